// SPDX-License-Identifier: BSD-3-Clause
// The policies of a camera's calibration on a small window: where the camera is, which factors a frame gets, how the correction is renewed, and what
// is left of it when the window is given up.
#include <searvins/estimator/camera_calibration.hpp>

#include <cmath>
#include <memory>
#include <vector>

#include <searvins/imu/navigation_prior.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::CalibratedCamera;
using estimator::KnownCamera;
using imu::NavigationState;
using vision::CameraCorrection;
using vision::FrameMotion;
using vision::Landmark;
using vision::StereoCamera;

namespace {

struct SmallCapacity {
  static constexpr int stereo_observations = 400;
};

struct CalibrationProblem {
  using Scalar = double;
  using Variables = smoother::Joined<smoother::Types<smoother::Capacity<NavigationState, 8>, smoother::Capacity<Landmark, 200>>, CalibratedCamera::Variables<SmallCapacity>>;
  using Factors = smoother::Joined<smoother::Types<smoother::Capacity<imu::NavigationPriorFactor, 8>, smoother::Capacity<vision::LandmarkPriorFactor, 200>>,
                                   CalibratedCamera::Factors<SmallCapacity>>;
  static constexpr int max_front_dimension = 200, member_capacity = 400;
  static constexpr std::size_t arena_scalars = 8 * 201 * 201;
};
using Smoother = smoother::FixedLagSmoother<CalibrationProblem>;

/// A car that turns; its camera's clock is late by offset_s and its axes are turned, and the policy is told the pictures.
struct TurningCar {
  static constexpr int kPoints = 20;
  Rng* rng;
  CameraCorrection real;
  std::unique_ptr<Smoother> smoother = std::make_unique<Smoother>();
  StereoCamera<double> nominal = street_camera();
  int frames{0};

  [[nodiscard]] static GpsTime time(int k) { return GpsTime::from_week_sow(2300, 100 + 2.0 * k); }
  /// A state with a frame of points of its own; two states see each point.
  void see(CalibratedCamera& policy) {
    Rng& r = *rng;
    const double rate = frames % 2 == 0 ? 0.5 : -0.4, speed = 6 + 2 * (frames % 3);
    NavigationState x;
    x.R_wb = so3::exp(Eigen::Vector3d{0, 0, 0.3 * frames}), x.p_wb_m = {3.0 * frames, 0, 0}, x.v_wb_mps = x.R_wb * Eigen::Vector3d{speed, 0, 0};
    const FrameMotion motion{0, x.v_wb_mps, {0, 0, rate}};
    const auto key = *smoother->add_variable(x, time(frames));
    REQUIRE(smoother->add_factor(*imu::NavigationPriorFactor::make(key, x, imu::NavigationSigmas{1e-4, 1e-3, 1, 0.1, 0.01, 0})).ok());
    policy.begin_frame(*smoother, time(frames));
    StereoCamera<double> truth = vision::carried(nominal, real.time_offset_s, x.R_wb.transpose() * x.v_wb_mps, motion.rate_b_radps);
    truth.R_bc = truth.R_bc * real.R_nc;
    const StereoCamera<double> there = policy.placed(nominal, x.R_wb, motion);
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d p_c_m{uniform(r, -6, 6), uniform(r, -3, 3), uniform(r, 8, 30)};
      const Eigen::Vector3d p_w_m = x.p_wb_m + x.R_wb * truth.body_from_camera(p_c_m);
      const auto landmark = *smoother->add_variable(Landmark{p_w_m}, time(frames));
      REQUIRE(smoother->add_factor(*vision::LandmarkPriorFactor::make(landmark, p_w_m, 0.02)).ok());  // a surveyed street
      const Eigen::Vector3d pixel = *nominal.project(p_c_m) + Eigen::Vector3d{normal(r, 0.3), normal(r, 0.3), normal(r, 0.3)};
      const auto f = policy.observation(key, landmark, nominal, there, motion, pixel, vision::pixel_covariance_px2(0.3));
      REQUIRE(f.ok());
      REQUIRE(smoother->add_factor(*f).ok());
    }
    ++frames;
    CHECK(smoother->optimise().status.ok());
    policy.remember(*smoother);
  }
  void let_oldest_leave() { REQUIRE(smoother->marginalise_oldest().status.ok()); }
};

double sigma(const CalibratedCamera& policy, int axis) { return std::sqrt(policy.estimate().covariance(axis, axis)); }

void check_estimate(const CalibratedCamera& policy, const CameraCorrection& real) {
  const CameraCorrection::Step off = policy.estimate().value.local(real);
  for (int i = 0; i < 4; ++i) CHECK(std::abs(off[i]) < 5 * sigma(policy, i));
}

}  // namespace

