// SPDX-License-Identifier: BSD-3-Clause
// The renderer's parts: patterns, the scaled pair, one wall against projections made here, outlines.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "examples/simulator/renderer.hpp"
#include "tests/support/property.hpp"

using namespace searvins;
using namespace searvins::simulator;

namespace {

std::vector<Texture> plain_patterns() { return std::vector<Texture>(32); }

}  // namespace

TEST_CASE("pattern: value at a texel's middle, means over patches, no glitter") {
  test::for_all_seeds(20, [](test::Rng& rng) {
    std::vector<float> values;
    double mean = 0;
    for (int i = 0; i < 64 * 32; ++i)
      values.push_back(static_cast<float>(test::integer(rng, 0, 255))), mean += static_cast<double>(values.back()) / (64 * 32);
    const Texture texture(64, 32, values);
    TexturePatch patch;
    for (int k = 0; k < 50; ++k) {
      const int x = test::integer(rng, -200, 200), y = test::integer(rng, -200, 200);
      patch.x = static_cast<float>(x) + 0.5F, patch.y = static_cast<float>(y) + 0.5F;
      CHECK(texture.mean(patch) == values[static_cast<std::size_t>((y & 31) * 64 + (x & 63))]);
    }
    // A patch of 16 x 16 texels in any place: near the mean, whose sigma is 74 / 16; as large as the pattern: the mean.
    patch.x_u = patch.y_v = 16;
    for (int k = 0; k < 20; ++k) {
      patch.x = static_cast<float>(test::uniform(rng, 0, 64)), patch.y = static_cast<float>(test::uniform(rng, 0, 32));
      CHECK(std::abs(static_cast<double>(texture.mean(patch)) - mean) < 25);
    }
    patch.x_u = patch.y_v = 64;
    CHECK(static_cast<double>(texture.mean(patch)) == doctest::Approx(mean).epsilon(0.06));
    // A patch 8 texels long and 1 wide: the mean of those 8 texels, which blurring in all directions would miss.
    patch = {16.5F, 8.5F, 8, 0, 0, 1};
    double eight = 0;
    for (std::size_t i = 13; i < 21; ++i) eight += static_cast<double>(values[8 * 64 + i] + values[8 * 64 + i - 1]) / 16;
    CHECK(static_cast<double>(texture.mean(patch)) == doctest::Approx(eight).epsilon(0.01));
  });
}

TEST_CASE("scaled rig: what is seen at the track's pixel is seen at the scaled place") {
  const StereoRig full;
  test::for_all_seeds(50, [&](test::Rng& rng) {
    const int width = test::integer(rng, 100, 2500), height = test::integer(rng, 60, 900);
    const StereoRig rig = scaled_rig(full, width, height);
    const double scale = width / full.width_px;
    const Eigen::Vector3d p{test::uniform(rng, -5, 5), test::uniform(rng, -2, 2), test::uniform(rng, 3, 50)};
    const double u = full.fx_px * p.x() / p.z() + full.cx_px, v = full.fy_px * p.y() / p.z() + full.cy_px;
    // The left edge of the first pixel, -1/2, stays; the middle of the height stays the middle.
    CHECK(rig.fx_px * p.x() / p.z() + rig.cx_px == doctest::Approx((u + 0.5) * scale - 0.5).epsilon(1e-9));
    CHECK(rig.fy_px * p.y() / p.z() + rig.cy_px - (height - 1) / 2.0 ==
          doctest::Approx((v - (full.height_px - 1) / 2) * scale).epsilon(1e-9));
    CHECK(rig.baseline_m == full.baseline_m);
  });
  const StereoRig same = scaled_rig(full, 2048, 732);
  CHECK(same.cx_px == full.cx_px);
  CHECK(same.cy_px == full.cy_px);
}

