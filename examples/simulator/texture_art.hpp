// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The patterns of the city's surfaces, drawn from a seed: facades, shops, road, paving, grass, leaves, cars, concrete.
///
/// All are 2.5 cm a texel (kTexelsPerM) and repeat at their edges. Base and grime are value noise (random numbers on a lattice, smoothly
/// interpolated, several octaves); on it stand things with corners that are seen from near and from far: windows with frames and
/// curtains, letters, slabs, patches of tar, manholes, cracks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "hash.hpp"
#include "texture.hpp"

namespace searvins::simulator {

inline constexpr double kTexelsPerM = 40;

/// A pattern in the making, in texels; what is drawn over an edge comes in at the other side.
class Canvas {
 public:
  Canvas(int width, int height, double value, std::uint64_t seed)
      : width_(width),
        height_(height),
        seed_(seed),
        values_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), static_cast<float>(value)) {}

  [[nodiscard]] Texture texture() const {
    std::vector<float> values = values_;
    for (float& v : values) v = std::clamp(v, 6.F, 250.F);
    return {width_, height_, values};
  }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// The next random number in [low, high).
  [[nodiscard]] double random(double low, double high) { return low + (high - low) * uniform_at(seed_, ++drawn_); }
  [[nodiscard]] int random_int(int low, int high) { return static_cast<int>(random(low, high + 1)); }

  /// Adds value noise: cells of so many texels at first, then of half the size and 1.7 times less strength.
  void add_noise(int cell, double strength, int octaves) {
    for (int octave = 0; octave < octaves && cell >= 2; ++octave, cell /= 2, strength /= 1.7) add_octave(cell, strength);
  }
  void fill(int x, int y, int width, int height, double value) {
    for (int k = 0; k < height; ++k)
      for (int i = 0; i < width; ++i) at(x + i, y + k) = static_cast<float>(value);
  }
  void shift(int x, int y, int width, int height, double change) {
    for (int k = 0; k < height; ++k)
      for (int i = 0; i < width; ++i) at(x + i, y + k) += static_cast<float>(change);
  }
  void frame(int x, int y, int width, int height, int line, double value) {
    fill(x, y, width, line, value), fill(x, y + height - line, width, line, value);
    fill(x, y, line, height, value), fill(x + width - line, y, line, height, value);
  }
  void disc(int x, int y, int radius, double value) {
    for (int k = -radius; k <= radius; ++k)
      for (int i = -radius; i <= radius; ++i)
        if (i * i + k * k <= radius * radius) at(x + i, y + k) = static_cast<float>(value);
  }
  /// A crack: a dark line that wanders.
  void crack(double change) {
    double x = random(0, width_), y = random(0, height_), direction = random(0, 2 * std::numbers::pi);
    const int length = random_int(60, 260);
    for (int i = 0; i < length; ++i) {
      direction += random(-0.5, 0.5), x += std::cos(direction), y += std::sin(direction);
      shift(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)), 2, 1, change);
    }
  }

 private:
  /// Random numbers on a lattice, between them a smooth step.
  void add_octave(int cell, double strength) {
    const int across = std::max(1, width_ / cell), down = std::max(1, height_ / cell);
    const std::uint64_t seed = scrambled(seed_ ^ static_cast<std::uint64_t>(++drawn_));
    std::vector<double> lattice;
    for (int k = 0; k < down; ++k)
      for (int i = 0; i < across; ++i) lattice.push_back(strength * (2 * uniform_at(seed, i, k) - 1));
    const auto value = [&](int i, int k) { return lattice[static_cast<std::size_t>((k % down) * across + i % across)]; };
    const auto ease = [cell](int n) {
      const double a = static_cast<double>(n % cell) / cell;
      return a * a * (3 - 2 * a);
    };
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const int i = x / cell, k = y / cell;
        const double ax = ease(x), top = value(i, k) + ax * (value(i + 1, k) - value(i, k));
        const double bottom = value(i, k + 1) + ax * (value(i + 1, k + 1) - value(i, k + 1));
        at(x, y) += static_cast<float>(top + ease(y) * (bottom - top));
      }
  }

  [[nodiscard]] float& at(int x, int y) {
    const int i = x & (width_ - 1), k = y & (height_ - 1);
    return values_[static_cast<std::size_t>(k) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i)];
  }

  int width_, height_;
  std::uint64_t seed_;
  std::int64_t drawn_{0};
  std::vector<float> values_;
};

