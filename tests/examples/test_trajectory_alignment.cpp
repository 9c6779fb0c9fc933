// SPDX-License-Identifier: BSD-3-Clause
// Errors of trajectories without a place in the world: known motions are found again, tilt stays visible, rests are answered.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "examples/support/angle_units.hpp"
#include "examples/support/trajectory_alignment.hpp"
#include "examples/support/tum_trajectory.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::test::close;
using searvins::test::for_all_seeds;
using searvins::test::normal;
using searvins::test::random_vector;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

using searvins::examples::kRadPerDeg;

/// A smooth path of some metres, one pose in a tenth of a second.
std::vector<TimedPose> random_path(Rng& rng, std::size_t n, double size_m) {
  std::vector<TimedPose> path;
  const Eigen::Vector3d rate = random_vector(rng, 2), phase = random_vector(rng, 3), turn = random_vector(rng, 0.1);
  Eigen::Matrix3d R = so3::exp(random_vector(rng, 3));
  for (std::size_t i = 0; i < n; ++i) {
    const double t = 0.1 * static_cast<double>(i);
    TimedPose x;
    x.time = GpsTime{static_cast<std::int64_t>(i) * 100'000'000};
    for (int k = 0; k < 3; ++k) x.p_w_m[k] = size_m * std::sin(rate[k] * t + phase[k]);
    x.R_wb = R;
    R = R * so3::exp(turn);
    path.push_back(x);
  }
  return path;
}

std::vector<TimedPose> moved(const RigidMotion& m, const std::vector<TimedPose>& path) {
  std::vector<TimedPose> out;
  for (const TimedPose& x : path) out.push_back(m * x);
  return out;
}

RigidMotion inverse(const RigidMotion& m) { return {m.R.transpose(), -(m.R.transpose() * m.t_m)}; }

}  // namespace

TEST_CASE("alignment: a rigid motion is found again, by either freedom where it is theirs") {
  for_all_seeds(50, [](Rng& rng) {
    const std::vector<TimedPose> truth = random_path(rng, 80, 3);
    const RigidMotion any{so3::exp(random_vector(rng, 3)), random_vector(rng, 50)};
    const auto pairs = paired(moved(inverse(any), truth), truth);
    REQUIRE(pairs.size() == truth.size());
    const auto six = absolute_error(pairs, AlignmentFreedom::pose);
    REQUIRE(six.ok());
    CHECK(close(six->alignment.truth_from_estimate.R, any.R, 1e-9));
    CHECK(close(six->alignment.truth_from_estimate.t_m, any.t_m, 1e-9));
    CHECK(six->position_m.max < 1e-9);
    CHECK(six->tilt_deg.max < 1e-6);

    const RigidMotion yaw{so3::exp(Eigen::Vector3d{0, 0, uniform(rng, -3.1, 3.1)}), random_vector(rng, 50)};
    const auto four = absolute_error(paired(moved(inverse(yaw), truth), truth), AlignmentFreedom::yaw_and_position);
    REQUIRE(four.ok());
    CHECK(close(four->alignment.truth_from_estimate.R, yaw.R, 1e-9));
    CHECK(four->position_m.max < 1e-9);
    CHECK_FALSE(four->alignment.by_attitude);
  });
}

TEST_CASE("alignment: an error of tilt stays visible with four degrees of freedom and is turned away with six") {
  for_all_seeds(30, [](Rng& rng) {
    const std::vector<TimedPose> truth = random_path(rng, 100, 5);
    const double tilt_deg = uniform(rng, 1, 10), course = uniform(rng, -3, 3);
    const RigidMotion tilted{so3::exp(Eigen::Vector3d{kRadPerDeg * tilt_deg * Eigen::Vector3d{std::cos(course), std::sin(course), 0}}),
                             {1, 2, 3}};
    const auto pairs = paired(moved(tilted, truth), truth);
    const auto four = absolute_error(pairs, AlignmentFreedom::yaw_and_position), six = absolute_error(pairs, AlignmentFreedom::pose);
    REQUIRE((four.ok() && six.ok()));
    CHECK(four->tilt_deg.rmse == doctest::Approx(tilt_deg).epsilon(0.02));
    CHECK(four->position_m.rmse > 0.2 * kRadPerDeg * tilt_deg);
    CHECK(six->position_m.rmse < 1e-9);
  });
}

