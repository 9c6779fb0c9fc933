// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Centre lines of lanes, and which of them a vehicle is on: a lateral position from a map [paper, future work].
///
/// A line is a chain of points. At a point p with up direction u, its segment from a to b has the horizontal direction t and the normal n to the right of
/// it; p is off to the right by d:
///
///     t = (b - a) less its part along u, unit        n = t x u        d = n' (p - a)        0 <= t' (p - a) <= |b - a|
///
/// A map says nothing rather than something wrong. Nothing is said
///
///     slow        below a speed: the direction of travel is not known
///     none near   no segment beside p whose direction is that of the velocity (or against it, where lines are driven both ways)
///     gated       |d| > k sqrt(n' P n + sigma^2) for the nearest: p is not on a mapped lane, or p is wrong
///     ambiguous   a second line within the gate: on which lane the vehicle is cannot be told
///     bent        the line ends or leaves its straight by more than a bound within k sqrt(t' P t) along it: who does not know how far round the bend
///                 p is does not know how far across the lane it is either
///
/// sigma is how far drivers and map are from the middle of a lane. That offset lasts, so a user should not ask at every state.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::imu {

/// A point of a centre line, ECEF metres. Consecutive points of the same line are joined.
struct CentrelinePoint {
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};
  std::uint32_t line{0};
};

/// All lines of a map, in the memory of the caller.
using Centrelines = std::span<const CentrelinePoint>;

/// Settings of a match.
struct CentrelineOptions {
  double sigma_m{0.5};                ///< of the antenna's place across the lane about its centre line
  double gate_sigmas{3};              ///< k
  double max_direction_rad{0.35};     ///< between velocity and line
  bool both_ways{true};               ///< false: lines are driven in the order of their points only
  double min_speed_mps{2};
  double max_bend_m{0.5};             ///< how far the line may leave its straight over the uncertainty along it
};

/// What a match came to.
enum class CentrelineVerdict : std::uint8_t { matched, slow, none_near, gated, ambiguous, bent };

/// A place on a line beside the vehicle.
struct CentrelineMatch {
  CentrelineVerdict verdict{CentrelineVerdict::none_near};
  Eigen::Vector3d point_e_m{Eigen::Vector3d::Zero()};   ///< on the line
  Eigen::Vector3d right_e{1, 0, 0};                     ///< n: horizontal, to the right of the line's own direction
  double offset_m{0};                                   ///< d: the vehicle is so far to the right of the line
};

namespace detail {

/// The segment from a to b beside p, or verdict none_near.
template <class Scalar>
[[nodiscard]] inline CentrelineMatch beside(const math::Vector3<Scalar>& a_e_m, const math::Vector3<Scalar>& b_e_m,
                                            const math::Vector3<Scalar>& p_e_m, const math::Vector3<Scalar>& up_e,
                                            const math::Vector3<Scalar>& direction_e, const CentrelineOptions& options) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  CentrelineMatch m;
  const Vector3 ab_m = b_e_m - a_e_m, along_m = ab_m - up_e.dot(ab_m) * up_e;
  const double length_m = along_m.norm();
  if (!(length_m > 1e-3)) return m;
  const Vector3 t = along_m / length_m;
  const double s_m = t.dot(p_e_m - a_e_m);
  const double cosine = options.both_ways ? std::abs(t.dot(direction_e)) : t.dot(direction_e);
  if (s_m < 0 || s_m > length_m || cosine < std::cos(options.max_direction_rad)) return m;
  m.verdict = CentrelineVerdict::matched;
  m.right_e = t.cross(up_e);
  m.offset_m = m.right_e.dot(p_e_m - a_e_m);
  m.point_e_m = a_e_m + s_m / length_m * ab_m;
  return m;
}

