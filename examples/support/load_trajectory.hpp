// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Loads a trajectory from what a user names: a run's folder, a trajectory.csv or an RTKLIB .pos file, told apart by content.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <searvins/io/rtklib_solution.hpp>
#include <searvins/io/trajectory.hpp>

namespace searvins::examples {

/// Rows and a short name for tables.
struct LoadedTrajectory {
  std::string name;
  std::vector<io::TrajectoryRow> rows;
};

/// Loads rows from a folder (its trajectory.csv) or a file.
[[nodiscard]] inline io::FileResult<LoadedTrajectory> load_trajectory(const std::string& given) {
  std::error_code code;
  std::filesystem::path path{given};
  const bool is_folder = std::filesystem::is_directory(path, code);
  if (is_folder) path /= "trajectory.csv";
  const io::FileResult<std::string> text = io::read_text_file(path.string());
  if (!text) return text.error();
  io::FileResult<std::vector<io::TrajectoryRow>> rows =
      text->front() == '%' ? io::parse_rtklib_solution(*text, path.string()) : io::parse_trajectory(*text, path.string());
  if (!rows) return rows.error();
  const std::filesystem::path folder = std::filesystem::path{given}.lexically_normal();
  std::string name =
      is_folder ? (folder.has_filename() ? folder.filename() : folder.parent_path().filename()).string() : path.stem().string();
  if (name == "trajectory" && path.has_parent_path()) name = path.parent_path().filename().string();
  return LoadedTrajectory{name.empty() || name == "." ? given : name, std::move(rows).value()};
}

}  // namespace searvins::examples
