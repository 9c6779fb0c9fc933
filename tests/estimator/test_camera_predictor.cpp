// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/estimator/camera_predictor.hpp>

#include <cmath>
#include <optional>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/math/so3.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::CameraPredictor;

namespace {

/// A body that turns and accelerates evenly, seen from its antenna.
struct Flight {
  explicit Flight(Rng& rng)
      : R_0(so3::exp(random_vector(rng, 3))), rate_b(random_vector(rng, 0.5)), p_0(random_vector(rng, 50)), v_0(random_vector(rng, 20)),
        a(random_vector(rng, 4)), lever_b(random_vector(rng, 2)) {
    camera.R_bc = so3::exp(random_vector(rng, 3));
    camera.p_bc_m = random_vector(rng, 2);
    R_en = geodesy::ecef_from_enu(place);
    origin_e = geodesy::ecef_from_geodetic(place);
  }
  [[nodiscard]] Eigen::Matrix3d R_nb(double t) const { return R_0 * so3::exp(Eigen::Vector3d{rate_b * t}); }
  [[nodiscard]] Eigen::Vector3d body_n(double t) const { return p_0 + v_0 * t + 0.5 * a * t * t; }
  [[nodiscard]] Eigen::Vector3d camera_n(double t) const { return body_n(t) + R_nb(t) * camera.p_bc_m; }
  /// What predict() gives, `jump_n_m` away from the truth.
  [[nodiscard]] estimator::RtkSolution at(double t, const Eigen::Vector3d& jump_n_m = Eigen::Vector3d::Zero()) const {
    estimator::RtkSolution s;
    s.time = GpsTime{}.plus_seconds(1000 + t);
    s.has_attitude = true;
    s.R_nb = R_nb(t);
    s.position_e_m = origin_e + R_en * (body_n(t) + s.R_nb * lever_b + jump_n_m);
    s.velocity_e_mps = R_en * (v_0 + a * t + s.R_nb * rate_b.cross(lever_b));
    return s;
  }

  Eigen::Matrix3d R_0, R_en;
  Eigen::Vector3d rate_b, p_0, v_0, a, lever_b, origin_e;
  geodesy::Geodetic place{0.8, 0.2, 300};
  vision::StereoCamera<double> camera{};
};

}  // namespace

TEST_CASE("camera predictor: rotation and way of the camera, whatever its place and the antenna's") {
  for_all_seeds(100, [](Rng& rng) {
    const Flight f(rng);
    CameraPredictor predictor{f.camera, f.lever_b};
    const double t = uniform(rng, 0, 2), dt = uniform(rng, 0.03, 0.2);
    CHECK_FALSE(predictor.motion_to(f.at(t)).has_value());
    const auto motion = predictor.motion_to(f.at(t + dt, random_vector(rng, 0.5)));  // a fix came between: positions jump
    REQUIRE(motion.has_value());
    const Eigen::Matrix3d R_nc0 = f.R_nb(t) * f.camera.R_bc, R_nc1 = f.R_nb(t + dt) * f.camera.R_bc;
    CHECK((motion->R_prev_cur - R_nc0.transpose() * R_nc1).norm() < 1e-6);
    const Eigen::Vector3d way = R_nc0.transpose() * (f.camera_n(t + dt) - f.camera_n(t));
    // The antenna's swing about the body has a jerk of rate^3 lever; axes turn by the way over the Earth's radius.
    const double swing_m = std::pow(f.rate_b.norm(), 3) * f.lever_b.norm() * std::pow(dt, 3) / 12;
    CHECK((motion->t_prev_cur_m - way).norm() < swing_m + 1e-4);
    // A point that stands still is expected where it is.
    const Eigen::Vector3d point_n = f.camera_n(t) + R_nc0 * Eigen::Vector3d{0.3, -0.2, 12};
    const Eigen::Vector3d expected = motion->to_current(R_nc0.transpose() * (point_n - f.camera_n(t)));
    CHECK((expected - R_nc1.transpose() * (point_n - f.camera_n(t + dt))).norm() < 2e-3);
  });
}

TEST_CASE("camera predictor: nothing where a prediction is missing, has no attitude, or lies too far back") {
  Rng rng{4};
  const Flight f(rng);
  CameraPredictor predictor{f.camera, f.lever_b};
  (void)predictor.motion_to(f.at(0));
  CHECK_FALSE(predictor.motion_to(std::nullopt).has_value());
  CHECK_FALSE(predictor.motion_to(f.at(0.2)).has_value());  // the frame before had none
  CHECK(predictor.motion_to(f.at(0.3)).has_value());
  estimator::RtkSolution level = f.at(0.4);
  level.has_attitude = false;
  CHECK_FALSE(predictor.motion_to(level).has_value());
  (void)predictor.motion_to(f.at(0.5));
  CHECK_FALSE(predictor.motion_to(f.at(2.0)).has_value());
  CHECK_FALSE(predictor.motion_to(f.at(1.9)).has_value());  // time that runs back
}
