// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/atmosphere.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/single_point.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>
#include <searvins/io/text_reader.hpp>

#include "examples/simulator/recording.hpp"
#include "examples/support/angle_units.hpp"
#include "examples/support/truth.hpp"

using namespace searvins;

namespace {

using searvins::examples::kRadPerDeg;

std::filesystem::path folder() { return std::filesystem::path{SEARVINS_SOURCE_DIR} / "examples/data/synthetic_drive"; }

/// The scene and the recording as the library reads it, once for all tests.
struct Bundle {
  simulator::BundledScene scene{simulator::kBundledSeed};
  io::Parsed<io::RinexObservationFile> rover = io::read_rinex_observation(folder() / "rover.obs");
  io::Parsed<io::RinexObservationFile> base = io::read_rinex_observation(folder() / "base.obs");
  io::Parsed<io::RinexNavigationFile> navigation = io::read_rinex_navigation(folder() / "nav.rnx");
  gnss::EphemerisStore<64> store{};

  Bundle() {
    for (const gnss::Ephemeris& e : navigation.value.ephemerides) (void)store.insert(e);
    store.ionosphere = navigation.value.ionosphere;
  }
  [[nodiscard]] double seconds(GpsTime t) const { return seconds_between(scene.start, t); }
};

const Bundle& bundle() {
  static const std::unique_ptr<const Bundle> one = std::make_unique<Bundle>();
  return *one;
}

bool open_sky(double tag_s) { return tag_s < simulator::kStreetBeginS - 1 || tag_s > simulator::kBridgeEndS; }

/// Numbers of two texts within a tolerance, everything else equal; the first offset that differs, or npos.
std::size_t first_difference(const std::string& a, const std::string& b, double tolerance) {
  std::size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (std::isdigit(static_cast<unsigned char>(a[i])) && std::isdigit(static_cast<unsigned char>(b[k]))) {
      char *a_end = nullptr, *b_end = nullptr;
      const double x = std::strtod(a.c_str() + i, &a_end), y = std::strtod(b.c_str() + k, &b_end);
      if (std::abs(x - y) > tolerance * std::max(1.0, std::abs(y) * 1e-9)) return i;
      i = static_cast<std::size_t>(a_end - a.c_str()), k = static_cast<std::size_t>(b_end - b.c_str());
      continue;
    }
    if (a[i] != b[k]) return i;
    ++i, ++k;
  }
  return i == a.size() && k == b.size() ? std::string::npos : i;
}

std::string text_of(const char* name) {
  const auto text = io::read_text_file((folder() / name).string());
  REQUIRE_MESSAGE(text.ok(), name);
  return *text;
}

/// Rover minus base of one signal's phase, less the modelled difference, in cycles; false where anything is missing.
bool single_difference(const Bundle& b, const gnss::ObservationEpoch& rover, const gnss::ObservationEpoch& base,
                       const Eigen::Vector3d& p_e_m, const gnss::SatelliteObservation& satellite, const gnss::SignalObservation& signal,
                       double& cycles, double& elevation_rad) {
  const gnss::SatelliteObservation* there = base.find(satellite.satellite);
  const gnss::SignalObservation* other = there ? there->find(signal.signal) : nullptr;
  if (!other || signal.half_cycle) return false;
  const auto at_rover = gnss::transmission_from_code(b.store, satellite.satellite, rover.tag, signal.code_m);
  const auto at_base = gnss::transmission_from_code(b.store, satellite.satellite, base.tag, other->code_m);
  if (!at_rover || !at_base) return false;
  const Eigen::Vector3d& q_e_m = b.scene.base_e_m;
  const double e1 = geodesy::azimuth_elevation(p_e_m, at_rover->state.position_e_m).elevation_rad;
  const double e2 = geodesy::azimuth_elevation(q_e_m, at_base->state.position_e_m).elevation_rad;
  const double model_m = gnss::range_m(p_e_m, at_rover->state.position_e_m) - gnss::range_m(q_e_m, at_base->state.position_e_m) -
                         gnss::kSpeedOfLightMps * (at_rover->state.clock_s - at_base->state.clock_s) +
                         gnss::troposphere_difference_m(geodesy::geodetic_from_ecef(p_e_m), e1, geodesy::geodetic_from_ecef(q_e_m), e2);
  cycles = signal.phase_cycles - other->phase_cycles - model_m / gnss::wavelength_m(signal.signal);
  elevation_rad = e1;
  return true;
}

}  // namespace

TEST_CASE("simulator: the bundled recording is what the generator makes of its seed") {
  const simulator::Recording made = simulator::make_recording(simulator::kBundledSeed);
  // Other compilers may round the last digit of an observation (0.001) or of the truth (0.0001) the other way.
  CHECK(first_difference(made.rover_obs, text_of("rover.obs"), 0.0021) == std::string::npos);
  CHECK(first_difference(made.base_obs, text_of("base.obs"), 0.0021) == std::string::npos);
  CHECK(first_difference(made.truth_csv, text_of("truth.csv"), 0.00021) == std::string::npos);
  CHECK(made.nav_rnx == text_of("nav.rnx"));
  CHECK(made.rover_obs.size() + made.base_obs.size() + made.nav_rnx.size() + made.truth_csv.size() < 1'000'000);
  const simulator::Recording other = simulator::make_recording(simulator::kBundledSeed + 1);
  CHECK(first_difference(other.rover_obs, made.rover_obs, 0.0021) != std::string::npos);
}

