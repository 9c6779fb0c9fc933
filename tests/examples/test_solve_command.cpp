// SPDX-License-Identifier: BSD-3-Clause
// `searvins solve` and `searvins demo`: what they write from the bundled recording, and what they say of input that they cannot use.
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <searvins/io/rtklib_solution.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/json.hpp"
#include "command_runner.hpp"
#include "examples/support/truth.hpp"

#ifdef SEARVINS_COMMAND
namespace {

using namespace searvins;
using namespace searvins::test;

/// A folder for spoilt copies of the bundled recording and for results.
struct SolveFixture {
  std::filesystem::path folder{std::filesystem::temp_directory_path() / "searvins_test_solve"};
  std::string data{SEARVINS_SOURCE_DIR "/examples/data/synthetic_drive/"};
  std::string rover{data + "rover.obs"}, base{data + "base.obs"}, nav{data + "nav.rnx"}, truth{data + "truth.csv"};

  SolveFixture() { std::filesystem::create_directories(folder); }
  ~SolveFixture() { std::filesystem::remove_all(folder); }
  SolveFixture(const SolveFixture&) = delete;
  SolveFixture& operator=(const SolveFixture&) = delete;

  [[nodiscard]] std::string path(const char* name) const { return (folder / name).string(); }
  /// Solves the first 15 s unless `more` says otherwise.
  [[nodiscard]] Outcome solve(const std::string& more = "--end 274815") const {
    return run("solve --rover " + rover + " --base " + base + " --nav " + nav + " --out " + path("out") + ' ' + more);
  }
  /// A copy of a file with every `from` replaced; there must be one.
  [[nodiscard]] std::string spoilt(const std::string& file, const char* name, const std::string& from, const std::string& to) const {
    std::string text = *io::read_text_file(file);
    std::size_t n = 0;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size(), ++n) text.replace(at, from.size(), to);
    REQUIRE(n > 0);
    REQUIRE(io::write_text_file(path(name), text).empty());
    return path(name);
  }
};

}  // namespace

TEST_CASE_FIXTURE(SolveFixture, "solve: the bundled recording gives every file, readable and scored") {
  const Outcome outcome = solve("--truth " + truth);
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  for (const char* name :
       {"trajectory.csv", "trajectory_lagged.csv", "solution.pos", "trajectory.kml", "trajectory_tum.txt", "summary.json", "report.html"})
    CHECK_MESSAGE(std::filesystem::exists(folder / "out" / name), name);
  const auto rows = io::read_trajectory((folder / "out/trajectory.csv").string());
  REQUIRE_MESSAGE(rows.ok(), io::to_string(rows.error()));
  CHECK(rows->size() == 117);
  const auto pos = io::read_rtklib_solution((folder / "out/solution.pos").string());
  REQUIRE(pos.ok());
  CHECK(pos->size() == rows->size());
  for (std::size_t i = 0; i < pos->size(); ++i) CHECK(((*pos)[i].p_e_m - (*rows)[i].p_e_m).norm() < 1e-3);
  const auto lagged = io::read_trajectory((folder / "out/trajectory_lagged.csv").string());
  REQUIRE(lagged.ok());
  CHECK(lagged->size() > 80);

  const auto track = examples::read_truth(truth, rows->front().time);
  REQUIRE(track.ok());
  const auto evaluation = examples::evaluate(*track, *rows);
  REQUIRE(evaluation.ok());
  CHECK(evaluation->wrong_fixes == 0);
  CHECK(evaluation->fix_rate_pct > 40);
  CHECK(evaluation->fixed_horizontal.rmse_m < 0.05);
  CHECK(evaluation->below_1p5_pct > 90);

  const auto json = examples::parse_json(*io::read_text_file((folder / "out/summary.json").string()), "summary.json");
  CHECK_MESSAGE(json.ok(), io::to_string(json.error()));
  CHECK(has(outcome, "correct fixes / wrong"));
  CHECK(has(outcome, "header of the base file"));
}

TEST_CASE_FIXTURE(SolveFixture, "solve: a run is repeated bit by bit, up to its clock") {
  const std::string columns = "--end 274830 --robust latent";
  const auto read = [this] {
    auto rows = io::read_trajectory((folder / "out/trajectory.csv").string());
    REQUIRE(rows.ok());
    for (io::TrajectoryRow& row : *rows) row.solve_ms = 0;
    return io::trajectory_csv(*rows);
  };
  REQUIRE(solve(columns).exit_code == 0);
  const std::string first = read();
  REQUIRE(solve(columns).exit_code == 0);
  CHECK(read() == first);
}

