// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Partial Cholesky factorisation in place: the one dense kernel of the multifrontal elimination.
///
/// A symmetric matrix, split after its first k columns, is replaced by the factor of its leading block and the Schur complement of the rest:
///
///     A = | A11  A21' |      L11 L11' = A11        (k x k, lower)
///         | A21  A22  |      L21      = A21 L11^-T
///                            A22     <- A22 - L21 L21'
///
/// Only the lower triangle is read or written. Storage is column-major with leading dimension ld, owned by the caller: no heap.
///
/// Scaling. Cholesky's backward error is componentwise small against the matrix scaled to unit diagonal [Demmel 1989; Higham, Accuracy and
/// Stability, thm 10.6], so variables of very different units need no explicit scaling. What needs a scale is the question whether a pivot is
/// zero: it is compared with the information that the variable had before anything was eliminated (`reference`), since a pivot is that number
/// minus what the eliminated variables explain.
#pragma once

#include <cmath>
#include <limits>

namespace searvins::math {

/// What to do with a pivot that is zero to working precision.
enum class ZeroPivot {
  fail,  ///< stop and report it: the system is under-determined
  skip   ///< treat the direction as carrying no information; right for a positive semidefinite matrix, whose row then is zero too
};

/// Outcome of partial_cholesky.
template <class Scalar>
struct PivotReport {
  int failed{-1};      ///< column of the pivot that stopped the factorisation, -1: none
  Scalar value{0};     ///< its value
  int skipped{0};      ///< zero pivots passed over under ZeroPivot::skip
  bool non_finite{false};
  [[nodiscard]] bool ok() const { return failed < 0; }
};

/// A pivot counts as zero below this share of its reference: rounding of an n-term difference.
template <class Scalar>
[[nodiscard]] constexpr Scalar zero_pivot_share() {
  return Scalar(64) * std::numeric_limits<Scalar>::epsilon();
}

/// What becomes of a column of the factorisation.
enum class PivotVerdict {
  use,   ///< its root divides the column
  skip,  ///< the column becomes zero
  stop   ///< the report says why
};

/// The verdict on pivot j, noted in the report unless it is of use.
template <class Scalar>
[[nodiscard]] PivotVerdict judge_pivot(Scalar pivot, Scalar reference, int j, ZeroPivot policy, PivotReport<Scalar>& report) {
  const bool is_finite = std::isfinite(pivot);
  if (is_finite && pivot > zero_pivot_share<Scalar>() * reference && pivot > std::numeric_limits<Scalar>::min()) return PivotVerdict::use;
  if (is_finite && policy == ZeroPivot::skip) {
    ++report.skipped;
    return PivotVerdict::skip;
  }
  report.failed = j, report.value = pivot, report.non_finite = !is_finite;
  return PivotVerdict::stop;
}

namespace detail {

/// column[first..n) -= sum_p A(j, p) A(first..n, p) for the panel columns p in [p0, p1): the inner product form, unit stride.
template <class Scalar>
inline void subtract_outer(Scalar* a, int ld, int n, int j, int p0, int p1) {
  Scalar* const c = a + static_cast<std::ptrdiff_t>(j) * ld;
  int p = p0;
  for (; p + 4 <= p1; p += 4) {
    const Scalar *const q0 = a + static_cast<std::ptrdiff_t>(p) * ld, *const q1 = q0 + ld, *const q2 = q1 + ld, *const q3 = q2 + ld;
    const Scalar b0 = q0[j], b1 = q1[j], b2 = q2[j], b3 = q3[j];
    if (b0 == 0 && b1 == 0 && b2 == 0 && b3 == 0) continue;  // fronts are sparse where measurements are local
    for (int i = j; i < n; ++i) c[i] -= b0 * q0[i] + b1 * q1[i] + b2 * q2[i] + b3 * q3[i];
  }
  for (; p < p1; ++p) {
    const Scalar* const q = a + static_cast<std::ptrdiff_t>(p) * ld;
    const Scalar b = q[j];
    if (b == 0) continue;
    for (int i = j; i < n; ++i) c[i] -= b * q[i];
  }
}

}  // namespace detail

/// Factors the first k columns of the n x n matrix at `a` (lower triangle, column-major, leading dimension ld) and leaves the Schur complement in
/// the trailing block. `reference[j] >= 0`, j < k, is the scale of pivot j (see above). On failure the matrix is partly overwritten.
template <class Scalar>
[[nodiscard]] PivotReport<Scalar> partial_cholesky(Scalar* a, int ld, int n, int k, const Scalar* reference, ZeroPivot policy = ZeroPivot::fail) {
  constexpr int panel = 8;
  PivotReport<Scalar> report;
  for (int k0 = 0; k0 < k; k0 += panel) {
    const int k1 = k0 + panel < k ? k0 + panel : k;
    for (int j = k0; j < k1; ++j) {
      detail::subtract_outer(a, ld, n, j, k0, j);
      Scalar* const c = a + static_cast<std::ptrdiff_t>(j) * ld;
      const PivotVerdict verdict = judge_pivot(c[j], reference[j], j, policy, report);
      if (verdict == PivotVerdict::stop) return report;
      if (verdict == PivotVerdict::skip) {
        for (int i = j; i < n; ++i) c[i] = 0;
        continue;
      }
      c[j] = std::sqrt(c[j]);
      const Scalar inverse = Scalar(1) / c[j];
      for (int i = j + 1; i < n; ++i) c[i] *= inverse;
    }
    for (int j = k1; j < n; ++j) detail::subtract_outer(a, ld, n, j, k0, k1);
  }
  return report;
}

/// x <- L^-1 x for the leading k x k lower triangle. A skipped pivot (zero on the diagonal) gives zero.
template <class Scalar>
void solve_lower(const Scalar* l, int ld, int k, Scalar* x) {
  for (int j = 0; j < k; ++j) {
    const Scalar* const c = l + static_cast<std::ptrdiff_t>(j) * ld;
    x[j] = c[j] > 0 ? x[j] / c[j] : Scalar(0);
    const Scalar xj = x[j];
    if (xj == 0) continue;
    for (int i = j + 1; i < k; ++i) x[i] -= c[i] * xj;
  }
}

/// x <- L^-T x for the leading k x k lower triangle.
template <class Scalar>
void solve_lower_transposed(const Scalar* l, int ld, int k, Scalar* x) {
  for (int j = k - 1; j >= 0; --j) {
    const Scalar* const c = l + static_cast<std::ptrdiff_t>(j) * ld;
    Scalar s = x[j];
    for (int i = j + 1; i < k; ++i) s -= c[i] * x[i];
    x[j] = c[j] > 0 ? s / c[j] : Scalar(0);
  }
}

}  // namespace searvins::math