TEST_CASE("simulator: the library reads the recording without skipping a line") {
  const Bundle& b = bundle();
  REQUIRE(b.rover.ok());
  REQUIRE(b.base.ok());
  REQUIRE(b.navigation.ok());
  CHECK(b.rover.skipped.total() == 0);
  CHECK(b.base.skipped.total() == 0);
  CHECK(b.navigation.skipped.total() == 0);
  CHECK(b.rover.value.epochs.size() == simulator::kEpochs - 3);  // the bridge
  CHECK(b.base.value.epochs.size() == simulator::kEpochs);
  CHECK(b.navigation.value.ephemerides.size() == simulator::risen(b.scene).size());
  CHECK(b.store.ionosphere.present());
  const auto truth = examples::read_truth((folder() / "truth.csv").string());
  REQUIRE(truth.ok());
  CHECK(truth->points.size() == 5 * simulator::kEpochs + 6);
  for (const double t_s : {0.0, 15.02, 61.0, 119.0}) {
    const auto p = examples::truth_at(*truth, b.scene.start.plus_seconds(t_s));
    REQUIRE(p);
    CHECK((*p - b.scene.rover_e_m(t_s)).norm() < 0.01);
  }
}

TEST_CASE("simulator: orbits and clocks agree with the library's to a millimetre") {
  const Bundle& b = bundle();
  int compared = 0;
  for (const gnss::Ephemeris& e : b.navigation.value.ephemerides)
    for (const simulator::Orbit& o : b.scene.orbits) {
      if (o.system != gnss::letter_of(e.satellite.constellation) || o.number != e.satellite.number) continue;
      for (double t_s = -3600; t_s <= 3600; t_s += 400) {
        const auto state = gnss::satellite_state(e, b.scene.start.plus_seconds(t_s));
        REQUIRE(state.ok());
        CHECK((state->position_e_m - simulator::satellite_position_e_m(o, t_s)).norm() < 1e-3);
        CHECK(std::abs(state->clock_s - simulator::satellite_clock_s(o, t_s)) * gnss::kSpeedOfLightMps < 1e-3);
        ++compared;
      }
    }
  CHECK(compared == 19 * static_cast<int>(b.navigation.value.ephemerides.size()));
}

TEST_CASE("simulator: single points in the open are within a few metres, and the clock is the simulated one") {
  const Bundle& b = bundle();
  int solved = 0;
  for (const gnss::ObservationEpoch& epoch : b.rover.value.epochs) {
    const double tag_s = b.seconds(epoch.tag);
    if (!open_sky(tag_s)) continue;
    const auto s = gnss::solve_single_point(epoch, b.store);
    REQUIRE(s.ok());
    const double t_s = b.scene.rover_clock.gps_time_s(tag_s);
    CHECK((s->position_e_m - b.scene.rover_e_m(t_s)).norm() < 6);
    CHECK(std::abs(s->clock_s[0] - (tag_s - t_s)) * gnss::kSpeedOfLightMps < 8);
    ++solved;
  }
  CHECK(solved > 70);
}

TEST_CASE("simulator: double differences at the truth are integers in the open") {
  const Bundle& b = bundle();
  int compared = 0;
  double worst_cycles = 0;
  for (const gnss::ObservationEpoch& rover : b.rover.value.epochs) {
    const double tag_s = b.seconds(rover.tag);
    if (!open_sky(tag_s)) continue;
    const gnss::ObservationEpoch& base = b.base.value.epochs[static_cast<std::size_t>(std::llround(tag_s))];
    REQUIRE(base.tag == rover.tag);
    const Eigen::Vector3d p_e_m = b.scene.rover_e_m(b.scene.rover_clock.gps_time_s(tag_s));
    for (const simulator::Signal& type : simulator::kSignals) {
      double pivot = 0, pivot_elevation = 0;
      for (int pass = 0; pass < 2; ++pass)  // first the highest satellite, then the others against it
        for (const gnss::SatelliteObservation& satellite : rover.satellites) {
          const char text[] = {type.system, type.code[0], type.code[1]};
          gnss::SignalCode code;
          REQUIRE(gnss::signal_from_text(text, 3, code));
          const gnss::SignalObservation* signal = satellite.find(code);
          double cycles = 0, elevation = 0;
          if (!signal || !single_difference(b, rover, base, p_e_m, satellite, *signal, cycles, elevation)) continue;
          if (pass == 0 && elevation > pivot_elevation) pivot = cycles, pivot_elevation = elevation;
          if (pass == 0 || elevation < 20 * kRadPerDeg) continue;
          worst_cycles = std::max(worst_cycles, std::abs(cycles - pivot - std::round(cycles - pivot)));
          ++compared;
        }
    }
  }
  CHECK(compared > 1500);
  CHECK(worst_cycles < 0.1);
  CHECK(worst_cycles > 0.01);  // there is noise
  MESSAGE(compared, " double differences, the worst ", worst_cycles, " cycles from an integer");
}

TEST_CASE("simulator: a street blocks, reflects or lets pass") {
  const simulator::Street street{0, 10, 5, 5};  // along north, walls at 63 degrees to the east and west
  CHECK(street.path({90 * kRadPerDeg, 70 * kRadPerDeg}) == simulator::Path::direct);
  CHECK(street.path({0, 5 * kRadPerDeg}) == simulator::Path::direct);
  CHECK(street.path({90 * kRadPerDeg, 50 * kRadPerDeg}) == simulator::Path::reflected);
  CHECK(street.path({90 * kRadPerDeg, 20 * kRadPerDeg}) == simulator::Path::blocked);
  // The mirror image of the antenna behind the western wall lies 10 m to the west: the way from the east is longer by 10 m cos(el).
  CHECK(street.extra_m({90 * kRadPerDeg, 50 * kRadPerDeg}) == doctest::Approx(10 * std::cos(50 * kRadPerDeg)));
}
