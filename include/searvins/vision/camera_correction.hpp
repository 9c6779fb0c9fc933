// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What a camera's calibration leaves over, as a variable: the offset of its clock and a small turn of its axes (boresight).
///
///     t_imu = t_camera + d             a frame with the stamp t was exposed at t + d by the clock of the inertial unit
///     R_bc  = R_bn R_nc                n: the camera's axes as calibrated, c: as they are
///     R_nc (+) b = R_nc Exp(b)         tangent (d, b), s and rad; b about the camera's axes right, down, forward
///
/// Both are constant but for temperature and wear. One variable stands for some seconds and is tied to the next by a random walk, so that what
/// was learned long ago cannot freeze it:
///
///     prior   e = R (x (-) mean)               R' R = P^-1, 4 x 4
///     walk    e = W (x2 (-) x1)                W = diag(1 / sigma(T)), sigma(T) = density sqrt(T)
///
/// with r = Log of the turn between,  d r / d b2 = Jr^-1(r)  and  d r / d b1 = -Jl^-1(r).
#pragma once

#include <Eigen/Core>

#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::vision {

/// See the file comment.
template <class S>
struct BasicCameraCorrection {
  using Scalar = S;
  using Step = Eigen::Matrix<S, 4, 1>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr int dof = 4;
  static constexpr smoother::Role role = smoother::Role::chain;
  static constexpr const char* name = "camera correction";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"time offset", "boresight right", "boresight down", "boresight forward"};
    return i >= 0 && i < 4 ? names[i] : "?";
  }
  /// First axis of each part in the tangent vector.
  enum Axis : int { offset = 0, boresight = 1 };

  S time_offset_s{0};                 ///< d
  Matrix3 R_nc{Matrix3::Identity()};  ///< nominal camera axes from true ones

  /// The turn as a vector about the camera's axes, rad.
  [[nodiscard]] Vector3 boresight_rad() const { return so3::log(R_nc); }

  [[nodiscard]] BasicCameraCorrection retract(const Step& step) const {
    return {time_offset_s + step[offset], R_nc * so3::exp(step.template tail<3>())};
  }
  [[nodiscard]] Step local(const BasicCameraCorrection& y) const {
    Step step;
    step << y.time_offset_s - time_offset_s, so3::log(R_nc.transpose() * y.R_nc);
    return step;
  }
  /// 10 ms bend a path by a tenth of a millimetre, 10 mrad an image by a pixel's tenth.
  [[nodiscard]] static Step linearisation_scale() { return Step::Constant(1e-2); }
};

using CameraCorrection = BasicCameraCorrection<double>;  ///< in double precision

/// A correction and how well it is known.
template <class Scalar>
struct BasicCameraCorrectionEstimate {
  BasicCameraCorrection<Scalar> value{};
  Eigen::Matrix<Scalar, 4, 4, Eigen::DontAlign> covariance{Eigen::Matrix<Scalar, 4, 4>::Zero()};  ///< in the order of the tangent vector
};

using CameraCorrectionEstimate = BasicCameraCorrectionEstimate<double>;  ///< in double precision

/// How well a calibration is trusted, and how steady it is.
struct CameraCorrectionOptions {
  double offset_sigma_s{5e-3}, boresight_sigma_rad{5e-3};
  double offset_walk_s_sqrt_s{1e-5}, boresight_walk_rad_sqrt_s{1e-5};  ///< density of the walk: sigma after a second
  double renew_s{10};                                                  ///< a variable stands for so long
};

/// Covariance of the walk over a time.
template <class Scalar = double>
[[nodiscard]] inline Eigen::Matrix<Scalar, 4, 4> walk_covariance(const CameraCorrectionOptions& options, double duration_s) {
  const auto variance = [duration_s](double density) { return density * density * duration_s; };
  using Vector4 = Eigen::Matrix<Scalar, 4, 1>;
  Vector4 v = Vector4::Constant(variance(options.boresight_walk_rad_sqrt_s));
  v[BasicCameraCorrection<Scalar>::offset] = variance(options.offset_walk_s_sqrt_s);
  return v.asDiagonal();
}
/// Covariance before anything was seen.
template <class Scalar = double>
[[nodiscard]] inline Eigen::Matrix<Scalar, 4, 4> prior_covariance(const CameraCorrectionOptions& options) {
  using Vector4 = Eigen::Matrix<Scalar, 4, 1>;
  Vector4 v = Vector4::Constant(options.boresight_sigma_rad * options.boresight_sigma_rad);
  v[BasicCameraCorrection<Scalar>::offset] = options.offset_sigma_s * options.offset_sigma_s;
  return v.asDiagonal();
}

