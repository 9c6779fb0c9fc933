// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Calibration in the EuRoC layout: sensor.yaml of the two cameras and of the IMU.
///
/// T_BS takes coordinates of the sensor into those of the body, p_b = R_bs p_s + t_bs; the body is the IMU. Of two cameras with T_BS,
///
///     R_c1_c0 = R_b_c1' R_b_c0          t_c1_c0 = R_b_c1' (t_b_c0 - t_b_c1)
///
/// A printed rotation has some 12 digits: one that is within 1e-4 of a rotation is made one, another is refused.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <searvins/io/file_result.hpp>
#include <searvins/vision/camera_model.hpp>
#include <searvins/vision/rectification.hpp>

#include "examples/datasets/sensor_yaml.hpp"

namespace searvins::examples {

/// Where a sensor is in the body.
struct SensorPose {
  Eigen::Matrix3d R_bs{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d t_bs_m{Eigen::Vector3d::Zero()};
};

/// One camera.
struct EurocCamera {
  vision::PinholeCamera<double> model{};
  SensorPose pose{};
  double rate_hz{0};
};

/// Noise of the IMU, as densities: rad/s/sqrt(Hz), m/s^2/sqrt(Hz) and the walks of the biases.
struct EurocImu {
  double rate_hz{0};
  double gyro_noise_radps_sqrt_hz{0}, accel_noise_mps2_sqrt_hz{0}, gyro_bias_walk_radps2_sqrt_hz{0}, accel_bias_walk_mps3_sqrt_hz{0};
};

/// T_BS of a sensor.
[[nodiscard]] inline io::FileResult<SensorPose> read_sensor_pose(const SensorYaml& yaml) {
  const auto data = yaml.numbers("T_BS.data", 16, 16);
  if (!data) return data.error();
  const auto wrong = [&](const char* what) {
    return io::Diagnostic{yaml.file(), yaml.find("T_BS.data")->line, what, "T_BS is [R t; 0 0 0 1] by rows, sensor to body, metres"};
  };
  SensorPose pose;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) pose.R_bs(static_cast<int>(r), static_cast<int>(c)) = (*data)[4 * r + c];
    pose.t_bs_m[static_cast<int>(r)] = (*data)[4 * r + 3];
  }
  if ((*data)[12] != 0 || (*data)[13] != 0 || (*data)[14] != 0 || (*data)[15] != 1) return wrong("the last row of T_BS is not 0 0 0 1");
  const Eigen::Matrix3d gram = pose.R_bs.transpose() * pose.R_bs;
  if (!((gram - Eigen::Matrix3d::Identity()).norm() < 1e-4) || pose.R_bs.determinant() < 0)
    return wrong("T_BS is no rotation and translation");
  pose.R_bs = Eigen::Quaterniond(pose.R_bs).normalized().toRotationMatrix();
  return pose;
}

