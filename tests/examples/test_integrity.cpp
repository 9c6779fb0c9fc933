// SPDX-License-Identifier: BSD-3-Clause
// Bounds, shares beyond three sigma and stretches: against the distributions that they are made for, and a brute-force scan.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "examples/support/assessment.hpp"
#include "examples/support/integrity.hpp"
#include "examples/support/json.hpp"
#include "scored_run.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::io::SolutionStatus;
using searvins::io::TrajectoryRow;
using searvins::test::chance;
using searvins::test::for_all_seeds;
using searvins::test::integer;
using searvins::test::kStart;
using searvins::test::kTruth_e_m;
using searvins::test::normal;
using searvins::test::Rng;
using searvins::test::ScoredRun;
using searvins::test::uniform;

namespace {

/// Errors drawn from P, reported with inflation^2 P. A round P has equal axes and no correlation.
ScoredRun gaussian_run(Rng& rng, int n, double inflation, bool round) {
  ScoredRun run;
  for (int i = 0; i < n; ++i) {
    const Eigen::Matrix3d P =
        (uniform(rng, 0.1, 2.0) * (round ? Eigen::Matrix3d{Eigen::Matrix3d::Identity()} : Eigen::Matrix3d{test::random_spd(rng, 3, 50)}))
            .eval();
    const Eigen::Matrix3d L = P.llt().matrixL();
    run.add(i, L * Eigen::Vector3d{normal(rng), normal(rng), normal(rng)}, SolutionStatus::float_, inflation * inflation * P);
  }
  run.score();
  return run;
}

/// Whether a count fits a binomial of n epochs and a probability: within five standard deviations (and one count).
bool fits_binomial(const Exceedance& e, double probability) {
  const double n = static_cast<double>(e.epochs);
  return std::abs(static_cast<double>(e.over) - n * probability) <= 5 * std::sqrt(n * probability * (1 - probability)) + 1;
}

const Exceedance* three_sigma_of(const Integrity& i, int k) {
  const Exceedance* all[] = {&i.east_3sigma, &i.north_3sigma, &i.up_3sigma, &i.horizontal_3sigma, &i.spatial_3sigma};
  return all[k];
}

}  // namespace

TEST_CASE("bound factors: the Rayleigh and normal quantiles, and the aviation constants that are theirs") {
  CHECK(vertical_bound_factor(1e-7) == doctest::Approx(5.33).epsilon(1e-3));    // K_V of precision approach
  CHECK(horizontal_bound_factor(5e-9) == doctest::Approx(6.18).epsilon(1e-3));  // K_H of en-route to non-precision approach
  for_all_seeds(50, [](Rng& rng) {
    const double risk = std::pow(10.0, uniform(rng, -11, -0.4)), k = horizontal_bound_factor(risk);
    CHECK(math::chi_square_exceedance(k * k, 2).value() == doctest::Approx(risk).epsilon(1e-9));
    CHECK(math::two_sided_exceedance(vertical_bound_factor(risk)) == doctest::Approx(risk).epsilon(1e-9));
    CHECK(horizontal_bound_factor(risk / 2) > k);
  });
}

TEST_CASE("horizontal semi-axis and NEES: those of the eigenvalues and of the inverse") {
  for_all_seeds(100, [](Rng& rng) {
    const Eigen::Matrix3d P = test::random_spd(rng, 3, 1e4);
    TrajectoryRow row;
    row.set_covariance_enu_m2(P);
    // Turn the ellipse on a fine grid of angles: its extent is never beyond the semi-axis, and reaches it.
    double largest = 0;
    for (int k = 0; k < 3600; ++k) {
      const Eigen::Vector2d u{std::cos(k * std::numbers::pi / 3600), std::sin(k * std::numbers::pi / 3600)};
      largest = std::max(largest, u.dot(P.topLeftCorner<2, 2>() * u));
    }
    const double axis = horizontal_semi_axis_m(row);
    CHECK(std::sqrt(largest) <= axis * (1 + 1e-9));
    CHECK(std::sqrt(largest) == doctest::Approx(axis).epsilon(1e-5));
    const Eigen::Vector3d e = test::random_vector<3>(rng, 3);
    const Eigen::Vector2d h = e.head<2>();
    const Eigen::Matrix2d P_h = P.topLeftCorner<2, 2>();
    CHECK(horizontal_nees(row, e) == doctest::Approx(h.dot(P_h.llt().solve(h))).epsilon(1e-6));
    CHECK(h.norm() <= axis * std::sqrt(horizontal_nees(row, e)) * (1 + 1e-9));  // why the bound holds
  });
  CHECK(std::isnan(horizontal_semi_axis_m(TrajectoryRow{})));
  CHECK(std::isnan(horizontal_nees(TrajectoryRow{}, {1, 1, 1})));
}

