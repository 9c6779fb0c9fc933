// SPDX-License-Identifier: BSD-3-Clause
// Matching a vehicle to the centre lines of a map: where it is off to, who says nothing when, and that neither the order of lines nor the place on Earth
// matters.
#include <searvins/imu/centreline.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::CentrelineMatch;
using imu::CentrelineOptions;
using imu::CentrelinePoint;
using imu::CentrelineVerdict;

namespace {

const Eigen::Matrix3d kCentimetres = 1e-4 * Eigen::Matrix3d::Identity();

/// A street at a random place, given in East-North-Up of it.
struct Street {
  geodesy::LocalFrame frame;
  std::vector<CentrelinePoint> points{};

  explicit Street(Rng& rng) : frame(geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({uniform(rng, -1.4, 1.4), uniform(rng, -3.1, 3.1), uniform(rng, 0, 2000)}))) {}
  void add(std::uint32_t line, const Eigen::Vector3d& p_w_m) { points.push_back({frame.to_ecef(p_w_m), line}); }
  /// A straight line that is `right_m` to the right of the origin, seen along `heading_rad` (from north over east), with a slope.
  void add_straight(std::uint32_t line, double heading_rad, double right_m, double half_m = 200, double slope = 0) {
    const Eigen::Vector3d t{std::sin(heading_rad), std::cos(heading_rad), slope}, n{std::cos(heading_rad), -std::sin(heading_rad), 0};
    for (const double s : {-half_m, -0.3 * half_m, 0.4 * half_m, half_m}) add(line, right_m * n + s * t);
  }
  [[nodiscard]] CentrelineMatch match(const Eigen::Vector3d& p_w_m, double heading_rad, double speed_mps = 10, const Eigen::Matrix3d& P = kCentimetres,
                                      const CentrelineOptions& options = {}) const {
    const Eigen::Vector3d v_w_mps{speed_mps * std::sin(heading_rad), speed_mps * std::cos(heading_rad), 0};
    return imu::match_centreline(points, frame.to_ecef(p_w_m), frame.R_ew * v_w_mps, frame.R_ew * P * frame.R_ew.transpose(), options);
  }
};

}  // namespace

TEST_CASE("a vehicle to the right of its line is so far to the right of it, wherever on Earth, uphill or down") {
  for_all_seeds(100, [](Rng& rng) {
    Street street(rng);
    const double heading = uniform(rng, -3.1, 3.1), right_m = uniform(rng, -1.2, 1.2), along_m = uniform(rng, -100, 100), height_m = uniform(rng, -20, 20);
    street.add_straight(1, heading, 0, 200, uniform(rng, -0.1, 0.1));
    const Eigen::Vector3d n{std::cos(heading), -std::sin(heading), 0}, t{std::sin(heading), std::cos(heading), 0};
    const CentrelineMatch m = street.match(right_m * n + along_m * t + Eigen::Vector3d{0, 0, height_m}, heading + uniform(rng, -0.2, 0.2));
    REQUIRE(m.verdict == CentrelineVerdict::matched);
    CHECK(m.offset_m == doctest::Approx(right_m).epsilon(1e-6).scale(100));
    CHECK((street.frame.R_ew.transpose() * m.right_e - n).norm() < 1e-4);
    const Eigen::Vector3d foot_w_m = street.frame.to_local(m.point_e_m);
    CHECK(foot_w_m.dot(t) == doctest::Approx(along_m).epsilon(1e-4).scale(100));
    CHECK(std::abs(foot_w_m.dot(n)) < 1e-3);
  });
}

TEST_CASE("against the order of its points the side is that of the line, not of the vehicle; where lines are one way there is no match") {
  for_all_seeds(50, [](Rng& rng) {
    Street street(rng);
    const double heading = uniform(rng, -3.1, 3.1);
    street.add_straight(1, heading, 0);
    const Eigen::Vector3d n{std::cos(heading), -std::sin(heading), 0};
    const CentrelineMatch with = street.match(0.7 * n, heading), against = street.match(0.7 * n, heading + 3.14159);
    REQUIRE(against.verdict == CentrelineVerdict::matched);
    CHECK(with.offset_m == doctest::Approx(against.offset_m));
    CentrelineOptions one_way;
    one_way.both_ways = false;
    CHECK(street.match(0.7 * n, heading, 10, kCentimetres, one_way).verdict == CentrelineVerdict::matched);
    CHECK(street.match(0.7 * n, heading + 3.14159, 10, kCentimetres, one_way).verdict == CentrelineVerdict::none_near);
  });
}

