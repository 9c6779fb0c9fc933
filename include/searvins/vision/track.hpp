// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Lives of tracks: how long a point has been followed, whether it may become a landmark, and which landmark it is.
///
///     new        one observation
///     maturing   more, but fewer than n_min
///     mature     n_min observations without a break: may have a landmark            [paper sec. Semantic-Aware Stereo Vision Frontend]
///     broken     the last observation was refused, or contradicted the motion of the rest; the count starts again
///
/// A landmark is one stretch of a track: a break ends it (the association was wrong, what follows is another point), and so does its arc,
/// the frames from its first observation to its last, when it reaches max_arc. A track that lives on then starts a fresh landmark, so no
/// landmark ties together more than max_arc states. Landmarks are numbered from 1 over all tracks; a number is never used again.
///
/// A frontend never gives a track number again. So a track that has not been seen for max_missed frames is forgotten, and should its
/// number come back after all, it is new.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/vision/stereo_camera.hpp>

namespace searvins::vision {

/// See the file comment.
enum class TrackStage : std::uint8_t { fresh, maturing, mature, broken };

/// Name of a stage, for tables; a fresh track is called new.
[[nodiscard]] constexpr const char* name_of(TrackStage stage) {
  switch (stage) {
    case TrackStage::fresh: return "new";
    case TrackStage::maturing: return "maturing";
    case TrackStage::mature: return "mature";
    case TrackStage::broken: return "broken";
  }
  return "?";
}

/// See the file comment.
struct TrackOptions {
  int n_min{3};       ///< observations before a landmark, >= 1
  int max_arc{25};    ///< frames of a landmark, >= 2
  int max_missed{5};  ///< frames without the track before it is forgotten, >= 0
};

/// One track.
struct Track {
  std::uint64_t id{0};
  StereoPixel<double> pixel_px{StereoPixel<double>::Zero()};  ///< last observation; only when has_pixel
  std::uint64_t last_frame{0};                                ///< ordinal of the frame of that observation, or of the refusal
  std::uint64_t landmark_frame{0};                            ///< ordinal of the first frame of the landmark
  std::uint64_t landmark{0};                                  ///< number of the newest landmark, 0: none yet
  int observations{0};                                        ///< since the last break, the broken one included if it was usable
  TrackStage stage{TrackStage::fresh};
  bool has_pixel{false};
  bool has_landmark{false};  ///< landmark `landmark` is alive
};

/// Up to N tracks, ordered by id. Frames are counted from 1 by begin_frame().
template <std::size_t N>
class TrackTable {
 public:
  explicit TrackTable(const TrackOptions& options = {}) : options_(options) {}

  [[nodiscard]] std::size_t size() const { return tracks_.size(); }
  [[nodiscard]] const Track* begin() const { return tracks_.begin(); }
  [[nodiscard]] const Track* end() const { return tracks_.end(); }
  [[nodiscard]] std::uint64_t frame() const { return frame_; }

  /// The track of an id, nullptr when there is none.
  [[nodiscard]] const Track* find(std::uint64_t id) const { return find_in(tracks_, id); }

  /// Starts a frame: forgets the tracks that were missing for too long.
  void begin_frame() {
    ++frame_;
    const auto patience = static_cast<std::uint64_t>(std::max(options_.max_missed, 0)) + 1;
    (void)tracks_.erase_if([&](const Track& t) { return t.last_frame + patience < frame_; });
  }

  /// Counts an observation of this frame. Returns the track as it is now; nullptr when it is new and
  /// there is no room for it: a full table forgets those that have been away for longest, but none that this frame has seen.
  const Track* observe(std::uint64_t id, const StereoPixel<double>& pixel_px) {
    Track* const track = find_or_insert(id);
    if (!track) return nullptr;
    track->pixel_px = pixel_px;
    track->has_pixel = true;
    track->last_frame = frame_;
    ++track->observations;
    track->stage = track->observations >= options_.n_min ? TrackStage::mature
                   : track->observations > 1             ? TrackStage::maturing
                                                         : TrackStage::fresh;
    return track;
  }

