// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Reading images: PNG of every filter and block, PGM, and files that are broken in any way.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "examples/support/image_reader.hpp"
#include "examples/support/png_writer.hpp"
#include "examples/synthetic_texture.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using examples::GrayImage;

namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

/// A PNG of given raw rows (each with its filter byte) in one stored block.
std::string png_of_rows(int width, int height, int colour_type, const std::vector<std::uint8_t>& rows) {
  const auto big_endian = [](std::uint32_t v) {
    return std::string{char(v >> 24U), char((v >> 16U) & 255U), char((v >> 8U) & 255U), char(v & 255U)};
  };
  const auto chunk = [&](const std::string& kind, const std::string& data) {
    return big_endian(std::uint32_t(data.size())) + kind + data + big_endian(examples::crc32(bytes_of(kind + data)));
  };
  const std::size_t n = rows.size();
  std::string packed = {'\x78', '\x01', '\x01', char(n & 255U), char(n >> 8U), char(~n & 255U), char((~n >> 8U) & 255U)};
  packed.append(rows.begin(), rows.end());
  packed += big_endian(examples::adler32(rows));
  const std::string header =
      big_endian(std::uint32_t(width)) + big_endian(std::uint32_t(height)) + std::string{8, char(colour_type), 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + chunk("IDAT", packed) + chunk("IEND", "");
}

std::string message(std::string_view content) {
  const auto image = examples::parse_image(content, "x");
  return image.ok() ? "" : image.error().message;
}

}  // namespace

TEST_CASE("Checksums of the standards' examples") {
  CHECK(examples::crc32(bytes_of("123456789")) == 0xcbf43926U);
  CHECK(examples::adler32(bytes_of("Wikipedia")) == 0x11e60398U);
  CHECK(examples::crc32({}) == 0);
  CHECK(examples::adler32({}) == 1);
}

TEST_CASE("Unpacking: a fixed block with a copy that overlaps itself") {
  // "aaaaaaaaaa" (10 times a) and "abcabcabcabc", packed by zlib's deflate.
  std::vector<std::uint8_t> out;
  const std::vector<std::uint8_t> ten{0x78, 0x9c, 0x4b, 0x84, 0x03, 0x00, 0x14, 0xe1, 0x03, 0xcb};
  CHECK(std::string_view{examples::inflate_zlib(ten, 10, out)}.empty());
  CHECK(std::string(out.begin(), out.end()) == "aaaaaaaaaa");
  CHECK_FALSE(std::string_view{examples::inflate_zlib(ten, 9, out)}.empty());
  CHECK_FALSE(std::string_view{examples::inflate_zlib(ten, 11, out)}.empty());
  const std::vector<std::uint8_t> before_the_beginning{0x78, 0x9c, 0x03, 0x02, 0x00};
  CHECK_FALSE(std::string_view{examples::inflate_zlib(before_the_beginning, 3, out)}.empty());
}

TEST_CASE("What is written is read back") {
  test::for_all_seeds(20, [](test::Rng& rng) {
    const int width = test::integer(rng, 1, 90), height = test::integer(rng, 1, 60);
    GrayImage image = test::texture_image(test::Texture{rng()}, width, height);
    if (test::chance(rng, 0.3))
      for (std::uint8_t& p : image.pixels()) p = static_cast<std::uint8_t>(rng());
    const auto read = examples::parse_image(examples::png_of(image.pixels(), width, height, 1), "x.png");
    REQUIRE(read.ok());
    CHECK(read->width() == width);
    CHECK(read->height() == height);
    CHECK(read->pixels() == image.pixels());
    std::string pgm = "P5 # a comment\n" + std::to_string(width) + ' ' + std::to_string(height) + "\n255\n";
    pgm.append(image.pixels().begin(), image.pixels().end());
    const auto read_pgm = examples::parse_image(pgm, "x.pgm");
    REQUIRE(read_pgm.ok());
    CHECK(read_pgm->pixels() == image.pixels());
  });
}

