// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What a stereo frontend says of one image pair: where it saw which points.
///
/// A point is observed by three numbers in the rectified pair, [u_left, u_right, v], pixels from the centre of the upper left one, u to the
/// right, v down: rectification makes v the same in both views, and u_left - u_right, the disparity, is positive for what lies in front.
/// Observations of the same track are believed to be of the same point. A track number is used once and never again.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/time.hpp>

namespace searvins::vision {

/// Class of what a point lies on, as the frontend's network numbers them (Cityscapes: semantic_mask.hpp).
using SemanticClass = std::uint8_t;

inline constexpr SemanticClass kUnlabelled = 255;  ///< no class is known

/// One point in one frame; see the file comment.
struct StereoObservation {
  std::uint64_t track{0};                             ///< identity over time
  Eigen::Vector3d pixel_px{Eigen::Vector3d::Zero()};  ///< [u_left, u_right, v]
  double score{1};                                    ///< confidence of the matches in [0, 1], the lower of stereo and temporal
  double v_difference_px{std::numeric_limits<double>::quiet_NaN()};  ///< v_left - v_right of the match; NaN: the frontend does not say
  SemanticClass semantic_class{kUnlabelled};                         ///< class at the left pixel
  bool near_rejected_class{false};  ///< the frontend has the labels, and one of a class to be rejected lies within the margin (screen())

  [[nodiscard]] double disparity_px() const { return pixel_px[0] - pixel_px[1]; }
  [[nodiscard]] bool finite() const { return pixel_px.allFinite() && std::isfinite(score); }
};

/// The observations of one image pair, at most N, in the order of the frontend. A frame without observations is a frame all the same.
template <std::size_t N>
struct StereoFrame {
  static constexpr std::size_t kCapacity = N;
  GpsTime time{};  ///< mid-exposure, GPS time
  StaticVector<StereoObservation, N> observations{};
  std::size_t dropped{0};  ///< observations that had no room, the ones of the lowest scores

  /// Takes an observation. When the frame is full the lowest score (the later of equals) is the one that goes, and it is counted; returns
  /// whether the new one stays. A NaN score is the lowest of all.
  bool add(const StereoObservation& observation) {
    if (observations.push_back(observation)) return true;
    ++dropped;
    std::size_t weakest = 0;
    for (std::size_t i = 1; i < observations.size(); ++i)
      if (!(rank(observations[i]) > rank(observations[weakest]))) weakest = i;
    if (!(rank(observation) > rank(observations[weakest]))) return false;
    observations.erase(weakest);
    return observations.push_back(observation);
  }

 private:
  [[nodiscard]] static double rank(const StereoObservation& o) {
    return std::isnan(o.score) ? -std::numeric_limits<double>::infinity() : o.score;
  }
};

}  // namespace searvins::vision
