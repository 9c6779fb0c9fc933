// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The pictures of a simulated drive: one after the other to a caller, or as files in the EuRoC layout.
///
///     cam0/data/<ns>.png, cam1/data/<ns>.png    the rectified pair, 8-bit grey; <ns>: GPS time, nanoseconds since 1980-01-06
///     cam0/data.csv, cam1/data.csv              #timestamp [ns],filename
///     cam0/sensor.yaml, cam1/sensor.yaml        calibration: no distortion; T_BS takes camera axes to those of the IMU
///     labels0/data/<ns>.png                     class of each left pixel (SurfaceClass)
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

/// How many pictures a drive has, from its first epoch to its last.
[[nodiscard]] inline int image_count(const SimulationOptions& options) {
  return static_cast<int>(std::llround(options.duration_s * options.camera_rate_hz)) + 1;
}

/// Renders the drive: call(time, seconds since the start, frame) for each picture in order of time.
template <class Call>
void for_each_frame(const Simulation& s, const RenderOptions& options, const Call& call) {
  Renderer renderer(s.city(), s.way(), s.options().seed, options);
  for (int k = 0; k < image_count(s.options()); ++k) {
    const double t_s = k / s.options().camera_rate_hz;
    call(s.options().start.plus_seconds(t_s), t_s, renderer.frame(t_s, s.vehicle().state(t_s)));
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

/// Writes the pictures into a folder; the message of the result is empty when all is well. `progress` gets the share that is done.
[[nodiscard]] inline io::Diagnostic write_images(const Simulation& s, const RenderOptions& options, const std::filesystem::path& folder,
                                                 const std::function<void(double)>& progress) {
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
    const std::string name = std::to_string(time.ns) + ".png";
    list += std::to_string(time.ns) + ',' + name + '\n';
    const std::array<const GrayImage*, 3> images{&frame.left, &frame.right, &frame.left_classes};
    for (std::size_t i = 0; i < images.size(); ++i) {
      const std::filesystem::path path = folder / kinds[i] / "data" / name;
      if (std::string wrong = examples::write_png(path.string(), *images[i]); !wrong.empty()) result = failure(path, std::move(wrong));
    }
    progress(static_cast<double>(++done) / image_count(s.options()));
  });
  if (!result.message.empty()) return result;
  const StereoRig rig = scaled_rig(StereoRig{}, options.width_px, options.height_px);
  for (const bool is_right : {false, true}) {
    const std::filesystem::path camera = folder / kinds[is_right ? 1 : 0];
    for (const auto& [name, text] : {std::pair{"data.csv", list}, {"sensor.yaml", camera_yaml(rig, s.options().camera_rate_hz, is_right)}})
      if (std::string wrong = io::write_text_file((camera / name).string(), text); !wrong.empty())
        return failure(camera / name, std::move(wrong));
  }
  return result;
}

}  // namespace searvins::simulator
