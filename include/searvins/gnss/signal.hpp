// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Constellations, satellites and signals, named as RINEX 3 names them: `G2W` is GPS, band 2, tracking code W.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>

namespace searvins::gnss {

inline constexpr double kSpeedOfLightMps = 299'792'458.0;  ///< in vacuum, exact

/// The constellations that the library models. GLONASS (FDMA), SBAS and NavIC are skipped by the readers and counted.
enum class Constellation : std::uint8_t { gps, galileo, beidou, qzss };
inline constexpr std::size_t kConstellations = 4;  ///< number of Constellation values

/// RINEX letter: G, E, C, J.
[[nodiscard]] constexpr char letter_of(Constellation c) { return "GECJ"[static_cast<std::size_t>(c)]; }

/// Full name, for messages.
[[nodiscard]] constexpr const char* name_of(Constellation c) {
  constexpr const char* names[] = {"GPS", "Galileo", "BeiDou", "QZSS"};
  return names[static_cast<std::size_t>(c)];
}

/// Constellation of a RINEX letter; false when it is not one of ours (`out` untouched).
[[nodiscard]] constexpr bool constellation_from_letter(char letter, Constellation& out) {
  switch (letter) {
    case 'G': out = Constellation::gps; return true;
    case 'E': out = Constellation::galileo; return true;
    case 'C': out = Constellation::beidou; return true;
    case 'J': out = Constellation::qzss; return true;
    default: return false;
  }
}

/// A satellite: constellation and RINEX number (QZSS J01..J10 is 1..10). Ordered by constellation, then number.
struct SatelliteId {
  Constellation constellation{Constellation::gps};
  std::uint8_t number{0};  ///< 1..63; 0: none
  friend constexpr auto operator<=>(const SatelliteId&, const SatelliteId&) = default;
};

/// A signal: constellation, RINEX band digit and tracking attribute, as in the observation code C2W of a GPS satellite.
struct SignalCode {
  Constellation constellation{Constellation::gps};
  char band{0};       ///< '1'..'8'; 0: none
  char attribute{0};  ///< tracking mode letter; ' ' when RINEX 2 does not tell
  friend constexpr auto operator<=>(const SignalCode&, const SignalCode&) = default;
};

/// Same constellation and carrier frequency, whatever the tracking mode.
[[nodiscard]] constexpr bool same_carrier(const SignalCode& a, const SignalCode& b) { return a.constellation == b.constellation && a.band == b.band; }

/// Carrier frequency, Hz; 0 for a band that the constellation does not have. BeiDou band 2 is B1I (RINEX 3.03 and later).
[[nodiscard]] constexpr double frequency_hz(Constellation c, char band) {
  constexpr double f0 = 10.23e6;
  if (c == Constellation::beidou) {
    switch (band) {
      case '1': return 154 * f0;    // B1C
      case '2': return 152.6 * f0;  // B1I, 1561.098 MHz
      case '5': return 115 * f0;    // B2a
      case '6': return 124 * f0;    // B3I, 1268.52 MHz
      case '7': return 118 * f0;    // B2I, B2b
      case '8': return 116.5 * f0;  // B2a+b
      default: return 0;
    }
  }
  switch (band) {
    case '1': return 154 * f0;
    case '2': return c == Constellation::galileo ? 0 : 120 * f0;
    case '5': return 115 * f0;
    case '6': return c == Constellation::gps ? 0 : 125 * f0;  // E6, L6
    case '7': return c == Constellation::galileo ? 118 * f0 : 0;
    case '8': return c == Constellation::galileo ? 116.5 * f0 : 0;
    default: return 0;
  }
}
/// Carrier frequency of a signal, Hz; 0 for an unknown band.
[[nodiscard]] constexpr double frequency_hz(const SignalCode& s) { return frequency_hz(s.constellation, s.band); }

/// Wavelength, metres; 0 for an unknown band.
[[nodiscard]] constexpr double wavelength_m(const SignalCode& s) {
  const double f = frequency_hz(s);
  return f > 0 ? kSpeedOfLightMps / f : 0;
}

/// Parses "G2W"; false when the text is not three characters of a known constellation and band (`out` untouched).
[[nodiscard]] constexpr bool signal_from_text(const char* text, std::size_t length, SignalCode& out) {
  Constellation c{};
  if (length != 3 || !constellation_from_letter(text[0], c) || frequency_hz(c, text[1]) == 0) return false;
  if (text[2] < 'A' || text[2] > 'Z') return false;
  out = {c, text[1], text[2]};
  return true;
}

}  // namespace searvins::gnss
