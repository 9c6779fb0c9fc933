// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Motion of a stereo camera between two frames from matched points of which many may be matched wrongly: RANSAC, then least squares.
/// [Fischler and Bolles 1981; paper sec. Semantic-Aware Stereo Vision Frontend]
///
/// A pair is one track's [uL, uR, v] in the previous frame, z0, and in the current one, z1. The previous one gives a point p(z0); motion
/// (R, t) predicts z1 as pi(q), q = R'(p - t). With D = d pi / d q and P = d p / d z0, both observations known to sigma pixels a number,
///
///     r = z1 - pi(q)          cov r = sigma^2 S,   S = I + T T',   T = D R' P        (T carries an error of z0 into the current frame)
///     d^2 = r' S^-1 r         the smallest sum of squared displacements of z0 and z1 that makes the two agree with the motion
///
/// d is a distance in pixels for near and far points alike: depth that is not known does not count against a point. It is what inliers
/// are told by (d < inlier_px) and what is minimised; E[d^2] = 3 sigma^2.
///
///     hypotheses      three pairs each, aligned in closed form (three_point_alignment.hpp), then two Gauss-Newton steps on the three:
///                     alignment weighs a far point's depth like a near one's, the steps put that right
///     score           sum min(d^2, inlier_px^2), the lowest wins                             [MSAC, Torr and Zisserman 2000]
///     early exit      after log(1 - confidence) / log(1 - w^3) samples, w the share of inliers so far
///     refinement      Gauss-Newton on the inliers, Huber on d / sigma, inliers chosen anew until the score falls no more
///
/// Normal equations with whitened A = S^-1/2 D [ [q]x, -R' ] (tangent order of camera_motion.hpp: R Exp(dtheta), t + dt), e = S^-1/2 r:
///
///     sum w A'A delta = sum w A'e          covariance  s^2 (sum A'A)^-1,   s = max(sigma_px, rms_px)
///
/// The same pairs, options and seed give the same bits: the generator starts from the seed in every call.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/small_cholesky.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/three_point_alignment.hpp>
#include <searvins/vision/triangulation.hpp>

namespace searvins::vision {

/// One track in two frames.
struct PixelPair {
  StereoPixel<double> previous_px{StereoPixel<double>::Zero()}, current_px{StereoPixel<double>::Zero()};
};

/// See the file comment.
struct PnpOptions {
  double inlier_px{2.0};         ///< largest d of an inlier, > 0
  double sigma_px{1.0};          ///< of each of uL, uR, v, > 0: scales Huber's threshold and the covariance
  double huber{1.345};           ///< on d / sigma_px, > 0
  double confidence{0.999};      ///< of having drawn one sample without outliers, in (0, 1)
  int max_iterations{200};       ///< samples at most, >= 1
  std::size_t min_inliers{15};   ///< fewer that agree are no motion; >= 3
  double min_inlier_share{0.3};  ///< of the usable pairs
  double min_shape{0.02};        ///< thinnest triangle of a sample (triangle_shape)
  RangeLimits<double> range{};   ///< pairs outside in the previous frame, or without disparity in the current one, are not used
  std::uint64_t seed{1};
};

/// What RANSAC met.
struct PnpStatistics {
  std::size_t pairs{0}, usable{0}, inliers{0};
  int iterations{0}, degenerate{0};  ///< samples drawn, and those of them that determine nothing
  double inlier_share{0};            ///< inliers / usable
  double rms_px{0};                  ///< sqrt(sum d^2 / (3 inliers - 6)): the noise of one observation as the inliers show it
};

namespace detail {

/// SplitMix64 [Steele, Lea, Flood 2014]: 64 good bits a call from a counter.
class SplitMix {
 public:
  explicit constexpr SplitMix(std::uint64_t seed) : state_(seed) {}
  /// Uniform in 0 .. n - 1, n < 2^32; the bias is n / 2^32.
  [[nodiscard]] constexpr std::size_t below(std::size_t n) { return static_cast<std::size_t>(((next() >> 32U) * n) >> 32U); }

