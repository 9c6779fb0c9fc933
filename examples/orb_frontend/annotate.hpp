// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A picture of what the frontend made of a frame: the left image, darkened, with a mark at every feature.
///
///     ring, and a bar to the left as long as the disparity     seen by both eyes and followed; blue (new), green, yellow (25 frames)
///     dot                                                      not followed, in the colour of the reason
///
/// The legend below has the dots' colours in the order of MatchFate with how many there are of each, as bars: a picture has no letters
/// here, the caption around it does.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <searvins/vision/image_view.hpp>

#include "examples/orb_frontend/match_choice.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/support/rgb_image.hpp"

namespace searvins::orb {

inline constexpr int kFullAge = 25;       ///< frames from which on a track has the last colour
inline constexpr int kLegendHeight = 10;  ///< px below the image

/// Colour of a track by the frames it has been seen in.
[[nodiscard]] inline examples::Rgb colour_of_age(int age) {
  constexpr std::array<examples::Rgb, 4> kStops{{{70, 110, 255}, {40, 190, 230}, {70, 220, 90}, {255, 225, 40}}};
  const double place = 3.0 * std::clamp(age - 1, 0, kFullAge - 1) / (kFullAge - 1);
  const auto i = std::min<std::size_t>(2, static_cast<std::size_t>(place));
  const auto blend = [part = place - static_cast<double>(i)](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + part * (b - a)));
  };
  const examples::Rgb a = kStops[i], b = kStops[i + 1];
  return {blend(a.r, b.r), blend(a.g, b.g), blend(a.b, b.b)};
}

/// Colour of a reason.
[[nodiscard]] constexpr examples::Rgb colour_of(MatchFate fate) {
  constexpr std::array<examples::Rgb, kMatchFates> kColours{
      {{255, 255, 255}, {150, 150, 150}, {200, 90, 255}, {255, 150, 30}, {255, 100, 170}, {255, 60, 50}, {160, 90, 40}}};
  return kColours[static_cast<std::size_t>(fate)];
}

namespace detail {

inline void fill(examples::RgbImage& image, int x, int y, int width, int height, examples::Rgb colour) {
  for (int row = y; row < y + height; ++row)
    for (int column = x; column < x + width; ++column) image.set(column, row, colour);
}

inline void ring(examples::RgbImage& image, float u, float v, float radius, examples::Rgb colour) {
  const int reach = static_cast<int>(radius) + 2, x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      const float from_ring = std::hypot(static_cast<float>(x + dx) - u, static_cast<float>(y + dy) - v) - radius;
      if (std::abs(from_ring) < 0.8F) image.set(x + dx, y + dy, colour);
    }
}

[[nodiscard]] inline examples::RgbImage darkened(const vision::ImageView& image) {
  examples::RgbImage out(image.width, image.height + kLegendHeight);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto grey = static_cast<std::uint8_t>(image(x, y) * 7 / 10);
      out.set(x, y, {grey, grey, grey});
    }
  return out;
}

}  // namespace detail

/// The picture of the frame that the frontend processed last; `left` is its left image. It is kLegendHeight px higher than the image.
template <std::size_t N>
[[nodiscard]] examples::RgbImage annotate(const OrbFrontend<N>& frontend, const vision::ImageView& left) {
  examples::RgbImage picture = detail::darkened(left);
  std::unordered_map<std::uint64_t, int> ages;
  for (const Track& track : frontend.tracks()) ages[track.id] = track.age;
  const std::vector<Feature>& features = frontend.features();
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    const StereoMatch& match = frontend.stereo_matches()[i];
    const std::uint64_t track = frontend.track_of_feature()[i];
    const int x = static_cast<int>(std::lround(f.u_px)), y = static_cast<int>(std::lround(f.v_px));
    if (match.fate != MatchFate::matched || track == OrbFrontend<N>::kNoTrack) {
      detail::fill(picture, x - 1, y - 1, 3, 3, colour_of(match.fate));
      continue;
    }
    const examples::Rgb colour = colour_of_age(ages[track]);
    detail::ring(picture, f.u_px, f.v_px, 4 + 1.5F * static_cast<float>(f.level), colour);
    const int bar = static_cast<int>(std::lround(match.disparity_px));
    detail::fill(picture, x - bar, y, bar, 1, colour);
  }
  int x = 0;
  for (std::size_t fate = 0; fate < kMatchFates; ++fate) {
    const int width = features.empty()
                          ? 0
                          : static_cast<int>(frontend.statistics().stereo[fate] * static_cast<std::size_t>(left.width) / features.size());
    detail::fill(picture, x, left.height + 2, width, kLegendHeight - 2, colour_of(static_cast<MatchFate>(fate)));
    x += width;
  }
  return picture;
}

}  // namespace searvins::orb