  /// The observation of this frame contradicts the track: it breaks, and what was observed is the first observation of what follows.
  void break_with(std::uint64_t id, const StereoPixel<double>& pixel_px) {
    Track* const track = find_track(id);
    if (!track) return;
    begin_anew(*track);
    track->pixel_px = pixel_px;
    track->has_pixel = true;
    track->observations = 1;
  }

  /// The observation of this frame is refused: the track, if it is known, breaks and has nothing to begin anew with.
  void break_off(std::uint64_t id) {
    if (Track* const track = find_track(id)) begin_anew(*track);
  }

  /// Whether an observation in this frame continues the track's landmark.
  [[nodiscard]] bool continues_landmark(const Track& track) const {
    return track.has_landmark && frame_ - track.landmark_frame < static_cast<std::uint64_t>(options_.max_arc);
  }

  /// The landmark that this frame's observation of a mature track belongs to: the one that lives, or a fresh one. Returns its number, 0
  /// for an id that is not there or not mature.
  std::uint64_t claim_landmark(std::uint64_t id) {
    Track* const track = find_track(id);
    if (!track || track->stage != TrackStage::mature) return 0;
    if (!continues_landmark(*track)) {
      track->landmark = ++landmarks_;
      track->landmark_frame = frame_;
      track->has_landmark = true;
    }
    return track->landmark;
  }

  /// The estimator has given up the landmark: the next admitted observation starts a fresh one.
  void end_landmark(std::uint64_t id) {
    if (Track* const track = find_track(id)) track->has_landmark = false;
  }

  /// Forgets all tracks; frames and landmarks are counted on.
  void clear() { tracks_.clear(); }

  /// Landmarks so far.
  [[nodiscard]] std::uint64_t landmarks() const { return landmarks_; }

 private:
  void begin_anew(Track& track) {
    track.stage = TrackStage::broken;
    track.observations = 0;
    track.has_pixel = false;
    track.has_landmark = false;
    track.last_frame = frame_;
  }

  /// First track whose id is not below; of a constant or a variable table.
  [[nodiscard]] static auto* lower_bound(auto& tracks, std::uint64_t id) {
    return std::lower_bound(tracks.begin(), tracks.end(), id, [](const Track& t, std::uint64_t wanted) { return t.id < wanted; });
  }
  [[nodiscard]] static auto* find_in(auto& tracks, std::uint64_t id) {
    auto* const at = lower_bound(tracks, id);
    return at != tracks.end() && at->id == id ? at : nullptr;
  }
  [[nodiscard]] Track* find_track(std::uint64_t id) { return find_in(tracks_, id); }
  [[nodiscard]] Track* find_or_insert(std::uint64_t id) {
    Track* at = lower_bound(tracks_, id);
    if (at != tracks_.end() && at->id == id) return at;
    if (tracks_.full() && forget_longest_away()) at = lower_bound(tracks_, id);
    const auto index = static_cast<std::size_t>(at - tracks_.begin());
    Track track;
    track.id = id;
    return tracks_.insert(index, track) ? &tracks_[index] : nullptr;
  }

  /// Makes room: what is seen now goes before what may come back. False when all were seen in this frame.
  bool forget_longest_away() {
    const auto oldest = std::min_element(tracks_.begin(), tracks_.end(), [](const Track& a, const Track& b) { return a.last_frame < b.last_frame; });
    if (oldest->last_frame >= frame_) return false;
    tracks_.erase(static_cast<std::size_t>(oldest - tracks_.begin()));
    return true;
  }

  TrackOptions options_;
  StaticVector<Track, N> tracks_;
  std::uint64_t frame_{0}, landmarks_{0};
};

}  // namespace searvins::vision
