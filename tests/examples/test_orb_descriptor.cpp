// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Orientation and descriptors: what turns with the image and what does not.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "examples/orb_frontend/brief.hpp"
#include "examples/orb_frontend/orientation.hpp"
#include "examples/orb_frontend/smoothing.hpp"
#include "examples/synthetic_texture.hpp"
#include "support/property.hpp"

using namespace searvins;
using examples::GrayImage;

namespace {

constexpr int kSize = 81, kMiddle = kSize / 2;
constexpr double kPi = std::numbers::pi;

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

struct Described {
  double angle_rad{0};
  orb::Descriptor descriptor{};
};

Described describe(const orb::Brief& brief, const GrayImage& image) {
  orb::Smoother smoother;
  GrayImage smooth;
  smoother.smooth(image.view(), smooth);
  const float angle_rad = orb::orientation_rad(image.view(), kMiddle, kMiddle);
  return {double(angle_rad), brief.describe(smooth.view(), kMiddle, kMiddle, angle_rad)};
}

}  // namespace

TEST_CASE("Hamming distance counts the bits that differ") {
  test::for_all_seeds(200, [](test::Rng& rng) {
    orb::Descriptor a, b;
    std::size_t expected = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      a[i] = rng(), b[i] = test::chance(rng, 0.3) ? a[i] : rng();
      expected += std::bitset<64>{a[i] ^ b[i]}.count();
    }
    CHECK(static_cast<std::size_t>(orb::hamming_distance(a, b)) == expected);
    CHECK(orb::hamming_distance(a, b) == orb::hamming_distance(b, a));
  });
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  CHECK(orb::hamming_distance({kAll, kAll, kAll, kAll}, {0, 0, 0, 0}) == 256);
  CHECK(orb::hamming_distance({1, 2, 3, 4}, {1, 2, 3, 4}) == 0);
}

TEST_CASE("The orientation points to the brighter side") {
  for (int step = 0; step < 16; ++step) {
    const double angle_rad = step * kPi / 8;
    GrayImage image(kSize, kSize);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        image(x, y) = test::grey(100 + 2 * (std::cos(angle_rad) * (x - kMiddle) + std::sin(angle_rad) * (y - kMiddle)));
    CHECK(angle_between(double(orb::orientation_rad(image.view(), kMiddle, kMiddle)), angle_rad) < 0.01);
  }
  const GrayImage wall(kSize, kSize, 77);
  CHECK(orb::orientation_rad(wall.view(), kMiddle, kMiddle) == 0);
}

TEST_CASE("The orientation against its definition") {
  test::for_all_seeds(10, [](test::Rng& rng) {
    const GrayImage image = test::texture_image(test::Texture{rng()}, kSize, kSize);
    double m_x = 0, m_y = 0;
    for (int dy = -15; dy <= 15; ++dy)
      for (int dx = -15; dx <= 15; ++dx)
        if (dx * dx + dy * dy <= 225)
          m_x += dx * double(image(kMiddle + dx, kMiddle + dy)), m_y += dy * double(image(kMiddle + dx, kMiddle + dy));
    CHECK(angle_between(double(orb::orientation_rad(image.view(), kMiddle, kMiddle)), std::atan2(m_y, m_x)) < 1e-5);
  });
}

TEST_CASE("Turning the image turns the orientation and leaves the descriptor nearly alone; another place has another descriptor") {
  const orb::Brief brief;
  int runs = 0, similar = 0, tried = 0;
  double worst_angle_rad = 0, sum_same = 0, sum_other = 0;
  test::for_all_seeds(60, [&](test::Rng& rng) {
    const test::Texture texture{rng()}, other{rng()};
    const double turn_rad = test::uniform(rng, -kPi, kPi);
    const Described still = describe(brief, test::turned_image(texture, kSize, 0)),
                    turned = describe(brief, test::turned_image(texture, kSize, turn_rad));
    ++tried;
    // A disc whose centroid is at its centre points nowhere in particular: few are like that.
    if (angle_between(turned.angle_rad - still.angle_rad, turn_rad) > 0.15) return;
    ++runs;
    worst_angle_rad = std::max(worst_angle_rad, angle_between(turned.angle_rad - still.angle_rad, turn_rad));
    const int same = orb::hamming_distance(still.descriptor, turned.descriptor);
    const int different = orb::hamming_distance(still.descriptor, describe(brief, test::turned_image(other, kSize, 0)).descriptor);
    sum_same += same, sum_other += different;
    similar += same < 64 ? 1 : 0;
  });
  MESSAGE("turned: " << runs << " of " << tried << " oriented alike, mean distance " << sum_same / runs << ", to others "
                     << sum_other / runs);
  CHECK(runs >= 0.85 * tried);
  CHECK(similar >= 0.95 * runs);
  CHECK(sum_same / runs < 35);
  CHECK(sum_other / runs > 85);
}

TEST_CASE("Without steering a turned image would be a stranger: the steering is what the test above sees") {
  const orb::Brief brief;
  const GrayImage still = test::turned_image(test::Texture{5}, kSize, 0), turned = test::turned_image(test::Texture{5}, kSize, kPi / 2);
  orb::Smoother smoother;
  GrayImage a, b;
  smoother.smooth(still.view(), a);
  smoother.smooth(turned.view(), b);
  const auto upright = [&](const GrayImage& image) { return brief.describe(image.view(), kMiddle, kMiddle, 0); };
  CHECK(orb::hamming_distance(upright(a), upright(b)) > 80);
  const auto along = [&](const GrayImage& image, float angle_rad) { return brief.describe(image.view(), kMiddle, kMiddle, angle_rad); };
  CHECK(orb::hamming_distance(along(a, 0), along(b, float(kPi / 2))) < 12);  // a quarter turn moves pixels onto pixels
}

TEST_CASE("The pattern is balanced, inside its disc, and says nothing twice") {
  double x = 0, y = 0;
  for (std::size_t i = 0; i < 256; ++i) {
    const orb::PointPair& p = orb::detail::kPattern[i];
    for (const auto& [px, py] : {std::pair{p.ax, p.ay}, std::pair{p.bx, p.by}}) {
      CHECK(px * px + py * py <= orb::detail::kPatternRadius * orb::detail::kPatternRadius);
      x += px, y += py;
    }
    for (std::size_t k = 0; k < i; ++k) CHECK_FALSE(orb::detail::says_the_same(p, orb::detail::kPattern[k]));
  }
  CHECK(std::abs(x) / 512 < 0.8);
  CHECK(std::abs(y) / 512 < 0.8);
  CHECK(orb::Brief::turn_of(float(-kPi)) == 16);
  CHECK(orb::Brief::turn_of(float(kPi)) == 16);
  CHECK(orb::Brief::turn_of(-0.01F) == 0);
  CHECK(orb::Brief::turn_of(float(-kPi / 16)) == 31);
}

TEST_CASE("Brightness and contrast of the image do not change a descriptor by much") {
  const orb::Brief brief;
  const GrayImage image = test::turned_image(test::Texture{9}, kSize, 0);
  GrayImage dimmed(kSize, kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) dimmed(x, y) = test::grey(20 + 0.5 * double(image(x, y)));
  CHECK(orb::hamming_distance(describe(brief, image).descriptor, describe(brief, dimmed).descriptor) < 20);
}
