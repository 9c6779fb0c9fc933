// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One broadcast record as it stands in a RINEX navigation file, and the gnss::Ephemeris it means.
///
/// A record is an epoch line (clock reference time, af0, af1, af2) and seven lines of four numbers, orbit[row][column], row 0 .. 6:
///
///     0   issue   Crs     delta n  M0          4   i dot   source  week    -
///     1   Cuc     e       Cus      sqrt A      5   accuracy  health  TGD | BGD E5a | TGD1   IODC | BGD E5b | TGD2
///     2   toe     Cic     Omega0   Cis         6   transmission time  (fit interval)
///     3   i0      Crc     omega    Omega dot
///
/// Times. The clock's date tells the week: toe is the instant with the file's seconds of week nearest to it, so a week number that
/// rolled over (modulo 1024), or counts in another system's weeks, cannot mislead. BeiDou dates and seconds are BDT, GPS time is 14 s
/// more. A transmission time more than 4 h from toe (0 or 0.9999E9 mean unknown) becomes toe.
///
/// Health, 0 when the signals that this message serves may be used:
///
///     GPS        the six bits as broadcast
///     QZSS       the same without the last bit, which is about LEX or L1C/B, not about L1 C/A
///     Galileo    I/NAV: E1-B and E5b bits (data validity and health status); F/NAV: E5a bits
///     BeiDou     SatH1
///
/// Galileo sources: bit 0 or 2 is I/NAV, bit 1 is F/NAV. A writer that merged both is taken at the word of its clock: bit 8 (clock for
/// E5a, E1) without bit 9 is F/NAV, else I/NAV.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/core/time.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/io/rinex_common.hpp>

