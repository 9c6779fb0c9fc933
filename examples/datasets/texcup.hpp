// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// TEX-CUP, the drive of 2019-05-09 through Austin, in the names that its benchmark uses:
///
///     asterx4_rover.obs, asterx4_base_1hz.obs    RINEX 3 made from the receivers' SBF files, 1 Hz          GPS time
///     brdm1290.19p                               broadcast ephemerides of the day                          GPS time
///     lord_imu.log                               week, whole s, fraction, ax, ay, az, gx, gy, gz; m/s^2, rad/s
///     ground_truth.log                           date, time (UTC), ., latitude, longitude, height: the antenna, 1 Hz
///     cam0/, cam1/ (or camera_data/cam0 ...)     pictures in the EuRoC layout, stamped with UTC nanoseconds; sensor.yaml may be missing
///     stereo_tracks.csv                          what a frontend made of them, instead (seconds of GPS week)
///
/// Axes. The LORD's are left, forward, down; the body's are right, forward, up at its origin: v_b = (-x, y, -z). T_b_c takes camera axes
/// (right, down, forward) to the body. kStarFromPort takes points from the port (left) to the starboard camera, so
/// T_b_c1 = T_b_c0 T_c1_c0^-1.
///
/// Tracks are pixels of the rectified pair. Its camera is the port one turned by the rectification, whose rotation is part of R_b_c below.
/// Whoever rectifies differently gives a rig.json. Pictures are rectified here, from the unrectified calibration.
///
/// A rig.json in the folder (or --rig) stands for another vehicle; a recording of another day must have one. Counts are compared with the
/// published ones on the published day only.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "examples/datasets/euroc_calibration.hpp"
#include "examples/datasets/recording.hpp"

