// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Time on integer nanoseconds, one type a scale: GPS, Galileo (GST), BeiDou (BDT) and UTC never mix by accident.
///
///     scale   origin                   against GPS time
///     GPST    1980-01-06 00:00:00 UTC  0
///     GST     1999-08-22 00:00:00 GPST (week 0 = GPS week 1024)    same seconds, weeks 1024 fewer
///     BDT     2006-01-01 00:00:00 UTC  (week 0 = GPS week 1356)    BDT = GPST - 14 s
///     UTC     civil                    UTC = GPST - leap seconds   (18 s since 2017-01-01)
///
/// A double holds seconds of a week only to 0.1 ns, and loses it over decades; an int64 of nanoseconds is exact to the year 2272.
#pragma once

#include <cmath>
#include <cstdint>

namespace searvins {

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;  ///< exact
inline constexpr std::int64_t kSecondsPerDay = 86'400;  ///< of GPS time, which has no leap seconds
inline constexpr std::int64_t kSecondsPerWeek = 604'800;  ///< of GPS time
inline constexpr std::int64_t kNanosecondsPerWeek = kSecondsPerWeek * kNanosecondsPerSecond;  ///< of GPS time

/// Nearest integer number of nanoseconds (halves up). Seconds beyond +-4.6e9 (145 years) saturate and NaN gives 0, so that garbage is no
/// undefined behaviour, not even when added to an instant; a reader refuses non-finite numbers before they become a time.
[[nodiscard]] inline std::int64_t nanoseconds_from_seconds(double seconds) {
  constexpr double kLimit = 4.6e9;
  if (!(seconds >= -kLimit)) return seconds < 0 ? -static_cast<std::int64_t>(kLimit) * kNanosecondsPerSecond : 0;
  if (seconds > kLimit) return static_cast<std::int64_t>(kLimit) * kNanosecondsPerSecond;
  const double whole = std::floor(seconds);
  return static_cast<std::int64_t>(whole) * kNanosecondsPerSecond + static_cast<std::int64_t>(std::llround((seconds - whole) * 1e9));
}

/// An instant of GPS time: nanoseconds since 1980-01-06 00:00:00 UTC.
struct GpsTime {
  std::int64_t ns{0};

  /// From GPS week (not modulo 1024) and seconds of week, which may lie outside [0, 604800).
  [[nodiscard]] static GpsTime from_week_sow(std::int64_t week, double sow) {
    return {week * kNanosecondsPerWeek + nanoseconds_from_seconds(sow)};
  }

  /// GPS week, counted without rollover.
  [[nodiscard]] constexpr std::int64_t week() const { return ns / kNanosecondsPerWeek - (ns % kNanosecondsPerWeek < 0 ? 1 : 0); }
  /// Nanoseconds of week, [0, 604800e9).
  [[nodiscard]] constexpr std::int64_t ns_of_week() const {
    const std::int64_t rest = ns % kNanosecondsPerWeek;
    return rest < 0 ? rest + kNanosecondsPerWeek : rest;
  }
  /// Seconds of week, [0, 604800).
  [[nodiscard]] constexpr double sow() const {
    return static_cast<double>(ns_of_week() / kNanosecondsPerSecond) + static_cast<double>(ns_of_week() % kNanosecondsPerSecond) * 1e-9;
  }

  [[nodiscard]] GpsTime plus_seconds(double seconds) const { return {ns + nanoseconds_from_seconds(seconds)}; }

