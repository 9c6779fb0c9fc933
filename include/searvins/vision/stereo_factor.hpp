// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A frame sees a landmark with both eyes [paper eq. (stereo-factor)].
///
///     p_b = R_wb' (l - p_wb)        p_c = R_bc' (p_b - p_bc)
///     e   = R (pi_s(p_c) - z)       R' R = (s^2 Sigma)^-1, Sigma of z = (uL, uR, v), s the scale from PnP's support
///     rho(|e|) under Huber          an observation is one decision, so its three rows share a weight
///
/// By one eye (Eyes::left) the row of uR is zero, and R' R the information of (uL, v) alone: depth then comes from the motion between frames.
///
/// With P = d pi_s / d p_c (stereo_camera.hpp) and A = R P R_bc',
///
///     d e / d theta = A [p_b]x        d e / d p_wb = -A R_wb'        d e / d l = A R_wb'
///
/// A landmark behind the camera, where pi_s is undefined. Optimisers commonly set the Jacobian to zero there: the point has no way back,
/// its block is singular, and the update fails. An observation that counts for nothing there makes the forbidden place the cheapest one;
/// one that jumps to another cost stops the step control of the whole window; and pi_s itself pulls with 1/z^2: a point at 0.1 m of a
/// camera outweighs thousands at 20 m and would drag the vehicle, whatever the loss. So pi_s is continued by its tangent in depth
/// (stereo_camera.hpp) where the point comes so near that the observation denies it anyway: where the predicted disparity exceeds the
/// seen one, d, by d and ten of its sigmas,
///
///     z < z_t = fx B / (2 d + 10 s sigma_d)        sigma_d^2 = Sigma_11 + Sigma_22 - 2 Sigma_12,  d = 0 if negative
///
/// about half the depth that was seen. For z >= z_t, which is where residuals are less than gross, nothing differs from pi_s. Below,
///
///     - e is continuously differentiable for every landmark: step control compares honest costs, and there is no edge to stop at
///     - d e / d l has full rank everywhere: the landmark's block is positive definite by one observation, without any prior
///     - the depth that one observation asks for is reached from behind by Newton's method, in a few steps, without overshoot
///     - a metre of depth costs (z_seen / z_t)^2 times the pixels that it costs at z_seen (from 4 where the disparity is many sigmas), so
///       that the loss bounds the pull in metres too
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include <searvins/core/status.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/vision/landmark.hpp>
#include <searvins/vision/stereo_camera.hpp>

namespace searvins::vision {

/// Noise of an observation with the same sigma, independent, on uL, uR and v.
template <class Scalar = double>
[[nodiscard]] inline Eigen::Matrix<Scalar, 3, 3> pixel_covariance_px2(std::type_identity_t<Scalar> sigma_px) {
  return sigma_px * sigma_px * Eigen::Matrix<Scalar, 3, 3>::Identity();
}

/// Which pixels of an observation count.
enum class Eyes : std::uint8_t { both, left };

/// See the file comment.
template <robust::Loss Loss = robust::Huber<double>>
struct StereoFactor {
  using Scalar = math::Deferred<double, Loss>;
  using State = math::Deferred<imu::NavigationState, Loss>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  static constexpr int max_rows = 3, max_keys = 2, max_columns = State::dof + Landmark::dof;
  static constexpr const char* name = "stereo";
  /// Attitude and position of the state, all of the landmark.
  template <class V>
  static constexpr int leading_axes() {
    return std::is_same_v<V, State> ? 6 : V::dof;
  }
  static constexpr double kGrossSigmas = 10;  ///< of disparity: see the file comment

  smoother::Key<State> state{};
  smoother::Key<Landmark> landmark{};
  StereoCamera<Scalar> camera{};
  StereoPixel<Scalar> pixel{StereoPixel<Scalar>::Zero()};  ///< z
  Matrix3 root_information{Matrix3::Identity()};           ///< R, upper triangular, 1/px
  Loss loss{};
  double tangent_below_m{0};  ///< z_t

