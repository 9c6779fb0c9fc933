// SPDX-License-Identifier: BSD-3-Clause
// PNG: what is written is read again, what another encoder wrote is read, damage is noticed.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "examples/support/image_reader.hpp"
#include "examples/support/png_writer.hpp"
#include "tests/support/property.hpp"
#include "tests/support/shared_data.hpp"

using namespace searvins;
using examples::GrayImage;

namespace {

std::string from_hex(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
    bytes.push_back(static_cast<char>(16 * digit(hex[i]) + digit(hex[i + 1])));
  }
  return bytes;
}

std::span<const std::uint8_t> as_bytes(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

/// An image of one of several kinds: flat, noise, a ramp with noise, stripes, few values.
GrayImage random_image(test::Rng& rng) {
  GrayImage image(test::integer(rng, 1, 90), test::integer(rng, 1, 70));
  const int kind = test::integer(rng, 0, 4);
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const int noise = test::integer(rng, 0, 255);
      const int value = kind == 0   ? 77
                        : kind == 1 ? noise
                        : kind == 2 ? 2 * u + 3 * v + noise % 4
                        : kind == 3 ? (u / 5 + v / 3) % 2 * 200
                                    : noise % 3;
      image(u, v) = static_cast<std::uint8_t>(value);
    }
  return image;
}

}  // namespace

TEST_CASE("checksums: the published examples") {
  CHECK(examples::crc32(as_bytes("123456789")) == 0xCBF43926U);
  CHECK(examples::adler32(as_bytes("Wikipedia")) == 0x11E60398U);
  CHECK(examples::adler32({}) == 1U);
}

TEST_CASE("PNG: what is written is read again, grey") {
  test::for_all_seeds(200, [](test::Rng& rng) {
    const GrayImage image = random_image(rng);
    const auto read = examples::parse_image(examples::png_of(image), "x.png");
    REQUIRE(read.ok());
    CHECK(read->width() == image.width());
    CHECK(read->height() == image.height());
    CHECK(read->pixels() == image.pixels());
  });
}

TEST_CASE("PNG: colour is written; its luma is read") {
  examples::RgbImage image(GrayImage(40, 30, 90));
  image.set(3, 4, {255, 0, 0}), image.set(4, 4, {0, 255, 0}), image.set(5, 4, {0, 0, 255});
  image.set(-1, 0, {1, 2, 3}), image.set(40, 0, {1, 2, 3}), image.set(0, 30, {1, 2, 3});
  CHECK(image(0, 0) == examples::Rgb{90, 90, 90});
  const auto read = examples::parse_image(examples::png_of(image), "x.png");
  REQUIRE(read.ok());
  CHECK((*read)(0, 0) == 90);
  CHECK((*read)(3, 4) == doctest::Approx(0.299 * 255).epsilon(0.02));
  CHECK((*read)(4, 4) == doctest::Approx(0.587 * 255).epsilon(0.02));
  CHECK((*read)(5, 4) == doctest::Approx(0.114 * 255).epsilon(0.03));
}

TEST_CASE("PNG: repetitions of every length and over long distances, and rare bytes with the longest codes") {
  std::vector<std::uint8_t> bytes;
  for (std::size_t length = 3; length < 300; ++length) {
    for (std::size_t i = 0; i < length; ++i) bytes.push_back(static_cast<std::uint8_t>(length * 7 + i * i));
    const std::size_t from = bytes.size() * 5 / 11;
    for (std::size_t i = 0; i < length; ++i) bytes.push_back(bytes[from + i]);
  }
  for (std::size_t power = 0; power < 17; ++power)  // counts 1, 2, 4, ...: a tree of the greatest height
    bytes.insert(bytes.end(), std::size_t{1} << power, static_cast<std::uint8_t>(3 * power));
  std::vector<std::uint8_t> shuffled = bytes;
  test::Rng rng{5};
  for (std::size_t i = shuffled.size(); i-- > 1;) std::swap(shuffled[i], shuffled[rng() % (i + 1)]);
  for (const auto& data : {bytes, shuffled}) {
    const int height = static_cast<int>(data.size() / 512);
    const std::span<const std::uint8_t> whole{data.data(), static_cast<std::size_t>(height) * 512};
    const auto read = examples::parse_image(examples::png_of(whole, 512, height, 1), "x.png");
    REQUIRE(read.ok());
    CHECK(std::equal(whole.begin(), whole.end(), read->pixels().begin(), read->pixels().end()));
  }
}

TEST_CASE("PNG: files of another encoder, all five filters: stored blocks, fixed codes") {
  constexpr std::string_view kStored =
      "89504e470d0a1a0a0000000d49484452000000070000000608000000002a65dbaa0000000974455874436f6d6d656e740078d7f474080000001d4944"
      "41547801013000cfff00001f3e5d7c9bba01112424242424240233383d42476ca7a9800000001e494441544c510377444749cc4e5104773333863333"
      "3300a9e1195189c1f91e9f0e3625df2eca0000000049454e44ae426082";
  constexpr std::string_view kFixed =
      "89504e470d0a1a0a0000000d49484452000000070000000608000000002a65dbaa0000000974455874436f6d6d656e740078d7f474080000001a4944"
      "41547801636090b78bad99bd8b5150050c988c2d6c9ddc7d0299cb5dea03f0370000001b49444154dc3dcff805b2941b1bb7191b1b33ac7c2819d879"
      "f027001e9f0e3679242f0c0000000049454e44ae426082";
  for (const std::string_view hex : {kStored, kFixed}) {
    const std::string file = from_hex(hex);
    const auto read = examples::parse_image(file, "x.png");
    REQUIRE(read.ok());
    REQUIRE(read->width() == 7);
    REQUIRE(read->height() == 6);
    for (int v = 0; v < 6; ++v)
      for (int u = 0; u < 7; ++u) CHECK((*read)(u, v) == (u * 31 + v * v * 17 + u * v * 5) % 256);
    // No single changed byte behind the signature goes unnoticed: every chunk has its checksum.
    for (std::size_t i = 8; i < file.size(); ++i) {
      std::string damaged = file;
      damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
      const auto wrong = examples::parse_image(damaged, "x.png");
      CHECK_MESSAGE((!wrong.ok() || wrong->pixels() == read->pixels()), i);
    }
    for (std::size_t length = 0; length < file.size(); ++length) CHECK_FALSE(examples::parse_image(file.substr(0, length), "x.png").ok());
  }
}

TEST_CASE("PNG: sizes that do not agree give no file") {
  const std::vector<std::uint8_t> pixels(12);
  CHECK(examples::png_of(pixels, 4, 3, 1).size() > 60);
  CHECK(examples::png_of(pixels, 4, 4, 1).empty());
  CHECK(examples::png_of(pixels, 2, 2, 2).empty());
  CHECK(examples::png_of(pixels, 0, 3, 1).empty());
  CHECK_FALSE(examples::write_png("/nowhere/at/all.png", GrayImage(4, 3)).empty());
}

TEST_CASE("PNG: a camera's image becomes smaller and stays itself") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto camera = *shared / "data/real/euroc_v101_static/mav0/cam0/data/1403715273262142976.png";
  const auto image = examples::read_image(camera.string());
  REQUIRE(image.ok());
  CHECK(image->width() == 752);
  CHECK(image->height() == 480);
  const std::string file = examples::png_of(*image);
  CHECK(file.size() < 0.6 * 752 * 480);  // 55 %
  const auto again = examples::parse_image(file, "x.png");
  REQUIRE(again.ok());
  CHECK(again->pixels() == image->pixels());
}
