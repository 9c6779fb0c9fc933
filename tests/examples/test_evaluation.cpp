// SPDX-License-Identifier: BSD-3-Clause
// The scoring rules, by self-tests whose answers are known and against an independent program's figures on the recordings.
#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "examples/support/evaluation.hpp"
#include "examples/support/evaluation_tables.hpp"
#include "examples/support/load_trajectory.hpp"
#include "scored_run.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::io::SolutionStatus;
using searvins::io::TrajectoryRow;
using searvins::test::for_all_seeds;
using searvins::test::kStart;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {


/// A straight drive at constant ECEF velocity, one truth row a second, and the same as an estimate.
struct Drive {
  TruthTrack truth;
  std::vector<TrajectoryRow> rows;
};

Drive straight_drive(Rng& rng, int n, SolutionStatus status = SolutionStatus::fix) {
  Drive drive;
  const Eigen::Vector3d p0{-3810234.401, 3567867.762, 3652897.917}, v_mps = test::random_vector<3>(rng, 15);
  for (int i = 0; i < n; ++i) {
    TrajectoryRow row;
    row.time = kStart.plus_seconds(i);
    row.p_e_m = p0 + i * v_mps;
    row.status = status;
    drive.truth.points.push_back({row.time, row.p_e_m});
    drive.rows.push_back(row);
  }
  return drive;
}

Evaluation score(const Drive& drive, const EvaluationOptions& options = {}) {
  const auto evaluation = evaluate(drive.truth, drive.rows, options);
  REQUIRE_MESSAGE(evaluation.ok(), io::to_string(evaluation.error()));
  return *evaluation;
}

}  // namespace

TEST_CASE("self-test 1: the truth as the estimate gives zero errors, 100 % available and below every limit") {
  for_all_seeds(20, [](Rng& rng) {
    const Evaluation e = score(straight_drive(rng, 100));
    CHECK(e.epochs.size() == 100);
    CHECK(e.availability_pct == 100);
    CHECK(e.below_1p0_pct == 100);
    CHECK(e.horizontal.max_m < 1e-8);
    CHECK(e.spatial.rmse_m < 1e-8);
    CHECK(e.fix_rate_pct == 100);
    CHECK(e.wrong_fixes == 0);
  });
}

TEST_CASE("self-test 2: every second row removed gives 50 % availability, and 50 % below each limit") {
  for_all_seeds(20, [](Rng& rng) {
    Drive drive = straight_drive(rng, 100);
    std::vector<TrajectoryRow> kept;
    for (std::size_t i = 0; i < drive.rows.size(); i += 2) kept.push_back(drive.rows[i]);
    drive.rows = kept;
    const Evaluation e = score(drive);
    CHECK(e.availability_pct == 50);
    CHECK(e.below_1p0_pct == 50);
    CHECK(e.below_1p5_pct == 50);
    CHECK(e.fix_rate_pct == 50);
    CHECK(e.horizontal.max_m < 1e-8);
  });
}

TEST_CASE("self-test 3: one row moved 1.0 m east fails the 1.0 m limit alone, and is a wrong fix") {
  for_all_seeds(20, [](Rng& rng) {
    Drive drive = straight_drive(rng, 100);
    TrajectoryRow& moved = drive.rows[static_cast<std::size_t>(test::integer(rng, 0, 99))];
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(moved.p_e_m));
    moved.p_e_m += R_ew.col(0) * (1.0 + 1e-8);
    const Evaluation e = score(drive);
    CHECK(e.below_1p0_pct == 99);
    CHECK(e.below_1p5_pct == 100);
    CHECK(e.horizontal.max_m == doctest::Approx(1));
    CHECK(e.horizontal.rmse_m == doctest::Approx(0.1));
    CHECK(e.wrong_fixes == 1);
    CHECK(e.fixed_below_0p5_pct == 99);
    CHECK(wrong_fix_list({"run", e}).find("1 wrong fixes") != std::string::npos);
    CHECK(wrong_fix_list({"run", e}).find("east    1.000  north    0.000  up    0.000") != std::string::npos);
  });
}

TEST_CASE("self-test 4: estimates at other times are scored at their own time; beyond half a step they belong to the neighbour") {
  for_all_seeds(20, [](Rng& rng) {
    for (const double shift_s : {0.4, 0.5, 0.6}) {
      Drive drive = straight_drive(rng, 100);
      const Eigen::Vector3d v_mps = drive.rows[1].p_e_m - drive.rows[0].p_e_m;
      for (TrajectoryRow& row : drive.rows) row.time = row.time.plus_seconds(shift_s), row.p_e_m += shift_s * v_mps;
      const Evaluation e = score(drive);
      CHECK(e.horizontal.max_m < 1e-8);
      CHECK(e.availability_pct == (shift_s < 0.6 ? 100 : 99));                     // the first epoch has no row within half a second
      CHECK(e.epochs[1].row == (shift_s == 0.4 ? 1U : shift_s == 0.5 ? 1U : 0U));  // of two half a second away the later
    }
  });
}

