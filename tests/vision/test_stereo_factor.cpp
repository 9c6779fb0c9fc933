// SPDX-License-Identifier: BSD-3-Clause
// The stereo factor: definition, Jacobian in front of and behind the camera, weights, refusals; and a landmark that goes behind the
// camera in a real smoother.
#include <searvins/vision/stereo_factor.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <searvins/imu/navigation_prior.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>
#include <searvins/vision/triangulation.hpp>

#include "support/factor_values.hpp"
#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::NavigationState;
using vision::Landmark;
using vision::StereoCamera;
using vision::StereoFactor;

namespace {

NavigationState random_state(Rng& rng) {
  NavigationState x;
  x.R_wb = so3::exp(random_vector<3>(rng, 1.7)), x.p_wb_m = random_vector<3>(rng, 100), x.v_wb_mps = random_vector<3>(rng, 20);
  return x;
}

struct Scene {
  FactorValuesOf<NavigationState, Landmark> values;
  StereoCamera<double> camera;
  smoother::Key<NavigationState> state;
  smoother::Key<Landmark> landmark;
  Eigen::Vector3d p_c_m;
};

/// A state and a landmark at a depth in its camera.
Scene scene(Rng& rng, double depth_m) {
  Scene s;
  s.camera = random_stereo_camera(rng);
  const NavigationState x = random_state(rng);
  s.p_c_m = {uniform(rng, -10, 10), uniform(rng, -5, 5), depth_m};
  s.state = s.values.add(x);
  s.landmark = s.values.add(Landmark{x.p_wb_m + x.R_wb * s.camera.body_from_camera(s.p_c_m)});
  return s;
}

using Matrix3x18 = Eigen::Matrix<double, 3, 18>;

/// Largest difference between the analytic and the numeric Jacobian, against the largest entry of the part it belongs to.
template <class F>
double jacobian_error(const F& f, Scene& s, double step) {
  double e[3]{};
  Matrix3x18 J = Matrix3x18::Zero(), numeric;
  f.linearise(s.values, e, {J.data(), 3});
  numeric << numeric_columns<3>(f, s.values, s.state, step), numeric_columns<3>(f, s.values, s.landmark, step);
  CHECK(J.middleCols<9>(6).isZero(0));  // velocity and biases are not seen
  CHECK(numeric.middleCols<9>(6).isZero(0));
  return std::max({part_error(J, numeric, 0, 3), part_error(J, numeric, 3, 3), part_error(J, numeric, 15, 3)});
}

}  // namespace

TEST_CASE("the residual is the whitened difference of pixels, and vanishes where the landmark was seen") {
  for_all_seeds(100, [](Rng& rng) {
    Scene s = scene(rng, uniform(rng, 1, 60));
    const Eigen::Vector3d seen = *s.camera.project(s.p_c_m), error = random_vector<3>(rng, 5);
    const Eigen::Matrix3d Sigma = 0.5 * random_spd(rng, 3, 20);
    const double scale = uniform(rng, 1, 4);
    const auto f = StereoFactor<>::make(s.state, s.landmark, s.camera, Eigen::Vector3d{seen - error}, Sigma, scale);
    REQUIRE(f.ok());
    double e[3]{}, w[3]{};
    f->evaluate(s.values, e);
    const double z2 = Eigen::Map<Eigen::Vector3d>(e).squaredNorm();
    CHECK(z2 == doctest::Approx(error.dot(Sigma.inverse() * error) / (scale * scale)).epsilon(1e-6));
    CHECK(f->weigh(e, w) == doctest::Approx(f->loss.rho(z2)));
    CHECK((w[0] == f->loss.weight(z2) && w[1] == w[0] && w[2] == w[0]));
  });
}

