// SPDX-License-Identifier: BSD-3-Clause
// The simulator's city: mirrors, roof edges, and labels that agree with the geometry.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "examples/simulator/simulation.hpp"
#include "examples/support/angle_units.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using simulator::City;
using simulator::Surroundings;
using simulator::Wall;

namespace {

using searvins::examples::kRadPerDeg;
constexpr double kFarM = 1e7;

Eigen::Vector3d direction(double azimuth_rad, double elevation_rad) {
  return {std::cos(elevation_rad) * std::sin(azimuth_rad), std::cos(elevation_rad) * std::cos(azimuth_rad), std::sin(elevation_rad)};
}

/// One wall from a to b whose normal is to the right of that way.
Wall wall_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double top_m) {
  const Eigen::Vector2d along = (b - a).normalized();
  return {a, b, {along.y(), -along.x()}, -2, top_m, 8, 0};
}

/// Whether the building of four walls w .. w + 3 holds a place.
bool holds(const City& city, std::size_t w, const Eigen::Vector3d& p) {
  if (p.z() >= city.walls[w].top_m) return false;
  for (std::size_t i = w; i < w + 4; ++i)
    if (city.walls[i].normal.dot(p.head<2>() - city.walls[i].a_m) > 0) return false;
  return true;
}

/// Whether a step-by-step walk along the ray meets a building, or a bridge's underside.
bool meets_anything(const City& city, const Eigen::Vector3d& from_m, const Eigen::Vector3d& u) {
  for (double along = 0; along < 250 && from_m.z() + along * u.z() < 100; along += 0.2) {
    const Eigen::Vector3d p = from_m + along * u, next = p + 0.2 * u;
    for (std::size_t w = 0; w < city.walls.size(); w += 4)
      if ((city.walls[w].a_m - p.head<2>()).squaredNorm() < 60 * 60 && holds(city, w, p)) return true;
    for (const simulator::Bridge& b : city.bridges)
      if (p.z() < b.underside_m && next.z() >= b.underside_m) {
        const Eigen::Vector2d off = p.head<2>() - b.centre_m;
        if (std::abs(off.dot(b.along)) < b.half_length_m && std::abs(off.dot(Eigen::Vector2d{b.along.y(), -b.along.x()})) < b.half_width_m)
          return true;
      }
  }
  return false;
}

simulator::SimulationOptions urban(double duration_s, std::uint64_t seed) {
  simulator::SimulationOptions options;
  options.profile = "urban", options.duration_s = duration_s, options.seed = seed;
  return options;
}

}  // namespace

TEST_CASE("simulated city: a wall 5 m to the west sends the signal from the east back, 10 m cos(el) late") {
  City city;
  city.walls.push_back(wall_between({-5, -50}, {-5, 50}, 30));
  CHECK(city.walls[0].normal.x() == 1);
  const Eigen::Vector3d antenna{0, 0, 2};
  const Surroundings around(city, antenna);
  const auto seen = around.reflection(direction(90 * kRadPerDeg, 40 * kRadPerDeg));
  REQUIRE(seen);
  CHECK(seen->extra_m == doctest::Approx(10 * std::cos(40 * kRadPerDeg)));
  CHECK(seen->point_m.x() == doctest::Approx(-5));
  CHECK(seen->point_m.z() == doctest::Approx(2 + 5 * std::tan(40 * kRadPerDeg)));
  CHECK(!around.reflection(direction(270 * kRadPerDeg, 40 * kRadPerDeg)));       // the satellite is behind the wall
  CHECK(!around.reflection(direction(90 * kRadPerDeg, 85 * kRadPerDeg)));        // the mirror point would be above the roof
  CHECK(around.direct(direction(90 * kRadPerDeg, 10 * kRadPerDeg)).is_clear);    // away from the wall
  CHECK(!around.direct(direction(270 * kRadPerDeg, 75 * kRadPerDeg)).is_clear);  // the roof is at 79.9 degrees
  CHECK(around.direct(direction(270 * kRadPerDeg, 81 * kRadPerDeg)).is_clear);
}

TEST_CASE("simulated city: the extra path of a reflection is the detour over the mirror point") {
  unsigned found = 0;
  for_all_seeds(400, [&](Rng& rng) {
    const double angle = uniform(rng, 0, 6.28);
    const Eigen::Vector2d along{std::cos(angle), std::sin(angle)}, middle = random_vector<2>(rng, 30);
    City city;
    city.walls.push_back(wall_between(middle - 40 * along, middle + 40 * along, 40));
    const Eigen::Vector3d antenna{0, 0, 2}, u = direction(uniform(rng, 0, 6.28), uniform(rng, 0.2, 1.3));
    const auto seen = Surroundings(city, antenna).reflection(u);
    if (!seen) return;
    ++found;
    const Eigen::Vector3d satellite = antenna + kFarM * u;
    const double over_m = (satellite - seen->point_m).norm() + (seen->point_m - antenna).norm(), straight_m = (satellite - antenna).norm();
    CHECK(seen->extra_m == doctest::Approx(over_m - straight_m).epsilon(1e-3));
    // Fermat: no other point of the wall gives a shorter way to first order.
    const Eigen::Vector3d side{along.x(), along.y(), 0};
    for (const Eigen::Vector3d& step : {Eigen::Vector3d{1e-2 * side}, Eigen::Vector3d{0, 0, 1e-2}})
      CHECK((satellite - seen->point_m - step).norm() + (seen->point_m + step - antenna).norm() >= over_m - 1e-6);
  });
  CHECK(found >= property_runs(400) / 15);  // most walls stand elsewhere
}

