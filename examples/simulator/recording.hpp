// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The synthetic drive: two minutes around a base station, as the text of its four files.
///
///     tag, s     0 .. 58      open sky: standing, two bends, a stop at a light; phase events at 26, 34, 42 and 46 s
///               60 .. 90      a street between walls: satellites are blocked or arrive as reflections
///               98 .. 100     under a bridge: no satellite
///              101 .. 119     open sky, a bend, standing again
///
/// The rover's clock is 0.3 ms ahead, so its antenna at tag T is where the truth says it was 0.3 ms earlier.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>

#include "drive.hpp"
#include "orbit.hpp"
#include "receiver.hpp"
#include "rinex_writer.hpp"
#include "world.hpp"

namespace searvins::simulator {

inline constexpr std::uint64_t kBundledSeed = 20250611;  ///< of the recording in examples/data/synthetic_drive
inline constexpr int kEpochs = 120;
inline constexpr double kStreetBeginS = 60, kStreetEndS = 90, kBridgeBeginS = 97.5, kBridgeEndS = 100.5;

/// The four files.
struct Recording {
  std::string rover_obs, base_obs, nav_rnx, truth_csv;
};

/// Everything the recording is made from.
struct BundledScene {
  explicit BundledScene(std::uint64_t seed) : random(seed), orbits(make_satellites(start, random)) {}

  /// Antenna of the rover at GPS time, ECEF.
  [[nodiscard]] Eigen::Vector3d rover_e_m(double t_s) const { return frame.to_ecef(drive.position_w_m(t_s)); }

  GpsTime start = gps_from_civil({2025, 6, 11, 4, 20, 0});
  Random random;
  std::vector<Orbit> orbits;
  geodesy::LocalFrame frame =
      geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({48.1 * std::numbers::pi / 180, 11.5 * std::numbers::pi / 180, 560}));
  Eigen::Vector3d base_e_m = frame.to_ecef({-2400, 2700, 31});  ///< 3.6 km to the north-west
  Drive drive{{{10, 0, 0},
               {9, 12, 0},
               {8, 13, -70},
               {8, 14, 20},
               {8, 0, 0},
               {8, 0, 0},
               {9, 8, 40},
               {20, 7, 15},
               {10, 9, 0},
               {13, 13, 0},
               {7, 10, 60},
               {6, 0, 0},
               {10, 0, 0}}};
  Clock rover_clock{3.0e-4, 2.0e-7, 1.0e-9}, base_clock{-4.0e-5, -1.0e-8, 0};
};

/// The walls at GPS time: height swings between 8 and 16 m along the street.
[[nodiscard]] inline std::optional<Street> street_at(const BundledScene& scene, double t_s) {
  if (t_s < kStreetBeginS - 0.5 || t_s >= kStreetEndS + 0.5) return std::nullopt;
  return Street{scene.drive.heading_rad(t_s), 12 + 4 * std::sin(0.4 * t_s), 11, 7};
}

/// The satellite that stands n-th highest of its constellation at the start.
[[nodiscard]] inline int nth_highest(const BundledScene& scene, char system, std::size_t n) {
  std::vector<std::pair<double, int>> by_elevation;
  for (const Orbit& o : scene.orbits)
    if (o.system == system) by_elevation.emplace_back(-flight_of(o, scene.rover_e_m(0), 0).line.elevation_rad, o.number);
  std::sort(by_elevation.begin(), by_elevation.end());
  return by_elevation.at(n).second;
}

/// What goes wrong with the rover's phases in the open: a flagged slip, two that nobody flags, a half cycle that is resolved 4 s later.
[[nodiscard]] inline std::vector<PhaseEvent> phase_events(const BundledScene& scene) {
  return {{26, 1e9, 'G', nth_highest(scene, 'G', 2), "1C", 5, 1},
          {34, 1e9, 'E', nth_highest(scene, 'E', 1), "1C", 1, 0},
          {42, 1e9, 'C', nth_highest(scene, 'C', 2), "2I", -3, 0},
          {46, 50, 'G', nth_highest(scene, 'G', 3), "2W", 0.5, 2}};
}

[[nodiscard]] inline ReceiverPlan rover_plan(const BundledScene& scene) {
  ReceiverPlan plan;
  plan.position_e_m = [&scene](double t_s) { return scene.rover_e_m(t_s); };
  plan.street = [&scene](double t_s) { return street_at(scene, t_s); };
  plan.covered = [](double t_s) { return t_s >= kBridgeBeginS && t_s < kBridgeEndS; };
  plan.clock = scene.rover_clock;
  plan.mask_rad = 10 * std::numbers::pi / 180;
  plan.events = phase_events(scene);
  return plan;
}

[[nodiscard]] inline ReceiverPlan base_plan(const BundledScene& scene) {
  ReceiverPlan plan;
  plan.position_e_m = [&scene](double) { return scene.base_e_m; };
  plan.clock = scene.base_clock;
  plan.mask_rad = 10 * std::numbers::pi / 180;
  return plan;
}

/// Observation file of a receiver; an epoch without satellites is not written.
[[nodiscard]] inline std::string observation_file(const std::string& marker, const BundledScene& scene, Receiver& receiver,
                                                  const Eigen::Vector3d& header_e_m) {
  std::string text = observation_header(marker, header_e_m, scene.start);
  for (int k = 0; k < kEpochs; ++k) {
    const Epoch epoch = receiver.measure(k);
    if (!epoch.satellites.empty()) text += observation_epoch(epoch, scene.start);
  }
  return text;
}

/// Antenna of the rover at 5 Hz of GPS time, from 1 s before the first epoch to 1 s after the last.
[[nodiscard]] inline std::string truth_file(const BundledScene& scene) {
  std::string text = "gps_week,sow,ecef_x_m,ecef_y_m,ecef_z_m\n";
  for (int k = -5; k <= 5 * kEpochs; ++k) {
    const GpsTime t = scene.start.plus_seconds(0.2 * k);
    const Eigen::Vector3d p = scene.rover_e_m(0.2 * k);
    text += formatted("%d,%.1f,%.4f,%.4f,%.4f\n", static_cast<int>(t.week()), t.sow(), p.x(), p.y(), p.z());
  }
  return text;
}

/// The broadcast records of the satellites that base or rover could see.
[[nodiscard]] inline std::vector<Orbit> risen(const BundledScene& scene) {
  std::vector<Orbit> up;
  for (const Orbit& o : scene.orbits)
    if (flight_of(o, scene.base_e_m, 0).line.elevation_rad > 0) up.push_back(o);
  return up;
}

/// Makes the recording of a seed.
[[nodiscard]] inline Recording make_recording(std::uint64_t seed) {
  const BundledScene scene(seed);
  Receiver rover(rover_plan(scene), scene.orbits, seed + 1), base(base_plan(scene), scene.orbits, seed + 2);
  return {observation_file("ROVER", scene, rover, scene.rover_e_m(0)), observation_file("BASE", scene, base, scene.base_e_m),
          navigation_file(risen(scene)), truth_file(scene)};
}

}  // namespace searvins::simulator
