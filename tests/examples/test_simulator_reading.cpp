// SPDX-License-Identifier: BSD-3-Clause
// The simulator's files as the library reads them, its ranges against the library's, and the command that writes them.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <searvins/gnss/range.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>

#include "command_runner.hpp"
#include "examples/simulator/dataset.hpp"
#include "examples/support/rig.hpp"
#include "simulated_files.hpp"

using namespace searvins;
using test::options_of;
using test::text_of;

TEST_CASE("simulated files: the library reads them without skipping a line") {
  const simulator::Simulation drive(options_of("urban", 60, 2));
  const simulator::Dataset set = simulator::make_dataset(drive, simulator::Layout::plain);
  const auto rover = io::read_rinex_observation_text(text_of(set, "rover.obs"));
  const auto base = io::read_rinex_observation_text(text_of(set, "base.obs"));
  const auto navigation = io::read_rinex_navigation_text(text_of(set, "nav.rnx"));
  REQUIRE(rover.ok());
  REQUIRE(base.ok());
  REQUIRE(navigation.ok());
  CHECK(rover.skipped.total() == 0);
  CHECK(base.skipped.total() == 0);
  CHECK(navigation.skipped.total() == 0);
  CHECK(rover.value.epochs.size() > 50);
  CHECK(base.value.epochs.size() == 61);
  int lost = 0, tracked = 0;
  for (const gnss::ObservationEpoch& epoch : rover.value.epochs)
    for (const gnss::SatelliteObservation& satellite : epoch.satellites)
      for (const gnss::SignalObservation& signal : satellite.signals) ++tracked, lost += signal.loss_of_lock ? 1 : 0;
  CHECK(tracked > 600);
  CHECK(lost > 20);

  for (const auto layout : {simulator::Layout::plain, simulator::Layout::texcup}) {
    const auto rig = examples::parse_rig(simulator::rig_text(drive, layout), "rig.json");
    REQUIRE(rig.ok());
    CHECK((*rig->base_position_e_m - drive.base_e_m()).norm() < 1e-6);
    CHECK(rig->gnss->signals.size() == 5);
    CHECK(rig->imu->R_b_raw(0, 0) == (layout == simulator::Layout::plain ? 1 : -1));
    CHECK(rig->lever_arm_b_m->y() == doctest::Approx(-0.517));
  }
}

TEST_CASE("simulated ranges: double differences agree with the library's to two millimetres") {
  simulator::SimulationOptions options = options_of("open", 120, 7);
  const simulator::Simulation drive(options);
  const simulator::Dataset set = simulator::make_dataset(drive, simulator::Layout::plain);
  const auto rover = io::read_rinex_observation_text(text_of(set, "rover.obs"));
  const auto base = io::read_rinex_observation_text(text_of(set, "base.obs"));
  const auto navigation = io::read_rinex_navigation_text(text_of(set, "nav.rnx"));
  gnss::EphemerisStore<64> store;
  for (const gnss::Ephemeris& e : navigation.value.ephemerides) (void)store.insert(e);
  int compared = 0;
  double worst_m = 0;
  for (std::size_t k = 0; k < rover.value.epochs.size(); k += 5) {
    const gnss::ObservationEpoch &here = rover.value.epochs[k], &there = base.value.epochs[k];
    REQUIRE(here.tag == there.tag);
    const double tag_s = seconds_between(options.start, here.tag);
    const double t_rover_s = drive.rover_clock().gps_time_s(tag_s), t_base_s = drive.base_clock().gps_time_s(tag_s);
    const Eigen::Vector3d p_e_m = drive.vehicle().antenna_e_m(t_rover_s);
    double pivot_m = 0;
    bool has_pivot = false;
    for (const gnss::SatelliteObservation& satellite : here.satellites) {
      const gnss::SatelliteObservation* same = there.find(satellite.satellite);
      if (!same) continue;
      const auto at_rover = gnss::transmission_from_code(store, satellite.satellite, here.tag, satellite.signals.front().code_m);
      const auto at_base = gnss::transmission_from_code(store, satellite.satellite, there.tag, same->signals.front().code_m);
      REQUIRE(at_rover);
      REQUIRE(at_base);
      const double library_m =
          gnss::range_m(p_e_m, at_rover->state.position_e_m) - gnss::range_m(drive.base_e_m(), at_base->state.position_e_m);
      const auto orbit = std::find_if(drive.orbits().begin(), drive.orbits().end(), [&](const simulator::Orbit& o) {
        return o.system == gnss::letter_of(satellite.satellite.constellation) && o.number == satellite.satellite.number;
      });
      REQUIRE(orbit != drive.orbits().end());
      const double simulated_m =
          simulator::flight_of(*orbit, p_e_m, t_rover_s).length_m - simulator::flight_of(*orbit, drive.base_e_m(), t_base_s).length_m;
      if (!has_pivot) pivot_m = simulated_m - library_m, has_pivot = true;
      worst_m = std::max(worst_m, std::abs(simulated_m - library_m - pivot_m));
      ++compared;
    }
  }
  CHECK(compared > 300);
  CHECK(worst_m < 2e-3);
  MESSAGE(compared, " ranges, the worst double difference is off by ", 1000 * worst_m, " mm");
}

TEST_CASE("simulated orbits: a later record of a satellite flies the same orbit, over the end of the week, too") {
  simulator::Random random(9);
  const GpsTime late = GpsTime::from_week_sow(2370, 604800 - 5400);
  for (const simulator::Orbit& o : simulator::make_satellites(late, random)) {
    const simulator::Orbit later = simulator::later_record(o, 7200);
    for (const double t_s : {0.0, 4000.0, 9000.0}) {
      CHECK((simulator::satellite_position_e_m(o, t_s) - simulator::satellite_position_e_m(later, t_s)).norm() < 1e-3);
      CHECK(std::abs(simulator::satellite_clock_s(o, t_s) - simulator::satellite_clock_s(later, t_s)) < 1e-13);
    }
  }
}

#ifdef SEARVINS_COMMAND
TEST_CASE("simulate: writes the files of each layout, says what is in them, and refuses what it cannot do") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "searvins_test_simulate";
  std::filesystem::remove_all(folder);
  const auto plain = test::run("simulate --duration 20 --profile light --out " + (folder / "plain").string());
  CHECK(plain.exit_code == 0);
  CHECK(test::has(plain, "profile light, seed 1, 20 s"));
  for (const char* name : {"rover.obs", "base.obs", "nav.rnx", "imu.csv", "truth.csv", "rig.json", "stereo_tracks.csv", "labels.csv"})
    CHECK_MESSAGE(std::filesystem::file_size(folder / "plain" / name) > 500, name);
  CHECK(std::filesystem::exists(folder / "plain/streets.csv"));
  const std::string route = (folder / "plain/truth.csv").string(), nav = (folder / "plain/nav.rnx").string();
  const auto again = test::run("simulate --layout texcup --route " + route + " --nav " + nav + " --out " + (folder / "again").string());
  CHECK(again.exit_code == 0);
  CHECK(std::filesystem::exists(folder / "again/ground_truth.log"));
  CHECK(test::has(again, "GPS week 2370, 274799"));
  CHECK(test::run("simulate --duration 20").exit_code == 2);
  CHECK(test::run("simulate --profile jungle --out x").exit_code == 2);
  CHECK(test::run("simulate --route /nowhere.csv --out " + folder.string()).exit_code == 3);
  CHECK(test::run("simulate --nav " + route + " --out " + folder.string()).exit_code == 3);
  std::filesystem::remove_all(folder);
}
#endif  // SEARVINS_COMMAND
