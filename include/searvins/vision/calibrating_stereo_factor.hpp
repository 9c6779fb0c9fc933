// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A frame sees a landmark with both eyes, by a camera whose clock and axes are only nearly known (camera_correction.hpp).
///
/// The frame's stamp lies s after the state, its exposure s + d, with the time offset d of the correction. In u = s + d the body moves on by its
/// velocity and angular rate; R_nc is the correction's turn:
///
///     p_wb(u) = p_wb + u v        R_wb(u) = R_wb Exp(u w)
///
///     a   = R_wb' (l - p_wb - u v)          the landmark from the body at its place at u, in axes of the state's body
///     p_b = Exp(-u w) a                     in the axes at u
///     p_n = R_bn' (p_b - p_bc)              as the calibration has it
///     p_c = R_nc' p_n
///     e   = R (pi_s(p_c) - z)               stereo_factor.hpp, with the same continuation behind the camera and the same Huber loss
///
/// v (in w) and w are those of the state as it was predicted when the frame came, and stay: an error of 0.1 m/s in v moves the camera by half
/// a millimetre in 5 ms. This keeps velocity and biases out of the factor, as one keeps them out by moving the pixels along their own paths
/// instead. Neglected with the acceleration g of the vehicle: g u^2 / 2, 0.04 mm at 3 m/s^2 and 5 ms.
///
/// With P = d pi_s / d p_c,  N = R P R_nc' R_bn'  and  B = N Exp(-u w),  d Exp(-u w) a / d u = -w x p_b - Exp(-u w) R_wb' v:
///
///     d e / d theta = B [a]x      d e / d p_wb = -B R_wb'      d e / d l = B R_wb'
///     d e / d d = N [p_b]x w - B R_wb' v                       d e / d b = R P [p_c]x
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <type_traits>

#include <searvins/core/status.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/vision/camera_correction.hpp>
#include <searvins/vision/landmark.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_factor.hpp>

namespace searvins::vision {

/// How a body moves about a state, and how long after it a frame was stamped.
struct FrameMotion {
  double late_s{0};                                       ///< s
  Eigen::Vector3d v_w_mps{Eigen::Vector3d::Zero()};       ///< velocity of the body
  Eigen::Vector3d rate_b_radps{Eigen::Vector3d::Zero()};  ///< relative to the Earth
};

/// Where the body carries the camera in u seconds: its place in the body at the state, by which a frame of u seconds later is seen.
template <class Scalar>
[[nodiscard]] inline StereoCamera<Scalar> carried(const StereoCamera<Scalar>& camera, std::type_identity_t<Scalar> u_s,
                                                  const math::Vector3<Scalar>& v_b_mps, const math::Vector3<Scalar>& rate_b_radps) {
  StereoCamera<Scalar> there = camera;
  const Eigen::Matrix<Scalar, 3, 3> turn = so3::exp(Eigen::Matrix<Scalar, 3, 1>{u_s * rate_b_radps});
  there.p_bc_m = turn * camera.p_bc_m + u_s * v_b_mps;
  there.R_bc = turn * camera.R_bc;
  return there;
}

/// See the file comment.
template <robust::Loss Loss = robust::Huber<double>>
struct CalibratingStereoFactor {
  using Scalar = math::Deferred<double, Loss>;
  using State = math::Deferred<imu::NavigationState, Loss>;
  using Correction = BasicCameraCorrection<Scalar>;
  using Motion = math::Deferred<FrameMotion, Loss>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  static constexpr int max_rows = 3, max_keys = 3, max_columns = State::dof + Landmark::dof + Correction::dof;
  static constexpr const char* name = "stereo, calibrating";
  /// Attitude and position of the state, all of the landmark and of the correction.
  template <class V>
  static constexpr int leading_axes() {
    return StereoFactor<Loss>::template leading_axes<V>();
  }

  StereoFactor<Loss> seen{};  ///< by the camera as it was calibrated
  smoother::Key<Correction> correction{};
  Motion motion{};

  /// Errors: those of StereoFactor::make; non_finite (motion).
  [[nodiscard]] static Result<CalibratingStereoFactor> make(const StereoFactor<Loss>& seen, const smoother::Key<Correction>& correction,
                                                            const Motion& motion) {
    if (!std::isfinite(motion.late_s) || !motion.v_w_mps.allFinite() || !motion.rate_b_radps.allFinite())
      return failure(StatusCode::non_finite, "motion of the body at a frame is not finite");
    return CalibratingStereoFactor{seen, correction, motion};
  }

  [[nodiscard]] int rows() const { return 3; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(seen.state), visit(seen.landmark), visit(correction);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    seen.whiten(see(values).p_c_m, nullptr, e);
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<Scalar> J) const {
    const View view = see(values);
    Matrix3 P;
    seen.whiten(view.p_c_m, &P, e);
    const Matrix3& R_wb = values(seen.state).R_wb;
    const Matrix3 RP = seen.root_information * P;
    const Matrix3 N = RP * (seen.camera.R_bc * values(correction).R_nc).transpose();
    const Matrix3 B = N * view.R_later.transpose(), d_landmark = B * R_wb.transpose();
    constexpr int landmark = State::dof, offset = landmark + Landmark::dof, boresight = offset + 1;
    J.template block<3, 3>(0, State::attitude) = B * so3::skew(view.a_m);
    J.template block<3, 3>(0, State::position) = -d_landmark;
    J.template block<3, 3>(0, landmark) = d_landmark;
    J.template block<3, 1>(0, offset) = N * view.p_b_m.cross(motion.rate_b_radps) - d_landmark * motion.v_w_mps;
    J.template block<3, 3>(0, boresight) = RP * so3::skew(view.p_c_m);
  }
  double weigh(const double* e, double* w) const { return seen.weigh(e, w); }

 private:
  /// The landmark on its way into the camera.
  struct View {
    Vector3 a_m, p_b_m, p_c_m;
    Matrix3 R_later;  ///< Exp(u w)
  };
  template <class Values>
  [[nodiscard]] View see(const Values& values) const {
    const State& x = values(seen.state);
    const Correction& c = values(correction);
    const double u_s = motion.late_s + c.time_offset_s;
    View view;
    view.R_later = so3::exp(Vector3{u_s * motion.rate_b_radps});
    view.a_m = x.R_wb.transpose() * (values(seen.landmark).p_w_m - x.p_wb_m - u_s * motion.v_w_mps);
    view.p_b_m = view.R_later.transpose() * view.a_m;
    view.p_c_m = c.R_nc.transpose() * seen.camera.camera_from_body(view.p_b_m);
    return view;
  }
};

static_assert(smoother::Factor<CalibratingStereoFactor<>>);

}  // namespace searvins::vision
