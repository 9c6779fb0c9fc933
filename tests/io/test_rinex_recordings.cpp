// SPDX-License-Identifier: BSD-3-Clause
// The recordings of real receivers: counts of epochs, satellites and signals as an independent count over the columns gives them.
#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <string>

#include <searvins/io/rinex_info.hpp>

#include "support/rinex_text.hpp"
#include "support/shared_data.hpp"

using namespace searvins;

namespace {

struct Expected {
  const char* path;
  long epochs, satellites, signals, slips;  // slips: odd LLI digits, with or without a phase; -1: RINEX 2, not counted
  double interval_s;
};

constexpr Expected kRecordings[] = {
    {"real/boulder_walk_2025/rover.obs", 536, 13677, 32097, 1278, 0.25},
    {"real/kamakura_drive_2021/base.obs", 180, 3240, 11520, 4, 1},
    {"real/kamakura_drive_2021/rover.obs", 180, 3516, 13343, 43, 1},
    {"real/nagoya_static_2024/base.obs", 301, 14342, 38822, 8, 1},
    {"real/nagoya_static_2024/rover.obs", 301, 14695, 40273, 10, 1},
    {"real/sf_static_2017/base.obs", 439, 3951, 6585, 3, 1},
    {"real/sf_static_2017/rover.obs", 400, 3582, 5893, 6, 1},
    {"real/spirent_rose_iono-Klob/base.obs", 601, 12020, 60100, 0, 1},
    {"real/spirent_rose_iono-Klob/rover.obs", 601, 12020, 60100, 0, 1},
    {"real/tokyo_urban_2023/rover.obs", 251, 6572, 10349, 3912, 1},
    {"real/geonet_static_2005/07590920.05o", 120, 948, 1872, -1, 30},
    {"real/geonet_static_2005/30400920.05o", 120, 1039, 2075, -1, 30},
    {"twin/a-clean/base.obs", 1139, 29443, 47496, 0, 1},
    {"twin/a-clean/rover.obs", 1139, 29445, 47500, 42, 1},
    {"twin/a-urban/base.obs", 1139, 29443, 47496, 0, 1},
    {"twin/a-urban/rover.obs", 1139, 25846, 39579, 1834, 1},
};

struct ExpectedNavigation {
  const char* path;
  std::array<long, 6> messages;  ///< GPS, QZSS, I/NAV, F/NAV, D1, D2
  long unhealthy;
  double alpha0;
};

constexpr ExpectedNavigation kNavigation[] = {
    {"real/boulder_walk_2025/rover.nav", {4, 0, 5, 11, 8, 0}, 3, 0},
    {"real/kamakura_drive_2021/nav.rnx", {49, 19, 129, 124, 0, 0}, 11, 8.3819e-9},
    {"real/nagoya_static_2024/base.nav", {13, 3, 39, 28, 24, 8}, 10, 1.8626e-8},
    {"real/sf_static_2017/rover.nav", {10, 0, 0, 0, 0, 0}, 0, 0},
    {"real/tokyo_urban_2023/rover.nav", {37, 16, 101, 0, 39, 24}, 1, 1.77e-8},
    {"real/geonet_static_2005/07590920.05n", {162, 0, 0, 0, 0, 0}, 0, 1.118e-8},
    {"real/geonet_static_2005/30400920.05n", {164, 0, 0, 0, 0, 0}, 0, 1.118e-8},
    {"real/spirent_rose_iono-Klob/nav_gps.rnx", {31, 0, 0, 0, 0, 0}, 0, 4.6566e-9},
    {"real/spirent_rose_iono-Klob/nav_gal.rnx", {0, 0, 0, 26, 0, 0}, 0, 0},
    {"twin/a-clean/base.nav", {40, 0, 300, 0, 44, 19}, 0, 1.77e-8},
};

}  // namespace

TEST_CASE("every recorded observation file is read whole: no epoch skipped, satellites and signals as counted independently") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  for (const Expected& expected : kRecordings) {
    CAPTURE(expected.path);
    const auto info = io::rinex_info(*shared / "data" / expected.path);
    CHECK_FALSE(info.error.has_value());
    REQUIRE(info.value.observation);
    const io::ObservationFileInfo& o = *info.value.observation;
    CHECK(o.summary.epochs == expected.epochs);
    CHECK(o.summary.epochs_skipped == 0);
    CHECK(o.interval_s == doctest::Approx(expected.interval_s));
    long satellites = 0, signals = 0, slips = 0;
    for (const io::ConstellationCount& c : o.constellations) {
      satellites += c.observations;
      for (const io::SignalCount& s : c.signals) signals += s.observations, slips += s.loss_of_lock;
    }
    CHECK(satellites == expected.satellites);
    CHECK(signals == expected.signals);
    if (expected.slips >= 0) CHECK(slips == expected.slips);
    CHECK(o.mean_satellites == doctest::Approx(static_cast<double>(satellites) / static_cast<double>(expected.epochs)));
  }
}

