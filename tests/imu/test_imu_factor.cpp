// SPDX-License-Identifier: BSD-3-Clause
// The inertial factor: zero at the prediction, Jacobians, whitening, the Earth's share, refused inputs, and its place in the smoother.
#include <searvins/imu/imu_factor.hpp>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <limits>
#include <memory>
#include <vector>

#include <searvins/imu/navigation_prior.hpp>
#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegration.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "imu/factor_check.hpp"
#include "imu/simulated_motion.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::NavigationState;
using imu::SampleKind;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

namespace {

template <class Earth>
Earth earth_of(const SimulatedMotion& m) {
  if constexpr (std::is_same_v<Earth, imu::ConstantGravity>)
    return {};
  else
    return {m.frame};
}

template <class Earth>
struct Setup {
  SimulatedMotion motion;
  Earth earth;
  NavigationValues values{};
  imu::ImuFactor<Earth> factor{};
  NavigationState predicted{};

  explicit Setup(Rng& rng, double duration = 1.0) : motion(SimulatedMotion::random(rng)), earth(earth_of<Earth>(motion)) {
    const auto m = imu::preintegrate<double>(motion.samples(uniform_times(duration, 100), SampleKind::instantaneous), motion.time(0),
                                             motion.time(duration), {random_vector<3>(rng, 0.1), random_vector<3>(rng, 0.01)});
    REQUIRE(m.ok());
    NavigationState x = motion.begin;
    x.accel_bias_b_mps2 = m->bias.accel_b_mps2 + random_vector<3>(rng, 0.05),
    x.gyro_bias_b_radps = m->bias.gyro_b_radps + random_vector<3>(rng, 1e-3);
    predicted = imu::predict(x, *m, earth);
    const auto from = values.add(x), to = values.add(predicted);
    const auto made = imu::ImuFactor<Earth>::make(from, to, *m, {}, earth, x.p_wb_m);
    REQUIRE(made.ok());
    factor = *made;
  }
};

}  // namespace

TEST_CASE_TEMPLATE("the motion rows vanish at the predicted state, the walk rows at equal biases", Earth, imu::RotatingEarth,
                   imu::FlatEarth, imu::ConstantGravity) {
  for_all_seeds(60, [](Rng& rng) {
    const Setup<Earth> s{rng, uniform(rng, 0.05, 5)};
    double e[15];
    s.factor.evaluate(s.values, e);
    for (int i = 0; i < 9; ++i) CHECK(std::abs(e[i]) < 1e-4);  // rounding of 20 km over a micrometre of sigma
    for (int i = 9; i < 15; ++i) CHECK(e[i] == 0);
  });
}

TEST_CASE_TEMPLATE("Jacobians by both states equal differences, near the prediction and far from it", Earth, imu::RotatingEarth,
                   imu::FlatEarth, imu::ConstantGravity) {
  for_all_seeds(30, [](Rng& rng) {
    Setup<Earth> s{rng, uniform(rng, 0.2, 2)};
    NavigationState::Step d = random_vector<15>(rng, 1);
    if (chance(rng, 0.5)) d *= 1e-3;
    d.segment<3>(NavigationState::accel_bias) *= 0.02, d.segment<3>(NavigationState::gyro_bias) *= 0.002;
    s.values.at(s.factor.to) = s.predicted.retract(d);
    check_navigation_jacobian(s.factor, s.values, 2e-5, 1e-6);
  });
}

TEST_CASE("rows are whitened: e'e is the Mahalanobis norm of the displaced residual, root information inverts the covariance") {
  for_all_seeds(60, [](Rng& rng) {
    Setup<imu::ConstantGravity> s{rng, uniform(rng, 0.01, 2)};
    const Matrix9& R = s.factor.root_information;
    const Matrix9 identity = R * s.factor.motion.covariance * R.transpose();
    CHECK(close(identity, Matrix9::Identity().eval(), 1e-9));
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < i; ++j) CHECK(R(i, j) == 0);
    NavigationState::Step d = NavigationState::Step::Zero();
    const Eigen::Vector3d dba = random_vector<3>(rng, 0.01), dbg = random_vector<3>(rng, 1e-3);
    d.segment<3>(NavigationState::position) = random_vector<3>(rng, 0.01),
    d.segment<3>(NavigationState::velocity) = random_vector<3>(rng, 0.01);
    d.segment<3>(NavigationState::accel_bias) = dba, d.segment<3>(NavigationState::gyro_bias) = dbg;
    s.values.at(s.factor.to) = s.predicted.retract(d);
    double e[15];
    s.factor.evaluate(s.values, e);
    const Eigen::Matrix3d Rt = s.values(s.factor.from).R_wb.transpose();
    Eigen::Matrix<double, 9, 1> r;
    r << Eigen::Vector3d::Zero(), Rt * d.segment<3>(NavigationState::position), Rt * d.segment<3>(NavigationState::velocity);
    CHECK(Eigen::Map<Eigen::Matrix<double, 9, 1>>(e).squaredNorm() ==
          doctest::Approx(r.dot(s.factor.motion.covariance.inverse() * r)).epsilon(1e-4));
    const double root_T = std::sqrt(s.factor.motion.duration_s);
    for (int i = 0; i < 3; ++i) {
      CHECK(e[9 + i] == doctest::Approx(dba[i] / (3.9e-5 * root_T)).epsilon(1e-9));
      CHECK(e[12 + i] == doctest::Approx(dbg[i] / (3.9e-6 * root_T)).epsilon(1e-9));
    }
  });
}

