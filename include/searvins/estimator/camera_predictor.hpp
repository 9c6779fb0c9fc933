// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How the camera has moved since the frame before, for a frontend that searches where its points should be (vision::VisionFrontend).
///
/// Estimator::predict() gives antenna, velocity and attitude at a frame from the readings up to it. Of two frames, 0 before 1, in axes n
/// (East-North-Up; its turn over a frame's way, way / 6400 km, is far below a pixel):
///
///     rotation       R_c0_c1 = (R_nb0 R_bc)' (R_nb1 R_bc)
///     antenna        d_n = (v_n0 + v_n1) / 2 dt                          not the difference of positions: a fix or a correction between
///                                                                      the frames would look like motion, in velocity it is small
///     camera         c_n = d_n + (R_nb1 - R_nb0) (p_bc - l_b)            l: lever arm of the antenna
///     motion         t_c0_c1 = (R_nb0 R_bc)' c_n
///
/// The mean of two velocities misses the way by (da/dt) dt^3 / 12: 0.1 mm at 10 Hz and a jerk of 1 m/s^3.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>

#include <searvins/core/time.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/stereo_camera.hpp>

namespace searvins::estimator {

/// See the file comment. Ask once a frame that the frontend is offered, in order of time. Scalar: double, as that of the solutions.
template <class Scalar>
class BasicCameraPredictor {
 public:
  using Solution = math::Deferred<RtkSolution, Scalar>;
  using CameraMotion = math::Deferred<vision::CameraMotion, Scalar>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  /// The camera in the body, and the antenna's lever arm in body axes, metres.
  BasicCameraPredictor(const vision::StereoCamera<Scalar>& camera, const Vector3& lever_arm_b_m)
      : R_bc_(camera.R_bc), arm_b_m_(camera.p_bc_m - lever_arm_b_m) {}

  /// Motion of the left camera since the last frame; nothing at the first one, or where either has no attitude, or more than
  /// `kLongestS` lie between them. `now`: the prediction at the frame, nothing while there is none.
  [[nodiscard]] std::optional<CameraMotion> motion_to(const std::optional<Solution>& now) {
    std::optional<Place> place;
    if (now && now->has_attitude && now->velocity_e_mps.allFinite() && now->R_nb.allFinite()) {
      const Matrix3 R_en = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(now->position_e_m));
      place = Place{now->time, now->R_nb, R_en.transpose() * now->velocity_e_mps};
    }
    std::optional<CameraMotion> motion;
    if (place && before_) motion = between(*before_, *place);
    before_ = place;
    return motion;
  }

 private:
  static constexpr double kLongestS = 1;

  struct Place {
    GpsTime time{};
    Matrix3 R_nb{Matrix3::Identity()};
    Vector3 v_n_mps{Vector3::Zero()};
  };

  [[nodiscard]] std::optional<CameraMotion> between(const Place& a, const Place& b) const {
    const double dt_s = seconds_between(a.time, b.time);
    if (!(dt_s > 0) || dt_s > kLongestS) return std::nullopt;
    const Vector3 way_n_m = 0.5 * dt_s * (a.v_n_mps + b.v_n_mps) + (b.R_nb - a.R_nb) * arm_b_m_;
    const Matrix3 R_cn = (a.R_nb * R_bc_).transpose();
    CameraMotion motion{R_cn * b.R_nb * R_bc_, R_cn * way_n_m};
    return motion.finite() ? std::optional{motion} : std::nullopt;
  }

  Matrix3 R_bc_;
  Vector3 arm_b_m_;
  std::optional<Place> before_;
};
using CameraPredictor = BasicCameraPredictor<double>;  ///< in double precision

}  // namespace searvins::estimator
