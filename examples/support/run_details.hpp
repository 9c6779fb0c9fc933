// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What stands beside a trajectory: the sensors of the run (summary.json) and the ratios of the integer vectors (solution.pos).
///
/// Both are optional. A .pos file is its own source of ratios; a run's folder has solution.pos with a line for each row of trajectory.csv.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <searvins/io/text_fields.hpp>

#include "examples/support/json.hpp"

namespace searvins::examples {

/// The sensors of a run, in the words of the paper's table.
struct SensorConfiguration {
  bool is_known{false};
  std::string gnss{};    ///< r, r+b; TC, LC before it with an inertial unit; empty: none
  std::string vision{};  ///< M: monocular, S: stereo; empty: none
  bool has_imu{false};
};

/// Reads them from the text of a summary.json; not known when it is none.
[[nodiscard]] inline SensorConfiguration configuration_of(std::string_view summary_json) {
  SensorConfiguration c;
  const io::FileResult<Json> json = parse_json(summary_json, "summary.json");
  const Json* settings = json ? json->find("settings") : nullptr;
  if (!settings) return c;
  const auto has = [settings](const char* key) { return settings->find(key) != nullptr; };
  c.is_known = true;
  c.has_imu = has("inertial unit");
  if (json->find("stereo")) c.vision = has("camera") && settings->find("camera")->string == "monocular" ? "M" : "S";
  if (has("positions"))
    c.gnss = "LC";
  else if (has("rover"))
    c.gnss = std::string{c.has_imu ? "TC, " : ""} + (has("base") ? "r+b" : "r");
  return c;
}

/// Ratios of a .pos file: the last column, where its header names it so. Empty when there is no such column or a line is not a number.
[[nodiscard]] inline std::vector<double> ratios_of(std::string_view pos_text) {
  std::vector<double> ratios;
  bool has_column = false;
  io::LineReader lines{pos_text};
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = io::split_words(line);
    if (words.empty()) continue;
    if (words.front().front() == '%') {
      has_column = has_column || words.back() == "ratio";
      continue;
    }
    double ratio = 0;
    if (!has_column || !io::parse_number(words.back(), ratio)) return {};
    ratios.push_back(ratio);
  }
  return ratios;
}

/// What stands beside a trajectory that load_trajectory() accepts. `ratios` has as many entries as the trajectory rows, or none.
struct RunDetails {
  SensorConfiguration configuration{};
  std::vector<double> ratios{};
};

/// Looks for both, in the folder that was given or that of the file that was given.
[[nodiscard]] inline RunDetails find_run_details(const std::string& given, std::size_t rows) {
  std::error_code code;
  const std::filesystem::path path{given};
  const bool is_folder = std::filesystem::is_directory(path, code), is_run = is_folder || path.filename() == "trajectory.csv";
  const std::filesystem::path folder = is_folder ? path : path.parent_path();
  RunDetails details;
  if (is_run)
    if (const io::FileResult<std::string> text = io::read_text_file((folder / "summary.json").string()))
      details.configuration = configuration_of(*text);
  if (const io::FileResult<std::string> text = io::read_text_file((is_run ? folder / "solution.pos" : path).string()))
    details.ratios = ratios_of(*text);
  if (details.ratios.size() != rows) details.ratios.clear();
  return details;
}

}  // namespace searvins::examples
