// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Keeps a few frames of a run, spread evenly over its time, and draws into each what became of its observations (strip_picture.hpp).
///
///     offer(left, frame)    every frame, when the frontend has made it: ages of tracks are counted, a picture is kept now and then
///     judge(time, fates)    later, when the estimator has screened the frame
///     pictures()            at the end
///
/// The run is divided into as many stretches as there are to be pictures, and the first frame in each stretch is kept. When a stretch's
/// picture is not judged in patience_s, because the estimator was not ready yet or refused the frame, a later frame of the stretch takes
/// its place. Memory is that of the pictures (grey, no wider than max_width_px) and of the tracks seen lately.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/vision/admission_report.hpp>
#include <searvins/vision/image_view.hpp>
#include <searvins/vision/stereo_observation.hpp>

#include "examples/support/gray_image.hpp"
#include "examples/support/picture_marks.hpp"
#include "examples/support/strip_picture.hpp"

namespace searvins::examples {

/// Settings of a strip.
struct StripOptions {
  int pictures{8};         ///< at most
  int max_width_px{960};   ///< wider ones are made smaller by a whole factor
  double patience_s{1.5};  ///< for the judgement on a picture
};

/// See the file comment.
class FrameStrip {
 public:
  /// For a run from `start` to `end`; frames outside belong to the first and the last stretch.
  FrameStrip(GpsTime start, GpsTime end, const StripOptions& options = {})
      : start_(start), end_(end), options_(options), kept_(static_cast<std::size_t>(std::max(0, options.pictures))) {}

  /// Sees a frame. `left` is the rectified image whose pixels the observations count in; an invalid one gives no picture. Frames come in
  /// the order of time.
  template <std::size_t N>
  void offer(GpsTime time, const vision::ImageView& left, const vision::StereoFrame<N>& frame) {
    ++frame_;
    for (const vision::StereoObservation& o : frame.observations) {
      Seen& seen = seen_[o.track];
      if (seen.last_frame != frame_) ++seen.frames, seen.last_frame = frame_;  // a number that occurs twice was seen in one frame
    }
    if (frame_ % kForgetFrames == 0) std::erase_if(seen_, [this](const auto& s) { return s.second.last_frame + kForgetFrames < frame_; });
    if (kept_.empty() || !left.valid()) return;
    std::optional<Kept>& place = kept_[stretch_of(time)];
    if (place && (place->fate || seconds_between(place->time, time) < options_.patience_s)) return;
    place = keep(time, left);
    for (const vision::StereoObservation& o : frame.observations) place->marks.push_back(mark_of(o, place->factor));
    place->dropped = frame.dropped;
  }

  /// The frame of that time has been screened; `fates` are those of its observations, in their order. Of a frame that is not kept, or was
  /// judged before, nothing is taken.
  void judge(GpsTime time, std::span<const vision::ObservationFate> fates, vision::FrameFate fate) {
    for (std::optional<Kept>& k : kept_)
      if (k && k->time == time && !k->fate) {
        k->fate = fate;
        for (std::size_t i = 0; i < k->marks.size() && i < fates.size(); ++i) k->marks[i].fate = fates[i];
      }
  }

  /// The pictures in the order of time.
  [[nodiscard]] std::vector<StripPicture> pictures() const {
    std::vector<StripPicture> all;
    for (const std::optional<Kept>& k : kept_)
      if (k) all.push_back(drawn(*k));
    return all;
  }

 private:
  /// A track.
  struct Seen {
    int frames{0};
    std::uint64_t last_frame{0};
  };
  /// An observation in pixels of the kept image.
  struct Mark {
    bool is_drawable{false};
    float u_px{0}, v_px{0}, disparity_px{0};
    int age{1};
    std::optional<vision::ObservationFate> fate{};
  };
  struct Kept {
    GpsTime time{};
    GrayImage image{};
    int factor{1};
    std::vector<Mark> marks{};
    std::size_t dropped{0};
    std::optional<vision::FrameFate> fate{};
  };