TEST_CASE("alignment: with noise it is the best there is: no small change makes the distances less") {
  for_all_seeds(20, [](Rng& rng) {
    const std::vector<TimedPose> truth = random_path(rng, 60, 4);
    std::vector<TimedPose> estimate = moved({so3::exp(Eigen::Vector3d{0, 0, uniform(rng, -3, 3)}), random_vector(rng, 9)}, truth);
    for (TimedPose& x : estimate)
      for (int k = 0; k < 3; ++k) x.p_w_m[k] += normal(rng, 0.05);
    const auto pairs = paired(estimate, truth);
    const double arm_m = 1e-6;  // positions alone
    for (const AlignmentFreedom freedom : {AlignmentFreedom::yaw_and_position, AlignmentFreedom::pose}) {
      const auto best = align(pairs, freedom, arm_m);
      REQUIRE(best.ok());
      const auto cost = [&](const RigidMotion& m) {
        double sum = 0;
        for (const PosePair& p : pairs) sum += (m * p.estimate.p_w_m - p.truth.p_w_m).squaredNorm();
        return sum;
      };
      const double least = cost(best->truth_from_estimate);
      for (int k = 0; k < 20; ++k) {
        RigidMotion other = best->truth_from_estimate;
        Eigen::Vector3d turn = random_vector(rng, 1e-3);
        if (freedom == AlignmentFreedom::yaw_and_position) turn.head<2>().setZero();
        other.R = so3::exp(turn) * other.R, other.t_m += random_vector(rng, 1e-3);
        CHECK(cost(other) >= least);
      }
    }
  });
}

TEST_CASE("alignment: a body at rest is turned by its attitudes; a line, about itself; nothing is no data") {
  for_all_seeds(30, [](Rng& rng) {
    TimedPose rest;
    rest.p_w_m = random_vector(rng, 5), rest.R_wb = so3::exp(random_vector(rng, 3));
    const RigidMotion any{so3::exp(random_vector(rng, 3)), random_vector(rng, 9)};
    std::vector<TimedPose> truth;
    for (int i = 0; i < 20; ++i) truth.push_back({GpsTime{i}, rest.p_w_m, rest.R_wb});
    const auto still = absolute_error(paired(moved(inverse(any), truth), truth), AlignmentFreedom::pose);
    REQUIRE(still.ok());
    CHECK(still->alignment.by_attitude);
    CHECK(close(still->alignment.truth_from_estimate.R, any.R, 1e-9));
    CHECK(still->position_m.max < 1e-9);
    const RigidMotion yaw{so3::exp(Eigen::Vector3d{0, 0, uniform(rng, -3, 3)}), random_vector(rng, 9)};
    const auto level = absolute_error(paired(moved(inverse(yaw), truth), truth), AlignmentFreedom::yaw_and_position);
    REQUIRE(level.ok());
    CHECK(level->alignment.by_attitude);
    CHECK(close(level->alignment.truth_from_estimate.R, yaw.R, 1e-9));

    for (std::size_t i = 0; i < truth.size(); ++i) truth[i].p_w_m += static_cast<double>(i) * Eigen::Vector3d{1, 2, 3};
    const auto line = absolute_error(paired(moved(inverse(any), truth), truth), AlignmentFreedom::pose);
    REQUIRE(line.ok());
    CHECK(line->alignment.by_attitude);
    CHECK(close(line->alignment.truth_from_estimate.R, any.R, 1e-7));
  });
  CHECK(absolute_error({}, AlignmentFreedom::pose).status().code == StatusCode::no_data);
}

