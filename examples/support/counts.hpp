// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How often something happened, in words, in the order in which it happened first.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace searvins::examples {

/// Something that happened so many times.
using Count = std::pair<std::string, long>;

/// Adds `n` to the count of a text.
inline void add_count(std::vector<Count>& counts, const std::string& what, long n = 1) {
  for (auto& [text, count] : counts)
    if (text == what) return void(count += n);
  counts.emplace_back(what, n);
}

}  // namespace searvins::examples
