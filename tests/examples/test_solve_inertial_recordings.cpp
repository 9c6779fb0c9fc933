// SPDX-License-Identifier: BSD-3-Clause
// `searvins solve --imu` on a small simulated drive: what it writes, how it goes through gaps of either sensor, and what it says of input
// that it cannot use.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>

#include "command_runner.hpp"
#include "examples/support/evaluation.hpp"
#include "examples/support/json.hpp"
#include "examples/support/truth.hpp"

#ifdef SEARVINS_COMMAND
namespace {

using namespace searvins;
using namespace searvins::test;

/// A drive of 90 s, simulated once, and a folder for spoilt copies and results.
struct Drive {
  std::filesystem::path folder{std::filesystem::temp_directory_path() / "searvins_test_inertial"};
  Drive() {
    std::filesystem::create_directories(folder);
    const Outcome made = run("simulate --duration 90 --profile light --seed 4 --out " + (folder / "drive").string());
    REQUIRE_MESSAGE(made.exit_code == 0, made.output);
  }
  ~Drive() { std::filesystem::remove_all(folder); }
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;
};

struct InertialSolveFixture {
  InertialSolveFixture() : folder(drive().folder) {}
  static Drive& drive() {
    static Drive made;
    return made;
  }

  std::filesystem::path folder;
  std::string data{(folder / "drive/").string()};
  std::string rover{data + "rover.obs"}, imu{data + "imu.csv"}, rig{data + "rig.json"};

  [[nodiscard]] std::string path(const std::string& name) const { return (folder / name).string(); }
  [[nodiscard]] Outcome solve(const std::string& more = {}) const {
    return run("solve --rover " + rover + " --base " + data + "base.obs --nav " + data + "nav.rnx --imu " + imu + " --rig " + rig + " --truth " + data +
               "truth.csv --out " + path("out") + ' ' + more);
  }
  /// A copy of a file without the lines that `drop` names; there must be some, and some must stay.
  std::string without(const std::string& file, const char* name, const std::function<bool(const std::string&)>& drop) const {
    const std::string text = *io::read_text_file(file);
    std::string kept;
    std::size_t dropped = 0;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
      const std::string line = text.substr(at, end - at);
      drop(line) ? static_cast<void>(++dropped) : static_cast<void>(kept += line);
      at = end;
    }
    REQUIRE(dropped > 0);
    REQUIRE(!kept.empty());
    REQUIRE(io::write_text_file(path(name), kept).empty());
    return path(name);
  }
  /// A copy of a file with every `from` replaced; there must be one.
  std::string replaced(const std::string& file, const char* name, const std::string& from, const std::string& to) const {
    std::string text = *io::read_text_file(file);
    std::size_t n = 0;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size(), ++n) text.replace(at, from.size(), to);
    REQUIRE(n > 0);
    REQUIRE(io::write_text_file(path(name), text).empty());
    return path(name);
  }
  [[nodiscard]] std::vector<io::TrajectoryRow> rows() const {
    auto read = io::read_trajectory(path("out/trajectory.csv"));
    REQUIRE_MESSAGE(read.ok(), io::to_string(read.error()));
    return *read;
  }
  [[nodiscard]] examples::Json summary() const {
    auto json = examples::parse_json(*io::read_text_file(path("out/summary.json")), "summary.json");
    REQUIRE_MESSAGE(json.ok(), io::to_string(json.error()));
    return *json;
  }
};

/// Second of week of a reading's row `week,sow,...`; -1 for the header.
double sow_of(const std::string& line) {
  const std::size_t comma = line.find(',');
  return line.front() == 'w' ? -1 : std::atof(line.c_str() + comma + 1);
}

