// SPDX-License-Identifier: BSD-3-Clause
// Dead reckoning against Runge-Kutta integration in ECEF, a body at rest on the turning Earth, and the predicted covariance against sampled
// errors.
#include <searvins/imu/prediction.hpp>

#include <Eigen/Cholesky>

#include <vector>

#include <searvins/imu/preintegration.hpp>

#include "imu/factor_check.hpp"
#include "imu/simulated_motion.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using imu::ImuSample;
using imu::NavigationState;
using imu::SampleKind;

namespace {

struct Error {
  double attitude_rad, position_m, velocity_mps;
};

Error error_of(const NavigationState& estimate, const NavigationState& truth) {
  const NavigationState::Step d = truth.local(estimate);
  return {d.segment<3>(NavigationState::attitude).norm(), d.segment<3>(NavigationState::position).norm(),
          d.segment<3>(NavigationState::velocity).norm()};
}

template <class Earth = imu::RotatingEarth>
NavigationState reckon(const NavigationState& begin, const std::vector<ImuSample>& list, GpsTime from, GpsTime to, const Earth& earth,
                       SampleKind kind = SampleKind::instantaneous) {
  imu::PreintegrationOptions options;
  options.kind = kind;
  const auto motion = imu::preintegrate<double>(list, from, to, imu::bias_of(begin), options);
  REQUIRE(motion.ok());
  return imu::predict(begin, *motion, earth);
}

NavigationState reckon(const SimulatedMotion& m, const std::vector<double>& times, SampleKind kind, double end, SampleKind taken_for) {
  return reckon(m.begin, m.samples(times, kind), m.time(0), m.time(end), imu::RotatingEarth{m.frame}, taken_for);
}

/// A body at rest relative to the Earth, any attitude; what it reads is constant.
struct RestingBody {
  SimulatedMotion motion;
  std::vector<ImuSample> samples;
  explicit RestingBody(Rng& rng, double duration, double rate_hz = 100) : motion(SimulatedMotion::random(rng, 0)) {
    motion.begin.R_wb = so3::exp(random_vector<3>(rng, 1.7));
    const imu::RotatingEarth earth{motion.frame};
    motion.gyro_b_radps = {}, motion.accel_b_mps2 = {};
    motion.gyro_b_radps.constant = motion.begin.R_wb.transpose() * earth.rate_w_radps();
    motion.accel_b_mps2.constant = -motion.begin.R_wb.transpose() * earth.gravity_w_mps2(motion.begin.p_wb_m);
    samples = motion.samples(uniform_times(duration, rate_hz), SampleKind::instantaneous);
  }
};

Eigen::Matrix<double, 15, 1> normal_step(Rng& rng, const imu::NavigationCovariance& covariance) {
  Eigen::Matrix<double, 15, 1> n;
  for (int i = 0; i < 15; ++i) n[i] = normal(rng);
  return Eigen::LLT<imu::NavigationCovariance>{covariance}.matrixL() * n;
}

}  // namespace

TEST_CASE("dead reckoning converges to integration in ECEF with the second order, for both kinds of samples, down to the stated terms") {
  for (const SampleKind kind : {SampleKind::instantaneous, SampleKind::mean_to_stamp}) {
    CAPTURE(static_cast<int>(kind));
    for_all_seeds(20, [&](Rng& rng) {
      const SimulatedMotion m = SimulatedMotion::random(rng);
      const NavigationState truth = m.truth(1.0);
      const auto error = [&](double rate_hz) { return error_of(reckon(m, uniform_times(1, rate_hz), kind, 1, kind), truth); };
      const Error a = error(50), b = error(100), c = error(3200);
      CHECK(b.attitude_rad < 6e-5);
      CHECK(b.velocity_mps < 5e-4);
      CHECK(b.position_m < 5e-4);
      CHECK(c.attitude_rad < 6e-8);
      CHECK(c.velocity_mps < 1e-6);  // what the gravity along the path leaves out, 30 m/s over 1 s
      CHECK(c.position_m < 5e-7);
      CHECK(a.attitude_rad / b.attitude_rad == doctest::Approx(4).epsilon(0.1));
      CHECK(a.velocity_mps / b.velocity_mps == doctest::Approx(4).epsilon(0.15));
      CHECK(a.position_m / b.position_m == doctest::Approx(4).epsilon(0.15));
    });
  }
}

