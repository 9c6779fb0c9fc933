// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Codes of one receiver, corrected by broadcast models instead of a base, in the groups that a difference factor takes.
///
/// A code less the satellite's clock and group delay, less the modelled ionosphere and troposphere, obeys
///
///     z_s = h_s(p) + c_g + e_s        h: range with Sagnac term, c_g: receiver clock of the satellite's constellation and carrier, metres
///
/// There is one clock a constellation (and carrier, which takes the receiver's delay between carriers with it) and epoch, of which nothing is known
/// before. The difference to a pivot o takes it out, and says no less than z_s and a free clock do: with the pivot error e_o as variable,
///
///     min over e_o   rho(e_o / sigma_o)  +  sum_s rho((z_s - z_o - (h_s - h_o) + e_o) / sigma_s)
///
/// is the cost of all codes under the clock c_g = z_o - h_o - e_o. That is the symmetric latent-pivot form: each code has a robust weight of its own.
/// So DifferenceFactor, made for rover and base, serves a rover alone, and the pivot error is its clock.
///
/// What differs is the variance: models leave metres that a base would take away, and leave them for minutes.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/single_point_problem.hpp>
#include <searvins/gnss/single_point_solution.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::gnss {

namespace detail {

/// The group of a code among those that are there, a new one when it is the first of its kind; nullptr when there is no room.
inline SignalGroup* undifferenced_group(const CorrectedSignal& s, DifferencedEpoch& out) {
  for (SignalGroup& g : out.groups)
    if (same_carrier(g.rover_signal, s.rover_signal)) return &g;
  SignalGroup g;
  g.rover_signal = g.base_signal = s.rover_signal;
  g.wavelength_m = s.wavelength_m;
  return out.groups.push_back(g) ? &out.groups.back() : nullptr;
}

[[nodiscard]] inline CorrectedSignal undifferenced_signal(const CodeRow& row) {
  CorrectedSignal s;
  s.satellite = row.satellite;
  s.rover_signal = s.base_signal = row.signal;
  s.wavelength_m = wavelength_m(row.signal);
  s.code_m = row.corrected_m - row.atmosphere_m;
  s.code_variance_m2 = row.sigma_m * row.sigma_m;
  s.elevation_rad = row.elevation_rad, s.azimuth_rad = row.azimuth_rad, s.cn0_dbhz = row.cn0_dbhz;
  s.satellite_e_m = row.transmission.state.position_e_m;
  return s;
}

/// Distinct satellites in the groups of an epoch whose signals stand by satellite.
[[nodiscard]] inline int satellites_in_groups(const DifferencedEpoch& epoch) {
  std::array<bool, kMaxCorrectedSignals> used{};
  for (const SignalGroup& g : epoch.groups) {
    used[static_cast<std::size_t>(g.pivot)] = true;
    for (const std::uint16_t c : g.candidates) used[c] = true;
  }
  int count = 0;
  const CorrectedSignal* last = nullptr;
  for (std::size_t i = 0; i < epoch.signals.size(); ++i) {
    if (!used[i]) continue;
    count += !last || last->satellite != epoch.signals[i].satellite ? 1 : 0;
    last = &epoch.signals[i];
  }
  return count;
}

}  // namespace detail

/// Replaces signals, groups and the number of satellites of `out` by the codes of `rover` alone; its Doppler shifts, reports and status stay. No phases.
/// Each group has its highest satellite as pivot; a code that has its group for itself is left out. `predicted_rover_e_m`: antenna, ECEF, good to some
/// hundred metres. `codes` is room to work in. Sigmas, screens and signals are those of `options`.
template <std::size_t E>
void undifference(const ObservationEpoch& rover, const EphemerisStore<E>& store, const Eigen::Vector3d& predicted_rover_e_m, const SinglePointOptions& options,
                  SinglePointSolution& codes, DifferencedEpoch& out) {
  out.signals.clear(), out.groups.clear();
  out.satellites = 0;
  codes.rows.clear();
  using Scalar = math::DeferredFor<double, E>;
  const std::optional<BasicSinglePointPrior<Scalar>> no_prior;  // the problem keeps a reference
  detail::BasicSinglePointProblem<Scalar> problem(options, no_prior, codes);
  problem.collect(rover, store);
  problem.place(predicted_rover_e_m);
  for (const CodeRow& row : codes.rows) {
    if (row.fate != CodeFate::used) continue;
    const CorrectedSignal s = detail::undifferenced_signal(row);
    SignalGroup* const group = detail::undifferenced_group(s, out);
    const int index = static_cast<int>(out.signals.size());
    if (!group || group->candidates.full() || !out.signals.push_back(s)) continue;
    const bool is_highest = group->pivot < 0 || s.elevation_rad > out.signals[static_cast<std::size_t>(group->pivot)].elevation_rad;
    const int candidate = is_highest ? group->pivot : index;
    if (is_highest) group->pivot = index;
    if (candidate >= 0) (void)group->candidates.push_back(static_cast<std::uint16_t>(candidate));
  }
  out.groups.erase_if([](const SignalGroup& g) { return g.candidates.empty(); });
  out.satellites = detail::satellites_in_groups(out);
}

}  // namespace searvins::gnss