 private:
  [[nodiscard]] constexpr std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

/// Lower Cholesky factor of I + T T', which is never singular.
template <class Scalar = double>
[[nodiscard]] inline Eigen::Matrix<Scalar, 3, 3> residual_factor(const math::Matrix3<Scalar>& T) {
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  Matrix3 S = Matrix3::Identity();
  S.noalias() += T * T.transpose();
  Matrix3 L = Matrix3::Zero();
  L(0, 0) = std::sqrt(S(0, 0));
  L(1, 0) = S(1, 0) / L(0, 0), L(2, 0) = S(2, 0) / L(0, 0);
  L(1, 1) = std::sqrt(S(1, 1) - L(1, 0) * L(1, 0));
  L(2, 1) = (S(2, 1) - L(2, 0) * L(1, 0)) / L(1, 1);
  L(2, 2) = std::sqrt(S(2, 2) - L(2, 0) * L(2, 0) - L(2, 1) * L(2, 1));
  return L;
}

/// X <- L^-1 X.
template <int K, class Scalar>
void whiten(const Eigen::Matrix<Scalar, 3, 3>& L, Eigen::Matrix<Scalar, 3, K>& X) {
  X.row(0) /= L(0, 0);
  X.row(1) = (X.row(1) - L(1, 0) * X.row(0)) / L(1, 1);
  X.row(2) = (X.row(2) - L(2, 0) * X.row(0) - L(2, 1) * X.row(1)) / L(2, 2);
}

}  // namespace detail

/// See the file comment. At most N pairs; the object is the whole working memory, about 170 N bytes.
template <std::size_t N>
class StereoPnp {
 public:
  using Scalar = math::DeferredFor<double, N>;
  using Camera = StereoCamera<Scalar>;
  using Motion = BasicCameraMotion<Scalar>;
  using Pairs = StaticVector<PixelPair, N>;
  using Matrix6 = Eigen::Matrix<Scalar, 6, 6>;
  using Vector6 = Eigen::Matrix<Scalar, 6, 1>;

  explicit StereoPnp(const Camera& camera, const PnpOptions& options = {}) : camera_(camera), options_(options) {}

  /// Finds the motion. Errors: invalid_argument (camera or options); too_few (usable pairs: `index` there, `detail` needed); rejected
  /// (too few that agree, likewise); under_determined (what agrees lies on a line, say). After an error there is no motion and no inlier.
  Status solve(const Pairs& pairs) {
    reset(pairs.size());
    if (const Status s = check_options(); !s) return s;
    collect(pairs);
    const std::size_t needed = options_.min_inliers;
    if (points_.size() < needed)
      return failure(StatusCode::too_few, "PnP: too few usable pairs", static_cast<std::int32_t>(points_.size()),
                     static_cast<std::int32_t>(needed));
    draw_samples();
    const Status status = conclude();
    if (!status) forget();
    return status;
  }

  /// The motion of the last successful solve, and its covariance in the tangent order of CameraMotion.
  [[nodiscard]] const Motion& motion() const { return motion_; }
  [[nodiscard]] const Matrix6& covariance() const { return covariance_; }
  [[nodiscard]] const PnpStatistics& statistics() const { return statistics_; }
  /// Whether pair i of the last call agrees with the motion.
  [[nodiscard]] bool is_inlier(std::size_t i) const { return i < is_inlier_.size() && is_inlier_[i]; }

  /// d of a pair under a motion, px; infinite where a motion puts the point behind the camera, and for pairs without disparity.
  [[nodiscard]] double distance_px(const PixelPair& pair, const Motion& motion) const {
    if (!usable(pair)) return std::numeric_limits<double>::infinity();
    return std::sqrt(distance2(point_of(pair, 0), motion));
  }

 private:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using Cholesky = math::DeferredFor<math::SmallCholesky<6>, N>;

  /// A usable pair and what of it does not depend on the motion.
  struct Point {
    Vector3 p_prev_m{Vector3::Zero()}, current_px{Vector3::Zero()};
    Matrix3 d_p_d_px{Matrix3::Zero()};  ///< P
    std::size_t pair{0};
  };

  void reset(std::size_t pairs) {
    points_.clear();
    is_inlier_.clear();
    (void)is_inlier_.resize(pairs);
    statistics_ = {};
    statistics_.pairs = pairs;
    motion_ = {};
    covariance_.setZero();
    cost_ = std::numeric_limits<double>::infinity();
  }

  void forget() {
    for (bool& inlier : is_inlier_) inlier = false;
    motion_ = {};
    covariance_.setZero();
  }

  [[nodiscard]] Status check_options() const {
    if (const Status s = check(camera_); !s) return s;
    const PnpOptions& o = options_;
    if (!(o.inlier_px > 0 && o.sigma_px > 0 && o.huber > 0 && std::isfinite(o.inlier_px) && std::isfinite(o.sigma_px)))
      return failure(StatusCode::invalid_argument, "PnP: inlier_px, sigma_px and huber must be positive and finite");
    if (!(o.confidence > 0 && o.confidence < 1)) return failure(StatusCode::invalid_argument, "PnP: the confidence must lie in (0, 1)");
    if (o.max_iterations < 1 || o.min_inliers < 3 || !(o.min_shape > 0))
      return failure(StatusCode::invalid_argument, "PnP: at least one iteration, three inliers and a positive min_shape are needed");
    return ok_status();
  }

