// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where is up, what is the gyroscope's bias: alignment of a body that stands still, from sums of its samples.
///
/// At rest the accelerometer reads f = -R_bw g_w + b_a + n and the gyroscope w = R_bw Omega_w + b_g + n', Omega the rate of the Earth. With u = f / |f| (up in b)
/// and a heading, R_wb is the rotation that carries u to -g_w / |g_w| and the forward axis into that heading. Its error, R_true = R_wb Exp(d):
///
///     d  =  [u]x (b_a + n) / g  +  u d_heading               cov(d) = [u]x (Sigma_b + Sigma_n) [u]x' / g^2 + sigma_heading^2 u u'
///     cov(d, b_a) = [u]x Sigma_b / g                         tilt and accelerometer bias are one unknown: 50 mm/s^2 of bias are 5 mrad
///
///     b_g = mean w - R_bw Omega_w,   error -n' - [R_bw Omega_w]x d
///
/// The mean of n over T seconds has the larger of the sample variance over the count and density^2 / T.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/imu/attitude_angles.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::imu {

/// Mean and covariance of samples, by updates that neither store them nor cancel [Welford 1962; Chan, Golub, LeVeque 1983 to merge two].
template <class Scalar>
class BasicRestStatistics {
 public:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  /// Takes a sample. Not finite: ignored.
  void add(const ImuSample& sample) {
    if (!sample.finite()) return;
    if (count_ == 0) first_ = sample.time;
    last_ = sample.time;
    ++count_;
    accumulate(sample.accel_b_mps2, mean_accel_, accel_squares_);
    accumulate(sample.gyro_b_radps, mean_gyro_, gyro_squares_);
  }

  /// Takes what another has gathered.
  void merge(const BasicRestStatistics& other) {
    if (other.count_ == 0) return;
    if (count_ == 0) return void(*this = other);
    const double n = static_cast<double>(count_), m = static_cast<double>(other.count_), total = n + m;
    const auto join = [&](Vector3& mean, Matrix3& squares, const Vector3& mean2, const Matrix3& squares2) {
      const Vector3 d = mean2 - mean;
      squares += squares2 + n * m / total * d * d.transpose();
      mean += m / total * d;
    };
    join(mean_accel_, accel_squares_, other.mean_accel_, other.accel_squares_);
    join(mean_gyro_, gyro_squares_, other.mean_gyro_, other.gyro_squares_);
    first_ = std::min(first_, other.first_);
    last_ = std::max(last_, other.last_);
    count_ += other.count_;
  }

  void reset() { *this = {}; }

  [[nodiscard]] long count() const { return count_; }
  [[nodiscard]] double duration_s() const { return count_ > 1 ? seconds_between(first_, last_) : 0.0; }
  [[nodiscard]] GpsTime first() const { return first_; }
  [[nodiscard]] GpsTime last() const { return last_; }
  [[nodiscard]] const Vector3& mean_accel_b_mps2() const { return mean_accel_; }
  [[nodiscard]] const Vector3& mean_gyro_b_radps() const { return mean_gyro_; }
  /// Covariance of one sample; zero for fewer than two.
  [[nodiscard]] Matrix3 accel_covariance() const { return per_sample(accel_squares_); }
  [[nodiscard]] Matrix3 gyro_covariance() const { return per_sample(gyro_squares_); }
  /// Covariance of the means, see the file comment. Needs a duration.
  [[nodiscard]] Matrix3 mean_accel_covariance(const ImuNoise& noise) const { return of_mean(accel_covariance(), noise.accel_noise_mps2_sqrt_hz); }
  [[nodiscard]] Matrix3 mean_gyro_covariance(const ImuNoise& noise) const { return of_mean(gyro_covariance(), noise.gyro_noise_radps_sqrt_hz); }

