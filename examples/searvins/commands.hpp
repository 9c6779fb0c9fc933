// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The subcommands of `searvins`. Each takes its own arguments (argv[0] is the subcommand's name) and returns the exit code:
/// 0 done, 2 usage, 3 unusable input, 4 the run ended degraded.
#pragma once

#include <searvins/io/diagnostic.hpp>

namespace searvins::examples {

int run_solve(int argc, const char* const* argv);     ///< recordings -> trajectory, report
int run_solve_euroc(int argc, const char* const* argv);  ///< `solve --dataset euroc`: stereo-inertial, without GNSS
int run_info(int argc, const char* const* argv);      ///< what is in an input file
int run_evaluate(int argc, const char* const* argv);  ///< scores trajectories against a truth
int run_simulate(int argc, const char* const* argv);  ///< makes a drive with all its sensors
int run_demo(int argc, const char* const* argv);      ///< solves the bundled recording

/// Says on stderr what is wrong with an input and returns the exit code for it.
[[nodiscard]] int unusable_input(const char* command, const io::Diagnostic& error);

}  // namespace searvins::examples
