// SPDX-License-Identifier: BSD-3-Clause
// Time scales: every conversion there and back, on integer nanoseconds, and against a calendar that is counted day by day.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include <searvins/core/time.hpp>

#include "support/property.hpp"

using namespace searvins;
using searvins::test::Rng;

namespace {

constexpr std::int64_t kSecond = kNanosecondsPerSecond;
constexpr std::int64_t kDay = kSecondsPerDay * kSecond;

/// A uniform instant between 1990 and 2090 (ns of GPS time).
std::int64_t random_ns(Rng& rng) { return std::uniform_int_distribution<std::int64_t>{10 * 365 * kDay, 110 * 365 * kDay}(rng); }

bool leap_year(int year) { return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0); }
int days_in_month(int year, int month) {
  const int days[] = {31, leap_year(year) ? 29 : 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return days[month - 1];
}

}  // namespace

TEST_CASE("time: week and seconds of week, there and back, also before the epoch") {
  test::for_all_seeds(2000, [](Rng& rng) {
    const std::int64_t week = test::integer(rng, -300, 5000);
    const std::int64_t ns_of_week = std::uniform_int_distribution<std::int64_t>{0, kNanosecondsPerWeek - 1}(rng);
    const GpsTime t{week * kNanosecondsPerWeek + ns_of_week};
    CHECK(t.week() == week);
    CHECK(t.ns_of_week() == ns_of_week);
    CHECK(t.sow() >= 0);
    CHECK(t.sow() < 604800);
    CHECK(std::abs(GpsTime::from_week_sow(t.week(), t.sow()).ns - t.ns) <= 1);  // a double holds a week to 0.1 ns
    const std::int64_t nominal_ms = ns_of_week / 1000000;
    const GpsTime nominal = GpsTime::from_week_sow(week, static_cast<double>(nominal_ms) * 1e-3);
    CHECK(nominal.ns == week * kNanosecondsPerWeek + nominal_ms * 1000000);  // what receivers write is exact
  });
}

TEST_CASE("time: both sides of a week rollover") {
  for (const std::int64_t week : {-1, 0, 1, 1023, 1024, 2047, 2048}) {
    CAPTURE(week);
    const GpsTime start{week * kNanosecondsPerWeek}, before{start.ns - 1};
    CHECK(start.week() == week);
    CHECK(start.sow() == 0);
    CHECK(before.week() == week - 1);
    CHECK(before.ns_of_week() == kNanosecondsPerWeek - 1);
    CHECK(before < start);
    CHECK(GpsTime::from_week_sow(week - 1, 604800.0) == start);
    CHECK(GpsTime::from_week_sow(week, -0.5).ns == start.ns - kSecond / 2);
    CHECK(GpsTime::from_week_sow(week - 1, 604799.75).plus_seconds(0.5).ns == start.ns + kSecond / 4);
    CHECK(seconds_between(before, start) == 1e-9);
    CHECK(seconds_between(start, before) == -1e-9);
  }
}

TEST_CASE("time: truncated week numbers resolve to the week nearest the reference") {
  test::for_all_seeds(2000, [](Rng& rng) {
    const std::int64_t reference = test::integer(rng, 1024, 6000);
    const std::int64_t modulus = test::chance(rng, 0.5) ? 1024 : 8192;
    const std::int64_t truth = reference + test::integer(rng, -500, 500);
    CHECK(resolve_week_rollover(truth % modulus, reference, modulus) == truth);
    CHECK(resolve_week_rollover(truth, reference, modulus) == truth);  // a full week number passes through
  });
  CHECK(resolve_week_rollover(0, 2047) == 2048);
  CHECK(resolve_week_rollover(1023, 2048) == 2047);
}

TEST_CASE("time: seconds round to the nearest nanosecond, whatever the sign") {
  CHECK(nanoseconds_from_seconds(0.4e-9) == 0);
  CHECK(nanoseconds_from_seconds(0.6e-9) == 1);
  CHECK(nanoseconds_from_seconds(-0.4e-9) == 0);
  CHECK(nanoseconds_from_seconds(-0.6e-9) == -1);
  CHECK(nanoseconds_from_seconds(-1.25) == -1250000000);
  CHECK(nanoseconds_from_seconds(0.9999999999) == kSecond);
  test::for_all_seeds(2000, [](Rng& rng) {
    const std::int64_t ns = std::uniform_int_distribution<std::int64_t>{-kNanosecondsPerWeek, kNanosecondsPerWeek}(rng);
    const double below_half = test::uniform(rng, -0.3, 0.3);  // plus at most 0.06 ns from the double
    const long double seconds = (static_cast<long double>(ns) + below_half) * 1e-9L;
    CHECK(nanoseconds_from_seconds(static_cast<double>(seconds)) == ns);
  });
}

TEST_CASE("P22 time: no number of seconds is undefined behaviour") {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(nanoseconds_from_seconds(nan) == 0);
  CHECK(nanoseconds_from_seconds(inf) == nanoseconds_from_seconds(4.6e9));
  CHECK(nanoseconds_from_seconds(-inf) == -nanoseconds_from_seconds(inf));
  CHECK(nanoseconds_from_seconds(1e300) == nanoseconds_from_seconds(inf));
  CHECK(GpsTime::from_week_sow(2400, inf) > GpsTime::from_week_sow(2400, 0));
  CHECK(GpsTime::from_week_sow(2400, -inf) < GpsTime::from_week_sow(2400, 0));
  CHECK(GpsTime{std::numeric_limits<std::int64_t>::min()}.ns_of_week() >= 0);
  CHECK(GpsTime{std::numeric_limits<std::int64_t>::max()}.ns_of_week() < kNanosecondsPerWeek);
}

