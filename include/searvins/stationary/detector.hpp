// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Does the vehicle stand still? Told from the inertial unit, with the speed of another source as a veto.
///
/// Samples are averaged over blocks of 0.1 s, and ten blocks make the window. An idling engine shakes the unit above 10 Hz, which the block means do not
/// see; a road shakes it at 1-10 Hz, which they do. The statistic is the spread of the block means, s_a = sqrt(trace cov), s_w alike. On the
/// recorded drive of tests/stationary three quarters of the rest lie below 0.055 m/s^2 and 0.005 rad/s, 95 % of the motion above 0.21 and 0.014.
///
///     threshold_a^2 = (factor density_a sqrt(3 / 0.1 s))^2 + idle_a^2         white noise of three axes, and what an idling vehicle adds
///     threshold_w   alike
///     rest begins   s_a and s_w of a whole window below their thresholds, and the mean rate near the bias
///     rest ends     a block mean off the rest's mean by leave_block thresholds, or a spread above leave_spread thresholds
///
/// idle_* are for vehicles; a smooth ride (a simulator, a lift, a train) can lie below them. So while a speed hint confirms a rest the detector
/// learns how still this vehicle is, and lowers its thresholds to four times that; and a hint of motion ends a rest at once.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/imu/imu_sample.hpp>

namespace searvins::stationary {

/// See the file comment.
struct DetectorSettings {
  double accel_idle_mps2{0.07}, gyro_idle_radps{0.005};  ///< spread of the block means of an idling vehicle
  double noise_factor{2};                                ///< above the white noise: 27 degrees of freedom, so 7 sigma
  double leave_block{3.5}, leave_spread{2};              ///< thresholds that end a rest
  double learned_factor{4};                              ///< thresholds are at most this times what a confirmed rest showed
  double max_rate_radps{0.01};                           ///< mean rate at rest, over the bias
  double max_rate_unknown_bias_radps{0.05};              ///< the same before a bias is known; at least three sigma of the bias
  double moving_speed_mps{0.3};                          ///< a hint that is above this by three sigma is a veto
  double confirming_speed_mps{0.1}, confirming_sigma_mps{0.1};  ///< a hint that is below these confirms a rest
  double hint_life_s{1.5};                               ///< how long a hint holds
  double max_gap_s{0.3};                                 ///< longer without a sample: the window starts anew
};

/// See the file comment.
template <class Scalar>
class BasicDetector {
 public:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

  static constexpr int kBlocks = 10;
  static constexpr std::int64_t kBlockNs = 100'000'000;

  BasicDetector() : BasicDetector(imu::ImuNoise{}) {}
  explicit BasicDetector(const imu::ImuNoise& noise, const DetectorSettings& settings = {}) : settings_(settings) {
    const double per_density = settings.noise_factor * std::sqrt(3.0 / (static_cast<double>(kBlockNs) * 1e-9));
    noise_accel_ = per_density * noise.accel_noise_mps2_sqrt_hz;
    noise_gyro_ = per_density * noise.gyro_noise_radps_sqrt_hz;
    settings_.max_rate_unknown_bias_radps = std::max(settings.max_rate_unknown_bias_radps, 3 * noise.gyro_bias_sigma_radps);
  }

  /// Takes the next sample. Errors: non_finite, out_of_order, duplicate; the detector is as it was before.
  Status add(const imu::ImuSample& sample) {
    if (!sample.finite()) return failure(StatusCode::non_finite, "IMU sample is not finite");
    if (last_ && sample.time == *last_) return failure(StatusCode::duplicate, "IMU sample of the same time as the last");
    if (last_ && sample.time < *last_) return failure(StatusCode::out_of_order, "IMU sample before the last");
    if (last_ && seconds_between(*last_, sample.time) > settings_.max_gap_s) restart();
    last_ = sample.time;
    if (open_.count > 0 && sample.time.ns - open_.begin.ns >= kBlockNs) close_block();
    if (open_.count == 0) open_.begin = sample.time;
    ++open_.count;
    open_.accel += sample.accel_b_mps2;
    open_.gyro += sample.gyro_b_radps;
    return ok_status();
  }

  /// Speed from GNSS or from the estimator, with its sigma.
  void set_speed_hint(GpsTime time, double speed_mps, double sigma_mps) {
    if (!std::isfinite(speed_mps) || !(sigma_mps > 0)) return;
    hint_time_ = time;
    hint_speed_ = speed_mps, hint_sigma_ = sigma_mps;
    if (hint_says_motion()) leave();
  }

  /// Bias of the gyroscope, once it is known.
  void set_gyro_bias(const Vector3& bias_b_radps) { gyro_bias_ = bias_b_radps; }