TEST_CASE("P7 an interval of one sample makes a usable factor") {
  for_all_seeds(60, [](Rng& rng) {
    const Setup<imu::RotatingEarth> s{rng, 0.01};
    CHECK(s.factor.root_information.allFinite());
    CHECK(s.factor.root_information.diagonal().minCoeff() > 0);
  });
}

TEST_CASE("the Coriolis and turning terms are those of the stated motion: rows of a flat Earth miss 2 Omega x v T and Omega T") {
  for_all_seeds(40, [](Rng& rng) {
    Setup<imu::RotatingEarth> s{rng};
    const auto flat =
        imu::ImuFactor<imu::FlatEarth>::make(s.factor.from, s.factor.to, s.factor.motion, {}, {s.motion.frame}, s.motion.begin.p_wb_m);
    REQUIRE(flat.ok());
    double e[15];
    flat->evaluate(s.values, e);
    const Eigen::Matrix<double, 9, 1> r =
        s.factor.root_information.triangularView<Eigen::Upper>().solve(Eigen::Map<const Eigen::Matrix<double, 9, 1>>(e));
    const Eigen::Vector3d omega = s.earth.rate_w_radps();
    const Eigen::Matrix3d Rt = s.motion.begin.R_wb.transpose();
    const Eigen::Vector3d way = s.predicted.p_wb_m - s.motion.begin.p_wb_m;
    const Eigen::Vector3d turn = -s.predicted.R_wb.transpose() * omega, coriolis = -2 * Rt * omega.cross(way);
    CHECK((r.head<3>() - turn).norm() < 1e-7);
    // What is left over is the lean of gravity in the turned frame, Omega x f T^2 / 2.
    CHECK((r.tail<3>() - coriolis).norm() < 1.2 * omega.norm() * 10);
    CHECK(r.head<3>().norm() > 1e-5);
  });
}

TEST_CASE("a motion that is none makes no factor") {
  Rng rng{3};
  const Setup<imu::RotatingEarth> s{rng};
  using Factor = imu::ImuFactor<imu::RotatingEarth>;
  const auto code = [&](auto change) {
    imu::PreintegratedMotion<double> m = s.factor.motion;
    imu::ImuNoise noise;
    change(m, noise);
    return Factor::make(s.factor.from, s.factor.to, m, noise, s.earth, {}).status().code;
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(code([](auto&, auto&) {}) == StatusCode::ok);
  CHECK(code([](auto& m, auto&) { m = {}; }) == StatusCode::invalid_argument);
  CHECK(code([](auto& m, auto&) { m.covariance.setZero(); }) == StatusCode::not_positive_definite);
  CHECK(code([](auto& m, auto&) { m.covariance(4, 4) *= -1; }) == StatusCode::not_positive_definite);
  CHECK(code([](auto& m, auto&) { m.covariance(4, 4) = nan; }) == StatusCode::not_positive_definite);
  CHECK(code([](auto&, auto& n) { n.accel_bias_walk_mps3_sqrt_hz = 0; }) == StatusCode::invalid_argument);
  CHECK(code([](auto&, auto& n) { n.gyro_bias_walk_radps2_sqrt_hz = nan; }) == StatusCode::invalid_argument);
}

namespace {

struct InertialProblem {
  using Scalar = double;
  using Variables = smoother::Types<smoother::Capacity<NavigationState, 8>>;
  using Factors = smoother::Types<smoother::Capacity<imu::ImuFactor<>, 8>, smoother::Capacity<imu::NavigationPriorFactor, 4>>;
  static constexpr int max_front_dimension = 60;
  static constexpr int member_capacity = 64;
  static constexpr std::size_t arena_scalars = 8 * 61 * 61;
};

}  // namespace

TEST_CASE("in the smoother: a prior and inertial factors alone reproduce dead reckoning from a disturbed start") {
  for_all_seeds(5, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const imu::RotatingEarth earth{m.frame};
    const auto list = m.samples(uniform_times(4, 100), SampleKind::instantaneous);
    const auto smoother = std::make_unique<smoother::FixedLagSmoother<InertialProblem>>();
    NavigationState x = m.begin;
    auto key = smoother->add_variable(x.retract(0.01 * random_vector<15>(rng)), m.time(0));
    REQUIRE(key.ok());
    const auto prior = imu::NavigationPriorFactor::make(*key, x, imu::NavigationSigmas{});
    REQUIRE((prior.ok() && smoother->add_factor(*prior).ok()));
    for (int k = 0; k < 4; ++k) {
      const auto motion = imu::preintegrate<double>(list, m.time(k), m.time(k + 1), imu::bias_of(x));
      REQUIRE(motion.ok());
      const NavigationState next = imu::predict(x, *motion, earth);
      const auto next_key = smoother->add_variable(next.retract(0.01 * random_vector<15>(rng)), m.time(k + 1));
      REQUIRE(next_key.ok());
      const auto factor = imu::ImuFactor<>::make(*key, *next_key, *motion, {}, earth, x.p_wb_m);
      REQUIRE((factor.ok() && smoother->add_factor(*factor).ok()));
      x = next, key = next_key;
    }
    const auto report = smoother->optimise();
    REQUIRE(report.status.ok());
    const NavigationState* y = smoother->find(*key);
    REQUIRE(y != nullptr);
    const NavigationState::Step d = x.local(*y);
    CHECK(d.segment<3>(0).norm() < 1e-6);
    CHECK(d.segment<3>(3).norm() < 1e-4);
    CHECK(d.segment<3>(6).norm() < 1e-5);
  });
}
