// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One picture of the strip of frames in a report, and how the fates of observations are drawn in it:
///
///     ring    admitted, in the colour of the track's age (picture_marks.hpp), with a bar to the left as long as the disparity
///     dot     passed the tests, but was not taken: too young a track, one of more than enough, a frame that is not believed
///     cross   refused by a test
///
/// Dots and crosses have the colour of their reason. Observations of a frame that was never screened are grey dots.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <searvins/core/time.hpp>
#include <searvins/vision/admission_report.hpp>

#include "examples/support/rgb_image.hpp"

namespace searvins::examples {

inline constexpr Rgb kUnscreenedColour{184, 190, 196};

/// Shape of a mark.
enum class MarkShape { ring, dot, cross };

/// How an observation of a fate is marked.
[[nodiscard]] constexpr MarkShape shape_of(vision::ObservationFate fate) {
  using enum vision::ObservationFate;
  if (fate == admitted) return MarkShape::ring;
  return fate == maturing || fate == no_new_landmark || fate == frame_rejected || fate == surplus || fate == no_room ? MarkShape::dot
                                                                                                                     : MarkShape::cross;
}

/// Colour of a reason. That of `admitted` is never drawn: those marks have the colour of their age.
[[nodiscard]] constexpr Rgb colour_of(vision::ObservationFate fate) {
  constexpr std::array<Rgb, vision::kObservationFates> kColours{{
      {70, 220, 90},    // admitted
      {255, 255, 255},  // maturing
      {200, 180, 255},  // no new landmark
      {255, 150, 30},   // frame rejected
      {214, 190, 140},  // surplus
      {255, 0, 0},      // not finite
      {255, 20, 130},   // duplicate track
      {170, 95, 255},   // low score
      {255, 120, 190},  // vertical disparity
      {170, 100, 50},   // outside image
      {150, 80, 225},   // no disparity
      {255, 185, 120},  // too near
      {180, 170, 60},   // too far
      {255, 60, 50},    // semantic class
      {255, 140, 125},  // semantic boundary
      {255, 70, 235},   // motion outlier
      {180, 60, 90},    // no room
      {110, 60, 40},    // over capacity
  }};
  return kColours[static_cast<std::size_t>(fate)];
}

/// A frame with its marks.
struct StripPicture {
  GpsTime time{};
  std::optional<vision::FrameFate> fate{};  ///< nothing: it was never screened
  RgbImage image{};
  std::array<std::size_t, vision::kObservationFates> counts{};  ///< observations by fate
  std::size_t unscreened{0};                                    ///< observations without a fate

  /// All observations.
  [[nodiscard]] std::size_t offered() const {
    std::size_t sum = unscreened;
    for (const std::size_t n : counts) sum += n;
    return sum;
  }
  [[nodiscard]] std::size_t admitted() const { return counts[static_cast<std::size_t>(vision::ObservationFate::admitted)]; }
};

}  // namespace searvins::examples