/// Leaves out the rover epochs of a stretch of seconds after the recording's beginning.
std::string rover_without(const InertialSolveFixture& f, const char* name, double from_s, double to_s) {
  bool skipping = false;
  return f.without(f.rover, name, [&](const std::string& line) {
    if (line.front() == '>') {  // > 2025 06 11 04 20  5.0000000  0 ..
      const double s = 60 * std::atof(line.substr(16, 2).c_str()) + std::atof(line.substr(18, 11).c_str()) - 60 * 20;
      skipping = s >= from_s && s < to_s;
    }
    return skipping;
  });
}

}  // namespace

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: a drive is fixed, with attitude, velocity and biases in every file") {
  const Outcome outcome = solve();
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "aligned"));
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(all.size() == 91);
  std::size_t with_attitude = 0, moving = 0;
  for (const io::TrajectoryRow& row : all) {
    CHECK(row.v_enu_mps.allFinite());
    if (!std::isfinite(row.heading_deg)) continue;
    ++with_attitude;
    CHECK((row.heading_deg >= 0 && row.heading_deg < 360));
    CHECK(std::abs(row.roll_deg) < 10);
    CHECK(std::abs(row.pitch_deg) < 10);
    if (row.v_enu_mps.norm() < 5) continue;  // a car points where it goes
    ++moving;
    const double course_deg = std::atan2(row.v_enu_mps.x(), row.v_enu_mps.y()) * 180 / std::numbers::pi;
    CHECK(std::abs(std::remainder(row.heading_deg - course_deg, 360)) < 8);
  }
  CHECK(with_attitude > 45);
  CHECK(moving > 10);
  const examples::Json json = summary();
  CHECK(json.find("status")->find("fix")->number > 60);
  CHECK(json.find("errors_m")->find("wrong_fixes")->number == 0);
  CHECK(json.find("errors_m")->find("horizontal")->find("rmse")->number < 0.1);
  CHECK(json.find("inertial")->find("alignment")->elements.size() == 1);
  CHECK(!json.find("inertial")->find("waited_for")->keys.empty());
  for (const char* bias : {"accel_bias_mps2", "gyro_bias_dps"}) CHECK(json.find("inertial")->find(bias)->elements.size() == 3);
  const std::string html = *io::read_text_file(path("out/report.html"));
  for (const char* column : {"\"hdg\":[", "\"bax\":[", "\"nees\":[", "\"shdg\":["}) CHECK_MESSAGE(html.find(column) != std::string::npos, column);
  // The last line of the TUM file turns: its quaternion is not the identity of an unknown attitude.
  const std::string tum = *io::read_text_file(path("out/trajectory_tum.txt"));
  CHECK(tum.substr(tum.rfind('\n', tum.size() - 2)).find("0.00000000 0.00000000 0.00000000 1.00000000") == std::string::npos);
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: no rover for 10 s: rows go on, labelled dr, and the outage is reported") {
  rover = rover_without(*this, "rover_gap.obs", 60, 70);
  const Outcome outcome = solve();
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  const std::vector<io::TrajectoryRow> all = rows();
  for (std::size_t i = 1; i < all.size(); ++i) CHECK(seconds_between(all[i - 1].time, all[i].time) < 1.6);
  const auto dead = std::count_if(all.begin(), all.end(), [](const io::TrajectoryRow& r) { return r.status == io::SolutionStatus::dr; });
  CHECK((dead >= 8 && dead <= 11));
  const examples::Json json = summary();
  const examples::Json& outages = *json.find("inertial")->find("outages");
  REQUIRE(outages.elements.size() == 1);
  CHECK(outages.elements[0].find("length_s")->number == doctest::Approx(11).epsilon(0.05));
  CHECK(outages.elements[0].find("horizontal_error_m")->number < 5);
  CHECK(has(outcome, "carried on by the inertial unit"));
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: a gap in the readings costs the attitude for a while, not the position") {
  imu = without(imu, "imu_gap.csv", [](const std::string& line) { return sow_of(line) > 274850 && sow_of(line) < 274853; });
  const Outcome outcome = solve();
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "imu_gap.csv: 1 gap in the readings, longest 3.0"));
  CHECK(has(outcome, "alignment lost"));
  CHECK(rows().size() >= 90);
  CHECK(summary().find("inertial")->find("alignment")->elements.size() == 3);
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: readings of a part of the drive: said, and GNSS alone for the rest") {
  imu = without(imu, "imu_part.csv", [](const std::string& line) { return sow_of(line) > 274840; });
  const Outcome outcome = solve();
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "the readings cover only a part of the rover's time"));
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(all.size() >= 90);
  CHECK(!std::isfinite(all.back().heading_deg));
  CHECK(all.back().status == io::SolutionStatus::fix);
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: rows at the rate of the unit lie between the solutions and move with them") {
  REQUIRE(solve().exit_code == 0);
  const std::vector<io::TrajectoryRow> solutions = rows();
  const Outcome outcome = solve("--rate imu");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(all.size() > solutions.size() + 5000);
  for (std::size_t i = 1; i < all.size(); ++i) {
    REQUIRE(all[i - 1].time < all[i].time);
    const double dt = seconds_between(all[i - 1].time, all[i].time);
    if (dt < 0.05) CHECK((all[i].p_e_m - all[i - 1].p_e_m).norm() < 20 * dt + 0.5);
  }
  for (const io::TrajectoryRow& s : solutions)  // solutions are what they were
    CHECK(std::any_of(all.begin(), all.end(), [&](const io::TrajectoryRow& r) { return r.time == s.time && r.status == s.status && r.p_e_m == s.p_e_m; }));
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: a given heading aligns before the car moves") {
  REQUIRE(solve("--heading 0,3").exit_code == 0);
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(std::count_if(all.begin(), all.end(), [](const io::TrajectoryRow& r) { return std::isfinite(r.heading_deg); }) > 80);
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: unusable input exits with 3 and names file, cause and remedy") {
  const auto refused = [](const Outcome& outcome, std::initializer_list<const char*> parts) {
    CHECK_MESSAGE(outcome.exit_code == 3, outcome.output);
    for (const char* part : parts) CHECK_MESSAGE(has(outcome, part), part << '\n' << outcome.output);
  };
  SUBCASE("no log") {
    imu = path("nowhere.csv");
    refused(solve(), {"nowhere.csv", "no such file"});
  }
  SUBCASE("a log that is none") {
    imu = rover;
    refused(solve(), {"rover.obs", "is no IMU log"});
  }
  SUBCASE("a log of another week: both ranges are named") {
    imu = replaced(imu, "imu_week.csv", "\n2370,", "\n2371,");
    refused(solve(), {"imu_week.csv", "does not overlap the rover in time", "readings from 2025-06-18", "rover from 2025-06-11"});
  }
  SUBCASE("a rig without an inertial unit") {
    REQUIRE(io::write_text_file(path("rig_none.json"), "{\"schema\": 1, \"base\": {\"position_ecef_m\": [4180673.8602, 848118.5422, 4726552.3013]}}").empty());
    rig = path("rig_none.json");
    refused(solve(), {"rig_none.json", "no section \"imu\"", "docs/inertial.md"});
  }
  SUBCASE("a rig without a lever arm") {
    rig = without(rig, "rig_arm.json", [](const std::string& line) { return line.find("\"antenna\"") != std::string::npos; });
    refused(solve(), {"rig_arm.json", "antenna.lever_arm_b_m"});
  }
  SUBCASE("a rig with an unknown field") {
    rig = replaced(rig, "rig_field.json", "\"rate_hz\"", "\"rate_khz\": 1, \"rate_hz\"");
    refused(solve(), {"rig_field.json", "rate_khz"});
  }
  SUBCASE("axes upside down") {
    rig = replaced(rig, "rig_axes.json", "[\"x\", \"y\", \"z\"]", "[\"-x\", \"y\", \"-z\"]");
    refused(solve(), {"gravity points the wrong way", "imu.axes", "up is the log's axis z"});
  }
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu: usage errors exit with 2 and say what is needed") {
  const std::string files = "solve --rover " + rover + " --base " + data + "base.obs --nav " + data + "nav.rnx --out " + path("out") + ' ';
  const auto refused = [&](const std::string& arguments, const char* part) {
    const Outcome outcome = run(files + arguments);
    CHECK_MESSAGE(outcome.exit_code == 2, outcome.output);
    CHECK_MESSAGE(has(outcome, part), outcome.output);
  };
  refused("--imu " + imu, "--imu needs --rig FILE");
  refused("--rate imu", "--rate imu needs --imu FILE");
  refused("--rate camera", "--rate camera needs --tracks FILE");
  refused("--rate often", "'often' is none of gnss, camera, imu");
  refused("--tracks x", "--tracks x needs --imu FILE");
  refused("--without motion --rig " + rig + " --imu " + imu, "--without motion needs --tracks FILE");
  refused("--tracks x --without ears --rig " + rig + " --imu " + imu, "'ears' is none of semantic, geometric, motion, maturity");
  refused("--with ears", "--with: 'ears' is none of wheels, cn0, code-gate, batch-size, predicted-motion");
  refused("--with wheels", "--with wheels needs --imu FILE");
  refused("--with predicted-motion", "--with predicted-motion needs --imu FILE");
  refused("--with batch-size", "--with batch-size needs --robust batch");
  refused("--positions x --rig " + rig + " --imu " + imu, "--positions is given: leave --rover out");
  CHECK(has(run("solve --positions x --out " + path("out")), "--positions needs --imu FILE"));
  refused("--heading 90", "--heading 90 needs --imu FILE");
  refused("--map x", "--map needs --imu FILE");
  refused("--heading 90,0 --rig " + rig + " --imu " + imu, "the sigma must lie in 0 .. 90");
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --imu without --base: codes of the rover alone, every epoch answered, nothing called better than a single point") {
  const Outcome outcome = run("solve --rover " + rover + " --nav " + data + "nav.rnx --imu " + imu + " --rig " + rig + " --truth " + data + "truth.csv --out " + path("out"));
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "rover alone (no base)"));
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(std::all_of(all.begin(), all.end(), [](const io::TrajectoryRow& r) { return r.status == io::SolutionStatus::spp || r.status == io::SolutionStatus::dr; }));
  CHECK(std::isfinite(all.back().heading_deg));
  const examples::Json json = summary();
  CHECK(json.find("errors_m")->find("availability_pct")->number > 99);
  CHECK(json.find("errors_m")->find("horizontal")->find("rmse")->number < 3);
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve: every policy that can be switched changes the trajectory") {
  REQUIRE(solve().exit_code == 0);
  const auto way = [this] {  // the file also has times of solving, which differ from run to run
    std::vector<double> numbers;
    for (const io::TrajectoryRow& row : rows()) numbers.insert(numbers.end(), row.p_e_m.begin(), row.p_e_m.end());
    return numbers;
  };
  const std::vector<double> before = way();
  REQUIRE(solve().exit_code == 0);
  CHECK(way() == before);
  for (const char* policy : {"--with wheels", "--with cn0", "--without robust", "--robust batch --with batch-size"}) {
    CAPTURE(policy);
    const Outcome outcome = solve(policy);
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
    CHECK(way() != before);
  }
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --map: lanes hold a drive whose rover falls silent, the summary says how often; a broken map is refused with its line") {
  rover = rover_without(*this, "rover_silent.obs", 40, 80);
  const Outcome without_map = solve();
  REQUIRE_MESSAGE(without_map.exit_code == 0, without_map.output);
  CHECK(!has(without_map, "held in a lane of the map"));
  const std::vector<io::TrajectoryRow> before = rows();
  const Outcome outcome = solve("--map " + data + "streets.csv");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "held in a lane of the map"));
  const std::vector<io::TrajectoryRow> after = rows();
  REQUIRE(before.size() == after.size());
  bool moved = false;
  for (std::size_t i = 0; i < before.size(); ++i) moved = moved || before[i].p_e_m != after[i].p_e_m;
  CHECK(moved);
  REQUIRE(io::write_text_file(path("broken.csv"), "line,lat_deg,lon_deg,height_m\n1,48,11,500\n1,48,east,500\n").empty());
  const Outcome refused = solve("--map " + path("broken.csv"));
  CHECK(refused.exit_code == 3);
  CHECK_MESSAGE(has(refused, "broken.csv:3"), refused.output);
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --positions: loosely coupled to the positions of an earlier run") {
  REQUIRE(run("solve --rover " + rover + " --base " + data + "base.obs --nav " + data + "nav.rnx --rig " + rig + " --out " + path("gnss")).exit_code == 0);
  const std::string positions = path("gnss/solution.pos");
  const std::string common = " --imu " + imu + " --rig " + rig + " --truth " + data + "truth.csv --out " + path("out");
  const Outcome outcome = run("solve --positions " + positions + common);
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(all.size() >= 90);
  CHECK(std::isfinite(all.back().heading_deg));
  const examples::Json json = summary();
  CHECK(json.find("errors_m")->find("availability_pct")->number > 99);
  CHECK(json.find("errors_m")->find("horizontal")->find("rmse")->number < 0.1);
  CHECK(json.find("inertial")->find("rows_with_attitude")->number > 40);
  CHECK(run("solve --positions " + path("nowhere.pos") + common).exit_code == 3);
  REQUIRE(io::write_text_file(path("empty.pos"), "% nothing\n").empty());
  CHECK(run("solve --positions " + path("empty.pos") + common).exit_code == 3);
  std::filesystem::remove_all(folder / "gnss");
}

