// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Random numbers by place instead of by turn: what is drawn at (seed, i, j) does not depend on what was drawn before.
#pragma once

#include <cstdint>

namespace searvins::simulator {

/// A number whose every bit depends on every bit of x (the finaliser of splitmix64, Steele et al. 2014).
[[nodiscard]] constexpr std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ x >> 30U) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ x >> 27U) * 0x94D049BB133111EBULL;
  return x ^ x >> 31U;
}

/// Uniform in [0, 1), one number for each (seed, i, j).
[[nodiscard]] constexpr double uniform_at(std::uint64_t seed, std::int64_t i, std::int64_t j = 0) {
  const std::uint64_t row = scrambled(seed ^ scrambled(static_cast<std::uint64_t>(i)));
  return static_cast<double>(scrambled(row ^ static_cast<std::uint64_t>(j)) >> 11U) * 0x1p-53;
}

}  // namespace searvins::simulator