/// A camera's calibration: pinhole, radial-tangential distortion with four or five coefficients (or none).
[[nodiscard]] inline io::FileResult<EurocCamera> read_euroc_camera(const SensorYaml& yaml) {
  const auto wrong = [&](std::string_view key, const std::string& what, const char* hint) {
    const YamlEntry* at = yaml.find(key);
    return io::Diagnostic{yaml.file(), at != nullptr ? at->line : 0, what, hint};
  };
  const auto kind = yaml.text("camera_model");
  if (!kind) return kind.error();
  if (*kind != "pinhole")
    return wrong("camera_model", "the camera model is " + *kind, "rectify the images beforehand and give a pinhole model");
  const auto size = yaml.numbers("resolution", 2, 2), focal = yaml.numbers("intrinsics", 4, 4);
  if (!size) return size.error();
  if (!focal) return focal.error();
  EurocCamera camera;
  for (const double n : *size)
    if (!(n >= 16 && n <= 20000) || n != std::floor(n))
      return wrong("resolution", "the resolution is no image size", "give [width, height] in pixels");
  camera.model.width_px = static_cast<int>((*size)[0]), camera.model.height_px = static_cast<int>((*size)[1]);
  camera.model.fx_px = (*focal)[0], camera.model.fy_px = (*focal)[1], camera.model.cx_px = (*focal)[2], camera.model.cy_px = (*focal)[3];
  if (!(camera.model.fx_px > 1 && camera.model.fy_px > 1 && camera.model.fx_px < 1e5 && camera.model.fy_px < 1e5))
    return wrong("intrinsics", "a focal length is not plausible", "give [fu, fv, cu, cv] in pixels");
  const Eigen::Vector2d middle{camera.model.cx_px, camera.model.cy_px};
  if (!camera.model.inside(middle))
    return wrong("intrinsics", "the principal point lies outside the image", "are the intrinsics those of this resolution?");
  if (yaml.find("distortion_coefficients") != nullptr) {
    const auto lens = yaml.numbers("distortion_coefficients", 4, 5);
    if (!lens) return lens.error();
    if (const YamlEntry* name = yaml.find("distortion_model"); name != nullptr && name->items.size() == 1) {
      const std::string& model = name->items.front();
      if (model != "radial-tangential" && model != "radtan" && model != "plumb_bob")
        return wrong("distortion_model", "the distortion model is " + model,
                     "only radial-tangential is known: rectify the images beforehand");
    }
    camera.model.lens = {(*lens)[0], (*lens)[1], (*lens)[2], (*lens)[3], lens->size() > 4 ? (*lens)[4] : 0};
  }
  const auto pose = read_sensor_pose(yaml);
  if (!pose) return pose.error();
  camera.pose = *pose;
  const auto rate = yaml.number("rate_hz");
  if (!rate) return rate.error();
  camera.rate_hz = *rate;
  return camera;
}

/// The IMU's noise. Its T_BS must be the identity: the body is the IMU.
[[nodiscard]] inline io::FileResult<EurocImu> read_euroc_imu_noise(const SensorYaml& yaml) {
  const auto pose = read_sensor_pose(yaml);
  if (!pose) return pose.error();
  if ((pose->R_bs - Eigen::Matrix3d::Identity()).norm() > 1e-9 || pose->t_bs_m.norm() > 1e-9)
    return io::Diagnostic{yaml.file(), yaml.find("T_BS.data")->line, "the IMU is not the body: its T_BS is not the identity",
                          "multiply the T_BS of the cameras by the inverse of the IMU's"};
  EurocImu imu;
  struct Field {
    const char* key;
    double* value;
  };
  for (const Field& f : {Field{"rate_hz", &imu.rate_hz}, Field{"gyroscope_noise_density", &imu.gyro_noise_radps_sqrt_hz},
                         Field{"gyroscope_random_walk", &imu.gyro_bias_walk_radps2_sqrt_hz},
                         Field{"accelerometer_noise_density", &imu.accel_noise_mps2_sqrt_hz},
                         Field{"accelerometer_random_walk", &imu.accel_bias_walk_mps3_sqrt_hz}}) {
    const auto value = yaml.number(f.key);
    if (!value) return value.error();
    if (!(*value > 0))
      return io::Diagnostic{yaml.file(), yaml.find(f.key)->line, std::string{f.key} + " must be positive",
                            "give the value of the data sheet"};
    *f.value = *value;
  }
  return imu;
}

/// Two cameras as the library's rectification wants them.
[[nodiscard]] inline vision::StereoCalibration<double> stereo_calibration(const EurocCamera& left, const EurocCamera& right) {
  vision::StereoCalibration<double> out;
  out.eyes = {left.model, right.model};
  out.R_c1_c0 = right.pose.R_bs.transpose() * left.pose.R_bs;
  out.t_c1_c0_m = right.pose.R_bs.transpose() * (left.pose.t_bs_m - right.pose.t_bs_m);
  out.R_b_c0 = left.pose.R_bs, out.p_b_c0_m = left.pose.t_bs_m;
  return out;
}

}  // namespace searvins::examples
