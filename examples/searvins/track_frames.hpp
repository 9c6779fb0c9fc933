// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Frames of a stereo_tracks.csv, as a FrameSource.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "examples/precomputed_frontend/track_reader.hpp"
#include "examples/searvins/frame_source.hpp"
#include "examples/support/counts.hpp"

namespace searvins::examples {

/// See the file comment.
class TrackFrames final : public FrameSource {
 public:
  /// Opens the file, whose stamps are seconds of the GPS week of `start`, and goes to the first frame at or after it. Errors: those of
  /// TrackReader; no frame from `start` on.
  [[nodiscard]] static io::FileResult<std::unique_ptr<FrameSource>> open(const std::string& path, GpsTime start) {
    auto frames = std::unique_ptr<TrackFrames>(new TrackFrames);
    if (auto wrong = frames->reader_.open(path, start.week())) return *wrong;
    do {
      if (const io::FileResult<bool> read = frames->advance(); !read) return read.error();
    } while (frames->has_ahead_ && frames->ahead_->time < start);
    if (!frames->has_ahead_)
      return io::Diagnostic{path, 0, "has no frame in the time to solve", "stamps are GPS seconds of week of the rover's week"};
    return std::unique_ptr<FrameSource>(std::move(frames));
  }

  [[nodiscard]] std::optional<GpsTime> time() const override {
    return has_ahead_ ? std::optional{ahead_->time} : std::nullopt;
  }
  [[nodiscard]] io::FileResult<bool> take(const std::optional<vision::CameraMotion>&, TrackFrame& frame) override {
    frame = *ahead_;
    if (const io::FileResult<bool> read = advance(); !read) return read.error();
    return true;
  }
  [[nodiscard]] std::vector<Count> left_out() const override {
    std::vector<Count> items;
    for (const io::SkippedItem& item : reader_.skipped().items()) items.emplace_back("tracks: " + item.reason, static_cast<long>(item.count));
    return items;
  }

 private:
  TrackFrames() = default;

  io::FileResult<bool> advance() {
    const io::FileResult<bool> read = reader_.next(*ahead_);
    has_ahead_ = read && *read;
    return read;
  }

  precomputed::TrackReader reader_;
  std::unique_ptr<TrackFrame> ahead_{std::make_unique<TrackFrame>()};
  bool has_ahead_{false};
};

}  // namespace searvins::examples
