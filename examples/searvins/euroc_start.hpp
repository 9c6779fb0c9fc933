// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How a recording of an unknown unit begins: which of its axes are right, forward and up, and a rest to level by.
///
/// Axes. The unit's axes of a dataset are any (EuRoC's x points up); those of the library are right, forward, up. A turn by right angles
/// lies between: up is the axis on which gravity is felt most, forward the one of the others along which the camera looks.
///
/// Rest. Most recordings begin with one, but a craft that is held or whose motors run is calm rather than still, too lively for the rest
/// detector. So calm readings count, if the pictures stand still (the caller's part: a steady ride is calm, too), and what the estimator
/// gets before the recording is not them but their mean, with a deviation of alternating sign. That looks still to a detector of tenths of
/// a second, and its size A makes the mean as uncertain as the means s of N / m tenths of a second with m readings each say:
///
///     variance of the mean   A^2 / N  =  s^2 / (N / m)         A = s sqrt(m)
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/imu/imu_sample.hpp>

namespace searvins::examples {

namespace detail {

inline constexpr double kBlockS = 0.1;
inline constexpr double kMostCalmS = 6;  ///< of a beginning that is looked at

/// Means over a tenth of a second.
struct Block {
  Eigen::Vector3d gyro{Eigen::Vector3d::Zero()}, accel{Eigen::Vector3d::Zero()};
  std::size_t end{0};  ///< reading after its last
};

/// The blocks from the beginning that are whole, of at most `most_s`.
[[nodiscard]] inline std::vector<Block> blocks_of(const std::vector<imu::ImuSample>& readings, std::size_t end, double most_s) {
  std::vector<Block> blocks;
  Block open;
  double count = 0;
  for (std::size_t i = 0; i < end; ++i) {
    const double since_s = seconds_between(readings[0].time, readings[i].time);
    if (since_s >= kBlockS * static_cast<double>(blocks.size() + 1) - 1e-6) {
      open.gyro /= count, open.accel /= count, open.end = i;
      blocks.push_back(open);
      open = {}, count = 0;
    }
    if (since_s >= most_s) break;
    open.gyro += readings[i].gyro_b_radps, open.accel += readings[i].accel_b_mps2, ++count;
  }
  return blocks;
}

}  // namespace detail

/// Axes right, forward, up (rows) in those of the dataset: see the file comment. `optical_d`: where the left camera looks.
[[nodiscard]] inline Eigen::Matrix3d library_axes(const Eigen::Vector3d& mean_accel_d_mps2, const Eigen::Vector3d& optical_d) {
  const auto axis_along = [](const Eigen::Vector3d& v) {
    Eigen::Index largest = 0;
    v.cwiseAbs().maxCoeff(&largest);
    return Eigen::Vector3d{(v[largest] < 0 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(largest)};
  };
  const Eigen::Vector3d up = axis_along(mean_accel_d_mps2), level = optical_d - optical_d.dot(up) * up;
  const Eigen::Vector3d forward = axis_along(level.norm() > 1e-3 ? level : Eigen::Vector3d{up.y(), up.z(), up.x()});
  Eigen::Matrix3d R;
  R.row(0) = forward.cross(up).transpose(), R.row(1) = forward.transpose(), R.row(2) = up.transpose();
  return R;
}

/// How many of the first readings are calm, of at most six seconds; 0 when that is less than a second. The last three tenths before it ends
/// are left out: a motion begins slowly.
[[nodiscard]] inline std::size_t calm_beginning(const std::vector<imu::ImuSample>& readings) {
  constexpr double kCalmAccelMps2 = 0.6, kCalmGyroRadps = 0.06;  // of a tenth of a second, off the mean so far
  constexpr double kMostBiasRadps = 0.15;
  constexpr std::size_t kLeastBlocks = 10, kDoubtfulBlocks = 3;
  const std::vector<detail::Block> blocks = detail::blocks_of(readings, readings.size(), detail::kMostCalmS);
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  std::size_t calm = 0;
  for (const detail::Block& block : blocks) {
    const double n = static_cast<double>(calm);
    if (calm > 0 && ((block.accel - accel / n).norm() > kCalmAccelMps2 || (block.gyro - gyro / n).norm() > kCalmGyroRadps)) break;
    if ((gyro + block.gyro).norm() > kMostBiasRadps * (n + 1)) break;
    gyro += block.gyro, accel += block.accel, ++calm;
  }
  if (calm < blocks.size()) calm -= std::min(calm, kDoubtfulBlocks);
  return calm >= kLeastBlocks ? blocks[calm - 1].end : 0;
}

/// Readings of a rest of `length_s` before the first reading, from the mean of the first `calm` of them: see the file comment.
[[nodiscard]] inline std::vector<imu::ImuSample> rest_before(const std::vector<imu::ImuSample>& readings, std::size_t calm,
                                                             double length_s) {
  const std::vector<detail::Block> blocks = detail::blocks_of(readings, calm, detail::kMostCalmS);
  if (blocks.size() < 2) return {};
  imu::ImuSample mean;
  const double n = static_cast<double>(blocks.size()), a_block = static_cast<double>(blocks.back().end) / n;
  for (const detail::Block& block : blocks) mean.gyro_b_radps += block.gyro / n, mean.accel_b_mps2 += block.accel / n;
  Eigen::Vector3d gyro2 = Eigen::Vector3d::Zero(), accel2 = Eigen::Vector3d::Zero();
  for (const detail::Block& block : blocks) {
    gyro2 += (block.gyro - mean.gyro_b_radps).cwiseAbs2() / (n - 1);
    accel2 += (block.accel - mean.accel_b_mps2).cwiseAbs2() / (n - 1);
  }
  // The mean of N readings that alternate by A has the variance A^2 / N; that of the blocks has s^2 / (N / a_block).
  const Eigen::Vector3d gyro = (a_block * gyro2).cwiseSqrt(), accel = (a_block * accel2).cwiseSqrt();
  const std::int64_t step_ns =
      (readings[blocks.back().end - 1].time.ns - readings[0].time.ns) / static_cast<std::int64_t>(blocks.back().end - 1);
  std::vector<imu::ImuSample> out;
  for (auto k = static_cast<std::int64_t>(length_s * 1e9) / step_ns; k > 0; --k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    out.push_back({GpsTime{readings[0].time.ns - k * step_ns}, mean.gyro_b_radps + sign * gyro, mean.accel_b_mps2 + sign * accel});
  }
  return out;
}

}  // namespace searvins::examples
