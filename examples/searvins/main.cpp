// SPDX-License-Identifier: BSD-3-Clause
// The `searvins` command: picks the subcommand.
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/version.hpp>

#include "examples/searvins/commands.hpp"
#include "examples/support/option_parser.hpp"

namespace {

using namespace searvins::examples;

struct Command {
  const char* name;
  const char* summary;
  int (*run)(int, const char* const*);
};

constexpr Command kCommands[] = {
    {"solve", "solves a recording: trajectory, covariance, fix status, report", run_solve},
    {"info", "says what is in an input file", run_info},
    {"evaluate", "scores trajectories against a truth, in the paper's tables", run_evaluate},
    {"simulate", "makes a drive with GNSS, IMU and stereo tracks, and the truth about it", run_simulate},
    {"demo", "solves a small bundled recording and writes its report", run_demo},
};

std::string usage() {
  std::string text = std::string{"searvins "} + searvins::kVersionString +
                     ": tightly coupled RTK-GNSS, inertial and stereo positioning\n\nusage: searvins COMMAND [options]\n\n";
  for (const Command& command : kCommands)
    text += "  " + std::string{command.name} + std::string(12 - std::string_view{command.name}.size(), ' ') + command.summary + '\n';
  return text +
         "\nsearvins COMMAND --help lists the options of a command.\nExit codes: 0 done, 2 usage, 3 unusable input, 4 the run ended "
         "without a solution.\n";
}

}  // namespace

int searvins::examples::unusable_input(const char* command, const io::Diagnostic& error) {
  std::fprintf(stderr, "searvins %s: %s\n", command, io::to_string(error).c_str());
  return kExitUnusableInput;
}

int main(int argc, char** argv) {
  const std::string_view name = argc > 1 ? argv[1] : "";
  if (name.empty()) return std::fputs(usage().c_str(), stderr), kExitUsage;
  if (name == "--help" || name == "-h" || name == "help") return std::fputs(usage().c_str(), stdout), kExitDone;
  if (name == "--version") return std::printf("searvins %s\n", searvins::kVersionString), kExitDone;
  std::vector<std::string> names;
  for (const Command& command : kCommands) {
    if (name == command.name) return command.run(argc - 1, argv + 1);
    names.emplace_back(command.name);
  }
  const std::string nearest = nearest_word(name, names);
  std::fprintf(stderr, "searvins: unknown command '%s'%s\nsearvins --help lists them.\n", argv[1],
               nearest.empty() ? "" : (": did you mean " + nearest + '?').c_str());
  return kExitUsage;
}
