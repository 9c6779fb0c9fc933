// SPDX-License-Identifier: BSD-3-Clause
// The command itself: exit codes and messages of everything that needs no recording to be solved.
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <searvins/io/trajectory.hpp>
#include <searvins/version.hpp>

#include "command_runner.hpp"

#ifdef SEARVINS_COMMAND
namespace {

using namespace searvins;
using namespace searvins::test;

/// A folder with a run of ten epochs and its truth.
struct CommandFixture {
  std::filesystem::path folder{std::filesystem::temp_directory_path() / "searvins_test_command"};
  CommandFixture() {
    std::filesystem::create_directories(folder);
    std::vector<io::TrajectoryRow> rows;
    std::string truth = "week,sow,x,y,z\n";
    for (int i = 0; i < 10; ++i) {
      io::TrajectoryRow row;
      row.time = GpsTime::from_week_sow(2323, 553980 + i);
      row.p_e_m = {-3810234.401, 3567867.762, 3652897.917 + i};
      row.status = io::SolutionStatus::fix;
      rows.push_back(row);
      truth += "2323," + std::to_string(553980 + i) + ",-3810234.401,3567867.762," + io::fixed_text(row.p_e_m.z(), 3) + "\n";
    }
    REQUIRE(io::write_text_file(path("trajectory.csv"), io::trajectory_csv(rows)).empty());
    REQUIRE(io::write_text_file(path("truth.csv"), truth).empty());
    REQUIRE(io::write_text_file(path("broken.csv"), io::trajectory_header() + "\n1,2,3\n").empty());
  }
  ~CommandFixture() { std::filesystem::remove_all(folder); }
  CommandFixture(const CommandFixture&) = delete;
  CommandFixture& operator=(const CommandFixture&) = delete;
  [[nodiscard]] std::string path(const char* name) const { return (folder / name).string(); }
};

}  // namespace

TEST_CASE("command: help and version of the command and of each subcommand exit with 0") {
  CHECK(run("--version").output == std::string{"searvins "} + kVersionString + "\n");
  CHECK(run("--help").exit_code == 0);
  for (const char* name : {"solve", "info", "evaluate", "simulate", "demo"}) {
    CHECK_MESSAGE(run(std::string{name} + " --help").exit_code == 0, name);
    CHECK_MESSAGE(has(run(std::string{name} + " --help"), std::string{"searvins "} + name), name);
    CHECK_MESSAGE(run(std::string{name} + " --version").output == std::string{"searvins "} + kVersionString + "\n", name);
    CHECK_MESSAGE(run(std::string{name} + " --nonsense-option").exit_code == 2, name);
  }
}

TEST_CASE("command: usage errors exit with 2 and suggest") {
  CHECK(run("").exit_code == 2);
  const Outcome typo = run("evalaute x");
  CHECK(typo.exit_code == 2);
  CHECK(has(typo, "did you mean evaluate?"));
  CHECK(run("evaluate").exit_code == 2);
  CHECK(run("evaluate --truth a --truth-ecef 1,2,3 run").exit_code == 2);
  CHECK(has(run("evaluate --truth a --step 0 run"), "--step: 0 lies outside"));
  CHECK(run("info").exit_code == 2);
}

TEST_CASE_FIXTURE(CommandFixture, "command: evaluate prints the tables, and refuses what it cannot use with 3") {
  const Outcome good = run("evaluate --truth " + path("truth.csv") + " " + folder.string() + " " + path("trajectory.csv"));
  CHECK(good.exit_code == 0);
  CHECK(has(good, "fix rate %"));
  CHECK(has(good, "100.00"));
  const Outcome broken = run("evaluate --truth " + path("truth.csv") + " " + path("broken.csv"));
  CHECK(broken.exit_code == 3);
  CHECK(has(broken, "broken.csv:2: 3 fields, 26 expected"));
  CHECK(run("evaluate --truth " + path("none.csv") + " " + path("trajectory.csv")).exit_code == 3);
  const Outcome elsewhere = run("evaluate --truth " + path("truth.csv") + " --start 1 --end 2 " + path("trajectory.csv"));
  CHECK(elsewhere.exit_code == 3);
  CHECK(has(elsewhere, "no truth row lies on a multiple"));
}

TEST_CASE_FIXTURE(CommandFixture, "command: info exits with 3 when one of the files is unusable, JSON stays JSON") {
  CHECK(run("info " + path("trajectory.csv")).exit_code == 0);
  const Outcome json = run("info --json " + path("trajectory.csv") + " " + path("none"));
  CHECK(json.exit_code == 3);
  CHECK(json.output.front() == '[');
  CHECK(has(json, "\"kind\": \"trajectory\""));
  CHECK(has(json, "no such file"));
}
#else
TEST_CASE("command: exit codes") { MESSAGE("SKIPPED: the searvins command is not built"); }
#endif