  [[nodiscard]] bool stationary() const { return stationary_; }
  /// Begin of the present rest (its first window); only while stationary().
  [[nodiscard]] GpsTime since() const { return since_; }
  [[nodiscard]] double rest_s() const { return stationary_ && last_ ? seconds_between(since_, *last_) : 0.0; }
  /// Means of the window: what a zero-angular-rate factor wants. Only when window_full().
  [[nodiscard]] const Vector3& mean_gyro_b_radps() const { return mean_gyro_; }
  [[nodiscard]] const Vector3& mean_accel_b_mps2() const { return mean_accel_; }
  [[nodiscard]] bool window_full() const { return filled_ == kBlocks; }
  /// The statistic and what it is compared with.
  [[nodiscard]] double accel_spread_mps2() const { return spread_accel_; }
  [[nodiscard]] double gyro_spread_radps() const { return spread_gyro_; }
  [[nodiscard]] double accel_threshold_mps2() const { return threshold(noise_accel_, settings_.accel_idle_mps2, learned_accel_); }
  [[nodiscard]] double gyro_threshold_radps() const { return threshold(noise_gyro_, settings_.gyro_idle_radps, learned_gyro_); }

 private:
  struct Block {
    GpsTime begin{};
    int count{0};
    Vector3 accel{Vector3::Zero()}, gyro{Vector3::Zero()};  ///< sums while open, means in the ring
  };

  void restart() {
    open_ = {};
    filled_ = next_ = 0;
    leave();
  }
  void leave() { stationary_ = false; }

  [[nodiscard]] bool hint_holds() const { return hint_time_ && last_ && std::abs(seconds_between(*hint_time_, *last_)) <= settings_.hint_life_s; }
  [[nodiscard]] bool hint_says_motion() const { return hint_holds() && hint_speed_ - 3 * hint_sigma_ > settings_.moving_speed_mps; }
  [[nodiscard]] bool hint_confirms_rest() const {
    return hint_holds() && hint_speed_ < settings_.confirming_speed_mps && hint_sigma_ < settings_.confirming_sigma_mps;
  }

  [[nodiscard]] double threshold(double noise, double idle, const std::optional<double>& learned) const {
    const double most = std::hypot(noise, idle);
    return learned ? std::clamp(settings_.learned_factor * *learned, noise, most) : most;
  }

  void close_block() {
    Block& block = ring_[static_cast<std::size_t>(next_)];
    block = open_;
    block.accel /= open_.count;
    block.gyro /= open_.count;
    open_ = {};
    const bool off = stationary_ && ((block.accel - mean_accel_).norm() > settings_.leave_block * accel_threshold_mps2() ||
                                     (block.gyro - mean_gyro_).norm() > settings_.leave_block * gyro_threshold_radps());
    next_ = (next_ + 1) % kBlocks;
    filled_ = std::min(filled_ + 1, kBlocks);
    measure();
    if (off) leave();
    if (filled_ == kBlocks) decide();
  }

  /// Means and spreads over the ring.
  void measure() {
    mean_accel_.setZero(), mean_gyro_.setZero();
    for (int i = 0; i < filled_; ++i) mean_accel_ += ring_[static_cast<std::size_t>(i)].accel, mean_gyro_ += ring_[static_cast<std::size_t>(i)].gyro;
    mean_accel_ /= filled_, mean_gyro_ /= filled_;
    double accel = 0, gyro = 0;
    for (int i = 0; i < filled_; ++i) {
      accel += (ring_[static_cast<std::size_t>(i)].accel - mean_accel_).squaredNorm();
      gyro += (ring_[static_cast<std::size_t>(i)].gyro - mean_gyro_).squaredNorm();
    }
    const double n = std::max(1, filled_ - 1);
    spread_accel_ = std::sqrt(accel / n), spread_gyro_ = std::sqrt(gyro / n);
  }

  void decide() {
    const double a = spread_accel_ / accel_threshold_mps2(), w = spread_gyro_ / gyro_threshold_radps();
    const double rate = gyro_bias_ ? (mean_gyro_ - *gyro_bias_).norm() : mean_gyro_.norm();
    const bool still = rate < (gyro_bias_ ? settings_.max_rate_radps : settings_.max_rate_unknown_bias_radps) && !hint_says_motion();
    if (stationary_ && (a > settings_.leave_spread || w > settings_.leave_spread || !still)) return leave();
    if (!stationary_ && a < 1 && w < 1 && still) {
      stationary_ = true;
      since_ = ring_[static_cast<std::size_t>(next_)].begin;  // the oldest block
    }
    if (stationary_ && hint_confirms_rest()) learn();
  }

  void learn() {
    constexpr double kGain = 0.05;  // per block: two seconds of confirmed rest
    const auto follow = [](std::optional<double>& level, double value) { level = level ? *level + kGain * (value - *level) : value; };
    follow(learned_accel_, spread_accel_), follow(learned_gyro_, spread_gyro_);
  }

  DetectorSettings settings_;
  double noise_accel_{0}, noise_gyro_{0};
  std::array<Block, kBlocks> ring_{};
  Block open_{};
  int filled_{0}, next_{0};
  Vector3 mean_accel_{Vector3::Zero()}, mean_gyro_{Vector3::Zero()};
  double spread_accel_{0}, spread_gyro_{0};
  std::optional<double> learned_accel_, learned_gyro_;
  std::optional<Vector3> gyro_bias_;
  std::optional<GpsTime> last_, hint_time_;
  double hint_speed_{0}, hint_sigma_{0};
  bool stationary_{false};
  GpsTime since_{};
};
using Detector = BasicDetector<double>;  ///< in double precision

}  // namespace searvins::stationary