  friend constexpr bool operator==(GpsTime, GpsTime) = default;
  friend constexpr auto operator<=>(GpsTime, GpsTime) = default;
};

/// later - earlier, seconds.
[[nodiscard]] constexpr double seconds_between(GpsTime earlier, GpsTime later) { return static_cast<double>(later.ns - earlier.ns) * 1e-9; }

/// Galileo System Time: nanoseconds since GST week 0 (1999-08-22 00:00:00 GPST, 13 s before midnight UTC).
struct GalileoTime {
  std::int64_t ns{0};
  [[nodiscard]] static GalileoTime from_week_sow(std::int64_t week, double sow) {
    return {week * kNanosecondsPerWeek + nanoseconds_from_seconds(sow)};
  }
};

/// BeiDou Time: nanoseconds since 2006-01-01 00:00:00 UTC.
struct BeidouTime {
  std::int64_t ns{0};
  [[nodiscard]] static BeidouTime from_week_sow(std::int64_t week, double sow) {
    return {week * kNanosecondsPerWeek + nanoseconds_from_seconds(sow)};
  }
};

inline constexpr std::int64_t kGalileoWeekOffset = 1024;  ///< GPS week of GST week 0
inline constexpr std::int64_t kBeidouWeekOffset = 1356;   ///< GPS week of BDT week 0
inline constexpr std::int64_t kBeidouLagSeconds = 14;     ///< GPST - BDT

/// GPS time of an instant of Galileo system time, exact.
[[nodiscard]] constexpr GpsTime to_gps(GalileoTime t) { return {t.ns + kGalileoWeekOffset * kNanosecondsPerWeek}; }
/// GPS time of an instant of BeiDou time, exact.
[[nodiscard]] constexpr GpsTime to_gps(BeidouTime t) {
  return {t.ns + kBeidouWeekOffset * kNanosecondsPerWeek + kBeidouLagSeconds * kNanosecondsPerSecond};
}
/// Galileo system time of an instant of GPS time, exact.
[[nodiscard]] constexpr GalileoTime to_galileo(GpsTime t) { return {t.ns - kGalileoWeekOffset * kNanosecondsPerWeek}; }
/// BeiDou time of an instant of GPS time, exact.
[[nodiscard]] constexpr BeidouTime to_beidou(GpsTime t) {
  return {t.ns - kBeidouWeekOffset * kNanosecondsPerWeek - kBeidouLagSeconds * kNanosecondsPerSecond};
}

/// A civil date and time of day without a scale; the function that takes or returns it names the scale.
struct CivilTime {
  int year{1980}, month{1}, day{6};
  int hour{0}, minute{0};
  double second{0};
};

/// Days from 1970-01-01 to a date of the proleptic Gregorian calendar [Hinnant, "chrono-Compatible Low-Level Date Algorithms"].
[[nodiscard]] constexpr std::int64_t days_from_civil(int year, int month, int day) {
  const std::int64_t y = static_cast<std::int64_t>(year) - (month <= 2 ? 1 : 0);
  const std::int64_t era = (y >= 0 ? y : y - 399) / 400;
  const std::int64_t year_of_era = y - era * 400;
  const std::int64_t day_of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  const std::int64_t day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * 146097 + day_of_era - 719468;
}

inline constexpr std::int64_t kGpsEpochUnixDays = days_from_civil(1980, 1, 6);  ///< from 1970-01-01 to the origin of GPS time

/// A civil reading of a clock that shows GPS time (RINEX observation tags).
[[nodiscard]] inline GpsTime gps_from_civil(const CivilTime& c) {
  const std::int64_t whole =
      (days_from_civil(c.year, c.month, c.day) - kGpsEpochUnixDays) * kSecondsPerDay + c.hour * 3600LL + c.minute * 60LL;
  return {whole * kNanosecondsPerSecond + nanoseconds_from_seconds(c.second)};
}

/// The civil reading of a clock that shows GPS time.
[[nodiscard]] inline CivilTime civil_from_gps(GpsTime t) {
  const std::int64_t ns_per_day = kSecondsPerDay * kNanosecondsPerSecond;
  std::int64_t days = t.ns / ns_per_day, rest = t.ns % ns_per_day;
  if (rest < 0) rest += ns_per_day, --days;
  const std::int64_t z = days + kGpsEpochUnixDays + 719468;  // Hinnant's civil_from_days
  const std::int64_t era = (z >= 0 ? z : z - 146096) / 146097;
  const std::int64_t doe = z - era * 146097;
  const std::int64_t yoe = (doe - doe / 1460 + doe / 36524 - doe / 146096) / 365;
  const std::int64_t doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
  const std::int64_t mp = (5 * doy + 2) / 153;
  CivilTime c;
  c.day = static_cast<int>(doy - (153 * mp + 2) / 5 + 1);
  c.month = static_cast<int>(mp < 10 ? mp + 3 : mp - 9);
  c.year = static_cast<int>(yoe + era * 400 + (c.month <= 2 ? 1 : 0));
  const std::int64_t whole = rest / kNanosecondsPerSecond;
  c.hour = static_cast<int>(whole / 3600);
  c.minute = static_cast<int>(whole / 60 % 60);
  c.second = static_cast<double>(whole % 60) + static_cast<double>(rest % kNanosecondsPerSecond) * 1e-9;
  return c;
}

namespace detail {

/// Months that began with one more leap second: IERS Bulletin C up to 2017-01-01; none has been announced since (2026).
struct LeapStep {
  int year, month;
};
inline constexpr LeapStep kLeapSteps[] = {{1981, 7}, {1982, 7}, {1983, 7}, {1985, 7}, {1988, 1}, {1990, 1},
                                          {1991, 1}, {1992, 7}, {1993, 7}, {1994, 7}, {1996, 1}, {1997, 7},
                                          {1999, 1}, {2006, 1}, {2009, 1}, {2012, 7}, {2015, 7}, {2017, 1}};

/// Nanoseconds of UTC, leap seconds not counted, from the GPS epoch to the month of a step.
[[nodiscard]] constexpr std::int64_t utc_ns_of(LeapStep step) {
  return (days_from_civil(step.year, step.month, 1) - kGpsEpochUnixDays) * kSecondsPerDay * kNanosecondsPerSecond;
}

}  // namespace detail

/// GPST - UTC at an instant of GPS time, seconds: the new value holds from 00:00:00 UTC, so the leap second 23:59:60 has the old one.
[[nodiscard]] constexpr int leap_seconds(GpsTime t) {
  int leap = 0;
  for (const detail::LeapStep& step : detail::kLeapSteps)
    if (t.ns >= detail::utc_ns_of(step) + (leap + 1) * kNanosecondsPerSecond) ++leap;
  return leap;
}

/// An instant of UTC: nanoseconds since 1970-01-01 00:00:00 UTC, leap seconds not counted (Unix time). A leap second 23:59:60 has the
/// same number as the second after it.
struct UtcTime {
  std::int64_t unix_ns{0};
};

/// UTC of an instant of GPS time, by the table of leap seconds.
[[nodiscard]] constexpr UtcTime to_utc(GpsTime t) {
  return {t.ns - leap_seconds(t) * kNanosecondsPerSecond + kGpsEpochUnixDays * kSecondsPerDay * kNanosecondsPerSecond};
}

/// Of the two instants that share a number at a leap second this is the later, 00:00:00 and what follows; so to_utc(to_gps(u)) is u
/// always, and to_gps(to_utc(t)) is t outside leap seconds.
[[nodiscard]] constexpr GpsTime to_gps(UtcTime t) {
  const std::int64_t since_epoch_ns = t.unix_ns - kGpsEpochUnixDays * kSecondsPerDay * kNanosecondsPerSecond;
  int leap = 0;
  for (const detail::LeapStep& step : detail::kLeapSteps)
    if (since_epoch_ns >= detail::utc_ns_of(step)) ++leap;
  return {since_epoch_ns + leap * kNanosecondsPerSecond};
}

/// Resolves a week number known modulo `modulus` (1024 for legacy GPS) to the week nearest a reference week.
[[nodiscard]] constexpr std::int64_t resolve_week_rollover(std::int64_t truncated_week, std::int64_t reference_week,
                                                           std::int64_t modulus = 1024) {
  const std::int64_t base = truncated_week % modulus;
  std::int64_t week = reference_week - (reference_week % modulus) + base;
  if (week - reference_week > modulus / 2) week -= modulus;
  if (reference_week - week > modulus / 2) week += modulus;
  return week;
}

}  // namespace searvins