TEST_CASE("Gaussian errors of the stated covariance exceed 3 sigma and the bounds as often as chance has it") {
  for_all_seeds(4, [](Rng& rng) {
    const ScoredRun run = gaussian_run(rng, 4000, 1, true);
    const Integrity i = assess_integrity(run.evaluation, run.rows, {0.02, 3});
    const double tail = math::two_sided_exceedance(3);
    for (int k = 0; k < 5; ++k) {
      CAPTURE(k);
      CHECK(three_sigma_of(i, k)->epochs == 4000);
      CHECK(three_sigma_of(i, k)->expected_pct == doctest::Approx(0.26998).epsilon(1e-4));
      CHECK(fits_binomial(*three_sigma_of(i, k), tail));
    }
    for (const BoundCheck& check : i.ladder) {
      CAPTURE(check.risk);
      CHECK(fits_binomial(check.horizontal, check.risk));
      CHECK(fits_binomial(check.vertical, check.risk));
    }
    CHECK(fits_binomial(i.stated.horizontal, 0.02));
    CHECK(i.mean_nees_horizontal == doctest::Approx(2).epsilon(0.15));
    CHECK(i.sigma_scale == doctest::Approx(1).epsilon(0.05));
  });
}

TEST_CASE("a long ellipse: the horizontal bound is exceeded less often than its risk; the chi-square share stays") {
  for_all_seeds(4, [](Rng& rng) {
    const ScoredRun run = gaussian_run(rng, 4000, 1, false);
    const Integrity i = assess_integrity(run.evaluation, run.rows);
    for (const BoundCheck& check : i.ladder) {
      const double n = 4000;
      CHECK(static_cast<double>(check.horizontal.over) <= n * check.risk + 5 * std::sqrt(n * check.risk) + 1);
      CHECK(fits_binomial(check.vertical, check.risk));
    }
    CHECK(i.ladder.front().horizontal.share_pct() < 4.5);  // 5 % only where it is round
    CHECK(fits_binomial(i.horizontal_3sigma, math::two_sided_exceedance(3)));
    CHECK(fits_binomial(i.spatial_3sigma, math::two_sided_exceedance(3)));
  });
}

TEST_CASE("inflated covariances are exceeded less, shrunk ones more, and the fitting sigma says by how much") {
  for_all_seeds(6, [](Rng& rng) {
    const double inflation = uniform(rng, 1.6, 3);
    Rng same = rng, same_again = rng;
    const ScoredRun honest = gaussian_run(rng, 2000, 1, true), wide = gaussian_run(same, 2000, inflation, true),
                    narrow = gaussian_run(same_again, 2000, 1 / inflation, true);
    const Integrity a = assess_integrity(wide.evaluation, wide.rows), b = assess_integrity(honest.evaluation, honest.rows),
                    c = assess_integrity(narrow.evaluation, narrow.rows);
    for (int k = 0; k < 5; ++k) {
      CHECK(three_sigma_of(a, k)->over <= three_sigma_of(b, k)->over);
      CHECK(three_sigma_of(b, k)->over < three_sigma_of(c, k)->over);
    }
    for (std::size_t k = 0; k < a.ladder.size(); ++k) {
      CHECK(a.ladder[k].horizontal.over <= b.ladder[k].horizontal.over);
      CHECK(b.ladder[k].horizontal.over <= c.ladder[k].horizontal.over);
      CHECK(a.ladder[k].median_horizontal_m == doctest::Approx(inflation * b.ladder[k].median_horizontal_m).epsilon(1e-6));
      CHECK(c.ladder[k].largest_ratio == doctest::Approx(inflation * b.ladder[k].largest_ratio).epsilon(1e-6));
    }
    CHECK(a.sigma_scale * inflation == doctest::Approx(b.sigma_scale).epsilon(1e-6));
    CHECK(c.sigma_scale / inflation == doctest::Approx(b.sigma_scale).epsilon(1e-6));
  });
}

