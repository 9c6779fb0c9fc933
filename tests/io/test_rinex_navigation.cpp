// SPDX-License-Identifier: BSD-3-Clause
// The navigation reader: random records come back from RINEX 2, 3 and 4; weeks, health, messages and ionosphere as the format means
// them; bad records cost themselves only.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <searvins/io/rinex_navigation.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;
using gnss::NavigationMessage;
using test::header_line;

namespace {

/// The numbers of a record as they are written.
struct Numbers {
  std::string name{"G05"};
  GpsTime clock_date{gps_from_civil({2024, 6, 24, 10, 0, 0.0})};  ///< reading of the system's clock
  std::array<double, 3> clock{-1.774e-4, -1.36e-12, 0};
  std::array<std::array<double, 4>, 7> orbit{{{72, -98.25, 4.293e-9, 1.7148},
                                              {-5.29e-6, 5.9276e-3, 1.83e-6, 5153.6356},
                                              {122400, 3.35e-8, 2.5209, -5.77e-8},
                                              {0.9719, 353.625, 1.2733, -8.275e-9},
                                              {-2.61e-10, 1, 2320, 0},
                                              {2, 0, -1.07e-8, 72},
                                              {115218, 4, 0, 0}}};
};

std::string d19(double v) {
  std::string text = test::formatted("%19.12e", v);
  text[text.find('e')] = 'D';
  return text;
}

std::string record(const Numbers& n, int version) {
  const bool old = version == 2;
  char head[64];
  const CivilTime c = civil_from_gps(n.clock_date);
  if (old)
    std::snprintf(head, sizeof head, "%2s %02d %2d %2d %2d %2d%5.1f", n.name.substr(1).c_str(), c.year % 100, c.month, c.day, c.hour,
                  c.minute, c.second);
  else
    std::snprintf(head, sizeof head, "%s %04d %02d %02d %02d %02d %02d", n.name.c_str(), c.year, c.month, c.day, c.hour, c.minute,
                  static_cast<int>(c.second));
  std::string text = head;
  for (const double v : n.clock) text += d19(v);
  text += '\n';
  for (const auto& row : n.orbit) {
    text += std::string(old ? 3 : 4, ' ');
    for (const double v : row) text += d19(v);
    text += '\n';
  }
  return text;
}

std::string nav_header(const char* version, const std::string& records = "") {
  return header_line(std::string{"     "} + version + "           N: GNSS NAV DATA    M: MIXED", "RINEX VERSION / TYPE") + records +
         header_line("", "END OF HEADER");
}

auto read(const std::string& text) { return io::read_rinex_navigation_text(text, "base.nav"); }

/// The one record of a RINEX 3 text.
gnss::Ephemeris only(const Numbers& n) {
  const auto parsed = read(nav_header("3.04") + record(n, 3));
  REQUIRE(parsed.value.ephemerides.size() == 1);
  return parsed.value.ephemerides[0];
}

Numbers satellite(const char* name, double sqrt_a = 5440.6) {
  Numbers n;
  n.name = name;
  n.orbit[1][3] = sqrt_a;
  return n;
}

Numbers random_numbers(test::Rng& rng) {
  Numbers n;
  const char letters[] = "GECJ";
  const int system = test::integer(rng, 0, 3);
  const gnss::SatelliteId id{static_cast<gnss::Constellation>(system),
                             static_cast<std::uint8_t>(test::integer(rng, 1, system == 3 ? 9 : 32))};
  n.name = test::satellite_text(id);
  n.name[0] = letters[system];
  n.clock_date = GpsTime{gps_from_civil({2024, 1, 1, 0, 0, 0.0}).ns + 16LL * kNanosecondsPerSecond * test::integer(rng, 0, 2'000'000)};
  n.clock = {test::uniform(rng, -1e-3, 1e-3), test::uniform(rng, -1e-10, 1e-10), 0};
  const auto angle = [&] { return test::uniform(rng, -3.14, 3.14); };
  const double week = static_cast<double>(n.clock_date.week() - (system == 2 ? kBeidouWeekOffset : 0));
  const double source = system == 1 ? 517 : 1;
  n.orbit = {
      {{static_cast<double>(test::integer(rng, 0, 255)), test::uniform(rng, -300, 300), test::uniform(rng, 0, 6e-9), angle()},
       {test::uniform(rng, -1e-5, 1e-5), test::uniform(rng, 0, 0.2), test::uniform(rng, -1e-5, 1e-5), test::uniform(rng, 5100, 6500)},
       {n.clock_date.sow(), test::uniform(rng, -1e-7, 1e-7), angle(), test::uniform(rng, -1e-7, 1e-7)},
       {test::uniform(rng, 0, 1), test::uniform(rng, -400, 400), angle(), test::uniform(rng, -1e-8, 0)},
       {test::uniform(rng, -1e-9, 1e-9), source, week, 0},
       {test::uniform(rng, 1, 10), 0, test::uniform(rng, -1e-8, 1e-8), test::uniform(rng, -1e-8, 1e-8)},
       {n.clock_date.sow(), 4, 0, 0}}};
  return n;
}

bool near(double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); }

}  // namespace

