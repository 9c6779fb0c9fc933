// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One reading of an inertial measurement unit, and how noisy the unit is.
///
/// Body frame b: the unit's own origin and axes. The gyroscope reads the rotation of b relative to inertial space, the accelerometer the specific
/// force at its origin, both in axes of b:
///
///     gyro  = w_ib + b_g + n_g        accel = R_bi (a_i - gravitation) + b_a + n_a         at rest: accel = +9.8 m/s^2 along the up axis
///
/// n is white with density sigma (one standard deviation per square root of hertz); each bias is a random walk with a density of its own.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstdint>

#include <searvins/core/time.hpp>

namespace searvins::imu {

/// What a sample stands for. Over a drive the two readings of one file differ by 4 mm/s per second.
enum class SampleKind : std::uint8_t {
  instantaneous,  ///< the value at its time; between samples the signal is linear
  mean_to_stamp   ///< the mean since the previous sample: time is the end of the interval
};

/// One reading in GPS time.
template <class Scalar>
struct BasicImuSample {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

  GpsTime time{};
  Vector3 gyro_b_radps{Vector3::Zero()};
  Vector3 accel_b_mps2{Vector3::Zero()};

  [[nodiscard]] bool finite() const { return gyro_b_radps.allFinite() && accel_b_mps2.allFinite(); }
};
using ImuSample = BasicImuSample<double>;  ///< in double precision

/// Noise of a unit: densities of white noise and of the bias walks, and how far a bias may be off at the start. Defaults: a MEMS unit for vehicles.
struct ImuNoise {
  double accel_noise_mps2_sqrt_hz{9.8e-4}, gyro_noise_radps_sqrt_hz{1.7e-4};
  double accel_bias_walk_mps3_sqrt_hz{3.9e-5}, gyro_bias_walk_radps2_sqrt_hz{3.9e-6};
  double accel_bias_sigma_mps2{0.05}, gyro_bias_sigma_radps{9e-4};
};

}  // namespace searvins::imu
