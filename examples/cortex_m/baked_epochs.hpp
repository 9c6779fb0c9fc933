// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The baked drive as an estimator takes it.
#pragma once

#include <Eigen/Core>

#include <iterator>

#include "examples/cortex_m/baked_drive.hpp"

namespace searvins::cortex_m {

inline constexpr int kEpochs = static_cast<int>(std::size(kRoverEpochs));
static_assert(std::size(kRoverEpochs) == std::size(kBaseEpochs) && std::size(kRoverEpochs) == std::size(kTruth),
              "rover, base and truth go together");

[[nodiscard]] inline Eigen::Vector3d position_of(const double (&xyz)[3]) { return {xyz[0], xyz[1], xyz[2]}; }

/// The rows of a baked epoch.
inline void unpack(const BakedEpoch& baked, const BakedSignal* rows, gnss::ObservationEpoch& out) {
  out.tag = GpsTime{baked.tag_ns}, out.satellites.clear();
  for (const BakedSignal* row = rows + baked.first; row != rows + baked.first + baked.count; ++row) {
    gnss::SatelliteId id;
    if (!gnss::constellation_from_letter(row->system, id.constellation)) continue;
    id.number = row->number;
    if (out.satellites.empty() || out.satellites.back().satellite != id) (void)out.satellites.push_back({id, {}});
    (void)out.satellites.back().signals.push_back({{id.constellation, row->band, row->attribute},
                                                   row->code_m,
                                                   row->phase_cycles,
                                                   row->doppler_hz,
                                                   static_cast<double>(row->cn0_dbhz),
                                                   row->loss_of_lock,
                                                   row->half_cycle});
  }
}

/// Broadcast records and the place of the base.
template <class Estimator>
[[nodiscard]] bool prepare(Estimator& rtk) {
  rtk.set_ionosphere(kIonosphere);
  for (const gnss::Ephemeris& e : kEphemerides)
    if (!rtk.add_ephemeris(e).ok()) return false;
  return rtk.set_base_position(position_of(kBasePosition)).ok();
}

}  // namespace searvins::cortex_m