TEST_CASE("evaluation epochs: multiples of the step within 0.1 ms, start and end inclusive") {
  Rng rng{1};
  Drive drive = straight_drive(rng, 61);
  EvaluationOptions options;
  options.start_sow = 553990, options.end_sow = 554010;
  CHECK(score(drive, options).epochs.size() == 21);
  options.step_s = 5;
  CHECK(score(drive, options).epochs.size() == 5);
  options.start_sow = 560000, options.end_sow = 570000;
  const auto none = evaluate(drive.truth, drive.rows, options);
  REQUIRE_FALSE(none.ok());
  CHECK(none.error().message.find("no truth row lies on a multiple of 5.000 s") == 0);
  for (const double offset_ms : {0.09, 0.11}) {
    Drive shifted = drive;
    for (TruthPoint& point : shifted.truth.points) point.time = point.time.plus_seconds(offset_ms * 1e-3);
    CHECK(evaluate(shifted.truth, shifted.rows).ok() == (offset_ms < 0.1));
  }
  CHECK_FALSE(evaluate(TruthTrack{}, drive.rows).ok());
  CHECK_FALSE(evaluate(drive.truth, {}).ok());
}

TEST_CASE("a missing estimate is a failure of every limit but no error; an uncovered one as well") {
  Rng rng{2};
  Drive drive = straight_drive(rng, 10, SolutionStatus::float_);
  drive.rows.erase(drive.rows.begin() + 3);
  drive.truth.points.erase(drive.truth.points.begin() + 7);
  drive.rows[7].time = drive.rows[7].time.plus_seconds(-0.4);  // the row of second 8, now inside the gap of 2 s
  const Evaluation e = score(drive);
  CHECK(e.epochs.size() == 9);
  CHECK(e.available == 8);
  CHECK(e.with_error == 7);
  CHECK(e.below_1p5_pct == doctest::Approx(100.0 * 7 / 9));
  CHECK(e.by_status[static_cast<std::size_t>(SolutionStatus::float_)] == 8);
  CHECK(e.fixed == 0);
  CHECK(std::isnan(e.fixed_below_0p5_pct));
}

TEST_CASE("percentile: linear between order statistics") {
  CHECK(percentile({4, 1, 3, 2, 5}, 0.5) == 3);
  CHECK(percentile({1, 2, 3, 4}, 0.95) == doctest::Approx(3.85));
  CHECK(percentile({7}, 0.95) == 7);
  CHECK(percentile({1, 2}, 1) == 2);
  CHECK(std::isnan(percentile({}, 0.5)));
}

TEST_CASE("NEES: errors drawn from the rows' own covariance give 3 on average and 95 % below 7.81") {
  Rng rng{3};
  Drive drive = straight_drive(rng, 4000);
  for (TrajectoryRow& row : drive.rows) {
    const Eigen::Matrix3d P = test::random_spd(rng, 3, 20);
    row.set_covariance_enu_m2(P);
    const Eigen::Matrix3d L = P.llt().matrixL();
    const Eigen::Vector3d error_enu_m = L * Eigen::Vector3d{test::normal(rng), test::normal(rng), test::normal(rng)};
    row.p_e_m += geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(row.p_e_m)) * error_enu_m;
  }
  const Evaluation e = score(drive);
  CHECK(e.with_nees == 4000);
  CHECK(e.mean_nees == doctest::Approx(3).epsilon(0.05));  // standard error sqrt(6/4000) = 0.04
  CHECK(e.nees_within_95_pct == doctest::Approx(95).epsilon(0.012));
}

namespace {

/// Figures that an independent program printed for one .pos file, three decimals; NaN where it printed a dash.
struct Printed {
  long scored{0}, fixed{0};
  std::map<std::string, std::array<double, 3>> figures;  ///< "H fixed" ... -> rms, p95, max
};

Printed read_printed(const std::string& line) {
  Printed printed;
  std::istringstream parts{line};
  for (std::string part; std::getline(parts, part, '|');) {
    const std::vector<std::string_view> w = io::split_words(part);
    if (w.size() >= 4 && w[0] == "sol") printed.scored = std::stol(std::string{w[3]});
    if (w.size() >= 2 && w[0] == "fix") printed.fixed = std::stol(std::string{w[1]});
    if (w.size() == 8 && (w[0] == "H" || w[0] == "V") && w[2] == "rms")
      printed.figures[std::string{w[0]} + ' ' + std::string{w[1]}] = {std::stod(std::string{w[3]}), std::stod(std::string{w[5]}),
                                                                      std::stod(std::string{w[7]})};
  }
  return printed;
}

/// Its P95: the order statistic of rank floor(0.95 n).
double nearest_rank_p95(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(0.95 * static_cast<double>(values.size())))];
}

