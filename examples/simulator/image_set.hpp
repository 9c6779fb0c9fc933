// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The pictures of a simulated drive: one after the other to a caller, or as files in the EuRoC layout.
///
///     cam0/data/<ns>.png, cam1/data/<ns>.png    the rectified pair, 8-bit grey; <ns>: GPS time, nanoseconds since 1980-01-06, or UTC since 1970
///     cam0/data.csv, cam1/data.csv              #timestamp [ns],filename
///     cam0/sensor.yaml, cam1/sensor.yaml        calibration: no distortion; T_BS takes camera axes to those of the IMU
///     labels0/data/<ns>.png                     class of each left pixel (SurfaceClass)
///     imu0/data.csv, imu0/sensor.yaml           the readings of imu.csv, rad/s and m/s^2; the body is the IMU (right, forward, up)
///     state_groundtruth_estimate0/data.csv      20 Hz: the IMU in the East-North-Up axes of the map: position, quaternion (w, x, y, z), velocity
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <system_error>
#include <utility>

#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/support/png_writer.hpp"

#include "renderer.hpp"
#include "rinex_writer.hpp"
#include "simulation.hpp"

namespace searvins::simulator {

/// What the stamps of pictures and of the files beside them count.
enum class StampScale { gps, unix_utc };
[[nodiscard]] inline std::string stamp_text(GpsTime time, StampScale scale) {
  return std::to_string(scale == StampScale::gps ? time.ns : to_utc(time).unix_ns);
}

/// How many pictures a drive has, from its first epoch to its last.
[[nodiscard]] inline int image_count(const SimulationOptions& options) {
  return static_cast<int>(std::llround(options.duration_s * options.camera_rate_hz)) + 1;
}

/// Renders the drive: call(time, seconds since the start, frame) for each picture in order of time.
template <class Call>
void for_each_frame(const Simulation& s, const RenderOptions& options, const Call& call) {
  Renderer renderer(s.city(), s.way(), s.options().seed, options, s.real_rig());
  for (int k = 0; k < image_count(s.options()); ++k) {
    const double t_s = k / s.options().camera_rate_hz;
    call(s.options().start.plus_seconds(t_s), t_s, renderer.frame(t_s + s.options().camera_offset_s, s.at_exposure(t_s)));
  }
}

/// sensor.yaml of the left or the right camera.
[[nodiscard]] inline std::string camera_yaml(const StereoRig& rig, double rate_hz, bool is_right) {
  const Eigen::Vector3d t_bc_m = rig.t_bc_m + (is_right ? rig.baseline_m : 0.0) * rig.R_bc.col(0);
  std::string text =
      "%YAML:1.0\n# Simulated; T_BS takes camera axes (right, down, forward) to those of the IMU (right, forward, up), metres.\n";
  text += "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [";
  for (int i = 0; i < 3; ++i)
    text += formatted("%.16g, %.16g, %.16g, %.16g,\n         ", rig.R_bc(i, 0), rig.R_bc(i, 1), rig.R_bc(i, 2), t_bc_m[i]);
  text += "0.0, 0.0, 0.0, 1.0]\n";
  text += formatted("rate_hz: %.10g\nresolution: [%.10g, %.10g]\ncamera_model: pinhole\n", rate_hz, rig.width_px, rig.height_px);
  text += formatted("intrinsics: [%.10g, %.10g, %.10g, %.10g]\n", rig.fx_px, rig.fy_px, rig.cx_px, rig.cy_px);
  return text + "distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n";
}

/// imu0/data.csv: what imu.csv says, a row for each of its.
[[nodiscard]] inline std::string euroc_imu_text(const Simulation& s, StampScale scale = StampScale::gps) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  ImuSensor sensor = s.imu();
  const int rate = static_cast<int>(std::llround(s.options().imu_rate_hz));
  const int last = static_cast<int>(std::llround(s.options().duration_s * rate)) + rate;
  for (int k = -rate; k <= last; ++k) {
    const double t_s = static_cast<double>(k) / rate;
    const ImuTruth m = sensor.measure(s.vehicle(), t_s);
    text += stamp_text(s.options().start.plus_seconds(t_s), scale);
    for (const Eigen::Vector3d& v : {m.w_ib_b_radps, m.f_b_mps2}) text += formatted(",%.9f,%.9f,%.9f", v.x(), v.y(), v.z());
    text += '\n';
  }
  return text;
}