TEST_CASE("Each filter of PNG, by hand") {
  // Two rows of three pixels, the second through every filter.
  const auto second_row = [](std::uint8_t filter, std::array<std::uint8_t, 3> stored) {
    const auto image = examples::parse_image(png_of_rows(3, 2, 0, {0, 10, 200, 30, filter, stored[0], stored[1], stored[2]}), "x");
    REQUIRE(image.ok());
    return std::vector<int>{(*image)(0, 1), (*image)(1, 1), (*image)(2, 1)};
  };
  CHECK(second_row(0, {1, 2, 3}) == std::vector{1, 2, 3});
  CHECK(second_row(1, {1, 2, 3}) == std::vector{1, 3, 6});
  CHECK(second_row(2, {1, 2, 250}) == std::vector{11, 202, 24});
  CHECK(second_row(3, {1, 2, 3}) == std::vector{6, 105, 70});   // (0+10)/2, (6+200)/2, (105+30)/2
  CHECK(second_row(4, {1, 2, 3}) == std::vector{11, 202, 33});  // up 10; of 11, 200, 10 for 201 up; of 202, 30, 200 for 32 up
  CHECK(message(png_of_rows(1, 1, 0, {5, 1})) == "a row of the PNG has an unknown filter");
}

TEST_CASE("Colour becomes grey, alpha is ignored, palettes stay indices") {
  const auto grey_of = [](int colour_type, std::vector<std::uint8_t> pixel) {
    pixel.insert(pixel.begin(), 0);
    const auto image = examples::parse_image(png_of_rows(1, 1, colour_type, pixel), "x");
    REQUIRE(image.ok());
    return int((*image)(0, 0));
  };
  CHECK(grey_of(2, {255, 0, 0}) == 76);
  CHECK(grey_of(2, {0, 255, 0}) == 150);
  CHECK(grey_of(6, {9, 9, 9, 128}) == 9);
  CHECK(grey_of(4, {77, 0}) == 77);
  CHECK(grey_of(3, {11}) == 11);
  CHECK(message(png_of_rows(1, 1, 1, {0, 0})) == "the PNG is of an unknown colour type");
}

TEST_CASE("Files cut or changed anywhere are refused, never read wrongly") {
  test::for_all_seeds(3, [](test::Rng& rng) {
    const GrayImage image = test::texture_image(test::Texture{rng()}, 23, 17);
    const std::string good = examples::png_of(image.pixels(), 23, 17, 1);
    REQUIRE(message(good).empty());
    for (std::size_t length = 0; length < good.size(); ++length) CHECK_FALSE(message(std::string_view{good}.substr(0, length)).empty());
    for (std::size_t i = 0; i < good.size(); ++i) {
      std::string bad = good;
      bad[i] = static_cast<char>(bad[i] ^ (1 << test::integer(rng, 0, 7)));
      const auto read = examples::parse_image(bad, "x");
      if (read.ok()) CHECK(read->pixels() == image.pixels());
    }
  });
}

TEST_CASE("Packed data of nonsense end in a message") {
  test::for_all_seeds(400, [](test::Rng& rng) {
    std::vector<std::uint8_t> packed{0x78, 0x9c};
    for (int i = test::integer(rng, 0, 200); i > 0; --i) packed.push_back(static_cast<std::uint8_t>(rng()));
    std::vector<std::uint8_t> out;
    const std::size_t size = static_cast<std::size_t>(test::integer(rng, 1, 1000));
    CHECK_FALSE(std::string_view{examples::inflate_zlib(packed, size, out)}.empty());
    CHECK(out.size() <= size);
  });
}

TEST_CASE("Other files, absurd sizes, PGM that is none") {
  CHECK(message("hello") == "is neither PNG nor binary PGM (P5)");
  CHECK(message("P5 4 4 65535\n") == "only PGM of 8 bits a pixel can be read");
  CHECK(message("P5 4 4 255\nabc") == "the file ends within the pixels");
  CHECK(message("P5 4") == "the PGM header is incomplete");
  CHECK(message("P5 0 4 255\n") == "the image has no size or is too large");
  CHECK(message("P5 999999999 999999999 255\n") == "the image has no size or is too large");
  CHECK(examples::read_image("/nowhere/at/all.png").error().message == "the file cannot be opened");
}

TEST_CASE("A real recording's PNG is read") {
  const auto shared = test::shared_data();
  const std::filesystem::path path =
      shared ? *shared / "data/real/euroc_v101_static/mav0/cam0/data/1403715273262142976.png" : std::filesystem::path{};
  if (!shared || !std::filesystem::exists(path)) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto image = examples::read_image(path.string());  // its checksum covers every byte
  REQUIRE(image.ok());
  CHECK(image->width() == 752);
  CHECK(image->height() == 480);
}
