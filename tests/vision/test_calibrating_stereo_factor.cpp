// SPDX-License-Identifier: BSD-3-Clause
// The stereo factor with a correction of the camera's clock and axes: what it is without one, Jacobian, and the sign of what it estimates, by
// pictures of a path that knows nothing of the factor's approximation.
#include <searvins/vision/calibrating_stereo_factor.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <searvins/imu/navigation_prior.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "support/factor_values.hpp"
#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::NavigationState;
using vision::CalibratingStereoFactor;
using vision::CameraCorrection;
using vision::FrameMotion;
using vision::Landmark;
using vision::StereoCamera;
using vision::StereoFactor;

namespace {

struct Scene {
  FactorValuesOf<NavigationState, Landmark, CameraCorrection> values;
  StereoCamera<double> camera;
  FrameMotion motion;
  smoother::Key<NavigationState> state;
  smoother::Key<Landmark> landmark;
  smoother::Key<CameraCorrection> correction;
};

/// A state, a correction, and a landmark at a depth in the camera as it is.
Scene scene(Rng& rng, double depth_m) {
  Scene s;
  s.camera = random_stereo_camera(rng);
  NavigationState x;
  x.R_wb = so3::exp(random_vector<3>(rng, 1.7)), x.p_wb_m = random_vector<3>(rng, 100), x.v_wb_mps = random_vector<3>(rng, 20);
  s.motion = {uniform(rng, -0.01, 0.01), x.v_wb_mps, random_vector<3>(rng, 1)};
  const CameraCorrection c{uniform(rng, -0.05, 0.05), so3::exp(random_vector<3>(rng, 0.3))};
  const Eigen::Vector3d p_c_m{uniform(rng, -10, 10), uniform(rng, -5, 5), depth_m};
  StereoCamera<double> there = vision::carried(s.camera, s.motion.late_s + c.time_offset_s, x.R_wb.transpose() * x.v_wb_mps, s.motion.rate_b_radps);
  there.R_bc = there.R_bc * c.R_nc;
  s.state = s.values.add(x), s.correction = s.values.add(c);
  s.landmark = s.values.add(Landmark{x.p_wb_m + x.R_wb * there.body_from_camera(p_c_m)});
  return s;
}

CalibratingStereoFactor<> factor_of(const Scene& s, const Eigen::Vector3d& pixel, const Eigen::Matrix3d& covariance) {
  const auto seen = StereoFactor<>::make(s.state, s.landmark, s.camera, pixel, covariance);
  REQUIRE(seen.ok());
  const auto f = CalibratingStereoFactor<>::make(*seen, s.correction, s.motion);
  REQUIRE(f.ok());
  return *f;
}

using Matrix3x22 = Eigen::Matrix<double, 3, 22>;

double jacobian_error(const CalibratingStereoFactor<>& f, Scene& s, double step) {
  double e[3]{};
  Matrix3x22 J = Matrix3x22::Zero(), numeric;
  f.linearise(s.values, e, {J.data(), 3});
  numeric << numeric_columns<3>(f, s.values, s.state, step), numeric_columns<3>(f, s.values, s.landmark, step),
      numeric_columns<3>(f, s.values, s.correction, step);
  CHECK(J.middleCols<9>(6).isZero(0));  // velocity and biases are not seen
  CHECK(numeric.middleCols<9>(6).isZero(0));
  double plain[3]{};
  f.evaluate(s.values, plain);
  CHECK((Eigen::Map<Eigen::Vector3d>(plain) == Eigen::Map<Eigen::Vector3d>(e)));
  const auto part = [&](int first, int count) { return part_error(J, numeric, first, count); };
  return std::max({part(0, 3), part(3, 3), part(15, 3), part(18, 1), part(19, 3)});
}

}  // namespace