/// Whether the line of the segment that ends at point `end` stays within max_bend_m of its straight for reach_m on either side of the match.
template <class Scalar>
[[nodiscard]] inline bool is_straight(Centrelines lines, std::size_t end, const CentrelineMatch& m, double reach_m, double max_bend_m) {
  const std::uint32_t line = lines[end].line;
  const auto stays = [&](std::size_t from, int step) {
    double way_m = 0;
    Eigen::Matrix<Scalar, 3, 1> last_e_m = m.point_e_m;
    for (std::size_t i = from; i < lines.size() && lines[i].line == line; i += static_cast<std::size_t>(step)) {  // below zero it wraps to beyond the end
      const double part_m = (lines[i].position_e_m - last_e_m).norm(), taken = way_m + part_m > reach_m ? (reach_m - way_m) / part_m : 1.0;
      if (std::abs(m.right_e.dot(last_e_m + taken * (lines[i].position_e_m - last_e_m) - m.point_e_m)) > max_bend_m) return false;
      if (taken < 1) return true;
      way_m += part_m, last_e_m = lines[i].position_e_m;
    }
    return way_m >= reach_m;
  };
  return stays(end, 1) && stays(end - 1, -1);
}

}  // namespace detail

/// The line that a vehicle at p_e_m with velocity v_e_mps is on. `covariance_e_m2`: of p_e_m. One pass over the map.
template <class Scalar = double>
[[nodiscard]] inline CentrelineMatch match_centreline(Centrelines lines, const math::Vector3<Scalar>& p_e_m, const math::Vector3<Scalar>& v_e_mps,
                                                      const math::Matrix3<Scalar>& covariance_e_m2, const CentrelineOptions& options = {}) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  CentrelineMatch best;
  const Vector3 up_e = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(p_e_m)).col(2);
  const Vector3 level_mps = v_e_mps - up_e.dot(v_e_mps) * up_e;
  best.verdict = CentrelineVerdict::slow;
  if (!(level_mps.norm() >= options.min_speed_mps)) return best;
  best.verdict = CentrelineVerdict::none_near;
  const Vector3 direction_e = level_mps.normalized();
  const auto gate_m = [&](const CentrelineMatch& m) {
    const double variance_m2 = m.right_e.dot(covariance_e_m2 * m.right_e) + options.sigma_m * options.sigma_m;
    return options.gate_sigmas * std::sqrt(variance_m2);
  };
  std::uint32_t line = 0;
  std::size_t end = 0;
  double second_m = std::numeric_limits<double>::infinity();  // beyond its gate: how near the nearest segment of another line is
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (lines[i].line != lines[i - 1].line) continue;
    const CentrelineMatch m = detail::beside<Scalar>(lines[i - 1].position_e_m, lines[i].position_e_m, p_e_m, up_e, direction_e, options);
    if (m.verdict != CentrelineVerdict::matched) continue;
    const bool is_nearer = best.verdict != CentrelineVerdict::matched || std::abs(m.offset_m) < std::abs(best.offset_m);
    const CentrelineMatch& other = is_nearer ? best : m;
    const std::uint32_t other_line = is_nearer ? line : lines[i].line;
    if (other.verdict == CentrelineVerdict::matched && other_line != (is_nearer ? lines[i].line : line))
      second_m = std::min(second_m, std::abs(other.offset_m) - gate_m(other));
    if (is_nearer) best = m, line = lines[i].line, end = i;
  }
  if (best.verdict != CentrelineVerdict::matched) return best;
  if (std::abs(best.offset_m) > gate_m(best))
    best.verdict = CentrelineVerdict::gated;
  else if (second_m <= 0)
    best.verdict = CentrelineVerdict::ambiguous;
  const Vector3 along_e = up_e.cross(best.right_e);
  const double reach_m = options.gate_sigmas * std::sqrt(along_e.dot(covariance_e_m2 * along_e));
  if (best.verdict == CentrelineVerdict::matched && !detail::is_straight<Scalar>(lines, end, best, reach_m, options.max_bend_m))
    best.verdict = CentrelineVerdict::bent;
  return best;
}

}  // namespace searvins::imu
