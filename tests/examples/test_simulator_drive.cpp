// SPDX-License-Identifier: BSD-3-Clause
// The simulator's vehicle: routes, attitude, and what an ideal and a real IMU on it measure.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>

#include "examples/simulator/imu_sensor.hpp"
#include "examples/simulator/spline_route.hpp"
#include "examples/simulator/street_route.hpp"
#include "examples/simulator/vehicle.hpp"
#include "examples/support/angle_units.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

using searvins::examples::kRadPerDeg;

geodesy::LocalFrame frame_at(double lat_deg, double lon_deg) {
  return geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({lat_deg * kRadPerDeg, lon_deg * kRadPerDeg, 100}));
}

simulator::Vehicle generated(std::uint64_t seed, double duration_s) {
  simulator::Random random(seed);
  return {simulator::StreetRoute(duration_s, random), frame_at(48.1, 11.5), {0.284, -0.517, 0.142}};
}

/// Speed and the two parts of the horizontal acceleration.
struct Dynamics {
  double speed, forward, right;
};
Dynamics dynamics(const simulator::PathMotion& m) {
  const Eigen::Vector2d ahead{std::sin(m.heading_rad), std::cos(m.heading_rad)}, right{ahead.y(), -ahead.x()};
  return {m.v_mps.dot(ahead), m.a_mps2.dot(ahead), m.a_mps2.dot(right)};
}

/// The angle between two attitudes.
double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) { return Eigen::AngleAxisd(a.transpose() * b).angle(); }

/// Position, velocity and attitude in the inertial axes that coincide with ECEF at time 0.
struct Inertial {
  Eigen::Vector3d p, v;
  Eigen::Quaterniond q;
};

Eigen::Matrix3d earth_turned(double t_s) { return Eigen::AngleAxisd(7.292115e-5 * t_s, Eigen::Vector3d::UnitZ()).toRotationMatrix(); }

/// The strapdown equations in inertial axes, by the midpoint rule with the library's gravity.
Inertial integrate(const simulator::Vehicle& vehicle, Inertial s, double from_s, double to_s, int steps) {
  const Eigen::Vector3d earth{0, 0, 7.292115e-5};
  const auto gravitation = [&](const Eigen::Vector3d& p_i, double t_s) {
    const Eigen::Matrix3d R = earth_turned(t_s);
    const Eigen::Vector3d p_e = R.transpose() * p_i;
    return Eigen::Vector3d{R * (geodesy::gravity_e_mps2(p_e) + earth.cross(earth.cross(p_e)))};
  };
  const double dt = (to_s - from_s) / steps;
  for (int k = 0; k < steps; ++k) {
    const double middle_s = from_s + (k + 0.5) * dt;
    const simulator::ImuTruth m = vehicle.imu(middle_s);
    const Eigen::Vector3d turn = m.w_ib_b_radps * dt;
    const auto rotated = [&](double share) {
      const double angle = share * turn.norm();
      return angle < 1e-15 ? s.q : s.q * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn.normalized()));
    };
    const Eigen::Vector3d half_p = s.p + s.v * dt / 2;
    const Eigen::Vector3d a = rotated(0.5) * m.f_b_mps2 + gravitation(half_p, middle_s);
    s.p += s.v * dt + a * dt * dt / 2;
    s.v += a * dt;
    s.q = rotated(1).normalized();
  }
  return s;
}

Inertial inertial_state(const simulator::Vehicle& vehicle, double t_s) {
  const simulator::VehicleState s = vehicle.state(t_s);
  const geodesy::LocalFrame& frame = vehicle.frame();
  const Eigen::Vector3d p_e = frame.to_ecef(s.p_w_m), v_e = frame.R_ew * s.v_w_mps;
  const Eigen::Matrix3d R = earth_turned(t_s);
  return {R * p_e, R * (v_e + Eigen::Vector3d{0, 0, 7.292115e-5}.cross(p_e)), Eigen::Quaterniond(R * frame.R_ew * s.R_wb)};
}

}  // namespace