void compare(const std::string& what, const Printed& printed, const std::vector<double>& errors_m) {
  const auto found = printed.figures.find(what);
  CAPTURE(what);
  REQUIRE((found != printed.figures.end()) == !errors_m.empty());
  if (errors_m.empty()) return;
  const ErrorFigures ours = figures_of(errors_m);
  const double half_digit = 0.5001e-3;
  CHECK(std::abs(ours.rmse_m - found->second[0]) <= half_digit);
  CHECK(std::abs(nearest_rank_p95(errors_m) - found->second[1]) <= half_digit);
  CHECK(std::abs(ours.max_m - found->second[2]) <= half_digit);
}

}  // namespace

TEST_CASE("every RTKLIB result on the recordings scores as an independent program scores it, to its printed digits") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data");
    return;
  }
  struct Folder {
    const char* name;
    double step_s;
    std::vector<double> point;
  };
  const Folder folders[] = {{"kamakura_drive_2021", 1, {}},
                            {"spirent_rose_iono-Klob", 1, {}},
                            {"tokyo_urban_2023", 1, {}},
                            {"nagoya_static_2024", 1, {-3817681.3807, 3562839.9785, 3650158.3760}},
                            {"sf_static_2017", 1, {-2706111.3408, -4261210.5240, 3885594.5989}},
                            {"geonet_static_2005", 30, {-3976219.1878, 3382371.6057, 3652511.1424}}};
  int compared = 0;
  for (const Folder& folder : folders) {
    const auto path = *shared / "data" / "real" / folder.name;
    std::ifstream summary{path / "rtklib" / "SUMMARY.txt"};
    for (std::string line; std::getline(summary, line);) {
      const std::string file = line.substr(0, line.find(' '));
      const Printed printed = read_printed(line);
      CAPTURE(folder.name);
      CAPTURE(file);
      const auto loaded = load_trajectory((path / "rtklib" / file).string());
      REQUIRE_MESSAGE(loaded.ok(), io::to_string(loaded.error()));
      const auto truth = folder.point.empty()
                             ? read_truth((path / "reference.csv").string())
                             : io::FileResult<TruthTrack>{static_truth({folder.point[0], folder.point[1], folder.point[2]})};
      EvaluationOptions options;
      options.step_s = folder.step_s;
      const auto e = evaluate(*truth, loaded->rows, options);
      REQUIRE(e.ok());
      CHECK(static_cast<long>(e->with_error) == printed.scored);
      CHECK(static_cast<long>(e->fixed) == printed.fixed);
      std::vector<double> h, v, h_fixed, v_fixed;
      for (const ScoredEpoch& epoch : e->epochs) {
        if (!epoch.has_error()) continue;
        h.push_back(epoch.horizontal_m()), v.push_back(std::abs(epoch.error_enu_m.z()));
        if (epoch.status == SolutionStatus::fix) h_fixed.push_back(h.back()), v_fixed.push_back(v.back());
      }
      compare("H all", printed, h), compare("V all", printed, v), compare("H fixed", printed, h_fixed),
          compare("V fixed", printed, v_fixed);
      ++compared;
    }
  }
  CHECK(compared >= 30);
}

TEST_CASE("tables: one row a run, plain ASCII") {
  Rng rng{4};
  const Evaluation e = score(straight_drive(rng, 10));
  const std::string text = evaluation_text({{"one", e}, {"two", e}});
  for (const char c : text) CHECK((c == '\n' || (c >= ' ' && c <= '~')));
  CHECK(text.find("one") < text.find("two"));
  CHECK(text.find("wrong fixes") == std::string::npos);
}

TEST_CASE("trajectories are found by folder, by file, and by content") {
  const auto folder = std::filesystem::temp_directory_path() / "searvins_test_run";
  std::filesystem::create_directories(folder);
  Rng rng{5};
  const Drive drive = straight_drive(rng, 5);
  CHECK(io::write_text_file((folder / "trajectory.csv").string(), io::trajectory_csv(drive.rows)).empty());
  CHECK(io::write_text_file((folder / "other.txt").string(), io::rtklib_solution(drive.rows)).empty());
  CHECK(load_trajectory(folder.string())->name == "searvins_test_run");
  CHECK(load_trajectory((folder / "").string())->name == "searvins_test_run");
  CHECK(load_trajectory((folder / "trajectory.csv").string())->name == "searvins_test_run");
  CHECK(load_trajectory((folder / "other.txt").string())->rows.size() == 5);
  CHECK(load_trajectory((folder / "none").string()).error().message == "no such file");
  CHECK_FALSE(io::write_text_file((folder / "no" / "such" / "folder.csv").string(), "x").empty());
  std::filesystem::remove_all(folder);
}
