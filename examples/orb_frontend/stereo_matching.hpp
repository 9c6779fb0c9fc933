// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Partners of the left features in the right image of a rectified pair.
///
/// A partner lies on the same row (within a pixel or two of its level), between no disparity and that of the nearest thing, on the same or
/// a neighbouring level. The one that choose() believes is then aligned to a fraction of a pixel (patch_alignment.hpp), which gives the
/// disparity and what is left of a vertical difference.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

#include "examples/orb_frontend/extractor.hpp"
#include "examples/orb_frontend/feature_index.hpp"
#include "examples/orb_frontend/match_choice.hpp"
#include "examples/orb_frontend/patch_alignment.hpp"

namespace searvins::orb {

/// What became of a left feature.
struct StereoMatch {
  MatchFate fate{MatchFate::no_candidate};
  std::size_t right{0};      ///< number of the right feature, if one was chosen
  int distance{0};           ///< bits
  float disparity_px{0};     ///< u_left - u_right, full image
  float v_difference_px{0};  ///< v_left - v_right after alignment, full image
  float mismatch{0};         ///< see Alignment
};

/// Bounds of the search.
struct StereoMatchOptions {
  MatchLimits limits{};
  float row_tolerance_px{1.5F};   ///< on the level
  float min_disparity_px{0.25F};  ///< after alignment; what is farther says nothing about depth
  float max_disparity_px{128};
  float max_mismatch{0.5F};
};

/// Matches features of an image pair; memory is kept from pair to pair.
class StereoMatcher {
 public:
  explicit StereoMatcher(const StereoMatchOptions& options = {}) : options_(options) {}

  /// Replaces `out` by one entry per left feature.
  void match(const std::vector<Feature>& left, const Pyramid& left_pyramid, const std::vector<Feature>& right, const Pyramid& right_pyramid,
             std::vector<StereoMatch>& out) {
    const vision::ImageView& image = right_pyramid.level(0);
    index_.build(right, image.width, image.height, kCellWidth, kCellHeight);
    partners_.reset(right.size());
    out.assign(left.size(), {});
    for (std::size_t i = 0; i < left.size(); ++i) out[i] = choose_partner(left, i, right, left_pyramid.scale(left[i].level));
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (out[i].fate != MatchFate::matched) continue;
      if (partners_.is_best(out[i].right, i))
        align(left[i], right[out[i].right], left_pyramid, right_pyramid, out[i]);
      else
        out[i].fate = MatchFate::not_mutual;
    }
  }

  [[nodiscard]] const StereoMatchOptions& options() const { return options_; }

 private:
  static constexpr int kCellWidth = 32, kCellHeight = 4;

  [[nodiscard]] StereoMatch choose_partner(const std::vector<Feature>& left, std::size_t i, const std::vector<Feature>& right,
                                           float scale) {
    const Feature& f = left[i];
    const float rows = options_.row_tolerance_px * scale, least_u = f.u_px - options_.max_disparity_px, most_u = f.u_px + scale;
    candidates_.clear();
    index_.for_each_near(least_u, most_u, f.v_px - rows, f.v_px + rows, [&](std::size_t j) {
      const Feature& g = right[j];
      if (std::abs(g.v_px - f.v_px) > rows || g.u_px < least_u || g.u_px > most_u || std::abs(g.level - f.level) > 1) return;
      const int distance = hamming_distance(f.descriptor, g.descriptor);
      candidates_.push_back({j, distance, g.u_px, g.v_px});
      partners_.offer(j, i, distance);
    });
    const Choice choice = choose(candidates_, options_.limits, scale);
    if (candidates_.empty()) return {};
    const Candidate& chosen = candidates_[choice.place];
    return {choice.fate, chosen.index, chosen.distance, f.u_px - chosen.u_px, f.v_px - chosen.v_px, 0};
  }

  /// Aligned on the left feature's level.
  void align(const Feature& f, const Feature& g, const Pyramid& left, const Pyramid& right, StereoMatch& match) const {
    const float scale = left.scale(f.level);
    const int start = static_cast<int>(std::lround(to_level(g.u_px, scale)));
    const Alignment found = align_on_row(left.level(f.level), f.x, f.y, right.level(f.level), start);
    if (!found.found || found.mismatch > options_.max_mismatch) {
      match.fate = MatchFate::not_aligned;
      return;
    }
    match.disparity_px = (static_cast<float>(f.x) - found.x) * scale;
    match.v_difference_px = (static_cast<float>(f.y) - found.y) * scale;
    match.mismatch = found.mismatch;
    if (match.disparity_px < options_.min_disparity_px || match.disparity_px > options_.max_disparity_px)
      match.fate = MatchFate::bad_disparity;
  }

  StereoMatchOptions options_;
  FeatureIndex index_;
  PartnerTable partners_;
  std::vector<Candidate> candidates_;
};

}  // namespace searvins::orb
