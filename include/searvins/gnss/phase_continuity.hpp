// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The memory of one epoch of phases, and the comparison of the next one with it: the tests of cycle_slip.hpp and common_motion.hpp put to
/// work.
///
/// Order matters. `compare` looks at the previous epoch and changes nothing of it; `remember` makes the compared epoch the previous one. An
/// epoch that is refused in between leaves no trace, and the one after it finds a gap.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/base_buffer.hpp>
#include <searvins/gnss/common_motion.hpp>
#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/gnss/signal_pairing.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::gnss {

/// What the comparison needs of one signal at one epoch.
struct PhaseSample {
  SatelliteId satellite{};
  SignalPair pair{};
  double wavelength_m{0};
  double less_range_m{kMissing};   ///< corrected phase minus the range at the predicted position; NaN: no usable phase
  double rover_phase_m{kMissing};  ///< the rover's phase as observed
  double doppler_hz{kMissing};
  Eigen::Vector3d direction_e{Eigen::Vector3d::Zero()};  ///< d range / d p
  BaseArc base_arc{};
  bool loss_of_lock{false};  ///< of the rover
  bool half_cycle{false};    ///< of the rover
};

/// How far the antenna has moved since the previous epoch, from inertial readings.
struct PredictedDisplacement {
  Eigen::Vector3d displacement_e_m{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d covariance_e_m2{Eigen::Matrix3d::Identity()};
};

/// What the comparison needs of the epoch as a whole.
struct PhaseEpoch {
  GpsTime tag{};
  bool power_failure{false};
  double base_age_s{0};
  std::uint32_t base_revision{0};  ///< counts the positions of the base
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};  ///< predicted, where the ranges were computed
  std::optional<PredictedDisplacement> moved{};           ///< since the epoch that phases are compared with
};

/// Continuity of up to N phases from epoch to epoch.
template <std::size_t N>
class PhaseContinuity {
 public:
  using Samples = StaticVector<PhaseSample, N>;