namespace art_detail {

inline void draw_bricks(Canvas& c, double contrast) {
  for (int row = 0; row * 4 < c.height(); ++row)
    for (int brick = 0; brick * 10 < c.width(); ++brick) c.shift(brick * 10 + (row % 2) * 5, row * 4, 9, 3, c.random(0.3, 1) * contrast);
}

/// One window with what is in and under it; (x, y) is the upper left corner of the opening.
inline void draw_window(Canvas& c, int x, int y, int width, int height, double glass, double trim) {
  c.fill(x - 3, y - 3, width + 6, height + 6, trim);
  c.fill(x, y, width, height, glass + c.random(-18, 18));
  const double luck = c.random(0, 1);
  if (luck < 0.35)  // a blind that is half down
    c.fill(x + 2, y + 2, width - 4, static_cast<int>(c.random(0.15, 0.9) * height), c.random(120, 215));
  else if (luck < 0.6)  // curtains at the sides
    for (const int side : {0, 1}) {
      const int wide = c.random_int(4, width / 3);
      c.fill(side == 0 ? x + 2 : x + width - 2 - wide, y + 2, wide, height - 4, c.random(110, 210));
    }
  else if (luck < 0.8)  // the sky in the upper panes
    c.fill(x + 2, y + 2, width - 4, height / 3, glass + c.random(30, 80));
  c.fill(x + width / 2 - 1, y, 2, height, trim);
  if (c.random(0, 1) < 0.6) c.fill(x, y + height / 3, width, 2, trim);
  c.fill(x - 5, y + height + 3, width + 10, 4, trim + 25);
  c.fill(x - 5, y + height + 7, width + 10, 3, 45);
  if (c.random(0, 1) < 0.14) {  // air conditioner
    c.fill(x + c.random_int(0, width / 2), y + height + 11, 26, 20, 190);
    c.disc(x + width / 2, y + height + 21, 7, 70);
  }
}

}  // namespace art_detail

/// The upper floors of a house, 25.6 x 12.8 m: eight bays, four floors of 3.2 m.
[[nodiscard]] inline Texture facade_texture(std::uint64_t seed) {
  Canvas c(1024, 512, 0, scrambled(seed));
  const double base = c.random(85, 175), glass = c.random(35, 80), trim = c.random(0, 1) < 0.6 ? c.random(190, 235) : c.random(25, 60);
  c.fill(0, 0, c.width(), c.height(), base);
  c.add_noise(128, 10, 6);
  if (c.random(0, 1) < 0.5) art_detail::draw_bricks(c, c.random(0, 1) < 0.5 ? -22 : 16);
  const int width = c.random_int(38, 84), height = c.random_int(52, 80);
  const bool banded = c.random(0, 1) < 0.5;
  for (int floor = 0; floor < 4; ++floor) {
    if (banded) c.fill(0, floor * 128 + 116, c.width(), 6, base + 35), c.fill(0, floor * 128 + 122, c.width(), 3, base - 45);
    for (int bay = 0; bay < 8; ++bay)
      if (c.random(0, 1) < 0.94) art_detail::draw_window(c, bay * 128 + (128 - width) / 2, floor * 128 + 24, width, height, glass, trim);
  }
  for (int i = 0; i < 26; ++i) {  // lamps, vents, boxes, pipes
    const bool pipe = c.random(0, 1) < 0.2;
    c.fill(c.random_int(0, 7) * 128 + c.random_int(0, 14), c.random_int(0, 511), pipe ? 3 : c.random_int(4, 12),
           pipe ? c.random_int(80, 300) : c.random_int(4, 12), c.random(0, 1) < 0.5 ? 35 : 225);
  }
  return c.texture();
}