TEST_CASE("by the left eye: as with a right pixel of which nothing is known, and two views of a point tell its depth") {
  for_all_seeds(100, [](Rng& rng) {
    Scene s = scene(rng, uniform(rng, 1, 60));
    const Eigen::Vector3d seen = *s.camera.project(s.p_c_m);
    const Eigen::Matrix3d Sigma = 0.5 * random_spd(rng, 3, 20);
    const double scale = uniform(rng, 1, 4);
    Eigen::Matrix3d blind = Sigma;
    blind(1, 1) += 1e8;
    const Eigen::Vector3d pixel = seen + random_vector<3>(rng, 3);
    const auto left = StereoFactor<>::make(s.state, s.landmark, s.camera, pixel, Sigma, scale, {}, vision::Eyes::left);
    const auto both = StereoFactor<>::make(s.state, s.landmark, s.camera, pixel, blind, scale);
    REQUIRE((left.ok() && both.ok()));
    CHECK(close(left->root_information.transpose() * left->root_information, both->root_information.transpose() * both->root_information, 1e-5));
    CHECK(left->root_information.row(1).isZero(0));
    CHECK(left->root_information.col(1).isZero(0));
    CHECK(jacobian_error(*left, s, 1e-5) < 1e-5);
    // From another place: the block of the landmark is regular by two such observations, by one it is not.
    const auto block = [&](const auto& f) {
      double e[3]{};
      Matrix3x18 J = Matrix3x18::Zero();
      f->linearise(s.values, e, {J.data(), 3});
      const Eigen::Matrix3d Jl = J.rightCols<3>();
      return Eigen::Matrix3d{Jl.transpose() * Jl};
    };
    const Eigen::Matrix3d one = block(left);
    s.values.at(s.state).p_wb_m += s.values.at(s.state).R_wb * s.camera.R_bc * Eigen::Vector3d{0.2 * s.p_c_m.z(), 0, 0};
    const Eigen::Matrix3d two = one + block(left);
    CHECK(std::abs(one.determinant()) < 1e-6 * std::abs(two.determinant()));
    CHECK(two.determinant() > 0);
  });
}

TEST_CASE("the Jacobian is that of the residual, in front of the camera and behind it") {
  for_all_seeds(200, [](Rng& rng) {
    const double depth = chance(rng, 0.6) ? uniform(rng, 1, 60) : uniform(rng, -30, 0.05);
    Scene s = scene(rng, depth);
    const auto f =
        StereoFactor<>::make(s.state, s.landmark, s.camera, random_vector<3>(rng, 500), Eigen::Matrix3d{0.5 * random_spd(rng, 3, 20)});
    REQUIRE(f.ok());
    CHECK(jacobian_error(*f, s, depth > 0.1 ? 1e-5 : 1e-3 * 0.04) < 1e-5);
  });
}

TEST_CASE("wherever the landmark is, one observation informs all of its axes and nothing is NaN") {
  for_all_seeds(200, [](Rng& rng) {
    const double depth =
        std::array{0.0, -1e-300, 0.1, -0.1, -1e6, 1e6, uniform(rng, -50, 50)}[static_cast<std::size_t>(integer(rng, 0, 6))];
    Scene s = scene(rng, depth);
    const auto f = StereoFactor<>::make(s.state, s.landmark, s.camera, random_vector<3>(rng, 500), vision::pixel_covariance_px2(1));
    double e[3]{}, w[3]{};
    Matrix3x18 J = Matrix3x18::Zero();
    f->linearise(s.values, e, {J.data(), 3});
    CHECK(J.allFinite());
    CHECK((std::isfinite(e[0]) && std::isfinite(e[1]) && std::isfinite(e[2]) && std::isfinite(f->weigh(e, w)) && w[0] > 0));
    const Eigen::Matrix3d d = J.rightCols<3>();
    CHECK(std::abs(d.determinant()) > 0);
  });
}

TEST_CASE("a wrong scale, pixel or covariance is refused") {
  const smoother::Key<NavigationState> x{0, 1};
  const smoother::Key<Landmark> l{0, 1};
  const StereoCamera<double> c = street_camera();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const double nan = std::nan("");
  CHECK(StereoFactor<>::make(x, l, c, {1, 0, 0}, I, 1).ok());
  CHECK(StereoFactor<>::make(x, l, c, {1, 0, 0}, I, 0.99).status().code == StatusCode::invalid_argument);
  CHECK(StereoFactor<>::make(x, l, c, {1, 0, 0}, I, nan).status().code == StatusCode::invalid_argument);
  CHECK(StereoFactor<>::make(x, l, c, {1, nan, 0}, I).status().code == StatusCode::non_finite);
  CHECK(StereoFactor<>::make(x, l, c, {1, 0, 0}, -I).status().code == StatusCode::not_positive_definite);
  CHECK(StereoFactor<>::make(x, l, c, {1, 0, 0}, nan * I).status().code == StatusCode::not_positive_definite);
}

