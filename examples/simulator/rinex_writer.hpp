// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// RINEX 3.04 text of simulated observations and broadcast records.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include <searvins/core/time.hpp>

#include "orbit.hpp"
#include "receiver.hpp"

namespace searvins::simulator {

/// printf into a string; at most 255 characters.
[[gnu::format(printf, 1, 2)]] inline std::string formatted(const char* format, ...) {
  char text[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

/// A header record: content in 60 columns, then its label.
[[nodiscard]] inline std::string header_record(const std::string& content, const char* label) {
  return formatted("%-60s%-20s\n", content.c_str(), label);
}

[[nodiscard]] inline std::string observation_header(const std::string& marker, const Eigen::Vector3d& near_e_m, GpsTime start,
                                                    double interval_s = 1.0) {
  std::string text = header_record(formatted("%9.2f%11s%-20s%s", 3.04, "", "OBSERVATION DATA", "M: MIXED"), "RINEX VERSION / TYPE");
  text += header_record(formatted("%-20s%-20s20250101 000000 UTC", "searvins_make_recor", "synthetic"), "PGM / RUN BY / DATE");
  text += header_record("Simulated: no receiver recorded this", "COMMENT");
  text += header_record(marker, "MARKER NAME");
  text += header_record(formatted("%-20s%-20s", "simulator", "searvins"), "OBSERVER / AGENCY");
  text += header_record(formatted("%-20s%-20s%-20s", "1", "SIMULATED", "1"), "REC # / TYPE / VERS");
  text += header_record(formatted("%-20s%-20s", "1", "NONE"), "ANT # / TYPE");
  text += header_record(formatted("%14.4f%14.4f%14.4f", near_e_m.x(), near_e_m.y(), near_e_m.z()), "APPROX POSITION XYZ");
  text += header_record(formatted("%14.4f%14.4f%14.4f", 0.0, 0.0, 0.0), "ANTENNA: DELTA H/E/N");
  for (const char system : {'G', 'E', 'C'}) {
    std::string types;
    int count = 0;
    for (const Signal& s : kSignals) {
      if (s.system != system) continue;
      for (const char quantity : {'C', 'L', 'D', 'S'}) types += formatted(" %c%s", quantity, s.code), ++count;
    }
    text += header_record(formatted("%c  %3d", system, count) + types, "SYS / # / OBS TYPES");
  }
  text += header_record("DBHZ", "SIGNAL STRENGTH UNIT");
  text += header_record(formatted("%10.3f", interval_s), "INTERVAL");
  const CivilTime c = civil_from_gps(start);
  text +=
      header_record(formatted("%6d%6d%6d%6d%6d%13.7f     GPS", c.year, c.month, c.day, c.hour, c.minute, c.second), "TIME OF FIRST OBS");
  for (const Signal& s : kSignals) text += header_record(formatted("%c L%s", s.system, s.code), "SYS / PHASE SHIFT");
  return text + header_record("", "END OF HEADER");
}

/// An epoch with its satellites; every signal of a constellation has its four columns, blank when it is not tracked.
[[nodiscard]] inline std::string observation_epoch(const Epoch& epoch, GpsTime start) {
  const CivilTime c = civil_from_gps(start.plus_seconds(epoch.tag_s));
  std::string text = formatted("> %04d %02d %02d %02d %02d%11.7f  0%3d\n", c.year, c.month, c.day, c.hour, c.minute, c.second,
                               static_cast<int>(epoch.satellites.size()));
  for (const SatelliteMeasurements& satellite : epoch.satellites) {
    text += formatted("%c%02d", satellite.system, satellite.number);
    for (const Measurement& m : satellite.signals) {
      if (!m.has_code) {
        text += std::string(64, ' ');
        continue;
      }
      const int strength = std::clamp(static_cast<int>(m.cn0_dbhz / 6), 1, 9);
      const char lli = m.lli == 0 ? ' ' : static_cast<char>('0' + m.lli);
      text += formatted("%14.3f  ", m.code_m);
      text += m.has_phase ? formatted("%14.3f%c%d", m.phase_cycles, lli, strength) : std::string(16, ' ');
      text += formatted("%14.3f  %14.3f  ", m.doppler_hz, m.cn0_dbhz);
    }
    while (text.back() == ' ') text.pop_back();
    text += '\n';
  }
  return text;
}

/// One navigation record: the epoch line and seven lines of four numbers.
[[nodiscard]] inline std::string navigation_record(const Orbit& o) {
  const bool beidou = o.system == 'C', galileo = o.system == 'E';
  const GpsTime own_time{o.toe.ns - (beidou ? kBeidouLagSeconds * kNanosecondsPerSecond : 0)};
  const CivilTime c = civil_from_gps(own_time);
  const double week = static_cast<double>(o.toe.week() - (beidou ? kBeidouWeekOffset : 0));
  const double issue = (beidou ? 1 : o.number + 40) + o.issue_shift, accuracy_m = galileo ? 3.12 : 2.0;
  const double source = galileo ? 517 : beidou ? 0 : 1;
  const double sent_s = o.toe_of_week_s - (o.system == 'G' ? 7182 : galileo ? -600 : 0);
  const double delays[2] = {galileo ? o.other_delay_s : o.delay_s, galileo ? o.delay_s : beidou ? o.other_delay_s : issue};
  const double rows[7][4] = {{issue, o.crs, o.delta_n, o.m0},
                             {o.cuc, o.eccentricity, o.cus, o.sqrt_a},
                             {o.toe_of_week_s, o.cic, o.omega0, o.cis},
                             {o.i0, o.crc, o.omega, o.omega_dot},
                             {o.i_dot, source, week, 0},
                             {accuracy_m, 0, delays[0], delays[1]},
                             {sent_s,
                              galileo  ? 0.0
                              : beidou ? 1.0
                                       : 4.0,
                              0, 0}};
  std::string text = formatted("%c%02d %04d %02d %02d %02d %02d %02d%19.12E%19.12E%19.12E\n", o.system, o.number, c.year, c.month, c.day,
                               c.hour, c.minute, static_cast<int>(c.second), o.af0, o.af1, 0.0);
  for (const auto& row : rows) text += formatted("    %19.12E%19.12E%19.12E%19.12E\n", row[0], row[1], row[2], row[3]);
  return text;
}

/// A navigation file; the Klobuchar coefficients are ordinary ones and do not describe the simulated ionosphere exactly.
[[nodiscard]] inline std::string navigation_file(const std::vector<Orbit>& orbits) {
  std::string text = header_record(formatted("%9.2f%11s%-20s%s", 3.04, "", "N: GNSS NAV DATA", "M: MIXED"), "RINEX VERSION / TYPE");
  text += header_record(formatted("%-20s%-20s20250101 000000 UTC", "searvins_make_recor", "synthetic"), "PGM / RUN BY / DATE");
  text += header_record("Simulated: these satellites do not exist", "COMMENT");
  text += header_record(formatted("GPSA %12.4E%12.4E%12.4E%12.4E", 1.118e-8, 1.490e-8, -5.960e-8, -5.960e-8), "IONOSPHERIC CORR");
  text += header_record(formatted("GPSB %12.4E%12.4E%12.4E%12.4E", 8.806e4, 1.638e4, -1.966e5, -1.311e5), "IONOSPHERIC CORR");
  text += header_record(formatted("%6d", 18), "LEAP SECONDS");
  text += header_record("", "END OF HEADER");
  for (const Orbit& o : orbits) text += navigation_record(o);
  return text;
}

}  // namespace searvins::simulator
