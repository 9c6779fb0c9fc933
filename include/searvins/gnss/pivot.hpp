// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The pivot of a group of double differences: the one satellite that every other is subtracted from.
///
/// Eligible is who stands high (45 degrees) and is strong (30 dB-Hz) [paper section III-D: "high elevation and C/N0"]. Among the eligible
/// the strongest is best, then the highest. Pure arg-max flips often in streets, and a flip moves every ambiguity of the group; so the
/// previous pivot is kept while it is eligible, free of slips and within 3 dB of the best. Satellites whose phase is unusable, then those
/// whose phase has just slipped, stand behind the others. Where a receiver reports no C/N0, elevation alone decides.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include <searvins/gnss/signal.hpp>

namespace searvins::gnss {

/// How to choose a pivot.
struct PivotOptions {
  double min_elevation_rad{45.0 * std::numbers::pi / 180.0};
  double min_cn0_dbhz{30.0};
  bool hysteresis{true};      ///< false: the pure arg-max every epoch
  double hysteresis_db{3.0};  ///< the previous pivot may be this much weaker than the best
  bool allow_fallback{true};  ///< when none is eligible: the highest satellite of the group; false: the group is not used
};

/// What the choice looks at.
struct PivotCandidate {
  SatelliteId satellite{};
  double elevation_rad{0};
  double cn0_dbhz{0};  ///< NaN: not reported
  bool phase_usable{true};
  bool slipped{false};  ///< the continuity of its phase is broken at this epoch
};

/// Outcome: an index into the candidates, -1 when there is no pivot.
struct PivotChoice {
  int index{-1};
  bool fallback{false};  ///< not eligible, the highest there was
};

namespace detail {

/// Phase quality first: 0 usable and continuous, 1 usable after a slip, 2 code alone.
[[nodiscard]] inline int pivot_tier(const PivotCandidate& c) { return !c.phase_usable ? 2 : c.slipped ? 1 : 0; }

}  // namespace detail

/// Chooses the pivot among the candidates of one group. `previous` names the pivot of the epoch before (number 0: none). The outcome does
/// not depend on the order of the candidates: what is equal in every respect is decided by satellite number.
[[nodiscard]] inline PivotChoice choose_pivot(std::span<const PivotCandidate> candidates, SatelliteId previous,
                                              const PivotOptions& options = {}) {
  bool strength_known = true;
  for (const PivotCandidate& c : candidates) strength_known = strength_known && std::isfinite(c.cn0_dbhz);
  const auto eligible = [&](const PivotCandidate& c) {
    return c.elevation_rad >= options.min_elevation_rad && (!strength_known || c.cn0_dbhz >= options.min_cn0_dbhz);
  };
  const auto better = [&](const PivotCandidate& a, const PivotCandidate& b, bool by_strength) {
    const int ta = detail::pivot_tier(a), tb = detail::pivot_tier(b);
    if (ta != tb) return ta < tb;
    if (by_strength && a.cn0_dbhz != b.cn0_dbhz) return a.cn0_dbhz > b.cn0_dbhz;
    if (a.elevation_rad != b.elevation_rad) return a.elevation_rad > b.elevation_rad;
    return a.satellite < b.satellite;
  };

  PivotChoice choice;
  int highest = -1, before = -1;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const PivotCandidate& c = candidates[i];
    const int at = static_cast<int>(i);
    if (highest < 0 || better(c, candidates[static_cast<std::size_t>(highest)], false)) highest = at;
    if (!eligible(c)) continue;
    if (c.satellite == previous) before = at;
    if (choice.index < 0 || better(c, candidates[static_cast<std::size_t>(choice.index)], strength_known)) choice.index = at;
  }
  if (choice.index < 0) {
    if (options.allow_fallback) choice = {highest, highest >= 0};
    return choice;
  }
  if (options.hysteresis && before >= 0) {
    const PivotCandidate& kept = candidates[static_cast<std::size_t>(before)];
    const PivotCandidate& top = candidates[static_cast<std::size_t>(choice.index)];
    const bool close = !strength_known || kept.cn0_dbhz >= top.cn0_dbhz - options.hysteresis_db;
    if (detail::pivot_tier(kept) == 0 && close) choice.index = before;
  }
  return choice;
}

}  // namespace searvins::gnss