TEST_CASE("random records come back from RINEX 3 and 4, and GPS ones from RINEX 2") {
  test::for_all_seeds(200, [](test::Rng& rng) {
    const Numbers n = random_numbers(rng);
    const char letter = n.name[0];
    const bool geostationary = letter == 'C' && n.name[1] == '0' && n.name[2] <= '5';
    const char* message = letter == 'G' || letter == 'J' ? "LNAV" : letter == 'E' ? "INAV" : geostationary ? "D2" : "D1";
    std::vector<std::string> texts = {nav_header("3.04") + record(n, 3),
                                      nav_header("4.01") + "> EPH " + n.name + ' ' + message + '\n' + record(n, 3)};
    if (letter == 'G') texts.push_back(nav_header("2.10") + record(n, 2));
    for (const std::string& text : texts) {
      const auto parsed = read(text);
      REQUIRE(parsed.ok());
      CHECK(parsed.skipped.total() == 0);
      REQUIRE(parsed.value.ephemerides.size() == 1);
      const gnss::Ephemeris& e = parsed.value.ephemerides[0];
      const GpsTime expected{n.clock_date.ns + (letter == 'C' ? 14 * kNanosecondsPerSecond : 0)};
      CHECK(e.toc == expected);
      CHECK(std::abs(e.toe.ns - expected.ns) <= 1000);
      CHECK(e.transmitted == e.toe);
      CHECK(test::satellite_text(e.satellite) == n.name);
      CHECK(e.issue == static_cast<std::uint32_t>(n.orbit[0][0]));
      CHECK(e.health == 0);
      const double read_back[] = {
          e.af0,    e.af1, e.crs, e.delta_n, e.m0,    e.cuc,       e.eccentricity, e.cus,        e.sqrt_a,          e.cic,
          e.omega0, e.cis, e.i0,  e.crc,     e.omega, e.omega_dot, e.i_dot,        e.accuracy_m, e.group_delay_s[0]};
      const auto& o = n.orbit;
      const double written[] = {n.clock[0], n.clock[1], o[0][1], o[0][2], o[0][3], o[1][0], o[1][1], o[1][2], o[1][3], o[2][1],
                                o[2][2],    o[2][3],    o[3][0], o[3][1], o[3][2], o[3][3], o[4][0], o[5][0], o[5][2]};
      for (std::size_t i = 0; i < std::size(written); ++i) CHECK(near(read_back[i], written[i]));
      CHECK(near(e.group_delay_s[1], letter == 'E' || letter == 'C' ? o[5][3] : 0.0));
    }
  });
}

TEST_CASE("messages: LNAV of two systems, D1 and D2 by satellite, I/NAV and F/NAV by data source") {
  CHECK(only(satellite("G05")).message == NavigationMessage::gps_lnav);
  CHECK(only(satellite("J02", 6493)).message == NavigationMessage::qzss_lnav);
  CHECK(only(satellite("C05", 6493)).message == NavigationMessage::beidou_d2);
  CHECK(only(satellite("C06", 6493)).message == NavigationMessage::beidou_d1);
  CHECK(only(satellite("C58")).message == NavigationMessage::beidou_d1);
  CHECK(only(satellite("C59", 6493)).message == NavigationMessage::beidou_d2);
  const auto galileo = [](double source) {
    Numbers n = satellite("E07");
    n.orbit[4][1] = source;
    return only(n).message;
  };
  for (const double inav : {513.0, 516.0, 517.0, 1025.0, 1.0, 4.0, 0.0, 512.0 + 7}) CHECK(galileo(inav) == NavigationMessage::galileo_inav);
  for (const double fnav : {258.0, 2.0, 256.0 + 7}) CHECK(galileo(fnav) == NavigationMessage::galileo_fnav);
}