TEST_CASE("nothing is said when slow, across a line, past its end, or beyond the gate; the covariance widens the gate across the line only") {
  for_all_seeds(50, [](Rng& rng) {
    Street street(rng);
    const double heading = uniform(rng, -3.1, 3.1);
    street.add_straight(1, heading, 0);
    const Eigen::Vector3d n{std::cos(heading), -std::sin(heading), 0}, t{std::sin(heading), std::cos(heading), 0};
    CHECK(street.match({0, 0, 0}, heading, 1).verdict == CentrelineVerdict::slow);
    CHECK(street.match({0, 0, 0}, heading + 1.2).verdict == CentrelineVerdict::none_near);
    CHECK(street.match(230 * t, heading).verdict == CentrelineVerdict::none_near);
    CHECK(street.match(4 * n, heading).verdict == CentrelineVerdict::gated);
    const Eigen::Matrix3d across = 4 * n * n.transpose() + kCentimetres, along = 4 * t * t.transpose() + kCentimetres;
    CHECK(street.match(4 * n, heading, 10, across).verdict == CentrelineVerdict::matched);
    CHECK(street.match(4 * n, heading, 10, along).verdict == CentrelineVerdict::gated);
  });
}

TEST_CASE("two lanes within the gate are ambiguous, however the map lists them; with a better position one is told from the other") {
  for_all_seeds(50, [](Rng& rng) {
    Street street(rng);
    const double heading = uniform(rng, -3.1, 3.1);
    street.add_straight(1, heading, 0), street.add_straight(2, heading, 3.5), street.add_straight(3, heading + 1.5, 0);
    const Eigen::Vector3d n{std::cos(heading), -std::sin(heading), 0};
    const Eigen::Matrix3d vague = 2 * Eigen::Matrix3d::Identity();
    const bool is_turned = chance(rng, 0.5);
    if (is_turned) std::reverse(street.points.begin(), street.points.end());
    CHECK(street.match(0.4 * n, heading, 10, vague).verdict == CentrelineVerdict::ambiguous);
    const CentrelineMatch left = street.match(0.4 * n, heading), right = street.match(3.2 * n, heading);
    CHECK(left.verdict == CentrelineVerdict::matched);
    CHECK(right.verdict == CentrelineVerdict::matched);
    CHECK(left.offset_m == doctest::Approx(is_turned ? -0.4 : 0.4).epsilon(1e-5));
    CHECK(right.offset_m == doctest::Approx(is_turned ? 0.3 : -0.3).epsilon(1e-5));
  });
}

TEST_CASE("before a bend nothing is said by who does not know how far it is, and something by who does") {
  for_all_seeds(50, [](Rng& rng) {
    Street street(rng);
    const double heading = uniform(rng, -3.1, 3.1), side = chance(rng, 0.5) ? 1 : -1;
    const Eigen::Vector3d n{std::cos(heading), -std::sin(heading), 0}, t{std::sin(heading), std::cos(heading), 0};
    for (const double s : {-200.0, -60.0, 0.0, 40.0}) street.add(1, s * t);
    street.add(1, 50 * t + 10 * side * n), street.add(1, 50 * t + 80 * side * n);
    const auto vague_along = [&](double sigma_m) { return Eigen::Matrix3d{sigma_m * sigma_m * t * t.transpose() + kCentimetres}; };
    CHECK(street.match(20 * t, heading, 10, vague_along(5)).verdict == CentrelineVerdict::matched);
    CHECK(street.match(20 * t, heading, 10, vague_along(10)).verdict == CentrelineVerdict::bent);
    CHECK(street.match(-60.1 * t, heading, 10, vague_along(20)).verdict == CentrelineVerdict::matched);
    CHECK(street.match(-180 * t, heading, 10, vague_along(10)).verdict == CentrelineVerdict::bent);  // the map ends
    CHECK(street.match(-180 * t, heading, 10, vague_along(5)).verdict == CentrelineVerdict::matched);
    if (chance(rng, 0.5)) std::reverse(street.points.begin(), street.points.end());
    CHECK(street.match(20 * t, heading, 10, vague_along(10)).verdict == CentrelineVerdict::bent);
  });
}

TEST_CASE("bad input: no map, one point, doubled points, NaN: nothing is said") {
  Rng rng{3};
  Street street(rng);
  CHECK(street.match({0, 0, 0}, 0).verdict == CentrelineVerdict::none_near);
  street.add(1, {0, 0, 0});
  CHECK(street.match({0, 0, 0}, 0).verdict == CentrelineVerdict::none_near);
  street.add(1, {0, 0, 0});
  CHECK(street.match({0, 0, 0}, 0).verdict == CentrelineVerdict::none_near);
  street.add(1, {0, std::nan(""), 0});
  CHECK(street.match({0, 0, 0}, 0).verdict == CentrelineVerdict::none_near);
  CHECK(street.match({0, 0, 0}, 0, std::nan("")).verdict == CentrelineVerdict::slow);
}
