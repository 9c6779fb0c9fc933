// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Normal and chi-square probabilities and their inverses: the thresholds of gates and the success rates of integer fixing.
///
/// Every probability is computed as whichever tail is asked for, so that 1e-12 in either tail keeps its digits. Thresholds are
/// configuration: everything here is double.
///
/// Normal, with the complementary error function of the standard library:
///
///     Phi(x) = erfc(-x/sqrt 2)/2        2 Phi(x) - 1 = erf(x/sqrt 2)        log erf = log1p(-erfc) where erf is near 1
///
/// Chi-square with n degrees of freedom: P = P(a, y), Q = 1 - P = Q(a, y) with a = n/2, y = x/2, the regularised incomplete gamma
/// functions. Because 2a is an integer, integration by parts, Q(a + 1, y) = Q(a, y) + y^a e^-y / Gamma(a + 1), ends after a steps at
///
///     Q(1, y) = e^-y        Q(1/2, y) = erfc(sqrt y)                                     [Abramowitz & Stegun 26.4.4, 26.4.5]
///
/// a finite sum of positive terms, used for y >= a; below, P is the smaller tail and its series has positive terms too
///
///     P(a, y) = y^a e^-y / Gamma(a + 1) (1 + y/(a + 1) + y^2/((a + 1)(a + 2)) + ...)     [A & S 6.5.29]
///
/// Quantiles solve log tail(x) = log probability by Newton's method in u = log x. Both log P and log Q are concave in u (the density
/// of u is log-concave), hence the iteration lands on one side of the root after a step and approaches it monotonically.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <searvins/core/status.hpp>