TEST_CASE("health: only the bits of the signals that the message serves") {
  const auto health = [](const char* name, double word, double source = 517) {
    Numbers n = satellite(name);
    n.orbit[5][1] = word;
    n.orbit[4][1] = source;
    return only(n).health;
  };
  CHECK(health("G05", 0) == 0);
  CHECK(health("G05", 63) == 63);
  CHECK(health("J02", 1) == 0);
  CHECK(health("J02", 62) == 62);
  CHECK(health("C06", 1) == 1);
  for (const double bit : {1.0, 2.0, 4.0, 64.0, 128.0, 256.0}) {  // E1-B and E5b
    CHECK(health("E07", bit, 517) != 0);
    CHECK(health("E07", bit, 258) == 0);
  }
  for (const double bit : {8.0, 16.0, 32.0}) {  // E5a
    CHECK(health("E07", bit, 517) == 0);
    CHECK(health("E07", bit, 258) != 0);
  }
}

TEST_CASE("week rollover: toe follows the date of the clock, whatever the week number says") {
  const auto toe = [](const GpsTime& clock, double sow, double week) {
    Numbers n;
    n.clock_date = clock;
    n.orbit[2][0] = sow, n.orbit[4][2] = week, n.orbit[6][0] = sow;
    const auto parsed = read(nav_header("2.10") + record(n, 2));
    REQUIRE(parsed.value.ephemerides.size() == 1);
    return std::pair{parsed.value.ephemerides[0].toe, parsed.skipped.count("week number contradicts")};
  };
  const GpsTime saturday = GpsTime::from_week_sow(2320, 604784), sunday = GpsTime::from_week_sow(2321, 0);
  CHECK(toe(saturday, 604784, 2320) == std::pair{saturday, 0L});
  CHECK(toe(saturday, 604784, 2320 - 2048) == std::pair{saturday, 0L});
  CHECK(toe(saturday, 604784, 2320 - 1024) == std::pair{saturday, 0L});
  CHECK(toe(saturday, 604784, 77) == std::pair{saturday, 1L});
  CHECK(toe(saturday, 0, 2321) == std::pair{sunday, 0L});  // toe after the week's end, clock before it
  CHECK(toe(sunday, 604784, 2320) == std::pair{saturday, 0L});
  CHECK(toe(saturday, 604800, 2321) == std::pair{sunday, 0L});
  const GpsTime rollover = GpsTime::from_week_sow(2048, 0);  // 2019-04-07
  CHECK(toe(rollover, 0, 0).first == rollover);
  CHECK(toe(rollover, 604784, 1023).first == GpsTime::from_week_sow(2047, 604784));
  CHECK(toe(GpsTime::from_week_sow(1024, 0), 0, 0).first == GpsTime::from_week_sow(1024, 0));
}

TEST_CASE("time of transmission: from the file where it is plausible, before the week's start included, else toe") {
  const auto sent = [](double sow) {
    Numbers n;
    n.clock_date = GpsTime::from_week_sow(2321, 0);
    n.orbit[2][0] = 0, n.orbit[4][2] = 2321, n.orbit[6][0] = sow;
    const gnss::Ephemeris e = only(n);
    return seconds_between(e.toe, e.transmitted);
  };
  CHECK(sent(0) == 0);
  CHECK(sent(604800 - 7200) == -7200);
  CHECK(sent(-6882) == -6882);
  CHECK(sent(600) == 600);
  CHECK(sent(0.9999e9) == 0);
  CHECK(sent(300000) == 0);
  Numbers beidou = satellite("C06");
  beidou.orbit[4][2] = 2320 - 1356, beidou.orbit[6][0] = 122400 - 60;
  const gnss::Ephemeris e = only(beidou);
  CHECK(e.toe == GpsTime{beidou.clock_date.ns + 14 * kNanosecondsPerSecond});
  CHECK(e.transmitted.ns - e.toe.ns == -60 * kNanosecondsPerSecond);
}