TEST_CASE("simulated drive: generated routes keep to speed and acceleration, stand at first, and get somewhere") {
  for_all_seeds(6, [](Rng& rng) {
    simulator::Random random(rng());
    const simulator::StreetRoute route(600, random);
    REQUIRE(route.end_s() >= 600);
    double way_m = 0, standing_s = 0, turned_rad = 0;
    simulator::PathMotion before = route.at(0);
    CHECK(route.at(-5).v_mps.norm() == 0);
    CHECK(route.at(19.9).v_mps.norm() == 0);
    CHECK(route.at(route.end_s() + 100).v_mps.norm() < 1e-9);
    for (double t = 0.05; t < 600; t += 0.05) {
      const simulator::PathMotion m = route.at(t);
      const Dynamics d = dynamics(m);
      CHECK(d.speed <= 14.0001);
      CHECK(d.speed >= -1e-9);
      CHECK(d.forward <= 1.8001);
      CHECK(d.forward >= -2.2001);
      CHECK(std::abs(d.right) <= 2.3001);
      way_m += d.speed * 0.05, standing_s += d.speed < 0.01 ? 0.05 : 0;
      turned_rad += std::abs(m.heading_rad - before.heading_rad);
      // The place goes on with the velocity, the velocity with the acceleration; neither jumps.
      CHECK((m.p_m - before.p_m - 0.025 * (m.v_mps + before.v_mps)).norm() < 2e-3);
      CHECK((m.v_mps - before.v_mps - 0.025 * (m.a_mps2 + before.a_mps2)).norm() < 5e-3);
      before = m;
    }
    CHECK(way_m > 1200);
    CHECK(standing_s > 25);
    CHECK(turned_rad > 3);
  });
}

TEST_CASE("simulated drive: velocity, acceleration and rate of turn are derivatives of place and attitude") {
  const simulator::Vehicle vehicle = generated(3, 300);
  for_all_seeds(60, [&](Rng& rng) {
    const double t = uniform(rng, 15, 290), h = 1e-3;
    const simulator::VehicleState s = vehicle.state(t), ahead = vehicle.state(t + h), behind = vehicle.state(t - h);
    CHECK(((ahead.p_w_m - behind.p_w_m) / (2 * h) - s.v_w_mps).norm() < 1e-5);
    CHECK(((ahead.v_w_mps - behind.v_w_mps) / (2 * h) - s.a_w_mps2).norm() < 1e-5);
    const Eigen::AngleAxisd turn(behind.R_wb.transpose() * ahead.R_wb);
    CHECK((turn.angle() * turn.axis() / (2 * h) - s.w_wb_b_radps).norm() < 2e-5);
    CHECK((s.R_wb.transpose() * s.R_wb - Eigen::Matrix3d::Identity()).norm() < 1e-12);
    // Road vehicle: no motion sideways, and forward is the second body axis.
    const Eigen::Vector3d v_b = s.R_wb.transpose() * s.v_w_mps;
    CHECK(std::abs(v_b.x()) < 0.02 * (1 + v_b.norm()));
    CHECK(v_b.y() > -1e-9);
  });
}

TEST_CASE("simulated drive: a spline through given positions follows them smoothly") {
  std::vector<simulator::GivenPoint> given;
  for (double t = 0; t <= 120; t += 0.2) {
    const double way = t < 20 ? 0.0 : 6 * (t - 20) - 12 * std::sin((t - 20) / 2), radius = 80;  // stands, then drives a circle
    given.push_back({t, {radius * std::sin(way / radius), radius * (1 - std::cos(way / radius)), 0.01 * way}});
  }
  const simulator::SplineRoute route(given);
  double worst_m = 0;
  for (const simulator::GivenPoint& g : given) worst_m = std::max(worst_m, (route.at(g.t_s).p_m - g.p_w_m.head<2>()).norm());
  CHECK(worst_m < 0.4);
  CHECK(worst_m > 1e-4);  // it smooths
  CHECK(route.at(5).v_mps.norm() < 1e-12);
  const double h = 1e-4;
  for (double t = 10; t < 115; t += 0.37) {
    const simulator::PathMotion m = route.at(t);
    CHECK(((route.at(t + h).p_m - route.at(t - h).p_m) / (2 * h) - m.v_mps).norm() < 1e-6);
    CHECK(((route.at(t + h).v_mps - route.at(t - h).v_mps) / (2 * h) - m.a_mps2).norm() < 1e-6);
    if (m.v_mps.norm() > 4)
      CHECK(std::abs(std::remainder(std::atan2(m.v_mps.x(), m.v_mps.y()) - m.heading_rad, 2 * std::numbers::pi)) < 0.02);
  }
  double sum = 0;
  for (const double w : simulator::spline_weights<5>(0.3)) sum += w;
  CHECK(sum == doctest::Approx(1));
}

