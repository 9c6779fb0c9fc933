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

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <searvins/vision/image_view.hpp>

#include "examples/orb_frontend/match_choice.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/support/picture_marks.hpp"
#include "examples/support/rgb_image.hpp"

namespace searvins::orb {

inline constexpr int kLegendHeight = 10;  ///< px below the image

/// Colour of a reason.
[[nodiscard]] constexpr examples::Rgb colour_of(MatchFate fate) {
  constexpr std::array<examples::Rgb, kMatchFates> kColours{
      {{255, 255, 255}, {150, 150, 150}, {200, 90, 255}, {255, 150, 30}, {255, 100, 170}, {255, 60, 50}, {160, 90, 40}}};
  return kColours[static_cast<std::size_t>(fate)];
}

/// The picture of the frame that the frontend processed last; `left` is its left image. It is kLegendHeight px higher than the image.
template <std::size_t N>
[[nodiscard]] examples::RgbImage annotate(const OrbFrontend<N>& frontend, const vision::ImageView& left) {
  examples::RgbImage picture = examples::darkened(left, 70, kLegendHeight);
  std::unordered_map<std::uint64_t, int> ages;
  for (const Track& track : frontend.tracks()) ages[track.id] = track.age;
  const std::vector<Feature>& features = frontend.features();
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    const StereoMatch& match = frontend.stereo_matches()[i];
    const std::uint64_t track = frontend.track_of_feature()[i];
    const int x = static_cast<int>(std::lround(f.u_px)), y = static_cast<int>(std::lround(f.v_px));
    if (match.fate != MatchFate::matched || track == OrbFrontend<N>::kNoTrack) {
      examples::fill(picture, x - 1, y - 1, 3, 3, colour_of(match.fate));
      continue;
    }
    const examples::Rgb colour = examples::colour_of_age(ages[track]);
    examples::ring(picture, f.u_px, f.v_px, 4 + 1.5F * static_cast<float>(f.level), colour);
    const int bar = static_cast<int>(std::lround(match.disparity_px));
    examples::fill(picture, x - bar, y, bar, 1, colour);
  }
  int x = 0;
  for (std::size_t fate = 0; fate < kMatchFates; ++fate) {
    const int width = features.empty()
                          ? 0
                          : static_cast<int>(frontend.statistics().stereo[fate] * static_cast<std::size_t>(left.width) / features.size());
    examples::fill(picture, x, left.height + 2, width, kLegendHeight - 2, colour_of(static_cast<MatchFate>(fate)));
    x += width;
  }
  return picture;
}

}  // namespace searvins::orb
