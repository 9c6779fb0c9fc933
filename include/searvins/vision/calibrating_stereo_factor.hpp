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

#include <searvins/core/status.hpp>
#include <searvins/imu/navigation_state.hpp>
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
  double late_s{0};                                          ///< s
  Eigen::Vector3d v_w_mps{Eigen::Vector3d::Zero()};          ///< velocity of the body
  Eigen::Vector3d rate_b_radps{Eigen::Vector3d::Zero()};     ///< relative to the Earth
};

/// Where the body carries the camera in u seconds: its place in the body at the state, by which a frame of u seconds later is seen.
[[nodiscard]] inline StereoCamera<double> carried(const StereoCamera<double>& camera, double u_s, const Eigen::Vector3d& v_b_mps,
                                                  const Eigen::Vector3d& rate_b_radps) {
  StereoCamera<double> there = camera;
  const Eigen::Matrix3d turn = so3::exp(Eigen::Vector3d{u_s * rate_b_radps});
  there.p_bc_m = turn * camera.p_bc_m + u_s * v_b_mps;
  there.R_bc = turn * camera.R_bc;
  return there;
}

/// See the file comment.
template <robust::Loss Loss = robust::Huber<double>>
struct CalibratingStereoFactor {
  using Scalar = double;
  using State = imu::NavigationState;
  static constexpr int max_rows = 3, max_keys = 3, max_columns = State::dof + Landmark::dof + CameraCorrection::dof;
  static constexpr const char* name = "stereo, calibrating";
  /// Attitude and position of the state, all of the landmark and of the correction.
  template <class V>
  static constexpr int leading_axes() {
    return StereoFactor<Loss>::template leading_axes<V>();
  }

  StereoFactor<Loss> seen{};  ///< by the camera as it was calibrated
  smoother::Key<CameraCorrection> correction{};
  FrameMotion motion{};

  /// Errors: those of StereoFactor::make; non_finite (motion).
  [[nodiscard]] static Result<CalibratingStereoFactor> make(const StereoFactor<Loss>& seen, const smoother::Key<CameraCorrection>& correction,
                                                            const FrameMotion& motion) {
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
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    const View view = see(values);
    Eigen::Matrix3d P;
    seen.whiten(view.p_c_m, &P, e);
    const Eigen::Matrix3d& R_wb = values(seen.state).R_wb;
    const Eigen::Matrix3d RP = seen.root_information * P;
    const Eigen::Matrix3d N = RP * (seen.camera.R_bc * values(correction).R_nc).transpose();
    const Eigen::Matrix3d B = N * view.R_later.transpose(), d_landmark = B * R_wb.transpose();
    constexpr int landmark = State::dof, offset = landmark + Landmark::dof, boresight = offset + 1;
    J.block<3, 3>(0, State::attitude) = B * so3::skew(view.a_m);
    J.block<3, 3>(0, State::position) = -d_landmark;
    J.block<3, 3>(0, landmark) = d_landmark;
    J.block<3, 1>(0, offset) = N * view.p_b_m.cross(motion.rate_b_radps) - d_landmark * motion.v_w_mps;
    J.block<3, 3>(0, boresight) = RP * so3::skew(view.p_c_m);
  }
  double weigh(const double* e, double* w) const { return seen.weigh(e, w); }

 private:
  /// The landmark on its way into the camera.
  struct View {
    Eigen::Vector3d a_m, p_b_m, p_c_m;
    Eigen::Matrix3d R_later;  ///< Exp(u w)
  };
  template <class Values>
  [[nodiscard]] View see(const Values& values) const {
    const State& x = values(seen.state);
    const CameraCorrection& c = values(correction);
    const double u_s = motion.late_s + c.time_offset_s;
    View view;
    view.R_later = so3::exp(Eigen::Vector3d{u_s * motion.rate_b_radps});
    view.a_m = x.R_wb.transpose() * (values(seen.landmark).p_w_m - x.p_wb_m - u_s * motion.v_w_mps);
    view.p_b_m = view.R_later.transpose() * view.a_m;
    view.p_c_m = c.R_nc.transpose() * seen.camera.camera_from_body(view.p_b_m);
    return view;
  }
};

static_assert(smoother::Factor<CalibratingStereoFactor<>>);

}  // namespace searvins::vision
