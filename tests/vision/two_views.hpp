// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Random streets seen twice by a stereo camera that has moved: what PnP and admission are tested with.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <searvins/math/so3.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/pnp.hpp>
#include <searvins/vision/stereo_camera.hpp>

#include "support/property.hpp"

namespace searvins::test {

/// A camera of the kind that cars carry.
inline vision::StereoCamera<double> car_camera() {
  vision::StereoCamera<double> camera;
  camera.fx_px = 718.9, camera.fy_px = 721.5, camera.cx_px = 607.2, camera.cy_px = 185.2;
  camera.baseline_m = 0.537;
  camera.width_px = 1241, camera.height_px = 376;
  return camera;
}

/// A metre or so forward, a few degrees of turn.
inline vision::CameraMotion random_motion(Rng& rng) {
  vision::CameraMotion motion;
  motion.R_prev_cur = so3::exp(random_vector<3>(rng, 0.05));
  motion.t_prev_cur_m = Eigen::Vector3d{uniform(rng, -0.1, 0.1), uniform(rng, -0.05, 0.05), uniform(rng, -0.3, 1.5)};
  return motion;
}

/// A point that the camera sees at a depth of 4 to `far_m`.
inline Eigen::Vector3d random_point(Rng& rng, const vision::StereoCamera<double>& camera, double far_m = 50) {
  const double z = 1 / uniform(rng, 1 / far_m, 1 / 4.0);
  const double u = uniform(rng, 60, camera.width_px - 1), v = uniform(rng, 0, camera.height_px - 1);
  return {(u - camera.cx_px) * z / camera.fx_px, (v - camera.cy_px) * z / camera.fy_px, z};
}

/// [u_left, u_right, v] with white noise.
inline vision::StereoPixel<double> look_at(Rng& rng, const vision::StereoCamera<double>& camera, const Eigen::Vector3d& p_c_m,
                                           double sigma_px) {
  vision::StereoPixel<double> pixel = camera.continued(p_c_m);
  for (int i = 0; i < 3; ++i) pixel[i] += normal(rng, sigma_px);
  return pixel;
}

/// The same point before and after.
inline vision::PixelPair seen_twice(Rng& rng, const vision::StereoCamera<double>& camera, const vision::CameraMotion& motion,
                                    const Eigen::Vector3d& p_prev_m, double sigma_px) {
  return {look_at(rng, camera, p_prev_m, sigma_px), look_at(rng, camera, motion.to_current(p_prev_m), sigma_px)};
}

/// A pair that was matched wrongly: the second observation is of another point.
inline vision::PixelPair mismatched(Rng& rng, const vision::StereoCamera<double>& camera, double sigma_px) {
  return {look_at(rng, camera, random_point(rng, camera), sigma_px), look_at(rng, camera, random_point(rng, camera), sigma_px)};
}

}  // namespace searvins::test
