// SPDX-License-Identifier: BSD-3-Clause
// Asks for heap. It must not link: the images are linked without any, and this shows that the linker would say so.
#include <cstddef>

#include "examples/cortex_m/transcript.hpp"

int* volatile kept;  // else the compiler may do without the memory

int main() {
  kept = new int[static_cast<std::size_t>(searvins::cortex_m::stack_high_water())];
  return searvins::cortex_m::finish(kept != nullptr);
}
