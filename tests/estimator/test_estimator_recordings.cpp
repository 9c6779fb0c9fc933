// SPDX-License-Identifier: BSD-3-Clause
// RTK and inertial navigation on the twin of a recorded drive, in the open and in a city: availability, accuracy, no wrong fix.
#include <cstdio>

#include <searvins/io/imu_log.hpp>

#include "estimator/inertial_drive.hpp"
#include "examples/support/rig.hpp"
#include "examples/support/truth.hpp"
#include "gnss/recordings.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::EstimatorOptions;
using estimator::RtkSolution;
using estimator::SolutionStatus;

namespace {

constexpr double kStandsUntilS = 30;  ///< the drive begins there, and the score

/// A twin with its unit, turned to right-forward-up axes; its settings are those of rig.json.
struct TwinDrive {
  InertialDrive drive{};
  EstimatorOptions options{};
};

TwinDrive twin_drive(const std::filesystem::path& shared, const std::string& name) {
  const auto folder = shared / "data/twin" / name;
  Recording r = twin(shared, name);
  TwinDrive t;
  InertialDrive& d = t.drive;
  d.rover = std::move(r.rover), d.base = std::move(r.base), d.base_e_m = r.base_e_m, d.ionosphere = r.store->ionosphere;
  for (const gnss::Ephemeris& e : r.store->records()) d.ephemerides.push_back(e);
  const auto rig = examples::read_rig((folder / "rig.json").string());
  REQUIRE(rig.ok());
  const examples::RigImu& unit = *rig.value().imu;
  auto log = io::read_imu_log(folder / "imu.log", {});
  REQUIRE(!log.error);
  d.imu = std::move(log.value.samples);
  io::turn_axes(d.imu, rig.value().R_rfu_b * unit.R_b_raw);
  d.lever_arm_b_m = rig.value().R_rfu_b * *rig.value().lever_arm_b_m;
  d.noise = {unit.accel_noise_mps2_sqrt_hz,      unit.gyro_noise_radps_sqrt_hz, unit.accel_bias_walk_mps3_sqrt_hz,
             unit.gyro_bias_walk_radps2_sqrt_hz, unit.accel_bias_sigma_mps2,    unit.gyro_bias_sigma_radps};
  if (unit.sample == examples::RigImu::Sample::mean_to_stamp) d.kind = imu::SampleKind::mean_to_stamp;
  d.start = d.rover.front().tag;
  auto track = examples::read_truth((folder / "truth.csv").string(), d.start);
  REQUIRE(track.ok());
  d.truth = [track = std::move(track.value())](GpsTime time) -> std::optional<DriveTruth> {
    const auto p = examples::truth_at(track, time);
    if (!p) return std::nullopt;
    return DriveTruth{*p, Eigen::Matrix3d::Identity()};
  };
  t.options = options_for(d);
  if (rig.value().gnss)
    for (const gnss::SignalCode& s : rig.value().gnss->signals) (void)t.options.rtk.differencing.selection.wanted.push_back(s);
  return t;
}

/// Every rover epoch has its solution, at once or when readings are there.
void check_available(const InertialDrive& d, const Run& run) {
  CHECK(run.errors == 0);
  CHECK(run.refused == 0);
  std::size_t next = 0;
  for (const RtkSolution& s : run.solutions) {
    CHECK(s.position_e_m.allFinite());
    if (next < d.rover.size() && s.tag == d.rover[next].tag) ++next;
  }
  CHECK(next == d.rover.size());
}

std::vector<double> horizontal_errors(const InertialDrive& d, const Run& run, double from_s) {
  std::vector<double> errors;
  for (const RtkSolution& s : run.solutions)
    if (const auto error = error_n_m(d, s); error && d.seconds(s.tag) >= from_s) errors.push_back(error->head<2>().norm());
  std::sort(errors.begin(), errors.end());
  return errors;
}

DriveScore report(const char* name, const InertialDrive& d, const Run& run) {
  const DriveScore s = score_of(d, run, kStandsUntilS);
  const std::vector<double> errors = horizontal_errors(d, run, kStandsUntilS);
  char line[300];
  std::snprintf(line, sizeof line,
                "%s: %d solutions, fix %.1f %% float %d dgnss %d spp %d dr %d; horizontal rms %.3f P50 %.3f P95 %.3f max %.3f, of fixed "
                "%.4f m, %d wrong; nees %.2f, %d alignments",
                name, s.solutions, s.fixed_percent(), s.by_status[1], s.by_status[2], s.by_status[3], s.by_status[4], s.rms_m(),
                errors[errors.size() / 2], errors[errors.size() * 95 / 100], s.max_m, s.fixed_rms_m(), s.wrong, s.mean_nees(),
                run.alignments);
  MESSAGE(line);
  std::map<std::string, int> unfixed;
  for (const RtkSolution& x : run.solutions)
    if (x.status != SolutionStatus::fix && d.seconds(x.tag) >= kStandsUntilS) ++unfixed[ambiguity::name_of(x.verdict)];
  std::string why = "not fixed:";
  for (const auto& [verdict, count] : unfixed) why += " " + verdict + " " + std::to_string(count);
  MESSAGE(why);
  return s;
}

}  // namespace

#define SEARVINS_REQUIRE_SHARED(shared)                           \
  const auto shared = shared_data();                              \
  if (!shared) {                                                  \
    MESSAGE("SKIPPED: no shared data (set SEARVINS_SHARED_DIR)"); \
    return;                                                       \
  }

TEST_CASE("twin a-clean with its inertial unit: every epoch answered, 97 % fixed, 3 cm") {
  SEARVINS_REQUIRE_SHARED(shared)
  const TwinDrive t = twin_drive(*shared, "a-clean");
  const Run run = run_all(t.drive, arrivals(t.drive), t.options);
  check_available(t.drive, run);
  const DriveScore s = report("a-clean", t.drive, run);
  CHECK(run.alignments == 1);
  CHECK(s.fixed_percent() >= 97);
  CHECK(s.rms_m() <= 0.03);
  CHECK(s.wrong == 0);
  CHECK(s.mean_nees() < 4);
}

TEST_CASE("twin a-urban with its inertial unit: every epoch answered, decimetres, no wrong fix") {
  SEARVINS_REQUIRE_SHARED(shared)
  const TwinDrive t = twin_drive(*shared, "a-urban");
  const Run run = run_all(t.drive, arrivals(t.drive), t.options);
  check_available(t.drive, run);
  const DriveScore s = report("a-urban", t.drive, run);
  CHECK(run.alignments == 1);
  CHECK(s.rms_m() <= 0.2);  // demanded: 1.6 m, and 20 m at the most
  CHECK(s.max_m <= 1.0);
  CHECK(s.wrong == 0);
  CHECK(s.mean_nees() < 8);
}
