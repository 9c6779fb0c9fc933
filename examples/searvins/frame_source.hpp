// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where the frames of stereo tracks of a run come from: a file that another frontend wrote (track_frames.hpp), or pictures and the
/// reference frontend (image_frames.hpp).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/image_view.hpp>

#include "examples/searvins/solver_run.hpp"
#include "examples/support/counts.hpp"

namespace searvins::examples {

/// Frames, one after the other in order of time.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;

  /// Time of the next frame; nothing when there is no more.
  [[nodiscard]] virtual std::optional<GpsTime> time() const = 0;
  /// Takes the next frame; false when it could not be used, which is counted. `predicted`: motion of the left camera since the frame taken
  /// before, where the unit is aligned. Errors: a file that cannot be read.
  [[nodiscard]] virtual io::FileResult<bool> take(const std::optional<vision::CameraMotion>& predicted, TrackFrame& frame) = 0;
  /// The rectified left picture of the frame taken last; not valid where there is none.
  [[nodiscard]] virtual vision::ImageView picture() const { return {}; }
  /// What was left out, by reason.
  [[nodiscard]] virtual std::vector<Count> left_out() const = 0;
};

}  // namespace searvins::examples
