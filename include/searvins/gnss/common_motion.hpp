// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Do the phases of all satellites move as one antenna and one clock would make them? Who does not, has slipped.
///
/// With the change of the range at the predicted positions taken out, the change of phase i from epoch to epoch is
///
///     y_i = u_i' d + c + noise        u_i = d range_i / d p (unit, 3), d: error of the predicted displacement, c: change of the clocks
///
/// four unknowns for all satellites. On rover-base single differences this is a triple difference: of receivers, of satellites (through c),
/// of epochs. It needs no second frequency and no Doppler, and sees slips that leave the geometry-free combination in place.
///
/// In a street many satellites are wrong at once (reflected, slipped) and some of them agree for a while, which drags least absolute values
/// along. So [d; c] is found by consensus: sets of four satellites, spread evenly over all sets, are solved exactly, and the solution with
/// the least truncated cost sum min(r^2 / threshold^2, 1) starts a least squares over whoever agrees.
///
/// The residual of a satellite is divided by 1 - leverage (its own vote), so that one which the rest cannot predict is not declared sound
/// by itself.
///
/// Inertial readings tell d beforehand, d ~ N(m, P). Then two satellites are a consensus: d = m and the c of any one satellite are a start, and the
/// least squares over whoever agrees has s^2 P^-1 in its normal matrix and s^2 P^-1 m on its right (s: sigma of a change, a seventh of its threshold).
/// The residual free of the satellite's own vote then has the variance s^2 / (1 - leverage); where three of its sigmas are more than the threshold they
/// take its place, so that the wavelength decides how vague a prediction may be. It is asked where the satellites alone are too few or disagree.
///
/// For fewer satellites: the common change, c alone; i must agree with at least half of the signals of other satellites.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/small_cholesky.hpp>

namespace searvins::gnss {

/// The change of one phase since the previous epoch.
struct PhaseChange {
  SatelliteId satellite{};
  Eigen::Vector3d direction_e{Eigen::Vector3d::Zero()};  ///< d range / d p, unit, satellite to receiver
  double change_m{0};                                    ///< predicted change of range taken out
  double threshold_m{0};                                 ///< a larger residual is a slip
  double wavelength_m{0};                                ///< a threshold above 0.45 of it cannot tell one cycle: then nothing passes
};

/// What the common-motion test found. `valid` false: no consensus, every result is `unavailable`.
struct MotionFit {
  bool valid{false};
  Eigen::Vector3d displacement_e_m{Eigen::Vector3d::Zero()};  ///< to be added to the predicted displacement, ECEF
  double clock_m{0};                                          ///< change of the clock difference
  int satellites{0};                                          ///< that agree
  double rms_m{0};                                            ///< of what agrees
};

/// What is known of the error of the predicted displacement before any phase is looked at.
struct MotionPrior {
  Eigen::Vector3d mean_e_m{Eigen::Vector3d::Zero()};             ///< m
  Eigen::Matrix3d covariance_e_m2{Eigen::Matrix3d::Identity()};  ///< P, positive definite
};

namespace detail {

/// [d; c], or the row [u' 1] of a change.
template <class Scalar>
using Row4 = Eigen::Matrix<Scalar, 4, 1>;

/// Inverse of a symmetric positive definite 4x4 by Cholesky: A = L L', A^-1 = L^-T L^-1. False when a pivot is below 1e-6 of the diagonal.
template <class Scalar = double>
[[nodiscard]] inline bool invert_spd4(const math::Matrix<Scalar, 4, 4>& a, math::Matrix<Scalar, 4, 4>& inverse) {
  using Matrix4 = Eigen::Matrix<Scalar, 4, 4>;
  Matrix4 l = Matrix4::Zero(), m = Matrix4::Zero();
  for (int j = 0; j < 4; ++j) {
    Scalar d = a(j, j);
    for (int k = 0; k < j; ++k) d -= l(j, k) * l(j, k);
    if (!(d > 1e-6 * a(j, j))) return false;
    l(j, j) = std::sqrt(d);
    for (int i = j + 1; i < 4; ++i) {
      Scalar s = a(i, j);
      for (int k = 0; k < j; ++k) s -= l(i, k) * l(j, k);
      l(i, j) = s / l(j, j);
    }
  }
  for (int j = 0; j < 4; ++j) {  // m = L^-1, column by column
    m(j, j) = 1 / l(j, j);
    for (int i = j + 1; i < 4; ++i) {
      Scalar s = 0;
      for (int k = j; k < i; ++k) s -= l(i, k) * m(k, j);
      m(i, j) = s / l(i, i);
    }
  }
  inverse.noalias() = m.transpose() * m;
  return true;
}

/// Normal equations that grow row by row.
template <class Scalar>
struct MotionEquations {
  using Row = Row4<Scalar>;
  using Normal = Eigen::Matrix<Scalar, 4, 4>;
  Normal normal{Normal::Zero()};
  Row right{Row::Zero()};

