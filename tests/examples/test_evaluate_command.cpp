// SPDX-License-Identifier: BSD-3-Clause
// `searvins evaluate`: its tables and files.
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/io/rtklib_solution.hpp>
#include <searvins/io/trajectory.hpp>

#include "command_runner.hpp"
#include "examples/support/json.hpp"

#ifdef SEARVINS_COMMAND
namespace {

using namespace searvins;
using namespace searvins::test;

/// A run of sixty epochs that stands still, its truth, and what `solve` leaves beside it: every tenth epoch is a wrong fix.
struct EvaluationFixture {
  std::filesystem::path folder{std::filesystem::temp_directory_path() / "searvins_test_evaluate"};
  EvaluationFixture() {
    std::filesystem::create_directories(folder);
    std::vector<io::TrajectoryRow> rows;
    std::vector<double> ratios;
    std::string truth = "week,sow,x,y,z\n";
    for (int i = 0; i < 60; ++i) {
      io::TrajectoryRow row;
      row.time = GpsTime::from_week_sow(2323, 553980 + i);
      row.p_e_m = {-3810234.401 + (i % 10 == 5 ? 2.0 : 0.01), 3567867.762, 3652897.917};
      row.status = io::SolutionStatus::fix;
      row.set_covariance_enu_m2(1e-4 * Eigen::Matrix3d::Identity());
      row.n_sat = 9;
      rows.push_back(row), ratios.push_back(4);
      truth += "2323," + std::to_string(553980 + i) + ",-3810234.401,3567867.762,3652897.917\n";
    }
    REQUIRE(io::write_text_file(path("trajectory.csv"), io::trajectory_csv(rows)).empty());
    REQUIRE(io::write_text_file(path("solution.pos"), io::rtklib_solution(rows, {}, ratios)).empty());
    REQUIRE(io::write_text_file(path("summary.json"), R"({"settings": {"rover": "a", "base": "b", "inertial unit": "c"}, "stereo": {}})")
                .empty());
    REQUIRE(io::write_text_file(path("truth.csv"), truth).empty());
  }
  ~EvaluationFixture() { std::filesystem::remove_all(folder); }
  EvaluationFixture(const EvaluationFixture&) = delete;
  EvaluationFixture& operator=(const EvaluationFixture&) = delete;
  [[nodiscard]] std::string path(const char* name) const { return (folder / name).string(); }
  [[nodiscard]] Outcome evaluate(const std::string& arguments) const {
    return run("evaluate --truth " + path("truth.csv") + ' ' + arguments);
  }
};

}  // namespace

TEST_CASE_FIXTURE(EvaluationFixture, "evaluate: the paper's tables, its rows on demand, names of choice") {
  const Outcome plain = evaluate(folder.string());
  REQUIRE_MESSAGE(plain.exit_code == 0, plain.output);
  CHECK(has(plain, "TC, r+b       S  yes"));
  CHECK_FALSE(has(plain, "[paper]"));
  CHECK(has(plain, "wrong fixes (horizontal error of 0.5 m or more): 6, events: 6"));
  const Outcome beside = evaluate("--paper mine=" + folder.string() + " " + path("solution.pos"));
  REQUIRE_MESSAGE(beside.exit_code == 0, beside.output);
  CHECK(has(beside, "SeA-RVINS (latent) [paper]"));
  CHECK(has(beside, "\nmine "));
  CHECK(has(beside, "\nsolution "));
  CHECK(has(evaluate("--integrity-risk 1e-3 --alert-limit 2.5 " + folder.string()),
            "Bounds at a risk of 0.001 an epoch (horizontal 3.72, vertical 3.29 sigma), alert limit 2.50 m"));
}

TEST_CASE_FIXTURE(EvaluationFixture, "evaluate: tables as CSV and Markdown, all figures as JSON, the page with its diagram") {
  const Outcome outcome = evaluate("--paper --tables " + path("t.csv") + " --tables " + path("t.md") + " --json " + path("e.json") +
                                   " --report " + path("r.html") + ' ' + folder.string());
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(io::read_text_file(path("t.csv"))->find("searvins_test_evaluate,run,\"TC, r+b\",S,yes,") != std::string::npos);
  CHECK(io::read_text_file(path("t.md"))->starts_with("**Position"));
  const auto json = examples::parse_json(*io::read_text_file(path("e.json")), "e.json");
  REQUIRE_MESSAGE(json.ok(), io::to_string(json.error()));
  const examples::Json& mine = json->find("runs")->elements.at(0);
  CHECK(mine.find("errors_m")->find("wrong_fixes")->number == 6);
  const std::vector<examples::Json>& list = mine.find("wrong_fixes")->find("list")->elements;
  REQUIRE(list.size() == 6);
  for (std::size_t k = 0; k < 6; ++k) {
    CHECK(list[k].find("sow")->number == 553985 + 10 * static_cast<double>(k));
    CHECK(list[k].find("ratio")->number == 4);
    CHECK(list[k].find("n_sat")->number == 9);
    CHECK(list[k].find("cause")->string == "jump");
  }
  CHECK(mine.find("integrity")->find("above_1p0_m")->find("stretches")->number == 6);
  const std::string html = *io::read_text_file(path("r.html"));
  CHECK(html.find("id=\"stanford\"") != std::string::npos);
  CHECK(html.find("<h2>Wrong fixes</h2>") != std::string::npos);
  CHECK(html.find("<small>paper</small>") != std::string::npos);
  const std::string begin = "id=\"run-data\">";
  const std::size_t at = html.find(begin) + begin.size();
  const auto data = examples::parse_json(std::string_view{html}.substr(at, html.find("</script>", at) - at), "run-data");
  REQUIRE_MESSAGE(data.ok(), io::to_string(data.error()));
  CHECK(data->find("runs")->elements.at(0).find("b")->elements.size() == 60);
  CHECK(data->find("integrity")->find("limit")->number == 1.5);
  for (const char* outside : {"http://", "https://", "src=", "@import", "url("})
    CHECK_MESSAGE(html.find(outside) == std::string::npos, outside);
}

TEST_CASE_FIXTURE(EvaluationFixture, "evaluate: usage errors exit with 2, files that cannot be written with 3") {
  CHECK(evaluate("--integrity-risk 0 " + folder.string()).exit_code == 2);
  CHECK(evaluate("--integrity-risk 0.6 " + folder.string()).exit_code == 2);
  CHECK(evaluate("--alert-limit -1 " + folder.string()).exit_code == 2);
  CHECK(has(evaluate("--tables t.txt " + folder.string()), "t.txt ends neither with .csv nor with .md"));
  CHECK(evaluate("--json /none/such/e.json " + folder.string()).exit_code == 3);
  CHECK(evaluate("--tables /none/such/e.md " + folder.string()).exit_code == 3);
  CHECK(evaluate("name=/none/such " + folder.string()).exit_code == 3);
}
#else
TEST_CASE("evaluate: files and tables") { MESSAGE("SKIPPED: the searvins command is not built"); }
#endif
