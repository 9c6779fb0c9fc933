// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Pictures of a scene by an ideal rectified pair, with the class and the inverse depth of every pixel.
///
/// The centre of pixel (u, v) looks along r = ((u - cx) / fx, (v - cy) / fy, 1) in camera axes. On a plane n . (X - C) = d (camera at C,
/// everything turned into its axes) the point is X = C + Z r with
///
///     1 / Z = n . r / d                     affine in (u, v)
///     s / Z = a . r + (a . (C - o)) / Z     affine in (u, v)       texel coordinate s = a . (X - o)
///
/// so a facet is filled from six affine functions, its pattern's place and sides (ds/du = ((s/Z)_u - s (1/Z)_u) Z) are exact, and the
/// largest 1/Z wins a pixel. First it is decided which facet each pixel shows, then each pixel is shaded once. Where two bodies meet, four
/// places in the pixel are looked at again among the facets of its neighbours, and their mean is taken: outlines are smooth.
/// Class and depth are those at the pixel's centre.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "examples/support/gray_image.hpp"

#include "facet.hpp"
#include "hash.hpp"
#include "scene.hpp"
#include "sky.hpp"
#include "stereo_camera.hpp"
#include "traffic.hpp"
#include "vehicle.hpp"

namespace searvins::simulator {

using examples::GrayImage;

/// How pictures are taken.
struct RenderOptions {
  int width_px{640}, height_px{240};
  double noise_sigma{2};  ///< grey levels
  bool has_traffic{true};
};

/// One picture, before the noise: brightness, and per pixel what is there.
struct Picture {
  std::vector<float> brightness{};     ///< 0..255
  std::vector<float> inverse_depth{};  ///< 1/m along the optical axis; 0: infinitely far
  GrayImage classes{};                 ///< SurfaceClass
};

/// What a rectified pair sees at one time.
struct StereoFrame {
  GrayImage left{}, right{};
  GrayImage left_classes{};                 ///< SurfaceClass of each pixel of `left`
  std::vector<float> left_inverse_depth{};  ///< 1/m, row by row
};

/// The pair for pictures of another size: the full width is kept, rows are added or cut equally above and below. Pixel centres have whole
/// coordinates, so cx + 1/2 scales.
[[nodiscard]] inline StereoRig scaled_rig(const StereoRig& rig, int width_px, int height_px) {
  const double scale = width_px / rig.width_px;
  StereoRig out = rig;
  out.fx_px *= scale, out.fy_px *= scale;
  out.cx_px = (rig.cx_px + 0.5) * scale - 0.5;
  out.cy_px = (rig.cy_px + 0.5) * scale - 0.5 + (height_px - rig.height_px * scale) / 2;
  out.width_px = width_px, out.height_px = height_px;
  return out;
}

namespace render_detail {

/// a + b u + c v.
struct Affine {
  double a{0}, b{0}, c{0};
  [[nodiscard]] double operator()(double u, double v) const { return a + b * u + c * v; }
};

/// A facet as a camera sees it.
struct Projected {
  const Facet* facet{nullptr};
  Affine inverse_z{}, s{}, t{}, s_grime{}, t_grime{};  // the latter four over Z
  std::array<Eigen::Vector2d, 5> corners{};            // pixels, after clipping
  std::size_t count{0};

  [[nodiscard]] bool contains(double u, double v) const {
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d &p = corners[i], &q = corners[(i + 1) % count];
      if ((q.x() - p.x()) * (v - p.y()) - (q.y() - p.y()) * (u - p.x()) > 0) return false;
    }
    return count > 0;
  }
};

}  // namespace render_detail

/// Renders one camera of the pair.
class CameraRenderer {
 public:
  CameraRenderer(const StereoRig& rig, const std::vector<Texture>& patterns, const Sky& sky)
      : rig_(rig), patterns_(patterns), sky_(sky), width_(static_cast<int>(rig.width_px)), height_(static_cast<int>(rig.height_px)) {}