TEST_CASE("dead reckoning on non-uniform times: within the error of the longest step") {
  for_all_seeds(20, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const NavigationState truth = m.truth(1.0);
    for (const SampleKind kind : {SampleKind::instantaneous, SampleKind::mean_to_stamp}) {
      const Error e = error_of(reckon(m, random_times(rng, 1.0, 300), kind, 1, kind), truth);
      CHECK(e.velocity_mps < 5e-4);
      CHECK(e.position_m < 5e-4);
      CHECK(e.attitude_rad < 6e-5);
    }
  });
}

TEST_CASE(
    "samples taken for the other kind are off by half a sample's change: millimetres per second, where the right kind is ten times "
    "better") {
  unsigned visible = 0, all = 0;
  for_all_seeds(20, [&](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const NavigationState truth = m.truth(1.0);
    const std::vector<double> times = uniform_times(1, 100);
    for (const SampleKind kind : {SampleKind::instantaneous, SampleKind::mean_to_stamp}) {
      const SampleKind other = kind == SampleKind::instantaneous ? SampleKind::mean_to_stamp : SampleKind::instantaneous;
      const double right = error_of(reckon(m, times, kind, 1, kind), truth).velocity_mps,
                   wrong = error_of(reckon(m, times, kind, 1, other), truth).velocity_mps;
      CHECK(right < 5e-4);
      CHECK(wrong > 2 * right);
      ++all;
      if (wrong > 2e-3 && wrong > 10 * right) ++visible;
    }
  });
  CHECK(visible > all * 3 / 4);
}

TEST_CASE("P9 a body at rest stays at rest for 60 s on the turning Earth, however it lies and wherever it is") {
  for_all_seeds(20, [](Rng& rng) {
    const RestingBody body{rng, 60};
    const imu::RotatingEarth earth{body.motion.frame};
    const NavigationState& begin = body.motion.begin;
    const Error whole = error_of(reckon(begin, body.samples, body.motion.time(0), body.motion.time(60), earth), begin);
    CHECK(whole.velocity_mps < 2e-5);  // J1 is cut off at (omega T)^3 T / 24 of gravity
    CHECK(whole.position_m < 1e-4);
    CHECK(whole.attitude_rad < 1e-12);
    NavigationState x = begin;
    for (int k = 0; k < 60; ++k) x = reckon(x, body.samples, body.motion.time(k), body.motion.time(k + 1), earth);
    const Error steps = error_of(x, begin);
    CHECK(steps.velocity_mps < 1e-8);
    CHECK(steps.position_m < 1e-6);  // the midpoint rule on a force that turns with the Earth: omega f h^2 T / 24
    CHECK(steps.attitude_rad < 1e-12);
  });
}

TEST_CASE("without rotation the same body drifts as predicted: it turns with the Earth rate and its gravity no longer cancels") {
  for_all_seeds(20, [](Rng& rng) {
    const RestingBody body{rng, 60};
    const imu::RotatingEarth earth{body.motion.frame};
    const NavigationState& begin = body.motion.begin;
    const NavigationState y = reckon(begin, body.samples, body.motion.time(0), body.motion.time(60), imu::FlatEarth{body.motion.frame});
    const Vector3d omega = earth.rate_w_radps(), g = earth.gravity_w_mps2(begin.p_wb_m), lean = omega.cross(Vector3d{-g});
    const Vector3d turned = so3::log(y.R_wb * begin.R_wb.transpose());
    CHECK((turned - 60 * omega).norm() < 1e-10);
    const Vector3d dv = y.v_wb_mps - begin.v_wb_mps, dp = y.p_wb_m - begin.p_wb_m;
    CHECK((dv - 1800 * lean).norm() < 0.003 * 1800 * 9.8 * omega.norm());
    CHECK((dp - 36000 * lean).norm() < 0.003 * 36000 * 9.8 * omega.norm());
    if (std::abs(omega.y()) > 3e-5) CHECK(dp.norm() > 10);  // metres in a minute, away from the poles
  });
}

