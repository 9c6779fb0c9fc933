// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <searvins/io/rinex_info.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;

namespace {

io::ObservationFileInfo scan(const std::string& text) {
  io::RinexObservationReader reader;
  REQUIRE(reader.open_text(text));
  return io::scan_observations(reader);
}

}  // namespace

TEST_CASE("an info scan counts what was written: satellites, signals, quantities, slips, C/N0") {
  test::for_all_seeds(20, [](test::Rng& rng) {
    const test::RinexTextPlan plan{
        3.04, {test::signal("G1C"), test::signal("G2W"), test::signal("E1C"), test::signal("C2I"), test::signal("J1C")}};
    std::string text = test::header_3(plan);
    long satellites = 0, signals = 0, phases = 0, slips = 0, cn0_count = 0;
    double cn0 = 0;
    std::size_t least = 1000, most = 0;
    const int n = test::integer(rng, 2, 20);
    for (int i = 0; i < n; ++i) {
      const gnss::ObservationEpoch epoch =
          test::random_epoch(rng, plan, GpsTime{gps_from_civil({2024, 6, 24, 8, 20, 0.0}).ns + i * 2 * kNanosecondsPerSecond});
      text += test::epoch_3(plan, epoch);
      satellites += static_cast<long>(epoch.satellites.size());
      least = std::min(least, epoch.satellites.size()), most = std::max(most, epoch.satellites.size());
      for (const auto& satellite : epoch.satellites)
        for (const auto& s : satellite.signals) {
          ++signals;
          phases += s.has_phase() ? 1 : 0;
          slips += s.loss_of_lock ? 1 : 0;
          if (s.has_cn0()) cn0 += s.cn0_dbhz, ++cn0_count;
        }
    }
    const io::ObservationFileInfo info = scan(text);
    long got_satellites = 0, got_signals = 0, got_phases = 0, got_slips = 0, got_cn0 = 0;
    double sum = 0;
    for (std::size_t c = 0; c < gnss::kConstellations; ++c) {
      got_satellites += info.constellations[c].observations;
      for (const io::SignalCount& s : info.constellations[c].signals) {
        CHECK(s.signal.constellation == static_cast<gnss::Constellation>(c));
        got_signals += s.observations, got_phases += s.phase, got_slips += s.loss_of_lock, got_cn0 += s.cn0;
        sum += s.mean_cn0_dbhz * static_cast<double>(s.cn0);
      }
    }
    CHECK(got_satellites == satellites);
    CHECK(got_signals == signals);
    CHECK(got_phases == phases);
    CHECK(got_slips == slips);
    CHECK(got_cn0 == cn0_count);
    CHECK(sum == doctest::Approx(cn0));
    CHECK(info.least_satellites == least);
    CHECK(info.most_satellites == most);
    CHECK(info.interval_s == 2);
    CHECK(info.gap_count == 0);
  });
}

TEST_CASE("gaps are found where tags are further apart than the interval") {
  const test::RinexTextPlan plan{3.04, {test::signal("G1C")}};
  std::string text = test::header_3(plan);
  const GpsTime start = gps_from_civil({2024, 6, 24, 8, 20, 0.0});
  for (const int second : {0, 1, 2, 3, 10, 11, 12, 14, 15})
    text += test::formatted("> 2024 06 24 08 20 %02.0f.0000000  0  1\n", second) + "G07" + test::value_cell(2e7) + '\n';
  const io::ObservationFileInfo info = scan(text);
  CHECK(info.interval_s == 1);
  CHECK(info.gap_count == 2);
  REQUIRE(info.gaps.size() == 2);
  CHECK(info.gaps[0].from == start.plus_seconds(3));
  CHECK(info.gaps[0].to == start.plus_seconds(10));
  CHECK(info.constellations[0].satellites.count() == 1);
  CHECK(info.constellations[0].satellites.test(7));
}

TEST_CASE("rinex_info tells files apart and passes errors on") {
  const auto missing = io::rinex_info("/no/such/file");
  REQUIRE(missing.error);
  CHECK(missing.error->message == "no such file");
  const auto path = std::filesystem::temp_directory_path() / "searvins_test_rinex_info.bin";
  const auto with = [&](const std::string& content) {
    std::ofstream{path, std::ios::binary} << content;
    return io::rinex_info(path);
  };
  const auto packed = with("\x1f\x8b\x08");
  REQUIRE(packed.error);
  CHECK(packed.error->hint.find("gunzip") != std::string::npos);
  const auto table = with("t,gx,gy,gz,ax,ay,az\n");
  CHECK_FALSE(table.error.has_value());
  CHECK(table.value.sniffed.kind == io::FileKind::imu_csv);
  const auto headless = with(test::header_line("     3.04           OBSERVATION DATA    M", "RINEX VERSION / TYPE"));
  REQUIRE(headless.error);
  CHECK(headless.value.sniffed.kind == io::FileKind::rinex_observation);
  const auto navigation =
      with(test::header_line("     3.04           N: GNSS NAV DATA    M", "RINEX VERSION / TYPE") + test::header_line("", "END OF HEADER"));
  CHECK(navigation.error.has_value());
  CHECK(navigation.value.navigation.has_value());
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
}