  /// Looks from a place with axes R_wc (right, down, forward) at facets.
  void render(const Eigen::Vector3d& camera_m, const Eigen::Matrix3d& R_wc, const std::vector<const Facet*>& facets, Picture& out) {
    camera_m_ = camera_m, R_wc_ = R_wc;
    const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    shown_.assign(pixels, -1), bodies_.assign(pixels, 0);
    out.inverse_depth.assign(pixels, 0), out.brightness.resize(pixels);
    out.classes.resize(width_, height_);
    projected_.clear();
    for (const Facet* facet : facets) {
      render_detail::Projected p;
      if (!project(*facet, p)) continue;
      projected_.push_back(p);
      fill(static_cast<int>(projected_.size()) - 1, out.inverse_depth);
    }
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u) shade_pixel(u, v, out);
  }

 private:
  static constexpr double kNearM = 0.25, kHazeM = 420, kEdgeOnM = 1e-3;
  static constexpr float kHaze = 205;
  using Projected = render_detail::Projected;
  using Affine = render_detail::Affine;

  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }

  /// The function a . r of the pixel, plus `share` times another.
  [[nodiscard]] Affine along_ray(const Eigen::Vector3d& a, double share = 0, const Affine& other = {}) const {
    const double bu = a.x() / rig_.fx_px, cv = a.y() / rig_.fy_px;
    return {a.z() - bu * rig_.cx_px - cv * rig_.cy_px + share * other.a, bu + share * other.b, cv + share * other.c};
  }

  /// False for what lies outside the picture.
  [[nodiscard]] bool project(const Facet& facet, Projected& p) const {
    std::array<Eigen::Vector3d, 4> corners;
    bool any_ahead = false;
    for (std::size_t i = 0; i < facet.count; ++i) {
      corners[i] = R_wc_.transpose() * (facet.corners_m[i] - camera_m_);
      any_ahead = any_ahead || corners[i].z() > kNearM;
    }
    if (!any_ahead) return false;
    clip(corners, facet.count, p);
    const auto outside = [&p](auto&& beyond) {
      return std::all_of(p.corners.begin(), p.corners.begin() + static_cast<long>(p.count), beyond);
    };
    if (p.count < 3 || outside([](const Eigen::Vector2d& c) { return c.x() < 0; }) ||
        outside([](const Eigen::Vector2d& c) { return c.y() < 0; }) ||
        outside([this](const Eigen::Vector2d& c) { return c.x() > width_ - 1; }) ||
        outside([this](const Eigen::Vector2d& c) { return c.y() > height_ - 1; }))
      return false;
    p.facet = &facet;
    const double distance = facet.normal.dot(facet.corners_m[0] - camera_m_);
    if (distance > -kEdgeOnM) return false;  // from behind, or so nearly edge-on that it fills no pixel
    p.inverse_z = along_ray(R_wc_.transpose() * facet.normal / distance);
    const auto texel = [&](const Layer& layer, const Eigen::Vector3d& axis) {
      return along_ray(R_wc_.transpose() * axis, axis.dot(camera_m_ - layer.origin_m), p.inverse_z);
    };
    p.s = texel(facet.paint, facet.paint.s_axis), p.t = texel(facet.paint, facet.paint.t_axis);
    p.s_grime = texel(facet.grime, facet.grime.s_axis), p.t_grime = texel(facet.grime, facet.grime.t_axis);
    return true;
  }

  /// Cuts off what is nearer than kNearM and projects the rest.
  void clip(const std::array<Eigen::Vector3d, 4>& corners, std::size_t count, Projected& p) const {
    const auto push = [&](const Eigen::Vector3d& x) {
      p.corners[p.count++] = {rig_.fx_px * x.x() / x.z() + rig_.cx_px, rig_.fy_px * x.y() / x.z() + rig_.cy_px};
    };
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d &a = corners[i], &b = corners[(i + 1) % count];
      if (a.z() >= kNearM) push(a);
      if ((a.z() >= kNearM) != (b.z() >= kNearM)) push(a + (kNearM - a.z()) / (b.z() - a.z()) * (b - a));
    }
  }

  /// Claims the pixels whose centre lies in the facet and where nothing nearer is known.
  void fill(int id, std::vector<float>& nearest) {
    const Projected& p = projected_[static_cast<std::size_t>(id)];
    double top = p.corners[0].y(), bottom = top;
    for (std::size_t i = 1; i < p.count; ++i) top = std::min(top, p.corners[i].y()), bottom = std::max(bottom, p.corners[i].y());
    const int first = std::max(0, static_cast<int>(std::ceil(std::max(top, -1.0))));
    const int last = std::min(height_ - 1, static_cast<int>(std::floor(std::min<double>(bottom, height_))));
    for (int v = first; v <= last; ++v) {
      double left = 1e9, right = -1e9;
      for (std::size_t i = 0; i < p.count; ++i) {
        const Eigen::Vector2d &a = p.corners[i], &b = p.corners[(i + 1) % p.count];
        if ((a.y() <= v) == (b.y() <= v)) continue;
        const double u = a.x() + (v - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        left = std::min(left, u), right = std::max(right, u);
      }
      if (left > right) continue;
      const int begin = std::max(0, static_cast<int>(std::ceil(std::max(left, -1.0))));
      const int end = std::min(width_ - 1, static_cast<int>(std::floor(std::min<double>(right, width_))));
      double inverse_z = p.inverse_z(begin, v);
      std::size_t i = index(0, v) + static_cast<std::size_t>(begin);
      for (int u = begin; u <= end; ++u, ++i, inverse_z += p.inverse_z.b)
        if (static_cast<float>(inverse_z) > nearest[i])
          nearest[i] = static_cast<float>(inverse_z), shown_[i] = id, bodies_[i] = p.facet->body;
    }
  }

  void shade_pixel(int u, int v, Picture& out) {
    const std::size_t i = index(u, v);
    const int id = shown_[i];
    out.classes.pixels()[i] =
        static_cast<std::uint8_t>(id < 0 ? SurfaceClass::sky : projected_[static_cast<std::size_t>(id)].facet->surface);
    out.brightness[i] = on_outline(u, v) ? smoothed(u, v) : shade(id, u, v);
  }

  [[nodiscard]] bool on_outline(int u, int v) const {
    const std::size_t i = index(u, v), row = static_cast<std::size_t>(width_);
    const std::uint32_t here = bodies_[i];
    return (u > 0 && bodies_[i - 1] != here) || (u + 1 < width_ && bodies_[i + 1] != here) || (v > 0 && bodies_[i - row] != here) ||
           (v + 1 < height_ && bodies_[i + row] != here);
  }

  /// The mean of four places, each shaded as the nearest of the facets that are shown around.
  [[nodiscard]] float smoothed(int u, int v) const {
    std::array<int, 9> around{};
    std::size_t count = 0;
    for (int y = std::max(0, v - 1); y <= std::min(height_ - 1, v + 1); ++y)
      for (int x = std::max(0, u - 1); x <= std::min(width_ - 1, u + 1); ++x) {
        const int id = shown_[index(x, y)];
        if (id >= 0 &&
            std::find(around.begin(), around.begin() + static_cast<long>(count), id) == around.begin() + static_cast<long>(count))
          around[count++] = id;
      }
    // No two in one row or column: an outline along either moves the mean in steps of a quarter.
    constexpr std::array<std::pair<double, double>, 4> kPlaces{{{-0.375, -0.125}, {0.125, -0.375}, {0.375, 0.125}, {-0.125, 0.375}}};
    float sum = 0;
    for (const auto& [du, dv] : kPlaces) {
      double nearest = 0;
      int best = -1;
      for (std::size_t k = 0; k < count; ++k) {
        const Projected& p = projected_[static_cast<std::size_t>(around[k])];
        const double inverse_z = p.inverse_z(u + du, v + dv);
        if (inverse_z > nearest && p.contains(u + du, v + dv)) nearest = inverse_z, best = around[k];
      }
      sum += shade(best, u + du, v + dv);
    }
    return sum / 4;
  }

  /// A texel coordinate less whole repetitions (a power of two each): small enough for single precision.
  [[nodiscard]] static float wrapped(double x, int repeat) {
    const auto whole = static_cast<std::int64_t>(x);
    return static_cast<float>(whole & (repeat - 1)) + static_cast<float>(x - static_cast<double>(whole));
  }

  [[nodiscard]] float pattern(int texture, int most_samples, const Affine& s, const Affine& t, const Affine& inverse_z, double z, double u,
                              double v) const {
    const Texture& pattern = patterns_[static_cast<std::size_t>(texture)];
    const double x = s(u, v) * z, y = t(u, v) * z;
    TexturePatch patch;
    patch.x = wrapped(x, pattern.width()), patch.y = wrapped(y, pattern.height());
    patch.x_u = static_cast<float>((s.b - x * inverse_z.b) * z), patch.x_v = static_cast<float>((s.c - x * inverse_z.c) * z);
    patch.y_u = static_cast<float>((t.b - y * inverse_z.b) * z), patch.y_v = static_cast<float>((t.c - y * inverse_z.c) * z);
    return pattern.mean(patch, most_samples);
  }

  [[nodiscard]] float shade(int id, double u, double v) const {
    if (id < 0) return sky_.brightness(R_wc_ * Eigen::Vector3d{(u - rig_.cx_px) / rig_.fx_px, (v - rig_.cy_px) / rig_.fy_px, 1});
    const Projected& p = projected_[static_cast<std::size_t>(id)];
    const double z = 1 / p.inverse_z(u, v);
    const float paint = pattern(p.facet->paint.texture, 4, p.s, p.t, p.inverse_z, z, u, v);
    const float grime = pattern(p.facet->grime.texture, 1, p.s_grime, p.t_grime, p.inverse_z, z, u, v);
    const float clear = (paint + 0.7F * (grime - 128)) * p.facet->shade;
    const auto haze = static_cast<float>(z / (z + kHazeM));
    return clear + haze * (kHaze - clear);
  }

  StereoRig rig_;
  const std::vector<Texture>& patterns_;
  const Sky& sky_;
  int width_, height_;
  Eigen::Vector3d camera_m_{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_wc_{Eigen::Matrix3d::Identity()};
  std::vector<Projected> projected_;
  std::vector<int> shown_;             // index in projected_, -1: sky
  std::vector<std::uint32_t> bodies_;  // of what is shown, 0: sky
};

/// Renders the pair of a vehicle. One seed gives one city's looks; the noise of a frame depends on the seed and its time alone.
class Renderer {
 public:
  Renderer(const City& city, const std::vector<WayPoint>& way, std::uint64_t seed, const RenderOptions& options = {}, const StereoRig& rig = {})
      : options_(options),
        seed_(seed),
        rig_(scaled_rig(rig, options.width_px, options.height_px)),
        patterns_(PatternSet::drawn(seed)),
        sky_(seed),
        scene_(city, way, seed),
        traffic_(way, seed),
        camera_(rig_, patterns_, sky_) {}
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  [[nodiscard]] const StereoRig& rig() const { return rig_; }
  [[nodiscard]] const Scene& scene() const { return scene_; }

  /// What the pair sees at a time of the drive, from the vehicle's state then.
  [[nodiscard]] StereoFrame frame(double t_s, const VehicleState& state) {
    const Eigen::Vector3d left_m = state.p_w_m + state.R_wb * rig_.t_bc_m;
    const Eigen::Matrix3d R_wc = state.R_wb * rig_.R_bc;
    std::vector<Facet> cars;
    if (options_.has_traffic) {
      for (const Car& car : traffic_.moving(t_s, state.p_w_m.head<2>())) add_car(car, cars);
      // Each side is a body of its own, as in the scene: a car's edges are outlines.
      for (std::size_t i = 0; i < cars.size(); ++i) cars[i].body = kFirstMovingBody + static_cast<std::uint32_t>(i);
    }
    StereoFrame out;
    for (const bool is_right : {false, true}) {
      const Eigen::Vector3d camera_m = is_right ? Eigen::Vector3d{left_m + rig_.baseline_m * R_wc.col(0)} : left_m;
      std::vector<const Facet*> near;
      scene_.for_each_near(camera_m, [&near](const Facet& f) { near.push_back(&f); });
      for (const Facet& f : cars)
        if (f.normal.dot(f.corners_m[0] - camera_m) < 0) near.push_back(&f);
      camera_.render(camera_m, R_wc, near, picture_);
      const auto stream = scrambled(static_cast<std::uint64_t>(std::llround(t_s * 1e6)) * 2 + (is_right ? 1 : 0));
      (is_right ? out.right : out.left) = exposed(picture_, seed_ ^ stream);
      if (!is_right) out.left_classes = picture_.classes, out.left_inverse_depth = picture_.inverse_depth;
    }
    return out;
  }

 private:
  static constexpr std::uint32_t kFirstMovingBody = 1U << 31U;

  /// With noise, in whole grey levels.
  [[nodiscard]] GrayImage exposed(const Picture& picture, std::uint64_t stream) const {
    GrayImage image(options_.width_px, options_.height_px);
    for (std::size_t i = 0; i < image.pixels().size(); ++i) {
      // Four bytes of a random word: their sum has the variance 4 (256^2 - 1) / 12.
      const std::uint64_t word = scrambled(stream + i);
      const auto sum = static_cast<int>((word & 255U) + (word >> 8U & 255U) + (word >> 16U & 255U) + (word >> 24U & 255U));
      const float noise = static_cast<float>(options_.noise_sigma) * (static_cast<float>(sum) - 510.F) / 147.8F;
      image.pixels()[i] = static_cast<std::uint8_t>(std::clamp(picture.brightness[i] + noise + 0.5F, 0.F, 255.F));
    }
    return image;
  }

  RenderOptions options_;
  std::uint64_t seed_;
  StereoRig rig_;
  std::vector<Texture> patterns_;
  Sky sky_;
  Scene scene_;
  Traffic traffic_;
  CameraRenderer camera_;
  Picture picture_;
};

}  // namespace searvins::simulator