namespace searvins::examples {

namespace texcup {

/// The scored seconds, GPS time of 18:09:40 to 19:16:59 UTC: 4040 epochs.
inline const TimeSpan kWindow{GpsTime::from_week_sow(2052, 410998), GpsTime::from_week_sow(2052, 415037)};
inline constexpr long kEpochs = 4040, kReadings = 403'995, kPairs = 40'372;
inline constexpr double kMostSkewS = 1.6e-3;  ///< between the pictures of a pair

inline const Eigen::Vector3d kBase_e_m{-742080.4125, -5462031.7412, 3198339.6909};
inline const Eigen::Vector3d kRoverHeader_e_m{-741205.0262, -5462376.8743, 3197933.6654};
inline const Eigen::Vector3d kLeverArm_b_m{-0.610, -0.052, 0.010};  ///< IMU to antenna, right-forward-up

/// The port camera in the body.
[[nodiscard]] inline SensorPose port_pose() {
  SensorPose pose;
  pose.R_bs << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  pose.t_bs_m = {-0.303, 0.011, 0.033};
  return pose;
}

/// Points of the port camera in the starboard camera.
[[nodiscard]] inline Eigen::Matrix4d star_from_port() {
  Eigen::Matrix4d T;
  T << 0.9998547791712777, -9.072429496170852e-05, 0.01704148871000322, -0.4976386284757827,   //
      3.922622620624165e-05, 0.9999954322738392, 0.003022233074424807, 0.0008955716318795508,  //
      -0.017041685059114343, -0.003021125709942124, 0.9998502156672199, 0.005505671695360818,  //
      0, 0, 0, 1;
  return T;
}

/// The starboard camera in the body.
[[nodiscard]] inline SensorPose star_pose() {
  const SensorPose port = port_pose();
  const Eigen::Matrix4d T = star_from_port();
  SensorPose pose;
  pose.R_bs = port.R_bs * T.topLeftCorner<3, 3>().transpose();
  pose.t_bs_m = port.t_bs_m - pose.R_bs * T.topRightCorner<3, 1>();
  return pose;
}

/// The lenses: fx, fy, cx, cy and k1, k2, p1, p2 for 2048 x 732 pixels.
[[nodiscard]] inline RigCamera port_lens() { return {{1373.879, 1378.680, 991.935, 333.389}, {-0.02918, 0.03616, 0.00357, -0.00408}}; }
[[nodiscard]] inline RigCamera star_lens() { return {{1319.512, 1324.766, 1021.862, 345.805}, {-0.03596, 0.03498, 0.00372, -0.00253}}; }

/// The published vehicle. Walks of the biases are those of the unit's class; the sigmas at the start cover the bias of 0.14 m/s^2 that
/// others measured in this recording.
[[nodiscard]] inline Rig published_rig() {
  Rig rig;
  RigImu imu;
  imu.rate_hz = 100;
  imu.R_b_raw = Eigen::Vector3d{-1, 1, -1}.asDiagonal();
  imu.accel_noise_mps2_sqrt_hz = 9.793e-4, imu.gyro_noise_radps_sqrt_hz = 1.745e-4;
  imu.accel_bias_walk_mps3_sqrt_hz = 5.5e-5, imu.gyro_bias_walk_radps2_sqrt_hz = 5.5e-6;
  imu.accel_bias_sigma_mps2 = 0.15, imu.gyro_bias_sigma_radps = 2e-3;
  rig.imu = imu;
  rig.lever_arm_b_m = kLeverArm_b_m;
  rig.base_position_e_m = kBase_e_m;
  RigStereo camera;
  camera.rectified = RigRectified{1292.667, 1292.667, 1005.948, 344.537, 0.497670};
  camera.size_px = {2048, 732};
  Eigen::Matrix3d R_r_c0;  // port camera to rectified
  R_r_c0 << 0.99998043, -0.00185682, 0.00597374, 0.00184774, 0.99999713, 0.00152424, -0.00597655, -0.00151317, 0.99998100;
  camera.R_b_c = port_pose().R_bs * R_r_c0.transpose();
  camera.t_b_c_m = port_pose().t_bs_m;
  camera.sigma_px = 1;
  rig.camera = camera;
  RigGnss gnss;
  for (const char* signal : {"G1C", "G2W", "E1C", "E7Q", "C2I"}) {
    gnss::SignalCode code;
    if (gnss::signal_from_text(signal, 3, code)) gnss.signals.push_back(code);
  }
  rig.gnss = gnss;
  return rig;
}

/// sensor.yaml of a camera.
[[nodiscard]] inline std::string sensor_yaml(const RigCamera& lens, const SensorPose& pose) {
  const auto numbers = [](std::initializer_list<double> values) {
    std::string text;
    for (const double v : values) {
      char buffer[32];
      std::snprintf(buffer, sizeof buffer, "%s%.16g", text.empty() ? "" : ", ", v);
      text += buffer;
    }
    return text;
  };
  std::string data;
  for (int i = 0; i < 3; ++i) data += numbers({pose.R_bs(i, 0), pose.R_bs(i, 1), pose.R_bs(i, 2), pose.t_bs_m[i]}) + ",\n         ";
  const Eigen::Vector4d &k = lens.intrinsics_px, &d = lens.distortion_radtan;
  return "%YAML:1.0\n# TEX-CUP as published; T_BS takes camera axes to right, forward, up at the LORD, metres.\nsensor_type: camera\n"
         "T_BS:\n  cols: 4\n  rows: 4\n  data: [" +
         data +
         "0.0, 0.0, 0.0, 1.0]\nrate_hz: 10\nresolution: [2048, 732]\ncamera_model: pinhole\n"
         "intrinsics: [" +
         numbers({k[0], k[1], k[2], k[3]}) + "]\ndistortion_model: radial-tangential\ndistortion_coefficients: [" +
         numbers({d[0], d[1], d[2], d[3]}) + "]\n";
}

/// Stamps of a camera's list, rising, as GPS time.
[[nodiscard]] inline io::FileResult<std::vector<GpsTime>> read_stamps(const std::filesystem::path& list) {
  io::TextReader reader;
  if (auto wrong = reader.open(list)) return *wrong;
  std::vector<GpsTime> stamps;
  std::string_view line;
  while (reader.next(line)) {
    std::int64_t ns = 0;
    if (line.empty() || line.front() == '#' || !io::parse_integer(io::trimmed(line.substr(0, line.find(','))), ns)) continue;
    stamps.push_back(to_gps(UtcTime{ns}));
  }
  if (stamps.empty())
    return io::Diagnostic{list.string(), 0, "no row begins with a stamp in nanoseconds", "write nanoseconds,filename rows"};
  std::sort(stamps.begin(), stamps.end());
  return stamps;
}

/// Compares the lists of pictures with what was published.
[[nodiscard]] inline DatasetFailure check_pictures(const std::filesystem::path& root, const TimeSpan& rover, bool is_published,
                                                   std::vector<std::string>& notes) {
  std::array<std::vector<GpsTime>, 2> stamps;
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    auto read = read_stamps(root / (i == 0 ? "cam0" : "cam1") / "data.csv");
    if (!read) return read.error();
    stamps[i] = std::move(*read);
  }
  const TimeSpan span{stamps[0].front(), stamps[0].back()};
  if (!span.overlaps(rover))
    return io::Diagnostic{(root / "cam0" / "data.csv").string(), dataset::first_row_line((root / "cam0" / "data.csv").string()),
                          "the pictures are of another time than the rover: stamps read as UTC from " + dataset::span_text(span) +
                              ", rover from " + dataset::span_text(rover),
                          "stamps are UTC nanoseconds since 1970 (the attribute tstamp times 1e9, no leap seconds added)"};
  if (!is_published) return std::nullopt;
  long pairs = 0;
  double worst_s = 0;
  for (const GpsTime t : stamps[0]) {
    const auto after = std::lower_bound(stamps[1].begin(), stamps[1].end(), t);
    double apart_s = 1;
    if (after != stamps[1].end()) apart_s = std::min(apart_s, seconds_between(t, *after));
    if (after != stamps[1].begin()) apart_s = std::min(apart_s, seconds_between(*(after - 1), t));
    if (!kWindow.contains(t) || apart_s > 0.01) continue;
    ++pairs, worst_s = std::max(worst_s, apart_s);
  }
  dataset::note_count(notes, "pictures", "pairs in the scored time", pairs, kPairs);
  if (worst_s > kMostSkewS)
    notes.push_back("pictures: the two of a pair are up to " + io::fixed_text(worst_s * 1e3, 2) + " ms apart, 1.60 ms as published");
  return std::nullopt;
}

/// The folder below (or equal to) `folder` that holds cam0 and cam1; empty: none.
[[nodiscard]] inline std::filesystem::path pictures_root(const std::filesystem::path& folder) {
  for (const char* name : {"", "mav0", "camera_data", "camera_data/mav0", "images"})
    if (dataset::is_folder(folder / name / "cam0") && dataset::is_folder(folder / name / "cam1")) return *name ? folder / name : folder;
  return {};
}

/// Tracks or pictures, whichever there are.
[[nodiscard]] inline DatasetFailure find_camera(const std::filesystem::path& folder, const TimeSpan& rover, bool is_published,
                                                DatasetRecording& out) {
  const std::filesystem::path root = pictures_root(folder);
  if (dataset::is_file(folder / "stereo_tracks.csv")) {
    out.tracks = (folder / "stereo_tracks.csv").string();
    if (!root.empty()) out.notes.push_back("stereo_tracks.csv is there, so the pictures are not used (--images DIR uses them instead)");
    return std::nullopt;
  }
  if (root.empty()) {
    const bool has_h5 = dataset::is_file(folder / "camera_data" / "images.h5") || dataset::is_file(folder / "images.h5");
    out.notes.push_back(has_h5 ? "images.h5 is not read: export it as cam0/, cam1/ (docs/datasets.md); solved without the camera"
                               : "no stereo_tracks.csv and no cam0/, cam1/: solved without the camera");
    return std::nullopt;
  }
  if (DatasetFailure f = check_pictures(root, rover, is_published, out.notes)) return f;
  const bool has_yaml = dataset::is_file(root / "cam0" / "sensor.yaml") && dataset::is_file(root / "cam1" / "sensor.yaml");
  if (has_yaml)
    out.images = root.string();
  else if (out.rig_file.empty())
    out.pictures = PictureView{root.string(), {sensor_yaml(port_lens(), port_pose()), sensor_yaml(star_lens(), star_pose())}};
  else
    return io::Diagnostic{(root / "cam0").string(), 0,
                          "there is no sensor.yaml beside data.csv, and the vehicle is that of " + out.rig_file,
                          "write sensor.yaml of both cameras"};
  return std::nullopt;
}

/// Counts and header of the observation files against the published ones.
inline void note_observations(const std::string& path, const ObservationScan& scan, const Eigen::Vector3d& header_e_m,
                              std::vector<std::string>& notes) {
  dataset::note_count(notes, path, "epochs in the scored time", scan.count_in(kWindow), kEpochs);
  const std::vector<gnss::SignalCode> published = published_rig().gnss->signals;
  std::vector<gnss::SignalCode> missing;
  for (const gnss::SignalCode& s : published)
    if (!std::binary_search(scan.signals.begin(), scan.signals.end(), s)) missing.push_back(s);
  if (!missing.empty())
    notes.push_back(dataset::file_name(path) + ": without the signals " + dataset::signals_text(missing) + "; it has " +
                    dataset::signals_text(scan.signals) + " (convbin -mask GL1C,GL2W,EL1C,EL7Q,CL2I keeps the published ones)");
  if (scan.header.approx_position_e_m && (*scan.header.approx_position_e_m - header_e_m).norm() > 1)
    notes.push_back(dataset::file_name(path) + ": APPROX POSITION XYZ is " +
                    io::fixed_text((*scan.header.approx_position_e_m - header_e_m).norm(), 1) + " m from the published one");
}

}  // namespace texcup

