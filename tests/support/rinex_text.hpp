// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Small writers of RINEX text for tests, and random epochs that survive the writing: values are multiples of what the columns hold.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/gnss/observation.hpp>

#include "property.hpp"

namespace searvins::test {

/// A header line: content in 60 columns, then the label.
inline std::string header_line(std::string content, const std::string& label) {
  content.resize(60, ' ');
  return content + label + '\n';
}

inline std::string formatted(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// One value with its two digits: 16 columns; blank when it is not finite.
inline std::string value_cell(double value, char lli = ' ', char ssi = ' ') {
  return (std::isfinite(value) ? formatted("%14.3f", value) : std::string(14, ' ')) + lli + ssi;
}

/// "G07".
inline std::string satellite_text(gnss::SatelliteId id) {
  return std::string{gnss::letter_of(id.constellation)} + (id.number < 10 ? "0" : "") + std::to_string(id.number);
}

/// Date and time of an epoch line; year with four digits or two.
inline std::string civil_text(GpsTime t, bool two_digit_year) {
  const CivilTime c = civil_from_gps(t);
  const std::int64_t in_minute = (t.ns_of_week() % (60 * kNanosecondsPerSecond)) / 100;  // units of 100 ns
  char text[80];
  std::snprintf(text, sizeof text, two_digit_year ? "%02d %2d %2d %2d %2d%3d.%07d" : "%04d %02d %02d %02d %02d%3d.%07d",
                two_digit_year ? c.year % 100 : c.year, c.month, c.day, c.hour, c.minute, static_cast<int>(in_minute / 10'000'000),
                static_cast<int>(in_minute % 10'000'000));
  return text;
}

/// What RINEX 3 text of these tests holds: per constellation the signals, each as C, L, D, S.
struct RinexTextPlan {
  double version{3.04};
  std::vector<gnss::SignalCode> signals;  ///< grouped by constellation
};

inline gnss::SignalCode signal(const char* text) {
  gnss::SignalCode code{};
  (void)gnss::signal_from_text(text, 3, code);
  return code;
}

inline std::vector<gnss::SignalCode> signals_of(const RinexTextPlan& plan, gnss::Constellation c) {
  std::vector<gnss::SignalCode> own;
  for (const gnss::SignalCode& s : plan.signals)
    if (s.constellation == c) own.push_back(s);
  return own;
}

/// SYS / # / OBS TYPES records, continued after 13 types.
inline std::string types_3(char letter, const std::vector<std::string>& types) {
  std::string text, line;
  char count[8];
  std::snprintf(count, sizeof count, "%c  %3d", letter, static_cast<int>(types.size()));
  line = count;
  for (std::size_t i = 0; i < types.size(); ++i) {
    if (i > 0 && i % 13 == 0) text += header_line(std::exchange(line, std::string(6, ' ')), "SYS / # / OBS TYPES");
    line += ' ' + types[i] + std::string(3 - types[i].size(), ' ');
  }
  return text + header_line(line, "SYS / # / OBS TYPES");
}

/// # / TYPES OF OBSERV records, continued after 9 types.
inline std::string types_2(const std::vector<std::string>& types) {
  std::string text, line = formatted("%6.0f", static_cast<double>(types.size()));
  for (std::size_t i = 0; i < types.size(); ++i) {
    if (i > 0 && i % 9 == 0) text += header_line(std::exchange(line, std::string(6, ' ')), "# / TYPES OF OBSERV");
    line += "    " + types[i];
  }
  return text + header_line(line, "# / TYPES OF OBSERV");
}

/// A header from its first line to its last: version, then the given records.
inline std::string observation_header(double version, const std::string& records, const std::string& system = "M") {
  return header_line(formatted("%9.2f", version) + std::string(11, ' ') + "OBSERVATION DATA    " + system, "RINEX VERSION / TYPE") +
         records + header_line("", "END OF HEADER");
}

inline std::string header_3(const RinexTextPlan& plan) {
  std::string records;
  for (std::size_t i = 0; i < gnss::kConstellations; ++i) {
    const auto c = static_cast<gnss::Constellation>(i);
    std::vector<std::string> types;
    for (const gnss::SignalCode& s : signals_of(plan, c))
      for (const char quantity : {'C', 'L', 'D', 'S'}) types.push_back({quantity, s.band, s.attribute});
    if (!types.empty()) records += types_3(gnss::letter_of(c), types);
  }
  return observation_header(plan.version, records);
}

inline char lli_digit(const gnss::SignalObservation& s) {
  const int bits = (s.loss_of_lock ? 1 : 0) + (s.half_cycle ? 2 : 0);
  return bits == 0 ? ' ' : static_cast<char>('0' + bits);
}

/// Code, phase, Doppler, C/N0 of one signal (or of none: blank).
inline std::string cells_of(const gnss::SignalObservation* s) {
  if (!s) return std::string(64, ' ');
  return value_cell(s->code_m) + value_cell(s->phase_cycles, lli_digit(*s)) + value_cell(s->doppler_hz) + value_cell(s->cn0_dbhz);
}

/// An epoch of RINEX 3 or 4.
inline std::string epoch_3(const RinexTextPlan& plan, const gnss::ObservationEpoch& epoch) {
  char count[16];
  std::snprintf(count, sizeof count, "  %d%3d", epoch.power_failure ? 1 : 0, static_cast<int>(epoch.satellites.size()));
  std::string text = "> " + civil_text(epoch.tag, false) + count + '\n';
  for (const gnss::SatelliteObservation& satellite : epoch.satellites) {
    text += satellite_text(satellite.satellite);
    for (const gnss::SignalCode& s : signals_of(plan, satellite.satellite.constellation)) text += cells_of(satellite.find(s));
    text += '\n';
  }
  return text;
}

/// The types of the RINEX 2 text of these tests.
inline const std::vector<std::string>& legacy_types() {
  static const std::vector<std::string> types = {"C1", "P1", "L1", "D1", "S1", "P2", "C2", "L2", "D2", "S2", "C5", "L5", "D5", "S5"};
  return types;
}

/// The signals that those types mean for a constellation; of GPS either 2W or 2X at one epoch.
inline std::vector<gnss::SignalCode> legacy_signals(gnss::Constellation c) {
  switch (c) {
    case gnss::Constellation::galileo: return {signal("E1X"), signal("E5X")};
    case gnss::Constellation::beidou: return {signal("C2I")};
    case gnss::Constellation::qzss: return {signal("J1C"), signal("J2X"), signal("J5X")};
    default: return {signal("G1C"), signal("G1W"), signal("G2W"), signal("G2X"), signal("G5X")};
  }
}

/// A value of RINEX 2 by its type.
inline std::string legacy_cell(const gnss::SatelliteObservation& satellite, const std::string& type) {
  const auto c = satellite.satellite.constellation;
  for (const gnss::SignalObservation& s : satellite.signals) {
    if (s.signal.band != type[1]) continue;
    const bool gps = c == gnss::Constellation::gps;
    if (type[0] == 'P' || type[0] == 'C') {
      const bool wants_p = gps && s.signal.attribute == 'W';
      if ((type[0] == 'P') == wants_p) return value_cell(s.code_m);
      continue;
    }
    if (gps && s.signal.attribute == 'W' && s.signal.band == '1') continue;  // only its code is written
    if (type[0] == 'L') return value_cell(s.phase_cycles, lli_digit(s));
    return value_cell(type[0] == 'D' ? s.doppler_hz : s.cn0_dbhz);
  }
  return std::string(16, ' ');
}

/// An epoch of RINEX 2.
inline std::string epoch_2(const gnss::ObservationEpoch& epoch) {
  char count[16];
  std::snprintf(count, sizeof count, "  %d%3d", epoch.power_failure ? 1 : 0, static_cast<int>(epoch.satellites.size()));
  std::string text = ' ' + civil_text(epoch.tag, true) + count;
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (i > 0 && i % 12 == 0) text += '\n' + std::string(32, ' ');
    text += satellite_text(epoch.satellites[i].satellite);
  }
  text += '\n';
  for (const gnss::SatelliteObservation& satellite : epoch.satellites)
    for (std::size_t i = 0; i < legacy_types().size(); ++i) {
      text += legacy_cell(satellite, legacy_types()[i]);
      if (i % 5 == 4 || i + 1 == legacy_types().size()) text += '\n';
    }
  return text;
}

/// A random value on the grid of three decimals, never 0.
inline double grid_value(Rng& rng, double low, double high) {
  const double v = std::round(uniform(rng, low, high) * 1000.0);
  return (v == 0 ? 1.0 : v) / 1000.0;
}

/// A random signal; the code is always there when `with_code`, else nearly always; something always is.
inline gnss::SignalObservation random_signal(Rng& rng, const gnss::SignalCode& code, bool with_code) {
  gnss::SignalObservation s;
  s.signal = code;
  if (with_code || chance(rng, 0.9)) s.code_m = grid_value(rng, 1.9e7, 4.2e7);
  if (chance(rng, 0.9)) {
    s.phase_cycles = grid_value(rng, -9e8, 9e8);
    s.loss_of_lock = chance(rng, 0.1);
    s.half_cycle = chance(rng, 0.1);
  }
  if (chance(rng, 0.9)) s.doppler_hz = grid_value(rng, -5000, 5000);
  s.cn0_dbhz = grid_value(rng, 10, 60);
  return s;
}

/// Random distinct satellites in order, at least one.
inline std::vector<gnss::SatelliteId> random_satellites(Rng& rng, double share) {
  std::vector<gnss::SatelliteId> ids;
  for (std::size_t c = 0; c < gnss::kConstellations; ++c)
    for (int number = 1; number <= (c == 3 ? 9 : 40); ++number)
      if (chance(rng, share)) ids.push_back({static_cast<gnss::Constellation>(c), static_cast<std::uint8_t>(number)});
  if (ids.empty()) ids.push_back({gnss::Constellation::gps, 7});
  return ids;
}

/// A random epoch that RINEX 3 text of the plan can hold.
inline gnss::ObservationEpoch random_epoch(Rng& rng, const RinexTextPlan& plan, GpsTime tag) {
  gnss::ObservationEpoch epoch;
  epoch.tag = tag;
  epoch.power_failure = chance(rng, 0.05);
  for (const gnss::SatelliteId id : random_satellites(rng, uniform(rng, 0.02, 0.3))) {
    gnss::SatelliteObservation satellite{id, {}};
    for (const gnss::SignalCode& s : signals_of(plan, id.constellation))
      if (chance(rng, 0.8)) (void)satellite.signals.push_back(random_signal(rng, s, false));
    if (!satellite.signals.empty()) (void)epoch.satellites.push_back(satellite);
  }
  return epoch;
}

/// A random epoch that RINEX 2 text can hold: L2 needs the code that says which signal it belongs to.
inline gnss::ObservationEpoch random_legacy_epoch(Rng& rng, GpsTime tag) {
  gnss::ObservationEpoch epoch;
  epoch.tag = tag;
  for (const gnss::SatelliteId id : random_satellites(rng, uniform(rng, 0.02, 0.3))) {
    gnss::SatelliteObservation satellite{id, {}};
    const bool codeless = chance(rng, 0.5);
    for (const gnss::SignalCode& s : legacy_signals(id.constellation)) {
      const bool p_code = s.attribute == 'W';
      if (s.constellation == gnss::Constellation::gps && s.band == '2' && p_code != codeless) continue;
      gnss::SignalObservation observation = random_signal(rng, s, true);
      if (p_code && s.band == '1') {
        observation = {};
        observation.signal = s;
        observation.code_m = grid_value(rng, 1.9e7, 4.2e7);
      }
      if (s.band == '1' ? !p_code || chance(rng, 0.5) : chance(rng, 0.8)) (void)satellite.signals.push_back(observation);
    }
    if (!satellite.signals.empty()) (void)epoch.satellites.push_back(satellite);
  }
  return epoch;
}

/// Equal, a missing value being equal to a missing value.
inline bool same_value(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

inline bool same_signal(const gnss::SignalObservation& a, const gnss::SignalObservation& b) {
  return a.signal == b.signal && same_value(a.code_m, b.code_m) && same_value(a.phase_cycles, b.phase_cycles) &&
         same_value(a.doppler_hz, b.doppler_hz) && same_value(a.cn0_dbhz, b.cn0_dbhz) && a.loss_of_lock == b.loss_of_lock &&
         a.half_cycle == b.half_cycle;
}

/// Equal epochs, the order of signals included.
inline bool same_epoch(const gnss::ObservationEpoch& a, const gnss::ObservationEpoch& b) {
  if (a.tag != b.tag || a.power_failure != b.power_failure || a.satellites.size() != b.satellites.size()) return false;
  for (std::size_t i = 0; i < a.satellites.size(); ++i) {
    const gnss::SatelliteObservation &x = a.satellites[i], &y = b.satellites[i];
    if (x.satellite != y.satellite || x.signals.size() != y.signals.size()) return false;
    for (std::size_t k = 0; k < x.signals.size(); ++k)
      if (!same_signal(x.signals[k], y.signals[k])) return false;
  }
  return true;
}

}  // namespace searvins::test
