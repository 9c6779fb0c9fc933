// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How far a trajectory without a place in the world (visual-inertial odometry) is from the truth.
///
/// Absolute error. The estimate is moved onto the truth by the rigid motion that makes the squares of the remaining distances least,
/// p_t = R p_e + t, and what remains is the error. With both centred on their means (e, f) and H = sum f e' = U S V',
///
///     pose, 6 degrees of freedom           R = U diag(1, 1, det(U V')) V'                                      [Umeyama 1991, no scale]
///     yaw and position, 4 of them          R = Rz(a),  a = atan2(sum e_x f_y - e_y f_x, sum e_x f_x + e_y f_y)
///     both                                 t = mean p_t - R mean p_e
///
/// An estimator with an accelerometer knows up and scale; only yaw and place are free. The alignment with four degrees of freedom is the
/// one that judges it: six would hide an error of tilt by turning it away.
///
/// A path that is (nearly) a point says nothing about R, and one that is a line leaves the turn about it open. So the attitudes have a say
/// as well, as if each body carried three points an arm of L away:  H + L^2 sum R_t R_e'  in the place of H. On a path of some length that
/// changes nothing; of a body that rests it is the mean of the attitudes.
///
/// Relative error. Over each stretch of the truth of a given length (or time) from i to j,  E = (T_ti^-1 T_tj)^-1 (T_ei^-1 T_ej) is what
/// the estimate adds to the motion: |t_E| over the length, and the angle of R_E. No alignment has a part in it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/math/so3.hpp>

namespace searvins::examples {

/// A body in the world at a time.
struct TimedPose {
  GpsTime time{};
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_wb{Eigen::Matrix3d::Identity()};
};

/// The same moment in the estimate's world and in that of the truth.
struct PosePair {
  TimedPose estimate{}, truth{};
};

/// p_t = R p_e + t.
struct RigidMotion {
  Eigen::Matrix3d R{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d t_m{Eigen::Vector3d::Zero()};

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p_m) const { return R * p_m + t_m; }
  [[nodiscard]] TimedPose operator*(const TimedPose& x) const { return {x.time, R * x.p_w_m + t_m, R * x.R_wb}; }
};

/// What the alignment may choose.
enum class AlignmentFreedom { yaw_and_position, pose };

/// An alignment, and whether the attitudes decided on its rotation because the path is too short to have one.
struct TrajectoryAlignment {
  RigidMotion truth_from_estimate{};
  bool by_attitude{false};
};

/// Root mean square, mean and greatest of some errors.
struct ErrorSummary {
  std::size_t count{0};
  double rmse{0}, mean{0}, max{0};

  void add(double error) {
    sum_ += error, squares_ += error * error, ++count;
    mean = sum_ / static_cast<double>(count), rmse = std::sqrt(squares_ / static_cast<double>(count)), max = std::max(max, error);
  }

 private:
  double sum_{0}, squares_{0};
};

/// What remains after an alignment.
struct AbsoluteError {
  TrajectoryAlignment alignment{};
  std::vector<double> distance_m;                        ///< of each pair
  ErrorSummary position_m{}, tilt_deg{}, heading_deg{};  ///< tilt: angle between the up axes; heading: of the turn about up that is left
};

/// Relative errors over stretches of one length or time.
struct RelativeError {
  double over{0};  ///< metres, or seconds
  ErrorSummary translation_m{};
  ErrorSummary translation_pct{};  ///< of the stretch's way; only stretches that have one
  ErrorSummary rotation_deg{};
};

namespace detail {

/// The rotation next to a matrix.
[[nodiscard]] inline Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * Eigen::Vector3d{1, 1, sign}.asDiagonal() * svd.matrixV().transpose();
}

[[nodiscard]] inline Eigen::Matrix3d turn_about_up(double angle_rad) { return so3::exp(Eigen::Vector3d{0, 0, angle_rad}); }

[[nodiscard]] inline double degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// (a^-1 b), the motion from one pose to another in the axes of the first.
[[nodiscard]] inline RigidMotion motion_between(const TimedPose& a, const TimedPose& b) {
  return {a.R_wb.transpose() * b.R_wb, a.R_wb.transpose() * (b.p_w_m - a.p_w_m)};
}

inline void add_relative(const PosePair& a, const PosePair& b, double way_m, RelativeError& out) {
  const RigidMotion truth = motion_between(a.truth, b.truth), estimate = motion_between(a.estimate, b.estimate);
  const double error_m = (truth.R.transpose() * (estimate.t_m - truth.t_m)).norm();
  out.translation_m.add(error_m);
  if (way_m > 0) out.translation_pct.add(100 * error_m / way_m);
  out.rotation_deg.add(degrees(so3::log(Eigen::Matrix3d{truth.R.transpose() * estimate.R}).norm()));
}

}  // namespace detail

/// The truth at the time of each pose of the estimate, between its two neighbours; poses without neighbours, or between two that are more
/// than max_gap_s apart, are left out. Both rise in time.
[[nodiscard]] inline std::vector<PosePair> paired(const std::vector<TimedPose>& estimate, const std::vector<TimedPose>& truth,
                                                  double max_gap_s = 0.25) {
  std::vector<PosePair> pairs;
  for (const TimedPose& x : estimate) {
    const auto after = std::lower_bound(truth.begin(), truth.end(), x.time, [](const TimedPose& p, GpsTime t) { return p.time < t; });
    if (after == truth.end()) break;
    if (after->time == x.time) {
      pairs.push_back({x, *after});
      continue;
    }
    if (after == truth.begin()) continue;
    const TimedPose& before = *(after - 1);
    const double span_s = seconds_between(before.time, after->time);
    if (span_s > max_gap_s) continue;
    const double share = seconds_between(before.time, x.time) / span_s;
    const Eigen::Vector3d turn = so3::log(Eigen::Matrix3d{before.R_wb.transpose() * after->R_wb});
    pairs.push_back(
        {x, {x.time, before.p_w_m + share * (after->p_w_m - before.p_w_m), before.R_wb * so3::exp(Eigen::Vector3d{share * turn})}});
  }
  return pairs;
}

