// SPDX-License-Identifier: BSD-3-Clause
// Rendered streets: classes against the world, depth against the simulator's own tracks, both images against each other.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "examples/simulator/renderer.hpp"
#include "examples/simulator/simulation.hpp"

using namespace searvins;
using namespace searvins::simulator;

namespace {

SimulationOptions urban_drive(std::uint64_t seed) {
  SimulationOptions options;
  options.profile = "urban", options.duration_s = 90, options.seed = seed;
  return options;
}

/// A drive that begins between houses, and its renderer.
struct RenderedDrive {
  Simulation simulation;
  Renderer renderer;

  explicit RenderedDrive(std::uint64_t seed, const RenderOptions& options = {})
      : simulation(urban_drive(seed)), renderer(simulation.city(), simulation.way(), seed, options) {}
  [[nodiscard]] StereoFrame frame(double t_s) { return renderer.frame(t_s, simulation.vehicle().state(t_s)); }
};

/// The camera of a state: place and axes.
struct Eye {
  Eigen::Vector3d place_m;
  Eigen::Matrix3d R_wc;
  Eye(const VehicleState& s, const StereoRig& rig) : place_m(s.p_w_m + s.R_wb * rig.t_bc_m), R_wc(s.R_wb * rig.R_bc) {}

  [[nodiscard]] Eigen::Vector3d world(const StereoRig& rig, double u, double v, double inverse_depth) const {
    return place_m + R_wc * Eigen::Vector3d{(u - rig.cx_px) / rig.fx_px, (v - rig.cy_px) / rig.fy_px, 1} / inverse_depth;
  }
};

double median_of(std::vector<double> values) {
  REQUIRE_FALSE(values.empty());
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Distance of a place in the map from a segment.
double distance_m(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d side = b - a;
  return (p - a - std::clamp((p - a).dot(side) / side.squaredNorm(), 0.0, 1.0) * side).norm();
}

}  // namespace

TEST_CASE("street: each pixel's class is that of the surface which lies at its depth") {
  RenderOptions options;
  options.width_px = 320, options.height_px = 120;
  RenderedDrive drive(3, options);
  const StereoRig& rig = drive.renderer.rig();
  const City& city = drive.simulation.city();
  long buildings = 0, roads = 0, wrong_buildings = 0, wrong_roads = 0;
  for (const double t_s : {0.0, 27.0, 45.0, 70.0}) {
    const VehicleState state = drive.simulation.vehicle().state(t_s);
    const Eye eye(state, rig);
    const StereoFrame frame = drive.frame(t_s);
    for (int v = 0; v < 120; v += 3)
      for (int u = 0; u < 320; u += 3) {
        const auto surface = static_cast<SurfaceClass>(frame.left_classes(u, v));
        const double inverse_depth = static_cast<double>(frame.left_inverse_depth[static_cast<std::size_t>(v * 320 + u)]);
        CHECK((surface == SurfaceClass::sky) == (inverse_depth == 0));
        if (inverse_depth <= 0) continue;
        const Eigen::Vector3d p = eye.world(rig, u, v, inverse_depth);
        if (surface == SurfaceClass::building) {
          ++buildings;
          const bool on_wall = std::any_of(city.walls.begin(), city.walls.end(), [&](const Wall& w) {
            return p.z() < w.top_m + 0.01 && p.z() > w.bottom_m && distance_m(p.head<2>(), w.a_m, w.b_m) < 0.01;
          });
          const bool on_bridge = std::any_of(city.bridges.begin(), city.bridges.end(), [&](const Bridge& b) {
            return p.z() > b.underside_m - 0.01 && p.z() < b.underside_m + 1.7 && (p.head<2>() - b.centre_m).norm() < 22;
          });
          wrong_buildings += on_wall || on_bridge ? 0 : 1;
        } else if (surface == SurfaceClass::road) {
          // At the height of the nearest piece of the way, 4 cm less at the sides; hills and crossings leave a few centimetres.
          const auto nearest =
              std::min_element(drive.simulation.way().begin(), drive.simulation.way().end(), [&](const WayPoint& a, const WayPoint& b) {
                return (a.p_m - p.head<2>()).squaredNorm() < (b.p_m - p.head<2>()).squaredNorm();
              });
          if ((nearest->p_m - p.head<2>()).norm() > 12) continue;
          ++roads;
          wrong_roads += std::abs(p.z() - nearest->ground_m) < 0.12 ? 0 : 1;
        }
      }
  }
  CHECK(buildings > 3000);
  CHECK(roads > 3000);
  CHECK(wrong_buildings == 0);
  CHECK(wrong_roads <= roads / 200);
}

TEST_CASE("street: the simulator's own tracks lie on the surface that the picture shows there, at its depth") {
  RenderOptions options;
  options.width_px = 1024, options.height_px = 366;  // half the size of the tracks
  options.has_traffic = false;
  RenderedDrive drive(4, options);
  StereoCamera tracks = drive.simulation.camera();
  const StereoRig full;
  int facade = 0, facade_class = 0, facade_depth = 0, road = 0, road_depth = 0;
  for (const double t_s : {24.0, 30.0, 36.0, 42.0}) {
    const VehicleState state = drive.simulation.vehicle().state(t_s);
    const StereoFrame frame = drive.frame(t_s);
    for (const TrackObservation& o : tracks.frame(state)) {
      if (o.is_wrong) continue;
      const int u = static_cast<int>(std::lround((o.u_left_px + 0.5) / 2 - 0.5)),
                v = static_cast<int>(std::lround((o.v_px + 0.5) / 2 - 0.5));
      if (u < 0 || v < 0 || u >= 1024 || v >= 366) continue;
      const double disparity =
          full.fx_px * full.baseline_m * static_cast<double>(frame.left_inverse_depth[static_cast<std::size_t>(v * 1024 + u)]);
      const bool same_depth = std::abs(disparity - (o.u_left_px - o.u_right_px)) < 3;  // two sigma of the tracks and the rounding
      if (o.semantic_class == 0) ++facade, facade_class += frame.left_classes(u, v) == 0 ? 1 : 0, facade_depth += same_depth ? 1 : 0;
      if (o.semantic_class == 1) ++road, road_depth += same_depth ? 1 : 0;
    }
  }
  MESSAGE("facade points: " << facade << ", shown as building " << facade_class << ", at their depth " << facade_depth
                            << "; road points: " << road << ", at their depth " << road_depth);
  REQUIRE(facade > 30);
  REQUIRE(road > 20);
  // The rest stands behind a tree, a post or a parked car, which the tracks do not know.
  CHECK(facade_class >= 0.7 * facade);
  CHECK(facade_depth >= 0.7 * facade);
  CHECK(road_depth >= 0.7 * road);
}

TEST_CASE("street: the right picture shows what the left one shows, moved along the row by the disparity") {
  RenderOptions options;
  options.noise_sigma = 0;
  RenderedDrive drive(5, options);
  const StereoRig& rig = drive.renderer.rig();
  const StereoFrame frame = drive.frame(33);
  std::vector<double> as_is, one_off, row_off;
  for (int v = 2; v < 238; v += 2)
    for (int u = 60; u < 638; u += 2) {
      const double inverse_depth = static_cast<double>(
          frame.left_inverse_depth[frame.left.pixels().size() / 240 * static_cast<std::size_t>(v) + static_cast<std::size_t>(u)]);
      const double x = u - rig.fx_px * rig.baseline_m * inverse_depth;
      if (inverse_depth <= 0.02 || x < 3 || x > 635) continue;
      const auto right_at = [&](double at, int y) {
        const int i = static_cast<int>(std::floor(at));
        return frame.right(i, y) + (at - i) * (frame.right(i + 1, y) - frame.right(i, y));
      };
      const double left = frame.left(u, v);
      as_is.push_back(std::abs(left - right_at(x, v))), one_off.push_back(std::abs(left - right_at(x + 2, v)));
      row_off.push_back(std::abs(left - right_at(x, v + 2)));
    }
  const auto mean = [](const std::vector<double>& all) {
    double sum = 0;
    for (const double x : all) sum += x;
    return sum / static_cast<double>(all.size());
  };
  MESSAGE("mean difference " << mean(as_is) << " grey levels, two columns off " << mean(one_off) << ", two rows off " << mean(row_off));
  REQUIRE(as_is.size() > 10'000);
  CHECK(median_of(as_is) < 2);
  CHECK(mean(as_is) < 0.6 * mean(one_off));
  CHECK(mean(as_is) < 0.6 * mean(row_off));
}

TEST_CASE("street: one seed gives the same pictures whatever was rendered before; the noise is as wanted") {
  RenderOptions small;
  small.width_px = 160, small.height_px = 60;
  RenderedDrive a(6, small), b(6, small), c(7, small);
  const StereoFrame first = a.frame(30);
  (void)b.frame(12);
  const StereoFrame again = b.frame(30), other = c.frame(30);
  CHECK(first.left.pixels() == again.left.pixels());
  CHECK(first.right.pixels() == again.right.pixels());
  CHECK(first.left_classes.pixels() == again.left_classes.pixels());
  CHECK(first.left_inverse_depth == again.left_inverse_depth);
  CHECK(first.left.pixels() != other.left.pixels());
  small.noise_sigma = 0;
  RenderedDrive clean(6, small);
  const StereoFrame without = clean.frame(30);
  double sum = 0, sum2 = 0;
  const std::size_t n = without.left.pixels().size();
  for (std::size_t i = 0; i < n; ++i) {
    const double d = static_cast<double>(first.left.pixels()[i]) - without.left.pixels()[i];
    sum += d, sum2 += d * d;
  }
  CHECK(std::abs(sum / static_cast<double>(n)) < 0.1);
  CHECK(std::sqrt(sum2 / static_cast<double>(n)) == doctest::Approx(2.04).epsilon(0.04));  // 2 and the rounding of both
}

TEST_CASE("street: while the vehicle stands only cars move") {
  RenderOptions small;
  small.width_px = 320, small.height_px = 120, small.noise_sigma = 0;
  RenderedDrive drive(8, small);  // the first twenty seconds of a drive are a stop
  long moved = 0, still = 0, changed_without_car = 0;
  const StereoFrame before = drive.frame(3);
  for (const double t_s : {5.0, 7.0, 9.0, 11.0}) {
    const StereoFrame after = drive.frame(t_s);
    for (int v = 1; v < 119; ++v)
      for (int u = 1; u < 319; ++u) {
        bool near_car = false;  // a pixel at a car's outline shows some of it
        for (int y = -1; y <= 1; ++y)
          for (int x = -1; x <= 1; ++x)
            for (const StereoFrame* f : {&before, &after})
              near_car = near_car || f->left_classes(u + x, v + y) == static_cast<int>(SurfaceClass::vehicle);
        const bool changed = std::abs(before.left(u, v) - after.left(u, v)) > 1;
        const bool shadow = before.left_classes(u, v) == static_cast<int>(SurfaceClass::road);
        if (near_car)
          moved += changed ? 1 : 0;
        else if (!shadow)
          ++still, changed_without_car += changed ? 1 : 0;
      }
  }
  CHECK(moved > 200);
  CHECK(still > 10'000);
  CHECK(changed_without_car == 0);
}
