// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Cameras for the tests of vision: that of a car, and random ones.
#pragma once

#include <Eigen/Core>

#include <searvins/imu/navigation_state.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/vision/camera_model.hpp>
#include <searvins/vision/rectification.hpp>
#include <searvins/vision/stereo_camera.hpp>

#include "support/property.hpp"

namespace searvins::test {

/// Axes of a camera that looks along the body's x axis (forward, left, up): x right, y down, z forward.
inline Eigen::Matrix3d forward_camera() {
  Eigen::Matrix3d R_bc;
  R_bc << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R_bc;
}

/// A wide image behind the windscreen, half a metre between the eyes.
inline vision::StereoCamera<double> street_camera() {
  vision::StereoCamera<double> c;
  c.fx_px = c.fy_px = 1000, c.cx_px = 1024, c.cy_px = 366, c.baseline_m = 0.5, c.width_px = 2048, c.height_px = 732;
  c.R_bc = forward_camera(), c.p_bc_m = {1.2, 0.25, 0.3};
  return c;
}

/// Any sensible stereo camera, anyhow on its body.
inline vision::StereoCamera<double> random_stereo_camera(Rng& rng) {
  vision::StereoCamera<double> c;
  c.width_px = integer(rng, 300, 2000), c.height_px = integer(rng, 200, 1500);
  c.fx_px = uniform(rng, 200, 2000), c.fy_px = c.fx_px * uniform(rng, 0.9, 1.1);
  c.cx_px = uniform(rng, 0.4, 0.6) * c.width_px, c.cy_px = uniform(rng, 0.4, 0.6) * c.height_px;
  c.baseline_m = uniform(rng, 0.05, 1);
  c.R_bc = so3::exp(random_vector<3>(rng, 1.7)), c.p_bc_m = random_vector<3>(rng, 2);
  return c;
}

/// The left camera of a well-known indoor data set (EuRoC), with its lens; and the pair.
inline vision::PinholeCamera<double> euroc_left() {
  return {752, 480, 458.654, 457.296, 367.215, 248.375, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0}};
}
inline vision::StereoCalibration<double> euroc_pair() {
  vision::StereoCalibration<double> pair;
  pair.eyes = {euroc_left(), vision::PinholeCamera<double>{
                                 752, 480, 457.587, 456.134, 379.999, 255.238, {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05, 0}}};
  Eigen::Matrix3d R_b_c0, R_b_c1;
  R_b_c0 << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247, 0.025715529948, -0.0257744366974,
      0.00375618835797, 0.999660727178;
  R_b_c1 << 0.0125552670891, -0.999755099723, 0.0182237714554, 0.999598781151, 0.0130119051815, 0.0251588363115, -0.0253898008918,
      0.0179005838253, 0.999517347078;
  pair.R_b_c0 = R_b_c0, pair.p_b_c0_m = {-0.0216401454975, -0.064676986768, 0.00981073058949};
  const Eigen::Vector3d p_b_c1_m{-0.0198435579556, 0.0453689425024, 0.00786212447038};
  pair.R_c1_c0 = R_b_c1.transpose() * R_b_c0, pair.t_c1_c0_m = R_b_c1.transpose() * (pair.p_b_c0_m - p_b_c1_m);
  return pair;
}

/// Any sensible camera with a lens that shows its whole image.
inline vision::PinholeCamera<double> random_pinhole(Rng& rng) {
  for (;;) {
    vision::PinholeCamera<double> c;
    c.width_px = integer(rng, 300, 2000), c.height_px = integer(rng, 200, 1500);
    c.fx_px = uniform(rng, 0.5, 1.5) * c.width_px, c.fy_px = c.fx_px * uniform(rng, 0.95, 1.05);
    c.cx_px = uniform(rng, 0.4, 0.6) * c.width_px, c.cy_px = uniform(rng, 0.4, 0.6) * c.height_px;
    c.lens = {uniform(rng, -0.3, 0.1), uniform(rng, -0.05, 0.1), uniform(rng, -0.005, 0.005), uniform(rng, -0.005, 0.005),
              uniform(rng, -0.01, 0.01)};
    if (check(c).ok()) return c;
  }
}

/// Any sensible pair: two such cameras side by side, turned against each other by some degrees.
inline vision::StereoCalibration<double> random_pair(Rng& rng) {
  vision::StereoCalibration<double> pair;
  pair.eyes = {random_pinhole(rng), random_pinhole(rng)};
  while (pair.eyes[1].width_px != pair.eyes[0].width_px) {
    auto& right = pair.eyes[1];
    right = pair.eyes[0];
    right.fx_px *= uniform(rng, 0.97, 1.03), right.fy_px = right.fx_px, right.cx_px += uniform(rng, -5, 5),
                                             right.lens.k1 += uniform(rng, -0.01, 0.01);
  }
  pair.eyes[1].height_px = pair.eyes[0].height_px;
  pair.R_c1_c0 = so3::exp(random_vector<3>(rng, 0.05));
  const Eigen::Vector3d right_c0_m = uniform(rng, 0.05, 1) * Eigen::Vector3d{1, uniform(rng, -0.05, 0.05), uniform(rng, -0.05, 0.05)};
  pair.t_c1_c0_m = -(pair.R_c1_c0 * right_c0_m);
  pair.R_b_c0 = so3::exp(random_vector<3>(rng, 1.5)), pair.p_b_c0_m = random_vector<3>(rng, 2);
  return pair;
}

}  // namespace searvins::test
