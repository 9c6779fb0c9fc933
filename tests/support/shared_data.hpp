// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where the shared recordings and reference answers lie. They are no part of the repository, so a test that wants them must
/// do without:
///
///     const auto shared = searvins::test::shared_data();
///     if (!shared) {
///       MESSAGE("SKIPPED: shared data not found");
///       return;
///     }
///     read(*shared / "data/real/kamakura_drive_2021/rover.obs");
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

namespace searvins::test {

/// The folder that holds `data/` and `peers/`: the environment variable SEARVINS_SHARED_DIR if set (it alone counts then, so an
/// empty or wrong one hides the data), else the build's SEARVINS_SHARED_DIR (../shared beside the project). Nothing when it is no folder.
[[nodiscard]] inline std::optional<std::filesystem::path> shared_data() {
  std::filesystem::path folder;
  if (const char* named = std::getenv("SEARVINS_SHARED_DIR")) {
    folder = named;
  } else {
#ifdef SEARVINS_SHARED_DIR
    folder = SEARVINS_SHARED_DIR;
#endif
  }
  std::error_code error;
  if (folder.empty() || !std::filesystem::is_directory(folder, error)) return std::nullopt;
  return folder;
}

}  // namespace searvins::test