TEST_CASE("a known camera is where it was calibrated, or where the body carries it") {
  for_all_seeds(50, [](Rng& rng) {
    const StereoCamera<double> nominal = random_stereo_camera(rng);
    const Eigen::Matrix3d R_wb = so3::exp(random_vector<3>(rng, 2));
    const Eigen::Vector3d v_w = random_vector<3>(rng, 20), rate_b = random_vector<3>(rng, 1);
    const KnownCamera known;
    CHECK(known.placed(nominal, R_wb, {0, v_w, rate_b}).R_bc == nominal.R_bc);
    CHECK(known.placed(nominal, R_wb, {0, v_w, rate_b}).p_bc_m == nominal.p_bc_m);
    const double late_s = uniform(rng, -0.005, 0.005);
    const StereoCamera<double> there = known.placed(nominal, R_wb, {late_s, v_w, rate_b});
    // The body at the frame's time by itself, then the camera in it.
    const Eigen::Matrix3d R_later = R_wb * so3::exp(Eigen::Vector3d{late_s * rate_b});
    CHECK(close(R_wb * there.R_bc, R_later * nominal.R_bc, 1e-12));
    CHECK(close(R_wb * there.p_bc_m, late_s * v_w + R_later * nominal.p_bc_m, 1e-12));
    const CalibratedCamera fresh;  // nothing seen yet: the same place
    CHECK(close(fresh.placed(nominal, R_wb, {late_s, v_w, rate_b}).p_bc_m, there.p_bc_m, 1e-12));
    const auto f = known.observation({0, 1}, {0, 1}, nominal, there, {late_s, v_w, rate_b}, {9, 4, 3}, vision::pixel_covariance_px2(1));
    REQUIRE(f.ok());
    CHECK(f->camera.p_bc_m == there.p_bc_m);
  });
}

TEST_CASE("a correction is found, renewed without a break, and goes on when its first states have left") {
  for_all_seeds(10, [](Rng& rng) {
    vision::CameraCorrectionOptions options;
    options.renew_s = 5;
    CalibratedCamera policy{options};
    TurningCar car{&rng, {uniform(rng, -6e-3, 6e-3), so3::exp(random_vector<3>(rng, 5e-3))}};
    CHECK(sigma(policy, 0) == doctest::Approx(options.offset_sigma_s));
    for (int k = 0; k < 7; ++k) car.see(policy);
    check_estimate(policy, car.real);
    CHECK(sigma(policy, 0) < 0.2 * options.offset_sigma_s);
    CHECK(sigma(policy, 2) < 0.1 * options.boresight_sigma_rad);
    CHECK(car.smoother->window().count<CameraCorrection>() == 3);  // 0, 6 and 12 s
    const double before = sigma(policy, 0);
    for (int k = 0; k < 12; ++k) car.let_oldest_leave(), car.see(policy);
    check_estimate(policy, car.real);
    CHECK(sigma(policy, 0) < before);
    CHECK(car.smoother->window().count<CameraCorrection>() <= 4);  // those of states that left have left too
    // What is known of the camera is where landmarks begin: the truth.
    const NavigationState x;
    const FrameMotion motion{0, {8, 0, 0}, {0, 0, 0.4}};
    StereoCamera<double> truth = vision::carried(car.nominal, car.real.time_offset_s, motion.v_w_mps, motion.rate_b_radps);
    truth.R_bc = truth.R_bc * car.real.R_nc;
    const StereoCamera<double> there = policy.placed(car.nominal, x.R_wb, motion), wrong = KnownCamera{}.placed(car.nominal, x.R_wb, motion);
    CHECK((there.R_bc - truth.R_bc).norm() < 0.5 * (wrong.R_bc - truth.R_bc).norm() + 5e-4);
  });
}

TEST_CASE("a window that is given up takes nothing along: the next begins at the estimate, with three times its sigmas") {
  for_all_seeds(10, [](Rng& rng) {
    CalibratedCamera policy;
    TurningCar car{&rng, {uniform(rng, -6e-3, 6e-3), so3::exp(random_vector<3>(rng, 5e-3))}};
    for (int k = 0; k < 5; ++k) car.see(policy);
    const auto known = policy.estimate();
    car.smoother->clear();
    NavigationState x;
    const auto key = *car.smoother->add_variable(x, car.time(5));
    REQUIRE(car.smoother->add_factor(*imu::NavigationPriorFactor::make(key, x, imu::NavigationSigmas{})).ok());
    policy.begin_frame(*car.smoother, car.time(5));
    CHECK(car.smoother->optimise().status.ok());
    policy.remember(*car.smoother);
    CHECK(policy.estimate().value.local(known.value).norm() < 1e-9);
    for (int i = 0; i < 4; ++i) CHECK(std::sqrt(policy.estimate().covariance(i, i) / known.covariance(i, i)) == doctest::Approx(3).epsilon(0.05));
    // Again and again: never less than the calibration itself is worth.
    for (int k = 6; k < 20; ++k) {
      car.smoother->clear();
      const auto again = *car.smoother->add_variable(x, car.time(k));
      REQUIRE(car.smoother->add_factor(*imu::NavigationPriorFactor::make(again, x, imu::NavigationSigmas{})).ok());
      policy.begin_frame(*car.smoother, car.time(k));
      CHECK(car.smoother->optimise().status.ok());
      policy.remember(*car.smoother);
    }
    const vision::CameraCorrectionOptions options;
    CHECK(sigma(policy, 0) <= options.offset_sigma_s * 1.001);
    CHECK(sigma(policy, 3) <= options.boresight_sigma_rad * 1.001);
  });
}