TEST_CASE("time: Galileo and BeiDou keep the same instant, there and back, with the published offsets") {
  test::for_all_seeds(1000, [](Rng& rng) {
    const GpsTime t{random_ns(rng)};
    CHECK(to_gps(to_galileo(t)) == t);
    CHECK(to_gps(to_beidou(t)) == t);
    const std::int64_t week = test::integer(rng, 0, 1500);
    const double sow = test::integer(rng, 0, 604799);
    CHECK(to_gps(GalileoTime::from_week_sow(week, sow)) == GpsTime::from_week_sow(week + 1024, sow));
    CHECK(to_gps(BeidouTime::from_week_sow(week, sow)) == GpsTime::from_week_sow(week + 1356, sow + 14));
  });
  CHECK(to_gps(GalileoTime{0}) == gps_from_civil({1999, 8, 22, 0, 0, 0}));
  CHECK(to_gps(BeidouTime{0}) == gps_from_civil({2006, 1, 1, 0, 0, 14}));
  CHECK(to_utc(to_gps(BeidouTime{0})).unix_ns == 1136073600 * kSecond);  // 2006-01-01 00:00:00 UTC
}

TEST_CASE("time: civil dates 1980-2100 agree with a calendar counted day by day") {
  std::int64_t day_number = 0;
  int year = 1980, month = 1, day = 6;
  while (year <= 2100) {
    const CivilTime c = civil_from_gps(GpsTime{day_number * kDay + kDay - 1});
    const bool same = c.year == year && c.month == month && c.day == day && c.hour == 23 && c.minute == 59;
    const bool back = gps_from_civil({year, month, day, 0, 0, 0}).ns == day_number * kDay;
    if (!same || !back) {
      CAPTURE(year);
      CAPTURE(month);
      CAPTURE(day);
      CHECK(same);
      CHECK(back);
      break;
    }
    ++day_number;
    if (++day > days_in_month(year, month)) day = 1, ++month;
    if (month > 12) month = 1, ++year;
  }
  CHECK(day_number == 121 * 365 + 30 - 5);  // 30 leap days: 1980, 1984 .. 2096, not 2100
}

TEST_CASE("time: civil time there and back to the nanosecond, also before the epoch") {
  test::for_all_seeds(2000, [](Rng& rng) {
    const GpsTime t{std::uniform_int_distribution<std::int64_t>{-30 * 365 * kDay, 120 * 365 * kDay}(rng)};
    const CivilTime c = civil_from_gps(t);
    CHECK(gps_from_civil(c) == t);
    CHECK(c.second >= 0);
    CHECK(c.second < 60);
  });
  const CivilTime before = civil_from_gps(GpsTime{-1});
  CHECK(before.year == 1980);
  CHECK(before.day == 5);
  CHECK(before.hour == 23);
  CHECK(before.second == doctest::Approx(59.999999999).epsilon(1e-15));
  CHECK(gps_from_civil({2019, 5, 9, 18, 38, 60.0}) == gps_from_civil({2019, 5, 9, 18, 39, 0}));  // RINEX writers do this
}

TEST_CASE("time: leap seconds on both sides of each step") {
  // GPS seconds at which 23:59:60 UTC began
  const std::int64_t inserted[] = {46828800,  78364801,  109900802, 173059203, 252028804, 315187205, 346723206,  393984007,  425520008,
                                   457056009, 504489610, 551750411, 599184012, 820108813, 914803214, 1025136015, 1119744016, 1167264017};
  int leap = 0;
  CHECK(leap_seconds(GpsTime{-kSecond}) == 0);
  for (const std::int64_t second : inserted) {
    CAPTURE(second);
    const GpsTime start{second * kSecond}, end{(second + 1) * kSecond};
    CHECK(leap_seconds(start) == leap);
    CHECK(leap_seconds(GpsTime{end.ns - 1}) == leap);
    CHECK(leap_seconds(end) == leap + 1);
    const std::int64_t midnight_ns = to_utc(end).unix_ns;
    CHECK(midnight_ns % kDay == 0);
    CHECK(to_utc(GpsTime{start.ns - 1}).unix_ns == midnight_ns - 1);
    CHECK(to_utc(start).unix_ns == midnight_ns);  // 23:59:60 shares its number with 00:00:00
    CHECK(to_gps(UtcTime{midnight_ns}) == end);
    CHECK(to_gps(UtcTime{midnight_ns + kSecond / 2}).ns == end.ns + kSecond / 2);
    CHECK(to_gps(UtcTime{midnight_ns - 1}).ns == start.ns - 1);
    ++leap;
  }
  CHECK(leap == 18);
  CHECK(to_gps(UtcTime{1483228800 * kSecond}).ns == 1167264018 * kSecond);  // 2017-01-01 00:00:00 UTC
  CHECK(to_utc(GpsTime{0}).unix_ns == 315964800 * kSecond);                 // 1980-01-06 00:00:00 UTC
}

TEST_CASE("time: UTC there and back, in random and in densely sampled leap neighbourhoods") {
  test::for_all_seeds(2000, [](Rng& rng) {
    const GpsTime t{random_ns(rng)};
    CHECK(to_gps(to_utc(t)) == t);
    const std::int64_t step_s = test::chance(rng, 0.5) ? 1483228800 : 1435708800;  // 2017-01-01, 2015-07-01
    const UtcTime u{step_s * kSecond + std::uniform_int_distribution<std::int64_t>{-3 * kSecond, 3 * kSecond}(rng)};
    CHECK(to_utc(to_gps(u)).unix_ns == u.unix_ns);
    const UtcTime later{u.unix_ns + 1};
    CHECK(to_gps(u) < to_gps(later));
  });
}
