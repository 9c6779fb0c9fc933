// SPDX-License-Identifier: BSD-3-Clause
// The test of common motion: it finds the motion among outliers, names them, and keeps silent where it cannot know.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <set>

#include <searvins/gnss/common_motion.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

using Changes = StaticVector<PhaseChange, 160>;
using Results = StaticVector<CheckResult, 160>;

/// `n` satellites spread over the sky, `signals` each, moved by d and c, with noise.
Changes sky(Rng& rng, int n, int signals, const Eigen::Vector3d& d, double c, double noise_m = 0.004) {
  Changes changes;
  const double turn = uniform(rng, 0, 6);
  for (int s = 0; s < n; ++s) {
    const double azimuth = turn + 2.4 * s, elevation = 0.3 + 1.1 * std::fmod(0.37 * s, 1.0);
    const Eigen::Vector3d u =
        -Eigen::Vector3d{std::sin(azimuth) * std::cos(elevation), std::cos(azimuth) * std::cos(elevation), std::sin(elevation)};
    for (int k = 0; k < signals; ++k)
      changes.push_back(
          {{Constellation::gps, static_cast<std::uint8_t>(s + 1)}, u, u.dot(d) + c + normal(rng, noise_m), 0.07, k == 0 ? 0.19 : 0.244});
  }
  return changes;
}

}  // namespace

TEST_CASE("set_of_four enumerates every set once") {
  for (const std::size_t n : {4U, 5U, 9U, 13U}) {
    std::set<std::array<std::size_t, 4>> seen;
    const std::size_t sets = n * (n - 1) * (n - 2) * (n - 3) / 24;
    for (std::size_t r = 0; r < sets; ++r) {
      const auto s = gnss::detail::set_of_four(n, r);
      CHECK((s[0] < s[1] && s[1] < s[2] && s[2] < s[3] && s[3] < n));
      seen.insert(s);
    }
    CHECK(seen.size() == sets);
  }
}

TEST_CASE("invert_spd4 inverts, and refuses the singular") {
  for_all_seeds(100, [](Rng& rng) {
    const Eigen::Matrix4d a = random_spd(rng, 4);
    Eigen::Matrix4d inverse;
    REQUIRE(gnss::detail::invert_spd4(a, inverse));
    CHECK((a * inverse - Eigen::Matrix4d::Identity()).norm() < 1e-9);
    const Eigen::Vector4d v{1, 2, 3, 4};
    CHECK_FALSE(gnss::detail::invert_spd4(v * v.transpose(), inverse));
  });
}

TEST_CASE("the motion is found and every slipped satellite named, with up to 40 % slipped, also in both signals alike") {
  for_all_seeds(100, [](Rng& rng) {
    const int n = integer(rng, 10, 24), bad = integer(rng, 0, n * 2 / 5 - 1);
    const Eigen::Vector3d d = random_vector<3>(rng, 5);
    const double c = uniform(rng, -3e5, 3e5);
    Changes changes = sky(rng, n, 2, d, c);
    for (std::size_t i = 0; i < 2 * static_cast<std::size_t>(bad); ++i)
      changes[i].change_m += (chance(rng, 0.5) ? 1 : -1) * uniform(rng, 0.19, 5.0);
    Results results;
    const MotionFit fit = common_motion_check(changes, results);
    REQUIRE(fit.valid);
    CHECK(fit.satellites == n - bad);
    CHECK((fit.displacement_e_m - d).norm() < 0.03);
    CHECK(std::abs(fit.clock_m - c) < 0.03);
    CHECK(fit.rms_m < 0.01);
    for (std::size_t i = 0; i < changes.size(); ++i) {
      if (i < 2 * static_cast<std::size_t>(bad))
        CHECK(results[i] == CheckResult::failed);
      else
        CHECK(results[i] != CheckResult::failed);
    }
  });
}

TEST_CASE("nothing is said with four satellites, without consensus, or where the others cannot predict one") {
  for_all_seeds(50, [](Rng& rng) {
    Results results;
    CHECK(!common_motion_check(sky(rng, 4, 2, random_vector<3>(rng), 0), results).valid);
    for (const CheckResult r : results) CHECK(r == CheckResult::unavailable);

    Changes wild = sky(rng, 10, 1, random_vector<3>(rng), 0);
    for (PhaseChange& c : wild) c.change_m += uniform(rng, -100, 100);
    CHECK(!common_motion_check(wild, results).valid);

    // Eight satellites low in the sky and one at the zenith: only it tells height from clock, so its slip shows in nothing but itself.
    Changes flat;
    for (int s = 0; s < 8; ++s)
      flat.push_back({{Constellation::gps, static_cast<std::uint8_t>(s + 1)},
                      {std::sin(0.8 * s), std::cos(0.8 * s), -0.02 * (s % 2)},
                      0.0,
                      0.07,
                      0.19});
    flat.push_back({{Constellation::gps, 9}, {0, 0, -1}, 0.19, 0.07, 0.19});
    (void)common_motion_check(flat, results);
    CHECK(results[8] != CheckResult::passed);
  });
}

