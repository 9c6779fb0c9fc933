// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Recordings of an IMU beside a receiver that computes its own RTK positions.
#pragma once

#include <doctest/doctest.h>

#include <filesystem>
#include <numbers>
#include <utility>
#include <vector>

#include <searvins/imu/attitude_angles.hpp>
#include <searvins/io/imu_log.hpp>
#include <searvins/io/pos_file.hpp>

namespace searvins::test {

/// Samples in body axes (right, forward, up), and the receiver's positions and velocities.
struct ImuRecording {
  std::vector<imu::ImuSample> samples;
  std::vector<imu::PositionFix> fixes;
};

inline ImuRecording read_imu_recording(const std::filesystem::path& folder, const Eigen::Matrix3d& R_b_raw) {
  auto log = io::read_imu_log(folder / "imu.csv");
  auto fixes = io::read_pos_file((folder / "onboard_rtk.pos").string());
  REQUIRE(log.ok());
  REQUIRE(fixes.ok());
  io::turn_axes(log.value.samples, R_b_raw);
  CHECK_FALSE(io::check_gravity_axis(log.value.samples, R_b_raw, "imu.csv"));
  return {std::move(log.value.samples), std::move(fixes.value)};
}

/// Boulder's car: raw axes back, right, up, and a mounting that looks down by 6.79 and right by 5.35 degrees.
inline Eigen::Matrix3d car_axes() {
  Eigen::Matrix3d R;
  R << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  constexpr double rad = std::numbers::pi / 180;
  const Eigen::Matrix3d mounting = imu::R_wb_from({0, -6.79 * rad, 5.35 * rad});
  return mounting * R;
}

}  // namespace searvins::test