  static constexpr std::uint64_t kForgetFrames = 64;

  [[nodiscard]] std::size_t stretch_of(GpsTime time) const {
    const double whole_s = seconds_between(start_, end_), n = static_cast<double>(kept_.size());
    const double at = whole_s > 0 ? n * seconds_between(start_, time) / whole_s : 0;
    return static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, n - 1));
  }

  [[nodiscard]] Kept keep(GpsTime time, const vision::ImageView& left) const {
    Kept kept;
    kept.time = time;
    const int limit = std::max(1, options_.max_width_px);
    kept.factor = (left.width + limit - 1) / limit;
    kept.image = reduced(left, kept.factor);
    return kept;
  }

  /// Centres of pixels are whole numbers in both images.
  [[nodiscard]] Mark mark_of(const vision::StereoObservation& o, int factor) const {
    constexpr double kFar = 1e6;  // px
    Mark mark;
    mark.is_drawable = o.pixel_px.allFinite() && o.pixel_px.cwiseAbs().maxCoeff() < kFar;
    if (!mark.is_drawable) return mark;
    mark.u_px = static_cast<float>((o.pixel_px[0] + 0.5) / factor - 0.5);
    mark.v_px = static_cast<float>((o.pixel_px[2] + 0.5) / factor - 0.5);
    mark.disparity_px = static_cast<float>(o.disparity_px() / factor);
    mark.age = seen_.at(o.track).frames;
    return mark;
  }

  /// Greys of every fourth step are enough below the marks, and make a picture of few colours.
  [[nodiscard]] static GrayImage coarse(GrayImage image) {
    for (std::uint8_t& pixel : image.pixels()) pixel = static_cast<std::uint8_t>(pixel / 4 * 4);
    return image;
  }

  static void draw(RgbImage& image, const Mark& mark) {
    const int x = static_cast<int>(std::lround(mark.u_px)), y = static_cast<int>(std::lround(mark.v_px));
    const MarkShape shape = mark.fate ? shape_of(*mark.fate) : MarkShape::dot;
    const Rgb colour = mark.fate ? colour_of(*mark.fate) : kUnscreenedColour;
    const int reach = std::clamp(image.width() / 190, 3, 6);  // a report shows all pictures at one width
    if (shape == MarkShape::cross) return cross(image, x, y, reach, colour);
    if (shape == MarkShape::dot) return fill(image, x - reach / 2, y - reach / 2, reach, reach, colour);
    const Rgb age = colour_of_age(mark.age);
    const int bar = static_cast<int>(std::lround(std::clamp(mark.disparity_px, 0.0F, static_cast<float>(image.width()))));
    fill(image, x - bar, y, bar, 1, age);
    ring(image, mark.u_px, mark.v_px, 1.3F * static_cast<float>(reach), age);
  }

  [[nodiscard]] static StripPicture drawn(const Kept& kept) {
    constexpr int kPercent = 50;
    StripPicture picture;
    picture.time = kept.time, picture.fate = kept.fate;
    picture.image = darkened(coarse(kept.image).view(), kPercent);
    picture.counts[static_cast<std::size_t>(vision::ObservationFate::capacity)] = kept.dropped;
    for (const Mark& m : kept.marks) ++(m.fate ? picture.counts[static_cast<std::size_t>(*m.fate)] : picture.unscreened);
    // Rings last: they are what the estimator works with.
    for (const bool rings : {false, true})
      for (const Mark& m : kept.marks)
        if (m.is_drawable && (m.fate == vision::ObservationFate::admitted) == rings) draw(picture.image, m);
    return picture;
  }

  GpsTime start_, end_;
  StripOptions options_;
  std::vector<std::optional<Kept>> kept_;  ///< a place a stretch
  std::unordered_map<std::uint64_t, Seen> seen_;
  std::uint64_t frame_{0};
};

}  // namespace searvins::examples
