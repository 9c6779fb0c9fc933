// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Frames of stereo tracks made from pictures on disk by the reference frontend, as a FrameSource:
///
///     pair of files  ->  rectified  ->  CheckedFrontend<OrbFrontend>  ->  class of each point, where labels lie beside  ->  frame
///
/// The folder is laid out as EuRoC's (datasets/euroc.hpp); labels0/data/ holds, under the names of the left pictures, one byte a
/// pixel of the picture as it was taken: its class. A pair that cannot be read or is refused by a check is left out and counted; the run goes on.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <searvins/vision/frontend.hpp>
#include <searvins/vision/rectification.hpp>
#include <searvins/vision/semantic_mask.hpp>

#include "examples/datasets/euroc.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/orb_frontend/remap.hpp"
#include "examples/searvins/frame_source.hpp"
#include "examples/support/counts.hpp"
#include "examples/support/gray_image.hpp"
#include "examples/support/image_reader.hpp"

namespace searvins::examples {

/// How the pictures are treated.
struct ImageFrameOptions {
  orb::OrbOptions orb{};
  io::NanosecondScale nanoseconds{io::NanosecondScale::unix_utc};  ///< of the stamps
  vision::SemanticRules semantic{};                                ///< whose margins the labels are asked for
};

/// The labels of the left raw picture, asked at rectified pixels. Models vision::SemanticMask.
class RawLabels {
 public:
  RawLabels(const vision::Rectification<double>& rectification, const GrayImage& labels)
      : rectification_(&rectification),
        image_{labels.view(), static_cast<double>(labels.width()) / rectification.raw(vision::Eye::left).width_px} {}

  [[nodiscard]] bool covers(double u_px, double v_px) const {
    const auto raw = raw_of(u_px, v_px);
    return raw && image_.covers(raw->x(), raw->y());
  }
  [[nodiscard]] vision::SemanticClass semantic_class(double u_px, double v_px) const {
    const auto raw = raw_of(u_px, v_px);
    return raw ? image_.semantic_class(raw->x(), raw->y()) : vision::kUnlabelled;
  }
  /// The radius is not distorted with the point: lenses change it by a few per cent.
  [[nodiscard]] bool any_within(double u_px, double v_px, double radius_px, const vision::ClassSet& classes) const {
    const auto raw = raw_of(u_px, v_px);
    return raw && image_.any_within(raw->x(), raw->y(), radius_px, classes);
  }

 private:
  [[nodiscard]] std::optional<Eigen::Vector2d> raw_of(double u_px, double v_px) const {
    const auto raw = rectification_->raw_of(vision::Eye::left, {u_px, v_px});
    return raw ? std::optional<Eigen::Vector2d>{*raw} : std::nullopt;
  }

  const vision::Rectification<double>* rectification_;
  vision::LabelImage image_;
};
static_assert(vision::SemanticMask<RawLabels>);

/// See the file comment.
class ImageFrames final : public FrameSource {
 public:
  using Frontend = orb::OrbFrontend<TrackFrame::kCapacity>;

  /// Reads lists and calibration. Errors: those of read_euroc; a calibration that cannot be rectified.
  [[nodiscard]] static io::FileResult<std::unique_ptr<ImageFrames>> open(const std::filesystem::path& folder, const ImageFrameOptions& options = {}) {
    EurocOptions layout;
    layout.nanoseconds = options.nanoseconds;
    io::Parsed<EurocRecording> read = read_euroc(folder, layout);
    if (read.error) return *read.error;
    const EurocCamera &left = read.value.left, &right = read.value.right;
    vision::StereoCalibration<double> calibration;
    calibration.eyes = {left.model, right.model};
    calibration.R_c1_c0 = right.pose.R_bs.transpose() * left.pose.R_bs;
    calibration.t_c1_c0_m = right.pose.R_bs.transpose() * (left.pose.t_bs_m - right.pose.t_bs_m);
    calibration.R_b_c0 = left.pose.R_bs, calibration.p_b_c0_m = left.pose.t_bs_m;
    const auto rectification = vision::rectify(calibration);
    const std::string yaml = (std::filesystem::path{read.value.folder} / "cam1" / "sensor.yaml").string();
    if (!rectification) return io::Diagnostic{yaml, 0, rectification.status().what, "compare T_BS and intrinsics of both cameras"};
    auto frames = std::unique_ptr<ImageFrames>(new ImageFrames(std::move(read.value), *rectification, options));
    frames->skipped_ = std::move(read.skipped);
    for (const vision::Eye eye : {vision::Eye::left, vision::Eye::right})
      if (const Status s = frames->remap_[eye == vision::Eye::left ? 0 : 1].build(*rectification, eye); !s.ok())
        return io::Diagnostic{yaml, 0, s.what, "compare T_BS and intrinsics of both cameras"};
    return frames;
  }

