// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Tracks from a file behind the seam of vision::VisionFrontend: for each image pair, the observations that were made of it offline. The
/// pictures themselves are not looked at. For those who need no images, TrackReader alone gives the frames in order.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/vision/frontend.hpp>

#include "examples/precomputed_frontend/track_reader.hpp"

namespace searvins::precomputed {

/// See the file comment. N: capacity of a frame. The reader must be open and outlive it.
template <std::size_t N = 512>
class PrecomputedFrontend {
 public:
  using Frame = vision::StereoFrame<N>;
  static constexpr double kToleranceS = 0.005;  ///< a frame is of a pair when their times differ by no more

  explicit PrecomputedFrontend(TrackReader& reader) : reader_(&reader) {}

  /// Fills the frame of images.time_left; without one in the file the frame stays empty, and that is counted. Errors: rejected when the
  /// file cannot be read further (see error()).
  [[nodiscard]] Status process(const vision::ImagePair& images, const std::optional<vision::CameraMotion>&, Frame& frame) {
    while (!error_) {
      if (!is_ahead_ && !advance()) break;
      const double late_s = seconds_between(ahead_.time, images.time_left);
      if (late_s > kToleranceS) {  // a frame of the file without a pair
        is_ahead_ = false;
        ++without_images_;
        continue;
      }
      if (late_s < -kToleranceS) break;
      const GpsTime time = frame.time;
      frame = ahead_;
      frame.time = time;
      is_ahead_ = false;
      return ok_status();
    }
    if (error_) return failure(StatusCode::rejected, "precomputed tracks: the file cannot be read further");
    ++without_tracks_;
    return ok_status();
  }

  /// What ended the reading, if something did.
  [[nodiscard]] const std::optional<io::Diagnostic>& error() const { return error_; }
  /// Image pairs without a frame in the file, and frames in the file without an image pair.
  [[nodiscard]] std::size_t without_tracks() const { return without_tracks_; }
  [[nodiscard]] std::size_t without_images() const { return without_images_; }

 private:
  /// Reads the next frame; false at the end or with an error.
  [[nodiscard]] bool advance() {
    const io::FileResult<bool> read = reader_->next(ahead_);
    if (!read) error_ = read.error();
    is_ahead_ = read.ok() && *read;
    return is_ahead_;
  }

  TrackReader* reader_;
  Frame ahead_{};
  bool is_ahead_{false};
  std::optional<io::Diagnostic> error_;
  std::size_t without_tracks_{0}, without_images_{0};
};

static_assert(vision::VisionFrontend<PrecomputedFrontend<>>);

}  // namespace searvins::precomputed