  /// `covariance_px2`: Sigma. `support_scale`: s >= 1 of the frame's PnP, 1 where it was well supported. By the left eye alone, uR says but where
  /// pi_s is continued from.
  /// Errors: invalid_argument (scale), non_finite (pixel), not_positive_definite (covariance, also NaN).
  [[nodiscard]] static Result<StereoFactor> make(const smoother::Key<State>& state, const smoother::Key<Landmark>& landmark,
                                                 const StereoCamera<Scalar>& camera, const StereoPixel<Scalar>& pixel,
                                                 const Matrix3& covariance_px2, double support_scale = 1, const Loss& loss = {},
                                                 Eyes eyes = Eyes::both) {
    if (!(support_scale >= 1) || !std::isfinite(support_scale))
      return failure(StatusCode::invalid_argument, "scale of a stereo observation's sigma must be 1 or more", -1, -1, support_scale);
    if (!pixel.allFinite()) return failure(StatusCode::non_finite, "stereo observation with a NaN or infinity");
    const auto root = imu::square_root_information<3>(covariance_px2);
    if (!root) return root.status();
    const double sigma_px =
        support_scale * std::sqrt(covariance_px2(0, 0) + covariance_px2(1, 1) - covariance_px2(0, 1) - covariance_px2(1, 0));
    const double nearest_px = 2 * std::max(pixel[0] - pixel[1], 0.0) + kGrossSigmas * sigma_px;
    const Matrix3 rows = eyes == Eyes::both ? *root : left_root_information(covariance_px2);
    return StereoFactor{state, landmark, camera, pixel, rows / support_scale, loss, camera.depth_m(nearest_px)};
  }

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state), visit(landmark);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    const State& x = values(state);
    const Vector3 p_b = x.R_wb.transpose() * (values(landmark).p_w_m - x.p_wb_m);
    whiten(camera.camera_from_body(p_b), nullptr, e);
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<Scalar> J) const {
    const State& x = values(state);
    const Vector3 p_b = x.R_wb.transpose() * (values(landmark).p_w_m - x.p_wb_m);
    Matrix3 P;
    whiten(camera.camera_from_body(p_b), &P, e);
    const Matrix3 A = root_information * (P * camera.R_bc.transpose());
    const Matrix3 d_landmark = A * x.R_wb.transpose(), d_attitude = A * so3::skew(p_b);
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 3; ++i) {
        J(i, State::attitude + c) = d_attitude(i, c);
        J(i, State::position + c) = -d_landmark(i, c);
        J(i, State::dof + c) = d_landmark(i, c);
      }
  }
  double weigh(const double* e, double* w) const {
    const double z2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    std::fill_n(w, 3, loss.weight(z2));
    return loss.rho(z2);
  }
  /// e of a landmark at p_c in camera axes and, if asked, d pi_s / d p_c.
  void whiten(const Vector3& p_c_m, Matrix3* d_p_c, double* e) const {
    Eigen::Map<Vector3>{e} = root_information * (camera.continued(p_c_m, d_p_c, tangent_below_m) - pixel);
  }

 private:
  /// R of (uL, v) in the rows and columns of uL and v: the factor of [a b; b c], inverted.
  [[nodiscard]] static Matrix3 left_root_information(const Matrix3& covariance_px2) {
    const double a = covariance_px2(0, 0), b = covariance_px2(2, 0), c = covariance_px2(2, 2);
    const double root_c = std::sqrt(c), root_a = std::sqrt(a - b * b / c);
    Matrix3 R = Matrix3::Zero();
    R(0, 0) = 1 / root_a, R(0, 2) = -b / (c * root_a), R(2, 2) = 1 / root_c;
    return R;
  }
};

static_assert(smoother::Factor<StereoFactor<>>);

}  // namespace searvins::vision