TEST_CASE_FIXTURE(SolveFixture, "solve: every formulation, mode and profile runs; float never says fix") {
  for (const char* options : {"--robust batch", "--robust scalar", "--robust latent", "--ambiguity full", "--continuity constant",
                              "--continuity instantaneous", "--handover restart", "--sigma-profile urban", "--sigma-profile geodetic",
                              "--signals G1C,E1C", "--arc 5 --lag 8", "--mask 20 --min-cn0 30"}) {
    const Outcome outcome = solve(std::string{"--end 274815 "} + options);
    CHECK_MESSAGE(outcome.exit_code == 0, options << '\n' << outcome.output);
  }
  REQUIRE(solve("--end 274815 --ambiguity float").exit_code == 0);
  const auto rows = io::read_trajectory((folder / "out/trajectory.csv").string());
  REQUIRE(rows.ok());
  CHECK(rows->size() == 16);
  for (const io::TrajectoryRow& row : *rows) CHECK(row.status == io::SolutionStatus::float_);
}

TEST_CASE_FIXTURE(SolveFixture, "solve: without a base it gives single points") {
  const Outcome outcome = run("solve --rover " + rover + " --nav " + nav + " --end 274830 --out " + path("out"));
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  const auto rows = io::read_trajectory((folder / "out/trajectory.csv").string());
  REQUIRE(rows.ok());
  CHECK(rows->size() == 31);
  for (const io::TrajectoryRow& row : *rows) CHECK(row.status == io::SolutionStatus::spp);
}

TEST_CASE_FIXTURE(SolveFixture, "solve: a damaged epoch is skipped and counted, and does not end the run") {
  rover = spoilt(rover, "rover.obs", "> 2025 06 11 04 20  5.0000000  0 ", "> 2025 06 11 04 20  5.0000000  0x");
  const Outcome outcome = solve();
  CHECK_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "rover.obs: "));
  const auto rows = io::read_trajectory((folder / "out/trajectory.csv").string());
  REQUIRE(rows.ok());
  CHECK(rows->size() == 15);
}

TEST_CASE_FIXTURE(SolveFixture, "solve: usage errors exit with 2") {
  CHECK(run("solve --base " + base + " --nav " + nav + " --out " + path("out")).exit_code == 2);
  CHECK(run("solve --rover " + rover + " --base " + base + " --out " + path("out")).exit_code == 2);
  CHECK(solve("--robust latnet").exit_code == 2);
  CHECK(has(solve("--robust latnet"), "did you mean latent?"));
  CHECK(has(solve("--signals G1C,X9Z"), "'X9Z' is no signal"));
  CHECK(solve("--arc 0").exit_code == 2);
  CHECK(solve("--base-ecef 1,2").exit_code == 2);
  CHECK(solve("--truth " + truth + " --truth-ecef 1,2,3").exit_code == 2);
  CHECK(has(solve("--images x"), "--images x needs --imu FILE"));
  CHECK(has(solve("--imu x --rig y --images x --tracks z"), "give either --tracks FILE or --images DIR"));
}