namespace searvins::math {

inline constexpr int kMaxChiSquareDof = 200;           ///< largest number of degrees of freedom that is served
inline constexpr double kMinTailProbability = 1e-100;  ///< smallest probability whose quantile is served

/// Phi(x), probability that a standard normal number is below x. Relative precision in the lower tail; for the upper, normal_cdf(-x).
[[nodiscard]] inline double normal_cdf(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }

/// Density of the standard normal distribution.
[[nodiscard]] inline double normal_density(double x) { return std::exp(-x * x / 2) * std::numbers::inv_sqrtpi / std::numbers::sqrt2; }

/// 2 Phi(x) - 1, probability that |N(0, 1)| < x, for x >= 0 (odd in x); near 0 it is x sqrt(2/pi) to full relative precision.
[[nodiscard]] inline double two_sided_probability(double x) { return std::erf(x / std::numbers::sqrt2); }

/// 2 - 2 Phi(x), probability that |N(0, 1)| > x, for x >= 0: to full relative precision where two_sided_probability is 1.
[[nodiscard]] inline double two_sided_exceedance(double x) { return std::erfc(x / std::numbers::sqrt2); }

/// log(2 Phi(x) - 1) for x >= 0: -infinity at 0, to full relative precision for large x, where the logarithm of the rounded
/// probability would be 0. A product of success probabilities is the exponential of a sum of these. NaN for x < 0.
[[nodiscard]] inline double log_two_sided_probability(double x) {
  return x < 1 ? std::log(two_sided_probability(x)) : std::log1p(-two_sided_exceedance(x));
}

/// x with Phi(x) = probability. Error below 1e-14 (1 + |x|), for a probability that is exact.
/// Starts from Abramowitz & Stegun 26.2.23 (4.5e-4) in the lower tail; Halley's method triples the digits a step.
/// Errors: invalid_argument unless 1e-100 <= probability < 1 (value = probability).
[[nodiscard]] inline Result<double> normal_quantile(double probability) {
  if (!(probability >= kMinTailProbability && probability < 1))
    return failure(StatusCode::invalid_argument, "normal quantile: the probability must lie in [1e-100, 1)", -1, -1, probability);
  const bool lower = probability < 0.5;
  const double tail = lower ? probability : 1 - probability;  // exact by Sterbenz's lemma
  const double t = std::sqrt(-2 * std::log(tail));
  double x = -t + (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
  for (int i = 0; i < 3; ++i) {
    const double newton = (normal_cdf(x) - tail) / normal_density(x);
    x -= newton / (1 + x * newton / 2);
  }
  return lower ? x : -x;
}

namespace detail {

/// Both tails of the chi-square distribution at x and the logarithmic slope x f(x) of either, f its density.
struct ChiSquareTails {
  double below{0}, above{1}, slope{0};
};

/// x f(x) / a = y^a e^-y / Gamma(a + 1), as a product that neither over- nor underflows on the way (e^-y is split in two).
[[nodiscard]] inline double gamma_step(int dof, double y) {
  const bool odd = dof % 2 == 1;
  const double half_exp = std::exp(-y / 2);
  double step = odd ? half_exp * 2 * std::sqrt(y) * std::numbers::inv_sqrtpi : half_exp;
  for (double k = odd ? 1.5 : 1.0; k <= dof / 2.0; k += 1) step *= y / k;
  return step * half_exp;
}

/// Q(a, y) by the finite sum, a = dof/2.
[[nodiscard]] inline double upper_tail_sum(int dof, double y) {
  const bool odd = dof % 2 == 1;
  const double half_exp = std::exp(-y / 2);
  double term = odd ? half_exp * 2 * std::sqrt(y) * std::numbers::inv_sqrtpi : half_exp;  // of Q(3/2) - Q(1/2), or Q(1) itself
  double sum = odd ? 0 : term;
  for (double k = odd ? 0.5 : 1.0; k < dof / 2.0; k += 1) {
    if (k > 0.5) term *= y / k;
    sum += term;
  }
  return sum * half_exp + (odd ? std::erfc(std::sqrt(y)) : 0);
}

/// P(a, y) / step by the series, for y < a + 1.
[[nodiscard]] inline double lower_tail_series(int dof, double y) {
  double term = 1, sum = 1;
  for (double k = dof / 2.0 + 1; term > sum * std::numeric_limits<double>::epsilon() / 4; k += 1) {
    term *= y / k;
    sum += term;
  }
  return sum;
}

[[nodiscard]] inline ChiSquareTails chi_square_tails(double x, int dof) {
  if (x <= 0) return {};
  if (x > 3000) return {1, 0, 0};  // above is below the smallest double for every dof served; keeps infinity out of the products
  const double y = x / 2, a = dof / 2.0;
  const double step = gamma_step(dof, y);
  if (y < a) {
    const double below = step * lower_tail_series(dof, y);
    return {below, 1 - below, a * step};
  }
  const double above = upper_tail_sum(dof, y);
  return {1 - above, above, a * step};
}

[[nodiscard]] inline Status check_chi_square(double value, int dof) {
  if (dof < 1 || dof > kMaxChiSquareDof)
    return failure(StatusCode::invalid_argument, "chi-square: the degrees of freedom must lie in 1..200", dof, -1, value);
  if (std::isnan(value)) return failure(StatusCode::non_finite, "chi-square: the argument is not a number", dof);
  return ok_status();
}

/// A start for the quantile: Wilson and Hilferty's cube of a normal number, or the first term of the series where that fails (few
/// degrees of freedom and a small lower tail).
[[nodiscard]] inline double chi_square_start(double tail, bool is_upper, int dof) {
  const double z = normal_quantile(tail).value() * (is_upper ? -1 : 1);
  const double spread = 2.0 / (9.0 * dof);
  const double root = 1 - spread + z * std::sqrt(spread);
  if (root > 0.3) return dof * root * root * root;
  const double first_term = std::log(tail / gamma_step(dof, 1) / std::numbers::e) * 2 / dof;
  return 2 * std::min(std::exp(first_term), 0.5 * dof);
}

/// x whose upper (or lower) tail is `tail`, tail in [1e-100, 0.5].
[[nodiscard]] inline Result<double> chi_square_solve(double tail, bool is_upper, int dof) {
  double u = std::log(chi_square_start(tail, is_upper, dof));
  for (int i = 0; i < 60; ++i) {
    const ChiSquareTails at = chi_square_tails(std::exp(u), dof);
    const double reached = is_upper ? at.above : at.below;
    const double relative_slope = (is_upper ? -at.slope : at.slope) / reached;
    const double step = std::clamp(-std::log(reached / tail) / relative_slope, -1.0, 1.0);
    u += step;
    if (std::abs(step) <= 1e-9) return std::exp(u);  // the step just taken squared its error
  }
  return failure(StatusCode::not_converged, "chi-square quantile: no convergence in 60 steps", dof, -1, tail);
}

}  // namespace detail

/// Probability that a chi-square number with `dof` degrees of freedom is below x; 0 for x <= 0.
/// Errors: invalid_argument (dof outside 1..200), non_finite (x is NaN).
[[nodiscard]] inline Result<double> chi_square_cdf(double x, int dof) {
  if (const Status s = detail::check_chi_square(x, dof); !s) return s;
  return detail::chi_square_tails(x, dof).below;
}

/// Probability that it is above x: to full relative precision where chi_square_cdf rounds to 1. Errors as chi_square_cdf.
[[nodiscard]] inline Result<double> chi_square_exceedance(double x, int dof) {
  if (const Status s = detail::check_chi_square(x, dof); !s) return s;
  return detail::chi_square_tails(x, dof).above;
}

/// x that a chi-square number with `dof` degrees of freedom stays below with the given probability: 7.81 for 0.95 and 3.
/// Errors: invalid_argument unless 1e-100 <= probability < 1 and 1 <= dof <= 200; non_finite.
[[nodiscard]] inline Result<double> chi_square_quantile(double probability, int dof) {
  if (const Status s = detail::check_chi_square(probability, dof); !s) return s;
  if (!(probability >= kMinTailProbability && probability < 1))
    return failure(StatusCode::invalid_argument, "chi-square quantile: the probability must lie in [1e-100, 1)", dof, -1, probability);
  return probability < 0.5 ? detail::chi_square_solve(probability, false, dof) : detail::chi_square_solve(1 - probability, true, dof);
}

/// x that it exceeds with the given probability, the false-alarm rate of a gate: 7.81 for 0.05 and 3. Errors as chi_square_quantile.
[[nodiscard]] inline Result<double> chi_square_threshold(double false_alarm, int dof) {
  if (const Status s = detail::check_chi_square(false_alarm, dof); !s) return s;
  if (!(false_alarm >= kMinTailProbability && false_alarm < 1))
    return failure(StatusCode::invalid_argument, "chi-square threshold: the false alarm must lie in [1e-100, 1)", dof, -1, false_alarm);
  return false_alarm < 0.5 ? detail::chi_square_solve(false_alarm, true, dof) : detail::chi_square_solve(1 - false_alarm, false, dof);
}

}  // namespace searvins::math
