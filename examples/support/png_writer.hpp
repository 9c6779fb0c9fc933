// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Writes PNG files (8-bit grey, RGB, or up to 256 colours by number) by hand: signature, IHDR, PLTE where colours have numbers, one IDAT,
/// IEND.
///
/// A row is stored as the difference to a prediction from its left (a), upper (b) and upper left (c) neighbours, whichever of the five
/// filters gives the smallest sum of absolute differences: none, a, b, (a + b) / 2, or the one of a, b, c that is nearest to a + b - c.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include <searvins/io/text_fields.hpp>

#include "examples/support/checksums.hpp"
#include "examples/support/deflate.hpp"
#include "examples/support/gray_image.hpp"
#include "examples/support/rgb_image.hpp"

namespace searvins::examples {

namespace png_detail {

inline void append_big_endian(std::string& out, std::uint32_t value) {
  for (const std::uint32_t shift : {24U, 16U, 8U, 0U}) out += static_cast<char>(value >> shift & 0xFFU);
}

inline void append_chunk(std::string& out, std::string_view kind, std::string_view data) {
  append_big_endian(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  out.append(kind).append(data);
  append_big_endian(out, crc32(std::span{reinterpret_cast<const std::uint8_t*>(out.data()) + begin, out.size() - begin}));
}

/// What a filter predicts from the neighbours to the left, above and above left.
[[nodiscard]] constexpr std::uint8_t predicted(int filter, int left, int up, int corner) {
  if (filter == 1) return static_cast<std::uint8_t>(left);
  if (filter == 2) return static_cast<std::uint8_t>(up);
  if (filter == 3) return static_cast<std::uint8_t>((left + up) / 2);
  if (filter != 4) return 0;
  const auto size = [](int x) { return x < 0 ? -x : x; };
  const int to_left = size(up - corner), to_up = size(left - corner), to_corner = size(left + up - 2 * corner);
  if (to_left <= to_up && to_left <= to_corner) return static_cast<std::uint8_t>(left);
  return static_cast<std::uint8_t>(to_up <= to_corner ? up : corner);
}

/// A row behind the number of a filter; returns the sum of its absolute differences.
[[nodiscard]] inline long filter_row(int filter, std::span<const std::uint8_t> above, std::span<const std::uint8_t> row,
                                     std::size_t channels, std::vector<std::uint8_t>& out) {
  out.assign(1, static_cast<std::uint8_t>(filter));
  long sum = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const int left = i < channels ? 0 : row[i - channels], corner = i < channels ? 0 : above[i - channels];
    const auto rest = static_cast<std::uint8_t>(row[i] - predicted(filter, left, above[i], corner));
    out.push_back(rest);
    sum += std::min<int>(rest, 256 - rest);
  }
  return sum;
}

[[nodiscard]] inline std::vector<std::uint8_t> filtered_rows(std::span<const std::uint8_t> pixels, std::size_t row_bytes,
                                                             std::size_t channels) {
  std::vector<std::uint8_t> all, best, tried;
  all.reserve(pixels.size() + pixels.size() / row_bytes);
  const std::vector<std::uint8_t> nothing(row_bytes, 0);
  std::span<const std::uint8_t> above{nothing};
  for (; !pixels.empty(); pixels = pixels.subspan(row_bytes)) {
    const auto row = pixels.first(row_bytes);
    long least = std::numeric_limits<long>::max();
    for (int filter = 0; filter <= 4; ++filter)
      if (const long sum = filter_row(filter, above, row, channels, tried); sum < least) least = sum, std::swap(best, tried);
    all.insert(all.end(), best.begin(), best.end());
    above = row;
  }
  return all;
}

[[nodiscard]] inline std::string png_file(std::span<const std::uint8_t> pixels, int width, int height, std::size_t channels,
                                          char colour_type, std::string_view palette) {
  std::string header;
  append_big_endian(header, static_cast<std::uint32_t>(width));
  append_big_endian(header, static_cast<std::uint32_t>(height));
  header += {'\x08', colour_type, '\0', '\0', '\0'};  // bits, colour type, deflate, filters by row, not interlaced
  std::string file{"\x89PNG\r\n\x1a\n"};
  append_chunk(file, "IHDR", header);
  if (!palette.empty()) append_chunk(file, "PLTE", palette);
  append_chunk(file, "IDAT", zlib_compressed(filtered_rows(pixels, static_cast<std::size_t>(width) * channels, channels)));
  append_chunk(file, "IEND", {});
  return file;
}

/// The colours of an image, the greys first and from dark to light, so that rows of numbers are as smooth as the picture; empty when there
/// are more than 256.
[[nodiscard]] inline std::vector<Rgb> palette_of(const RgbImage& image) {
  const auto place = [](Rgb c) { return std::tuple{c.r != c.g || c.g != c.b, c.r + c.g + c.b, c.r, c.g}; };
  const auto is_before = [&](Rgb a, Rgb b) { return place(a) < place(b); };
  std::vector<Rgb> colours;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const Rgb c = image(x, y);
      const auto at = std::lower_bound(colours.begin(), colours.end(), c, is_before);
      if (at != colours.end() && *at == c) continue;
      if (colours.size() == 256) return {};
      colours.insert(at, c);
    }
  return colours;
}

}  // namespace png_detail