TEST_CASE(
    "a motion that is predicted to a centimetre: two to four satellites verify each other, and one that slipped is named by two or three "
    "others") {
  for_all_seeds(200, [](Rng& rng) {
    const int n = integer(rng, 2, 4);
    const double sigma_m = uniform(rng, 0.002, 0.01), c = uniform(rng, -3e5, 3e5);
    const Eigen::Vector3d m = random_vector<3>(rng, 5), d = m + random_vector<3>(rng, 1.5 * sigma_m);
    const MotionPrior prior{m, sigma_m * sigma_m * Eigen::Matrix3d::Identity()};
    Changes changes = sky(rng, n, 1, d, c);
    Results results;
    const MotionFit fit = predicted_motion_check(changes, prior, results);
    REQUIRE(fit.valid);
    CHECK(fit.satellites == n);
    CHECK((fit.displacement_e_m - d).norm() < 3 * sigma_m);
    for (const CheckResult r : results) CHECK(r == CheckResult::passed);
    CHECK(!common_motion_check(changes, results).valid);

    const std::size_t bad = static_cast<std::size_t>(integer(rng, 0, n - 1));
    changes[bad].change_m += (chance(rng, 0.5) ? 1 : -1) * 0.19 * integer(rng, 1, 9);
    const MotionFit spoilt = predicted_motion_check(changes, prior, results);
    CHECK(spoilt.valid == (n > 2));  // of two that differ nobody knows which it is
    for (std::size_t i = 0; i < results.size(); ++i)
      CHECK(results[i] == (n == 2 ? CheckResult::unavailable : i == bad ? CheckResult::failed : CheckResult::passed));
  });
}

TEST_CASE("a vague prediction verifies nothing that it cannot tell from a slip, and nearly none adds nothing to five satellites") {
  for_all_seeds(100, [](Rng& rng) {
    const Eigen::Vector3d d = random_vector<3>(rng, 0.1);
    Changes changes = sky(rng, integer(rng, 2, 4), 1, d, 7);
    Results results;
    (void)predicted_motion_check(changes, {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()}, results);
    for (const CheckResult r : results) CHECK(r != CheckResult::passed);

    changes = sky(rng, integer(rng, 7, 12), 1, random_vector<3>(rng, 5), 7);
    const MotionFit alone = common_motion_check(changes, results);
    const MotionFit with = predicted_motion_check(changes, {random_vector<3>(rng, 5), 1e8 * Eigen::Matrix3d::Identity()}, results);
    REQUIRE(alone.valid);
    REQUIRE(with.valid);
    CHECK((alone.displacement_e_m - with.displacement_e_m).norm() < 1e-6);
    CHECK(with.satellites == alone.satellites);
  });
}

TEST_CASE("no prior: the covariance must be positive definite, and one satellite is no consensus") {
  Rng rng{1};
  Results results;
  const Changes changes = sky(rng, 4, 1, Eigen::Vector3d::Zero(), 0);
  CHECK(!predicted_motion_check(changes, {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()}, results).valid);
  CHECK(!predicted_motion_check(sky(rng, 1, 2, Eigen::Vector3d::Zero(), 0), MotionPrior{}, results).valid);
  CHECK(results.size() == 2);
}

TEST_CASE("a threshold beyond 0.45 wavelengths verifies nothing, but still fails") {
  Rng rng{3};
  Changes changes = sky(rng, 10, 1, {1, 2, 3}, 4);
  for (PhaseChange& c : changes) c.threshold_m = 0.1;
  changes[3].change_m += 5;
  Results results;
  CHECK(common_motion_check(changes, results).valid);
  for (std::size_t i = 0; i < 10; ++i) CHECK(results[i] == (i == 3 ? CheckResult::failed : CheckResult::unavailable));
}

TEST_CASE("common change: the majority is believed; one satellite alone, or two that differ") {
  using R = CheckResult;
  const auto change = [](int s, double y) {
    return PhaseChange{{Constellation::beidou, static_cast<std::uint8_t>(s)}, {0, 0, 1}, y, 0.07, 0.19};
  };
  const auto check = [&](std::initializer_list<PhaseChange> list) {
    Changes changes;
    Results results;
    for (const PhaseChange& c : list) changes.push_back(c);
    common_change_check(changes, results);
    return results;
  };
  Results r = check({change(1, 7.0), change(2, 7.01), change(3, 7.19), change(4, 6.99)});
  CHECK(r[0] == R::passed);
  CHECK(r[2] == R::failed);
  CHECK(check({change(1, 0), change(1, 0.01)})[0] == R::unavailable);
  r = check({change(1, 0), change(2, 0.19)});
  CHECK((r[0] == R::failed && r[1] == R::failed));
}

TEST_CASE("raised thresholds follow the spread of the majority, not the outliers") {
  for_all_seeds(20, [](Rng& rng) {
    Changes changes = sky(rng, 20, 1, Eigen::Vector3d::Zero(), 50, 0.3);
    changes[0].change_m += 1000;
    raise_thresholds_to_spread(changes);
    CHECK(changes[0].threshold_m > 0.3);
    CHECK(changes[0].threshold_m < 2.5);
    Changes quiet = sky(rng, 20, 1, Eigen::Vector3d::Zero(), 50, 0.001);
    raise_thresholds_to_spread(quiet);
    CHECK(quiet[5].threshold_m == 0.07);
  });
}
