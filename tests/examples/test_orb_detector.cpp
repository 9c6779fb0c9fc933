// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Corners: FAST against its definition, Harris, the choice over the image, the pyramid.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "examples/orb_frontend/extractor.hpp"
#include "examples/synthetic_texture.hpp"
#include "support/property.hpp"

using namespace searvins;
using examples::GrayImage;
using orb::Corner;

namespace {

constexpr int kCircle[16][2] = {{0, -3}, {1, -3}, {2, -2}, {3, -1}, {3, 0},  {3, 1},   {2, 2},   {1, 3},
                                {0, 3},  {-1, 3}, {-2, 2}, {-3, 1}, {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};

/// The definition, word for word: nine in a row on the circle, all brighter than p + t or all darker than p - t.
bool is_corner(const GrayImage& image, int x, int y, int t) {
  for (int start = 0; start < 16; ++start) {
    bool brighter = true, darker = true;
    for (int i = 0; i < 9; ++i) {
      const int* at = kCircle[(start + i) % 16];
      brighter = brighter && image(x + at[0], y + at[1]) > image(x, y) + t;
      darker = darker && image(x + at[0], y + at[1]) < image(x, y) - t;
    }
    if (brighter || darker) return true;
  }
  return false;
}

/// The least threshold at which it is none, by bisection of the definition; 0 when it is none at 0.
int contrast_of(const GrayImage& image, int x, int y) {
  int low = 0, high = 256;
  while (low < high) {
    const int t = (low + high) / 2;
    if (is_corner(image, x, y, t))
      low = t + 1;
    else
      high = t;
  }
  return low;
}

std::vector<Corner> brute_force(const GrayImage& image, int threshold, int border) {
  std::vector<Corner> corners;
  const auto contrast = [&](int x, int y) {
    const int c = contrast_of(image, x, y);
    return c > threshold ? c : 0;
  };
  for (int y = border; y < image.height() - border; ++y)
    for (int x = border; x < image.width() - border; ++x) {
      const int c = contrast(x, y);
      bool keep = c > 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const bool is_before = dy < 0 || (dy == 0 && dx < 0);
          if ((dx != 0 || dy != 0) && keep) keep = is_before ? c > contrast(x + dx, y + dy) : c >= contrast(x + dx, y + dy);
        }
      if (keep) corners.push_back({x, y, c});
    }
  return corners;
}

/// Noise, steps or few grey values, so that ties and flat parts are there too.
GrayImage random_image(test::Rng& rng, int width, int height) {
  GrayImage image(width, height);
  const int kind = test::integer(rng, 0, 2), levels = kind == 0 ? 256 : kind == 1 ? 4 : 2;
  const int block = test::integer(rng, 1, 5);
  const std::uint64_t seed = rng();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      test::Rng cell{seed ^ (static_cast<std::uint64_t>(y / block) * 1000003U + static_cast<std::uint64_t>(x / block))};
      image(x, y) = static_cast<std::uint8_t>(test::integer(cell, 0, levels - 1) * (255 / (levels - 1)));
    }
  return image;
}

}  // namespace

TEST_CASE("FAST finds what the definition finds, with the same contrasts") {
  std::size_t found = 0;
  test::for_all_seeds(12, [&](test::Rng& rng) {
    const int width = test::integer(rng, 40, 90), height = test::integer(rng, 12, 24), threshold = test::integer(rng, 0, 80),
              border = test::integer(rng, 4, 5);
    const GrayImage image = random_image(rng, width, height);
    orb::FastDetector detector;
    std::vector<Corner> corners;
    detector.detect(image.view(), threshold, border, corners);
    const std::vector<Corner> expected = brute_force(image, threshold, border);
    REQUIRE(corners.size() == expected.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      CHECK(corners[i].x == expected[i].x);
      CHECK(corners[i].y == expected[i].y);
      CHECK(corners[i].contrast == expected[i].contrast);
    }
    found += corners.size();
  });
  CHECK(found > 20);
}

TEST_CASE("FAST works on a crop with a stride, and a second image is not mixed with the first") {
  const GrayImage big = test::texture_image(test::Texture{3}, 130, 90);
  const vision::ImageView crop = big.view().crop(17, 9, 100, 70);
  GrayImage copy(100, 70);
  for (int y = 0; y < 70; ++y) std::copy_n(crop.row(y), 100, copy.row(y));
  orb::FastDetector detector;
  std::vector<Corner> of_crop, of_copy, again;
  detector.detect(crop, 10, 5, of_crop);
  detector.detect(copy.view(), 10, 5, of_copy);
  detector.detect(big.view(), 10, 5, again);
  again.clear();
  detector.detect(crop, 10, 5, again);
  REQUIRE(of_crop.size() > 10);
  REQUIRE(of_crop.size() == of_copy.size());
  REQUIRE(of_crop.size() == again.size());
  for (std::size_t i = 0; i < of_crop.size(); ++i) {
    CHECK(std::pair{of_crop[i].x, of_crop[i].y} == std::pair{of_copy[i].x, of_copy[i].y});
    CHECK(std::pair{of_crop[i].x, of_crop[i].y} == std::pair{again[i].x, again[i].y});
  }
}

TEST_CASE("Images too small for a corner have none") {
  orb::FastDetector detector;
  std::vector<Corner> corners;
  const GrayImage image = test::texture_image(test::Texture{4}, 39, 40);
  detector.detect(image.view(), 5, 4, corners);
  detector.detect(image.view().crop(0, 0, 39, 8), 5, 4, corners);
  CHECK(corners.empty());
}

TEST_CASE("Harris: a corner is above an edge, an edge is below zero, a wall is zero") {
  GrayImage image(40, 40, 50);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x)
      if (x >= 20 && y >= 20) image(x, y) = 200;
  CHECK(orb::harris_response(image.view(), 20, 20) > 0);
  CHECK(orb::harris_response(image.view(), 20, 32) < 0);
  CHECK(orb::harris_response(image.view(), 8, 8) == 0);
}

