// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/image_view.hpp>

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

using namespace searvins::vision;

TEST_CASE("image views: rows, crops, and what is no image") {
  std::vector<std::uint8_t> grey(45 * 30);  // rows of 45 bytes, 40 of them picture
  for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = static_cast<std::uint8_t>(i * 7);
  const ImageView view{grey.data(), 40, 30, 45};
  REQUIRE(view.valid());
  const ImageView crop = view.crop(7, 5, 10, 8);
  REQUIRE(crop.valid());
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 10; ++x) CHECK(crop(x, y) == grey[static_cast<std::size_t>((y + 5) * 45 + x + 7)]);
  CHECK(view.crop(30, 22, 10, 8).valid());
  CHECK_FALSE(view.crop(31, 22, 10, 8).valid());
  CHECK_FALSE(view.crop(30, 23, 10, 8).valid());
  CHECK_FALSE(view.crop(-1, 0, 10, 8).valid());
  CHECK_FALSE(view.crop(0, 0, 0, 8).valid());
  CHECK_FALSE(ImageView{}.valid());
  CHECK_FALSE(ImageView{grey.data(), 40, 30, 39}.valid());
  CHECK(view.contains(39, 29));
  CHECK_FALSE(view.contains(40, 29));
  CHECK(packed_image(grey.data(), 45, 30).crop(0, 0, 40, 30)(39, 29) == view(39, 29));
}
