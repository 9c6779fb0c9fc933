// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The seam between images and the estimator: whoever turns image pairs into identified stereo observations is a VisionFrontend.
///
///     image pair, its times, predicted motion  ->  frontend  ->  StereoFrame  ->  admission  ->  estimator
///
/// The predicted motion says where to search: a point that was at p_prev in the previous left camera is expected at
/// motion.to_current(p_prev). It is what the inertial unit says; a frontend need not use it, and gets none before the unit is aligned.
///
/// The estimator takes StereoFrames from anywhere; this seam is for those who hand over images. A frontend may run in a thread of its own
/// and hand its frames over through core/spsc_queue.hpp; the estimator stays single-threaded, and the same frames give the same bits.
///
/// Drivers deliver pairs of different sizes, pairs whose right half is missing, or halves of different pairs (times half a period apart,
/// which would be read as disparity). CheckedFrontend refuses those, counts why, and answers for pictures without content itself.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/image_view.hpp>
#include <searvins/vision/stereo_observation.hpp>

namespace searvins::vision {

/// Both images of a stereo camera, of the same size, with their times of mid-exposure.
struct ImagePair {
  ImageView left, right;
  GpsTime time_left{}, time_right{};
};

/// Turns image pairs, offered in order of time, into stereo observations in pixels of the rectified pair.
///
///     Frame            a StereoFrame
///     process          fills `frame`, which is empty and has its time set; an image pair in which nothing is found is no failure
///
/// A track keeps its number as long as the frontend believes it to be the same point; a broken one is never continued under the old
/// number. The predicted motion begins at the previous pair that was offered.
template <class F>
concept VisionFrontend = std::same_as<typename F::Frame, StereoFrame<F::Frame::kCapacity>> &&
    requires(F& frontend, const ImagePair& images, const std::optional<CameraMotion>& predicted, typename F::Frame& frame) {
  { frontend.process(images, predicted, frame) } -> std::same_as<Status>;
};

/// What became of an image pair.
enum class ImageFate : std::uint8_t {
  processed,        ///< handed to the frontend, which filled a frame
  no_left,          ///< no left image: refused
  no_right,         ///< no right image: refused
  sizes_differ,     ///< left and right have different sizes: refused
  size_unexpected,  ///< not the size of the calibration: refused
  skewed,           ///< exposed at different times, so of different pairs: refused
  out_of_order,     ///< not after the last pair: refused
  featureless,      ///< black, overexposed or covered: a frame without observations
  frontend_failed,  ///< the frontend itself reported an error: refused
};
inline constexpr std::size_t kImageFates = 9;  ///< number of ImageFate values

/// Name of a fate, for tables.
[[nodiscard]] constexpr const char* name_of(ImageFate fate) {
  constexpr std::array<const char*, kImageFates> names{"processed",
                                                       "left image missing",
                                                       "right image missing",
                                                       "sizes differ",
                                                       "not the calibrated size",
                                                       "left and right of different times",
                                                       "not in order of time",
                                                       "without content",
                                                       "frontend failed"};
  return names[static_cast<std::size_t>(fate)];
}

/// What is asked of a pair before a frontend sees it.
struct ImagePairLimits {
  int width{0}, height{0};   ///< size that the calibration is of, px; 0: any
  double max_skew_s{0.005};  ///< |time_left - time_right|; hardware triggers keep 1 or 2 ms, a pair torn apart differs by a period or half
  int min_contrast{8};       ///< difference of the brightest and darkest grey value seen; below, the image has no content. 0: do not look
};

/// Brightest minus darkest of a grid of 48 x 48 pixels (all of them if the image is smaller): what no feature detector could exceed there.
[[nodiscard]] inline int coarse_contrast(const ImageView& image) {
  constexpr int kGrid = 48;
  const int step_x = std::max(1, image.width / kGrid), step_y = std::max(1, image.height / kGrid);
  int darkest = 255, brightest = 0;
  for (int y = 0; y < image.height; y += step_y)
    for (int x = 0; x < image.width; x += step_x) {
      const int grey = image(x, y);
      darkest = std::min(darkest, grey), brightest = std::max(brightest, grey);
    }
  return std::max(0, brightest - darkest);
}

/// Fate of a pair as far as it shows before processing: `processed` when a frontend should see it. `last`: time of the pair before, if any.
[[nodiscard]] inline ImageFate check_image_pair(const ImagePair& images, const ImagePairLimits& limits,
                                                const std::optional<GpsTime>& last = {}) {
  const ImageView &left = images.left, &right = images.right;
  if (!left.valid()) return ImageFate::no_left;
  if (!right.valid()) return ImageFate::no_right;
  if (left.width != right.width || left.height != right.height) return ImageFate::sizes_differ;
  if ((limits.width > 0 && left.width != limits.width) || (limits.height > 0 && left.height != limits.height))
    return ImageFate::size_unexpected;
  const double skew_s = seconds_between(images.time_left, images.time_right);
  if (std::max(skew_s, -skew_s) > limits.max_skew_s) return ImageFate::skewed;
  if (last && !(images.time_left > *last)) return ImageFate::out_of_order;
  if (limits.min_contrast > 0 && (coarse_contrast(left) < limits.min_contrast || coarse_contrast(right) < limits.min_contrast))
    return ImageFate::featureless;
  return ImageFate::processed;
}

/// A frontend behind the checks of check_image_pair; itself a VisionFrontend. Counts every pair under its fate.
template <VisionFrontend F>
class CheckedFrontend {
 public:
  using Frame = typename F::Frame;

  explicit CheckedFrontend(F& frontend, const ImagePairLimits& limits = {}) : frontend_(&frontend), limits_(limits) {}

  /// Errors: no_data (an image is missing), invalid_argument (sizes), stale (halves of different pairs), out_of_order, or what the
  /// frontend reports; `frame` has no observations then.
  Status process(const ImagePair& images, const std::optional<CameraMotion>& predicted, Frame& frame) {
    frame = Frame{};
    frame.time = images.time_left;
    ImageFate fate = check_image_pair(images, limits_, last_);
    Status status = status_of(fate);
    if (status.ok()) last_ = images.time_left;
    if (fate == ImageFate::processed) {
      status = frontend_->process(images, predicted, frame);
      if (!status.ok()) {
        fate = ImageFate::frontend_failed;
        frame = Frame{};
        frame.time = images.time_left;
      }
    }
    ++counts_[static_cast<std::size_t>(fate)];
    return status;
  }

  [[nodiscard]] std::size_t count(ImageFate fate) const { return counts_[static_cast<std::size_t>(fate)]; }

 private:
  [[nodiscard]] static Status status_of(ImageFate fate) {
    switch (fate) {
      case ImageFate::no_left: return failure(StatusCode::no_data, "image pair: the left image is missing");
      case ImageFate::no_right: return failure(StatusCode::no_data, "image pair: the right image is missing");
      case ImageFate::sizes_differ: return failure(StatusCode::invalid_argument, "image pair: left and right have different sizes");
      case ImageFate::size_unexpected: return failure(StatusCode::invalid_argument, "image pair: not the size that the calibration is of");
      case ImageFate::skewed: return failure(StatusCode::stale, "image pair: left and right were not exposed together");
      case ImageFate::out_of_order: return failure(StatusCode::out_of_order, "image pair: not after the last one");
      case ImageFate::processed:
      case ImageFate::featureless:
      case ImageFate::frontend_failed: break;
    }
    return ok_status();
  }

  F* frontend_;
  ImagePairLimits limits_;
  std::optional<GpsTime> last_{};
  std::array<std::size_t, kImageFates> counts_{};
};

}  // namespace searvins::vision