TEST_CASE_FIXTURE(SolveFixture, "solve: unusable files exit with 3, name the file and say what to do") {
  const auto refused = [](const Outcome& outcome, const std::string& file, const std::string& part) {
    CHECK_MESSAGE(outcome.exit_code == 3, outcome.output);
    CHECK_MESSAGE(has(outcome, file), outcome.output);
    CHECK_MESSAGE(has(outcome, part), outcome.output);
  };
  const std::string good_rover = rover, good_base = base, good_nav = nav;
  SUBCASE("no rover file") {
    rover = path("nowhere.obs");
    refused(solve(), "nowhere.obs", "no such file");
  }
  SUBCASE("an empty rover file") {
    rover = path("empty.obs");
    REQUIRE(io::write_text_file(rover, "").empty());
    refused(solve(), "empty.obs", "empty");
  }
  SUBCASE("a navigation file as rover, an observation file as navigation") {
    rover = good_nav;
    refused(solve(), "nav.rnx", "nav");
    rover = good_rover, nav = good_rover;
    refused(solve(), "rover.obs", "obs");
  }
  SUBCASE("one file as rover and base") {
    base = good_rover;
    refused(solve(), "rover.obs", "as rover and as base");
  }
  SUBCASE("a base of another day") {
    base = spoilt(spoilt(base, "base1.obs", "> 2025 06 11", "> 2025 06 12"), "base.obs", "  2025     6    11 ", "  2025     6    12 ");
    refused(solve(), "base.obs", "does not overlap the rover in time");
  }
  SUBCASE("a base position that is zero") {
    base = spoilt(base, "base.obs", "  4180673.8602   848118.5422  4726552.3013 ", "        0.0000        0.0000        0.0000 ");
    refused(solve(), "base.obs", "--base-ecef X,Y,Z");
    CHECK(solve("--end 274815 --base-ecef 4180673.8602,848118.5422,4726552.3013").exit_code == 0);
  }
  SUBCASE("a base position that is missing") {
    base = spoilt(base, "base.obs", "APPROX POSITION XYZ ", "COMMENT             ");
    refused(solve(), "base.obs", "--base-ecef X,Y,Z");
  }
  SUBCASE("a base position that is none") { refused(solve("--base-ecef 0,0,0"), "--base-ecef", "not near the surface of the Earth"); }
  SUBCASE("a navigation file of another day") {
    nav = spoilt(nav, "nav.rnx", " 2025 06 11 ", " 2025 06 18 ");
    nav = spoilt(nav, "nav2.rnx", " 2.370000000000E+03", " 2.371000000000E+03");  // week of GPS and Galileo
    nav = spoilt(nav, "nav.rnx", " 1.014000000000E+03", " 1.015000000000E+03");   // of BeiDou
    refused(solve(), "nav.rnx", "no record is of the rover's time");
  }
  SUBCASE("signals that neither file has") { refused(solve("--signals G5Q,E5Q"), "--signals", "the rover has "); }
  SUBCASE("a time that the recording does not hold") {
    refused(solve("--start 1 --end 2"), "rover.obs", "no epoch between --start and --end");
  }
  SUBCASE("a truth that is none") { refused(solve("--truth " + good_base), "base.obs", ":1: "); }
  SUBCASE("a rig that is none") { refused(solve("--rig " + truth), "truth.csv", ":1"); }
}

TEST_CASE_FIXTURE(SolveFixture, "solve: epochs without differences fall back to single points, and the summary says why") {
  const Outcome outcome = solve("--end 274815 --mask 85");
  CHECK_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "16 times no differences: too few satellites in common with the base"));
  const auto rows = io::read_trajectory((folder / "out/trajectory.csv").string());
  REQUIRE(rows.ok());
  for (const io::TrajectoryRow& row : *rows) CHECK(row.status == io::SolutionStatus::spp);
}

TEST_CASE_FIXTURE(SolveFixture, "solve: a run without any solution exits with 4 and says why") {
  rover = spoilt(rover, "rover.obs", "C1C L1C D1C S1C C2W L2W D2W S2W", "S1X S1C D1C D1X S2X S2W D2W D2X");
  rover = spoilt(rover, "rover2.obs", "C1C L1C D1C S1C C7Q L7Q D7Q S7Q", "S1X S1C D1C D1X S7X S7Q D7Q D7X");
  rover = spoilt(rover, "rover3.obs", "C2I L2I D2I S2I", "S2X S2I D2I D2X");
  const Outcome without_code = run("solve --rover " + rover + " --nav " + nav + " --end 274815 --out " + path("out"));
  CHECK_MESSAGE(without_code.exit_code == 4, without_code.output);
  CHECK(has(without_code, "without a solution"));
}

TEST_CASE_FIXTURE(SolveFixture, "demo: solves the bundled recording, prints the tables and says where the report is") {
  const Outcome outcome = run("demo --out " + path("demo"));
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  for (const char* part : {"scalar", "latent", "symmetric", "fix rate %", "report.html"}) CHECK_MESSAGE(has(outcome, part), part);
  CHECK(std::filesystem::exists(folder / "demo/report.html"));
  const Outcome nowhere = run("demo --data " + path("nowhere") + " --out " + path("demo"));
  CHECK(nowhere.exit_code == 3);
  CHECK(has(nowhere, "no such file"));
}
#else
TEST_CASE("solve: exit codes") { MESSAGE("SKIPPED: the searvins command is not built"); }
#endif