TEST_CASE("one wall: its outline in the class image is where its corners project, at every pose") {
  const std::vector<Texture> patterns = plain_patterns();
  const Sky sky(1);
  const StereoRig rig = scaled_rig(StereoRig{}, 320, 120);
  CameraRenderer camera(rig, patterns, sky);
  Picture picture;
  int edges = 0;
  test::for_all_seeds(150, [&](test::Rng& rng) {
    // A wall ahead of a camera that may be turned any way; corners left to right at the bottom as the camera sees it.
    const double depth_m = test::uniform(rng, 4, 40), half_m = test::uniform(rng, 0.05, 0.25) * depth_m,
                 slant = test::uniform(rng, -0.8, 0.8);
    const Eigen::Matrix3d R_wc = Eigen::AngleAxisd(test::uniform(rng, -3, 3), test::random_vector(rng).normalized()).toRotationMatrix();
    const Eigen::Vector3d camera_m = test::random_vector(rng, 100);
    std::array<Eigen::Vector3d, 4> seen{Eigen::Vector3d{-half_m, 0.06 * depth_m, depth_m - slant * half_m},
                                        {half_m, 0.06 * depth_m, depth_m + slant * half_m},
                                        {half_m, -0.08 * depth_m, depth_m + slant * half_m},
                                        {-half_m, -0.08 * depth_m, depth_m - slant * half_m}};
    std::array<Eigen::Vector3d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = camera_m + R_wc * seen[i];
    const Facet wall = facet_of(corners, SurfaceClass::building);
    camera.render(camera_m, R_wc, {&wall}, picture);
    const auto u_of = [&](const Eigen::Vector3d& p) { return rig.fx_px * p.x() / p.z() + rig.cx_px; };
    const auto v_of = [&](const Eigen::Vector3d& p) { return rig.fy_px * p.y() / p.z() + rig.cy_px; };
    const int row = static_cast<int>(std::lround((v_of(seen[0]) + v_of(seen[3])) / 2));
    const double left = u_of(seen[0]), right = u_of(seen[1]);
    if (left < 1 || right > 318 || right - left < 3) return;
    int first = -1, last = -1;
    for (int u = 0; u < 320; ++u)
      if (picture.classes(u, row) == 0) last = u, first = first < 0 ? u : first;
    CHECK(first == static_cast<int>(std::ceil(left)));
    CHECK(last == static_cast<int>(std::floor(right)));
    const int column = static_cast<int>(std::lround((left + right) / 2));
    int top = -1;
    for (int v = 119; v >= 0; --v)
      if (picture.classes(column, v) == 0) top = v;
    const double top_left = v_of(seen[3]), top_right = v_of(seen[2]);
    const double line = top_left + (column - left) / (right - left) * (top_right - top_left);
    CHECK(std::abs(top - line) <= 1);
    // Depth along the axis at the middle of the row.
    const Eigen::Vector3d normal = (seen[1] - seen[0]).cross(seen[3] - seen[0]);
    const Eigen::Vector3d ray{(column - rig.cx_px) / rig.fx_px, (row - rig.cy_px) / rig.fy_px, 1};
    const double z = normal.dot(seen[0]) / normal.dot(ray);
    const auto i = static_cast<std::size_t>(row * 320 + column);
    CHECK(static_cast<double>(picture.inverse_depth[i]) == doctest::Approx(1 / z).epsilon(1e-5));
    // From behind there is nothing.
    std::reverse(corners.begin(), corners.end());
    const Facet away = facet_of(corners, SurfaceClass::building);
    camera.render(camera_m, R_wc, {&away}, picture);
    CHECK(std::all_of(picture.inverse_depth.begin(), picture.inverse_depth.end(), [](float x) { return x == 0; }));
    ++edges;
  });
  CHECK(3 * edges > static_cast<int>(test::property_runs(150)));  // a wall may be out of sight
}

TEST_CASE("outlines are smooth: a pixel's brightness is its covered share") {
  const std::vector<Texture> patterns = plain_patterns();
  const Sky sky(1);
  const StereoRig rig = scaled_rig(StereoRig{}, 320, 120);
  CameraRenderer camera(rig, patterns, sky);
  Picture picture;
  std::vector<float> at_edge;
  for (int step = 0; step < 8; ++step) {
    const double edge_u = 150 + step / 8.0 - 0.5, x = 10 * (edge_u - rig.cx_px) / rig.fx_px;
    const std::array<Eigen::Vector3d, 4> corners{Eigen::Vector3d{x, 3, 10}, {x + 6, 3, 10}, {x + 6, -3, 10}, {x, -3, 10}};
    Facet wall = facet_of(corners, SurfaceClass::building);
    wall.shade = 0.2F;
    camera.render(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity(), {&wall}, picture);
    at_edge.push_back(picture.brightness[static_cast<std::size_t>(60 * 320 + 150)]);
  }
  for (std::size_t i = 1; i < at_edge.size(); ++i) CHECK(at_edge[i] >= at_edge[i - 1] - 1);  // less and less of the dark wall
  CHECK(at_edge.back() - at_edge.front() > 50);
  CHECK(at_edge[4] > at_edge.front() + 20);
  CHECK(at_edge[4] < at_edge.back() - 20);
}

TEST_CASE("any facet: nothing but finite brightness and depth, also through the camera and edge-on") {
  const std::vector<Texture> patterns = plain_patterns();
  const Sky sky(2);
  const StereoRig rig = scaled_rig(StereoRig{}, 96, 48);
  CameraRenderer camera(rig, patterns, sky);
  Picture picture;
  test::for_all_seeds(200, [&](test::Rng& rng) {
    const double size = std::pow(10, test::uniform(rng, -2, 2));
    const Eigen::Vector3d middle = test::random_vector(rng, size), a = test::random_vector(rng, size);
    const Eigen::Vector3d b = test::random_vector(rng, size), through = test::chance(rng, 0.3) ? Eigen::Vector3d{-middle} : middle;
    const Eigen::Vector3d origin = test::chance(rng, 0.3) ? Eigen::Vector3d::Zero() : through;
    const std::array<Eigen::Vector3d, 4> corners{origin - a - b, origin + a - b, origin + a + b, origin - a + b};
    Facet f = facet_of(corners, SurfaceClass::road);
    f.paint = layer_along(f, 0), f.grime = layer_on_map(0, kTexelsPerM);
    camera.render(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity(), {&f}, picture);
    // Sky, haze and paint mix to no more than their extremes; nothing is nearer than where facets are cut.
    CHECK(std::all_of(picture.brightness.begin(), picture.brightness.end(), [](float grey) { return grey > -400 && grey < 700; }));
    CHECK(std::all_of(picture.inverse_depth.begin(), picture.inverse_depth.end(), [](float x) { return x >= 0 && x < 4.1F; }));
  });
}
