// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Robust single-point positioning: where one receiver is, from the codes of one epoch, although many of them may be wrong.
///
/// Unknowns x = (position in ECEF; c times the receiver clock offset for each constellation; delay of the receiver's other carriers against
/// the L1 family), metres. One code of satellite s says
///
///     code + c (clock_s - group delay)  =  |p - p_s| + Sagnac + troposphere + ionosphere + clock [+ delay of other carriers] + noise
///
/// The clocks of the constellations differ by what the system times and the receiver's channels differ: metres, not kilometres. That is
/// information: clock_c = T + d_c with T free and d_c ~ N(0, sigma_c^2). With D = diag(1 / sigma_c^2), T eliminated, it is the form of
/// D - D 1 1' D / (1' D 1). In a street where three satellites of each constellation are seen it doubles the redundancy. The delay
/// between carriers (L2, L5, E5, E6, B2, B3 against L1, E1, B1) is nearly the same for all constellations, up to 10 m: one more unknown.
///
/// Reflected signals are late by metres to hundreds of metres, and often they are the majority. Hence, in order,
///
///     1. plain Gauss-Newton from anywhere (Earth's centre by default), atmosphere and mask off: converges since ranges are nearly linear,
///     2. graduated Geman-McClure weights (c^2 / (c^2 + z^2))^2 [Yang et al., RA-L 2020], c shrinking from the largest residual to 2 sigma:
///        no outlier decides early,
///     3. by several ways (all satellites, each constellation left out, the earliest codes first): the least robust cost wins,
///     4. hard exclusion beyond 3 sigma, then a chi-square test of the rest, the largest normalised residual leaving one by one.
///
/// In 2..4 a late code (positive residual) is suspected earlier than an early one: a reflection can only lengthen the way.
/// A prior (a prediction) takes part as Gaussian information in 2..4. The position is that at reception: epoch tag minus clock offset.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/gnss/single_point_problem.hpp>
#include <searvins/gnss/single_point_solution.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/quantiles.hpp>
#include <searvins/math/small_cholesky.hpp>

