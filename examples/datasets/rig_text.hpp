// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A Rig as the text of a rig.json: what parse_rig() reads back as the same rig, with everything in right-forward-up axes.
///
/// Runners of datasets hold the published calibration as values; written beside the results it can be looked at, changed, and given back
/// with --rig.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <string>

#include "examples/support/json_writer.hpp"
#include "examples/support/rig.hpp"

namespace searvins::examples {

namespace detail {

template <class Derived>
void write_vector(JsonWriter& json, const char* key, const Eigen::MatrixBase<Derived>& v) {
  json.begin_array(key);
  for (Eigen::Index i = 0; i < v.size(); ++i) json.value(static_cast<double>(v(i)));
  json.end_array();
}

template <class Derived>
void write_matrix(JsonWriter& json, const char* key, const Eigen::MatrixBase<Derived>& m) {
  json.begin_array(key);
  for (Eigen::Index i = 0; i < m.rows(); ++i) write_vector(json, "", m.row(i));
  json.end_array();
}

/// "x", "-y" ...: the raw axis that a row of a signed permutation picks.
[[nodiscard]] inline std::string axis_text(const Eigen::RowVector3d& row) {
  Eigen::Index at = 0;
  row.cwiseAbs().maxCoeff(&at);
  return std::string{row[at] < 0 ? "-" : ""} + "xyz"[at];
}

inline void write_imu(JsonWriter& json, const RigImu& imu, const Eigen::Matrix3d& R_rfu_b) {
  json.begin_object("imu").member("rate_hz", imu.rate_hz);
  json.member("sample", imu.sample == RigImu::Sample::instantaneous ? "instantaneous" : "mean_to_stamp");
  const Eigen::Matrix3d R = R_rfu_b * imu.R_b_raw;
  json.begin_array("axes");
  for (int i = 0; i < 3; ++i) json.value(axis_text(R.row(i)));
  json.end_array();
  json.member("accel_noise_mps2_sqrt_hz", imu.accel_noise_mps2_sqrt_hz).member("gyro_noise_radps_sqrt_hz", imu.gyro_noise_radps_sqrt_hz);
  json.member("accel_bias_walk_mps3_sqrt_hz", imu.accel_bias_walk_mps3_sqrt_hz);
  json.member("gyro_bias_walk_radps2_sqrt_hz", imu.gyro_bias_walk_radps2_sqrt_hz);
  json.member("accel_bias_sigma_mps2", imu.accel_bias_sigma_mps2).member("gyro_bias_sigma_radps", imu.gyro_bias_sigma_radps);
  json.end_object();
}

inline void write_eye(JsonWriter& json, const char* key, const RigCamera& eye) {
  json.begin_object(key);
  write_vector(json, "intrinsics_px", eye.intrinsics_px);
  write_vector(json, "distortion_radtan", eye.distortion_radtan);
  json.end_object();
}

inline void write_camera(JsonWriter& json, const RigStereo& camera, const Eigen::Matrix3d& R_rfu_b) {
  json.begin_object("camera");
  if (camera.rectified) {
    const RigRectified& r = *camera.rectified;
    json.begin_object("rectified").member("fx_px", r.fx_px).member("fy_px", r.fy_px).member("cx_px", r.cx_px).member("cy_px", r.cy_px);
    json.member("baseline_m", r.baseline_m).end_object();
  } else if (camera.unrectified) {
    write_eye(json, "left", camera.unrectified->left), write_eye(json, "right", camera.unrectified->right);
    write_matrix(json, "T_c1_c0", camera.unrectified->T_c1_c0);
  }
  write_vector(json, "size_px", camera.size_px);
  write_matrix(json, "R_b_c", Eigen::Matrix3d{R_rfu_b * camera.R_b_c});
  write_vector(json, "t_b_c_m", Eigen::Vector3d{R_rfu_b * camera.t_b_c_m});
  json.member("sigma_px", camera.sigma_px).end_object();
}

inline void write_gnss(JsonWriter& json, const RigGnss& g) {
  const auto text = [](const gnss::SignalCode& s) { return std::string{gnss::letter_of(s.constellation), s.band, s.attribute}; };
  json.begin_object("gnss").begin_array("signals");
  for (const gnss::SignalCode& s : g.signals) json.value(text(s));
  json.end_array().member("elevation_mask_deg", g.elevation_mask_deg).member("min_cn0_dbhz", g.min_cn0_dbhz);
  if (!g.code_sigma_m.empty()) {
    json.begin_object("code_sigma_m");
    for (const auto& [signal, sigma] : g.code_sigma_m) write_vector(json, signal.c_str(), sigma);
    json.end_object();
  }
  write_vector(json, "phase_sigma_m", g.phase_sigma_m);
  json.member("doppler_sigma_mps", g.doppler_sigma_mps).member("max_base_age_s", g.max_base_age_s).end_object();
}

}  // namespace detail

/// The rig as rig.json.
[[nodiscard]] inline std::string rig_text(const Rig& rig) {
  JsonWriter json;
  json.begin_object().member("schema", 1).member("body_axes", "right-forward-up");
  if (rig.imu) detail::write_imu(json, *rig.imu, rig.R_rfu_b);
  if (rig.lever_arm_b_m) {
    json.begin_object("antenna");
    detail::write_vector(json, "lever_arm_b_m", Eigen::Vector3d{rig.R_rfu_b * *rig.lever_arm_b_m});
    json.end_object();
  }
  if (rig.base_position_e_m) {
    json.begin_object("base");
    detail::write_vector(json, "position_ecef_m", *rig.base_position_e_m);
    json.end_object();
  }
  if (rig.camera) detail::write_camera(json, *rig.camera, rig.R_rfu_b);
  if (rig.gnss) detail::write_gnss(json, *rig.gnss);
  if (rig.reject_classes) {
    json.begin_object("semantic").begin_array("reject_classes");
    for (const int k : *rig.reject_classes) json.value(k);
    json.end_array().end_object();
  }
  return json.end_object().text();
}

}  // namespace searvins::examples
