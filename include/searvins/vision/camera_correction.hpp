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
#include <searvins/math/so3.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::vision {

/// See the file comment.
struct CameraCorrection {
  using Scalar = double;
  using Step = Eigen::Vector4d;
  static constexpr int dof = 4;
  static constexpr smoother::Role role = smoother::Role::chain;
  static constexpr const char* name = "camera correction";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"time offset", "boresight right", "boresight down", "boresight forward"};
    return i >= 0 && i < 4 ? names[i] : "?";
  }
  /// First axis of each part in the tangent vector.
  enum Axis : int { offset = 0, boresight = 1 };

  double time_offset_s{0};                            ///< d
  Eigen::Matrix3d R_nc{Eigen::Matrix3d::Identity()};  ///< nominal camera axes from true ones

  /// The turn as a vector about the camera's axes, rad.
  [[nodiscard]] Eigen::Vector3d boresight_rad() const { return so3::log(R_nc); }

  [[nodiscard]] CameraCorrection retract(const Step& step) const {
    return {time_offset_s + step[offset], R_nc * so3::exp(step.tail<3>())};
  }
  [[nodiscard]] Step local(const CameraCorrection& y) const {
    Step step;
    step << y.time_offset_s - time_offset_s, so3::log(R_nc.transpose() * y.R_nc);
    return step;
  }
  /// 10 ms bend a path by a tenth of a millimetre, 10 mrad an image by a pixel's tenth.
  [[nodiscard]] static Step linearisation_scale() { return Step::Constant(1e-2); }
};

/// A correction and how well it is known.
struct CameraCorrectionEstimate {
  CameraCorrection value{};
  Eigen::Matrix<double, 4, 4, Eigen::DontAlign> covariance{Eigen::Matrix4d::Zero()};  ///< in the order of the tangent vector
};

/// How well a calibration is trusted, and how steady it is.
struct CameraCorrectionOptions {
  double offset_sigma_s{5e-3}, boresight_sigma_rad{5e-3};
  double offset_walk_s_sqrt_s{1e-5}, boresight_walk_rad_sqrt_s{1e-5};  ///< density of the walk: sigma after a second
  double renew_s{10};                                                  ///< a variable stands for so long
};

/// Covariance of the walk over a time.
[[nodiscard]] inline Eigen::Matrix4d walk_covariance(const CameraCorrectionOptions& options, double duration_s) {
  const auto variance = [duration_s](double density) { return density * density * duration_s; };
  Eigen::Vector4d v = Eigen::Vector4d::Constant(variance(options.boresight_walk_rad_sqrt_s));
  v[CameraCorrection::offset] = variance(options.offset_walk_s_sqrt_s);
  return v.asDiagonal();
}
/// Covariance before anything was seen.
[[nodiscard]] inline Eigen::Matrix4d prior_covariance(const CameraCorrectionOptions& options) {
  Eigen::Vector4d v = Eigen::Vector4d::Constant(options.boresight_sigma_rad * options.boresight_sigma_rad);
  v[CameraCorrection::offset] = options.offset_sigma_s * options.offset_sigma_s;
  return v.asDiagonal();
}

/// What is known of a correction from elsewhere; see the file comment.
struct CameraCorrectionPriorFactor {
  using Scalar = double;
  static constexpr int max_rows = 4, max_keys = 1, max_columns = 4;
  static constexpr const char* name = "camera correction prior";

  smoother::Key<CameraCorrection> correction{};
  CameraCorrection mean{};
  Eigen::Matrix4d root_information{Eigen::Matrix4d::Identity()};  ///< R, upper triangular

  /// Errors: not_positive_definite (also for a NaN).
  [[nodiscard]] static Result<CameraCorrectionPriorFactor> make(const smoother::Key<CameraCorrection>& correction, const CameraCorrection& mean,
                                                                const Eigen::Matrix4d& covariance) {
    const auto root = imu::square_root_information<4>(covariance);
    if (!root) return root.status();
    return CameraCorrectionPriorFactor{correction, mean, *root};
  }

  [[nodiscard]] int rows() const { return 4; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(correction);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector4d>{e} = root_information * mean.local(values(correction));
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    const CameraCorrection::Step r = mean.local(values(correction));
    Eigen::Map<Eigen::Vector4d>{e} = root_information * r;
    J.block<4, 1>(0, 0) = root_information.col(0);
    J.block<4, 3>(0, 1) = root_information.rightCols<3>() * so3::right_jacobian_inverse(r.tail<3>());
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 4, w); }
};

/// One correction goes over into the next; see the file comment.
struct CameraCorrectionWalk {
  using Scalar = double;
  static constexpr int max_rows = 4, max_keys = 2, max_columns = 8;
  static constexpr const char* name = "camera correction walk";

  smoother::Key<CameraCorrection> from{}, to{};
  Eigen::Vector4d weight{Eigen::Vector4d::Ones()};  ///< 1 / sigma(T)

  /// Errors: invalid_argument (a duration or a density that is not positive).
  [[nodiscard]] static Result<CameraCorrectionWalk> make(const smoother::Key<CameraCorrection>& from, const smoother::Key<CameraCorrection>& to,
                                                         const CameraCorrectionOptions& options, double duration_s) {
    const Eigen::Vector4d variance = walk_covariance(options, duration_s).diagonal();
    if (!(duration_s > 0) || !(variance.minCoeff() > 1e-300) || !variance.allFinite())
      return failure(StatusCode::invalid_argument, "walk of a camera's correction: time and densities must be positive", -1, -1, duration_s);
    return CameraCorrectionWalk{from, to, variance.cwiseSqrt().cwiseInverse()};
  }

  [[nodiscard]] int rows() const { return 4; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(from), visit(to);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Map<Eigen::Vector4d>{e} = weight.cwiseProduct(values(from).local(values(to)));
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    const CameraCorrection::Step r = values(from).local(values(to));
    Eigen::Map<Eigen::Vector4d>{e} = weight.cwiseProduct(r);
    J(0, 0) = -weight[0], J(0, 4) = weight[0];
    const Eigen::Vector3d turn = r.tail<3>(), w = weight.tail<3>();
    J.block<3, 3>(1, 1) = -(w.asDiagonal() * so3::left_jacobian_inverse(turn));
    J.block<3, 3>(1, 5) = w.asDiagonal() * so3::right_jacobian_inverse(turn);
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 4, w); }
};

static_assert(smoother::Variable<CameraCorrection> && smoother::Factor<CameraCorrectionPriorFactor> && smoother::Factor<CameraCorrectionWalk>);

}  // namespace searvins::vision
