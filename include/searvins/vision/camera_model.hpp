// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// One camera as it comes: pinhole with radial-tangential distortion [Brown 1971, in the form of common calibration tools].
///
/// A ray (X, Y, Z), Z > 0, meets the plane Z = 1 at x = X/Z, y = Y/Z. The lens moves it, with s = x^2 + y^2 and g = 1 + k1 s + k2 s^2 +
/// k3 s^3,
///
///     x_d = x g + 2 p1 x y + p2 (s + 2 x^2)          u = fx x_d + cx
///     y_d = y g + p1 (s + 2 y^2) + 2 p2 x y          v = fy y_d + cy
///
///     d x_d / d x = g + 2 x^2 g' + 2 p1 y + 6 p2 x        g' = k1 + 2 k2 s + 3 k3 s^2
///     d x_d / d y = 2 x y g' + 2 p1 x + 2 p2 y            = d y_d / d x
///     d y_d / d y = g + 2 y^2 g' + 6 p1 y + 2 p2 x
///
/// The polynomial is a fit inside the image. Far outside, r g may turn back: two rays would share a pixel, and a point far off the image
/// would appear on it. So a ray is refused where r g has turned, that is, unless
///
///     d(r g)/dr = 1 + 3 k1 t + 5 k2 t^2 + 7 k3 t^3 > 0      for all t in [0, s]
///
/// The inverse has no closed form: Newton from the distorted point, with halved steps where the error would grow.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <concepts>
#include <limits>

#include <searvins/core/status.hpp>

namespace searvins::vision {

/// Coefficients of the lens; zeros: none.
template <std::floating_point S>
struct RadialTangential {
  using Vector2 = Eigen::Matrix<S, 2, 1>;
  using Matrix2 = Eigen::Matrix<S, 2, 2>;

  S k1{0}, k2{0}, p1{0}, p2{0}, k3{0};

  /// Whether the lens maps the disc of squared radius `s` one to one (radially): see the file comment.
  [[nodiscard]] bool one_to_one(S s) const {
    const auto slope = [this](S t) { return S(1) + t * (S(3) * k1 + t * (S(5) * k2 + t * S(7) * k3)); };
    if (!(slope(s) > S(0))) return false;
    // The least slope lies at an end or where 3 k1 + 10 k2 t + 21 k3 t^2 = 0.
    const S a = S(21) * k3, half_b = S(5) * k2, c = S(3) * k1, root = half_b * half_b - a * c;
    if (root < S(0)) return true;
    const S q = -(half_b + std::copysign(std::sqrt(root), half_b));
    for (const S t : {a != S(0) ? q / a : S(-1), q != S(0) ? c / q : S(-1)})
      if (t > S(0) && t < s && !(slope(t) > S(0))) return false;
    return true;
  }

  /// The ideal point as the lens shows it, whatever its radius; optionally the Jacobian.
  [[nodiscard]] Vector2 distort(const Vector2& ideal, Matrix2* d_ideal = nullptr) const {
    const S x = ideal[0], y = ideal[1], s = x * x + y * y;
    const S g = S(1) + s * (k1 + s * (k2 + s * k3));
    if (d_ideal) {
      const S slope = k1 + s * (S(2) * k2 + S(3) * k3 * s), mixed = S(2) * (x * y * slope + p1 * x + p2 * y);
      *d_ideal << g + S(2) * x * x * slope + S(2) * p1 * y + S(6) * p2 * x, mixed,  //
          mixed, g + S(2) * y * y * slope + S(6) * p1 * y + S(2) * p2 * x;
    }
    return {x * g + S(2) * p1 * x * y + p2 * (s + S(2) * x * x), y * g + p1 * (s + S(2) * y * y) + S(2) * p2 * x * y};
  }

  /// The ideal point of a distorted one, to a few epsilon. Errors: non_finite; not_converged (value: the error that remained) when no
  /// point within the range of the lens is shown there.
  [[nodiscard]] Result<Vector2> undistort(const Vector2& distorted) const {
    constexpr int kIterations = 50, kHalvings = 10, kShrinkings = 64;
    const S tolerance = S(8) * std::numeric_limits<S>::epsilon();
    if (!distorted.allFinite()) return failure(StatusCode::non_finite, "image point with a NaN or infinity");
    Vector2 x = distorted;
    for (int i = 0; i < kShrinkings && !one_to_one(x.squaredNorm()); ++i) x /= S(2);  // the slope at 0 is 1
    if (!one_to_one(x.squaredNorm())) return failure(StatusCode::not_converged, "image point outside the range of the lens model");
    Matrix2 J;
    Vector2 error = distort(x, &J) - distorted;
    for (int i = 0; i < kIterations && error.norm() > tolerance * (S(1) + distorted.norm()); ++i) {
      const S determinant = J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0);
      Vector2 step{(J(1, 1) * error[0] - J(0, 1) * error[1]) / determinant, (J(0, 0) * error[1] - J(1, 0) * error[0]) / determinant};
      bool nearer = false;
      for (int half = 0; half < kHalvings && !nearer; ++half, step /= S(2)) {
        const Vector2 candidate = x - step;
        if (!one_to_one(candidate.squaredNorm())) continue;
        Matrix2 candidate_J;
        const Vector2 candidate_error = distort(candidate, &candidate_J) - distorted;
        if (!(candidate_error.norm() < error.norm())) continue;
        nearer = true;
        x = candidate, error = candidate_error, J = candidate_J;
      }
      if (!nearer) break;
    }
    if (!(error.norm() <= S(16) * tolerance * (S(1) + distorted.norm())))
      return failure(StatusCode::not_converged, "image point outside the range of the lens model", -1, -1,
                     static_cast<double>(error.norm()));
    return x;
  }
};