TEST_CASE("ionosphere: GPS before QZSS before BeiDou, from each version's records; leap seconds") {
  const std::string gps = header_line("GPSA   1.8626E-08  2.2352E-08 -1.1921E-07 -5.9605E-08", "IONOSPHERIC CORR") +
                          header_line("GPSB   1.2902E+05  1.6384E+05 -1.9661E+05 -2.6214E+05", "IONOSPHERIC CORR");
  const std::string qzss = header_line("QZSA    .1956D-07   .1490D-07  -.3576D-06  -.8345D-06", "IONOSPHERIC CORR") +
                           header_line("QZSB    .1352D+06   .3277D+06   .1442D+07   .3670D+07", "IONOSPHERIC CORR");
  const std::string beidou = header_line("BDSA    .2794D-07   .2533D-06  -.1967D-05   .2921D-05", "IONOSPHERIC CORR") +
                             header_line("BDSB    .1167D+06   .1475D+06  -.3932D+06   .2621D+06", "IONOSPHERIC CORR");
  const std::string galileo = header_line("GAL    1.6175E+02  6.6016E-01  1.9379E-02  0.0000E+00", "IONOSPHERIC CORR");
  const auto alpha0 = [](const std::string& records) {
    return read(nav_header("3.04", records) + record({}, 3)).value.ionosphere.alpha[0];
  };
  CHECK(alpha0(galileo + beidou + qzss + gps) == 1.8626e-8);
  CHECK(alpha0(beidou + qzss) == 1.956e-8);
  CHECK(alpha0(beidou) == 2.794e-8);
  CHECK(alpha0(galileo) == 0);
  const auto full = read(nav_header("3.04", gps + header_line("    18", "LEAP SECONDS")) + record({}, 3));
  CHECK(full.value.ionosphere.beta[3] == -2.6214e5);
  CHECK(full.value.leap_seconds == 18);

  const auto old = read(nav_header("2.10", header_line("    1.1180D-08  1.4900D-08 -5.9600D-08 -5.9600D-08", "ION ALPHA") +
                                               header_line("    8.8060D+04  1.6380D+04 -1.9660D+05 -1.3110D+05", "ION BETA")) +
                        record({}, 2));
  CHECK(old.value.ionosphere.alpha[3] == -5.96e-8);
  CHECK(old.value.ionosphere.beta[0] == 8.806e4);

  const std::string klobuchar = "> ION G05 LNAV\n    2024 06 24 10 00 00" + d19(1e-8) + d19(2e-8) + d19(3e-8) + "\n    " + d19(4e-8) +
                                d19(1e5) + d19(2e5) + d19(3e5) + "\n    " + d19(4e5) + d19(0) + '\n';
  const auto modern = read(nav_header("4.00") + klobuchar + "> EPH G05 LNAV\n" + record({}, 3));
  CHECK(modern.value.ionosphere.alpha[0] == 1e-8);
  CHECK(modern.value.ionosphere.alpha[3] == 4e-8);
  CHECK(modern.value.ionosphere.beta[0] == 1e5);
  CHECK(modern.value.ionosphere.beta[3] == 4e5);
  CHECK(read(nav_header("3.04", header_line("GPSA   xxx", "IONOSPHERIC CORR")) + record({}, 3)).skipped.count("ionosphere coefficients") ==
        1);
}

