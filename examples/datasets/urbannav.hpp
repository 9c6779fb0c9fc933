// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// UrbanNav, in the two forms in which it is published. Files are told apart by what they hold.
///
///     Hong Kong    UrbanNav-HK-*.obs      RINEX observations of one of the car's receivers
///                  any other RINEX        observations: a base station (SatRef, HKSC or HKKT); navigation: the day's, one file or several
///                  xsense_imu_*.csv       ROS columns: field.header.stamp (UTC nanoseconds), field.angular_velocity.x, ...; 400 Hz
///                  UrbanNav_*_raw.txt     UTCTime Week GPSTime, latitude and longitude in degrees, minutes, seconds, H-Ell, ..., Roll
///                                         Pitch Heading: the SPAN-CPT, 1 Hz
///     Tokyo        rover_trimble.obs or rover_ublox.obs, base_trimble.obs, base.nav, imu.csv, reference.csv
///
/// Hong Kong. The axes of IMU and SPAN are right, forward, up; the SPAN is 0.14 m above the IMU. The antennas are published by hand, to a
/// decimetre: those of the receivers 0.86 m ahead of the IMU and 0.31 m below it; the one that f9p.splitter shares with the SPAN 0.56 m
/// behind the SPAN and 0.07 m below. The truth is moved from the SPAN to the antenna, with R = R_z(-h) R_x(p) R_y(r) from right-forward-up
/// to east-north-up:
///
///     p_antenna = p_span + R_e_enu R (r_antenna - r_span)
///
/// Its gyr_n and acc_n are standard deviations of single readings; divided by the square root of the rate they are the densities below.
///
/// Tokyo. No lever arm is published, so the inertial unit is used only with a rig.json that has one (axes there: forward, right, down).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/io/file_kind.hpp>

#include "examples/datasets/named_columns.hpp"
#include "examples/datasets/recording.hpp"

