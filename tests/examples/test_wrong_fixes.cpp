// SPDX-License-Identifier: BSD-3-Clause
// The list of wrong fixes: sorted and complete, events, causes.
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "examples/support/wrong_fixes.hpp"
#include "scored_run.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::io::SolutionStatus;
using searvins::test::chance;
using searvins::test::for_all_seeds;
using searvins::test::integer;
using searvins::test::kStart;
using searvins::test::kTruth_e_m;
using searvins::test::Rng;
using searvins::test::ScoredRun;
using searvins::test::uniform;

TEST_CASE("wrong fixes: sorted, complete, nothing else, events apart") {
  for_all_seeds(60, [](Rng& rng) {
    ScoredRun run;
    std::vector<double> ratios;
    const int n = integer(rng, 5, 150);
    run.add(0, {0, 0, 0}), ratios.push_back(1);
    for (int i = 1; i < n; ++i) {
      if (chance(rng, 0.15)) continue;
      run.add(i, uniform(rng, 0, 1.2) * Eigen::Vector3d{0.8, 0.6, 1}, chance(rng, 0.6) ? SolutionStatus::fix : SolutionStatus::float_,
              chance(rng, 0.8) ? Eigen::Matrix3d{test::random_spd(rng, 3, 20)} : Eigen::Matrix3d{Eigen::Matrix3d::Constant(io::kUnknown)});
      ratios.push_back(uniform(rng, 1, 20));
    }
    run.score();
    const std::vector<WrongFix> list = wrong_fixes_of(run.evaluation, run.rows, ratios);
    CHECK(list.size() == run.evaluation.wrong_fixes);
    std::vector<std::size_t> expected;
    for (std::size_t i = 0; i < run.evaluation.epochs.size(); ++i) {
      const ScoredEpoch& e = run.evaluation.epochs[i];
      if (e.available && e.status == SolutionStatus::fix && e.horizontal_m() >= 0.5) expected.push_back(i);
    }
    REQUIRE(list.size() == expected.size());
    std::size_t total = 0;
    for (const std::size_t count : causes_of(list)) total += count;
    CHECK(total == list.size());
    for (std::size_t k = 0; k < list.size(); ++k) {
      CHECK(list[k].epoch == expected[k]);
      CHECK(list[k].ratio == ratios[list[k].row]);
      CHECK(run.rows[list[k].row].time == list[k].time);
      if (k == 0) continue;
      CHECK(list[k - 1].time < list[k].time);
      CHECK((list[k].event == list[k - 1].event) == (list[k - 1].epoch + 1 == list[k].epoch));
    }
  });
}

TEST_CASE("wrong fixes: causes") {
  const Eigen::Matrix3d P = 0.0001 * Eigen::Matrix3d::Identity();
  ScoredRun run;
  run.add(0, {0.8, 0, 0}, SolutionStatus::fix, P);      // first estimate
  run.add(1, {0.81, 0.01, 0}, SolutionStatus::fix, P);  // continued
  run.add(2, {0.02, 0, 0}, SolutionStatus::float_, P);
  run.add(3, {0, 0.9, 0}, SolutionStatus::fix, P);  // jump from a right float
  run.add(4, {0, 0.1, 0}, SolutionStatus::float_, P);
  run.add(5, {0, 1.4, 0}, SolutionStatus::float_, P);
  run.add(6, {0, 1.2, 0}, SolutionStatus::fix, 100 * 100 * P);  // off before, and the covariance admits it
  run.add(9, {3, 0, 0}, SolutionStatus::fix, P);                // after a gap
  run.add(10, {0, 3, 0}, SolutionStatus::fix, P);               // other wrong integers
  run.rows.back().n_sat = 5, run.rows.back().success_rate = 0.9;
  run.add(12, {0.3, 0, 0}, SolutionStatus::float_, P);
  run.add(13, {1, 0, 0}, SolutionStatus::fix, P);    // a step of more than half the error
  run.add(14, {0.7, 0, 0}, SolutionStatus::fix, P);  // other integers of the same side: too far to be the same, off before
  run.score();
  const std::vector<WrongFix> list = wrong_fixes_of(run.evaluation, run.rows, std::vector<double>(run.rows.size(), 2.0));
  const std::vector<WrongFixCause> causes = {WrongFixCause::first_estimate, WrongFixCause::continued,      WrongFixCause::jump,
                                             WrongFixCause::off_before,     WrongFixCause::first_estimate, WrongFixCause::jump,
                                             WrongFixCause::jump,           WrongFixCause::off_before};
  REQUIRE(list.size() == causes.size());
  for (std::size_t k = 0; k < causes.size(); ++k) CHECK_MESSAGE(list[k].cause == causes[k], k);
  CHECK(events_of(list) == 5);
  CHECK(list[3].is_admitted);
  CHECK(explanation_of(list[3]) == "moved 0.20 m, error before 1.40 m, low ratio, within 3 sigma");
  CHECK(explanation_of(list[5]) == "moved 4.24 m, error before 3.00 m, few satellites, low success rate, low ratio");
  CHECK(list[5].sigma_m == doctest::Approx(0.01));
  CHECK(wrong_fixes_of(run.evaluation, run.rows)[0].ratio != 2.0);  // without ratios they are not known
  CHECK(std::isnan(wrong_fixes_of(run.evaluation, run.rows)[0].ratio));
}

TEST_CASE("a fix whose truth is not known is wrong, listed, and its cause says so") {
  ScoredRun run;
  for (int i = 0; i < 10; ++i) run.add(i, {0, 0, 0}, SolutionStatus::fix);
  run.rows[7].time = run.rows[7].time.plus_seconds(-0.4);
  TruthTrack truth;
  for (int i = 0; i < 10; ++i)
    if (i != 6) truth.points.push_back({kStart.plus_seconds(i), kTruth_e_m});
  run.evaluation = *evaluate(truth, run.rows);
  const std::vector<WrongFix> list = wrong_fixes_of(run.evaluation, run.rows);
  REQUIRE(list.size() == 1);
  CHECK(list.size() == run.evaluation.wrong_fixes);
  CHECK(list[0].cause == WrongFixCause::no_truth);
  CHECK(std::isnan(list[0].horizontal_m));
  CHECK(explanation_of(list[0]).empty());
}
