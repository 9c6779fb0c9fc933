// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Rectification: two calibrated cameras seen as one StereoCamera, whose images have matching points on one row.
///
/// Calibration: camera 0 (left) and 1 (right), p_c1 = R_c1_c0 p_c0 + t_c1_c0. The right camera's place in left axes is
///
///     o = -R_c1_c0' t_c1_c0        B = |o|
///
/// Both cameras are turned, in thought, to common axes r: x along o (so both image rows run along the baseline), z the mean of the two
/// optical axes made perpendicular to x (so each turns as little as may be), y = z x x. With rows x', y', z' in left axes,
///
///     R_r_c0 = [x y z]'        R_r_c1 = R_r_c0 R_c1_c0'
///
/// and share new intrinsics without distortion: one focal length, the mean of the four, and one principal point that puts the middles of
/// the two images, on average, in the middle of the new ones. A ray d_c of a camera is seen at K R_r_c d_c; a point p_r = R_r_c0 p_c0 is
/// seen by the right camera as p_r - (B, 0, 0), hence on the same row, its disparity f B / z.
///
/// Maps of pixels both ways, and remap tables row by row for whatever image type the caller has: a table names, for each pixel of the new
/// image, the place in the raw image to interpolate at.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

#include <searvins/core/status.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/vision/camera_model.hpp>
#include <searvins/vision/stereo_camera.hpp>

namespace searvins::vision {

/// Which camera of the pair.
enum class Eye : std::uint8_t { left, right };

/// Two cameras and how they stand to each other; `R_b_c0`, `p_b_c0_m`: the left one in the body.
template <std::floating_point S>
struct StereoCalibration {
  std::array<PinholeCamera<S>, 2> eyes{};
  Eigen::Matrix<S, 3, 3> R_c1_c0{Eigen::Matrix<S, 3, 3>::Identity()};
  Eigen::Matrix<S, 3, 1> t_c1_c0_m{Eigen::Matrix<S, 3, 1>::Zero()};
  Eigen::Matrix<S, 3, 3> R_b_c0{Eigen::Matrix<S, 3, 3>::Identity()};
  Eigen::Matrix<S, 3, 1> p_b_c0_m{Eigen::Matrix<S, 3, 1>::Zero()};
};

/// Choices of rectify().
template <std::floating_point S>
struct RectificationOptions {
  S focal_scale{1};       ///< above 1: a narrower view with fewer pixels that have no source
  S min_depth_m{S(0.1)};  ///< of the StereoCamera
};

/// The result. Made by rectify().
template <std::floating_point S>
class Rectification {
 public:
  using Vector2 = Eigen::Matrix<S, 2, 1>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  static constexpr float kNoSource = -1;  ///< both entries of a remap table where the raw image shows nothing

  Rectification() = default;
  Rectification(const std::array<PinholeCamera<S>, 2>& eyes, const std::array<Matrix3, 2>& R_r_c, const StereoCamera<S>& camera)
      : eyes_(eyes), R_r_c_(R_r_c), camera_(camera) {}

  /// The pair as one camera, of the size of the raw images.
  [[nodiscard]] const StereoCamera<S>& camera() const { return camera_; }
  [[nodiscard]] const PinholeCamera<S>& raw(Eye eye) const { return eyes_[at(eye)]; }
  /// Axes of a raw camera in the common ones.
  [[nodiscard]] const Matrix3& rotation(Eye eye) const { return R_r_c_[at(eye)]; }

  /// Rectified pixel of a raw one. Errors: as PinholeCamera::ray; rejected when the turned ray looks backwards.
  [[nodiscard]] Result<Vector2> rectified(Eye eye, const Vector2& raw_pixel) const {
    const auto ray = eyes_[at(eye)].ray(raw_pixel);
    if (!ray) return ray.status();
    const Vector3 d = R_r_c_[at(eye)] * *ray;
    if (!(d.z() > S(0))) return failure(StatusCode::rejected, "ray lies behind the rectified camera", -1, -1, static_cast<double>(d.z()));
    return Vector2{camera_.fx_px * d.x() / d.z() + camera_.cx_px, camera_.fy_px * d.y() / d.z() + camera_.cy_px};
  }

  /// Raw pixel of a rectified one; it may lie off the image. Errors: as PinholeCamera::project.
  [[nodiscard]] Result<Vector2> raw_of(Eye eye, const Vector2& pixel) const {
    const Vector3 d{(pixel[0] - camera_.cx_px) / camera_.fx_px, (pixel[1] - camera_.cy_px) / camera_.fy_px, S(1)};
    return eyes_[at(eye)].project(Vector3{R_r_c_[at(eye)].transpose() * d});
  }

  /// Row `v` of the remap table of an eye: for pixel (i, v) of the rectified image, i < width, the raw pixel (u_px[i], v_px[i]), or
  /// kNoSource in both. Returns how many pixels have a source. Errors: invalid_argument (a span that is not of the image's width, or a
  /// row off the image).
  [[nodiscard]] Result<int> fill_row(Eye eye, int v, std::span<float> u_px, std::span<float> v_px) const {
    const auto width = static_cast<std::size_t>(camera_.width_px);
    if (u_px.size() != width || v_px.size() != width || v < 0 || v >= camera_.height_px)
      return failure(StatusCode::invalid_argument, "a row of a remap table has the width of the image and lies on it", v, camera_.width_px);
    int sources = 0;
    for (std::size_t i = 0; i < width; ++i) {
      const auto source = raw_of(eye, {static_cast<S>(i), static_cast<S>(v)});
      const bool seen = source.ok() && eyes_[at(eye)].inside(*source);
      u_px[i] = seen ? static_cast<float>((*source)[0]) : kNoSource;
      v_px[i] = seen ? static_cast<float>((*source)[1]) : kNoSource;
      sources += seen ? 1 : 0;
    }
    return sources;
  }

