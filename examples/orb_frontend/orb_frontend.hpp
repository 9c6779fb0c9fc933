// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The reference frontend: rectified image pairs in, identified stereo observations out. It models vision::VisionFrontend.
///
///     left, right --> features --> stereo matches
///                        |               |
///     tracks --predicted-+--> temporal matches --> tracks continued, lost, begun --> observations
///
/// A track begins with a feature that both eyes see. It lives while it is found again; after more than `max_missed` frames without, its
/// number is retired. An observation is given for every track that both eyes see in this frame; its score is the lower of the two matches',
/// 1 - distance / 128 (a random match has 0).
///
/// Images of different sizes, missing halves and the like are refused (and counted), see ImageProblem. Use vision::CheckedFrontend around
/// it to have times and the calibrated size checked too.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <searvins/core/status.hpp>
#include <searvins/vision/frontend.hpp>
#include <searvins/vision/stereo_camera.hpp>

#include "examples/orb_frontend/extractor.hpp"
#include "examples/orb_frontend/stereo_matching.hpp"
#include "examples/orb_frontend/temporal_matching.hpp"

namespace searvins::orb {

/// Everything that can be chosen.
struct OrbOptions {
  ExtractorOptions extractor{};
  StereoMatchOptions stereo{};
  TemporalMatchOptions temporal{};
  double min_depth_m{1};         ///< nothing is nearer: bounds the disparity
  std::size_t max_tracks{1000};  ///< new ones wait while there are so many
  int max_missed{2};             ///< frames
};

/// Why a pair was refused or gave nothing.
enum class ImageProblem : std::uint8_t {
  missing_left,
  missing_right,
  sizes_differ,
  too_small,    ///< for a single feature
  featureless,  ///< processed, but one of the images has no features: black, overexposed, covered
};
inline constexpr std::size_t kImageProblems = 5;

/// Counts of one frame.
struct FrameStatistics {
  std::size_t left_features{0}, right_features{0};
  std::array<std::size_t, kMatchFates> stereo{};    ///< left features by fate
  std::array<std::size_t, kMatchFates> temporal{};  ///< tracks of the frames before by fate
  std::size_t begun{0}, retired{0};                 ///< tracks
  std::size_t not_begun{0};                         ///< features of both eyes that became no track because there were max_tracks already
  std::size_t observations{0};                      ///< given, before the capacity of the frame

  [[nodiscard]] std::size_t stereo_matched() const { return stereo[static_cast<std::size_t>(MatchFate::matched)]; }
  [[nodiscard]] std::size_t continued() const { return temporal[static_cast<std::size_t>(MatchFate::matched)]; }
};

/// See the file comment. N: capacity of a frame.
template <std::size_t N = 512>
class OrbFrontend {
 public:
  using Frame = vision::StereoFrame<N>;
  static constexpr std::uint64_t kNoTrack = 0;

  /// `camera` is that of the rectified images.
  explicit OrbFrontend(const vision::StereoCamera<double>& camera, OrbOptions options = {})
      : camera_(camera),
        options_(with_disparity_of(camera, options)),
        left_(options_.extractor),
        right_(options_.extractor),
        stereo_matcher_(options_.stereo),
        temporal_matcher_(camera, options_.temporal) {}

  /// Errors: no_data (an image is missing), invalid_argument (sizes); tracks stay as they were then.
  [[nodiscard]] Status process(const vision::ImagePair& images, const std::optional<vision::CameraMotion>& predicted, Frame& frame) {
    if (const Status status = check(images); !status.ok()) return status;
    statistics_ = {};
    left_.extract(images.left, features_);
    right_.extract(images.right, right_features_);
    statistics_.left_features = features_.size();
    statistics_.right_features = right_features_.size();
    if (features_.empty() || right_features_.empty()) count(ImageProblem::featureless);
    stereo_matcher_.match(features_, left_.pyramid(), right_features_, right_.pyramid(), stereo_);
    for (const StereoMatch& match : stereo_) ++statistics_.stereo[static_cast<std::size_t>(match.fate)];
    continue_tracks(predicted && predicted->finite() ? predicted : std::nullopt);
    begin_tracks();
    give_observations(frame);
    return ok_status();
  }

  [[nodiscard]] const FrameStatistics& statistics() const { return statistics_; }
  [[nodiscard]] std::size_t problems(ImageProblem problem) const { return problems_[static_cast<std::size_t>(problem)]; }
  [[nodiscard]] const OrbOptions& options() const { return options_; }

  /// Of the last frame: the left features, what became of each in stereo, and the track of each (kNoTrack if it has none).
  [[nodiscard]] const std::vector<Feature>& features() const { return features_; }
  [[nodiscard]] const std::vector<StereoMatch>& stereo_matches() const { return stereo_; }
  [[nodiscard]] const std::vector<std::uint64_t>& track_of_feature() const { return track_of_feature_; }
  [[nodiscard]] const std::vector<Feature>& right_features() const { return right_features_; }
  /// The tracks that live, those that were just missed among them.
  [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }

