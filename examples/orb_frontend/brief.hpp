// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Steered BRIEF: 256 comparisons of smoothed grey values around a corner, in a pattern turned to the corner's orientation.
///
///     bit i = I(c + R(angle) a_i) < I(c + R(angle) b_i)
///
/// [Calonder et al., ECCV 2010; Rublee et al., ICCV 2011]. The pattern is this file's own: pairs of points from a bell-shaped distribution
/// around the centre, drawn by a seeded generator when the program is compiled. A pair must be at least 4 px long, and no two pairs may
/// begin and end within 2 px of each other, since they would say the same twice. Angles are rounded to 1/32 of a turn and the turned
/// patterns are tabulated.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <searvins/vision/image_view.hpp>

namespace searvins::orb {

/// 256 bits.
using Descriptor = std::array<std::uint64_t, 4>;

/// Bits that differ, 0 .. 256.
[[nodiscard]] inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
#if defined(__POPCNT__) || !defined(__x86_64__)
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) + std::popcount(a[3] ^ b[3]);
#else
  // The oldest x86-64 cannot count bits: the four words are added up side by side, in fields of 2, 4, 8 and 16 bits.
  constexpr std::uint64_t k1 = 0x5555555555555555, k2 = 0x3333333333333333, k4 = 0x0f0f0f0f0f0f0f0f, k8 = 0x00ff00ff00ff00ff;
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < 4; i += 2) {
    std::uint64_t v = a[i] ^ b[i], w = a[i + 1] ^ b[i + 1];
    v -= (v >> 1U) & k1;
    w -= (w >> 1U) & k1;
    const std::uint64_t nibbles = (v & k2) + ((v >> 2U) & k2) + (w & k2) + ((w >> 2U) & k2);  // each at most 8
    bytes += (nibbles & k4) + ((nibbles >> 4U) & k4);                                         // each at most 32 in the end
  }
  const std::uint64_t shorts = (bytes & k8) + ((bytes >> 8U) & k8);
  return static_cast<int>((shorts * 0x0001000100010001) >> 48U);
#endif
}

/// One comparison: (ax, ay) against (bx, by), pixels from the corner.
struct PointPair {
  std::int8_t ax{0}, ay{0}, bx{0}, by{0};
};

namespace detail {

inline constexpr int kPatternRadius = 13;  // px

/// SplitMix64 [Steele et al., OOPSLA 2014], because the standard's generators do not run at compile time.
class PatternRandom {
 public:
  constexpr explicit PatternRandom(std::uint64_t seed) : state_(seed) {}

  /// Bell-shaped around 0, standard deviation 6 or so, whole numbers in [-18, 18].
  [[nodiscard]] constexpr int bell() {
    int sum = 0;
    for (int i = 0; i < 3; ++i) sum += static_cast<int>(next() % 13) - 6;
    return sum;
  }

 private:
  [[nodiscard]] constexpr std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111eb;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

[[nodiscard]] constexpr bool within(int x, int y, int radius) { return x * x + y * y <= radius * radius; }

[[nodiscard]] constexpr bool says_the_same(const PointPair& p, const PointPair& q) {
  return (within(p.ax - q.ax, p.ay - q.ay, 2) && within(p.bx - q.bx, p.by - q.by, 2)) ||
         (within(p.ax - q.bx, p.ay - q.by, 2) && within(p.bx - q.ax, p.by - q.ay, 2));
}

[[nodiscard]] constexpr std::array<PointPair, 256> draw_pattern(std::uint64_t seed) {
  PatternRandom random{seed};
  std::array<PointPair, 256> pattern{};
  for (std::size_t count = 0; count < pattern.size();) {
    const int ax = random.bell(), ay = random.bell(), bx = random.bell(), by = random.bell();
    if (!within(ax, ay, kPatternRadius) || !within(bx, by, kPatternRadius) || within(ax - bx, ay - by, 3)) continue;
    const PointPair pair{static_cast<std::int8_t>(ax), static_cast<std::int8_t>(ay), static_cast<std::int8_t>(bx),
                         static_cast<std::int8_t>(by)};
    bool is_new = true;
    for (std::size_t i = 0; i < count && is_new; ++i) is_new = !says_the_same(pattern[i], pair);
    if (is_new) pattern[count++] = pair;
  }
  return pattern;
}

inline constexpr std::array<PointPair, 256> kPattern = draw_pattern(20260301);

}  // namespace detail

/// Pixels that a turned pattern reaches from its centre.
inline constexpr int kBriefReach = detail::kPatternRadius + 1;

/// Computes descriptors; it holds the turned patterns.
class Brief {
 public:
  static constexpr int kTurns = 32;

  Brief() {
    for (int turn = 0; turn < kTurns; ++turn) {
      const double angle_rad = 2 * std::numbers::pi * turn / kTurns, c = std::cos(angle_rad), s = std::sin(angle_rad);
      const auto turned_x = [&](int x, int y) { return static_cast<std::int8_t>(std::lround(c * x - s * y)); };
      const auto turned_y = [&](int x, int y) { return static_cast<std::int8_t>(std::lround(s * x + c * y)); };
      for (std::size_t i = 0; i < 256; ++i) {
        const PointPair& p = detail::kPattern[i];
        patterns_[static_cast<std::size_t>(turn)][i] = {turned_x(p.ax, p.ay), turned_y(p.ax, p.ay), turned_x(p.bx, p.by),
                                                        turned_y(p.bx, p.by)};
      }
    }
  }

  /// The descriptor at (x, y), at least kBriefReach pixels inside a smoothed image.
  [[nodiscard]] Descriptor describe(const vision::ImageView& smooth, int x, int y, float angle_rad) const {
    const auto& pattern = patterns_[turn_of(angle_rad)];
    const std::uint8_t* centre = smooth.row(y) + x;
    const std::ptrdiff_t stride = smooth.stride_bytes;
    Descriptor bits{};
    for (std::size_t word = 0; word < 4; ++word) {
      std::uint64_t value = 0;
      for (std::size_t i = 0; i < 64; ++i) {
        const PointPair& p = pattern[64 * word + i];
        const bool bit = centre[p.ay * stride + p.ax] < centre[p.by * stride + p.bx];
        value |= static_cast<std::uint64_t>(bit) << i;
      }
      bits[word] = value;
    }
    return bits;
  }

  /// Angle to the number of the nearest turned pattern.
  [[nodiscard]] static std::size_t turn_of(float angle_rad) {
    const long turn = std::lround(angle_rad * (static_cast<float>(kTurns) / (2 * std::numbers::pi_v<float>)));
    return static_cast<std::size_t>(((turn % kTurns) + kTurns) % kTurns);
  }

 private:
  std::array<std::array<PointPair, 256>, kTurns> patterns_;
};

}  // namespace searvins::orb
