// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A recording in the folder of a published dataset: what a reader of such a folder (texcup.hpp, ppc.hpp, urbannav.hpp) finds in it, and
/// the checks that all of them make.
///
/// A reader gives back names of files that the readers of the library understand, the vehicle as a Rig in right-forward-up axes, and texts
/// for what had to be converted. It refuses what cannot be solved, with file and line, and says what to do; counts and times that differ
/// from the published ones are notes with both numbers. All spans are GPS time.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/imu_check.hpp>
#include <searvins/io/imu_log.hpp>
#include <searvins/io/rinex_observation.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/support/rig.hpp"
#include "examples/support/truth.hpp"

namespace searvins::examples {

/// What a user chooses of a folder.
struct DatasetChoice {
  std::string rover, base, rig;  ///< instead of those that the reader would take; empty: its own
  std::vector<std::string> nav;  ///< the same
  bool use_imu{true}, use_camera{true};
};

/// A file that the runner writes beside the results, because no reader knows the published form: a relative name and its content.
struct DatasetText {
  std::string name, text;
};

/// A folder of pictures that lacks the calibration: the runner makes one beside the results with these sensor.yaml and links to the
/// pictures of `folder`.
struct PictureView {
  std::string folder;
  std::array<std::string, 2> sensor_yaml;  ///< cam0, cam1
};

/// What a run needs. Empty names: there is none.
struct DatasetRecording {
  std::string rover, base;
  std::vector<std::string> nav;
  std::string imu, truth, tracks, images;  ///< in forms that the library reads
  Rig rig{};
  std::string rig_file;                             ///< where `rig` comes from; empty: the published calibration
  std::optional<DatasetText> imu_text, truth_text;  ///< converted, instead of imu and truth
  std::optional<PictureView> pictures;              ///< instead of images
  std::optional<GpsTime> start, end;                ///< the published scoring window, inclusive; nothing: the whole recording
  std::vector<std::string> notes;
};

using DatasetFailure = std::optional<io::Diagnostic>;

/// First and last time of a stream.
struct TimeSpan {
  GpsTime first{}, last{};
  [[nodiscard]] bool overlaps(const TimeSpan& other) const { return first <= other.last && other.first <= last; }
  [[nodiscard]] bool contains(GpsTime t) const { return first <= t && t <= last; }
};

/// Epochs and signals of an observation file.
struct ObservationScan {
  io::RinexObservationHeader header;
  TimeSpan span{};
  std::vector<GpsTime> tags;
  std::vector<gnss::SignalCode> signals;  ///< that occur, each once, sorted
  [[nodiscard]] long count_in(const TimeSpan& window) const {
    return static_cast<long>(std::count_if(tags.begin(), tags.end(), [&](GpsTime t) { return window.contains(t); }));
  }
  /// Median step, seconds; 0 for fewer than two tags.
  [[nodiscard]] double interval_s() const {
    std::vector<std::int64_t> steps;
    for (std::size_t i = 1; i < tags.size(); ++i) steps.push_back(tags[i].ns - tags[i - 1].ns);
    if (steps.empty()) return 0;
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return static_cast<double>(*middle) * 1e-9;
  }
};

namespace dataset {

/// "2019-05-09 18:09:58 (GPS week 2052, sow 410998.0)".
[[nodiscard]] inline std::string time_text(GpsTime t) {
  const CivilTime c = civil_from_gps(t);
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "%04d-%02d-%02d %02d:%02d:%02d (GPS week %lld, sow %.1f)", c.year, c.month, c.day, c.hour, c.minute,
                static_cast<int>(c.second), static_cast<long long>(t.week()), t.sow());
  return buffer;
}
[[nodiscard]] inline std::string span_text(const TimeSpan& s) { return time_text(s.first) + " to " + time_text(s.last); }

[[nodiscard]] inline std::string signals_text(const std::vector<gnss::SignalCode>& signals) {
  std::string text;
  for (const gnss::SignalCode& s : signals) {
    if (!text.empty()) text += ',';
    text += {gnss::letter_of(s.constellation), s.band, s.attribute};
  }
  return text.empty() ? "none" : text;
}

[[nodiscard]] inline bool is_file(const std::filesystem::path& path) {
  std::error_code failed;
  return std::filesystem::is_regular_file(path, failed);
}
[[nodiscard]] inline bool is_folder(const std::filesystem::path& path) {
  std::error_code failed;
  return std::filesystem::is_directory(path, failed);
}
[[nodiscard]] inline std::string file_name(const std::string& path) { return std::filesystem::path{path}.filename().string(); }

/// The files of a folder, not of those below it, sorted by name.
[[nodiscard]] inline std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code failed;
  for (std::filesystem::directory_iterator at{folder, failed}, end; !failed && at != end; at.increment(failed))
    if (is_file(at->path())) files.push_back(at->path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Refuses what is no folder.
[[nodiscard]] inline DatasetFailure check_folder(const std::filesystem::path& folder, const char* what_it_holds) {
  if (is_folder(folder)) return std::nullopt;
  return io::Diagnostic{folder.string(), 0, is_file(folder) ? "is a file, not the folder of a recording" : "no such folder",
                        std::string{"name the folder that holds "} + what_it_holds};
}

/// The first of these names that is a file of the folder; else a Diagnostic that says where it comes from.
[[nodiscard]] inline io::FileResult<std::string> find_file(const std::filesystem::path& folder, const std::vector<std::string>& names,
                                                           const std::string& what_to_do) {
  for (const std::string& name : names)
    if (is_file(folder / name)) return (folder / name).string();
  std::string listed;
  for (const std::string& name : names) (listed += listed.empty() ? "" : " or ") += name;
  return io::Diagnostic{folder.string(), 0, "there is no " + listed + " in it", what_to_do};
}

/// Number of the first line of a text file that is neither empty nor a comment; 0 where there is none.
[[nodiscard]] inline long first_row_line(const std::string& path) {
  io::TextReader reader;
  if (reader.open(path)) return 0;
  std::string_view line;
  double number = 0;
  while (reader.next(line)) {
    line = io::trimmed(line);
    if (line.empty() || line.front() == '#' || line.front() == '%') continue;
    const std::string_view first = line.substr(0, line.find_first_of(", \t/"));
    if (io::parse_number(first, number)) return reader.line_number();
  }
  return 0;
}

/// Reads all tags of an observation file. Errors: what the reader refuses, no epoch.
[[nodiscard]] inline io::FileResult<ObservationScan> scan_observations(const std::string& path) {
  io::RinexObservationReader reader;
  if (!reader.open(path)) return *reader.error();
  ObservationScan scan;
  gnss::ObservationEpoch epoch;
  while (reader.next(epoch)) {
    scan.tags.push_back(epoch.tag);
    for (const gnss::SatelliteObservation& satellite : epoch.satellites)
      for (const gnss::SignalObservation& s : satellite.signals) {
        const auto at = std::lower_bound(scan.signals.begin(), scan.signals.end(), s.signal);
        if (at == scan.signals.end() || *at != s.signal) scan.signals.insert(at, s.signal);
      }
  }
  if (scan.tags.empty()) return reader.error() ? *reader.error() : io::Diagnostic{path, 0, "holds no usable epoch", {}};
  scan.header = reader.header();
  scan.span = {scan.tags.front(), scan.tags.back()};
  return scan;
}

/// Refuses a stream whose times do not meet the rover's. `path` begins with a week or a date; `what`: "readings", "rows".
[[nodiscard]] inline DatasetFailure check_overlap(const std::string& path, const char* what, const TimeSpan& span, const TimeSpan& rover,
                                                  const std::string& what_to_do) {
  if (span.overlaps(rover)) return std::nullopt;
  const bool is_week = span.first.week() != rover.first.week();
  return io::Diagnostic{path, first_row_line(path),
                        std::string{is_week ? "is of another week than the rover: " : "is of another time than the rover: "} + what +
                            " from " + span_text(span) + ", rover from " + span_text(rover),
                        what_to_do};
}

/// A note when a count is not the published one.
inline void note_count(std::vector<std::string>& notes, const std::string& path, const std::string& what, long found, long published) {
  if (found != published)
    notes.push_back(file_name(path) + ": " + std::to_string(found) + ' ' + what + ", " + std::to_string(published) + " as published");
}

/// The span of an IMU log whose numbers are usable, and how many rows lie in a window. Errors: what the reader refuses; columns exchanged,
/// no gravity, gravity on a wrong axis; another time than the rover's.
struct ImuScan {
  TimeSpan span{};
  long in_window{0};
  double interval_s{0};
};
[[nodiscard]] inline io::FileResult<ImuScan> check_samples(const std::string& path, const io::ImuLog& log, const Rig& rig,
                                                           const TimeSpan& rover, const TimeSpan& window, std::vector<std::string>& notes) {
  const std::string what_to_do = "give the log of this drive, stamped with GPS time";
  for (const io::ImuFinding& finding : log.findings) {
    using enum io::ImuFault;
    if (finding.fault == columns_exchanged || finding.fault == gravity_missing || finding.fault == accel_magnitude) {
      io::Diagnostic text = finding.text;
      text.file = path, text.line = first_row_line(path);
      return text;
    }
  }
  const TimeSpan span{log.samples.front().time, log.samples.back().time};
  if (const DatasetFailure f = check_overlap(path, "readings", span, rover, what_to_do)) return *f;
  std::vector<imu::ImuSample> turned = log.samples;
  const Eigen::Matrix3d R_rfu_raw = rig.R_rfu_b * rig.imu->R_b_raw;
  io::turn_axes(turned, R_rfu_raw);
  if (const auto axis = io::check_gravity_axis(turned, R_rfu_raw, path)) {
    io::Diagnostic text = axis->text;
    text.line = first_row_line(path);
    text.hint =
        "the columns are not in the published order or the axes not as published: get the file again, or give a rig.json with --rig";
    return text;
  }
  if (const auto rate = io::check_imu_rate(log.interval_s, rig.imu->rate_hz, path))
    notes.push_back(file_name(path) + ": " + rate->text.message);
  ImuScan scan{span, 0, log.interval_s};
  for (const imu::ImuSample& s : log.samples) scan.in_window += window.contains(s.time) ? 1 : 0;
  return scan;
}

/// Span of a truth; refuses one of another time than the rover's.
[[nodiscard]] inline io::FileResult<TimeSpan> check_truth(const std::string& path, const std::vector<TruthPoint>& points,
                                                          const TimeSpan& rover) {
  const TimeSpan span{points.front().time, points.back().time};
  if (const DatasetFailure f = check_overlap(path, "rows", span, rover,
                                             "give the reference trajectory of this drive, or take the file away to solve without one"))
    return *f;
  return span;
}

/// The rig that the user or the folder gives instead of the published one; nothing when neither does.
[[nodiscard]] inline io::FileResult<std::optional<Rig>> given_rig(const std::filesystem::path& folder, const DatasetChoice& choice,
                                                                  DatasetRecording& out) {
  out.rig_file = !choice.rig.empty() ? choice.rig : is_file(folder / "rig.json") ? (folder / "rig.json").string() : std::string{};
  if (out.rig_file.empty()) return std::optional<Rig>{};
  io::FileResult<Rig> rig = read_rig(out.rig_file);
  if (!rig) return rig.error();
  out.notes.push_back("the vehicle is that of " + out.rig_file + ", not the published one");
  return std::optional<Rig>{std::move(rig).value()};
}

/// Refuses a rig without what an IMU needs.
[[nodiscard]] inline DatasetFailure check_rig(const DatasetRecording& out) {
  if (out.rig.imu && out.rig.lever_arm_b_m) return std::nullopt;
  return io::Diagnostic{out.rig_file, 0, out.rig.imu ? "has no antenna.lever_arm_b_m" : "has no section \"imu\"",
                        "add it, or solve without the inertial unit: --sensors gnss"};
}

[[nodiscard]] inline Eigen::Vector3d ecef(double lat_deg, double lon_deg, double height_m) {
  constexpr double rad = std::numbers::pi / 180;
  return geodesy::ecef_from_geodetic({lat_deg * rad, lon_deg * rad, height_m});
}

}  // namespace dataset
}  // namespace searvins::examples
