// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Decorrelation of an ambiguity covariance by integers: the first half of LAMBDA (lambda.hpp has the second, the search).
///
/// 1. Factorisation. Q = L' D L, L unit lower triangular, computed from the last row upward. Read as a model of the errors:
///
///        x_k = w_k + sum_{i>k} L(i,k) w_i,   the w_i independent with variances d_i,
///
///    so d_k is the variance of x_k given x_{k+1} ... x_{n-1}. THE LAST ENTRY IS FIXED FIRST and is meant to be the most precise.
///    Symmetric pivoting takes the smallest remaining variance at each step [MLAMBDA: Chang, Yang, Zhou, J. Geodesy 79, 2005].
///
/// 2. Decorrelation. Integer changes of variable z = Z' x, det Z = +-1, make the d_k fall towards the end as far as integers
///    allow. With r = l - round(l), l = L(k+1,k), exchanging x_k - round(l) x_{k+1} with x_{k+1} turns the pair (d_k, d_{k+1}) into
///
///        delta = d_k + r^2 d_{k+1},   d_{k+1}' = delta,   d_k' = d_k d_{k+1} / delta
///
///    and pays when delta < d_{k+1}. Every exchange lowers d_{k+1}, so no pair qualifies after finitely many. The rest of L follows:
///
///        eta = d_k / delta,   lambda = r d_{k+1} / delta,   L(k+1,k)' = lambda
///        L(k,c)' = L(k+1,c) - r L(k,c),   L(k+1,c)' = eta L(k,c) + lambda L(k+1,c)     c < k
///
///    The reduction is lazy: x_k is reduced by x_{k+1} only when the pair is exchanged, since a reduction alone changes neither
///    d nor the search tree. But where |round(l)| >= 4 the rest of its column is reduced too: that keeps L and Z small
///    [Xie, Chang, Al Borno, 2011], thus the numbers sound and the rows of Z' usable as constraints.
///
/// Storage: one n x n array, rows contiguous. While factoring and reducing the lower triangle holds L, which makes the row
/// operations contiguous; the upper one then takes L' for the search, whose inner product runs along a column of L.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include <searvins/ambiguity/unimodular.hpp>
#include <searvins/core/status.hpp>

namespace searvins::ambiguity {

/// Z, L and D of a covariance of up to MaxN ambiguities, in place, without heap.
///
/// MaxSteps bounds the work: about n to 15 n steps are usual, 40 n with full reduction. Where it does not suffice the covariance
/// stays less decorrelated, which is as valid: searches take longer and complete() says so.
template <class Scalar, int MaxN, int MaxSteps = 64 * MaxN>
class Decorrelation {
  static_assert(MaxN >= 1 && MaxN <= 4096 && MaxSteps >= MaxN);

 public:
  using Transform = UnimodularTransform<MaxN, MaxSteps>;

  /// Factors and decorrelates the n x n covariance Q (cycles^2), row i at Q + i * ld; settings and errors as Lambda::decompose().
  Status decompose(const Scalar* Q, int ld, int n, Scalar exchange_factor, bool reduce_fully) {
    n_ = 0;
    if (n < 1 || ld < n) return failure(StatusCode::invalid_argument, "LAMBDA: needs n >= 1 ambiguities and ld >= n", n, ld);
    if (n > MaxN) return failure(StatusCode::capacity_exceeded, "LAMBDA: more ambiguities than MaxN", n, MaxN);
    if (!(exchange_factor > Scalar(0.25) && exchange_factor < 1))
      return failure(StatusCode::invalid_argument, "LAMBDA: exchange_factor must lie in (1/4, 1)", -1, -1,
                     static_cast<double>(exchange_factor));
    if (Status s = load(Q, ld, n); !s.ok()) return s;
    transform_.reset(n);
    if (Status s = factorise(n); !s.ok()) return s;
    if (Status s = decorrelate(n, exchange_factor, reduce_fully); !s.ok()) return s;
    for (int i = 1; i < n; ++i)
      for (int k = 0; k < i; ++k) row(k)[i] = row(i)[k];
    n_ = n;
    return ok_status();
  }

  /// Number of ambiguities, 0 when there is nothing.
  [[nodiscard]] int size() const { return n_; }

  /// d, cycles^2: entry k is the variance of z_k given z_{k+1} ... z_{n-1}.
  [[nodiscard]] const Scalar* variances() const { return d_.data(); }

  /// Column k of L: column(k)[i] = L(i,k) for i > k.
  [[nodiscard]] const Scalar* column(int k) const { return row(k); }

  /// The change of variables z = Z' x.
  [[nodiscard]] const Transform& transform() const { return transform_; }