namespace searvins::gnss {
namespace detail {

/// Lowest robust cost of descents from x0: as it is, without each constellation, and hugging the earliest codes; x0 becomes that solution.
template <class Scalar>
[[nodiscard]] inline double best_descent(const BasicSinglePointProblem<Scalar>& problem, BasicSinglePointVector<Scalar>& x0) {
  BasicSinglePointVector<Scalar> best = x0;
  double best_cost = std::numeric_limits<double>::infinity();
  const auto attempt = [&](std::size_t without, double lateness) {
    BasicSinglePointVector<Scalar> x = x0;
    const double cost = problem.descend(x, without, lateness);
    if (cost < best_cost) best = x, best_cost = cost;
  };
  for (std::size_t c = 0; c <= kConstellations; ++c) attempt(c, 1);
  for (const double lateness : {3.0, 10.0}) attempt(kConstellations, lateness);
  x0 = best;
  return best_cost;
}

/// Removes outliers from x until the chi-square test passes or nothing can be checked any more; x and covariance are of what is left.
template <class Scalar>
[[nodiscard]] inline Status exclude_outliers(BasicSinglePointProblem<Scalar>& problem, const SinglePointOptions& options,
                                             BasicSinglePointVector<Scalar>& x, BasicSinglePointSolution<Scalar>& out) {
  for (int round = 0; round < 2; ++round) {
    problem.select(x);
    for (std::size_t i = 0; i <= kMaxCodeRows; ++i) {
      if (problem.redundancy() < 0)
        return failure(StatusCode::too_few, "single point: too few codes agree", problem.candidates(),
                       problem.candidates() - problem.redundancy());
      if (!problem.refine(x, &out.covariance))
        return failure(StatusCode::under_determined, "single point: the satellites that agree do not determine a position");
      out.redundancy = problem.redundancy(), out.chi_square = problem.chi_square(x);
      const Result<double> bound = math::chi_square_threshold(options.false_alarm, std::max(out.redundancy, 1));
      if (!bound) return bound.status();
      out.consistent = out.redundancy > 0 && out.chi_square <= *bound;
      if (out.consistent || out.redundancy <= 1) break;
      CodeRow* worst = problem.least_plausible(x, out.covariance);
      if (!worst) break;
      worst->fate = CodeFate::outlier;
    }
  }
  return ok_status();
}

/// sqrt trace of (A'A)^-1 with one clock for all; infinite when singular.
template <class Scalar>
[[nodiscard]] inline double dilution(const BasicSinglePointSolution<Scalar>& s) {
  using Vector4 = Eigen::Matrix<Scalar, 4, 1>;
  using Matrix4 = Eigen::Matrix<Scalar, 4, 4>;
  Matrix4 N = Matrix4::Zero();
  for (const CodeRow& r : s.rows) {
    if (r.fate != CodeFate::used) continue;
    Vector4 a;
    a << BasicSinglePointProblem<Scalar>::direction(s.state, r).template head<3>(), 1.0;
    N.noalias() += a * a.transpose();
  }
  const math::SmallCholesky<4, Scalar> factor(N);
  return factor.ok() ? std::sqrt(factor.inverse().trace()) : std::numeric_limits<double>::infinity();
}

template <class Scalar>
inline void report(const BasicSinglePointProblem<Scalar>& problem, GpsTime tag, const BasicSinglePointVector<Scalar>& x,
                   BasicSinglePointSolution<Scalar>& out) {
  out.state = x;
  out.position_e_m = x.template head<3>();
  double clock_sum_m = 0;
  for (CodeRow& r : out.rows) {
    if (r.fate == CodeFate::used || r.fate == CodeFate::outlier || r.fate == CodeFate::low) r.residual_m = problem.residual_m(x, r);
    out.excluded += r.fate == CodeFate::outlier;
    if (r.fate != CodeFate::used) continue;
    ++out.used;
    clock_sum_m += x[BasicSinglePointProblem<Scalar>::clock_index(r)];
    out.constellation_used[static_cast<std::size_t>(r.satellite.constellation)] = true;
  }
  for (std::size_t c = 0; c < kConstellations; ++c) out.clock_s[c] = x[3 + static_cast<int>(c)] / kSpeedOfLightMps;
  if (out.used > 0) out.time = tag.plus_seconds(-clock_sum_m / out.used / kSpeedOfLightMps);
  if (!out.consistent && out.redundancy > 0) out.covariance *= std::max(1.0, out.chi_square / out.redundancy);
  out.gdop = dilution(out);
}

/// The middle one of the residuals of a constellation (nullptr: of all) at x; 0 without rows.
template <class Scalar>
[[nodiscard]] inline double median_residual_m(const BasicSinglePointProblem<Scalar>& problem, const BasicSinglePointSolution<Scalar>& s,
                                              const BasicSinglePointVector<Scalar>& x, const Constellation* of) {
  StaticVector<double, kMaxCodeRows> r_m;
  for (const CodeRow& r : s.rows)
    if (r.fate == CodeFate::used && (!of || r.satellite.constellation == *of)) static_cast<void>(r_m.push_back(problem.residual_m(x, r)));
  if (r_m.empty()) return 0;
  std::nth_element(r_m.begin(), r_m.begin() + r_m.size() / 2, r_m.end());
  return r_m[r_m.size() / 2];
}

/// Clocks for a start at the prior's position: the common offset from all rows, and each clock that the prior does not know from its own.
template <class Scalar>
inline void start_clocks(const BasicSinglePointProblem<Scalar>& problem, const BasicSinglePointSolution<Scalar>& s,
                         const BasicSinglePointPrior<Scalar>& prior, BasicSinglePointVector<Scalar>& x) {
  x.template segment<kSinglePointClocks>(3).array() += median_residual_m(problem, s, x, nullptr);
  for (std::size_t c = 0; c < kConstellations; ++c) {
    const Constellation of = static_cast<Constellation>(c);
    const int i = 3 + static_cast<int>(c);
    if (prior.information(i, i) <= 0) x[i] += median_residual_m(problem, s, x, &of);
  }
}

/// A start from codes alone: least squares from options.start_e_m, then the robust descent without atmosphere.
template <class Scalar>
[[nodiscard]] inline Status start_from_codes(BasicSinglePointProblem<Scalar>& problem, const SinglePointOptions& options,
                                             BasicSinglePointVector<Scalar>& x) {
  problem.forget_place();
  x.setZero();
  x.template head<3>() = options.start_e_m;
  if (!problem.converge_plainly(x))
    return failure(StatusCode::under_determined, "single point: the satellites do not determine a position");
  static_cast<void>(best_descent(problem, x));
  const double radius_m = x.template head<3>().norm();
  if (!(radius_m > 5e6 && radius_m < 5e7))
    return failure(StatusCode::rejected, "single point: the solution is not near the Earth", -1, -1, radius_m);
  return ok_status();
}

/// Whether options and prior are within their domains.
template <class Scalar>
[[nodiscard]] inline Status check_single_point(const SinglePointOptions& options,
                                               const std::optional<BasicSinglePointPrior<Scalar>>& prior) {
  if (options.codes_per_satellite < 1 || options.codes_per_satellite > kCodesPerSatellite)
    return failure(StatusCode::invalid_argument, "single point: codes_per_satellite outside its range");
  if (!(options.outlier_sigmas > 0 && options.data_information_scale > 0 && options.late_factor >= 1 && options.cn0_decade_db > 0))
    return failure(StatusCode::invalid_argument,
                   "single point: outlier_sigmas, data_information_scale and cn0_decade_db must be positive, late_factor at least 1");
  for (const double sigma_m : options.clock_difference_sigma_m)
    if (!(sigma_m >= 0.01 && sigma_m <= 1e6))
      return failure(StatusCode::invalid_argument, "single point: clock_difference_sigma_m outside [0.01, 1e6] m", -1, -1, sigma_m);
  if (!(options.other_carrier_sigma_m >= 0.01 && options.other_carrier_sigma_m <= 1e6))
    return failure(StatusCode::invalid_argument, "single point: other_carrier_sigma_m outside [0.01, 1e6] m", -1, -1,
                   options.other_carrier_sigma_m);
  const math::Vector3<Scalar> start_e_m = options.start_e_m;
  if (!start_e_m.allFinite() || (prior && !(prior->mean.allFinite() && prior->information.allFinite())))
    return failure(StatusCode::invalid_argument, "single point: start or prior is not finite");
  return ok_status();
}

/// The position from the rows that `problem` has collected into `out`; the rest of `out` is filled when that succeeds.
template <class Scalar>
[[nodiscard]] inline Status locate(BasicSinglePointProblem<Scalar>& problem, GpsTime tag, const SinglePointOptions& options,
                                   const std::optional<BasicSinglePointPrior<Scalar>>& prior, BasicSinglePointSolution<Scalar>& out) {
  if (problem.candidates() == 0) return failure(StatusCode::no_data, "single point: no satellite with a usable code and an ephemeris");
  if (problem.redundancy() < 0) return failure(StatusCode::too_few, "single point: fewer codes than unknowns", problem.candidates(), 4);

  BasicSinglePointVector<Scalar> x;
  if (prior) {
    x = prior->mean;
    problem.place(x.template head<3>());
    start_clocks(problem, out, *prior, x);
  } else {
    if (const Status s = start_from_codes(problem, options, x); !s) return s;
    problem.place(x.template head<3>());
  }
  if (problem.redundancy() < 0)
    return failure(StatusCode::too_few, "single point: fewer codes above the elevation mask than unknowns", problem.candidates(), 4);
  if (!std::isfinite(best_descent(problem, x)))
    return failure(StatusCode::under_determined, "single point: the satellites do not determine a position");
  if (const Status s = exclude_outliers(problem, options, x, out); !s) return s;
  report(problem, tag, x, out);
  return ok_status();
}

}  // namespace detail

/// Position of one receiver at one epoch, into `out`. Without prior at least four usable codes are needed, with a prior one.
/// Errors, `out` cleared: invalid_argument (an option or the prior out of its domain), no_data (no usable code), too_few (not enough
/// codes, or not enough that agree: `index` there, `detail` needed), under_determined (geometry), rejected (not near the Earth). A
/// solution that fails its own chi-square test is given with consistent = false and a covariance scaled up by the test.
/// Scalar: double or wider.
template <class Scalar, std::size_t N>
Status solve_single_point(const ObservationEpoch& epoch, const EphemerisStore<N>& store, const SinglePointOptions& options,
                          const std::type_identity_t<std::optional<BasicSinglePointPrior<Scalar>>>& prior,
                          BasicSinglePointSolution<Scalar>& out) {
  out.clear();
  Status s = detail::check_single_point<Scalar>(options, prior);
  if (!s) return s;
  detail::BasicSinglePointProblem<Scalar> problem(options, prior, out);
  problem.collect(epoch, store);
  s = detail::locate(problem, epoch.tag, options, prior, out);
  if (!s) out.clear();
  return s;
}

/// The same by value: some 20 kB, several times on its way.
template <class Scalar = double, std::size_t N>
[[nodiscard]] Result<BasicSinglePointSolution<Scalar>> solve_single_point(
    const ObservationEpoch& epoch, const EphemerisStore<N>& store, const SinglePointOptions& options = {},
    const std::type_identity_t<std::optional<BasicSinglePointPrior<Scalar>>>& prior = std::nullopt) {
  BasicSinglePointSolution<Scalar> out;
  if (const Status s = solve_single_point(epoch, store, options, prior, out); !s) return s;
  return out;
}

}  // namespace searvins::gnss
