// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// rig.json: the vehicle, its sensors, their noise and their places, as formats.md describes it. Every field has its unit in its name.
///
/// Body axes: the file may name its body frame right-forward-up, forward-right-down or forward-left-up; R_rfu_b turns vectors of the
/// file's body frame into right-forward-up, which the estimator uses throughout.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/gnss/signal.hpp>

#include "examples/support/json_section.hpp"

namespace searvins::examples {

/// IMU section. Noise values are densities (white noise per square root of hertz, bias random walk per square root of a second).
struct RigImu {
  enum class Sample { instantaneous, mean_to_stamp };
  double rate_hz{0};
  Sample sample{Sample::instantaneous};                  ///< mean_to_stamp: each row is the mean since the previous one
  Eigen::Matrix3d R_b_raw{Eigen::Matrix3d::Identity()};  ///< signed permutation: body axes from raw axes
  double accel_noise_mps2_sqrt_hz{0}, gyro_noise_radps_sqrt_hz{0};
  double accel_bias_walk_mps3_sqrt_hz{0}, gyro_bias_walk_radps2_sqrt_hz{0};
  double accel_bias_sigma_mps2{0}, gyro_bias_sigma_radps{0};
};

/// One camera of an unrectified pair.
struct RigCamera {
  Eigen::Vector4d intrinsics_px{Eigen::Vector4d::Zero()};      ///< fx, fy, cx, cy
  Eigen::Vector4d distortion_radtan{Eigen::Vector4d::Zero()};  ///< k1, k2, p1, p2
};

/// A rectified pair.
struct RigRectified {
  double fx_px{0}, fy_px{0}, cx_px{0}, cy_px{0}, baseline_m{0};
};

/// An unrectified pair: T_c1_c0 maps left (c0) to right (c1) camera coordinates.
struct RigUnrectified {
  RigCamera left{}, right{};
  Eigen::Matrix4d T_c1_c0{Eigen::Matrix4d::Identity()};
};

/// Camera section: exactly one of the two pairs is there.
struct RigStereo {
  std::optional<RigRectified> rectified;
  std::optional<RigUnrectified> unrectified;
  Eigen::Vector2d size_px{Eigen::Vector2d::Zero()};    ///< width, height
  Eigen::Matrix3d R_b_c{Eigen::Matrix3d::Identity()};  ///< left camera axes (right, down, forward) to body
  Eigen::Vector3d t_b_c_m{Eigen::Vector3d::Zero()};    ///< left camera in the body frame
  double sigma_px{1};
};

/// GNSS section; the last four members have defaults and may be absent from the file.
struct RigGnss {
  std::vector<gnss::SignalCode> signals;
  double elevation_mask_deg{15}, min_cn0_dbhz{20};
  std::map<std::string, Eigen::Vector2d>
      code_sigma_m;                             ///< by signal text: a, b of sigma^2 = 2 a^2 + (b / sin elevation)^2; absent: the library's
  Eigen::Vector2d phase_sigma_m{0.003, 0.006};  ///< the same two numbers for every carrier phase
  double doppler_sigma_mps{0.5};
  double max_base_age_s{30};
};

/// The whole file. A section that the file does not have is empty.
struct Rig {
  Eigen::Matrix3d R_rfu_b{Eigen::Matrix3d::Identity()};
  std::optional<RigImu> imu;
  std::optional<Eigen::Vector3d> lever_arm_b_m;  ///< IMU to antenna phase centre
  std::optional<Eigen::Vector3d> base_position_e_m;
  std::optional<RigStereo> camera;
  std::optional<RigGnss> gnss;
  std::optional<std::vector<int>> reject_classes;  ///< semantic classes whose keypoints are dropped
};

namespace detail {

/// Row of a signed permutation from "x", "-y" ...; false for anything else.
[[nodiscard]] inline bool axis_row(std::string_view text, Eigen::RowVector3d& row) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  if (text.size() != 1 || text[0] < 'x' || text[0] > 'z') return false;
  row = Eigen::RowVector3d::Zero();
  row[text[0] - 'x'] = negative ? -1 : 1;
  return true;
}

inline void read_axes(JsonSection& section, const Json& parent, Eigen::Matrix3d& R_b_raw) {
  const std::vector<std::string> axes = section.strings("axes");
  if (!section.ok()) return;
  const Json& at = *parent.find("axes");
  if (axes.size() != 3) return section.fail(at, section.full("axes") + " must name three axes");
  for (int i = 0; i < 3; ++i) {
    Eigen::RowVector3d row;
    const std::string& axis = axes[static_cast<std::size_t>(i)];
    if (!axis_row(axis, row)) return section.fail(at, section.full("axes") + ": \"" + axis + "\" is not one of x, y, z, -x, -y, -z");
    R_b_raw.row(i) = row;
  }
  if (std::abs(R_b_raw.determinant() - 1) > 0.5)
    section.fail(at, section.full("axes") + " is no rotation: an axis stands twice, or the handedness changes");
}

inline void check_rotation(JsonSection& section, const Json& parent, std::string_view name, const Eigen::Matrix3d& R) {
  if (section.ok() && ((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() > 1e-4 || R.determinant() < 0))
    section.fail(*parent.find(name), section.full(name) + " is not a rotation matrix (orthonormal, determinant 1)");
}

inline void read_imu(JsonSection section, const Json& object, Rig& rig) {
  RigImu imu;
  section.number("rate_hz", imu.rate_hz, 1, 10000);
  imu.sample =
      section.word("sample", {"instantaneous", "mean_to_stamp"}) == 0 ? RigImu::Sample::instantaneous : RigImu::Sample::mean_to_stamp;
  read_axes(section, object, imu.R_b_raw);
  const std::pair<const char*, double*> densities[] = {{"accel_noise_mps2_sqrt_hz", &imu.accel_noise_mps2_sqrt_hz},
                                                       {"gyro_noise_radps_sqrt_hz", &imu.gyro_noise_radps_sqrt_hz},
                                                       {"accel_bias_walk_mps3_sqrt_hz", &imu.accel_bias_walk_mps3_sqrt_hz},
                                                       {"gyro_bias_walk_radps2_sqrt_hz", &imu.gyro_bias_walk_radps2_sqrt_hz},
                                                       {"accel_bias_sigma_mps2", &imu.accel_bias_sigma_mps2},
                                                       {"gyro_bias_sigma_radps", &imu.gyro_bias_sigma_radps}};
  for (const auto& [name, out] : densities) section.number(name, *out, 1e-12, 100);
  section.finish();
  rig.imu = imu;
}

inline void read_camera_model(JsonSection section, RigCamera& camera) {
  section.vector("intrinsics_px", camera.intrinsics_px);
  section.vector("distortion_radtan", camera.distortion_radtan, -100, 100);
  section.finish();
}

inline void read_stereo(JsonSection section, const Json& object, Rig& rig) {
  RigStereo stereo;
  if (const Json* pair = section.optional("rectified")) {
    RigRectified& r = stereo.rectified.emplace();
    JsonSection inner = section.section("rectified", *pair);
    inner.number("fx_px", r.fx_px, 1, 1e5), inner.number("fy_px", r.fy_px, 1, 1e5);
    inner.number("cx_px", r.cx_px, -1e5, 1e5), inner.number("cy_px", r.cy_px, -1e5, 1e5);
    inner.number("baseline_m", r.baseline_m, 1e-3, 100);
    inner.finish();
    for (const char* name : {"left", "right", "T_c1_c0"})
      if (const Json* other = section.optional(name))
        section.fail(*other, section.full(name) + " stands beside " + section.full("rectified") + ": give one or the other");
  } else {
    RigUnrectified& u = stereo.unrectified.emplace();
    if (const Json* left = section.required("left")) read_camera_model(section.section("left", *left), u.left);
    if (const Json* right = section.required("right")) read_camera_model(section.section("right", *right), u.right);
    section.matrix("T_c1_c0", u.T_c1_c0);
    check_rotation(section, object, "T_c1_c0", u.T_c1_c0.topLeftCorner<3, 3>());
  }
  section.vector("size_px", stereo.size_px, 1, 1e5);
  section.matrix("R_b_c", stereo.R_b_c);
  check_rotation(section, object, "R_b_c", stereo.R_b_c);
  section.vector("t_b_c_m", stereo.t_b_c_m, -1000, 1000);
  section.number("sigma_px", stereo.sigma_px, 1e-3, 100);
  section.finish();
  rig.camera = stereo;
}

inline void read_gnss(JsonSection section, const Json& object, Rig& rig) {
  RigGnss g;
  for (const std::string& text : section.strings("signals")) {
    gnss::SignalCode code;
    if (gnss::signal_from_text(text.data(), text.size(), code))
      g.signals.push_back(code);
    else
      section.fail(*object.find("signals"), section.full("signals") + ": \"" + text +
                                                "\" is no signal (constellation G, E, C or J, band, tracking code, as in G2W)");
  }
  section.number("elevation_mask_deg", g.elevation_mask_deg, 0, 89);
  section.number("min_cn0_dbhz", g.min_cn0_dbhz, 0, 60);
  if (const Json* sigmas = section.optional("code_sigma_m")) {
    JsonSection inner = section.section("code_sigma_m", *sigmas);
    for (const std::string& key : sigmas->keys) {
      gnss::SignalCode code;
      if (!gnss::signal_from_text(key.data(), key.size(), code)) section.fail(*sigmas->find(key), inner.full(key) + " is no signal");
      inner.vector(key, g.code_sigma_m[key], 0, 1000);
    }
  }
  section.optional_vector("phase_sigma_m", g.phase_sigma_m, 0, 10);
  section.optional_number("doppler_sigma_mps", g.doppler_sigma_mps, 1e-4, 100);
  section.optional_number("max_base_age_s", g.max_base_age_s, 0, 3600);
  section.finish();
  rig.gnss = g;
}

inline void read_position(JsonSection section, const char* name, std::optional<Eigen::Vector3d>& out) {
  section.vector(name, out.emplace(Eigen::Vector3d::Zero()), -1e8, 1e8);
  section.finish();
}

}  // namespace detail

/// Reads a rig from JSON text; `name` is the file's name in errors.
[[nodiscard]] inline io::FileResult<Rig> parse_rig(std::string_view text, const std::string& name) {
  const io::FileResult<Json> json = parse_json(text, name, {16, 1U << 20U});
  if (!json) return json.error();
  Rig rig;
  io::Diagnostic error;
  JsonSection top{*json, {}, name, error};
  double schema = 0;
  top.number("schema", schema, 1, 1);
  if (const Json* section = top.optional("imu")) detail::read_imu(top.section("imu", *section), *section, rig);
  if (const Json* section = top.optional("antenna"))
    detail::read_position(top.section("antenna", *section), "lever_arm_b_m", rig.lever_arm_b_m);
  if (const Json* section = top.optional("base"))
    detail::read_position(top.section("base", *section), "position_ecef_m", rig.base_position_e_m);
  if (const Json* section = top.optional("camera")) detail::read_stereo(top.section("camera", *section), *section, rig);
  if (const Json* section = top.optional("gnss")) detail::read_gnss(top.section("gnss", *section), *section, rig);
  if (const Json* section = top.optional("semantic")) {
    JsonSection inner = top.section("semantic", *section);
    rig.reject_classes = inner.integers("reject_classes", 0, 255);
    inner.finish();
  }
  const bool needs_axes = rig.imu || rig.lever_arm_b_m || rig.camera;
  if (needs_axes || json->find("body_axes")) {  // axes matter only where something is given in the body frame
    const std::size_t axes = top.word("body_axes", {"right-forward-up", "forward-right-down", "forward-left-up"});
    if (axes == 1) rig.R_rfu_b << 0, 1, 0, 1, 0, 0, 0, 0, -1;
    if (axes == 2) rig.R_rfu_b << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  }
  top.finish();
  if (!error.message.empty()) return error;
  return rig;
}

/// Reads a rig.json file.
[[nodiscard]] inline io::FileResult<Rig> read_rig(const std::string& path) {
  const io::FileResult<std::string> text = io::read_text_file(path, 1U << 20U);
  if (!text) return text.error();
  return parse_rig(*text, path);
}

}  // namespace searvins::examples