TEST_CASE("records of other systems, messages and kinds are skipped and counted, the rest is read") {
  const std::string glonass =
      "R05 2024 06 24 08 15 00" + d19(0) + d19(0) + d19(0) + '\n' + "    " + d19(1) + d19(1) + d19(1) + d19(1) + '\n';
  Numbers sbas, navic;
  sbas.name = "S33", navic.name = "I03";
  const auto mixed = read(nav_header("3.04") + record({}, 3) + glonass + record(sbas, 3) + record(navic, 3) + record(satellite("E07"), 3));
  CHECK(mixed.value.ephemerides.size() == 2);
  CHECK(mixed.skipped.count("GLONASS record") == 1);
  CHECK(mixed.skipped.find("GLONASS record")->first_line == 11);
  CHECK(mixed.skipped.count("SBAS record") == 1);
  CHECK(mixed.skipped.count("NavIC record") == 1);

  const auto modern =
      read(nav_header("4.00") + "> EPH G05 CNAV\n" + record({}, 3) +
           "> STO G05 LNAV\n    2024 06 24 10 00 00 GPUT\n> EOP G05 CNAV\n    2024\n> EPH R05 FDMA\n" + glonass + "> EPH E07 FNAV\n" +
           record(satellite("E07"), 3) + "> EPH G05 INAV\n" + record({}, 3) + "> EPH J02 LNAV\n" + record(satellite("J02", 6493), 3));
  REQUIRE(modern.value.ephemerides.size() == 2);
  CHECK(modern.value.ephemerides[0].message == NavigationMessage::galileo_fnav);
  CHECK(modern.value.ephemerides[1].message == NavigationMessage::qzss_lnav);
  CHECK(modern.skipped.count("G message CNAV is not used") == 1);
  CHECK(modern.skipped.count("R message FDMA is not used") == 1);
  CHECK(modern.skipped.count("STO record") == 1);
  CHECK(modern.skipped.count("EOP record") == 1);
  CHECK(modern.skipped.count("does not belong") == 1);
}

TEST_CASE("bad input: absurd, missing and unreadable numbers cost their record, with the reason and the line") {
  const auto reason = [](const Numbers& bad) {
    const auto parsed = read(nav_header("3.04") + record({}, 3) + record(bad, 3) + record(satellite("E07"), 3));
    CHECK(parsed.value.ephemerides.size() == 2);
    CHECK_FALSE(parsed.error.has_value());
    REQUIRE(parsed.skipped.items().size() == 1);
    CHECK(parsed.skipped.items()[0].first_line == 11);
    return parsed.skipped.items()[0].reason;
  };
  const auto with = [](std::size_t row, std::size_t i, double v) {
    Numbers n;
    n.orbit[row][i] = v;
    return n;
  };
  CHECK(reason(with(1, 1, -0.01)) == "eccentricity is not in [0, 1)");
  CHECK(reason(with(1, 1, 1.0)) == "eccentricity is not in [0, 1)");
  CHECK(reason(with(1, 3, 1999)) == "square root of the semi-major axis is not in 2000 .. 8000");
  CHECK(reason(with(1, 3, 8001)) == "square root of the semi-major axis is not in 2000 .. 8000");
  CHECK(reason(with(2, 0, 604801)) == "toe is not a time of week");
  CHECK(reason(with(2, 0, -1)) == "toe is not a time of week");
  CHECK(reason(with(0, 3, 11)) == "angle beyond 10 rad");
  CHECK(reason(with(3, 3, 1e-4)) == "orbital rate beyond 1e-5 rad/s");
  CHECK(reason(with(1, 0, 0.2)) == "harmonic beyond 0.1 rad");
  CHECK(reason(with(3, 1, 2e5)) == "radius harmonic beyond 100 km");
  CHECK(reason(with(0, 0, -1)) == "issue of data is not a number of 16 bits");
  CHECK(reason(with(5, 1, 1e6)) == "health is not a number of 16 bits");
  Numbers clock;
  clock.clock[0] = 2;
  CHECK(reason(clock) == "clock beyond 1 s or 1e-3 s/s");
  Numbers nameless;
  nameless.name = "Gxx";
  CHECK(reason(nameless) == "satellite name is not readable");

  const std::string good = record({}, 3);
  const auto damaged = [&](std::size_t at, const std::string& text) {
    std::string bad = good;
    bad.replace(at, text.size(), text);
    const auto parsed = read(nav_header("3.04") + good + bad + record(satellite("E07"), 3));
    CHECK(parsed.value.ephemerides.size() == 2);
    return parsed.skipped.items().empty() ? std::string{} : parsed.skipped.items()[0].reason;
  };
  CHECK(damaged(30, "NaN") == "number of the record is missing or not readable");
  CHECK(damaged(85, std::string(19, ' ')) == "number of the record is missing or not readable");
  CHECK(damaged(85, "                Inf") == "number of the record is missing or not readable");
  CHECK(damaged(9, "13") == "date of the record is not readable");
  CHECK(damaged(85, "\t") == "tab character in a fixed-column line");
}

