// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A textured plane seen by a stereo camera, exact to any fraction of a pixel: the texture is a function, not an image.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <searvins/vision/stereo_camera.hpp>

#include "examples/support/gray_image.hpp"

namespace searvins::test {

/// Grey values in 0 .. 255: blotches of random brightness on three scales, smooth in between.
class Texture {
 public:
  explicit Texture(std::uint64_t seed, double cell = 9) : seed_(seed), cell_(cell) {}

  [[nodiscard]] double operator()(double x, double y) const {
    const double value = 0.5 * layer(x / cell_, y / cell_, 1) + 0.3 * layer(x / (2.7 * cell_), y / (2.7 * cell_), 2) +
                         0.2 * layer(x / (0.55 * cell_), y / (0.55 * cell_), 3);
    return std::clamp(128 + 260 * (value - 0.5), 0.0, 255.0);
  }

 private:
  [[nodiscard]] double at(std::int64_t i, std::int64_t k, std::uint64_t layer) const {
    std::uint64_t z = seed_ * 0x9e3779b97f4a7c15 + static_cast<std::uint64_t>(i) * 0xbf58476d1ce4e5b9 +
                      static_cast<std::uint64_t>(k) * 0x94d049bb133111eb + layer;
    z = (z ^ (z >> 31U)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 29U)) * 0x94d049bb133111eb;
    return static_cast<double>((z ^ (z >> 32U)) >> 11U) * 0x1p-53;
  }
  [[nodiscard]] double layer(double x, double y, std::uint64_t number) const {
    const double fx = std::floor(x), fy = std::floor(y), a = smooth(x - fx), b = smooth(y - fy);
    const auto i = static_cast<std::int64_t>(fx), k = static_cast<std::int64_t>(fy);
    return (1 - b) * ((1 - a) * at(i, k, number) + a * at(i + 1, k, number)) +
           b * ((1 - a) * at(i, k + 1, number) + a * at(i + 1, k + 1, number));
  }
  [[nodiscard]] static double smooth(double t) { return t * t * (3 - 2 * t); }

  std::uint64_t seed_;
  double cell_;
};

inline std::uint8_t grey(double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); }

/// The texture itself, pixel (x, y) showing texture(x + dx, y + dy).
inline examples::GrayImage texture_image(const Texture& texture, int width, int height, double dx = 0, double dy = 0) {
  examples::GrayImage image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image(x, y) = grey(texture(x + dx, y + dy));
  return image;
}

/// The texture turned by angle_rad (clockwise as seen, y down) around the image's centre.
inline examples::GrayImage turned_image(const Texture& texture, int size, double angle_rad) {
  examples::GrayImage image(size, size);
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), m = size / 2;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) image(x, y) = grey(texture(c * (x - m) + s * (y - m), -s * (x - m) + c * (y - m)));
  return image;
}

/// A camera of 300 px of focal length, 320 x 240 px, 0.2 m of baseline.
inline vision::StereoCamera<double> small_camera() {
  vision::StereoCamera<double> camera;
  camera.fx_px = camera.fy_px = 300;
  camera.cx_px = 160, camera.cy_px = 120;
  camera.baseline_m = 0.2;
  camera.width_px = 320, camera.height_px = 240;
  return camera;
}

/// A slanted textured plane through (0, 0, depth) of the world, and what a camera with world axes turned by R_wc at p_wc sees of it.
struct TexturedPlane {
  Texture texture;
  double depth_m{4};
  Eigen::Vector3d normal{0.25, 0.1, -1};  ///< towards the camera, any length
  double pixels_per_m{60};

  /// Point of the plane that a pixel of the left (right: `right_eye`) image shows, in the world.
  [[nodiscard]] Eigen::Vector3d point(const vision::StereoCamera<double>& camera, const Eigen::Matrix3d& R_wc, const Eigen::Vector3d& p_wc,
                                      double u, double v, bool right_eye = false) const {
    const Eigen::Vector3d ray = R_wc * Eigen::Vector3d{(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, 1};
    const Eigen::Vector3d eye = right_eye ? Eigen::Vector3d{p_wc + R_wc.col(0) * camera.baseline_m} : p_wc;
    return eye + ray * (normal.dot(Eigen::Vector3d{0, 0, depth_m} - eye) / normal.dot(ray));
  }

  [[nodiscard]] examples::GrayImage image(const vision::StereoCamera<double>& camera, const Eigen::Matrix3d& R_wc,
                                          const Eigen::Vector3d& p_wc, bool right_eye) const {
    examples::GrayImage out(camera.width_px, camera.height_px);
    for (int y = 0; y < camera.height_px; ++y)
      for (int x = 0; x < camera.width_px; ++x) {
        const Eigen::Vector3d p = point(camera, R_wc, p_wc, x, y, right_eye);
        out(x, y) = grey(texture(pixels_per_m * p.x(), pixels_per_m * p.y()));
      }
    return out;
  }
};

}  // namespace searvins::test