  void add(const PhaseChange& c) {
    const Row a{c.direction_e.x(), c.direction_e.y(), c.direction_e.z(), 1.0};
    normal += a * a.transpose();
    right += c.change_m * a;
  }
  [[nodiscard]] bool solve(Row& x, Normal& normal_inverse) const {
    if (!invert_spd4<Scalar>(normal, normal_inverse)) return false;
    x = normal_inverse * right;
    return true;
  }
};

template <class Scalar>
[[nodiscard]] inline double motion_residual_m(const PhaseChange& c, const Row4<Scalar>& x) {
  return c.change_m - c.direction_e.dot(x.template head<3>()) - x(3);
}

/// The four members of the set of rank `rank` among all sets of four of 0..n-1, in lexicographic order.
[[nodiscard]] constexpr std::array<std::size_t, 4> set_of_four(std::size_t n, std::size_t rank) {
  const auto choose = [](std::size_t m, std::size_t k) {
    std::size_t c = 1;
    for (std::size_t i = 1; i <= k; ++i) c = m + 1 > i ? c * (m + 1 - i) / i : 0;
    return c;
  };
  std::array<std::size_t, 4> set{};
  std::size_t next = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t with = choose(n - next - 1, 3 - k); rank >= with; with = choose(n - next - 1, 3 - k)) rank -= with, ++next;
    set[k] = next++;
  }
  return set;
}

/// Verdict on a residual that is free of the signal's own vote, its threshold at least `least_m`.
[[nodiscard]] inline CheckResult verdict(double residual_m, const PhaseChange& c, double least_m = 0) {
  const double threshold_m = std::max(c.threshold_m, least_m);
  if (!(std::abs(residual_m) < threshold_m)) return CheckResult::failed;
  return threshold_m <= 0.45 * c.wavelength_m ? CheckResult::passed : CheckResult::unavailable;
}

/// sum of min(r^2 / threshold^2, 1) over the changes at x = [d; c]; the sum ends early once it has reached `enough`.
template <std::size_t N, class Scalar>
[[nodiscard]] double truncated_cost(const StaticVector<PhaseChange, N>& changes, const Row4<Scalar>& x, double enough) {
  double cost = 0;
  for (std::size_t i = 0; i < changes.size() && cost < enough; ++i) {
    const double z = motion_residual_m(changes[i], x) / changes[i].threshold_m;
    cost += std::min(z * z, 1.0);
  }
  return cost;
}

/// Best [d; c] among at most 128 sets of four satellites; `first[k]`: first change of satellite k. False when no set is solvable.
template <std::size_t N, class Scalar>
[[nodiscard]] bool motion_by_consensus(const StaticVector<PhaseChange, N>& changes, const StaticVector<std::uint16_t, N>& first,
                                       Row4<Scalar>& best) {
  constexpr std::size_t most_sets = 128;
  const std::size_t n = first.size(), sets = n * (n - 1) * (n - 2) * (n - 3) / 24;
  const std::size_t tries = std::min(sets, most_sets);
  // Steps of the golden ratio spread the tried sets evenly over all; where all are tried the step is 1.
  const std::size_t step = tries == sets ? 1 : static_cast<std::size_t>(0.6180339887 * static_cast<double>(sets));
  double least = static_cast<double>(changes.size()) + 1;
  for (std::size_t t = 0, rank = 0; t < tries; ++t, rank = (rank + step) % sets) {
    MotionEquations<Scalar> four;
    for (const std::size_t k : set_of_four(n, rank)) four.add(changes[first[k]]);
    Row4<Scalar> x;
    Eigen::Matrix<Scalar, 4, 4> unused;
    if (!four.solve(x, unused)) continue;
    const double cost = truncated_cost(changes, x, least);
    if (cost < least) least = cost, best = x;
  }
  return least <= static_cast<double>(changes.size());
}