TEST_CASE("simulated IMU: at rest it feels gravity upwards and the turn of the Earth") {
  const simulator::Vehicle vehicle = generated(1, 60);
  const simulator::VehicleState s = vehicle.state(5);
  const simulator::ImuTruth m = vehicle.imu(5);
  const Eigen::Vector3d p_e = vehicle.frame().to_ecef(s.p_w_m);
  const Eigen::Matrix3d R_eb = vehicle.frame().R_ew * s.R_wb;
  CHECK((m.f_b_mps2 + R_eb.transpose() * geodesy::gravity_e_mps2(p_e)).norm() < 1e-6);
  CHECK((m.w_ib_b_radps - R_eb.transpose() * Eigen::Vector3d{0, 0, 7.292115e-5}).norm() < 1e-10);
  CHECK(m.f_b_mps2.z() == doctest::Approx(9.81).epsilon(0.002));
}

TEST_CASE("simulated IMU: integrating it in inertial axes gives the drive back within millimetres") {
  double worst_m = 0;
  for_all_seeds(4, [&](Rng& rng) {
    const simulator::Vehicle vehicle = generated(rng(), 200);
    const double from = uniform(rng, 20, 180), to = from + 10;
    const Inertial end = integrate(vehicle, inertial_state(vehicle, from), from, to, 4000), truth = inertial_state(vehicle, to);
    worst_m = std::max(worst_m, (end.p - truth.p).norm());
    CHECK((end.p - truth.p).norm() < 2e-3);
    CHECK((end.v - truth.v).norm() < 5e-4);
    CHECK(angle_between(end.q.toRotationMatrix(), truth.q.toRotationMatrix()) < 2e-6);
  });
  MESSAGE("worst position after 10 s: ", 1000 * worst_m, " mm");
}

TEST_CASE("simulated IMU: errors have the densities and the turn-on spread that rig.json names") {
  const simulator::Vehicle vehicle = generated(1, 30);
  const simulator::ImuNoise noise;
  double bias2 = 0, white2 = 0;
  constexpr int kSensors = 60, kRows = 200;
  for (int n = 0; n < kSensors; ++n) {
    simulator::ImuSensor sensor(noise, 100, simulator::ImuSampling::instantaneous, simulator::Random(static_cast<std::uint64_t>(n)));
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> errors;
    for (int k = 0; k < kRows; ++k) {
      const double t = 0.01 * k;  // still standing
      errors.emplace_back(sensor.measure(vehicle, t).w_ib_b_radps - sensor.without_errors(vehicle, t).w_ib_b_radps);
      mean += errors.back() / kRows;
    }
    bias2 += mean.squaredNorm() / (3 * kSensors);
    for (const Eigen::Vector3d& e : errors) white2 += (e - mean).squaredNorm() / (3.0 * (kRows - 1) * kSensors);
  }
  CHECK(std::sqrt(bias2) == doctest::Approx(noise.gyro_bias_sigma_radps).epsilon(0.25));
  CHECK(std::sqrt(white2) == doctest::Approx(noise.gyro_noise_radps_sqrt_hz * 10).epsilon(0.05));
}

TEST_CASE("simulated IMU: a mean_to_stamp row is the mean of the truth since the row before") {
  const simulator::Vehicle vehicle = generated(2, 100);
  const simulator::ImuSensor mean(simulator::ImuNoise{}, 100, simulator::ImuSampling::mean_to_stamp, simulator::Random(1));
  for (const double t : {30.0, 41.3, 55.55, 70.01}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < 50; ++i) sum += vehicle.imu(t - 0.01 + (i + 0.5) * 0.0002).f_b_mps2 / 50;
    CHECK((mean.without_errors(vehicle, t).f_b_mps2 - sum).norm() < 1e-6);
  }
}