TEST_CASE("it vanishes where the camera, carried on and turned, sees the landmark; without a correction it is the stereo factor") {
  for_all_seeds(100, [](Rng& rng) {
    const double depth_m = uniform(rng, 2, 60);
    Scene s = scene(rng, depth_m);
    const CameraCorrection c = s.values.at(s.correction);
    const NavigationState& x = s.values.at(s.state);
    StereoCamera<double> there = vision::carried(s.camera, s.motion.late_s + c.time_offset_s, x.R_wb.transpose() * x.v_wb_mps, s.motion.rate_b_radps);
    there.R_bc = there.R_bc * c.R_nc;
    const Eigen::Vector3d p_b_m = x.R_wb.transpose() * (s.values.at(s.landmark).p_w_m - x.p_wb_m);
    const Eigen::Vector3d seen = *there.project(there.camera_from_body(p_b_m));
    double e[3]{}, plain[3]{}, w[3]{};
    factor_of(s, seen, vision::pixel_covariance_px2(1)).evaluate(s.values, e);
    CHECK(Eigen::Map<Eigen::Vector3d>(e).norm() < 1e-6);

    s.values.at(s.correction) = {};
    s.motion = {0, s.motion.v_w_mps, s.motion.rate_b_radps};
    const Eigen::Matrix3d Sigma = 0.5 * random_spd(rng, 3, 20);
    const auto f = factor_of(s, seen, Sigma);
    f.evaluate(s.values, e);
    f.seen.evaluate(s.values, plain);
    CHECK(close(Eigen::Map<Eigen::Vector3d>(e), Eigen::Map<Eigen::Vector3d>(plain), 1e-9));
    const double z2 = Eigen::Map<Eigen::Vector3d>(e).squaredNorm();
    CHECK(f.weigh(e, w) == doctest::Approx(f.seen.loss.rho(z2)));
    CHECK((w[0] == f.seen.loss.weight(z2) && w[1] == w[0] && w[2] == w[0]));
  });
}

TEST_CASE("the Jacobian is that of the residual, in front of the camera and behind it") {
  for_all_seeds(200, [](Rng& rng) {
    const double depth_m = chance(rng, 0.6) ? uniform(rng, 1, 60) : uniform(rng, -30, 0.05);
    Scene s = scene(rng, depth_m);
    const auto f = factor_of(s, random_vector<3>(rng, 500), Eigen::Matrix3d{0.5 * random_spd(rng, 3, 20)});
    CHECK(jacobian_error(f, s, depth_m > 0.1 ? 1e-6 : 4e-5) < 2e-5);
  });
}

TEST_CASE("a motion that is not finite is refused") {
  const auto seen = StereoFactor<>::make({0, 1}, {0, 1}, street_camera(), {1, 0, 0}, Eigen::Matrix3d::Identity());
  REQUIRE(seen.ok());
  const double nan = std::nan("");
  CHECK(CalibratingStereoFactor<>::make(*seen, {0, 1}, {}).ok());
  CHECK(CalibratingStereoFactor<>::make(*seen, {0, 1}, {nan, {}, {}}).status().code == StatusCode::non_finite);
  CHECK(CalibratingStereoFactor<>::make(*seen, {0, 1}, {0, {0, nan, 0}, {0, 0, 0}}).status().code == StatusCode::non_finite);
  CHECK(CalibratingStereoFactor<>::make(*seen, {0, 1}, {0, {0, 0, 0}, {nan, 0, 0}}).status().code == StatusCode::non_finite);
}

namespace {

constexpr int kFrames = 12, kPoints = 24;

struct CalibrationProblem {
  using Scalar = double;
  using Variables = smoother::Types<smoother::Capacity<NavigationState, kFrames>, smoother::Capacity<Landmark, kPoints>, smoother::Capacity<CameraCorrection, 1>>;
  using Factors = smoother::Types<smoother::Capacity<imu::NavigationPriorFactor, kFrames>, smoother::Capacity<CalibratingStereoFactor<>, kFrames * kPoints>,
                                  smoother::Capacity<vision::LandmarkPriorFactor, kPoints>, smoother::Capacity<vision::CameraCorrectionPriorFactor, 1>>;
  static constexpr int max_front_dimension = 200, member_capacity = 320;
  static constexpr std::size_t arena_scalars = 12 * 201 * 201;
};

/// A car (forward, left, up) that goes round bends, in closed form.
struct Path {
  double speed_mps, bend_rad, rhythm_radps;
  [[nodiscard]] Eigen::Vector3d place_w_m(double t) const { return {speed_mps * t, 4 * std::sin(rhythm_radps * t), 0.3 * std::sin(t)}; }
  [[nodiscard]] Eigen::Matrix3d R_wb(double t) const {
    return so3::exp(Eigen::Vector3d{0, 0, bend_rad * std::cos(rhythm_radps * t)}) *
           so3::exp(Eigen::Vector3d{0.02 * std::sin(2 * t), 0.03 * std::cos(3 * t), 0});
  }
  [[nodiscard]] Eigen::Vector3d velocity_w_mps(double t) const { return (place_w_m(t + 1e-5) - place_w_m(t - 1e-5)) / 2e-5; }
  [[nodiscard]] Eigen::Vector3d rate_b_radps(double t) const { return so3::log(R_wb(t - 1e-5).transpose() * R_wb(t + 1e-5)) / 2e-5; }
};

}  // namespace