/// Where each satellite begins in `changes`, which are sorted by satellite.
template <std::size_t N>
void satellites_of(const StaticVector<PhaseChange, N>& changes, StaticVector<std::uint16_t, N>& first) {
  for (std::size_t i = 0; i < changes.size(); ++i)
    if (i == 0 || changes[i].satellite != changes[i - 1].satellite) first.push_back(static_cast<std::uint16_t>(i));
}

/// Least squares from x over what agrees, until the set stays; then the verdicts. `known`: equations that take part from the beginning (a prior). At least
/// min_satellites, and at least 60 % of all, must agree. s_m: sigma of a change where a prior takes part, else 0.
template <std::size_t N, class Scalar>
MotionFit fit_and_judge(const StaticVector<PhaseChange, N>& changes, const StaticVector<std::uint16_t, N>& first, Row4<Scalar> x,
                        const MotionEquations<Scalar>& known, int min_satellites, double s_m, StaticVector<CheckResult, N>& results) {
  constexpr double least_redundancy = 0.2;  // 1 - leverage: below it the others do not predict the satellite
  MotionFit fit;
  StaticVector<std::uint8_t, N> votes;
  votes.resize(changes.size());
  Eigen::Matrix<Scalar, 4, 4> normal_inverse = Eigen::Matrix<Scalar, 4, 4>::Zero();
  for (int iteration = 0; iteration < 8; ++iteration) {
    MotionEquations<Scalar> agreeing = known;
    bool changed = iteration == 0;
    for (std::size_t i = 0; i < changes.size(); ++i) {
      const std::uint8_t vote = std::abs(motion_residual_m(changes[i], x)) < changes[i].threshold_m ? 1 : 0;
      changed = changed || vote != votes[i];
      votes[i] = vote;
      if (vote) agreeing.add(changes[i]);
    }
    if (!changed) break;
    if (!agreeing.solve(x, normal_inverse)) return fit;
  }
  for (std::size_t k = 0; k < first.size(); ++k) {
    const std::size_t end = k + 1 < first.size() ? first[k + 1] : changes.size();
    bool any = false;
    for (std::size_t i = first[k]; i < end; ++i) any = any || votes[i] != 0;
    fit.satellites += any ? 1 : 0;
  }
  if (fit.satellites < min_satellites || 10 * fit.satellites < 6 * static_cast<int>(first.size())) return fit;

  double sum = 0, count = 0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    const std::size_t begin = first[k], end = k + 1 < first.size() ? first[k + 1] : changes.size();
    double voters = 0;
    for (std::size_t i = begin; i < end; ++i) voters += votes[i];
    const Row4<Scalar> a{changes[begin].direction_e.x(), changes[begin].direction_e.y(), changes[begin].direction_e.z(), 1.0};
    const double redundancy = 1 - voters * a.dot(normal_inverse * a);
    for (std::size_t i = begin; i < end; ++i) {
      const double r = motion_residual_m(changes[i], x);
      if (votes[i]) sum += r * r, count += 1;
      if (redundancy > least_redundancy) results[i] = verdict(r / redundancy, changes[i], 3 * s_m / std::sqrt(redundancy));
    }
  }
  fit.valid = true;
  fit.displacement_e_m = x.template head<3>();
  fit.clock_m = x(3);
  fit.rms_m = std::sqrt(sum / count);
  return fit;
}

/// The equations of a prior, in units of a change's sigma s_m; `inverse`: of its covariance.
template <class Scalar>
[[nodiscard]] inline MotionEquations<Scalar> prior_equations(const MotionPrior& prior, const math::Matrix3<Scalar>& inverse, double s_m) {
  MotionEquations<Scalar> known;
  const Eigen::Matrix<Scalar, 3, 3> information = s_m * s_m * inverse;
  known.normal.template topLeftCorner<3, 3>() = information;
  known.right.template head<3>() = information * prior.mean_e_m;
  return known;
}