TEST_CASE("P16 a unit mounted another way round gives the same trajectory: readings, biases and attitude turn with the body axes") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const Matrix3d R_bc = so3::exp(random_vector<3>(rng, 1.8));  // c: the axes of the other mounting
    NavigationState other = m.begin;
    NavigationState begin = m.begin;
    begin.accel_bias_b_mps2 = random_vector<3>(rng, 0.1), begin.gyro_bias_b_radps = random_vector<3>(rng, 0.01);
    other.R_wb = begin.R_wb * R_bc;
    other.accel_bias_b_mps2 = R_bc.transpose() * begin.accel_bias_b_mps2,
    other.gyro_bias_b_radps = R_bc.transpose() * begin.gyro_bias_b_radps;
    auto list = m.samples(random_times(rng, 1, 100), SampleKind::instantaneous), turned = list;
    for (ImuSample& s : turned) s.gyro_b_radps = R_bc.transpose() * s.gyro_b_radps, s.accel_b_mps2 = R_bc.transpose() * s.accel_b_mps2;
    const imu::RotatingEarth earth{m.frame};
    const NavigationState x = reckon(begin, list, m.time(0.01), m.time(0.99), earth),
                          y = reckon(other, turned, m.time(0.01), m.time(0.99), earth);
    CHECK((x.p_wb_m - y.p_wb_m).norm() < 1e-10);
    CHECK((x.v_wb_mps - y.v_wb_mps).norm() < 1e-11);
    CHECK(close((x.R_wb * R_bc).eval(), y.R_wb, 1e-13));
  });
}

TEST_CASE("another local frame gives the same trajectory") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const auto other = geodesy::LocalFrame::at(m.frame.to_ecef(random_vector<3>(rng, 5e3)));
    const Matrix3d R = other.R_ew.transpose() * m.frame.R_ew;
    NavigationState begin = m.begin;
    begin.R_wb = R * begin.R_wb, begin.v_wb_mps = R * begin.v_wb_mps, begin.p_wb_m = other.to_local(m.frame.to_ecef(m.begin.p_wb_m));
    const auto list = m.samples(uniform_times(1, 100), SampleKind::instantaneous);
    const NavigationState x = reckon(m.begin, list, m.time(0), m.time(1), imu::RotatingEarth{m.frame}),
                          y = reckon(begin, list, m.time(0), m.time(1), imu::RotatingEarth{other});
    CHECK((other.to_ecef(y.p_wb_m) - m.frame.to_ecef(x.p_wb_m)).norm() < 1e-8);
    CHECK((R * x.v_wb_mps - y.v_wb_mps).norm() < 1e-9);
    CHECK(close((R * x.R_wb).eval(), y.R_wb, 1e-13));
  });
}

TEST_CASE("the predicted covariance: transition equals differences of predict, noise is the motion's and the walk's") {
  for_all_seeds(30, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const imu::RotatingEarth earth{m.frame};
    NavigationState x = m.begin;
    x.accel_bias_b_mps2 = random_vector<3>(rng, 0.1), x.gyro_bias_b_radps = random_vector<3>(rng, 0.002);
    const auto motion = imu::preintegrate<double>(m.samples(uniform_times(1, 100), SampleKind::instantaneous), m.time(0), m.time(1), {});
    REQUIRE(motion.ok());
    const imu::ImuNoise noise;
    const imu::NavigationCovariance none = imu::NavigationCovariance::Zero();
    const imu::NavigationCovariance Q = imu::predict_covariance(x, none, *motion, noise, earth);
    imu::NavigationCovariance F;
    const NavigationState y = imu::predict(x, *motion, earth);
    for (int i = 0; i < 15; ++i) {
      const double step = 1e-3 * NavigationState::linearisation_scale()[i];
      const NavigationState::Step d = step * NavigationState::Step::Unit(i);
      F.col(i) = (y.local(imu::predict(x.retract(d), *motion, earth)) - y.local(imu::predict(x.retract(-d), *motion, earth))) / (2 * step);
    }
    const imu::NavigationCovariance P = random_spd(rng, 15, 100), expected = F * P * F.transpose() + Q;
    CHECK(close(imu::predict_covariance(x, P, *motion, noise, earth), expected, 1e-5));
    CHECK(Q.diagonal().tail<3>().maxCoeff() == doctest::Approx(std::pow(noise.gyro_bias_walk_radps2_sqrt_hz, 2)));
    CHECK(Q(NavigationState::accel_bias, NavigationState::accel_bias) == doctest::Approx(std::pow(noise.accel_bias_walk_mps3_sqrt_hz, 2)));
    CHECK(Q(0, 0) == doctest::Approx(motion->covariance(0, 0)));
    CHECK(Q.block<3, 3>(6, 6).trace() == doctest::Approx(motion->covariance.block<3, 3>(6, 6).trace()).epsilon(1e-3));
  });
}