  /// Whether the decorrelation ran to its end; false when MaxSteps stopped it.
  [[nodiscard]] bool complete() const { return n_ > 0 && complete_; }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// Largest multiplier of a reduction: beyond it no covariance of ambiguities is, and a step could not hold it.
  static constexpr Scalar kLargestMultiple = std::min(kExactIntegers<Scalar>, Scalar(1 << 30));

  [[nodiscard]] Scalar* row(int i) { return work_.data() + index(i) * index(stride_); }
  [[nodiscard]] const Scalar* row(int i) const { return work_.data() + index(i) * index(stride_); }

  /// Lower triangle of work_ = (Q + Q') / 2.
  Status load(const Scalar* Q, int ld, int n) {
    stride_ = n;
    const auto q = [Q, ld](int i, int k) { return Q[index(i) * index(ld) + index(k)]; };
    for (int i = 0; i < n; ++i) {
      const Scalar variance = q(i, i);
      if (!std::isfinite(variance)) return failure(StatusCode::non_finite, "LAMBDA: covariance is not finite", i, i);
      if (!(variance > 0))
        return failure(StatusCode::not_positive_definite, "LAMBDA: a variance is not positive", i, -1, static_cast<double>(variance));
      sigma_[index(i)] = std::sqrt(variance);
      row(i)[i] = variance;
      bool sound = true;
      for (int k = 0; k < i; ++k) {
        const Scalar difference = q(i, k) - q(k, i);
        sound &= std::abs(difference) <= Scalar(1e-4) * sigma_[index(i)] * sigma_[index(k)];  // false for NaN and infinity too
        row(i)[k] = q(i, k) - difference / 2;
      }
      if (!sound) return unsound_row(Q, ld, i);
    }
    return ok_status();
  }

  /// Says what is wrong with row i, which load() has refused.
  [[nodiscard]] Status unsound_row(const Scalar* Q, int ld, int i) const {
    for (int k = 0; k < i; ++k) {
      const Scalar lower = Q[index(i) * index(ld) + index(k)], upper = Q[index(k) * index(ld) + index(i)];
      if (!std::isfinite(lower) || !std::isfinite(upper)) return failure(StatusCode::non_finite, "LAMBDA: covariance is not finite", i, k);
      if (!(std::abs(lower - upper) <= Scalar(1e-4) * sigma_[index(i)] * sigma_[index(k)]))
        return failure(StatusCode::invalid_argument, "LAMBDA: covariance is not symmetric; fill both triangles", i, k,
                       static_cast<double>(lower - upper));
    }
    return failure(StatusCode::invalid_argument, "LAMBDA: covariance row is out of range", i);
  }

  /// Q = L' D L with the smallest remaining variance as next pivot, in place, from the last row upward.
  Status factorise(int n) {
    for (int k = n - 1; k >= 0; --k) {
      int pivot = 0;
      Scalar smallest = row(0)[0];
      for (int i = 1; i <= k; ++i)
        if (row(i)[i] < smallest) smallest = row(i)[i], pivot = i;
      if (pivot != k) exchange_pivot(pivot, k, n);
      const int original = transform_.source(k);
      const Scalar variance = sigma_[index(original)] * sigma_[index(original)];
      if (!(smallest > static_cast<Scalar>(8 * n) * std::numeric_limits<Scalar>::epsilon() * variance))
        return failure(StatusCode::not_positive_definite, "LAMBDA: covariance is not positive definite; `index` is the ambiguity", original,
                       -1, static_cast<double>(smallest));
      d_[index(k)] = smallest;
      eliminate(k, smallest);
    }
    return ok_status();
  }

  /// Exchanges variables p < k of the part that is not factored yet, and the columns p and k of L below it.
  void exchange_pivot(int p, int k, int n) {
    for (int c = 0; c < p; ++c) std::swap(row(p)[c], row(k)[c]);
    for (int i = p + 1; i < k; ++i) std::swap(row(i)[p], row(k)[i]);
    std::swap(row(p)[p], row(k)[k]);
    for (int i = k + 1; i < n; ++i) std::swap(row(i)[p], row(i)[k]);
    transform_.exchange_sources(p, k);
  }

  /// Row k of L, and the Schur complement of pivot k: Q(i,c) -= L(k,i) d_k L(k,c) for c <= i < k.
  void eliminate(int k, Scalar d) {
    const Scalar inverse = 1 / d;
    Scalar* l = row(k);
    for (int i = 0; i < k; ++i) {
      l[i] *= inverse;
      subtract_multiple(row(i), l, l[i] * d, i + 1);
    }
  }

  /// a[0..n) -= f * b[0..n)
  static void subtract_multiple(Scalar* __restrict a, const Scalar* __restrict b, Scalar f, int n) {
    for (int i = 0; i < n; ++i) a[i] -= f * b[i];
  }