  [[nodiscard]] bool usable(const PixelPair& pair) const {
    const StereoPixel<Scalar>& current_px = pair.current_px;
    return range_fault(camera_, pair.previous_px, options_.range) == RangeFault::none && current_px.allFinite() &&
           current_px[0] > current_px[1];
  }

  [[nodiscard]] Point point_of(const PixelPair& pair, std::size_t index) const {
    Point point;
    point.p_prev_m = point_at(camera_, pair.previous_px, &point.d_p_d_px);
    point.current_px = pair.current_px;
    point.pair = index;
    return point;
  }

  void collect(const Pairs& pairs) {
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (usable(pairs[i])) (void)points_.push_back(point_of(pairs[i], i));
    statistics_.usable = points_.size();
  }

  /// d^2 of the file comment.
  [[nodiscard]] double distance2(const Point& point, const Motion& motion) const {
    const Vector3 q = motion.to_current(point.p_prev_m);
    if (!camera_.in_front(q)) return std::numeric_limits<double>::infinity();
    Matrix3 D;
    Vector3 e = point.current_px - camera_.continued(q, &D);
    const Matrix3 T = D * (motion.R_prev_cur.transpose() * point.d_p_d_px);
    detail::whiten<1>(detail::residual_factor<Scalar>(T), e);
    const double d2 = e.squaredNorm();
    return d2 >= 0 ? d2 : std::numeric_limits<double>::infinity();  // a NaN agrees with nothing
  }

  /// Truncated cost of a motion, infinite as soon as it exceeds `bound`.
  [[nodiscard]] double score(const Motion& motion, double bound, std::size_t& inliers) const {
    const double limit = options_.inlier_px * options_.inlier_px;
    double cost = 0;
    inliers = 0;
    for (const Point& point : points_) {
      const double d2 = distance2(point, motion);
      inliers += d2 < limit;
      cost += std::min(d2, limit);
      if (!(cost < bound)) return std::numeric_limits<double>::infinity();
    }
    return cost;
  }

  /// Adds a pair's share of the normal equations at `motion`, with Huber's weight or (for the covariance) without; returns d^2.
  double accumulate(const Point& point, const Motion& motion, bool weighted, Matrix6& H, Vector6& g) const {
    const Vector3 q = motion.to_current(point.p_prev_m);
    const Matrix3 R_cur_prev = motion.R_prev_cur.transpose();
    Matrix3 D;
    Vector3 e = point.current_px - camera_.continued(q, &D);
    Eigen::Matrix<Scalar, 3, 6> A;
    A.template leftCols<3>() = D * so3::skew(q);
    A.template rightCols<3>() = -(D * R_cur_prev);
    const Matrix3 L = detail::residual_factor<Scalar>(D * (R_cur_prev * point.d_p_d_px));
    detail::whiten<1>(L, e);
    detail::whiten<6>(L, A);
    const double d2 = e.squaredNorm();
    const double weight = weighted ? robust::Huber<double>{options_.huber}.weight(d2 / (options_.sigma_px * options_.sigma_px)) : 1.0;
    H.noalias() += weight * (A.transpose() * A);
    g.noalias() += weight * (A.transpose() * e);
    return d2;
  }

  /// Gauss-Newton, at most `steps` steps, over the points that `for_each(visit)` visits; false when they do not determine the motion.
  template <class ForEach>
  [[nodiscard]] bool descend(Motion& motion, int steps, bool weighted, ForEach for_each) const {
    constexpr double kTurnRad = 1e-10, kWayM = 1e-9;  // steps below are rounding
    for (int i = 0; i < steps; ++i) {
      Matrix6 H = Matrix6::Zero();
      Vector6 g = Vector6::Zero();
      for_each([&](const Point& point) { (void)accumulate(point, motion, weighted, H, g); });
      const Cholesky factor(H);
      if (!factor.ok()) return false;
      const Vector6 delta = factor.solve(g);
      motion = motion.plus(delta);
      if (delta.template head<3>().norm() < kTurnRad && delta.template tail<3>().norm() < kWayM) break;
    }
    return motion.finite();
  }

  /// Three different points.
  [[nodiscard]] std::array<std::size_t, 3> draw(detail::SplitMix& random) const {
    const std::size_t n = points_.size(), a = random.below(n);
    std::size_t b = random.below(n - 1), c = random.below(n - 2);
    if (b >= a) ++b;
    if (c >= std::min(a, b)) ++c;
    if (c >= std::max(a, b)) ++c;
    return {a, b, c};
  }