namespace searvins::examples {

namespace urbannav {

inline const Eigen::Vector3d kSpan_b_m{0, 0, 0.14};               ///< IMU to SPAN-CPT
inline const Eigen::Vector3d kFrontAntenna_b_m{0, 0.86, -0.31};   ///< IMU to the antennas of the receivers
inline const Eigen::Vector3d kSharedAntenna_b_m{0, -0.56, 0.07};  ///< IMU to the antenna of the SPAN

/// The car of Hong Kong.
[[nodiscard]] inline Rig hong_kong_rig(bool is_shared_antenna) {
  Rig rig;
  RigImu imu;
  imu.rate_hz = 400;
  imu.accel_noise_mps2_sqrt_hz = 1e-3, imu.gyro_noise_radps_sqrt_hz = 5.2e-4;
  imu.accel_bias_walk_mps3_sqrt_hz = 1.2e-4, imu.gyro_bias_walk_radps2_sqrt_hz = 1.2e-5;
  imu.accel_bias_sigma_mps2 = 0.05, imu.gyro_bias_sigma_radps = 3.5e-3;
  rig.imu = imu;
  rig.lever_arm_b_m = is_shared_antenna ? kSharedAntenna_b_m : kFrontAntenna_b_m;
  return rig;
}

/// East-north-up axes from right-forward-up ones, degrees; heading clockwise from north.
[[nodiscard]] inline Eigen::Matrix3d enu_from_rfu(double roll_deg, double pitch_deg, double heading_deg) {
  constexpr double rad = std::numbers::pi / 180;
  return (Eigen::AngleAxisd(-heading_deg * rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch_deg * rad, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(roll_deg * rad, Eigen::Vector3d::UnitY()))
      .toRotationMatrix();
}

/// One row of the truth: the point `offset_b_m` from the SPAN; an empty text on success, else what is wrong.
[[nodiscard]] inline std::string read_truth_row(std::string_view line, const Eigen::Vector3d& offset_b_m, TruthPoint& point) {
  const std::vector<std::string_view> words = io::split_words(line);
  if (words.size() < 19) return "the row is cut short: 19 fields from UTCTime to Heading are needed";
  std::array<double, 19> x{};
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!io::parse_number(words[i], x[i])) return "'" + std::string{words[i]} + "' is not a number";
  if (x[1] != std::floor(x[1]) || x[1] < 0 || x[1] > 9999 || x[2] < 0 || x[2] > 2 * static_cast<double>(kSecondsPerWeek))
    return "Week and GPSTime are no GPS time";
  point.time = GpsTime::from_week_sow(static_cast<std::int64_t>(x[1]), x[2]);
  const double apart_s = seconds_between(point.time, to_gps(UtcTime{nanoseconds_from_seconds(x[0])}));
  if (std::abs(apart_s) > 0.5)
    return "UTCTime and GPSTime disagree by " + io::fixed_text(apart_s, 1) + " s beyond the leap seconds: a wrong week or a changed column";
  const auto degrees = [&](std::size_t i) {
    const double sign = words[i].starts_with('-') ? -1 : 1;
    return sign * (std::abs(x[i]) + x[i + 1] / 60 + x[i + 2] / 3600);
  };
  if (std::abs(degrees(3)) > 90 || std::abs(degrees(6)) > 360) return "latitude or longitude lies outside its range";
  const Eigen::Vector3d span_e_m = dataset::ecef(degrees(3), degrees(6), x[9]);
  const Eigen::Matrix3d R_e_enu = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(span_e_m));
  point.p_e_m = span_e_m + R_e_enu * enu_from_rfu(x[16], x[17], x[18]) * offset_b_m;
  return {};
}

/// Reads the truth of Hong Kong. Errors: a row that cannot be read (with its line), time that does not rise, no row.
[[nodiscard]] inline io::FileResult<std::vector<TruthPoint>> read_span_truth(const std::string& path, const Eigen::Vector3d& offset_b_m) {
  io::TextReader reader;
  if (auto wrong = reader.open(path)) return *wrong;
  std::vector<TruthPoint> points;
  std::string_view line;
  while (reader.next(line)) {
    const std::string_view row = io::trimmed(line);
    if (row.empty() || !(std::isdigit(static_cast<unsigned char>(row.front())) || row.front() == '-')) continue;
    TruthPoint point;
    std::string wrong = read_truth_row(row, offset_b_m, point);
    if (wrong.empty() && !points.empty() && point.time <= points.back().time) wrong = "time does not rise";
    if (!wrong.empty()) return io::Diagnostic{path, reader.line_number(), wrong, "get the file again (docs/datasets.md)"};
    points.push_back(point);
  }
  if (points.empty()) return io::Diagnostic{path, 0, "has no row of the truth", "get the file again (docs/datasets.md)"};
  return points;
}

/// The files of a Hong Kong folder by what they hold.
struct Found {
  std::vector<std::string> rovers, bases, nav, imus, truths;
};
[[nodiscard]] inline Found find_files(const std::filesystem::path& folder) {
  Found found;
  for (const std::filesystem::path& file : dataset::files_of(folder)) {
    const io::FileKind kind = io::sniff(file).kind;
    std::string name = file.filename().string();
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (kind == io::FileKind::rinex_navigation) found.nav.push_back(file.string());
    if (kind == io::FileKind::rinex_observation) (name.starts_with("urbannav") ? found.rovers : found.bases).push_back(file.string());
    io::TextReader reader;
    std::string_view line;
    if (reader.open(file) || !reader.next(line)) continue;
    if (line.find("field.angular_velocity.x") != line.npos) found.imus.push_back(file.string());
    if (line.find("UTCTime") != line.npos && line.find("H-Ell") != line.npos) found.truths.push_back(file.string());
  }
  const auto is_phone = [](const std::string& file) { return dataset::file_name(file).find("xsens") == std::string::npos; };
  if (!std::all_of(found.imus.begin(), found.imus.end(), is_phone))
    std::erase_if(found.imus, is_phone);  // the telephones' have the same columns
  return found;
}

/// The one file of its sort, or a Diagnostic that says why there is none or too many.
[[nodiscard]] inline io::FileResult<std::string> only(const std::filesystem::path& folder, const std::vector<std::string>& files,
                                                      const char* what, const char* option, const std::string& what_to_do) {
  if (files.size() == 1) return files.front();
  if (files.empty()) return io::Diagnostic{folder.string(), 0, std::string{"there is no "} + what + " in it", what_to_do};
  std::string names;
  for (const std::string& file : files) (names += names.empty() ? "" : ", ") += dataset::file_name(file);
  return io::Diagnostic{folder.string(), 0, "there is more than one " + std::string{what} + " in it: " + names,
                        *option ? std::string{"name one with "} + option + " FILE" : "leave one of them"};
}

/// Rover: of several the receiver with the most signals whose antenna is published, by name.
[[nodiscard]] inline io::FileResult<std::string> choose_rover(const std::filesystem::path& folder, const std::vector<std::string>& rovers) {
  for (const char* part : {"f9p.splitter", "f9p", "novatel"})
    for (const std::string& rover : rovers)
      if (rover.find(part) != rover.npos) return rover;
  return only(folder, rovers, "observation file of the car (UrbanNav-HK-*.obs)", "--rover",
              "get the GNSS folder of the sequence (docs/datasets.md)");
}

[[nodiscard]] inline io::FileResult<DatasetRecording> read_hong_kong(const std::filesystem::path& folder, const DatasetChoice& choice) {
  DatasetRecording out;
  const auto given = dataset::given_rig(folder, choice, out);
  if (!given) return given.error();
  const Found found = find_files(folder);
  const auto rover = choice.rover.empty() ? choose_rover(folder, found.rovers) : io::FileResult<std::string>{choice.rover};
  if (!rover) return rover.error();
  const auto base = choice.base.empty()
                        ? only(folder, found.bases, "observation file of a base station", "--base",
                               "get the RINEX of HKSC or HKKT of the day and hour from SatRef, unpack it with crx2rnx and put it here")
                        : io::FileResult<std::string>{choice.base};
  if (!base) return base.error();
  if (found.nav.empty() && choice.nav.empty())
    return io::Diagnostic{folder.string(), 0, "there is no broadcast navigation file in it",
                          "get the day's navigation RINEX from SatRef or an IGS data centre"};
  out.rover = *rover, out.base = *base, out.nav = choice.nav.empty() ? found.nav : choice.nav;
  const auto rover_scan = dataset::scan_observations(out.rover);
  if (!rover_scan) return rover_scan.error();
  const TimeSpan drive = rover_scan->span;
  out.rig = *given ? **given : hong_kong_rig(out.rover.find("splitter") != out.rover.npos);

  if (choice.use_imu) {
    if (const DatasetFailure f = dataset::check_rig(out)) return *f;
    const auto imu = only(folder, found.imus, "IMU log with the columns field.angular_velocity.x ...", "",
                          "get xsense_imu_*.csv of the sequence, or solve without it: --sensors gnss");
    if (!imu) return imu.error();
    io::FileResult<NamedReadings> readings = read_named_imu(*imu);
    if (!readings) return readings.error();
    for (const io::SkippedItem& item : readings->skipped.items())
      out.notes.push_back(dataset::file_name(*imu) + ": " + item.reason + ", " + std::to_string(item.count) + " times, first at line " +
                          std::to_string(item.first_line));
    if (const auto scan = dataset::check_samples(*imu, readings->log, out.rig, drive, drive, out.notes); !scan) return scan.error();
    out.imu_text = DatasetText{"imu.csv", imu_csv(readings->log.samples)};
  }
  if (found.truths.empty()) {
    out.notes.push_back("no UrbanNav_*_raw.txt: nothing is scored");
    return out;
  }
  const Eigen::Vector3d antenna_b_m = out.rig.lever_arm_b_m ? Eigen::Vector3d{out.rig.R_rfu_b * *out.rig.lever_arm_b_m} : kSpan_b_m;
  const auto truth = read_span_truth(found.truths.front(), antenna_b_m - kSpan_b_m);
  if (!truth) return truth.error();
  if (const auto span = dataset::check_truth(found.truths.front(), *truth, drive); !span) return span.error();
  out.truth_text = DatasetText{"truth.csv", truth_csv(*truth)};
  out.notes.push_back(dataset::file_name(found.truths.front()) + ": moved from the SPAN-CPT to the antenna");
  return out;
}

[[nodiscard]] inline io::FileResult<DatasetRecording> read_tokyo(const std::filesystem::path& folder, const DatasetChoice& choice) {
  DatasetRecording out;
  const auto given = dataset::given_rig(folder, choice, out);
  if (!given) return given.error();
  const std::string get = "get Tokyo_Data.zip again and name the folder of one run, Odaiba or Shinjuku (docs/datasets.md)";
  auto rover = choice.rover.empty() ? dataset::find_file(folder, {"rover_trimble.obs", "rover_ublox.obs"}, get)
                                    : io::FileResult<std::string>{choice.rover};
  auto base = choice.base.empty() ? dataset::find_file(folder, {"base_trimble.obs"}, get) : io::FileResult<std::string>{choice.base};
  auto nav = choice.nav.empty() ? dataset::find_file(folder, {"base.nav"}, get) : io::FileResult<std::string>{choice.nav.front()};
  for (const auto* file : {&rover, &base, &nav})
    if (!*file) return file->error();
  out.rover = *rover, out.base = *base, out.nav = choice.nav.empty() ? std::vector<std::string>{*nav} : choice.nav;
  const auto rover_scan = dataset::scan_observations(out.rover);
  if (!rover_scan) return rover_scan.error();
  const TimeSpan drive = rover_scan->span;
  if (*given) out.rig = **given;
  if (choice.use_imu && !*given)
    out.notes.push_back("no lever arm is published for Tokyo: solved without imu.csv; a rig.json with one uses it");
  if (choice.use_imu && *given) {
    if (const DatasetFailure f = dataset::check_rig(out)) return *f;
    const auto imu = dataset::find_file(folder, {"imu.csv"}, get + ", or solve without it: --sensors gnss");
    if (!imu) return imu.error();
    io::FileResult<NamedReadings> readings = read_named_imu(*imu);
    if (!readings) return readings.error();
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

}  // namespace urbannav

/// Reads a folder. Errors: see the file comment; each names the file and what to do.
[[nodiscard]] inline io::FileResult<DatasetRecording> read_urbannav(const std::filesystem::path& folder, const DatasetChoice& choice = {}) {
  if (const DatasetFailure f = dataset::check_folder(folder, "the RINEX files, the IMU log and the truth of one drive")) return *f;
  const bool is_tokyo = dataset::is_file(folder / "rover_trimble.obs") || dataset::is_file(folder / "rover_ublox.obs");
  return is_tokyo ? urbannav::read_tokyo(folder, choice) : urbannav::read_hong_kong(folder, choice);
}

}  // namespace searvins::examples