/// The ground floor, 25.6 x 3.2 m; row 0 is its top.
[[nodiscard]] inline Texture shop_texture(std::uint64_t seed) {
  Canvas c(1024, 128, 0, scrambled(seed ^ 0x5350));
  c.fill(0, 0, c.width(), c.height(), c.random(70, 140));
  c.add_noise(64, 12, 5);
  for (int x = 0; x < c.width();) {
    const int width = std::min(c.random_int(110, 230), c.width() - x);
    const double board = c.random(0, 1) < 0.5 ? c.random(25, 70) : c.random(170, 235), ink = board < 100 ? 235 : 30;
    c.fill(x + 4, 6, width - 8, 24, board);
    for (int i = x + 10; i + 16 < x + width - 6; i += c.random_int(10, 18))  // letters
      for (int stroke = 0; stroke < 3; ++stroke) {
        const bool upright = c.random(0, 1) < 0.5;
        c.fill(i + c.random_int(0, 5), 11 + c.random_int(0, upright ? 3 : 11), upright ? 3 : 8, upright ? 13 : 3, ink);
      }
    const int door = c.random(0, 1) < 0.7 ? 36 : 0;
    c.fill(x + 8, 38, width - 16 - door, 70, c.random(30, 75));
    for (int i = 0; i < 9; ++i)  // what is in the window
      c.fill(x + 10 + c.random_int(0, std::max(1, width - 46 - door)), 42 + c.random_int(0, 44), c.random_int(6, 26), c.random_int(5, 20),
             c.random(60, 230));
    c.frame(x + 8, 38, width - 16 - door, 70, 2, c.random(150, 220));
    if (door > 0) c.fill(x + width - 8 - door + 4, 38, door - 8, 90, c.random(35, 150));
    c.fill(x - 3, 0, 6, 128, c.random(60, 200));
    x += width;
  }
  c.fill(0, 116, c.width(), 12, 62);
  for (int i = 0; i < 14; ++i)
    c.shift(c.random_int(0, 1023), c.random_int(30, 100), c.random_int(5, 16), c.random_int(6, 18), c.random(-90, 90));
  return c.texture();
}

/// The road across, 25.6 m of it; row 256 is its middle, 2.5 cm a row: dashes between lanes, lines at the edges, patches, manholes.
[[nodiscard]] inline Texture road_texture(std::uint64_t seed) {
  Canvas c(1024, 512, 92, scrambled(seed ^ 0x524F));
  c.add_noise(64, 9, 6);
  for (int i = 0; i < 16; ++i) {  // patches with their seams
    const int x = c.random_int(0, 1023), y = c.random_int(60, 400), w = c.random_int(25, 130), h = c.random_int(18, 60);
    c.shift(x, y, w, h, c.random(-32, 26));
    c.frame(x, y, w, h, 2, 42);
  }
  for (int i = 0; i < 26; ++i) c.crack(-38);
  for (int i = 0; i < 130; ++i) {  // spots of oil and gum, gravel
    const int size = c.random_int(2, 5);
    c.disc(c.random_int(0, 1023), c.random_int(50, 460), size, c.random(0, 1) < 0.6 ? 50 : 150);
  }
  for (int dash = 0; dash < 3; ++dash)
    for (const int lane : {-66, 66}) c.fill(dash * 341, 256 + lane - 3, 150, 6, 205);
  for (const int edge : {-156, 156}) c.fill(0, 256 + edge - 3, 1024, 6, 195);
  for (const int kerb : {-232, 232}) {
    c.fill(0, 256 + kerb - 8, 1024, 16, 150);
    for (int x = 0; x < 1024; x += 40) c.fill(x, 256 + kerb - 8, 2, 16, 70);
  }
  for (int i = 0; i < 3; ++i) {
    const int x = 170 + i * 330 + c.random_int(-60, 60), y = 256 + c.random_int(-120, 120);
    c.disc(x, y, 13, 45), c.disc(x, y, 10, 120);
    for (int k = -6; k <= 6; k += 4) c.fill(x - 7, y + k, 14, 2, 60);
  }
  c.add_noise(8, 7, 3);  // worn paint
  return c.texture();
}

/// Slabs of 40 cm.
[[nodiscard]] inline Texture paving_texture(std::uint64_t seed) {
  Canvas c(512, 512, 128, scrambled(seed ^ 0x5041));
  c.add_noise(64, 8, 5);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      c.shift(x * 16, y * 16, 16, 16, c.random(-20, 20));
      c.fill(x * 16, y * 16, 16, 1, 70), c.fill(x * 16, y * 16, 1, 16, 70);
    }
  for (int i = 0; i < 60; ++i) c.disc(c.random_int(0, 511), c.random_int(0, 511), c.random_int(2, 5), c.random(50, 90));
  for (int i = 0; i < 6; ++i) c.frame(c.random_int(0, 511), c.random_int(0, 511), 32, 24, 2, 45);
  return c.texture();
}