 private:
  [[nodiscard]] static constexpr std::size_t at(Eye eye) { return static_cast<std::size_t>(eye); }

  std::array<PinholeCamera<S>, 2> eyes_{};
  std::array<Matrix3, 2> R_r_c_{Matrix3::Identity(), Matrix3::Identity()};
  StereoCamera<S> camera_{};
};

namespace detail {

/// The common axes in those of the left camera, as rows; see the file comment. `o`: direction to the right camera.
template <class S>
[[nodiscard]] Eigen::Matrix<S, 3, 3> common_axes(const Eigen::Matrix<S, 3, 1>& o, const Eigen::Matrix<S, 3, 3>& R_c1_c0) {
  const Eigen::Matrix<S, 3, 1> forward = Eigen::Matrix<S, 3, 1>::UnitZ() + R_c1_c0.row(2).transpose();
  const Eigen::Matrix<S, 3, 1> z = (forward - forward.dot(o) * o).normalized();
  Eigen::Matrix<S, 3, 3> R;
  R.row(0) = o.transpose(), R.row(1) = (so3::skew(z) * o).transpose(), R.row(2) = z.transpose();
  return R;
}

}  // namespace detail

/// Rectifies a calibration. Errors: invalid_argument with what is wrong: a camera (check() of it; index: 0 left, 1 right), different
/// image sizes, a pose that is no rotation, a baseline that is not mostly to the right, optical axes that part by more than 60 degrees or
/// lie along the baseline.
template <class S>
[[nodiscard]] Result<Rectification<S>> rectify(const StereoCalibration<S>& calibration, const RectificationOptions<S>& options = {}) {
  using Vector2 = Eigen::Matrix<S, 2, 1>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix3 = Eigen::Matrix<S, 3, 3>;
  const auto wrong = [](const char* what) { return failure(StatusCode::invalid_argument, what); };
  const auto& eyes = calibration.eyes;
  for (std::size_t i = 0; i < 2; ++i)
    if (Status s = check(eyes[i]); !s.ok()) {
      s.index = static_cast<std::int32_t>(i);
      return s;
    }
  if (eyes[0].width_px != eyes[1].width_px || eyes[0].height_px != eyes[1].height_px)
    return wrong("stereo pair: the two images differ in size");
  if (!detail::is_rotation(calibration.R_c1_c0) || !detail::is_rotation(calibration.R_b_c0) || !calibration.p_b_c0_m.allFinite())
    return wrong("stereo pair: a pose is not a rotation and a place");
  if (!(options.focal_scale > S(0)) || !std::isfinite(options.focal_scale))
    return wrong("stereo pair: the scale of the focal length must be positive");
  const Vector3 offset = -(calibration.R_c1_c0.transpose() * calibration.t_c1_c0_m);
  const S baseline_m = offset.norm();
  if (!(baseline_m > S(0)) || !std::isfinite(baseline_m)) return wrong("stereo pair: the cameras are in one place");
  const Vector3 o = offset / baseline_m;
  if (o.x() < S(0)) return wrong("stereo pair: camera 1 is to the left of camera 0: swap them, or invert the transform between them");
  if (o.x() < S(0.7)) return wrong("stereo pair: the baseline does not run along the image rows");
  if (calibration.R_c1_c0(2, 2) < S(0.5)) return wrong("stereo pair: the optical axes part by more than 60 degrees");

  const Matrix3 R_r_c0 = detail::common_axes<S>(o, calibration.R_c1_c0);
  const std::array<Matrix3, 2> R{R_r_c0, Matrix3{R_r_c0 * calibration.R_c1_c0.transpose()}};
  StereoCamera<S> camera;
  camera.width_px = eyes[0].width_px, camera.height_px = eyes[0].height_px;
  camera.baseline_m = baseline_m, camera.min_depth_m = options.min_depth_m;
  camera.fx_px = camera.fy_px = options.focal_scale * (eyes[0].fx_px + eyes[0].fy_px + eyes[1].fx_px + eyes[1].fy_px) / S(4);
  const Vector2 middle{static_cast<S>(camera.width_px - 1) / S(2), static_cast<S>(camera.height_px - 1) / S(2)};
  Vector2 principal = middle;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto ray = eyes[i].ray(middle);
    if (!ray) return ray.status();
    const Vector3 d = R[i] * *ray;
    if (!(d.z() > S(0.1) * d.norm())) return wrong("stereo pair: an image looks along the baseline");
    principal -= camera.fx_px / S(2) * Vector2{d.x() / d.z(), d.y() / d.z()};
  }
  camera.cx_px = principal[0], camera.cy_px = principal[1];
  camera.R_bc = calibration.R_b_c0 * R_r_c0.transpose(), camera.p_bc_m = calibration.p_b_c0_m;
  if (const Status s = check(camera); !s.ok()) return s;
  return Rectification<S>{eyes, R, camera};
}

}  // namespace searvins::vision
