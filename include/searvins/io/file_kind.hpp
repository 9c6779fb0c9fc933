// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What sort of file this is, told from its first bytes, never from its name: receivers, services and users name RINEX files in a
/// dozen ways. Also the messages for the sorts that need a tool first (compressed files).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <searvins/io/diagnostic.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/text_reader.hpp>

namespace searvins::io {

/// Sorts of input files.
enum class FileKind : std::uint8_t {
  unreadable,         ///< missing, a folder, empty or without permission
  rinex_observation,  ///< RINEX 2, 3, 4 observations
  rinex_navigation,   ///< RINEX 2, 3, 4 broadcast ephemerides
  rinex_other,        ///< RINEX of another type: meteorology, clocks, GLONASS navigation of RINEX 2
  hatanaka,           ///< RINEX observations, Hatanaka compressed
  gzip,
  unix_compress,
  zip,
  bzip2,
  xz,
  imu_csv,        ///< comma separated, named or seven columns, or EuRoC's
  lord_log,       ///< week, whole_seconds, fractional_seconds, ax, ay, az, gx, gy, gz
  stereo_tracks,  ///< t_gps_sow,track_id,...
  trajectory,     ///< what `searvins solve` writes
  truth,          ///< reference trajectory: named columns, or week,sow,x,y,z
  rtklib_pos,     ///< RTKLIB solution
  json,
  unknown,
};

/// Name of a sort, for messages.
[[nodiscard]] constexpr const char* name_of(FileKind kind) {
  switch (kind) {
    case FileKind::unreadable: return "unreadable";
    case FileKind::rinex_observation: return "RINEX observation";
    case FileKind::rinex_navigation: return "RINEX navigation";
    case FileKind::rinex_other: return "RINEX of another type";
    case FileKind::hatanaka: return "Hatanaka-compressed RINEX";
    case FileKind::gzip: return "gzip";
    case FileKind::unix_compress: return "Unix compress (.Z)";
    case FileKind::zip: return "zip";
    case FileKind::bzip2: return "bzip2";
    case FileKind::xz: return "xz";
    case FileKind::imu_csv: return "IMU CSV";
    case FileKind::lord_log: return "LORD IMU log";
    case FileKind::stereo_tracks: return "stereo tracks";
    case FileKind::trajectory: return "trajectory";
    case FileKind::truth: return "truth";
    case FileKind::rtklib_pos: return "RTKLIB solution";
    case FileKind::json: return "JSON";
    case FileKind::unknown: return "unknown";
  }
  return "unknown";
}

/// A sort, and for RINEX the version and type letter of the first line.
struct SniffedFile {
  FileKind kind{FileKind::unknown};
  double rinex_version{0};
  char rinex_type{' '};
};

namespace detail {

/// The first line that is neither empty nor (when `skip_comments`) a comment.
[[nodiscard]] inline std::string_view first_line(std::string_view text, bool skip_comments) {
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    line = without_blanks(line);
    if (!line.empty() && !(skip_comments && line.front() == '#')) return line;
  }
  return {};
}

/// Number of comma-separated fields when all are numbers, else 0.
[[nodiscard]] inline int count_numbers(std::string_view line) {
  int n = 0;
  while (true) {
    const std::size_t comma = line.find(',');
    double value = 0;
    if (read_exponential(line.substr(0, comma), value) != FieldState::number) return 0;
    ++n;
    if (comma == std::string_view::npos) return n;
    line.remove_prefix(comma + 1);
  }
}

[[nodiscard]] inline FileKind kind_of_table(std::string_view head) {
  const auto has = [](std::string_view line, std::string_view word) { return line.find(word) != std::string_view::npos; };
  const std::string_view first = first_line(head, false);
  if (!first.empty() && first.front() == '{') return FileKind::json;
  if (!first.empty() && first.front() == '%') return FileKind::rtklib_pos;
  if (has(first, "track_id")) return FileKind::stereo_tracks;
  if (has(first, "ecef_x_m") && has(first, "status")) return FileKind::trajectory;
  if (has(first, "ant_x") || has(first, "ecef_x") || has(first, "ECEF X") || has(first, "ecefX")) return FileKind::truth;
  if (has(first, ",") && (has(first, "w_RS_S_x") || has(first, "gx") || (has(first, "gyro") && !has(first, "gyro1")) || has(first, "wx_"))) return FileKind::imu_csv;
  const std::string_view row = first_line(head, true);
  const int numbers = count_numbers(row);
  if (numbers == 7) return FileKind::imu_csv;
  if (numbers == 9) return FileKind::lord_log;
  if (numbers >= 5) return FileKind::truth;
  return FileKind::unknown;
}

}  // namespace detail

/// Tells the sort from the first bytes of a file (1024 are plenty).
[[nodiscard]] inline SniffedFile sniff_text(std::string_view head) {
  const auto begins = [head](std::string_view magic) { return head.substr(0, magic.size()) == magic; };
  if (head.empty()) return {FileKind::unreadable};
  if (begins("\x1f\x8b")) return {FileKind::gzip};
  if (begins("\x1f\x9d") || begins("\x1f\xa0")) return {FileKind::unix_compress};
  if (begins("PK\x03\x04")) return {FileKind::zip};
  if (begins("BZh")) return {FileKind::bzip2};
  if (begins("\xfd"
             "7zXZ"))
    return {FileKind::xz};

  const std::string_view line = head.substr(0, head.find('\n'));
  const std::string_view label = field(line, 60, 20);
  if (label.substr(0, 12) == "CRINEX VERS ") return {FileKind::hatanaka};
  if (label.substr(0, 20) != "RINEX VERSION / TYPE") return {detail::kind_of_table(head)};
  SniffedFile sniffed{FileKind::rinex_other, 0, column(line, 20)};
  if (read_fixed(field(line, 0, 9), sniffed.rinex_version) != FieldState::number) sniffed.rinex_version = 0;
  if (sniffed.rinex_type == 'O') sniffed.kind = FileKind::rinex_observation;
  if (sniffed.rinex_type == 'N') sniffed.kind = FileKind::rinex_navigation;
  return sniffed;
}

/// Tells the sort of a file.
[[nodiscard]] inline SniffedFile sniff(const std::filesystem::path& path) {
  TextReader reader;
  if (reader.open(path)) return {FileKind::unreadable};
  return sniff_text(reader.head());
}

/// For a sort that must be converted first: what it is and the tool to run. Nothing for the others.
[[nodiscard]] inline std::optional<Diagnostic> refuse_compressed(FileKind kind, const std::string& file) {
  const auto packed = [&](const char* what, const std::string& tool) {
    return Diagnostic{file, 0, std::string{"the file is "} + what + " compressed", "run `" + tool + ' ' + file + "` first"};
  };
  switch (kind) {
    case FileKind::gzip: return packed("gzip", "gunzip");
    case FileKind::unix_compress: return packed("Unix compress (.Z)", "gunzip");
    case FileKind::zip: return packed("zip", "unzip");
    case FileKind::bzip2: return packed("bzip2", "bunzip2");
    case FileKind::xz: return packed("xz", "unxz");
    case FileKind::hatanaka: {
      Diagnostic d = packed("Hatanaka (CRINEX)", "CRX2RNX");
      d.line = 1;
      return d;
    }
    default: return std::nullopt;
  }
}

}  // namespace searvins::io
