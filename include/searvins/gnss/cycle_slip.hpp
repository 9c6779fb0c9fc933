// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Is a carrier phase continuous since the previous epoch? Three tests on epoch-to-epoch *changes*, and the rule that combines them with
/// what the receivers say themselves.
///
/// All changes are in metres, of the rover-base single difference unless said otherwise: y = phase(k) - phase(k-1).
///
///   geometry-free    y_a - y_b of two frequencies of one satellite [Blewitt 1990]: geometry, clocks and troposphere cancel, the ionosphere
///                    barely moves. Blind where dN1 lambda_1 = dN2 lambda_2 nearly: (9,7), (5,4), (4,3) cycles. It cannot say which of two
///                    signals slipped, so both are suspect; of three the majority is believed.
///   common motion    what the motion of one antenna and one clock cannot explain: common_motion.hpp, on the single difference.
///   Doppler          the same test on the rover alone, with y = lambda (phi(k) - phi(k-1)) + lambda (D(k) + D(k-1)) dt / 2: the Doppler
///                    predicts the phase, and what the trapezoid misses (jerk) is again common motion.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace searvins::gnss {

/// What is known of a phase against the previous epoch.
enum class Continuity : std::uint8_t {
  verified,    ///< a test that would have seen a one-cycle slip saw none
  broken,      ///< a slip, a gap, or a first sight: the ambiguity is another number
  unverified,  ///< nothing speaks against it, but no test was able to
};

/// Why a continuity is not `verified`; `none` when it is.
enum class SlipCause : std::uint8_t {
  none,
  lli_rover,          ///< the rover reported loss of lock
  lli_base,           ///< the base reported loss of lock
  half_cycle,         ///< the half-cycle ambiguity is, or was, unresolved
  gap,                ///< no phase at the previous epoch, on either receiver
  geometry_free,      ///< the frequencies moved against each other
  doppler,            ///< the phase moved against its Doppler
  triple_difference,  ///< the phase moved against those of the other satellites
  first_epoch,        ///< never seen before
  single_frequency,   ///< not suspicious, but the policy or the data allow no verdict
  power_failure,      ///< a receiver reported a power failure
  base_changed,       ///< another base signal or another base position than before
};
inline constexpr std::size_t kSlipCauses = 12;  ///< number of SlipCause values

/// Name of a cause, for reports.
[[nodiscard]] constexpr const char* name_of(SlipCause cause) {
  constexpr const char* names[kSlipCauses] = {"none",        "LLI of rover",     "LLI of base",   "half cycle",
                                              "gap",         "geometry-free",    "Doppler",       "triple difference",
                                              "first epoch", "single frequency", "power failure", "base changed"};
  return names[static_cast<std::size_t>(cause)];
}

/// Outcome of one test for one signal.
enum class CheckResult : std::uint8_t { unavailable, passed, failed };

/// What to do with signals that the geometry-free test cannot see.
enum class SingleFrequencyPolicy : std::uint8_t {
  verify,        ///< common motion or Doppler may verify them
  always_fresh,  ///< never verified: a new ambiguity every epoch, as in the paper
};

/// What to do with a phase whose half-cycle ambiguity is unresolved.
enum class HalfCyclePolicy : std::uint8_t {
  drop,        ///< the phase is not used
  use_broken,  ///< used, but its continuity is broken at this and the next epoch
};

/// Thresholds. The changes are of phases, so a threshold must stay below half a wavelength (95 mm on L1) and above their noise.
struct CycleSlipOptions {
  double geometry_free_m{0.05};           ///< one cycle on both of L1 and L2 moves the difference by 54 mm
  double geometry_free_rate_mps{0.0005};  ///< added for every second of interval beyond the first: ionosphere
  bool common_motion{true};
  double common_motion_m{0.07};
  double common_motion_rate_mps{0.0005};       ///< likewise
  bool predicted_motion{false};                ///< common motion about a predicted displacement, where one is given and satellites alone say nothing
  double base_age_rate_mps{0.0015};            ///< added for every second by which the age of the base data changed: satellite clocks
  bool doppler{true};                          ///< where common motion gave no verdict
  double doppler_m{0.045}, doppler_mps{0.04};  ///< threshold doppler_m + doppler_mps dt: noise of the Doppler and jerk
  SingleFrequencyPolicy single_frequency{SingleFrequencyPolicy::verify};
  HalfCyclePolicy half_cycle{HalfCyclePolicy::drop};
  double interval_s{0};           ///< nominal interval of the rover; 0: the shortest seen so far
  double longest_interval_s{60};  ///< no continuity across more than this
};

