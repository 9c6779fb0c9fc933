// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How likely an integer estimate is the true one, from the covariance alone.
///
/// Let d_i be the conditional variances (cycles^2) of the *decorrelated* ambiguities: d_i is the variance of ambiguity i given the
/// ones fixed before it. Rounding them one after the other (bootstrapping) hits the truth with the probability that every
/// conditional error stays within half a cycle [Teunissen, J. Geodesy 72, 1998]:
///
///     P_B = prod_i ( 2 Phi(1 / (2 sqrt(d_i))) - 1 ) = prod_i erf(x_i),    x_i = 1 / (2 sqrt(2 d_i))
///
/// Integer least squares is never worse, so P_B is a lower bound of its success rate; of the d_i before decorrelation it would be
/// a much smaller one. The product is summed as logarithms: each term is log1p(-erfc(x)) where erf(x) is near one (it keeps
/// 1 - P down to 1e-300) and log(erf(x)) elsewhere, so that neither end loses digits and 80 poor ambiguities do not underflow.
///
/// The ambiguity dilution of precision, ADOP = (det Q)^(1/(2n)) = (prod d_i)^(1/(2n)) cycles, does not depend on the
/// decorrelation. It bounds integer least squares from above: its pull-in region has volume one, and of all regions of volume one
/// the ellipsoid of Q holds the most probability [Teunissen, J. Geodesy 74, 2000]:
///
///     P_ILS <= P( chi^2_n <= c_n / ADOP^2 ),    c_n = Gamma(n/2 + 1)^(2/n) / pi
///
/// All three assume unbiased floats and a true covariance: multipath is not in them, hence the further gates of the resolution.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

namespace searvins::ambiguity {

/// ln P_B of n conditional variances (cycles^2). No ambiguity at all is certain: 0. A variance that is not positive, or NaN, makes
/// the set worthless: minus infinity.
template <class Scalar>
[[nodiscard]] Scalar log_bootstrapped_success_rate(const Scalar* conditional_variances, int n) {
  Scalar log_p = 0;
  for (int i = 0; i < n; ++i) {
    const Scalar d = conditional_variances[i];
    if (!(d > 0)) return -std::numeric_limits<Scalar>::infinity();
    const Scalar x = 1 / (2 * std::sqrt(2 * d));
    log_p += x < Scalar(0.5) ? std::log(std::erf(x)) : std::log1p(-std::erfc(x));
  }
  return log_p;
}

/// P_B in [0, 1] of n conditional variances (cycles^2).
template <class Scalar>
[[nodiscard]] Scalar bootstrapped_success_rate(const Scalar* conditional_variances, int n) {
  return std::exp(log_bootstrapped_success_rate(conditional_variances, n));
}

/// 1 - P_B, exact also where P_B rounds to one.
template <class Scalar>
[[nodiscard]] Scalar bootstrapped_failure_rate(const Scalar* conditional_variances, int n) {
  return -std::expm1(log_bootstrapped_success_rate(conditional_variances, n));
}

/// Ratio of the second-best to the best squared norm, >= 1: large when the best integers stand out. Infinity when the float is
/// exactly the best integer vector, 1 when it is both.
template <class Scalar>
[[nodiscard]] Scalar ratio_of_norms(Scalar best, Scalar second) {
  if (best > 0) return second / best;
  return second > 0 ? std::numeric_limits<Scalar>::infinity() : Scalar(1);
}

/// ADOP in cycles of n conditional variances (cycles^2), any decorrelation. NaN when n < 1 or a variance is not positive.
template <class Scalar>
[[nodiscard]] Scalar ambiguity_dilution_of_precision(const Scalar* conditional_variances, int n) {
  Scalar log_det = 0;
  for (int i = 0; i < n; ++i) {
    if (!(conditional_variances[i] > 0)) return std::numeric_limits<Scalar>::quiet_NaN();
    log_det += std::log(conditional_variances[i]);
  }
  return n < 1 ? std::numeric_limits<Scalar>::quiet_NaN() : std::exp(log_det / static_cast<Scalar>(2 * n));
}

/// Upper bound in [0, 1] of the success rate of integer least squares with n ambiguities of this ADOP (cycles). NaN for n < 1 or an
/// ADOP that is not positive.
///
/// With y = c_n / (2 ADOP^2) the chi-square tail is the regularised incomplete gamma function Q(n/2, y), built upward from
/// Q(1/2, y) = erfc(sqrt y) or Q(1, y) = exp(-y) by Q(a + 1, y) = Q(a, y) + y^a exp(-y) / Gamma(a + 1): all terms positive.
template <class Scalar>
[[nodiscard]] Scalar integer_least_squares_success_bound(Scalar adop_cycles, int n) {
  if (n < 1 || !(adop_cycles > 0)) return std::numeric_limits<Scalar>::quiet_NaN();
  const bool odd = n % 2 != 0;
  const Scalar start = odd ? Scalar(0.5) : Scalar(1);
  const Scalar log_gamma_start = odd ? std::log(std::sqrt(std::numbers::pi_v<Scalar>) / 2) : Scalar(0);  // ln Gamma(start + 1)
  Scalar log_gamma = log_gamma_start;                                                                    // becomes ln Gamma(n/2 + 1)
  for (int k = odd ? 3 : 4; k <= n; k += 2) log_gamma += std::log(static_cast<Scalar>(k) / 2);
  const Scalar c_n = std::exp(2 * log_gamma / static_cast<Scalar>(n)) / std::numbers::pi_v<Scalar>;

  const Scalar y = c_n / (2 * adop_cycles * adop_cycles);
  Scalar tail = odd ? std::erfc(std::sqrt(y)) : std::exp(-y);
  Scalar log_term = start * std::log(y) - y - log_gamma_start;  // ln( y^a exp(-y) / Gamma(a + 1) ) at a = start
  for (int k = odd ? 3 : 4; k <= n; k += 2) {
    tail += std::exp(log_term);
    log_term += std::log(y) - std::log(static_cast<Scalar>(k) / 2);
  }
  return tail < 1 ? 1 - tail : Scalar(0);
}

}  // namespace searvins::ambiguity
