// SPDX-License-Identifier: BSD-3-Clause
// The same programs on a desktop: only what they compute is of interest there.
#include <cstdio>

#include "examples/cortex_m/board.hpp"

namespace searvins::cortex_m {

void write(const char* text) { (void)std::fputs(text, stdout); }
std::uint64_t instructions() { return 0; }
std::uint32_t stack_high_water() { return 0; }

}  // namespace searvins::cortex_m
