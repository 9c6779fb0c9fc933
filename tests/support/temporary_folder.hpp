// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A folder for the files of one test: empty at the beginning, gone at the end.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace searvins::test {

/// `name` tells it from the folders of other tests, which may run at the same time.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name) : path_(std::filesystem::temp_directory_path() / ("searvins_" + name)) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code failed;
    std::filesystem::remove_all(path_, failed);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace searvins::test
