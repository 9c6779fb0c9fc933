// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Reads grey images: PGM (P5, at most 8 bits) and PNG, told apart by their first bytes.
///
/// Of PNG: 8 bits a sample, not interlaced; grey, grey with alpha, colour (turned to grey by Rec. 601 luma) and colour with alpha (alpha is
/// ignored). Palettes are read as their indices, which is what label images store. That is what cameras, EuRoC-layout recordings and
/// segmentation networks write; anything else is refused by name. Images of more than kMaxPixels are refused before memory is asked for.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/io/text_fields.hpp>

#include "examples/support/checksums.hpp"
#include "examples/support/gray_image.hpp"
#include "examples/support/inflate.hpp"

namespace searvins::examples {

inline constexpr std::size_t kMaxPixels = std::size_t{1} << 26;  ///< of an image that is read

namespace detail {

using Bytes = std::span<const std::uint8_t>;

inline constexpr std::array<std::uint8_t, 8> kPngHead{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

/// What a reading came to: an empty text, or what is wrong.
using Problem = const char*;

[[nodiscard]] inline bool size_fits(std::uint64_t width, std::uint64_t height) {
  return width > 0 && height > 0 && width <= kMaxPixels && height <= kMaxPixels && width * height <= kMaxPixels;
}

/// A number of a PGM header, after blanks and comments; false when there is none.
[[nodiscard]] inline bool pgm_number(Bytes bytes, std::size_t& at, std::uint64_t& number) {
  const auto is_blank = [](std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  while (at < bytes.size() && (is_blank(bytes[at]) || bytes[at] == '#')) {
    if (bytes[at] == '#')
      while (at < bytes.size() && bytes[at] != '\n') ++at;
    else
      ++at;
  }
  const std::size_t begin = at;
  number = 0;
  for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9' && at - begin < 9; ++at)
    number = 10 * number + (bytes[at] - std::uint64_t{'0'});
  return at > begin;
}

[[nodiscard]] inline Problem read_pgm(Bytes bytes, GrayImage& image) {
  std::size_t at = 2;
  std::uint64_t width = 0, height = 0, white = 0;
  if (!pgm_number(bytes, at, width) || !pgm_number(bytes, at, height) || !pgm_number(bytes, at, white) || at >= bytes.size())
    return "the PGM header is incomplete";
  if (white < 1 || white > 255) return "only PGM of 8 bits a pixel can be read";
  if (!size_fits(width, height)) return "the image has no size or is too large";
  ++at;  // the one blank after the header
  if (bytes.size() - at < width * height) return "the file ends within the pixels";
  image.resize(static_cast<int>(width), static_cast<int>(height));
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), image.pixels().size(), image.pixels().begin());
  return "";
}

/// PNG's header chunk.
struct PngHeader {
  std::uint32_t width{0}, height{0};
  std::size_t channels{0};
};

[[nodiscard]] inline std::uint32_t big_endian(Bytes bytes) {
  return static_cast<std::uint32_t>(bytes[0]) << 24U | static_cast<std::uint32_t>(bytes[1]) << 16U |
         static_cast<std::uint32_t>(bytes[2]) << 8U | static_cast<std::uint32_t>(bytes[3]);
}

[[nodiscard]] inline Problem read_png_header(Bytes data, PngHeader& header) {
  constexpr std::array<std::size_t, 7> kChannels{1, 0, 3, 1, 2, 0, 4};
  if (data.size() != 13) return "the PNG header has a wrong length";
  header.width = big_endian(data);
  header.height = big_endian(data.subspan(4));
  if (!size_fits(header.width, header.height)) return "the image has no size or is too large";
  if (data[8] != 8) return "only PNG of 8 bits a sample can be read";
  if (data[9] >= kChannels.size() || kChannels[data[9]] == 0) return "the PNG is of an unknown colour type";
  header.channels = kChannels[data[9]];
  if (data[10] != 0 || data[11] != 0) return "the PNG is packed or filtered by an unknown method";
  return data[12] == 0 ? "" : "interlaced PNG cannot be read";
}

/// Walks the chunks: header, then the packed pixels strung together.
[[nodiscard]] inline Problem read_png_chunks(Bytes bytes, PngHeader& header, std::vector<std::uint8_t>& packed) {
  for (std::size_t at = kPngHead.size(); bytes.size() - at >= 12;) {
    const std::size_t length = big_endian(bytes.subspan(at));
    if (length > bytes.size() - at - 12) return "the file ends within a PNG chunk";
    const Bytes name = bytes.subspan(at + 4, 4), data = bytes.subspan(at + 8, length);
    if (crc32(bytes.subspan(at + 4, length + 4)) != big_endian(bytes.subspan(at + 8 + length)))
      return "the checksum of a PNG chunk is wrong";
    const std::string_view kind{reinterpret_cast<const char*>(name.data()), 4};
    if (kind == "IHDR") {
      if (const Problem wrong = read_png_header(data, header); *wrong) return wrong;
    } else if (kind == "IDAT") {
      packed.insert(packed.end(), data.begin(), data.end());
    } else if (kind == "IEND") {
      return header.channels == 0 ? "the PNG has no header" : "";
    }
    at += length + 12;
  }
  return "the file ends before the PNG does";
}

/// The neighbour of three that is nearest to a + b - c, of equals the first.
[[nodiscard]] inline std::uint8_t paeth(int a, int b, int c) {
  const int p = a + b - c, from_a = std::abs(p - a), from_b = std::abs(p - b), from_c = std::abs(p - c);
  return static_cast<std::uint8_t>(from_a <= from_b && from_a <= from_c ? a : from_b <= from_c ? b : c);
}

/// Adds a row's prediction to what was stored; `before` is the row above, of zeros for the first.
[[nodiscard]] inline Problem unfilter_row(std::uint8_t filter, std::size_t channels, Bytes before, std::span<std::uint8_t> row) {
  if (filter > 4) return "a row of the PNG has an unknown filter";
  for (std::size_t i = 0; i < row.size() && filter != 0; ++i) {
    const int left = i >= channels ? row[i - channels] : 0, up = before[i], corner = i >= channels ? before[i - channels] : 0;
    const int predicted = filter == 1 ? left : filter == 2 ? up : filter == 3 ? (left + up) / 2 : paeth(left, up, corner);
    row[i] = static_cast<std::uint8_t>(row[i] + predicted);
  }
  return "";
}

[[nodiscard]] inline std::uint8_t grey_of(const std::uint8_t* pixel, std::size_t channels) {
  if (channels < 3) return pixel[0];
  return static_cast<std::uint8_t>((299 * pixel[0] + 587 * pixel[1] + 114 * pixel[2] + 500) / 1000);
}

[[nodiscard]] inline Problem read_png(Bytes bytes, GrayImage& image) {
  PngHeader header;
  std::vector<std::uint8_t> packed, rows;
  if (const Problem wrong = read_png_chunks(bytes, header, packed); *wrong) return wrong;
  const std::size_t row_bytes = header.width * header.channels;
  if (const Problem wrong = inflate_zlib(packed, (row_bytes + 1) * header.height, rows); *wrong) return wrong;
  image.resize(static_cast<int>(header.width), static_cast<int>(header.height));
  const std::vector<std::uint8_t> zeros(row_bytes, 0);
  Bytes before{zeros};
  for (std::size_t y = 0; y < header.height; ++y) {
    const std::span<std::uint8_t> row = std::span{rows}.subspan(y * (row_bytes + 1) + 1, row_bytes);
    if (const Problem wrong = unfilter_row(rows[y * (row_bytes + 1)], header.channels, before, row); *wrong) return wrong;
    std::uint8_t* out = image.row(static_cast<int>(y));
    for (std::size_t x = 0; x < header.width; ++x) out[x] = grey_of(row.data() + x * header.channels, header.channels);
    before = row;
  }
  return "";
}

}  // namespace detail

/// Reads an image from memory; `name` is the file's name in messages.
[[nodiscard]] inline io::FileResult<GrayImage> parse_image(std::string_view content, const std::string& name) {
  const detail::Bytes bytes{reinterpret_cast<const std::uint8_t*>(content.data()), content.size()};
  const std::span head{detail::kPngHead};
  GrayImage image;
  detail::Problem wrong = "is neither PNG nor binary PGM (P5)";
  if (content.starts_with("P5"))
    wrong = detail::read_pgm(bytes, image);
  else if (bytes.size() >= head.size() && std::equal(head.begin(), head.end(), bytes.begin()))
    wrong = detail::read_png(bytes, image);
  if (*wrong) return io::Diagnostic{name, 0, wrong, "convert it to 8-bit grey PNG or PGM, or get it again"};
  return image;
}

/// Reads an image file. Errors: those of parse_image; a missing, empty or unreadable file.
[[nodiscard]] inline io::FileResult<GrayImage> read_image(const std::string& path) {
  std::ifstream stream{path, std::ios::binary};
  if (!stream) return io::Diagnostic{path, 0, "the file cannot be opened", "check the path and its permissions"};
  std::string content;
  std::array<char, std::size_t{1} << 16> block;
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    content.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    if (content.size() > 4 * kMaxPixels) return io::Diagnostic{path, 0, "the file is too large for an image", {}};
  }
  if (content.empty()) return io::Diagnostic{path, 0, "the file is empty", "get it again, the transfer may have failed"};
  return parse_image(content, path);
}

}  // namespace searvins::examples