/// Rough ground: grass, earth, stones. Leaves of a tree with more contrast.
[[nodiscard]] inline Texture rough_texture(std::uint64_t seed, double base, double strength) {
  Canvas c(512, 512, base, scrambled(seed ^ 0x4752));
  c.add_noise(64, strength, 6);
  for (int i = 0; i < 700; ++i)
    c.shift(c.random_int(0, 511), c.random_int(0, 511), c.random_int(2, 7), c.random_int(2, 7), c.random(-1.6, 1.6) * strength);
  return c.texture();
}

/// Bare concrete with the joints and holes of its formwork.
[[nodiscard]] inline Texture concrete_texture(std::uint64_t seed) {
  Canvas c(512, 512, 135, scrambled(seed ^ 0x434F));
  c.add_noise(128, 14, 7);
  for (int k = 0; k < 512; k += 64) c.fill(0, k, 512, 2, 90), c.fill(k, 0, 2, 512, 90);
  for (int y = 16; y < 512; y += 32)
    for (int x = 16; x < 512; x += 32) c.disc(x, y, 2, 70);
  for (int i = 0; i < 40; ++i)
    c.shift(c.random_int(0, 511), c.random_int(0, 511), c.random_int(4, 10), c.random_int(20, 90), c.random(-30, 10));
  return c.texture();
}

/// Grime without any pattern, mean 128: laid over everything so that no two repetitions look the same.
[[nodiscard]] inline Texture grime_texture(std::uint64_t seed) {
  Canvas c(1024, 1024, 128, scrambled(seed ^ 0x4749));
  c.add_noise(256, 26, 5);
  for (int i = 0; i < 260; ++i)
    c.shift(c.random_int(0, 1023), c.random_int(0, 1023), c.random_int(3, 14), c.random_int(3, 14), c.random(-45, 30));
  return c.texture();
}

/// The side of a car, 256 texels long and 64 high: body, wheels, seams, handles; row 0 is the top of the body.
[[nodiscard]] inline Texture car_side_texture(std::uint64_t seed) {
  Canvas c(256, 64, 165, scrambled(seed ^ 0x4353));
  c.add_noise(64, 8, 4);
  c.fill(0, 50, 256, 14, 40);
  for (const int x : {48, 205}) c.disc(x, 46, 24, 30), c.disc(x, 46, 17, 45), c.disc(x, 46, 10, 170), c.disc(x, 46, 4, 60);
  for (const int x : {88, 130, 172}) c.fill(x, 2, 2, 46, 70);
  for (const int x : {112, 154}) c.fill(x, 14, 12, 3, 40);
  c.fill(0, 10, 12, 10, 235), c.fill(246, 8, 10, 12, 60), c.fill(0, 30, 256, 2, 90);
  return c.texture();
}

/// Front or back of a car: lights, plate, grille.
[[nodiscard]] inline Texture car_end_texture(std::uint64_t seed) {
  Canvas c(128, 64, 150, scrambled(seed ^ 0x4345));
  c.add_noise(64, 8, 4);
  c.fill(4, 10, 24, 14, 225), c.fill(100, 10, 24, 14, 225), c.fill(9, 13, 10, 8, 60), c.fill(109, 13, 10, 8, 60);
  c.fill(40, 12, 48, 12, 45), c.fill(46, 30, 36, 11, 235);
  for (int i = 0; i < 5; ++i) c.fill(49 + i * 6, 32, 3 + c.random_int(0, 1), 7, 40);
  c.fill(0, 46, 128, 18, 50), c.fill(8, 50, 14, 14, 25), c.fill(106, 50, 14, 14, 25);
  return c.texture();
}

/// Glass of a car: dark, with what it mirrors.
[[nodiscard]] inline Texture car_glass_texture(std::uint64_t seed) {
  Canvas c(128, 32, 48, scrambled(seed ^ 0x4347));
  c.fill(0, 0, 128, 8, 110);
  c.add_noise(32, 16, 3);
  for (const int x : {0, 42, 84, 124}) c.fill(x, 0, 4, 32, 150);
  return c.texture();
}

}  // namespace searvins::simulator