TEST_CASE("P18 an outage of 10, 30 and 60 s: errors are those of the predicted covariance, in steps or in one go") {
  imu::PreintegrationOptions options;
  for (const double duration : {10.0, 30.0, 60.0}) {
    CAPTURE(duration);
    const int runs = static_cast<int>(property_runs(60));
    double chi2 = 0;
    int beyond_3_sigma = 0;
    for (int run = 0; run < runs; ++run) {
      Rng rng{static_cast<std::uint64_t>(run + 1)};
      const RestingBody body{rng, duration, 20};
      const imu::RotatingEarth earth{body.motion.frame};
      imu::NavigationCovariance P = imu::NavigationCovariance::Zero();
      P.diagonal() << Vector3d::Constant(1e-6), Vector3d::Constant(1e-4), Vector3d::Constant(1e-4), Vector3d::Constant(1e-6),
          Vector3d::Constant(1e-10);
      const NavigationState& truth = body.motion.begin;
      NavigationState x = truth.retract(normal_step(rng, P));
      std::vector<ImuSample> list = body.samples;
      options.kind = SampleKind::mean_to_stamp;  // so that the noise of a segment is that of its sample
      Vector3d accel_walk = Vector3d::Zero(), gyro_walk = Vector3d::Zero();
      const double h = 0.05, root_h = std::sqrt(h);
      for (ImuSample& s : list)
        for (int i = 0; i < 3; ++i) {
          s.accel_b_mps2[i] += accel_walk[i] + normal(rng, options.noise.accel_noise_mps2_sqrt_hz / root_h);
          s.gyro_b_radps[i] += gyro_walk[i] + normal(rng, options.noise.gyro_noise_radps_sqrt_hz / root_h);
          accel_walk[i] += normal(rng, options.noise.accel_bias_walk_mps3_sqrt_hz * root_h);
          gyro_walk[i] += normal(rng, options.noise.gyro_bias_walk_radps2_sqrt_hz * root_h);
        }
      for (int k = 0; k < static_cast<int>(duration); ++k) {
        const auto motion = imu::preintegrate<double>(list, body.motion.time(k), body.motion.time(k + 1), imu::bias_of(x), options);
        REQUIRE(motion.ok());
        P = imu::predict_covariance(x, P, *motion, options.noise, earth);
        x = imu::predict(x, *motion, earth);
      }
      const NavigationState::Step error = truth.local(x);
      const Eigen::Matrix<double, 9, 9> P9 = P.topLeftCorner<9, 9>();
      chi2 += Eigen::LLT<Eigen::Matrix<double, 9, 9>>{P9}.matrixL().solve(error.head<9>()).squaredNorm();
      for (int i = 3; i < 6; ++i) beyond_3_sigma += std::abs(error[i]) > 3 * std::sqrt(P(i, i)) ? 1 : 0;
    }
    CHECK(std::abs(chi2 / runs - 9) < 5 * std::sqrt(18.0 / runs));
    CHECK(beyond_3_sigma <= 2 + runs * 3 / 50);
  }
}
