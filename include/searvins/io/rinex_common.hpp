// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What RINEX observation and navigation files share: the first line, header labels, civil epochs and time systems.
///
/// A header line is 60 columns of content and a label from column 61. The scale of an epoch tag is named by the file:
///
///     GPS, GAL, QZS, IRN   GPST           (GST and QZSST run in step with GPST)
///     BDT                  GPST = tag + 14 s
///     GLO, UTC             GPST = tag + leap seconds   (RINEX writes GLONASS time as UTC, without Moscow's 3 h)
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_kind.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/text_reader.hpp>

namespace searvins::io {

/// Scale of the epoch tags of a file.
enum class TimeSystem : std::uint8_t { gps, beidou, utc };

/// The first line of a RINEX file.
struct RinexFirstLine {
  double version{0};  ///< 2.00 .. 2.99, 3.00 .. 3.99, 4.00 .. 4.99
  char type{' '};     ///< O, N, ...
  char system{' '};   ///< G, R, E, C, J, I, S, M (mixed), blank (GPS)
  [[nodiscard]] int major() const { return static_cast<int>(version); }
};

/// Label of a header line.
[[nodiscard]] constexpr std::string_view header_label(std::string_view line) { return without_blanks(field(line, 60, 20)); }

/// Time system of a three-letter name; nothing for an unknown one.
[[nodiscard]] inline std::optional<TimeSystem> time_system_from_text(std::string_view name) {
  if (name == "GPS" || name == "GAL" || name == "QZS" || name == "IRN") return TimeSystem::gps;
  if (name == "BDT" || name == "BDS") return TimeSystem::beidou;
  if (name == "GLO" || name == "UTC") return TimeSystem::utc;
  return std::nullopt;
}

/// A civil date and a time of day that is exact: no double between the text and the nanosecond.
struct CivilEpoch {
  int year{0}, month{0}, day{0}, hour{0}, minute{0};
  std::int64_t second_ns{0};

  /// A date of the calendar between 1980 and 2099, a time of day that exists (61 s allowed for a leap second).
  [[nodiscard]] bool valid() const {
    constexpr int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    if (year < 1980 || year > 2099 || month < 1 || month > 12 || day < 1) return false;
    const bool leap_day = month == 2 && year % 4 == 0;  // holds from 1980 to 2099
    return day <= days[month - 1] + (leap_day ? 1 : 0) && hour >= 0 && hour < 24 && minute >= 0 && minute < 60 && second_ns >= 0 &&
           second_ns < 61 * kNanosecondsPerSecond;
  }

  /// As GPS time.
  [[nodiscard]] GpsTime to_gps(TimeSystem system) const {
    const GpsTime reading{gps_from_civil({year, month, day, hour, minute, 0.0}).ns + second_ns};
    if (system == TimeSystem::beidou) return {reading.ns + kBeidouLagSeconds * kNanosecondsPerSecond};
    if (system == TimeSystem::utc)
      return searvins::to_gps(UtcTime{reading.ns + kGpsEpochUnixDays * kSecondsPerDay * kNanosecondsPerSecond});
    return reading;
  }
};

/// Year of a two-digit one: 80 .. 99 are 1980 .. 1999.
[[nodiscard]] constexpr int full_year(int two_digits) { return two_digits + (two_digits >= 80 ? 1900 : 2000); }

/// Opens a reader's file or text: refuses what is not there, what is compressed, and what is no RINEX of the expected type.
/// On success the reader stands before the second line. `expected` is 'O' or 'N'.
[[nodiscard]] inline std::optional<Diagnostic> read_first_line(TextReader& reader, char expected, RinexFirstLine& out) {
  const std::string what = expected == 'O' ? "observation" : "navigation";
  const SniffedFile sniffed = sniff_text(reader.head());
  if (auto refused = refuse_compressed(sniffed.kind, reader.name())) return refused;
  std::string_view line;
  if (!reader.next(line)) return Diagnostic{reader.name(), 0, "the file is empty", "get the recording again, the transfer may have failed"};
  const auto problem = [&](std::string message, std::string hint) {
    return Diagnostic{reader.name(), 1, std::move(message), std::move(hint)};
  };
  if (header_label(line) != "RINEX VERSION / TYPE") {
    if (line.find('\t') != std::string_view::npos)
      return problem("tab characters in the first header line: RINEX is a fixed-column format",
                     "run `expand " + reader.name() + "` and use its output");
    const std::string found = sniffed.kind == FileKind::unknown ? std::string{"no label 'RINEX VERSION / TYPE' in column 61"}
                                                                : std::string{"it looks like: "} + name_of(sniffed.kind);
    return problem("this is no RINEX file: " + found,
                   "give a RINEX " + what + " file, made with the receiver's converter or RTKLIB's convbin");
  }
  out = {sniffed.rinex_version, sniffed.rinex_type, column(line, 40)};
  if (out.major() < 2 || out.major() > 4)
    return problem("RINEX version '" + std::string{without_blanks(field(line, 0, 9))} + "' is not supported",
                   "convert the file to version 2.11, 3.0x or 4.0x, for instance with gfzrnx or convbin");
  if (out.type == expected) return std::nullopt;
  if (expected == 'O' && out.type == 'N')
    return problem("this is a navigation file, observations are expected here",
                   "pass it as --nav, and the receiver's observation file as --rover or --base");
  if (expected == 'N' && out.type == 'O')
    return problem("this is an observation file, broadcast ephemerides are expected here",
                   "pass it as --rover or --base, and the navigation file as --nav");
  if (expected == 'N' && out.type == 'G')
    return problem("this is a GLONASS navigation file, and GLONASS is not used",
                   "give the navigation file of GPS, Galileo, BeiDou or QZSS");
  return problem(std::string{"RINEX file type '"} + out.type + "' is not supported",
                 "give a RINEX " + what + " file (type " + expected + ')');
}

/// Why a header line with a tab cannot be read; nothing for a good line or a comment.
[[nodiscard]] inline std::optional<Diagnostic> refuse_tab_in_header(const TextReader& reader, std::string_view line) {
  if (line.find('\t') == std::string_view::npos || header_label(line) == "COMMENT") return std::nullopt;
  return Diagnostic{reader.name(), reader.line_number(), "tab character in the header: RINEX is a fixed-column format",
                    "run `expand " + reader.name() + "` and use its output"};
}

}  // namespace searvins::io
