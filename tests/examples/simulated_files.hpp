// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Simulations and their files, by a word each.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "examples/simulator/dataset.hpp"

namespace searvins::test {

inline simulator::SimulationOptions options_of(const char* profile, double duration_s, std::uint64_t seed) {
  simulator::SimulationOptions options;
  options.profile = profile, options.duration_s = duration_s, options.seed = seed;
  return options;
}

inline const std::string& text_of(const simulator::Dataset& set, const std::string& name) {
  const auto found = std::find_if(set.files.begin(), set.files.end(), [&](const auto& f) { return f.name == name; });
  REQUIRE_MESSAGE(found != set.files.end(), name);
  return found->text;
}

}  // namespace searvins::test
