// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Processor time of this process: what other programs take of the machine does not count.
#pragma once

#include <ctime>

namespace searvins::bench {

/// Milliseconds since the process began.
[[nodiscard]] inline double processor_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

}  // namespace searvins::bench