 private:
  [[nodiscard]] static OrbOptions with_disparity_of(const vision::StereoCamera<double>& camera, OrbOptions options) {
    options.stereo.max_disparity_px = static_cast<float>(camera.disparity_px(std::max(options.min_depth_m, camera.min_depth_m)));
    return options;
  }

  void count(ImageProblem problem) { ++problems_[static_cast<std::size_t>(problem)]; }

  [[nodiscard]] Status check(const vision::ImagePair& images) {
    const vision::ImageView &left = images.left, &right = images.right;
    const auto refuse = [this](ImageProblem problem, StatusCode code, const char* what) {
      count(problem);
      return failure(code, what);
    };
    if (!left.valid()) return refuse(ImageProblem::missing_left, StatusCode::no_data, "the left image is missing");
    if (!right.valid()) return refuse(ImageProblem::missing_right, StatusCode::no_data, "the right image is missing");
    if (left.width != right.width || left.height != right.height)
      return refuse(ImageProblem::sizes_differ, StatusCode::invalid_argument, "left and right image have different sizes");
    if (left.width < Pyramid::kMinSize || left.height < Pyramid::kMinSize || left.width > kMaxSize || left.height > kMaxSize)
      return refuse(ImageProblem::too_small, StatusCode::invalid_argument, "the images are too small or too large for features");
    return ok_status();
  }

  void continue_tracks(const std::optional<vision::CameraMotion>& motion) {
    TemporalMatcher::predict(tracks_, motion);
    temporal_matcher_.match(tracks_, motion.has_value(), features_, left_.pyramid(), temporal_);
    track_of_feature_.assign(features_.size(), kNoTrack);
    distance_of_feature_.assign(features_.size(), 0);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < tracks_.size(); ++i) {
      const TemporalMatch& match = temporal_[i];
      ++statistics_.temporal[static_cast<std::size_t>(match.fate)];
      Track& track = tracks_[i];
      if (match.fate == MatchFate::matched) {
        see(track, match.feature);
        distance_of_feature_[match.feature] = match.distance;
      } else if (++track.missed > options_.max_missed) {
        ++statistics_.retired;
        continue;
      }
      if (kept != i) tracks_[kept] = track;
      ++kept;
    }
    tracks_.resize(kept);
  }

  /// Notes that a track is seen as a feature of this frame.
  void see(Track& track, std::size_t feature) {
    const Feature& f = features_[feature];
    track.descriptor = f.descriptor;
    track.u_px = f.u_px;
    track.v_px = f.v_px;
    track.level = f.level;
    track.missed = 0;
    ++track.age;
    track_of_feature_[feature] = track.id;
    place(track, f, stereo_[feature]);
  }

  /// The point of a track: with a depth if both eyes see it, else a direction.
  void place(Track& track, const Feature& f, const StereoMatch& match) const {
    const Eigen::Vector3d direction{(static_cast<double>(f.u_px) - camera_.cx_px) / camera_.fx_px,
                                    (static_cast<double>(f.v_px) - camera_.cy_px) / camera_.fy_px, 1};
    track.has_depth = match.fate == MatchFate::matched;
    track.p_c_m = track.has_depth ? Eigen::Vector3d{direction * camera_.depth_m(static_cast<double>(match.disparity_px))} : direction;
  }

  void begin_tracks() {
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (track_of_feature_[i] != kNoTrack || stereo_[i].fate != MatchFate::matched) continue;
      if (tracks_.size() >= options_.max_tracks) {
        ++statistics_.not_begun;
        continue;
      }
      Track track;
      track.id = ++last_id_;
      track.age = 0;
      see(track, i);
      tracks_.push_back(track);
      ++statistics_.begun;
    }
  }

  void give_observations(Frame& frame) {
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const StereoMatch& match = stereo_[i];
      if (track_of_feature_[i] == kNoTrack || match.fate != MatchFate::matched) continue;
      const double u = static_cast<double>(features_[i].u_px), v = static_cast<double>(features_[i].v_px);
      vision::StereoObservation observation;
      observation.track = track_of_feature_[i];
      observation.pixel_px = {u, u - static_cast<double>(match.disparity_px), v};
      observation.score = std::clamp(1 - std::max(match.distance, distance_of_feature_[i]) / 128.0, 0.0, 1.0);
      observation.v_difference_px = static_cast<double>(match.v_difference_px);
      ++statistics_.observations;
      frame.add(observation);
    }
  }

  static constexpr int kMaxSize = 16384;  // px; places on a level fit 16 bits

  vision::StereoCamera<double> camera_;
  OrbOptions options_;
  Extractor left_, right_;
  StereoMatcher stereo_matcher_;
  TemporalMatcher temporal_matcher_;
  std::vector<Feature> features_, right_features_;
  std::vector<StereoMatch> stereo_;
  std::vector<TemporalMatch> temporal_;
  std::vector<Track> tracks_;
  std::vector<std::uint64_t> track_of_feature_;  ///< parallel to features_
  std::vector<int> distance_of_feature_;         ///< bits of the temporal match, parallel to features_
  std::uint64_t last_id_{kNoTrack};
  FrameStatistics statistics_{};
  std::array<std::size_t, kImageProblems> problems_{};
};

static_assert(vision::VisionFrontend<OrbFrontend<>>);

}  // namespace searvins::orb
