// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A camera that drives down a street of points: frames of tracks with the true motion, for tests of admission.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/motion_consistency.hpp>
#include <searvins/vision/stereo_observation.hpp>

#include "support/property.hpp"
#include "two_views.hpp"

namespace searvins::test {

/// Ten frames a second; a point's track number is its index plus one, as long as it is seen without a break.
class StreetDrive {
 public:
  static constexpr std::size_t kTracks = 128;
  using Frame = vision::StereoFrame<kTracks>;

  explicit StreetDrive(Rng& rng, double sigma_px = 0.3) : rng_(&rng), sigma_px_(sigma_px) {
    for (int i = 0; i < 400; ++i)
      points_.push_back(random_point_of_street(rng));
  }

  /// Moves on (way forward, turn to the right) and looks.
  Frame next(double way_m = 0.7, double turn_rad = 0.004) {
    motion_ = {so3::exp(Eigen::Vector3d{0, turn_rad, 0}), {0, 0, way_m}};
    if (frames_++ > 0) pose_ = pose_.then(motion_);
    return look();
  }

  /// What an ideal unit predicts for the last step.
  [[nodiscard]] std::optional<vision::PredictedMotion> prediction() const {
    return vision::PredictedMotion{motion_, Eigen::Matrix<double, 6, 6>::Zero()};
  }
  [[nodiscard]] const vision::CameraMotion& motion() const { return motion_; }
  [[nodiscard]] GpsTime time() const { return GpsTime::from_week_sow(2323, 1000 + 0.1 * frames_); }

 private:
  /// Braces: their order of evaluation is the same with every compiler, so is the street.
  [[nodiscard]] static Eigen::Vector3d random_point_of_street(Rng& rng) {
    return {(chance(rng, 0.5) ? -1 : 1) * uniform(rng, 3, 12), uniform(rng, -5, 1.5), uniform(rng, 0, 120)};
  }

  [[nodiscard]] Frame look() {
    const auto camera = car_camera();
    Frame frame;
    frame.time = time();
    for (std::size_t i = 0; i < points_.size() && !frame.observations.full(); ++i) {
      const Eigen::Vector3d p_c_m = pose_.to_current(points_[i]);
      if (p_c_m.z() < 3 || p_c_m.z() > 45 || !camera.inside(camera.continued(p_c_m), 3)) continue;
      vision::StereoObservation o;
      o.track = i + 1, o.score = 0.9;
      o.pixel_px = look_at(*rng_, camera, p_c_m, sigma_px_);
      o.v_difference_px = normal(*rng_, sigma_px_);
      o.semantic_class = 2;
      (void)frame.add(o);
    }
    return frame;
  }

  Rng* rng_;
  double sigma_px_;
  std::vector<Eigen::Vector3d> points_;  ///< in the first camera
  vision::CameraMotion pose_, motion_;
  int frames_{0};
};

}  // namespace searvins::test