  /// The rectified pair as one camera, in the body of the calibration's T_BS.
  [[nodiscard]] const vision::StereoCamera<double>& camera() const { return rectification_.camera(); }
  [[nodiscard]] const EurocRecording& recording() const { return recording_; }
  [[nodiscard]] bool has_labels() const { return has_labels_; }
  /// Pairs earlier than this are passed over.
  void start_at(GpsTime start) {
    while (next_ < recording_.pairs.size() && recording_.pairs[next_].time < start) ++next_;
  }

  [[nodiscard]] std::optional<GpsTime> time() const override {
    return next_ < recording_.pairs.size() ? std::optional{recording_.pairs[next_].time} : std::nullopt;
  }

  [[nodiscard]] io::FileResult<bool> take(const std::optional<vision::CameraMotion>& predicted, TrackFrame& frame) override {
    const EurocPair& pair = recording_.pairs[next_++];
    has_picture_ = false;
    const io::FileResult<EurocImages> images = read_euroc_pair(recording_, pair);
    if (!images) {
      ++left_out_["pair left out: " + images.error().message];
      is_broken_ = true;
      return false;
    }
    if (!remap_[0].apply(images->left.view(), left_).ok() || !remap_[1].apply(images->right.view(), right_).ok()) {
      ++left_out_["pair left out: not the size of the calibration"];
      is_broken_ = true;
      return false;
    }
    // After a pair that the frontend never saw, the prediction begins at the wrong one.
    const bool is_whole = !std::exchange(is_broken_, false);
    const Status s = checked_.process({left_.view(), right_.view(), pair.time, pair.time}, is_whole ? predicted : std::nullopt, frame);
    has_picture_ = true;
    if (!s.ok()) {
      ++left_out_[std::string{"pair left out: "} + s.what];
      return false;
    }
    if (has_labels_) label(pair, frame);
    return true;
  }

  [[nodiscard]] std::vector<Count> left_out() const override {
    std::vector<Count> items(left_out_.begin(), left_out_.end());
    for (const io::SkippedItem& item : skipped_.items()) items.emplace_back("pictures: " + item.reason, static_cast<long>(item.count));
    return items;
  }

  [[nodiscard]] vision::ImageView picture() const override { return has_picture_ ? left_.view() : vision::ImageView{}; }
  [[nodiscard]] const Frontend& frontend() const { return frontend_; }

 private:
  ImageFrames(EurocRecording recording, const vision::Rectification<double>& rectification, const ImageFrameOptions& options)
      : recording_(std::move(recording)),
        rectification_(rectification),
        options_(options),
        frontend_(rectification_.camera(), options.orb),
        checked_(frontend_, vision::ImagePairLimits{rectification_.camera().width_px, rectification_.camera().height_px}) {
    std::error_code failed;
    has_labels_ = std::filesystem::is_directory(labels_folder(), failed);
  }

  [[nodiscard]] std::filesystem::path labels_folder() const { return std::filesystem::path{recording_.folder} / "labels0" / "data"; }

  /// Says of each observation what it lies on.
  void label(const EurocPair& pair, TrackFrame& frame) {
    const io::FileResult<GrayImage> image = read_image((labels_folder() / std::filesystem::path{pair.left_path}.filename()).string());
    if (!image) {
      ++left_out_["labels left out: " + image.error().message];
      return;
    }
    const RawLabels mask{rectification_, *image};
    for (vision::StereoObservation& o : frame.observations) {
      o.semantic_class = mask.semantic_class(o.pixel_px[0], o.pixel_px[2]);
      o.near_rejected_class =
          vision::screen(options_.semantic, mask, o.pixel_px[0], o.pixel_px[2], camera().width_px) == vision::SemanticVerdict::near_boundary;
    }
  }

  EurocRecording recording_;
  vision::Rectification<double> rectification_;
  ImageFrameOptions options_;
  std::array<orb::Remap, 2> remap_{};
  Frontend frontend_;
  vision::CheckedFrontend<Frontend> checked_;
  GrayImage left_, right_;
  io::SkipLog skipped_;
  std::map<std::string, long> left_out_;
  std::size_t next_{0};
  bool has_labels_{false}, has_picture_{false}, is_broken_{false};
};

}  // namespace searvins::examples