  /// True once an epoch is remembered; `last_tag` is its tag.
  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] GpsTime last_tag() const { return epoch_.tag; }

  /// Compares an epoch (samples sorted by satellite) with the remembered one. `verdicts` gets one entry a sample.
  MotionFit compare(const PhaseEpoch& epoch, const Samples& samples, const CycleSlipOptions& options,
                    StaticVector<ContinuityVerdict, N>& verdicts) {
    const double dt_s = started_ ? seconds_between(epoch_.tag, epoch.tag) : 0;
    const double shortest_s = interval_s_ == 0 ? dt_s : std::min(interval_s_, dt_s);
    const double interval_s = options.interval_s > 0 ? options.interval_s : shortest_s;
    const bool consecutive = started_ && dt_s <= 1.5 * interval_s && dt_s <= options.longest_interval_s;
    const double extra_s = std::max(dt_s - 1, 0.0), age_change_s = std::abs(epoch.base_age_s - epoch_.base_age_s);

    evidence_.clear(), phase_change_m_.clear(), doppler_change_m_.clear();
    for (const PhaseSample& s : samples) gather(epoch, s, consecutive, dt_s);
    check_geometry_free(samples, options.geometry_free_m + options.geometry_free_rate_mps * (extra_s + age_change_s));
    MotionFit fit;
    if (options.common_motion) {
      collect(samples, phase_change_m_,
              options.common_motion_m + options.common_motion_rate_mps * extra_s + options.base_age_rate_mps * age_change_s);
      fit = common_motion_check(changes_, results_);
      if (!fit.valid && options.predicted_motion && epoch.moved && started_) {
        // The changes are less those between the two predicted positions; what is left of the displacement is the prior's mean.
        const Vector3& now_e_m = epoch.position_e_m;
        const Vector3 taken_out_m = now_e_m - epoch_.position_e_m;
        fit = predicted_motion_check(changes_, {epoch.moved->displacement_e_m - taken_out_m, epoch.moved->covariance_e_m2}, results_);
      }
      for (std::size_t i = 0; i < changes_.size(); ++i) evidence_[origin_[i]].common_motion = results_[i];
    }
    if (options.doppler) check_doppler(samples, options.doppler_m + options.doppler_mps * dt_s);

    verdicts.clear();
    for (const ContinuityEvidence& e : evidence_) verdicts.push_back(decide_continuity(e, options.single_frequency));
    return fit;
  }

  /// Makes an epoch the one that the next is compared with.
  void remember(const PhaseEpoch& epoch, const Samples& samples) {
    if (started_) {
      const double dt_s = seconds_between(epoch_.tag, epoch.tag);
      if (interval_s_ == 0 || dt_s < interval_s_) interval_s_ = dt_s;
    }
    started_ = true, epoch_ = epoch, previous_ = samples;
    for (const PhaseSample& s : samples) seen_of(s) = static_cast<std::uint8_t>(seen_of(s) | band_bit(s));
  }

 private:
  using Vector3 = math::Vector3<math::DeferredFor<double, N>>;

  /// What the receivers report of a signal, and its changes when nothing reported speaks against continuity.
  void gather(const PhaseEpoch& epoch, const PhaseSample& now, bool consecutive, double dt_s) {
    ContinuityEvidence e;
    double phase_m = kMissing, doppler_m = kMissing;
    const PhaseSample* before = nullptr;
    for (const PhaseSample& s : previous_)
      if (s.satellite == now.satellite && s.pair.rover == now.pair.rover) before = &s;
    e.known = (seen_of(now) & band_bit(now)) != 0;
    e.power_failure = epoch.power_failure;
    e.loss_of_lock = now.loss_of_lock;
    e.half_cycle = now.half_cycle;
    if (before) {
      e.half_cycle = e.half_cycle || before->half_cycle;
      e.consecutive =
          consecutive && (std::isfinite(before->less_range_m) || before->half_cycle) && (std::isfinite(now.less_range_m) || now.half_cycle);
      e.base_changed = before->pair.base != now.pair.base || epoch.base_revision != epoch_.base_revision;
      if (before->base_arc.number != now.base_arc.number)
        e.base = now.base_arc.cause == SlipCause::none ? SlipCause::gap : now.base_arc.cause;
      const bool reported =
          !e.consecutive || e.power_failure || e.loss_of_lock || e.half_cycle || e.base_changed || e.base != SlipCause::none;
      if (!reported) {
        phase_m = now.less_range_m - before->less_range_m;
        doppler_m = now.rover_phase_m - before->rover_phase_m + now.wavelength_m * 0.5 * (now.doppler_hz + before->doppler_hz) * dt_s;
      }
    }
    evidence_.push_back(e);
    phase_change_m_.push_back(phase_m);
    doppler_change_m_.push_back(doppler_m);
  }

  void check_geometry_free(const Samples& samples, double threshold_m) {
    for (std::size_t begin = 0; begin < samples.size();) {
      std::size_t end = begin;
      while (end < samples.size() && samples[end].satellite == samples[begin].satellite) ++end;
      std::array<CheckResult, kMaxGeometryFree> results{};
      geometry_free_check(std::span<const double>{phase_change_m_.data() + begin, end - begin}, threshold_m, results);
      for (std::size_t i = begin; i < end && i - begin < kMaxGeometryFree; ++i) evidence_[i].geometry_free = results[i - begin];
      begin = end;
    }
  }

  /// Doppler speaks only where common motion said nothing.
  void check_doppler(const Samples& samples, double threshold_m) {
    bool needed = false;
    for (std::size_t i = 0; i < samples.size(); ++i)
      needed = needed || (std::isfinite(doppler_change_m_[i]) && evidence_[i].common_motion == CheckResult::unavailable);
    if (!needed) return;
    collect(samples, doppler_change_m_, threshold_m);
    raise_thresholds_to_spread(changes_);
    (void)common_motion_check(changes_, results_);
    common_change_check(changes_, results_);
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      ContinuityEvidence& e = evidence_[origin_[i]];
      if (e.common_motion == CheckResult::unavailable) e.doppler = results_[i];
    }
  }

  void collect(const Samples& samples, const StaticVector<double, N>& change_m, double threshold_m) {
    changes_.clear(), origin_.clear(), results_.clear();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!std::isfinite(change_m[i])) continue;
      changes_.push_back({samples[i].satellite, samples[i].direction_e, change_m[i], threshold_m, samples[i].wavelength_m});
      origin_.push_back(static_cast<std::uint16_t>(i));
    }
  }

  [[nodiscard]] std::uint8_t& seen_of(const PhaseSample& s) {
    return seen_[static_cast<std::size_t>(s.satellite.constellation)][s.satellite.number & 63U];
  }
  [[nodiscard]] static std::uint8_t band_bit(const PhaseSample& s) {
    return static_cast<std::uint8_t>(1U << ((s.pair.rover.band - '1') & 7));
  }

  bool started_{false};
  PhaseEpoch epoch_{};
  double interval_s_{0};  // shortest step between remembered epochs
  Samples previous_{};
  std::array<std::array<std::uint8_t, 64>, kConstellations> seen_{};  // a bit a band

  StaticVector<ContinuityEvidence, N> evidence_{};  // of the comparison, like everything below
  StaticVector<double, N> phase_change_m_{}, doppler_change_m_{};
  StaticVector<PhaseChange, N> changes_{};
  StaticVector<std::uint16_t, N> origin_{};  // of a change among the samples
  StaticVector<CheckResult, N> results_{};
};

}  // namespace searvins::gnss