TEST_CASE("kamakura, nagoya, tokyo, geonet: spot values of the files") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto read = [&](const char* path) { return io::read_rinex_observation(*shared / "data/real" / path); };
  const auto kamakura = read("kamakura_drive_2021/rover.obs");
  const auto* e07 = kamakura.value.epochs[0].find({gnss::Constellation::galileo, 7});
  REQUIRE(e07);
  REQUIRE(e07->signals.size() == 4);
  CHECK(e07->find(test::signal("E1C"))->code_m == 24441483.004);
  CHECK(e07->find(test::signal("E1C"))->phase_cycles == 128440856.815);
  CHECK(e07->find(test::signal("E8Q"))->cn0_dbhz == 54.781);
  CHECK_FALSE(e07->find(test::signal("E1C"))->has_doppler());
  CHECK(kamakura.value.epochs[0].tag == gps_from_civil({2021, 9, 22, 6, 30, 0.0}));

  const auto nagoya = read("nagoya_static_2024/rover.obs");
  const auto* c01 = nagoya.value.epochs[0].find({gnss::Constellation::beidou, 1});
  REQUIRE(c01);
  CHECK(c01->find(test::signal("C2I"))->code_m == 36842422.530);  // X1 keeps its column
  CHECK(c01->find(test::signal("C2I"))->doppler_hz == 161.587);
  CHECK(nagoya.skipped.count("GLONASS") > 0);
  CHECK(nagoya.skipped.count("observation type X1") == 4);

  const auto tokyo = read("tokyo_urban_2023/rover.obs");
  CHECK_FALSE(tokyo.value.header.approx_position_e_m.has_value());
  CHECK(tokyo.value.epochs[0].tag.ns % kNanosecondsPerSecond == 6'000'000);
  CHECK(tokyo.value.epochs[0].find({gnss::Constellation::gps, 3})->find(test::signal("G2L"))->half_cycle);

  const auto geonet = read("geonet_static_2005/07590920.05o");
  const auto* g03 = geonet.value.epochs[0].find({gnss::Constellation::gps, 3});
  REQUIRE(g03);
  CHECK(g03->find(test::signal("G1C"))->code_m == 24767686.375);
  CHECK(g03->find(test::signal("G2W"))->phase_cycles == 43647388.242);
  CHECK(g03->find(test::signal("G2W"))->code_m == 24767684.822);
  CHECK_FALSE(g03->find(test::signal("G2W"))->loss_of_lock);  // LLI 4: anti-spoofing
  CHECK(geonet.value.summary.flags[4] == 3);
}

TEST_CASE("every recorded navigation file gives its records by message, with health and ionosphere") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  for (const ExpectedNavigation& expected : kNavigation) {
    CAPTURE(expected.path);
    const auto parsed = io::read_rinex_navigation(*shared / "data" / expected.path);
    CHECK_FALSE(parsed.error.has_value());
    const io::NavigationFileInfo info = io::summarise_navigation(parsed.value);
    CHECK(info.messages == expected.messages);
    CHECK(info.unhealthy == expected.unhealthy);
    CHECK(info.ionosphere.alpha[0] == expected.alpha0);
    CHECK(parsed.skipped.count("missing or not readable") == 0);
    CHECK(parsed.skipped.count("week number") == 0);
    for (const gnss::Ephemeris& e : parsed.value.ephemerides) {
      CHECK(std::abs(seconds_between(e.toc, e.toe)) <= 7200);
      CHECK(e.sqrt_a > (e.satellite.constellation == gnss::Constellation::gps ? 5100 : 5200));
    }
  }
}

TEST_CASE("a 3.9 MB file is read in well under the time that matters") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  io::RinexObservationReader reader;
  gnss::ObservationEpoch epoch;
  const auto start = std::chrono::steady_clock::now();
  REQUIRE(reader.open(*shared / "data/real/spirent_rose_iono-Klob/rover.obs"));
  while (reader.next(epoch)) {
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  MESSAGE("read in " << seconds * 1e3 << " ms");
  CHECK(seconds < 5.0);  // about 0.03 s optimised; sanitizers and a loaded machine take longer
}
