// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <optional>

#include <searvins/io/rinex_common.hpp>
#include <searvins/io/rinex_epoch_line.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;

TEST_CASE("a civil epoch is valid exactly when the calendar has it") {
  test::for_all_seeds(300, [](test::Rng& rng) {
    io::CivilEpoch t{test::integer(rng, 1978, 2101), test::integer(rng, 0, 13),  test::integer(rng, 0, 32),
                     test::integer(rng, -1, 24),     test::integer(rng, -1, 60), 0};
    bool expected =
        t.year >= 1980 && t.year <= 2099 && t.month >= 1 && t.month <= 12 && t.hour >= 0 && t.hour < 24 && t.minute >= 0 && t.minute < 60;
    if (expected) {
      const CivilTime back =
          civil_from_gps(gps_from_civil({t.year, t.month, t.day, 0, 0, 0.0}));  // a day that does not exist comes back as another
      expected = back.day == t.day && back.month == t.month;
    }
    CHECK(t.valid() == expected);
  });
}

TEST_CASE("time scales: 14 s for BeiDou, leap seconds for UTC, also across the step of 2017") {
  const io::CivilEpoch before{2016, 12, 31, 23, 59, 59 * kNanosecondsPerSecond}, after{2017, 1, 1, 0, 0, 0};
  const auto lag = [](const io::CivilEpoch& t, io::TimeSystem s) {
    return (t.to_gps(s).ns - t.to_gps(io::TimeSystem::gps).ns) / kNanosecondsPerSecond;
  };
  CHECK(lag(before, io::TimeSystem::utc) == 17);
  CHECK(lag(after, io::TimeSystem::utc) == 18);
  CHECK(lag(after, io::TimeSystem::beidou) == 14);
  CHECK(io::full_year(80) == 1980);
  CHECK(io::full_year(79) == 2079);
  CHECK(io::full_year(5) == 2005);
  CHECK_FALSE(io::time_system_from_text("").has_value());
  CHECK(io::time_system_from_text("IRN") == io::TimeSystem::gps);
}

TEST_CASE("epoch lines written are read back to the 100 ns, in both shapes") {
  test::for_all_seeds(300, [](test::Rng& rng) {
    const GpsTime tag{gps_from_civil({1990, 1, 1, 0, 0, 0.0}).ns + 100LL * test::integer(rng, 0, 2'000'000'000) * 500'000};
    char rest[40];
    const int flag = test::integer(rng, 0, 6), count = test::integer(rng, 0, 999);
    std::snprintf(rest, sizeof rest, "  %d%3d", flag, count);
    for (const auto& e : {io::read_epoch_line_3("> " + test::civil_text(tag, false) + rest),
                          io::read_epoch_line_2(' ' + test::civil_text(tag, true) + rest)}) {
      REQUIRE(e.has_value());
      CHECK(e->dated);
      CHECK(e->civil.to_gps(io::TimeSystem::gps) == tag);
      CHECK(e->flag == flag);
      CHECK(e->count == count);
    }
  });
}

TEST_CASE("observation lines, satellite lists and header lines are no RINEX 2 epoch lines") {
  for (const char* line : {"  55923622.160    24767686.375    43647388.2424   24767684.8224", "                                G31G32", "",
                           "                    24767686.375", "     4    L1    C1    L2    P2", " 05  4  2  0  0  0.0000000",
                           " 05  4  2  0  0  0.0000000  7  1", " 05 13  2  0  0  0.0000000  0  1", "                            0  1"})
    CHECK_FALSE(io::read_epoch_line_2(line).has_value());
  CHECK(io::read_epoch_line_2("                            4  1").has_value());
  CHECK_FALSE(io::read_epoch_line_3("G07  20000000.000").has_value());
  CHECK_FALSE(io::read_epoch_line_3(">").has_value());
}