TEST_CASE("pairs: the truth between its rows; gaps and ends are left out") {
  std::vector<TimedPose> truth;
  for (const double t_s : {0.0, 0.2, 0.4, 2.0})
    truth.push_back({GpsTime{}.plus_seconds(t_s), Eigen::Vector3d{t_s, 0, -t_s}, so3::exp(Eigen::Vector3d{0, t_s, 0})});
  std::vector<TimedPose> estimate;
  for (const double t_s : {-0.1, 0.0, 0.1, 0.4, 1.0, 2.0, 2.1})
    estimate.push_back({GpsTime{}.plus_seconds(t_s), {}, Eigen::Matrix3d::Identity()});
  const auto pairs = paired(estimate, truth);
  REQUIRE(pairs.size() == 4);
  const double at_s[] = {0.0, 0.1, 0.4, 2.0};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(pairs[i].estimate.time == GpsTime{}.plus_seconds(at_s[i]));
    CHECK(close(pairs[i].truth.p_w_m, Eigen::Vector3d{at_s[i], 0, -at_s[i]}, 1e-9));
    CHECK(close(pairs[i].truth.R_wb, so3::exp(Eigen::Vector3d{0, at_s[i], 0}), 1e-9));
  }
}

TEST_CASE("relative error: blind to any rigid motion, says a scale in percent and a drift of heading in degrees") {
  for_all_seeds(20, [](Rng& rng) {
    std::vector<TimedPose> truth, estimate;
    const double scale = uniform(rng, 0.9, 1.1), drift_deg_m = uniform(rng, 0.01, 0.2);
    const RigidMotion any{so3::exp(random_vector(rng, 3)), random_vector(rng, 50)};
    for (int i = 0; i <= 300; ++i) {
      const double way_m = 0.1 * i;
      truth.push_back({GpsTime{std::int64_t{i} * 100'000'000}, {way_m, 0, 0}, Eigen::Matrix3d::Identity()});
      estimate.push_back(
          any * TimedPose{truth.back().time, {scale * way_m, 0, 0}, so3::exp(Eigen::Vector3d{way_m * drift_deg_m * kRadPerDeg, 0, 0})});
    }
    const auto pairs = paired(estimate, truth);
    for (const double length_m : {1.0, 10.0}) {
      const RelativeError e = relative_error_over_distance(pairs, length_m);
      CHECK(e.translation_m.count >= static_cast<std::size_t>(10 * (30 - length_m)) - 1);
      CHECK(e.translation_pct.mean == doctest::Approx(100 * std::abs(scale - 1)).epsilon(1e-6).scale(0));
      CHECK(e.rotation_deg.mean == doctest::Approx(drift_deg_m * length_m).epsilon(0.11));  // stretches end at the next pose
    }
    const RelativeError in_time = relative_error_over_time(pairs, 2);  // 1 m/s
    CHECK(in_time.translation_m.mean == doctest::Approx(2 * std::abs(scale - 1)).epsilon(1e-6).scale(0));
    CHECK(relative_error_over_distance(pairs, 31).translation_m.count == 0);
  });
  // A rest of a thousand poses is one beginning.
  std::vector<TimedPose> waits;
  for (int i = 0; i < 1000; ++i) waits.push_back({GpsTime{std::int64_t{i} * 1'000'000}, {0, 0, 0}, Eigen::Matrix3d::Identity()});
  waits.push_back({GpsTime{2'000'000'000}, {1.5, 0, 0}, Eigen::Matrix3d::Identity()});
  CHECK(relative_error_over_distance(paired(waits, waits), 1).translation_m.count == 1);
}

TEST_CASE("TUM text: stamps to the nanosecond, body in the world") {
  TimedPose x;
  x.time = GpsTime{1'403'715'273'000'000'007};
  x.p_w_m = {1, -2.5, 0.25};
  x.R_wb = so3::exp(Eigen::Vector3d{0, 0, std::numbers::pi / 2});
  const std::string text = tum_text({x}, "made up");
  CHECK(text ==
        "# made up\n# timestamp tx ty tz qx qy qz qw\n"
        "1403715273.000000007 1.000000 -2.500000 0.250000 0.000000000 0.000000000 0.707106781 0.707106781\n");
}