 private:
  void accumulate(const Vector3& x, Vector3& mean, Matrix3& squares) const {
    const Vector3 before = x - mean;
    mean += before / static_cast<double>(count_);
    squares += before * (x - mean).transpose();
  }
  [[nodiscard]] Matrix3 per_sample(const Matrix3& squares) const {
    if (count_ < 2) return Matrix3::Zero();
    return (squares + squares.transpose()) / (2.0 * static_cast<double>(count_ - 1));
  }
  [[nodiscard]] Matrix3 of_mean(Matrix3 sample, double density) const {
    sample /= static_cast<double>(std::max(1L, count_));
    const double floor = density * density / std::max(duration_s(), 1e-3);
    for (int i = 0; i < 3; ++i) sample(i, i) = std::max(sample(i, i), floor);
    return sample;
  }

  long count_{0};
  GpsTime first_{}, last_{};
  Vector3 mean_accel_{Vector3::Zero()}, mean_gyro_{Vector3::Zero()};
  Matrix3 accel_squares_{Matrix3::Zero()}, gyro_squares_{Matrix3::Zero()};
};
using RestStatistics = BasicRestStatistics<double>;  ///< in double precision

/// Axes right, forward (of a heading), up over an up direction: the attitude of a body that stands upright on it.
template <class Scalar = double>
[[nodiscard]] inline math::Matrix3<Scalar> upright_axes(const math::Vector3<Scalar>& up_w, double heading_rad) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  const Vector3 u = up_w.normalized();
  const Vector3 f = Vector3{std::sin(heading_rad), std::cos(heading_rad), 0};
  Eigen::Matrix<Scalar, 3, 3> R;
  R.col(2) = u;
  R.col(1) = (f - f.dot(u) * u).normalized();
  R.col(0) = R.col(1).cross(u);
  return R;
}

/// R_wb that carries the mean specific force to `force_w` (at rest: -g_w) and has the heading. What is left free, a turn by t about the force, moves the
/// forward axis on a cone: y = c s + sqrt(1 - c^2) (cos t f + sin t r) with s the force's direction and c its share of the forward axis. The heading
/// is met where y has no part to the right of it: A cos t + B sin t = C, solved in closed form.
/// Errors: non_finite; invalid_argument (force below 3 m/s^2, or so far from vertical in b that the forward axis has no heading): value = its size.
template <class Scalar = double>
[[nodiscard]] inline Result<math::Matrix3<Scalar>> attitude_from_force(const math::Vector3<Scalar>& force_b_mps2,
                                                                       const math::Vector3<Scalar>& force_w_mps2, double heading_rad) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  if (!force_b_mps2.allFinite() || !force_w_mps2.allFinite() || !std::isfinite(heading_rad))
    return failure(StatusCode::non_finite, "specific force or heading is not finite");
  if (force_b_mps2.norm() < 3 || force_w_mps2.norm() < 3)
    return failure(StatusCode::invalid_argument, "the specific force is too small to level by: is gravity in it, and in m/s^2?", -1, -1, force_b_mps2.norm());
  const Vector3 u_b = force_b_mps2.normalized(), u_w = force_w_mps2.normalized();
  if (std::abs(u_b.y()) > 0.99) return failure(StatusCode::invalid_argument, "the forward axis points along gravity: it has no heading", -1, -1, u_b.y());
  Matrix3 upright_b;  // right, forward, up over u_b, in axes of b
  upright_b.col(2) = u_b;
  upright_b.col(1) = (Vector3::UnitY() - u_b.y() * u_b).normalized();
  upright_b.col(0) = upright_b.col(1).cross(u_b);
  const Matrix3 upright_w = upright_axes<Scalar>(u_w, heading_rad);
  const Vector3 right_w{std::cos(heading_rad), -std::sin(heading_rad), 0};
  const double A = upright_w.col(1).dot(right_w), B = upright_w.col(0).dot(right_w), C = -u_b.y() / std::sqrt(1 - u_b.y() * u_b.y()) * u_w.dot(right_w);
  const double size = std::hypot(A, B);
  if (!(std::abs(C) < size)) return failure(StatusCode::invalid_argument, "no attitude has this heading under this specific force", -1, -1, C);
  const double middle = std::atan2(B, A), aside = std::acos(C / size), plus = wrapped(middle + aside), minus = wrapped(middle - aside);
  const double t = std::abs(plus) < std::abs(minus) ? plus : minus;  // the other one points backwards
  Matrix3 turned_w = upright_w;
  turned_w.col(1) = std::cos(t) * upright_w.col(1) + std::sin(t) * upright_w.col(0);
  turned_w.col(0) = turned_w.col(1).cross(u_w);
  return Matrix3{turned_w * upright_b.transpose()};
}