TEST_CASE_FIXTURE(InertialSolveFixture, "solve --tracks: frames become states, every observation has its fate, and a broken file is refused with its line") {
  const std::string tracks = data + "stereo_tracks.csv";
  const Outcome outcome = solve("--rate camera --tracks " + tracks);
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "observations admitted"));
  const std::vector<io::TrajectoryRow> all = rows();
  CHECK(all.size() > 300);  // ten a second from alignment on
  CHECK(std::is_sorted(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.time < b.time; }));
  CHECK(std::any_of(all.begin(), all.end(), [](const io::TrajectoryRow& r) { return r.n_tracks > 10; }));
  const examples::Json json = summary();
  CHECK(json.find("errors_m")->find("horizontal")->find("max")->number < 0.3);
  CHECK(json.find("stereo")->find("frames")->number > 800);
  CHECK(json.find("stereo")->find("observation_fates")->find("admitted")->number > 1000);
  const Outcome without = solve("--tracks " + tracks + " --without semantic,maturity");
  REQUIRE_MESSAGE(without.exit_code == 0, without.output);
  CHECK(summary().find("stereo")->find("observation_fates")->find("admitted")->number >
        json.find("stereo")->find("observation_fates")->find("admitted")->number);
  const Outcome broken = solve("--tracks " + replaced(tracks, "broken.csv", "t_gps_sow,track_id", "t_gps_sow,number"));
  CHECK(broken.exit_code == 3);
  CHECK(has(broken, "the header has no column track_id"));
}