/// The file of an image of `channels` (1: grey, 3: red, green, blue) bytes a pixel, row by row; empty when the sizes do not agree.
[[nodiscard]] inline std::string png_of(std::span<const std::uint8_t> pixels, int width, int height, int channels) {
  if (width <= 0 || height <= 0 || (channels != 1 && channels != 3)) return {};
  const std::size_t row_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
  if (pixels.size() != row_bytes * static_cast<std::size_t>(height)) return {};
  return png_detail::png_file(pixels, width, height, static_cast<std::size_t>(channels), channels == 1 ? '\0' : '\2', {});
}
[[nodiscard]] inline std::string png_of(const GrayImage& image) { return png_of(image.pixels(), image.width(), image.height(), 1); }
[[nodiscard]] inline std::string png_of(const RgbImage& image) { return png_of(image.bytes(), image.width(), image.height(), 3); }

/// The same picture with its colours numbered, a third of the size; a plain png_of() when it has more than 256.
[[nodiscard]] inline std::string compact_png_of(const RgbImage& image) {
  const std::vector<Rgb> colours = png_detail::palette_of(image);
  if (colours.empty()) return png_of(image);
  std::unordered_map<std::uint32_t, std::uint8_t> number_of;
  std::string palette;
  const auto key = [](Rgb c) { return std::uint32_t{c.r} << 16U | std::uint32_t{c.g} << 8U | std::uint32_t{c.b}; };
  for (const Rgb c : colours) {
    number_of[key(c)] = static_cast<std::uint8_t>(palette.size() / 3);
    for (const std::uint8_t part : {c.r, c.g, c.b}) palette += static_cast<char>(part);
  }
  std::vector<std::uint8_t> numbers;
  numbers.reserve(image.bytes().size() / 3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) numbers.push_back(number_of[key(image(x, y))]);
  return png_detail::png_file(numbers, image.width(), image.height(), 1, '\3', palette);
}

/// Writes an image file; an empty string on success, else what went wrong.
[[nodiscard]] inline std::string write_png(const std::string& path, std::span<const std::uint8_t> pixels, int width, int height,
                                           int channels) {
  const std::string file = png_of(pixels, width, height, channels);
  return file.empty() ? path + ": the pixels do not fill the image" : io::write_text_file(path, file);
}
[[nodiscard]] inline std::string write_png(const std::string& path, const GrayImage& image) {
  return write_png(path, image.pixels(), image.width(), image.height(), 1);
}
[[nodiscard]] inline std::string write_png(const std::string& path, const RgbImage& image) {
  return write_png(path, image.bytes(), image.width(), image.height(), 3);
}

}  // namespace searvins::examples