/// Best [d; c] among those that begin at the prior and the clock of one satellite; false when none is solvable.
template <std::size_t N, class Scalar>
[[nodiscard]] bool motion_by_prior(const StaticVector<PhaseChange, N>& changes, const StaticVector<std::uint16_t, N>& first,
                                   const MotionPrior& prior, const MotionEquations<Scalar>& known, Row4<Scalar>& best) {
  double least = static_cast<double>(changes.size()) + 1;
  for (const std::uint16_t k : first) {
    MotionEquations<Scalar> near = known;
    for (const PhaseChange& c : changes) {  // within the threshold and three sigmas of what the prior leaves open between the two
      const Eigen::Matrix<Scalar, 3, 1> between = c.direction_e - changes[k].direction_e;
      const double off_m = c.change_m - changes[k].change_m - between.dot(prior.mean_e_m);
      if (std::abs(off_m) < c.threshold_m + 3 * std::sqrt(between.dot(prior.covariance_e_m2 * between))) near.add(c);
    }
    Row4<Scalar> x;
    Eigen::Matrix<Scalar, 4, 4> unused;
    if (!near.solve(x, unused)) continue;
    const double cost = truncated_cost(changes, x, least);
    if (cost < least) least = cost, best = x;
  }
  return least <= static_cast<double>(changes.size());
}

}  // namespace detail

/// The test of common motion. `changes` sorted by satellite; `results` gets one outcome each. At least five satellites, and at least 60 %
/// of all, must agree, else nothing is said.
template <std::size_t N>
MotionFit common_motion_check(const StaticVector<PhaseChange, N>& changes, StaticVector<CheckResult, N>& results) {
  using Scalar = math::DeferredFor<double, N>;
  constexpr int min_satellites = 5;
  results.clear();
  results.resize(changes.size());
  StaticVector<std::uint16_t, N> first;
  detail::satellites_of(changes, first);
  detail::Row4<Scalar> x;
  if (first.size() < min_satellites || !detail::motion_by_consensus(changes, first, x)) return {};
  return detail::fit_and_judge(changes, first, x, {}, min_satellites, 0, results);
}

/// The same where the motion is predicted: at least two satellites, and 60 % of all, must agree. Nothing is said where the prior is not positive definite.
template <std::size_t N>
MotionFit predicted_motion_check(const StaticVector<PhaseChange, N>& changes, const MotionPrior& prior,
                                 StaticVector<CheckResult, N>& results) {
  using Scalar = math::DeferredFor<double, N>;
  constexpr int min_satellites = 2;
  results.clear();
  results.resize(changes.size());
  StaticVector<std::uint16_t, N> first;
  detail::satellites_of(changes, first);
  const math::SmallCholesky<3> covariance(prior.covariance_e_m2);
  if (first.size() < min_satellites || !covariance.ok()) return {};
  const double s_m = changes[0].threshold_m / 7;
  const detail::MotionEquations<Scalar> known = detail::prior_equations<Scalar>(prior, covariance.inverse(), s_m);
  detail::Row4<Scalar> x;
  if (!detail::motion_by_prior(changes, first, prior, known, x)) return {};
  return detail::fit_and_judge(changes, first, x, known, min_satellites, s_m, results);
}

/// The test of common change, for those that have no outcome yet (`unavailable`): a signal passes when it agrees, within the larger
/// threshold of the two, with at least half of the signals of other satellites; with no other satellite nothing is said.
template <std::size_t N>
void common_change_check(const StaticVector<PhaseChange, N>& changes, StaticVector<CheckResult, N>& results) {
  results.resize(changes.size());
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (results[i] != CheckResult::unavailable) continue;
    int others = 0, agreeing = 0;
    for (const PhaseChange& other : changes) {
      if (other.satellite == changes[i].satellite) continue;
      ++others;
      if (std::abs(changes[i].change_m - other.change_m) < std::max(changes[i].threshold_m, other.threshold_m)) ++agreeing;
    }
    if (others > 0) results[i] = 2 * agreeing >= others ? detail::verdict(0, changes[i]) : CheckResult::failed;
  }
}

/// Raises every threshold to three standard deviations of the changes about their median (1.4826 times the median deviation): a test
/// against noise that nobody declared cannot fail everyone.
template <std::size_t N>
void raise_thresholds_to_spread(StaticVector<PhaseChange, N>& changes) {
  StaticVector<double, N> values;
  for (const PhaseChange& c : changes) values.push_back(c.change_m);
  const auto median = [&]() {
    const auto middle = values.begin() + values.size() / 2;
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  if (values.empty()) return;
  const double centre_m = median();
  for (double& v : values) v = std::abs(v - centre_m);
  const double spread_m = 3 * 1.4826 * median();
  for (PhaseChange& c : changes) c.threshold_m = std::max(c.threshold_m, spread_m);
}

}  // namespace searvins::gnss