TEST_CASE_FIXTURE(InertialSolveFixture, "evaluate --report: several runs on one page") {
  REQUIRE(solve().exit_code == 0);
  std::filesystem::rename(folder / "out", folder / "with_imu");
  REQUIRE(run("solve --rover " + rover + " --base " + data + "base.obs --nav " + data + "nav.rnx --rig " + rig + " --out " + path("gnss_only")).exit_code == 0);
  REQUIRE(io::write_text_file(path("streets.csv"), "line,lat_deg,lon_deg,height_m\n1,48.1,11.5,560\n1,48.101,11.5,560\n2,48.1,11.5,560\n2,48.1,11.502,560\n").empty());
  const Outcome outcome = run("evaluate --truth " + data + "truth.csv " + path("with_imu") + ' ' + path("gnss_only") + " --report " + path("both.html") +
                              " --streets " + path("streets.csv"));
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  const std::string html = *io::read_text_file(path("both.html"));
  CHECK(html.find("with_imu and gnss_only") != std::string::npos);
  const std::string begin = "id=\"run-data\">";
  const std::size_t at = html.find(begin) + begin.size();
  const auto json = examples::parse_json(std::string_view{html}.substr(at, html.find("</script>", at) - at), "run-data");
  REQUIRE_MESSAGE(json.ok(), io::to_string(json.error()));
  REQUIRE(json->find("runs")->elements.size() == 2);
  CHECK(json->find("streets")->elements.size() == 2);
  CHECK(json->find("streets")->elements[0].find("e")->elements.size() == 2);
  for (const examples::Json& one : json->find("runs")->elements)
    for (const char* column : {"s", "e", "n", "h", "v", "d", "q"}) CHECK(one.find(column)->elements.size() == json->find("t")->elements.size());
  for (const char* outside : {"http://", "https://", "src=", "@import", "url("}) CHECK_MESSAGE(html.find(outside) == std::string::npos, outside);
  std::filesystem::remove_all(folder / "with_imu");
}
#else
TEST_CASE("solve --imu: exit codes") { MESSAGE("SKIPPED: the searvins command is not built"); }
#endif
