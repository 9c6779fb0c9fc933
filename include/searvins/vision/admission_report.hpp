// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What became of stereo observations and of the frames they came in: every one is counted under exactly one fate, so a report can show
/// what was kept, what was refused, and why.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace searvins::vision {

/// Fate of an observation, in the order in which the tests are made: the first that fails names it.
enum class ObservationFate : std::uint8_t {
  admitted,            ///< becomes a factor
  maturing,            ///< passed every test; its track is too young for a landmark
  no_new_landmark,     ///< passed every test, but begins a landmark in a frame that may only reuse
  frame_rejected,      ///< passed every test, in a frame whose motion is not believed
  surplus,             ///< passed every test; enough others were chosen, spread over the picture
  not_finite,          ///< a NaN or infinity
  duplicate_track,     ///< the track number occurs more than once in the frame: none of them is believed
  low_score,           ///< match score below min_score
  vertical_disparity,  ///< left and right differ in row by more than max_v_difference_px
  outside_image,       ///< a pixel that is not on the image
  no_disparity,        ///< u_left <= u_right: behind the camera or matched wrongly
  too_near,            ///< nearer than range.min_depth_m
  too_far,             ///< beyond range.max_depth_m, or less disparity than range.min_disparity_px
  semantic_class,      ///< lies on a rejected class, in either view
  semantic_boundary,   ///< lies within the margin of one
  motion_outlier,      ///< contradicts the motion on which the others agree
  no_room,             ///< more tracks than the table holds
  capacity,            ///< did not fit into the frame (the lowest scores of more than it holds)
};
inline constexpr std::size_t kObservationFates = 18;  ///< number of ObservationFate values

/// Name of a fate, for tables.
[[nodiscard]] constexpr const char* name_of(ObservationFate fate) {
  constexpr std::array<const char*, kObservationFates> names{
      "admitted",        "maturing",       "no new landmark",    "frame rejected", "surplus",      "not finite",
      "duplicate track", "low score",      "vertical disparity", "outside image",  "no disparity", "too near",
      "too far",         "semantic class", "semantic boundary",  "motion outlier", "no room",      "over capacity"};
  return names[static_cast<std::size_t>(fate)];
}

/// Fate of a frame.
enum class FrameFate : std::uint8_t {
  full,            ///< the motion agrees with the prediction
  full_alone,      ///< nothing was predicted: the motion has the support of its points alone
  full_unchecked,  ///< the motion check is switched off
  reuse_only,      ///< motion and prediction agree roughly
  differs,         ///< motion and prediction contradict each other: rejected
  no_motion,       ///< too few points agree on a motion: rejected
  no_previous,     ///< the first frame, or the first after a gap: nothing to compare with, rejected
  empty,           ///< no observation came (black picture, lens covered): rejected
  masked,          ///< all observations lie on rejected classes: rejected
  nothing_usable,  ///< all observations were refused, for several reasons: rejected
  out_of_order,    ///< not after the frame before: refused, nothing changed
};
inline constexpr std::size_t kFrameFates = 11;  ///< number of FrameFate values

/// Name of a fate, for tables.
[[nodiscard]] constexpr const char* name_of(FrameFate fate) {
  constexpr std::array<const char*, kFrameFates> names{"full",
                                                       "full, no prediction",
                                                       "full, motion not checked",
                                                       "reuse only",
                                                       "motion differs",
                                                       "no motion",
                                                       "no previous",
                                                       "empty",
                                                       "masked",
                                                       "nothing usable",
                                                       "out of order"};
  return names[static_cast<std::size_t>(fate)];
}

/// Counts since the beginning.
struct AdmissionCounts {
  std::array<std::size_t, kObservationFates> observations{};
  std::array<std::size_t, kFrameFates> frames{};
  std::size_t landmarks{0};     ///< begun
  std::size_t still_frames{0};  ///< frames with the stop cue up

  [[nodiscard]] std::size_t of(ObservationFate fate) const { return observations[static_cast<std::size_t>(fate)]; }
  [[nodiscard]] std::size_t of(FrameFate fate) const { return frames[static_cast<std::size_t>(fate)]; }
  void count(ObservationFate fate, std::size_t n = 1) { observations[static_cast<std::size_t>(fate)] += n; }
  void count(FrameFate fate) { ++frames[static_cast<std::size_t>(fate)]; }

  /// All observations that were offered.
  [[nodiscard]] std::size_t offered() const {
    std::size_t sum = 0;
    for (const std::size_t n : observations) sum += n;
    return sum;
  }
};

}  // namespace searvins::vision