/// Length of a path.
[[nodiscard]] inline double way_length_m(const std::vector<TimedPose>& path) {
  double sum_m = 0;
  for (std::size_t i = 1; i < path.size(); ++i) sum_m += (path[i].p_w_m - path[i - 1].p_w_m).norm();
  return sum_m;
}

/// See the file comment. `arm_m`: L. Errors: no_data without pairs.
[[nodiscard]] inline Result<TrajectoryAlignment> align(const std::vector<PosePair>& pairs, AlignmentFreedom freedom, double arm_m = 0.1) {
  if (pairs.empty()) return failure(StatusCode::no_data, "no pose of the estimate has a truth of its time");
  const double n = static_cast<double>(pairs.size());
  Eigen::Vector3d mean_e = Eigen::Vector3d::Zero(), mean_t = Eigen::Vector3d::Zero();
  for (const PosePair& p : pairs) mean_e += p.estimate.p_w_m / n, mean_t += p.truth.p_w_m / n;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero(), spread = Eigen::Matrix3d::Zero();
  for (const PosePair& p : pairs) {
    const Eigen::Vector3d e = p.estimate.p_w_m - mean_e, f = p.truth.p_w_m - mean_t;
    H += (f * e.transpose() + arm_m * arm_m * p.truth.R_wb * p.estimate.R_wb.transpose()) / n;
    spread += f * f.transpose() / n;
  }
  TrajectoryAlignment out;
  Eigen::Matrix3d& R = out.truth_from_estimate.R;
  if (freedom == AlignmentFreedom::pose) {
    out.by_attitude = Eigen::JacobiSVD<Eigen::Matrix3d>(spread).singularValues()[1] < arm_m * arm_m;
    R = detail::nearest_rotation(H);
  } else {
    out.by_attitude = spread(0, 0) + spread(1, 1) < arm_m * arm_m;
    R = detail::turn_about_up(std::atan2(H(1, 0) - H(0, 1), H(0, 0) + H(1, 1)));
  }
  out.truth_from_estimate.t_m = mean_t - R * mean_e;
  return out;
}

/// What remains after the alignment. Errors: those of align().
[[nodiscard]] inline Result<AbsoluteError> absolute_error(const std::vector<PosePair>& pairs, AlignmentFreedom freedom) {
  const Result<TrajectoryAlignment> alignment = align(pairs, freedom);
  if (!alignment.ok()) return alignment.status();
  AbsoluteError out;
  out.alignment = *alignment;
  for (const PosePair& p : pairs) {
    const TimedPose x = alignment->truth_from_estimate * p.estimate;
    out.distance_m.push_back((x.p_w_m - p.truth.p_w_m).norm());
    out.position_m.add(out.distance_m.back());
    const Eigen::Matrix3d turn = x.R_wb * p.truth.R_wb.transpose();  // in the axes of the world
    out.tilt_deg.add(detail::degrees(std::atan2(std::hypot(turn(0, 2), turn(1, 2)), turn(2, 2))));
    out.heading_deg.add(std::abs(detail::degrees(std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1)))));
  }
  return out;
}

/// Over stretches of `length_m` of the truth's way; each begins one pose after the one before.
[[nodiscard]] inline RelativeError relative_error_over_distance(const std::vector<PosePair>& pairs, double length_m) {
  RelativeError out;
  out.over = length_m;
  std::vector<double> way_m(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) way_m[i] = way_m[i - 1] + (pairs[i].truth.p_w_m - pairs[i - 1].truth.p_w_m).norm();
  for (std::size_t i = 0, j = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && way_m[j] - way_m[i] < length_m) ++j;
    if (j == pairs.size()) break;
    if (i > 0 && way_m[i] == way_m[i - 1]) continue;  // a rest is one beginning, not hundreds
    detail::add_relative(pairs[i], pairs[j], way_m[j] - way_m[i], out);
  }
  return out;
}

/// Over stretches of `duration_s`.
[[nodiscard]] inline RelativeError relative_error_over_time(const std::vector<PosePair>& pairs, double duration_s) {
  RelativeError out;
  out.over = duration_s;
  for (std::size_t i = 0, j = 0; i < pairs.size(); ++i) {
    const auto since_s = [&](std::size_t k) { return seconds_between(pairs[i].truth.time, pairs[k].truth.time); };
    while (j < pairs.size() && since_s(j) < duration_s - 1e-9) ++j;
    if (j == pairs.size()) break;
    if (since_s(j) > 1.5 * duration_s) continue;  // across a gap
    double way_m = 0;
    for (std::size_t k = i + 1; k <= j; ++k) way_m += (pairs[k].truth.p_w_m - pairs[k - 1].truth.p_w_m).norm();
    detail::add_relative(pairs[i], pairs[j], way_m, out);
  }
  return out;
}

}  // namespace searvins::examples