namespace searvins::io {

/// A record, numbers as written.
struct NavigationRecord {
  gnss::SatelliteId satellite{};
  CivilEpoch toc{};
  std::array<double, 3> clock{};                 ///< af0, af1, af2
  std::array<std::array<double, 4>, 7> orbit{};  ///< 0 where blank
};

namespace detail {

/// The instant with these seconds of week (on the reference's clock, which lags GPS time by `lag_s`) nearest to the reference.
[[nodiscard]] inline GpsTime nearest_with_sow(double sow, double lag_s, GpsTime reference) {
  const GpsTime guess = GpsTime::from_week_sow(reference.week(), sow + lag_s);
  const auto weeks = std::llround(seconds_between(guess, reference) / static_cast<double>(kSecondsPerWeek));
  return {guess.ns + weeks * kNanosecondsPerWeek};
}

[[nodiscard]] inline bool geostationary_beidou(std::uint8_t number) { return number <= 5 || (number >= 59 && number <= 63); }

/// I/NAV or F/NAV, from the data source bits.
[[nodiscard]] inline gnss::NavigationMessage galileo_message(double source) {
  const auto bits = source >= 0 && source < 65536 ? static_cast<unsigned>(source) : 0U;
  const bool inav = (bits & 0b101U) != 0, fnav = (bits & 0b10U) != 0;
  const bool clock_of_fnav = (bits & 0x100U) != 0 && (bits & 0x200U) == 0;
  return fnav && (!inav || clock_of_fnav) ? gnss::NavigationMessage::galileo_fnav : gnss::NavigationMessage::galileo_inav;
}

[[nodiscard]] inline gnss::NavigationMessage message_of(const NavigationRecord& r) {
  switch (r.satellite.constellation) {
    case gnss::Constellation::galileo: return galileo_message(r.orbit[4][1]);
    case gnss::Constellation::beidou:
      return geostationary_beidou(r.satellite.number) ? gnss::NavigationMessage::beidou_d2 : gnss::NavigationMessage::beidou_d1;
    case gnss::Constellation::qzss: return gnss::NavigationMessage::qzss_lnav;
    default: return gnss::NavigationMessage::gps_lnav;
  }
}

/// The bits of the health word that concern the message.
[[nodiscard]] constexpr unsigned health_mask(gnss::NavigationMessage message) {
  switch (message) {
    case gnss::NavigationMessage::qzss_lnav: return 0xFFFEU;
    case gnss::NavigationMessage::galileo_inav: return 0b1'1100'0111U;
    case gnss::NavigationMessage::galileo_fnav: return 0b0'0011'1000U;
    default: return 0xFFFFU;
  }
}

/// What is absurd about a record's numbers; nullptr when nothing is.
[[nodiscard]] inline const char* absurd(const NavigationRecord& r) {
  const auto& o = r.orbit;
  const auto within = [](double limit, std::initializer_list<double> values) {
    for (const double v : values)
      if (!(std::abs(v) <= limit)) return false;
    return true;
  };
  if (!(o[1][1] >= 0 && o[1][1] < 1)) return "eccentricity is not in [0, 1)";
  if (!(o[1][3] >= 2000 && o[1][3] <= 8000)) return "square root of the semi-major axis is not in 2000 .. 8000";
  if (!(o[2][0] >= 0 && o[2][0] <= static_cast<double>(kSecondsPerWeek))) return "toe is not a time of week";
  if (!within(10, {o[0][3], o[2][2], o[3][0], o[3][2]})) return "angle beyond 10 rad";
  if (!within(1e-5, {o[0][2], o[3][3], o[4][0]})) return "orbital rate beyond 1e-5 rad/s";
  if (!within(0.1, {o[1][0], o[1][2], o[2][1], o[2][3]})) return "harmonic beyond 0.1 rad";
  if (!within(1e5, {o[0][1], o[3][1]})) return "radius harmonic beyond 100 km";
  if (!within(1, {r.clock[0]}) || !within(1e-3, {r.clock[1], r.clock[2]})) return "clock beyond 1 s or 1e-3 s/s";
  if (!(o[0][0] >= 0 && o[0][0] <= 65535)) return "issue of data is not a number of 16 bits";
  if (!(o[5][1] >= 0 && o[5][1] <= 65535)) return "health is not a number of 16 bits";
  return nullptr;
}

}  // namespace detail

/// What became of a record: an ephemeris, or a reason why there is none; `week_differs` when the week number contradicts the date
/// (modulo 1024: a rolled-over number and Galileo's own weeks are in order).
struct ConvertedRecord {
  gnss::Ephemeris ephemeris{};
  const char* wrong{nullptr};
  bool week_differs{false};
};

/// Turns a record into an ephemeris. `message` overrides what the record's numbers say (RINEX 4 names the message).
[[nodiscard]] inline ConvertedRecord to_ephemeris(const NavigationRecord& r, const gnss::NavigationMessage* message = nullptr) {
  ConvertedRecord out;
  if ((out.wrong = detail::absurd(r))) return out;
  const auto& o = r.orbit;
  gnss::Ephemeris& e = out.ephemeris;
  const bool beidou = r.satellite.constellation == gnss::Constellation::beidou;
  const double lag_s = beidou ? static_cast<double>(kBeidouLagSeconds) : 0.0;
  e.satellite = r.satellite;
  e.message = message ? *message : detail::message_of(r);
  e.toc = r.toc.to_gps(beidou ? TimeSystem::beidou : TimeSystem::gps);
  e.toe = detail::nearest_with_sow(o[2][0], lag_s, e.toc);
  const bool sent_known = std::abs(o[6][0]) <= static_cast<double>(kSecondsPerWeek);
  e.transmitted = sent_known ? detail::nearest_with_sow(o[6][0], lag_s, e.toe) : e.toe;
  if (std::abs(seconds_between(e.toe, e.transmitted)) > 4 * 3600.0) e.transmitted = e.toe;

  const GpsTime week_start{e.toe.ns - (beidou ? kBeidouLagSeconds * kNanosecondsPerSecond : 0)};
  const std::int64_t week = week_start.week() - (beidou ? kBeidouWeekOffset : 0);
  out.week_differs = std::fmod(o[4][2] - static_cast<double>(week), 1024.0) != 0;
  e.issue = static_cast<std::uint32_t>(o[0][0]);
  e.health = static_cast<std::uint16_t>(static_cast<unsigned>(o[5][1]) & detail::health_mask(e.message));
  e.accuracy_m = o[5][0] > 0 ? o[5][0] : 0.0;

  e.crs = o[0][1], e.delta_n = o[0][2], e.m0 = o[0][3];
  e.cuc = o[1][0], e.eccentricity = o[1][1], e.cus = o[1][2], e.sqrt_a = o[1][3];
  e.cic = o[2][1], e.omega0 = o[2][2], e.cis = o[2][3];
  e.i0 = o[3][0], e.crc = o[3][1], e.omega = o[3][2], e.omega_dot = o[3][3];
  e.i_dot = o[4][0];
  e.af0 = r.clock[0], e.af1 = r.clock[1], e.af2 = r.clock[2];
  const bool one_delay = r.satellite.constellation == gnss::Constellation::gps || r.satellite.constellation == gnss::Constellation::qzss;
  e.group_delay_s[0] = o[5][2];
  e.group_delay_s[1] = one_delay ? 0.0 : o[5][3];
  return out;
}

}  // namespace searvins::io
