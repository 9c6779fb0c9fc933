// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the programs of this folder ask of the machine below them: startup.cpp answers on the target, host_board.cpp on the host.
#pragma once

#include <cstdint>

namespace searvins::cortex_m {

/// Writes a text to standard output.
void write(const char* text);

/// Instructions executed since the start, in steps of 40; right under QEMU with -icount shift=0 only. 0 on the host.
[[nodiscard]] std::uint64_t instructions();

/// The most bytes of stack that were ever in use; 0 on the host.
[[nodiscard]] std::uint32_t stack_high_water();

}  // namespace searvins::cortex_m
