// SPDX-License-Identifier: BSD-3-Clause
// `searvins info`: what is in each file, for people or as JSON.
#include <cstdio>
#include <string>

#include "examples/searvins/commands.hpp"
#include "examples/support/file_info.hpp"
#include "examples/support/option_parser.hpp"

namespace searvins::examples {

int run_info(int argc, const char* const* argv) {
  OptionParser parser{"searvins info", "says what is in input files of any sort"};
  parser.flag("json", "print a JSON array with one object a file");
  parser.positionals("FILE", "RINEX, IMU log, stereo tracks, truth, trajectory, RTKLIB .pos or rig.json", 1);
  const Options options = parser.parse(argc, argv);
  if (const auto code = options.finished()) return *code;

  bool all_usable = true;
  JsonWriter json;
  json.begin_array();
  std::string text;
  for (const std::string& path : options.positionals()) {
    const FileInfo info = file_info(path);
    all_usable = all_usable && !info.error;
    write_info(json, info);
    text += (text.empty() ? "" : "\n") + info_text(info);
  }
  json.end_array();
  std::fputs(options.flag("json") ? json.text().c_str() : text.c_str(), stdout);
  return all_usable ? kExitDone : kExitUnusableInput;
}

}  // namespace searvins::examples