  /// Reduces and exchanges neighbours until none gains.
  Status decorrelate(int n, Scalar exchange_factor, bool reduce_fully) {
    complete_ = true;
    int k = n - 2;
    while (k >= 0) {
      const Scalar limit = exchange_factor * d_[index(k + 1)];
      if (d_[index(k)] >= limit) {  // whatever r is
        --k;
        continue;
      }
      const Scalar multiple = nearest_integer(row(k + 1)[k]);
      const Scalar r = row(k + 1)[k] - multiple;
      const Scalar delta = d_[index(k)] + r * r * d_[index(k + 1)];
      if (!(delta < limit)) {
        --k;
        continue;
      }
      if (!has_room(n)) return ok_status();
      row(k + 1)[k] = r;
      if (!reduce_and_exchange(k, multiple, n)) return nearly_singular(k);
      exchange_rows(k, delta);
      if (k < n - 2) ++k;
    }
    for (k = reduce_fully ? n - 2 : -1; k >= 0 && has_room(n); --k)
      for (int i = k + 1; i < n; ++i)
        if (!reduce(k, i, n)) return nearly_singular(k);
    return ok_status();
  }

  /// Whether the steps of one more column fit; if not, the decorrelation ends here.
  bool has_room(int n) { return complete_ = transform_.room() >= n; }

  [[nodiscard]] Status nearly_singular(int k) const {
    return failure(StatusCode::not_positive_definite, "LAMBDA: covariance so nearly singular that integers lose their digits",
                   transform_.source(k));
  }

  /// x_k <- x_{k+1} and x_{k+1} <- x_k - multiple * x_{k+1}, for the columns of L below row k+1. False when a multiplier is too large.
  bool reduce_and_exchange(int k, Scalar multiple, int n) {
    if (!(std::abs(multiple) < kLargestMultiple)) return false;
    const auto whole = static_cast<std::int32_t>(multiple);
    if (std::abs(multiple) < 4) {
      transform_.append(k, k + 1, whole, true);
      exchange_columns(k, multiple, n);
      return true;
    }
    transform_.append(k, k + 1, whole, false);
    for (int i = k + 2; i < n; ++i) row(i)[k] -= multiple * row(i)[k + 1];
    for (int i = k + 2; i < n; ++i)
      if (!reduce(k, i, n)) return false;
    transform_.append(k, k + 1, 0, true);
    exchange_columns(k, Scalar(0), n);
    return true;
  }

  /// x_k <- x_k - round(L(i,k)) x_i, i > k, where that is not zero. False when the multiplier is too large.
  bool reduce(int k, int i, int n) {
    if (std::abs(row(i)[k]) <= Scalar(0.5)) return true;
    const Scalar multiple = nearest_integer(row(i)[k]);
    if (!(std::abs(multiple) < kLargestMultiple)) return false;
    transform_.append(k, i, static_cast<std::int32_t>(multiple), false);
    row(i)[k] -= multiple;
    for (int r = i + 1; r < n; ++r) row(r)[k] -= multiple * row(r)[i];
    return true;
  }

  /// Columns k and k+1 of L below row k+1: reduced by `multiple`, then exchanged.
  void exchange_columns(int k, Scalar multiple, int n) {
    for (int i = k + 2; i < n; ++i) {
      Scalar* pair = row(i) + k;
      const Scalar reduced = pair[0] - multiple * pair[1];
      pair[0] = pair[1];
      pair[1] = reduced;
    }
  }

  /// d and rows k and k+1 of L after the exchange (the equations of the header).
  void exchange_rows(int k, Scalar delta) {
    Scalar& d_k = d_[index(k)];
    Scalar& d_next = d_[index(k + 1)];
    const Scalar r = row(k + 1)[k];
    const Scalar inverse = 1 / delta;
    const Scalar eta = d_k * inverse, lambda = d_next * r * inverse;
    d_k = eta * d_next;
    d_next = delta;
    combine_rows(row(k), row(k + 1), r, eta, lambda, k);
    row(k + 1)[k] = lambda;
  }

  static void combine_rows(Scalar* __restrict a, Scalar* __restrict b, Scalar r, Scalar eta, Scalar lambda, int n) {
    for (int c = 0; c < n; ++c) {
      const Scalar upper = a[c], lower = b[c];
      a[c] = lower - r * upper;
      b[c] = eta * upper + lambda * lower;
    }
  }

  int n_{0};       // 0: nothing decomposed
  int stride_{0};  // row length of work_
  bool complete_{false};
  std::array<Scalar, std::size_t{MaxN} * std::size_t{MaxN}> work_{};
  std::array<Scalar, std::size_t{MaxN}> d_{};
  std::array<Scalar, std::size_t{MaxN}> sigma_{};  // standard deviations of the input, its order
  Transform transform_{};
};

}  // namespace searvins::ambiguity