TEST_CASE("Stanford areas: a partition of error and bound; they add up and agree with the shares") {
  CHECK(stanford_area(0.5, 1.0, 1.5) == StanfordArea::nominal);
  CHECK(stanford_area(1.0, 1.0, 1.5) == StanfordArea::nominal);
  CHECK(stanford_area(1.5, 1.5, 1.5) == StanfordArea::nominal);
  CHECK(stanford_area(1.2, 1.0, 1.5) == StanfordArea::misleading);
  CHECK(stanford_area(1.500001, 1.5, 1.5) == StanfordArea::hazardous);
  CHECK(stanford_area(1.0, 2.0, 1.5) == StanfordArea::unavailable);
  CHECK(stanford_area(1.8, 2.0, 1.5) == StanfordArea::unavailable);
  CHECK(stanford_area(3.0, 2.0, 1.5) == StanfordArea::misleading_unavailable);
  for_all_seeds(20, [](Rng& rng) {
    ScoredRun run;
    const int n = 300;
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector3d error_m = test::random_vector<3>(rng, 2);
      if (chance(rng, 0.8))
        run.add(i, error_m, SolutionStatus::float_, std::pow(10.0, uniform(rng, -3, 1)) * test::random_spd(rng, 3, 20));
      else if (chance(rng, 0.5))
        run.add(i, error_m);  // without a covariance
    }
    run.score();
    const IntegrityOptions options{0.1, uniform(rng, 0.5, 2)};
    const Integrity i = assess_integrity(run.evaluation, run.rows, options);
    std::size_t sum = 0, hazardous = 0, beyond = 0;
    for (const std::size_t area : i.areas) sum += area;
    for (const ScoredEpoch& epoch : run.evaluation.epochs) {
      const double bound_m = horizontal_bound_m(epoch, run.rows, options.risk);
      if (!(bound_m > 0)) continue;
      beyond += epoch.horizontal_m() > bound_m,
          hazardous += epoch.horizontal_m() > options.alert_limit_m && bound_m <= options.alert_limit_m;
    }
    CHECK(sum == i.with_bound);
    CHECK(i.with_bound == i.stated.horizontal.epochs);
    CHECK(i.with_bound < run.evaluation.epochs.size());
    CHECK(i.count(StanfordArea::hazardous) == hazardous);
    CHECK(i.stated.horizontal.over == beyond);
    CHECK(beyond == i.count(StanfordArea::hazardous) + i.count(StanfordArea::misleading) + i.count(StanfordArea::misleading_unavailable));
  });
}

TEST_CASE("stretches: against a brute-force scan, their epochs complete the share below the limit") {
  for_all_seeds(60, [](Rng& rng) {
    ScoredRun run;
    const int n = integer(rng, 20, 200);
    double size_m = 1;
    run.add(0, {0.1, 0, 0});
    for (int i = 1; i + 1 < n; ++i) {
      if (chance(rng, 0.2)) size_m = uniform(rng, 0, 2.5);  // errors that stay for a while
      if (chance(rng, 0.9)) run.add(i, {size_m, uniform(rng, -0.1, 0.1), 3});
    }
    run.add(n - 1, {0.2, 0, 0});
    run.score();
    REQUIRE(run.evaluation.epochs.size() == static_cast<std::size_t>(n));
    const std::vector<ScoredEpoch>& epochs = run.evaluation.epochs;
    for (const double limit_m : {1.0, 1.5}) {
      const std::vector<Stretch> stretches = stretches_above(run.evaluation, limit_m);
      // Every pair of epochs is tried as a stretch: the longest of those that qualify throughout.
      std::size_t longest = 0, from = 0;
      for (std::size_t a = 0; a < epochs.size(); ++a)
        for (std::size_t b = a; b < epochs.size(); ++b) {
          bool above = true;
          for (std::size_t k = a; k <= b; ++k) above = above && !(epochs[k].available && epochs[k].horizontal_m() < limit_m);
          if (above && b - a + 1 > longest) longest = b - a + 1, from = a;
        }
      const Stretch found = longest_of(stretches);
      CHECK(found.epochs == longest);
      if (longest) {
        CHECK(found.first == from);
        CHECK(found.from == epochs[from].time);
        CHECK(seconds_between(found.from, found.to) == doctest::Approx(static_cast<double>(longest) - 1));
        CHECK(found.length_s == static_cast<double>(longest));
        double most = -1;
        for (std::size_t k = from; k < from + longest; ++k)
          if (epochs[k].has_error()) most = std::max(most, epochs[k].horizontal_m());
        CHECK((most < 0 ? std::isnan(found.max_error_m) : found.max_error_m == most));
      }
      std::size_t sum = 0;
      for (const Stretch& s : stretches) sum += s.epochs;
      const double below_pct = limit_m == 1.0 ? run.evaluation.below_1p0_pct : run.evaluation.below_1p5_pct;
      CHECK(100 - examples::detail::share_pct(sum, epochs.size()) == doctest::Approx(below_pct));
      CHECK(std::is_sorted(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) { return a.from < b.from; }));
    }
  });
}

