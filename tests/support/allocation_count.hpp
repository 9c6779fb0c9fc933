// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The count that allocation_counter.hpp keeps, for the other files of an executable that has one of its files include that.
#pragma once

#include <atomic>

namespace searvins::test {

inline std::atomic<unsigned long long> allocation_count{0};
/// Allocations so far in this process; always 0 where nobody counts.
[[nodiscard]] inline unsigned long long heap_allocations() { return allocation_count.load(); }

}  // namespace searvins::test
