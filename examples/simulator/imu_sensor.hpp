// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The errors of a simulated IMU, of the class of the LORD 3DM-GX5-25.
///
///     measured = (I + S + M) truth + b_k + n_k           b_(k+1) = b_k + K sqrt(dt) N(0, I)          n_k = density sqrt(rate) N(0, I)
///
/// S: scale factors, M: misalignment (small angles), b: bias, drawn at turn-on, then a random walk of density K. A mean_to_stamp sample is
/// the mean of the truth over the time since the previous stamp, by Simpson's rule.
#pragma once

#include <Eigen/Core>

#include <cmath>

#include "random.hpp"
#include "vehicle.hpp"

namespace searvins::simulator {

/// Noise of the sensor. Densities are those of rig.json.
struct ImuNoise {
  double accel_noise_mps2_sqrt_hz{9.80665e-4}, gyro_noise_radps_sqrt_hz{1.7453292519943296e-4};
  double accel_bias_walk_mps3_sqrt_hz{3.92266e-5}, gyro_bias_walk_radps2_sqrt_hz{3.878509448876288e-6};
  double accel_bias_sigma_mps2{0.05}, gyro_bias_sigma_radps{9e-4};
  double accel_scale_sigma{3e-4}, gyro_scale_sigma{5e-4}, misalignment_sigma_rad{3e-4};
};

/// What a row stands for.
enum class ImuSampling { instantaneous, mean_to_stamp };

/// Measures the truth of a vehicle, row after row.
class ImuSensor {
 public:
  ImuSensor(const ImuNoise& noise, double rate_hz, ImuSampling sampling, Random random)
      : noise_(noise), dt_s_(1 / rate_hz), sampling_(sampling), random_(random) {
    accel_bias_mps2_ = noise_.accel_bias_sigma_mps2 * normals(), gyro_bias_radps_ = noise_.gyro_bias_sigma_radps * normals();
    accel_gain_ = gain(noise_.accel_scale_sigma), gyro_gain_ = gain(noise_.gyro_scale_sigma);
  }

  /// The row with the stamp t.
  [[nodiscard]] ImuTruth measure(const Vehicle& vehicle, double t_s) {
    const ImuTruth truth = without_errors(vehicle, t_s);
    const double per_sample = 1 / std::sqrt(dt_s_), per_step = std::sqrt(dt_s_);
    const ImuTruth row{accel_gain_ * truth.f_b_mps2 + accel_bias_mps2_ + noise_.accel_noise_mps2_sqrt_hz * per_sample * normals(),
                       gyro_gain_ * truth.w_ib_b_radps + gyro_bias_radps_ + noise_.gyro_noise_radps_sqrt_hz * per_sample * normals()};
    accel_bias_mps2_ += noise_.accel_bias_walk_mps3_sqrt_hz * per_step * normals();
    gyro_bias_radps_ += noise_.gyro_bias_walk_radps2_sqrt_hz * per_step * normals();
    return row;
  }

  /// What an ideal sensor of the same sampling would give.
  [[nodiscard]] ImuTruth without_errors(const Vehicle& vehicle, double t_s) const {
    if (sampling_ == ImuSampling::instantaneous) return vehicle.imu(t_s);
    const ImuTruth a = vehicle.imu(t_s - dt_s_), b = vehicle.imu(t_s - dt_s_ / 2), c = vehicle.imu(t_s);
    return {(a.f_b_mps2 + 4 * b.f_b_mps2 + c.f_b_mps2) / 6, (a.w_ib_b_radps + 4 * b.w_ib_b_radps + c.w_ib_b_radps) / 6};
  }

 private:
  [[nodiscard]] Eigen::Vector3d normals() {
    Eigen::Vector3d n;
    for (int i = 0; i < 3; ++i) n[i] = random_.normal();
    return n;
  }
  [[nodiscard]] Eigen::Matrix3d gain(double scale_sigma) {
    const Eigen::Vector3d scale = scale_sigma * normals(), turn = noise_.misalignment_sigma_rad * normals();
    Eigen::Matrix3d m;
    m << 1 + scale.x(), -turn.z(), turn.y(), turn.z(), 1 + scale.y(), -turn.x(), -turn.y(), turn.x(), 1 + scale.z();
    return m;
  }

  ImuNoise noise_;
  double dt_s_;
  ImuSampling sampling_;
  Random random_;
  Eigen::Vector3d accel_bias_mps2_, gyro_bias_radps_;
  Eigen::Matrix3d accel_gain_, gyro_gain_;
};

}  // namespace searvins::simulator
