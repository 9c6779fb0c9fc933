// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where the tracks of the frames before are in the current left image.
///
/// A track knows its place: as a point p in camera axes when it was seen by both eyes, as a direction otherwise. The predicted motion moves
/// it,
///
///     p_cur = R_prev_cur' (p_prev - t_prev_cur)          (a direction only turns)
///
/// and it is searched where that is seen, within a radius that covers the error of the prediction; without a prediction, within a larger
/// radius around its last place. Partners are chosen by match_choice.hpp.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <vector>

#include <searvins/core/status.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/stereo_camera.hpp>

#include "examples/orb_frontend/extractor.hpp"
#include "examples/orb_frontend/feature_index.hpp"
#include "examples/orb_frontend/match_choice.hpp"

namespace searvins::orb {

/// A point that is followed.
struct Track {
  std::uint64_t id{0};
  Descriptor descriptor{};  ///< as last seen
  float u_px{0}, v_px{0};   ///< left image, as last seen
  int level{0};
  Eigen::Vector3d p_c_m{Eigen::Vector3d::UnitZ()};  ///< axes of the last frame's left camera; a direction while it has no depth
  bool has_depth{false};
  int age{1};     ///< frames in which it was seen
  int missed{0};  ///< frames since
};

/// What became of a track.
struct TemporalMatch {
  MatchFate fate{MatchFate::no_candidate};
  std::size_t feature{0};  ///< number of the current feature, if one was chosen
  int distance{0};         ///< bits
};

/// Bounds of the search.
struct TemporalMatchOptions {
  MatchLimits limits{44, 0.8F, 4};  ///< stricter than in stereo: the frame before was seen by the same eye
  float radius_px{12};              ///< with a predicted motion
  float radius_unpredicted_px{48};  ///< without one
};

/// Matches tracks with features; memory is kept from frame to frame.
class TemporalMatcher {
 public:
  TemporalMatcher(const vision::StereoCamera<double>& camera, const TemporalMatchOptions& options) : camera_(camera), options_(options) {}

  /// Moves every track's point into the current camera axes; without a motion, nothing is known to have moved.
  static void predict(std::vector<Track>& tracks, const std::optional<vision::CameraMotion>& motion) {
    if (!motion) return;
    for (Track& track : tracks)
      track.p_c_m = track.has_depth ? motion->to_current(track.p_c_m) : Eigen::Vector3d{motion->R_prev_cur.transpose() * track.p_c_m};
  }

  /// Replaces `out` by one entry per track; no two of them have the same feature. `tracks` are predicted.
  void match(const std::vector<Track>& tracks, bool is_predicted, const std::vector<Feature>& features, const Pyramid& pyramid,
             std::vector<TemporalMatch>& out) {
    index_.build(features, pyramid.level(0).width, pyramid.level(0).height, kCell, kCell);
    partners_.reset(features.size());
    out.assign(tracks.size(), {});
    for (std::size_t i = 0; i < tracks.size(); ++i)
      out[i] = choose_partner(tracks[i], i, is_predicted, features, pyramid.scale(tracks[i].level));
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (out[i].fate == MatchFate::matched && !partners_.is_best(out[i].feature, i)) out[i].fate = MatchFate::not_mutual;
  }

 private:
  static constexpr int kCell = 32;

  /// Where to look, in pixels; false when the track has left the view.
  [[nodiscard]] bool expected_place(const Track& track, bool is_predicted, float& u, float& v) const {
    u = track.u_px;
    v = track.v_px;
    if (!is_predicted) return true;
    const Eigen::Vector3d& p = track.p_c_m;
    if (!(p.z() > (track.has_depth ? camera_.min_depth_m : 1e-3))) return false;
    u = static_cast<float>(camera_.cx_px + camera_.fx_px * p.x() / p.z());
    v = static_cast<float>(camera_.cy_px + camera_.fy_px * p.y() / p.z());
    return camera_.inside(static_cast<double>(u), static_cast<double>(v), -static_cast<double>(options_.radius_px));
  }

  [[nodiscard]] TemporalMatch choose_partner(const Track& track, std::size_t i, bool is_predicted, const std::vector<Feature>& features,
                                             float scale) {
    float u = 0, v = 0;
    candidates_.clear();
    if (!expected_place(track, is_predicted, u, v)) return {};
    const float radius = is_predicted ? options_.radius_px : options_.radius_unpredicted_px;
    index_.for_each_near(u - radius, u + radius, v - radius, v + radius, [&](std::size_t j) {
      const Feature& f = features[j];
      if (std::abs(f.u_px - u) > radius || std::abs(f.v_px - v) > radius || std::abs(f.level - track.level) > 1) return;
      const int distance = hamming_distance(track.descriptor, f.descriptor);
      candidates_.push_back({j, distance, f.u_px, f.v_px});
      partners_.offer(j, i, distance);
    });
    const Choice choice = choose(candidates_, options_.limits, scale);
    if (candidates_.empty()) return {};
    return {choice.fate, candidates_[choice.place].index, candidates_[choice.place].distance};
  }

  vision::StereoCamera<double> camera_;
  TemporalMatchOptions options_;
  FeatureIndex index_;
  PartnerTable partners_;
  std::vector<Candidate> candidates_;
};

}  // namespace searvins::orb