  [[nodiscard]] bool hypothesis(const std::array<std::size_t, 3>& sample, Motion& motion) const {
    BasicPointTriple<Scalar> previous, current;
    for (std::size_t i = 0; i < 3; ++i) {
      previous[i] = points_[sample[i]].p_prev_m;
      current[i] = point_at<Scalar>(camera_, points_[sample[i]].current_px);
    }
    const Result<Motion> aligned = align_three_points(previous, current, options_.min_shape);
    if (!aligned) return false;
    motion = *aligned;
    return descend(motion, 2, false, [&](auto visit) {
      for (const std::size_t k : sample) visit(points_[k]);
    });
  }

  void draw_samples() {
    detail::SplitMix random(options_.seed);
    int needed = options_.max_iterations;
    for (int i = 0; i < needed; ++i) {
      ++statistics_.iterations;
      Motion candidate;
      if (!hypothesis(draw(random), candidate)) {
        ++statistics_.degenerate;
        continue;
      }
      if (take_if_better(candidate)) needed = std::min(options_.max_iterations, samples_needed());
    }
  }

  /// log(1 - confidence) / log(1 - w^3), at least one.
  [[nodiscard]] int samples_needed() const {
    const double w = static_cast<double>(statistics_.inliers) / static_cast<double>(points_.size());
    const double miss = 1 - w * w * w;
    if (!(miss > 0)) return 1;
    if (!(miss < 1)) return options_.max_iterations;
    const double samples = std::log(1 - options_.confidence) / std::log(miss);
    return samples < options_.max_iterations ? std::max(1, static_cast<int>(std::ceil(samples))) : options_.max_iterations;
  }

  bool take_if_better(const Motion& candidate) {
    std::size_t inliers = 0;
    const double cost = score(candidate, cost_, inliers);
    if (!(cost < cost_)) return false;
    cost_ = cost, motion_ = candidate, statistics_.inliers = inliers;
    return true;
  }

  /// Refines the best hypothesis, judges it, and reports.
  [[nodiscard]] Status conclude() {
    constexpr int kRounds = 8, kSteps = 10;
    if (!std::isfinite(cost_)) return failure(StatusCode::under_determined, "PnP: no sample determines a motion", statistics_.iterations);
    const double limit = options_.inlier_px * options_.inlier_px;
    for (int round = 0; round < kRounds; ++round) {
      mark_inliers(limit);
      Motion refined = motion_;
      const auto inliers = [&](auto visit) {
        for (const Point& point : points_)
          if (is_inlier_[point.pair]) visit(point);
      };
      if (!descend(refined, kSteps, true, inliers) || !take_if_better(refined)) break;
    }
    mark_inliers(limit);
    statistics_.inlier_share = static_cast<double>(statistics_.inliers) / static_cast<double>(points_.size());
    const double share = std::ceil(options_.min_inlier_share * static_cast<double>(points_.size()));
    const std::size_t needed = std::max(options_.min_inliers, static_cast<std::size_t>(std::max(share, 0.0)));
    if (statistics_.inliers < needed)
      return failure(StatusCode::rejected, "PnP: too few pairs agree on a motion", static_cast<std::int32_t>(statistics_.inliers),
                     static_cast<std::int32_t>(needed));
    return measure_covariance();
  }

  void mark_inliers(double limit) {
    statistics_.inliers = 0;
    for (const Point& point : points_) {
      const bool inlier = distance2(point, motion_) < limit;
      is_inlier_[point.pair] = inlier;
      statistics_.inliers += inlier;
    }
  }

  [[nodiscard]] Status measure_covariance() {
    Matrix6 H = Matrix6::Zero();
    Vector6 g = Vector6::Zero();
    double sum = 0;
    for (const Point& point : points_)
      if (is_inlier_[point.pair]) sum += accumulate(point, motion_, false, H, g);
    const Cholesky factor(H);
    if (!factor.ok()) return failure(StatusCode::under_determined, "PnP: the points that agree do not determine a motion");
    statistics_.rms_px = std::sqrt(sum / static_cast<double>(3 * statistics_.inliers - 6));
    const double sigma_px = std::max(options_.sigma_px, statistics_.rms_px);
    covariance_ = sigma_px * sigma_px * factor.inverse();
    return ok_status();
  }

  Camera camera_;
  PnpOptions options_;
  StaticVector<Point, N> points_;
  StaticVector<bool, N> is_inlier_;
  Motion motion_;
  Matrix6 covariance_{Matrix6::Zero()};
  PnpStatistics statistics_;
  double cost_{std::numeric_limits<double>::infinity()};
};

}  // namespace searvins::vision