/// See the file comment.
template <std::floating_point S>
struct PinholeCamera {
  using Vector2 = Eigen::Matrix<S, 2, 1>;
  using Vector3 = Eigen::Matrix<S, 3, 1>;
  using Matrix2 = Eigen::Matrix<S, 2, 2>;
  using Matrix23 = Eigen::Matrix<S, 2, 3>;

  int width_px{0}, height_px{0};
  S fx_px{0}, fy_px{0}, cx_px{0}, cy_px{0};
  RadialTangential<S> lens{};

  template <class T>
  [[nodiscard]] PinholeCamera<T> cast() const {
    const auto t = [](S x) { return static_cast<T>(x); };
    return {width_px, height_px, t(fx_px), t(fy_px), t(cx_px), t(cy_px), {t(lens.k1), t(lens.k2), t(lens.p1), t(lens.p2), t(lens.k3)}};
  }

  /// Whether a pixel lies between the centres of the outermost ones. A NaN does not.
  [[nodiscard]] bool inside(const Vector2& pixel) const {
    return pixel[0] >= S(0) && pixel[1] >= S(0) && pixel[0] <= static_cast<S>(width_px - 1) && pixel[1] <= static_cast<S>(height_px - 1);
  }

  /// Pixel of a point in camera axes, m; optionally its Jacobian. It may lie off the image. Errors: rejected (value: the depth) when it is
  /// behind (z <= 0), not finite, or beyond the range of the lens.
  [[nodiscard]] Result<Vector2> project(const Vector3& p_c_m, Matrix23* d_p_c = nullptr) const {
    if (!(p_c_m.z() > S(0)) || !p_c_m.allFinite())
      return failure(StatusCode::rejected, "point is behind the camera", -1, -1, static_cast<double>(p_c_m.z()));
    const S q = S(1) / p_c_m.z();
    const Vector2 ideal = p_c_m.template head<2>() * q;
    if (!ideal.allFinite() || !lens.one_to_one(ideal.squaredNorm()))
      return failure(StatusCode::rejected, "point is beyond the range of the lens model", -1, -1, static_cast<double>(p_c_m.z()));
    Matrix2 J;
    const Vector2 seen = lens.distort(ideal, d_p_c ? &J : nullptr);
    if (d_p_c) {
      J.row(0) *= fx_px * q, J.row(1) *= fy_px * q;
      d_p_c->template leftCols<2>() = J;
      d_p_c->col(2) = -(J * ideal);
    }
    return Vector2{fx_px * seen[0] + cx_px, fy_px * seen[1] + cy_px};
  }

  /// The ray (x, y, 1) of a pixel. Errors: as RadialTangential::undistort.
  [[nodiscard]] Result<Vector3> ray(const Vector2& pixel) const {
    const auto ideal = lens.undistort(Vector2{(pixel[0] - cx_px) / fx_px, (pixel[1] - cy_px) / fy_px});
    if (!ideal) return ideal.status();
    return Vector3{(*ideal)[0], (*ideal)[1], S(1)};
  }
};

/// Whether a calibration can be one. Errors: invalid_argument with what is wrong.
template <class S>
[[nodiscard]] Status check(const PinholeCamera<S>& c) {
  const auto positive = [](S x) { return x > S(0) && std::isfinite(x); };
  const auto& l = c.lens;
  if (c.width_px < 2 || c.height_px < 2) return failure(StatusCode::invalid_argument, "camera: the image needs a width and a height");
  if (!positive(c.fx_px) || !positive(c.fy_px)) return failure(StatusCode::invalid_argument, "camera: focal lengths must be positive");
  if (!c.inside({c.cx_px, c.cy_px}))
    return failure(StatusCode::invalid_argument, "camera: the principal point lies outside the image: is it another size?");
  if (!std::isfinite(l.k1) || !std::isfinite(l.k2) || !std::isfinite(l.k3) || !std::isfinite(l.p1) || !std::isfinite(l.p2))
    return failure(StatusCode::invalid_argument, "camera: distortion with a NaN or infinity");
  for (const S u : {S(0), static_cast<S>(c.width_px - 1)})
    for (const S v : {S(0), static_cast<S>(c.height_px - 1)})
      if (!c.ray({u, v}).ok()) return failure(StatusCode::invalid_argument, "camera: the distortion folds the image inside its corners");
  return ok_status();
}

/// Whether images of a size are what a calibration is for. Errors: invalid_argument (index: width, detail: height of the images).
template <class S>
[[nodiscard]] Status check_size(const PinholeCamera<S>& c, int width_px, int height_px) {
  if (c.width_px == width_px && c.height_px == height_px) return ok_status();
  return failure(StatusCode::invalid_argument, "camera: images have another size than the calibration", width_px, height_px);
}

}  // namespace searvins::vision
