// SPDX-License-Identifier: BSD-3-Clause
// `searvins solve --calibrate-camera` on a drive that `searvins simulate` spoilt the camera of.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <searvins/io/text_reader.hpp>

#include "command_runner.hpp"
#include "examples/support/json.hpp"

#ifdef SEARVINS_COMMAND
namespace {

using namespace searvins;
using namespace searvins::test;

struct CalibrationFixture {
  std::filesystem::path folder{std::filesystem::temp_directory_path() / "searvins_test_calibrate"};
  std::string data{(folder / "drive/").string()};
  ~CalibrationFixture() { std::filesystem::remove_all(folder); }
  [[nodiscard]] std::string solve() const {
    return "solve --rover " + data + "rover.obs --base " + data + "base.obs --nav " + data + "nav.rnx --imu " + data + "imu.csv --rig " + data + "rig.json --out " +
           (folder / "out").string() + ' ';
  }
};

double number(const examples::Json& object, const char* name) {
  const examples::Json* found = object.find(name);
  REQUIRE(found);
  return found->number;
}

}  // namespace

TEST_CASE_FIXTURE(CalibrationFixture, "solve --calibrate-camera: time offset and boresight are found, printed with sigmas and written to summary.json") {
  const Outcome made = run("simulate --duration 70 --profile light --seed 21 --camera-offset-ms 5 --camera-boresight-deg 0.2,-0.2,0.1 --out " + data);
  REQUIRE_MESSAGE(made.exit_code == 0, made.output);
  const Outcome outcome = run(solve() + "--calibrate-camera --tracks " + data + "stereo_tracks.csv --truth " + data + "truth.csv");
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.output);
  CHECK(has(outcome, "camera time offset"));
  CHECK(has(outcome, "camera boresight (right, down, forward)"));
  const auto text = io::read_text_file((folder / "out/summary.json").string());
  REQUIRE(text);
  const auto json = examples::parse_json(*text, "summary.json");
  REQUIRE(json);
  const examples::Json* const stereo = json->find("stereo");
  REQUIRE(stereo);
  const examples::Json* const found = stereo->find("camera_correction");
  REQUIRE(found);
  CHECK(std::abs(number(*found, "time_offset_s") - 5e-3) < 1e-3);
  CHECK(number(*found, "time_offset_sigma_s") < 1e-3);
  const examples::Json* const turn = found->find("boresight_deg");
  REQUIRE((turn && turn->elements.size() == 3));
  const double wanted[] = {0.2, -0.2, 0.1};
  for (std::size_t i = 0; i < 3; ++i) CHECK(std::abs(turn->elements[i].number - wanted[i]) < 0.1);
}

TEST_CASE_FIXTURE(CalibrationFixture, "solve --calibrate-camera and simulate: usage errors exit with 2 and say what is needed") {
  CHECK(has(run(solve() + "--calibrate-camera"), "--calibrate-camera needs --tracks FILE or --images DIR"));
  const Outcome other = run(solve() + "--calibrate-camera --robust latent --tracks x");
  CHECK(other.exit_code == 2);
  CHECK(has(other, "--calibrate-camera needs --robust symmetric"));
  CHECK(has(run("solve --dataset ppc --sensors imu --calibrate-camera --out x y"), "--calibrate-camera needs --sensors all"));
  const Outcome two = run("simulate --camera-boresight-deg 1,2 --out " + data);
  CHECK(two.exit_code == 2);
  CHECK(has(two, "3 numbers"));
  CHECK(run("simulate --camera-offset-ms 1000 --out " + data).exit_code == 2);
}

#else
TEST_CASE("solve --calibrate-camera") { MESSAGE("SKIPPED: the searvins command is not built"); }
#endif