/// imu0/sensor.yaml.
[[nodiscard]] inline std::string euroc_imu_yaml(const SimulationOptions& options) {
  const ImuNoise& n = options.imu_noise;
  std::string text =
      "%YAML:1.0\n# Simulated; the body is the IMU: right, forward, up.\nsensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [1.0, 0.0, 0.0, 0.0,\n         0.0, 1.0, 0.0, 0.0,\n         0.0, 0.0, 1.0, 0.0,\n         0.0, 0.0, 0.0, 1.0]\n";
  text += formatted("rate_hz: %.10g\ngyroscope_noise_density: %.6g\ngyroscope_random_walk: %.6g\n", options.imu_rate_hz,
                    n.gyro_noise_radps_sqrt_hz, n.gyro_bias_walk_radps2_sqrt_hz);
  return text + formatted("accelerometer_noise_density: %.6g\naccelerometer_random_walk: %.6g\n", n.accel_noise_mps2_sqrt_hz,
                          n.accel_bias_walk_mps3_sqrt_hz);
}

/// state_groundtruth_estimate0/data.csv, from the first epoch to the last.
[[nodiscard]] inline std::string euroc_truth_text(const Simulation& s, StampScale scale = StampScale::gps) {
  constexpr double kRateHz = 20;
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m "
      "s^-1],v_RS_R_z [m s^-1]\n";
  for (int k = 0; k <= std::llround(s.options().duration_s * kRateHz); ++k) {
    const double t_s = k / kRateHz;
    const VehicleState x = s.vehicle().state(t_s);
    const Eigen::Quaterniond q(x.R_wb);
    text += stamp_text(s.options().start.plus_seconds(t_s), scale);
    text += formatted(",%.5f,%.5f,%.5f,%.9f,%.9f,%.9f,%.9f,%.5f,%.5f,%.5f\n", x.p_w_m.x(), x.p_w_m.y(), x.p_w_m.z(), q.w(), q.x(), q.y(),
                      q.z(), x.v_w_mps.x(), x.v_w_mps.y(), x.v_w_mps.z());
  }
  return text;
}

/// Writes the pictures, the readings and the truth into a folder; the message of the result is empty when all is well. `progress` gets the share that is done.
[[nodiscard]] inline io::Diagnostic write_images(const Simulation& s, const RenderOptions& options, const std::filesystem::path& folder,
                                                 const std::function<void(double)>& progress, StampScale scale = StampScale::gps) {
  const auto failure = [](const std::filesystem::path& path, std::string what) {
    return io::Diagnostic{path.string(), 0, std::move(what), "choose another folder with --out"};
  };
  const std::array<const char*, 3> kinds{"cam0", "cam1", "labels0"};
  for (const char* kind : kinds) {
    std::error_code failed;
    std::filesystem::create_directories(folder / kind / "data", failed);
    if (failed) return failure(folder / kind, "could not be made: " + failed.message());
  }
  io::Diagnostic result;
  std::string list = "#timestamp [ns],filename\n";
  int done = 0;
  for_each_frame(s, options, [&](GpsTime time, double, const StereoFrame& frame) {
    if (!result.message.empty()) return;
    const std::string stamp = stamp_text(time, scale), name = stamp + ".png";
    list += stamp + ',' + name + '\n';
    const std::array<const GrayImage*, 3> images{&frame.left, &frame.right, &frame.left_classes};
    for (std::size_t i = 0; i < images.size(); ++i) {
      const std::filesystem::path path = folder / kinds[i] / "data" / name;
      if (std::string wrong = examples::write_png(path.string(), *images[i]); !wrong.empty()) result = failure(path, std::move(wrong));
    }
    progress(static_cast<double>(++done) / image_count(s.options()));
  });
  if (!result.message.empty()) return result;
  const StereoRig rig = scaled_rig(StereoRig{}, options.width_px, options.height_px);
  const double rate_hz = s.options().camera_rate_hz;
  const std::array<std::pair<const char*, std::string>, 7> files{{{"cam0/data.csv", list},
                                                                  {"cam0/sensor.yaml", camera_yaml(rig, rate_hz, false)},
                                                                  {"cam1/data.csv", list},
                                                                  {"cam1/sensor.yaml", camera_yaml(rig, rate_hz, true)},
                                                                  {"imu0/data.csv", euroc_imu_text(s, scale)},
                                                                  {"imu0/sensor.yaml", euroc_imu_yaml(s.options())},
                                                                  {"state_groundtruth_estimate0/data.csv", euroc_truth_text(s, scale)}}};
  for (const auto& [name, text] : files) {
    std::error_code failed;
    std::filesystem::create_directories((folder / name).parent_path(), failed);
    if (std::string wrong = io::write_text_file((folder / name).string(), text); !wrong.empty()) return failure(folder / name, std::move(wrong));
  }
  return result;
}

}  // namespace searvins::simulator