/// Reads a folder. Errors: see the file comment; each names the file and what to do.
[[nodiscard]] inline io::FileResult<DatasetRecording> read_texcup(const std::filesystem::path& folder, const DatasetChoice& choice = {}) {
  using namespace texcup;
  if (const DatasetFailure f = dataset::check_folder(folder, "asterx4_rover.obs and the files beside it")) return *f;
  DatasetRecording out;
  const auto given = dataset::given_rig(folder, choice, out);
  if (!given) return given.error();
  out.rig = *given ? **given : published_rig();

  const std::string convert = ": convert asterx4.sbf with RTKLIB's convbin (docs/datasets.md has the line)";
  auto rover = choice.rover.empty() ? dataset::find_file(folder, {"asterx4_rover.obs"}, "get 2019May09-rover/asterx4/asterx4.sbf" + convert)
                                    : io::FileResult<std::string>{choice.rover};
  auto base = choice.base.empty()
                  ? dataset::find_file(folder, {"asterx4_base_1hz.obs"}, "get 2019May09-reference/asterx4/asterx4.sbf" + convert)
                  : io::FileResult<std::string>{choice.base};
  if (!rover) return rover.error();
  if (!base) return base.error();
  out.rover = *rover, out.base = *base;
  out.nav = choice.nav;
  for (const std::filesystem::path& file : choice.nav.empty() ? dataset::files_of(folder) : std::vector<std::filesystem::path>{})
    if (file.filename().string().starts_with("brd") && file.extension().string().ends_with('p')) out.nav.push_back(file.string());
  if (out.nav.empty())
    return io::Diagnostic{folder.string(), 0, "there is no broadcast navigation file (brdm1290.19p) in it",
                          "get brdm1290.19p, day 129 of 2019, from an IGS data centre, and unpack it"};

  const auto rover_scan = dataset::scan_observations(out.rover);
  if (!rover_scan) return rover_scan.error();
  const TimeSpan drive = rover_scan->span;
  const bool is_published = drive.overlaps(kWindow);
  if (!is_published && out.rig_file.empty())
    return io::Diagnostic{
        out.rover, 0,
        "is not of the published drive: it goes from " + dataset::span_text(drive) + ", the drive from " + dataset::span_text(kWindow),
        "give the file of 2019-05-09, or describe your own vehicle in a rig.json beside it"};
  if (is_published) {
    const auto base_scan = dataset::scan_observations(out.base);
    if (!base_scan) return base_scan.error();
    note_observations(out.rover, *rover_scan, kRoverHeader_e_m, out.notes);
    note_observations(out.base, *base_scan, kBase_e_m, out.notes);
    out.start = kWindow.first, out.end = kWindow.last;
  }

  if (choice.use_imu) {
    if (const DatasetFailure f = dataset::check_rig(out)) return *f;
    auto imu = dataset::find_file(folder, {"lord_imu.log"}, "get 2019May09-rover/lord/lord_imu.log, or solve without it: --sensors gnss");
    if (!imu) return imu.error();
    out.imu = *imu;
    io::ImuLogOptions options;
    options.reference = drive.first;
    const io::Parsed<io::ImuLog> log = io::read_imu_log(out.imu, options);
    if (log.error) return *log.error;
    const auto scan = dataset::check_samples(out.imu, log.value, out.rig, drive, kWindow, out.notes);
    if (!scan) return scan.error();
    if (is_published) dataset::note_count(out.notes, out.imu, "readings in the scored time", scan->in_window, kReadings);
  }
  if (choice.use_imu && choice.use_camera)
    if (const DatasetFailure f = find_camera(folder, drive, is_published, out)) return *f;

  if (dataset::is_file(folder / "ground_truth.log")) {
    out.truth = (folder / "ground_truth.log").string();
    const auto truth = read_truth(out.truth, drive.first);
    if (!truth) return truth.error();
    const auto span = dataset::check_truth(out.truth, truth->points, drive);
    if (!span) return span.error();
    if (is_published) {
      const long rows =
          std::count_if(truth->points.begin(), truth->points.end(), [](const TruthPoint& p) { return kWindow.contains(p.time); });
      dataset::note_count(out.notes, out.truth, "rows in the scored time", rows, kEpochs);
    }
  } else {
    out.notes.push_back("no ground_truth.log: nothing is scored");
  }
  return out;
}

}  // namespace searvins::examples