namespace {

/// States whose poses are known, and landmarks that they see.
struct PosesProblem {
  using Scalar = double;
  using Variables = smoother::Types<smoother::Capacity<NavigationState, 12>, smoother::Capacity<Landmark, 24>>;
  using Factors = smoother::Types<smoother::Capacity<imu::NavigationPriorFactor, 12>, smoother::Capacity<StereoFactor<>, 240>,
                                  smoother::Capacity<vision::LandmarkPriorFactor, 24>>;
  static constexpr int max_front_dimension = 180, member_capacity = 160;
  static constexpr std::size_t arena_scalars = 12 * 181 * 181;
};
using PosesSmoother = smoother::FixedLagSmoother<PosesProblem>;

/// A car that drives forward a metre a frame past resting points, with one more point that moves.
struct PassingScene {
  static constexpr int kFrames = 10, kRestingPoints = 12;
  std::unique_ptr<PosesSmoother> smoother = std::make_unique<PosesSmoother>();
  StereoCamera<double> camera = street_camera();
  std::vector<NavigationState> truth;
  std::vector<smoother::Key<NavigationState>> states;
  std::vector<smoother::Key<Landmark>> landmarks;

  explicit PassingScene(Rng& rng, double attitude_rad) {
    for (int k = 0; k < kFrames; ++k) {
      NavigationState x;
      x.p_wb_m = {1.0 * k, 0, 0};
      truth.push_back(x);
      NavigationState::Step off = NavigationState::Step::Zero();
      off.segment<3>(3) = random_vector<3>(rng, 0.1), off.head<3>() = random_vector<3>(rng, attitude_rad);
      states.push_back(*smoother->add_variable(x.retract(off), GpsTime{k * 100'000'000LL}));
      REQUIRE(smoother->add_factor(*imu::NavigationPriorFactor::make(states.back(), x, imu::NavigationSigmas{0.02, 0.1, 1, 0.1, 0.01, 0}))
                  .ok());
    }
  }
  Eigen::Vector3d seen_px(int frame, const Eigen::Vector3d& p_w_m) const {
    const NavigationState& x = truth[static_cast<std::size_t>(frame)];
    return *camera.project(camera.camera_from_body(x.R_wb.transpose() * (p_w_m - x.p_wb_m)));
  }
  /// A landmark that starts at `start` and is seen where `place(frame)` is.
  template <class Place>
  void add(const Eigen::Vector3d& start_w_m, double prior_m, const Place& place) {
    const auto key = smoother->add_variable(Landmark{start_w_m}, GpsTime{0});
    REQUIRE(key.ok());
    if (prior_m > 0) REQUIRE(smoother->add_factor(*vision::LandmarkPriorFactor::make(*key, start_w_m, prior_m)).ok());
    for (int k = 0; k < kFrames; ++k)
      REQUIRE(smoother
                  ->add_factor(*StereoFactor<>::make(states[static_cast<std::size_t>(k)], *key, camera, seen_px(k, place(k)),
                                                     vision::pixel_covariance_px2(0.7)))
                  .ok());
    landmarks.push_back(*key);
  }
  void add_resting_points(Rng& rng) {
    for (int i = 0; i < kRestingPoints; ++i) {
      const Eigen::Vector3d p{uniform(rng, 15, 50), uniform(rng, -10, 10), uniform(rng, -1, 5)};
      add(p + random_vector<3>(rng, 1), 30, [&](int) { return p; });
    }
  }
  double worst_position_error_m() const {
    double worst = 0;
    for (std::size_t k = 0; k < states.size(); ++k) worst = std::max(worst, (smoother->find(states[k])->p_wb_m - truth[k].p_wb_m).norm());
    return worst;
  }
  void let_all_leave() {
    for (int k = 0; k + 1 < kFrames; ++k) {
      const auto report = smoother->marginalise_oldest();
      CHECK(report.status.ok());
      CHECK(report.skipped_axes == 0);
    }
    CHECK(smoother->optimise().status.ok());
  }
};

smoother::OptimiseOptions<double> patient() {
  smoother::OptimiseOptions<double> o;
  o.max_iterations = 60;
  return o;
}

}  // namespace

