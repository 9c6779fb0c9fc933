// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// PPC-Dataset (Precise Positioning Challenge 2024), one folder a run, as nagoya/run1:
///
///     rover.obs, base.obs, base.nav    RINEX 3.04; rover 5 Hz, base 1 Hz
///     imu.csv          GPS TOW (s), GPS Week, Acc X..Z (m/s^2), Ang Rate X..Z (deg/s); 100 Hz, GPS time
///     reference.csv    GPS TOW (s), GPS Week, ..., ECEF X (m), ECEF Y (m), ECEF Z (m), ...: the antenna, 5 Hz
///
/// Axes. The publisher names them forward, right, down; the files that are in use read +9.8 m/s^2 on z at rest, which is up, with y to the
/// left. The sign of gravity decides: z up is forward, left, up, z down is forward, right, down. The lever arms are published in forward,
/// right, down either way, one a city (the table of the dataset's front page). The city is the one whose base station the header of
/// base.obs gives. The published position of its phase centre is used.
///
/// A rig.json in the folder (or --rig) stands for another vehicle.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include "examples/datasets/named_columns.hpp"
#include "examples/datasets/recording.hpp"

namespace searvins::examples {

namespace ppc {

/// Where the drives were.
struct City {
  const char* name;
  double base_lat_deg, base_lon_deg, base_height_m;  ///< phase centre of the base's antenna
  std::array<double, 3> lever_frd_m;                 ///< IMU to antenna: forward, right, down
};
inline constexpr std::array<City, 2> kCities{{{"Nagoya", 35.13470947, 136.97757427, 104.718, {0.593, -0.670, -1.216}},
                                              {"Tokyo", 35.66633426, 139.79220181, 59.82, {0.31, 0.0, -0.55}}}};

/// A published run: when it begins (GPS time) and how long it is.
struct Run {
  const char* name;
  CivilTime start;
  int seconds;
};
inline constexpr std::array<Run, 6> kRuns{{{"nagoya/run1", {2024, 8, 3, 8, 53, 0}, 1530},
                                           {"nagoya/run2", {2024, 7, 20, 10, 22, 0}, 1890},
                                           {"nagoya/run3", {2024, 8, 3, 9, 50, 0}, 1040},
                                           {"tokyo/run1", {2024, 7, 23, 4, 4, 30}, 2390},
                                           {"tokyo/run2", {2024, 7, 23, 1, 10, 0}, 1830},
                                           {"tokyo/run3", {2024, 7, 23, 1, 51, 0}, 3060}}};

/// The city whose base is within a kilometre of a point; nullptr for neither.
[[nodiscard]] inline const City* city_at(const Eigen::Vector3d& base_e_m) {
  for (const City& c : kCities)
    if ((dataset::ecef(c.base_lat_deg, c.base_lon_deg, c.base_height_m) - base_e_m).norm() < 1000) return &c;
  return nullptr;
}

/// Raw axes in right-forward-up.
[[nodiscard]] inline Eigen::Matrix3d axes(bool z_is_up) {
  Eigen::Matrix3d R;
  if (z_is_up)
    R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  else
    R << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return R;
}

/// The vehicle of a city. Noise: of the class of the ADIS16505-2 in a car, a few times the data sheet's at rest.
[[nodiscard]] inline Rig published_rig(const City& city, bool z_is_up) {
  Rig rig;
  RigImu imu;
  imu.rate_hz = 100;
  imu.R_b_raw = axes(z_is_up);
  imu.accel_noise_mps2_sqrt_hz = 1e-3, imu.gyro_noise_radps_sqrt_hz = 1e-4;
  imu.accel_bias_walk_mps3_sqrt_hz = 4e-5, imu.gyro_bias_walk_radps2_sqrt_hz = 4e-6;
  imu.accel_bias_sigma_mps2 = 0.05, imu.gyro_bias_sigma_radps = 3e-3;
  rig.imu = imu;
  rig.lever_arm_b_m = Eigen::Vector3d{city.lever_frd_m[1], city.lever_frd_m[0], -city.lever_frd_m[2]};
  rig.base_position_e_m = dataset::ecef(city.base_lat_deg, city.base_lon_deg, city.base_height_m);
  return rig;
}

/// Compares a recording with the run that it belongs to.
inline void note_run(const std::string& rover, const ObservationScan& scan, std::vector<std::string>& notes) {
  for (const Run& run : kRuns) {
    const GpsTime start = gps_from_civil(run.start);
    if (!scan.span.overlaps({start, start.plus_seconds(run.seconds)})) continue;
    const long epochs = static_cast<long>(scan.tags.size());
    if (epochs != 5L * run.seconds + 1)
      notes.push_back(dataset::file_name(rover) + ": " + std::to_string(epochs) + " epochs of " + run.name + ", " +
                      std::to_string(5L * run.seconds + 1) + " steps of 0.2 s as published: the missing ones are outages");
    return;
  }
  notes.push_back(dataset::file_name(rover) + ": none of the six published runs: " + dataset::span_text(scan.span));
}

/// The reading of z is mostly up.
[[nodiscard]] inline bool z_is_up(const io::ImuLog& log) {
  double sum = 0;
  for (const imu::ImuSample& s : log.samples) sum += s.accel_b_mps2.z();
  return sum > 0;
}

}  // namespace ppc

/// Reads a run's folder. Errors: see the file comment; each names the file and what to do.
[[nodiscard]] inline io::FileResult<DatasetRecording> read_ppc(const std::filesystem::path& folder, const DatasetChoice& choice = {}) {
  if (const DatasetFailure f = dataset::check_folder(folder, "rover.obs and the files beside it, as nagoya/run1")) return *f;
  DatasetRecording out;
  const auto given = dataset::given_rig(folder, choice, out);
  if (!given) return given.error();
  const std::string get = "get the run again from the PPC-Dataset page (docs/datasets.md); name the folder of one run, as nagoya/run1";
  auto rover = choice.rover.empty() ? dataset::find_file(folder, {"rover.obs"}, get) : io::FileResult<std::string>{choice.rover};
  auto base = choice.base.empty() ? dataset::find_file(folder, {"base.obs"}, get) : io::FileResult<std::string>{choice.base};
  auto nav = choice.nav.empty() ? dataset::find_file(folder, {"base.nav"}, get) : io::FileResult<std::string>{choice.nav.front()};
  for (const auto* file : {&rover, &base, &nav})
    if (!*file) return file->error();
  out.rover = *rover, out.base = *base, out.nav = choice.nav.empty() ? std::vector<std::string>{*nav} : choice.nav;

  const auto rover_scan = dataset::scan_observations(out.rover);
  if (!rover_scan) return rover_scan.error();
  const TimeSpan drive = rover_scan->span;
  io::RinexObservationReader base_reader;
  if (!base_reader.open(out.base)) return *base_reader.error();
  const auto& base_e_m = base_reader.header().approx_position_e_m;
  const ppc::City* city = base_e_m ? ppc::city_at(*base_e_m) : nullptr;
  if (!*given && !city)
    return io::Diagnostic{out.base, 0, "the base station is neither that of Nagoya nor that of Tokyo",
                          "give the published base.obs, or describe "
                          "your own vehicle in a rig.json beside it"};
  out.rig = *given ? **given : ppc::published_rig(*city, true);
  if (!*given) ppc::note_run(out.rover, *rover_scan, out.notes);

  if (choice.use_imu) {
    if (const DatasetFailure f = dataset::check_rig(out)) return *f;
    const auto imu = dataset::find_file(folder, {"imu.csv"}, get + ", or solve without it: --sensors gnss");
    if (!imu) return imu.error();
    io::FileResult<NamedReadings> readings = read_named_imu(*imu);
    if (!readings) return readings.error();
    for (const io::SkippedItem& item : readings->skipped.items())
      out.notes.push_back("imu.csv: " + item.reason + ", " + std::to_string(item.count) + " times, first at line " +
                          std::to_string(item.first_line));
    if (!*given) {
      const bool up = ppc::z_is_up(readings->log);
      out.rig = ppc::published_rig(*city, up);
      out.notes.push_back(std::string{"imu.csv: z is "} +
                          (up ? "up, so the axes are forward, left, up (the publisher names forward, right, down)"
                              : "down, so the axes are forward, right, down, as published"));
    }
    if (const auto scan = dataset::check_samples(*imu, readings->log, out.rig, drive, drive, out.notes); !scan) return scan.error();
    out.imu_text = DatasetText{"imu.csv", imu_csv(readings->log.samples)};
  }

  if (dataset::is_file(folder / "reference.csv")) {
    out.truth = (folder / "reference.csv").string();
    const auto truth = read_truth(out.truth, drive.first);
    if (!truth) return truth.error();
    if (const auto span = dataset::check_truth(out.truth, truth->points, drive); !span) return span.error();
  } else {
    out.notes.push_back("no reference.csv: nothing is scored");
  }
  return out;
}

}  // namespace searvins::examples