/// cov(d) of the file comment. `force_covariance` is that of the specific force: noise of the mean and bias.
template <class Scalar = double>
[[nodiscard]] inline math::Matrix3<Scalar> attitude_covariance(const math::Vector3<Scalar>& up_b, const math::Matrix3<Scalar>& force_covariance,
                                                               double gravity_mps2, double sigma_heading_rad) {
  const Eigen::Matrix<Scalar, 3, 3> U = so3::skew(up_b);
  return U * force_covariance * U.transpose() / (gravity_mps2 * gravity_mps2) + sigma_heading_rad * sigma_heading_rad * up_b * up_b.transpose();
}

/// What a rest tells once a heading is known.
struct RestAlignment {
  Eigen::Matrix3d R_wb{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d gyro_bias_b_radps{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d attitude_covariance{Eigen::Matrix3d::Identity()};   ///< of d, body axes, rad^2
  Eigen::Matrix3d attitude_accel_bias{Eigen::Matrix3d::Zero()};       ///< cov(d, b_a), rad m/s^2
  Eigen::Matrix3d gyro_bias_covariance{Eigen::Matrix3d::Identity()};  ///< (rad/s)^2
};

/// Aligns from a rest. `gravity_w_mps2` is that of the position, `earth_rate_w_radps` the Earth's in w (zero where it is not known: its size is then for
/// the caller to add to the bias' sigma). A heading that is not known is passed with a sigma of pi.
/// Errors: too_few (under 10 samples); those of attitude_from_force; rejected: the mean is not gravity's size to within 10 %: value = |mean|.
template <class Scalar>
[[nodiscard]] inline Result<RestAlignment> align_at_rest(const BasicRestStatistics<Scalar>& rest, const ImuNoise& noise,
                                                         const math::Vector3<Scalar>& gravity_w_mps2,
                                                         const math::Vector3<Scalar>& earth_rate_w_radps, double heading_rad,
                                                         double sigma_heading_rad) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  if (rest.count() < 10) return failure(StatusCode::too_few, "fewer than 10 samples at rest", static_cast<std::int32_t>(rest.count()), 10);
  const double g = gravity_w_mps2.norm(), f = rest.mean_accel_b_mps2().norm();
  const Result<Matrix3> R_wb = attitude_from_force<Scalar>(rest.mean_accel_b_mps2(), -gravity_w_mps2, heading_rad);
  if (!R_wb.ok()) return R_wb.status();
  if (std::abs(f - g) > 0.1 * g) return failure(StatusCode::rejected, "the specific force at rest is not gravity: wrong unit, or not at rest", -1, -1, f);
  RestAlignment a;
  a.R_wb = *R_wb;
  const Vector3 up_b = rest.mean_accel_b_mps2() / f, earth_b = R_wb->transpose() * earth_rate_w_radps;
  const double bias_variance = noise.accel_bias_sigma_mps2 * noise.accel_bias_sigma_mps2;
  const Matrix3 bias = bias_variance * Matrix3::Identity();
  a.attitude_covariance = attitude_covariance<Scalar>(up_b, rest.mean_accel_covariance(noise) + bias, g, sigma_heading_rad);
  a.attitude_accel_bias = bias_variance / g * so3::skew(up_b);
  a.gyro_bias_b_radps = rest.mean_gyro_b_radps() - earth_b;
  const Matrix3 E = so3::skew(earth_b);
  a.gyro_bias_covariance = rest.mean_gyro_covariance(noise) + E * a.attitude_covariance * E.transpose();
  return a;
}

}  // namespace searvins::imu