TEST_CASE("simulated city: the detour over a roof is the shortest way over its edge, and the loss begins with 6 dB") {
  unsigned bent = 0;
  for_all_seeds(200, [&](Rng& rng) {
    City city;
    const Eigen::Vector2d a = Eigen::Vector2d{uniform(rng, 5, 25), -100}, b = Eigen::Vector2d{uniform(rng, 5, 25), 100};
    city.walls.push_back(wall_between(b, a, uniform(rng, 8, 40)));
    const Eigen::Vector3d antenna{0, 0, 2}, u = direction(uniform(rng, 45, 135) * kRadPerDeg, uniform(rng, 0.2, 1.2));
    const simulator::DirectRay ray = Surroundings(city, antenna).direct(u);
    if (ray.is_clear) {
      CHECK(ray.detour_m == 0);
      return;
    }
    ++bent;
    double shortest = 1e9;
    for (double part = 0; part <= 1; part += 1e-4) {
      const Eigen::Vector2d p = a + part * (b - a);
      const Eigen::Vector3d edge{p.x(), p.y(), city.walls[0].top_m};
      shortest = std::min(shortest, (edge - antenna).norm() - u.dot(edge - antenna));
    }
    CHECK(ray.detour_m == doctest::Approx(shortest).epsilon(1e-3));
  });
  CHECK(bent >= property_runs(200) / 5);
  CHECK(simulator::knife_edge_loss_db(0, 0.19) == doctest::Approx(6.03).epsilon(0.01));
  CHECK(simulator::knife_edge_loss_db(1, 0.19) ==
        doctest::Approx(20 * std::log10(2 * std::numbers::pi * std::sqrt(2 / 0.19))).epsilon(0.05));
}

TEST_CASE("simulated city: nothing stands in the way of the vehicle") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const simulator::Simulation drive(urban(300, seed));
    CHECK(drive.city().buildings > 20);
    for (std::size_t i = 0; i < drive.way().size(); i += 3)
      for (std::size_t w = 0; w < drive.city().walls.size(); w += 4) {
        const simulator::WayPoint& at = drive.way()[i];
        REQUIRE(!holds(drive.city(), w, {at.p_m.x(), at.p_m.y(), at.ground_m + 1.8}));
      }
  }
}

TEST_CASE("simulated city: a drive that ends before its first wait does") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const simulator::Simulation drive(urban(5, seed));
    REQUIRE(!drive.way().empty());
    CHECK((drive.vehicle().antenna_w_m(5) - drive.vehicle().antenna_w_m(0)).norm() < 1e-3);
  }
}

TEST_CASE("simulated city: labels agree with a walk along the rays, and the strength with the labels") {
  const simulator::Simulation drive(urban(120, 5));
  simulator::CityReceiver rover = drive.rover();
  int clear = 0, hidden = 0, wrong = 0, bad = 0, tracked = 0;
  double clear_db = 0, reflected_db = 0;
  int reflected = 0;
  for (int k = 0; k <= 120; ++k) {
    (void)rover.measure(k);
    if (k % 4 != 0) continue;
    const double t_s = drive.rover_clock().gps_time_s(k);
    const Eigen::Vector3d antenna = drive.vehicle().antenna_w_m(t_s);
    for (const simulator::SignalLabel& l : rover.labels()) {
      if (l.code[0] != '1' && std::string_view{l.code} != "2I") continue;
      CHECK(l.extra_m >= 0);
      if (l.has_code) ++tracked, bad += l.state == simulator::SignalState::los ? 0 : 1;
      if (l.state == simulator::SignalState::blocked) {
        CHECK(!l.has_code);
        continue;
      }
      // The label's direction is in the axes at the antenna, the map's differ by less than 0.02 degrees here.
      const bool meets = meets_anything(drive.city(), antenna, direction(l.azimuth_rad, l.elevation_rad));
      if (l.state == simulator::SignalState::los) {
        ++clear, wrong += meets ? 1 : 0, clear_db += l.cn0_dbhz;
        CHECK(l.extra_m == 0);
      } else {
        ++hidden, wrong += meets ? 0 : 1;
        if (l.state == simulator::SignalState::nlos) ++reflected, reflected_db += l.cn0_dbhz;
      }
    }
  }
  CHECK(clear > 150);
  CHECK(hidden > 60);
  CHECK(wrong <= (clear + hidden) / 200);  // rays that graze an edge
  CHECK(clear_db / clear > reflected_db / reflected + 6);
  CHECK(bad > tracked / 10);
  MESSAGE(clear, " clear and ", hidden, " hidden rays, ", wrong, " at odds with the walk; ", 100 * bad / tracked,
          " % of the tracked are bad");
}

TEST_CASE("simulated city: profiles have their shares of time") {
  for (const double duration_s : {300.0, 600.0, 1234.0}) {
    const auto profile = simulator::profile_named("texcup", duration_s);
    REQUIRE(profile);
    std::array<int, 3> count{};
    for (int k = 0; k < 10000; ++k) ++count[static_cast<std::size_t>(simulator::district_at(*profile, duration_s * (k + 0.5) / 10000))];
    CHECK(count[0] == doctest::Approx(1000).epsilon(0.01));
    CHECK(count[1] == doctest::Approx(4000).epsilon(0.01));
    CHECK(count[2] == doctest::Approx(5000).epsilon(0.01));
  }
  CHECK(!simulator::profile_named("jungle", 100));
}