TEST_CASE("Harris against its definition in floating point") {
  test::for_all_seeds(30, [](test::Rng& rng) {
    const GrayImage image = random_image(rng, 20, 20);
    const int x = test::integer(rng, 5, 14), y = test::integer(rng, 5, 14);
    double a = 0, b = 0, c = 0;
    for (int dy = -3; dy <= 3; ++dy)
      for (int dx = -3; dx <= 3; ++dx) {
        const double gx = double(image(x + dx + 1, y + dy)) - double(image(x + dx - 1, y + dy));
        const double gy = double(image(x + dx, y + dy + 1)) - double(image(x + dx, y + dy - 1));
        a += gx * gx, b += gx * gy, c += gy * gy;
      }
    const double expected = a * c - b * b - 0.04 * (a + c) * (a + c), size = (a + c) * (a + c) + 1;
    CHECK(std::abs(double(orb::harris_response(image.view(), x, y)) - expected) < 1e-5 * size);
  });
}

TEST_CASE("A corner is found again where the image was moved to, to a fifth of a pixel") {
  const test::Texture texture{7, 11};
  const GrayImage still = test::texture_image(texture, 200, 160);
  test::for_all_seeds(10, [&](test::Rng& rng) {
    const double dx = test::uniform(rng, -0.5, 0.5), dy = test::uniform(rng, -0.5, 0.5);
    const GrayImage moved = test::texture_image(texture, 200, 160, dx, dy);
    orb::Extractor extractor{{150, 1}};
    std::vector<orb::Feature> a, b;
    extractor.extract(still.view(), a);
    extractor.extract(moved.view(), b);
    std::vector<double> errors;
    for (const orb::Feature& f : a)
      for (const orb::Feature& g : b) {
        const double error = std::hypot(double(f.u_px) - dx - double(g.u_px), double(f.v_px) - dy - double(g.v_px));
        if (error < 1.5) errors.push_back(error);
      }
    REQUIRE(errors.size() > 60);
    std::sort(errors.begin(), errors.end());
    CHECK(errors[errors.size() / 2] < 0.2);
  });
}

TEST_CASE("Levels keep the place: a spot is at the same full-image coordinates on every level") {
  GrayImage image(300, 220, 20);
  const double u = 143.3, v = 101.6;
  for (int y = 0; y < 220; ++y)
    for (int x = 0; x < 300; ++x) image(x, y) = test::grey(20 + 200 * std::exp(-((x - u) * (x - u) + (y - v) * (y - v)) / 50));
  orb::Pyramid pyramid;
  pyramid.build(image.view(), 5, 1.25F);
  REQUIRE(pyramid.levels() == 5);
  for (int l = 0; l < pyramid.levels(); ++l) {
    const vision::ImageView level = pyramid.level(l);
    double sum = 0, x_sum = 0, y_sum = 0;
    for (int y = 0; y < level.height; ++y)
      for (int x = 0; x < level.width; ++x) {
        const double weight = level(x, y) - 20.0;
        sum += weight, x_sum += weight * x, y_sum += weight * y;
      }
    CHECK(std::abs(double(orb::to_full_image(float(x_sum / sum), pyramid.scale(l))) - u) < 0.06);
    CHECK(std::abs(double(orb::to_full_image(float(y_sum / sum), pyramid.scale(l))) - v) < 0.06);
    CHECK(orb::to_level(orb::to_full_image(12.5F, pyramid.scale(l)), pyramid.scale(l)) == doctest::Approx(12.5));
  }
}

TEST_CASE("Levels that would be too small are left out") {
  const GrayImage image(80, 100);
  orb::Pyramid pyramid;
  pyramid.build(image.view(), 8, 1.25F);
  CHECK(pyramid.levels() == 2);  // 80 -> 64 -> 51
}

TEST_CASE("Features are spread, apart from each other, and no more than wanted") {
  // Strong texture on the left third, weak on the rest.
  const test::Texture texture{11};
  GrayImage image = test::texture_image(texture, 360, 240);
  for (int y = 0; y < 240; ++y)
    for (int x = 120; x < 360; ++x) image(x, y) = test::grey(128 + 0.35 * (double(image(x, y)) - 128));
  orb::Extractor extractor{{200, 1}};
  std::vector<orb::Feature> features;
  extractor.extract(image.view(), features);
  CHECK(features.size() <= 200);
  CHECK(features.size() > 150);
  std::size_t weak = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    weak += features[i].u_px > 120 ? 1U : 0U;
    for (std::size_t k = 0; k < i; ++k)
      CHECK(std::max(std::abs(features[i].x - features[k].x), std::abs(features[i].y - features[k].y)) >= orb::GridSelector::kSpot);
  }
  CHECK(weak > 25);
}

TEST_CASE("The smoothing filter is a triangle over seven pixels in each axis") {
  test::for_all_seeds(5, [](test::Rng& rng) {
    const GrayImage image = random_image(rng, 50, 40);
    orb::Smoother smoother;
    GrayImage smooth;
    smoother.smooth(image.view(), smooth);
    for (int y = 3; y < 37; ++y)
      for (int x = 3; x < 47; ++x) {
        double sum = 0;
        for (int dy = -3; dy <= 3; ++dy)
          for (int dx = -3; dx <= 3; ++dx) sum += (4 - std::abs(dx)) * (4 - std::abs(dy)) * double(image(x + dx, y + dy));
        const double lifted = double(smooth(x, y)) - sum / 256;
        CHECK(lifted >= 0);  // means are rounded up
        CHECK(lifted < 4);
      }
  });
}