/// What is known of a correction from elsewhere; see the file comment.
template <class S>
struct BasicCameraCorrectionPriorFactor {
  using Scalar = S;
  using Correction = BasicCameraCorrection<S>;
  using Vector4 = Eigen::Matrix<S, 4, 1>;
  using Matrix4 = Eigen::Matrix<S, 4, 4>;
  static constexpr int max_rows = 4, max_keys = 1, max_columns = 4;
  static constexpr const char* name = "camera correction prior";

  smoother::Key<Correction> correction{};
  Correction mean{};
  Matrix4 root_information{Matrix4::Identity()};  ///< R, upper triangular

  /// Errors: not_positive_definite (also for a NaN).
  [[nodiscard]] static Result<BasicCameraCorrectionPriorFactor> make(const smoother::Key<Correction>& correction, const Correction& mean,
                                                                     const Matrix4& covariance) {
    const auto root = imu::square_root_information<4>(covariance);
    if (!root) return root.status();
    return BasicCameraCorrectionPriorFactor{correction, mean, *root};
  }

  [[nodiscard]] int rows() const { return 4; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(correction);
  }
  template <class Values>
  void evaluate(const Values& values, S* e) const {
    Eigen::Map<Vector4>{e} = root_information * mean.local(values(correction));
  }
  template <class Values>
  void linearise(const Values& values, S* e, smoother::JacobianRef<S> J) const {
    const Vector4 r = mean.local(values(correction));
    Eigen::Map<Vector4>{e} = root_information * r;
    J.template block<4, 1>(0, 0) = root_information.col(0);
    J.template block<4, 3>(0, 1) = root_information.template rightCols<3>() * so3::right_jacobian_inverse(r.template tail<3>());
  }
  S weigh(const S* e, S* w) const { return smoother::weigh_gaussian(e, 4, w); }
};

using CameraCorrectionPriorFactor = BasicCameraCorrectionPriorFactor<double>;  ///< in double precision

/// One correction goes over into the next; see the file comment.
template <class S>
struct BasicCameraCorrectionWalk {
  using Scalar = S;
  using Correction = BasicCameraCorrection<S>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Vector4 = Eigen::Matrix<S, 4, 1>;
  static constexpr int max_rows = 4, max_keys = 2, max_columns = 8;
  static constexpr const char* name = "camera correction walk";

  smoother::Key<Correction> from{}, to{};
  Vector4 weight{Vector4::Ones()};  ///< 1 / sigma(T)

  /// Errors: invalid_argument (a duration or a density that is not positive).
  [[nodiscard]] static Result<BasicCameraCorrectionWalk> make(const smoother::Key<Correction>& from, const smoother::Key<Correction>& to,
                                                              const CameraCorrectionOptions& options, double duration_s) {
    const Vector4 variance = walk_covariance<S>(options, duration_s).diagonal();
    if (!(duration_s > 0) || !(variance.minCoeff() > 1e-300) || !variance.allFinite())
      return failure(StatusCode::invalid_argument, "walk of a camera's correction: time and densities must be positive", -1, -1,
                     duration_s);
    return BasicCameraCorrectionWalk{from, to, variance.cwiseSqrt().cwiseInverse()};
  }

  [[nodiscard]] int rows() const { return 4; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(from), visit(to);
  }
  template <class Values>
  void evaluate(const Values& values, S* e) const {
    Eigen::Map<Vector4>{e} = weight.cwiseProduct(values(from).local(values(to)));
  }
  template <class Values>
  void linearise(const Values& values, S* e, smoother::JacobianRef<S> J) const {
    const Vector4 r = values(from).local(values(to));
    Eigen::Map<Vector4>{e} = weight.cwiseProduct(r);
    J(0, 0) = -weight[0], J(0, 4) = weight[0];
    const Vector3 turn = r.template tail<3>(), w = weight.template tail<3>();
    J.template block<3, 3>(1, 1) = -(w.asDiagonal() * so3::left_jacobian_inverse(turn));
    J.template block<3, 3>(1, 5) = w.asDiagonal() * so3::right_jacobian_inverse(turn);
  }
  S weigh(const S* e, S* w) const { return smoother::weigh_gaussian(e, 4, w); }
};

using CameraCorrectionWalk = BasicCameraCorrectionWalk<double>;  ///< in double precision

static_assert(smoother::Variable<CameraCorrection> && smoother::Factor<CameraCorrectionPriorFactor> &&
              smoother::Factor<CameraCorrectionWalk>);

}  // namespace searvins::vision
