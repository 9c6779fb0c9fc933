// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Runs the built `searvins` command (macro SEARVINS_COMMAND: its path) and keeps its exit code and what it printed.
#pragma once

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdio>
#include <string>

#if __has_include(<sys/wait.h>)
#include <sys/wait.h>
#endif

#ifdef SEARVINS_COMMAND
namespace searvins::test {

/// What a call of the command came to.
struct Outcome {
  int exit_code{-1};
  std::string output;  ///< stdout and stderr
};

/// Calls `searvins ARGUMENTS` through the shell.
inline Outcome run(const std::string& arguments) {
  Outcome outcome;
  std::FILE* pipe = popen(("'" SEARVINS_COMMAND "' " + arguments + " 2>&1").c_str(), "r");
  REQUIRE(pipe);
  char block[4096];
  for (std::size_t n; (n = std::fread(block, 1, sizeof block, pipe)) > 0;) outcome.output.append(block, n);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  return outcome;
}

/// Whether the printed text contains `part`.
inline bool has(const Outcome& outcome, const std::string& part) { return outcome.output.find(part) != std::string::npos; }

}  // namespace searvins::test
#endif  // SEARVINS_COMMAND
