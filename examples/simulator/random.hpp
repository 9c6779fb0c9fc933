// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Random numbers that are the same with every compiler: the standard fixes the output of std::mt19937_64 but not that of its
/// distributions, so those are made here, from arithmetic alone.
#pragma once

#include <cstdint>
#include <random>

namespace searvins::simulator {

/// A seeded stream of random numbers.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [low, high).
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(engine_() >> 11U) * 0x1p-53); }

  /// Mean 0, variance 1: twelve uniform numbers less their mean (never beyond 6).
  [[nodiscard]] double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform(0, 1);
    return sum;
  }

  /// Uniform integer in [low, high].
  [[nodiscard]] std::int64_t integer(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(engine_() % static_cast<std::uint64_t>(high - low + 1));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace searvins::simulator