/// Signals of one satellite that geometry_free_check() looks at.
inline constexpr std::size_t kMaxGeometryFree = 16;
/// Geometry-free test of one satellite: `change_m[i]` is the change of the phase of its signal i (NaN: none), on distinct carriers.
/// A signal passes when it belongs to the largest set that agrees within the threshold and that set is a majority (of two signals: both),
/// fails otherwise; unavailable when it has no partner.
inline void geometry_free_check(std::span<const double> change_m, double threshold_m, std::span<CheckResult> results) {
  const std::size_t n = std::min({change_m.size(), results.size(), kMaxGeometryFree});
  const auto agree = [&](std::size_t i, std::size_t j) { return std::abs(change_m[i] - change_m[j]) < threshold_m; };
  std::size_t present = 0, largest = 0, seed = 0;
  for (std::size_t i = 0; i < n; ++i) {
    results[i] = CheckResult::unavailable;
    if (!std::isfinite(change_m[i])) continue;
    ++present;
    std::size_t with = 0;
    for (std::size_t j = 0; j < n; ++j) with += std::isfinite(change_m[j]) && agree(i, j) ? 1U : 0U;
    if (with > largest) largest = with, seed = i;
  }
  if (present < 2) return;
  const bool majority = largest >= 2 && 2 * largest > present;
  for (std::size_t i = 0; i < n; ++i)
    if (std::isfinite(change_m[i])) results[i] = majority && agree(i, seed) ? CheckResult::passed : CheckResult::failed;
}

/// Everything that bears on the continuity of one phase.
struct ContinuityEvidence {
  bool known{false};                ///< the signal was seen before
  bool consecutive{false};          ///< with a usable phase at the previous epoch, and that is no more than one interval ago
  bool power_failure{false};        ///< of either receiver, since then
  bool loss_of_lock{false};         ///< of the rover, since then
  bool half_cycle{false};           ///< of the rover, then or now
  bool base_changed{false};         ///< another base signal or position
  SlipCause base{SlipCause::none};  ///< why the base phase does not continue; none: it does
  CheckResult geometry_free{CheckResult::unavailable};
  CheckResult common_motion{CheckResult::unavailable};
  CheckResult doppler{CheckResult::unavailable};
};

/// Continuity and its cause.
struct ContinuityVerdict {
  Continuity continuity{Continuity::broken};
  SlipCause cause{SlipCause::first_epoch};
};

/// The rule: what the receivers report goes first, then any failed test; then a passed one verifies, as far as the policy allows.
[[nodiscard]] constexpr ContinuityVerdict decide_continuity(const ContinuityEvidence& e, SingleFrequencyPolicy policy) {
  const auto broken = [](SlipCause cause) { return ContinuityVerdict{Continuity::broken, cause}; };
  if (!e.known) return broken(SlipCause::first_epoch);
  if (e.power_failure) return broken(SlipCause::power_failure);
  if (!e.consecutive) return broken(SlipCause::gap);
  if (e.loss_of_lock) return broken(SlipCause::lli_rover);
  if (e.half_cycle) return broken(SlipCause::half_cycle);
  if (e.base_changed) return broken(SlipCause::base_changed);
  if (e.base != SlipCause::none) return broken(e.base);
  if (e.geometry_free == CheckResult::failed) return broken(SlipCause::geometry_free);
  if (e.common_motion == CheckResult::failed) return broken(SlipCause::triple_difference);
  if (e.doppler == CheckResult::failed) return broken(SlipCause::doppler);
  const bool moved_along = e.common_motion == CheckResult::passed || e.doppler == CheckResult::passed;
  const bool verified = e.geometry_free == CheckResult::passed || (policy == SingleFrequencyPolicy::verify && moved_along);
  return verified ? ContinuityVerdict{Continuity::verified, SlipCause::none}
                  : ContinuityVerdict{Continuity::unverified, SlipCause::single_frequency};
}

}  // namespace searvins::gnss
