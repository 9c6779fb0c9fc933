// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// searvins_make_recording FOLDER [SEED]: writes rover.obs, base.obs, nav.rnx and truth.csv of a synthetic drive into an existing folder.
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "recording.hpp"

namespace {

bool write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) std::fprintf(stderr, "error: %s cannot be written\n", path.string().c_str());
  return static_cast<bool>(file);
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t seed = searvins::simulator::kBundledSeed;
  if (argc == 3) {
    const char* end = argv[2] + std::strlen(argv[2]);
    const auto [stop, error] = std::from_chars(argv[2], end, seed);
    if (error != std::errc{} || stop != end) argc = 0;
  }
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: searvins_make_recording FOLDER [SEED]\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const searvins::simulator::Recording recording = searvins::simulator::make_recording(seed);
  const bool written = write(folder / "rover.obs", recording.rover_obs) && write(folder / "base.obs", recording.base_obs) &&
                       write(folder / "nav.rnx", recording.nav_rnx) && write(folder / "truth.csv", recording.truth_csv);
  return written ? 0 : 3;
}