TEST_CASE("pictures that were taken later than stamped, by a camera that is turned: the estimate says so, by sign and by size") {
  for_all_seeds(20, [](Rng& rng) {
    const Path path{uniform(rng, 5, 12), uniform(rng, 0.2, 0.4) * (chance(rng, 0.5) ? 1 : -1), uniform(rng, 0.8, 1.5)};
    const double offset_s = uniform(rng, 3e-3, 8e-3) * (chance(rng, 0.5) ? 1 : -1);
    const Eigen::Vector3d boresight_rad = random_vector<3>(rng, 6e-3);
    const StereoCamera<double> nominal = street_camera();
    StereoCamera<double> real = nominal;
    real.R_bc = nominal.R_bc * so3::exp(boresight_rad);

    const auto smoother = std::make_unique<smoother::FixedLagSmoother<CalibrationProblem>>();
    std::vector<smoother::Key<NavigationState>> states;
    const auto time_of = [](int k) { return 0.25 * k; };
    for (int k = 0; k < kFrames; ++k) {
      NavigationState x;
      x.p_wb_m = path.place_w_m(time_of(k)), x.R_wb = path.R_wb(time_of(k)), x.v_wb_mps = path.velocity_w_mps(time_of(k));
      states.push_back(*smoother->add_variable(x, GpsTime{}.plus_seconds(time_of(k))));
      REQUIRE(smoother->add_factor(*imu::NavigationPriorFactor::make(states.back(), x, imu::NavigationSigmas{1e-4, 0.002, 1, 0.1, 0.01, 0})).ok());
    }
    const auto correction = *smoother->add_variable(CameraCorrection{}, GpsTime{});
    REQUIRE(smoother->add_factor(*vision::CameraCorrectionPriorFactor::make(correction, {}, vision::prior_covariance({}))).ok());
    for (int i = 0; i < kPoints; ++i) {
      const double at = time_of(integer(rng, 0, kFrames - 1));
      const Eigen::Vector3d p_w_m = path.place_w_m(at) + path.R_wb(at) * Eigen::Vector3d{uniform(rng, 10, 40), uniform(rng, -9, 9), uniform(rng, -1, 5)};
      const auto landmark = *smoother->add_variable(Landmark{p_w_m + random_vector<3>(rng, 0.5)}, GpsTime{});
      REQUIRE(smoother->add_factor(*vision::LandmarkPriorFactor::make(landmark, p_w_m, 30)).ok());
      for (int k = 0; k < kFrames; ++k) {
        const double exposed_s = time_of(k) + offset_s;
        const Eigen::Vector3d p_c_m = real.camera_from_body(path.R_wb(exposed_s).transpose() * (p_w_m - path.place_w_m(exposed_s)));
        if (p_c_m.z() < 2 || !real.inside(real.continued(p_c_m))) continue;
        const Eigen::Vector3d pixel = *real.project(p_c_m) + Eigen::Vector3d{normal(rng, 0.2), normal(rng, 0.2), normal(rng, 0.2)};
        const auto seen = StereoFactor<>::make(states[static_cast<std::size_t>(k)], landmark, nominal, pixel, vision::pixel_covariance_px2(0.2));
        REQUIRE(seen.ok());
        const auto f = CalibratingStereoFactor<>::make(*seen, correction, {0, path.velocity_w_mps(time_of(k)), path.rate_b_radps(time_of(k))});
        REQUIRE(f.ok());
        REQUIRE(smoother->add_factor(*f).ok());
      }
    }
    smoother::OptimiseOptions<double> patient;
    patient.max_iterations = 40;
    CHECK(smoother->optimise(patient).status.ok());
    const CameraCorrection found = *smoother->find(correction);
    const auto covariance = smoother->covariance(correction);
    REQUIRE(covariance.ok());
    const auto sigma = [&](int i) { return std::sqrt((*covariance)(i, i)); };
    CHECK(sigma(0) < 0.5e-3);
    CHECK(std::abs(found.time_offset_s - offset_s) < 5 * sigma(0) + 5e-5);
    CHECK(std::abs(found.time_offset_s - offset_s) < 0.5 * std::abs(offset_s));  // a wrong sign misses by twice the offset
    for (int i = 0; i < 3; ++i) {
      CHECK(sigma(1 + i) < 1e-3);
      CHECK(std::abs(found.boresight_rad()[i] - boresight_rad[i]) < 5 * sigma(1 + i) + 5e-5);
    }
  });
}