TEST_CASE("stretches: a hole in the truth ends one") {
  ScoredRun run;
  for (int i = 0; i < 30; ++i) run.add(i, {2, 0, 0});
  TruthTrack truth;
  for (int i = 0; i < 30; ++i)
    if (i < 10 || i >= 15) truth.points.push_back({kStart.plus_seconds(i), kTruth_e_m});
  run.evaluation = *evaluate(truth, run.rows);
  const std::vector<Stretch> stretches = stretches_above(run.evaluation, 1.0);
  REQUIRE(stretches.size() == 2);
  CHECK(stretches[0].epochs == 10);
  CHECK(stretches[1].epochs == 15);
  CHECK(longest_of(stretches).from == kStart.plus_seconds(15));
  CHECK(longest_of({}).epochs == 0);
}

TEST_CASE("assessment: plain ASCII tables, strict JSON with every wrong fix, runs without covariance do no harm") {
  Rng rng{11};
  ScoredRun run = gaussian_run(rng, 200, 0.5, false), bare;
  for (TrajectoryRow& row : run.rows) row.status = SolutionStatus::fix;
  run.score();
  for (int i = 0; i < 20; ++i) bare.add(i, {1.2, 0, 0});
  bare.score();
  const std::vector<AssessedRun> runs = {assess("one \"and\" <only>", run.rows, run.evaluation),
                                         assess("bare", bare.rows, bare.evaluation)};
  const std::string text = assessment_text(runs);
  for (const char c : text) CHECK((c == '\n' || (c >= ' ' && c <= '~')));
  CHECK(text.find("longest above 1.0 m    20 s from sow 553980.000, up to 1.20 m") != std::string::npos);
  const auto json = parse_json(assessment_json(runs, "searvins evaluate"), "assessment");
  REQUIRE_MESSAGE(json.ok(), io::to_string(json.error()));
  const std::vector<Json>& list = json->find("runs")->elements;
  REQUIRE(list.size() == 2);
  CHECK(list[0].find("wrong_fixes")->find("list")->elements.size() == run.evaluation.wrong_fixes);
  CHECK(list[0].find("integrity")->find("beyond_3_sigma")->find("horizontal")->find("share_pct")->number ==
        doctest::Approx(runs[0].integrity.horizontal_3sigma.share_pct()));
  CHECK(list[0].find("errors_m")->find("mean_nees")->number == doctest::Approx(run.evaluation.mean_nees));
  CHECK(list[1].find("integrity")->find("epochs")->number == 0);
  CHECK(list[1].find("integrity")->find("bound")->find("median_horizontal_m")->is(Json::Kind::null));
  CHECK(list[1].find("integrity")->find("above_1p0_m")->find("longest")->find("length_s")->number == 20);
  CHECK(list[1].find("integrity")->find("above_1p5_m")->find("longest") == nullptr);
  JsonWriter summary;
  summary.begin_object();
  member_assessment(summary, run.evaluation, run.rows);
  const auto members = parse_json(summary.end_object().text(), "summary");
  REQUIRE(members.ok());
  CHECK(members->find("wrong_fixes")->find("number")->number == static_cast<double>(run.evaluation.wrong_fixes));
  CHECK(members->find("integrity")->find("bound")->find("risk")->number == 1e-5);
  CHECK(risk_text(1e-5) == "1e-5");
  CHECK(risk_text(100 * 1e-7) == "1e-5");
  CHECK(risk_text(0.05) == "0.05");
}