TEST_CASE("bad input: a record cut by the end of the file, and one with lines missing") {
  const std::string text = nav_header("3.04") + record({}, 3) + record(satellite("E07"), 3);
  const auto cut = read(text.substr(0, text.size() - 30));
  CHECK(cut.value.ephemerides.size() == 1);
  CHECK(cut.skipped.count("the file ends inside a record") == 1);
  const std::string second = record(satellite("E07"), 3);
  const auto shorter = read(nav_header("3.04") + second.substr(0, second.size() - 3 * 81) + record({}, 3));
  CHECK(shorter.value.ephemerides.size() == 1);
  CHECK(shorter.skipped.count("too few lines") == 1);
  const auto untimed = read(nav_header("3.04") + second.substr(0, second.size() - 81) + record({}, 3));
  REQUIRE(untimed.value.ephemerides.size() == 2);
  CHECK(untimed.value.ephemerides[0].transmitted == untimed.value.ephemerides[0].toe);
}

TEST_CASE("bad input: no header end, nothing usable, stray lines, lines in RINEX 4 before the first record") {
  const auto unending = read(header_line("     3.04           N: GNSS NAV DATA    M: MIXED", "RINEX VERSION / TYPE") + record({}, 3));
  REQUIRE(unending.error);
  CHECK(unending.error->message.find("no END OF HEADER") != std::string::npos);
  CHECK(unending.error->line == 9);
  const auto modern =
      read(header_line("     4.00           NAVIGATION DATA     M", "RINEX VERSION / TYPE") + "> EPH G05 LNAV\n" + record({}, 3));
  REQUIRE(modern.error);
  CHECK(modern.error->line == 2);
  const auto empty = read(nav_header("3.04"));
  REQUIRE(empty.error);
  CHECK(empty.error->message.find("no usable ephemeris") != std::string::npos);
  CHECK_FALSE(empty.error->hint.empty());
  const auto stray = read(nav_header("3.04") + "    stray\n" + record({}, 3));
  CHECK(stray.value.ephemerides.size() == 1);
  CHECK(stray.skipped.count("belong to no record") == 1);
  const auto tab = read(nav_header("3.04", header_line("GPSA\t 1.8626E-08", "IONOSPHERIC CORR")));
  REQUIRE(tab.error);
  CHECK(tab.error->line == 2);
}

TEST_CASE("any beginning of a file gives a beginning of its records, random damage does no harm") {
  test::for_all_seeds(30, [](test::Rng& rng) {
    std::string text = nav_header("3.04");
    for (int i = 0; i < 4; ++i) text += record(random_numbers(rng), 3);
    const auto whole = read(text);
    REQUIRE(whole.value.ephemerides.size() == 4);
    for (int i = 0; i < 40; ++i) {
      const auto part = read(text.substr(0, static_cast<std::size_t>(test::integer(rng, 0, static_cast<int>(text.size())))));
      const auto& records = part.value.ephemerides;
      CHECK(part.error.has_value() == records.empty());
      for (std::size_t k = 0; k < records.size(); ++k)
        CHECK((records[k].satellite == whole.value.ephemerides[k].satellite && records[k].toe == whole.value.ephemerides[k].toe &&
               records[k].group_delay_s[1] == whole.value.ephemerides[k].group_delay_s[1]));
    }
    for (int i = 0; i < 40; ++i) {
      std::string damaged = text;
      for (int k = test::integer(rng, 1, 20); k > 0; --k)
        damaged[static_cast<std::size_t>(test::integer(rng, 0, static_cast<int>(damaged.size()) - 1))] =
            static_cast<char>(test::integer(rng, 0, 255));
      for (const gnss::Ephemeris& e : read(damaged).value.ephemerides)
        CHECK((e.eccentricity >= 0 && e.eccentricity < 1 && std::isfinite(e.m0)));
    }
  });
}