TEST_CASE("a landmark that starts behind the camera comes back to where it was seen, with the weak prior and without any") {
  for_all_seeds(20, [](Rng& rng) {
    PassingScene s(rng, 0.005);
    s.add_resting_points(rng);
    const Eigen::Vector3d p{uniform(rng, 20, 40), uniform(rng, -5, 5), uniform(rng, 0, 3)};
    const double prior_m = chance(rng, 0.5) ? 100 : 0;
    s.add({uniform(rng, -20, 0), uniform(rng, -5, 5), uniform(rng, 0, 3)}, prior_m, [&](int) { return p; });
    const auto report = s.smoother->optimise(patient());
    CHECK(report.status.ok());
    CHECK((s.smoother->find(s.landmarks.back())->p_w_m - p).norm() < (prior_m > 0 ? 1.0 : 1e-2));
    CHECK(s.worst_position_error_m() < 0.05);
    s.let_all_leave();
  });
}

TEST_CASE("a moving thing whose landmark lies behind the camera neither stops the window nor moves it more than one in front") {
  for_all_seeds(10, [](Rng& rng) {
    // It comes towards the camera faster than the road does: no resting point has such rays.
    const Eigen::Vector3d from{uniform(rng, 28, 35), uniform(rng, -4, 4), 1}, to{uniform(rng, 18, 20), uniform(rng, -4, 4), 1};
    const Eigen::Vector3d behind{uniform(rng, -10, 1), uniform(rng, -4, 4), 1};
    const Rng seen = rng;
    const auto run = [&](bool start_behind) {
      Rng same = seen;
      PassingScene s(same, 0.005);
      s.add_resting_points(same);
      s.add(from, 30, [&](int k) { return Eigen::Vector3d{from + (to - from) * (k / 9.0)}; });
      if (start_behind) REQUIRE(s.smoother->set_value(s.landmarks.back(), Landmark{behind}).ok());
      for (int update = 0; update < 8; ++update) {
        const auto report = s.smoother->optimise();
        CHECK((report.status.ok() || report.last_step > 0));  // some step was taken
        CHECK(report.final_cost <= report.initial_cost * (1 + 1e-6));
      }
      CHECK(s.smoother->find(s.landmarks.back())->p_w_m.allFinite());
      const double error_m = s.worst_position_error_m();
      s.let_all_leave();
      return error_m;
    };
    const double in_front_m = run(false), behind_m = run(true);
    CHECK(in_front_m < 0.6);
    CHECK(behind_m == doctest::Approx(in_front_m).epsilon(0.05).scale(0.1));
  });
}

TEST_CASE("the seam lies beyond ten sigmas of disparity, and below it a point pulls no harder than some near ones") {
  for_all_seeds(100, [](Rng& rng) {
    const double seen_m = uniform(rng, 3, 60), sigma_px = uniform(rng, 0.3, 2), scale = uniform(rng, 1, 4);
    Scene s = scene(rng, seen_m);
    s.camera.min_depth_m = 0.1;
    const auto f =
        StereoFactor<>::make(s.state, s.landmark, s.camera, *s.camera.project(s.p_c_m), vision::pixel_covariance_px2(sigma_px), scale);
    REQUIRE(f.ok());
    const double seam_px = s.camera.disparity_px(f->tangent_below_m), d_px = s.camera.disparity_px(seen_m);
    CHECK(seam_px == doctest::Approx(2 * d_px + 10 * scale * sigma_px * std::sqrt(2.0)));
    // At the seam the observation is denied by ten sigmas or more; just above it the model is pi_s.
    const auto row = [&](double depth_m, int i) {
      s.values.at(s.landmark).p_w_m =
          s.values.at(s.state).p_wb_m + s.values.at(s.state).R_wb * s.camera.body_from_camera({s.p_c_m.x(), s.p_c_m.y(), depth_m});
      double e[3]{};
      f->evaluate(s.values, e);
      return e[i];
    };
    const double z = f->tangent_below_m * 1.001;
    CHECK(row(z, 0) - row(z, 1) >= 9.9 * std::sqrt(2.0));
    const Eigen::Vector3d plain = f->root_information * (*s.camera.project({s.p_c_m.x(), s.p_c_m.y(), z}) - f->pixel);
    CHECK(row(z, 2) == doctest::Approx(plain[2]));
    const double pull = (row(-10, 0) - row(-10, 1)) - (row(-9, 0) - row(-9, 1));  // whitened disparity per metre, behind
    const double usual = s.camera.disparity_px(1.0) / (seen_m * seen_m) / (scale * sigma_px);
    CHECK(pull == doctest::Approx(usual * (seen_m / f->tangent_below_m) * (seen_m / f->tangent_below_m)));
  });
}
