// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// LAMBDA: the integer vectors nearest to a real-valued one in the metric of its covariance [Teunissen, J. Geodesy 70, 1995].
///
///     minimise  (a - N)' Q^-1 (a - N)   over integer N      a: float ambiguities, cycles, Q: their covariance, cycles^2
///
/// First the covariance is factored and decorrelated by an integer change of variables, z = Z' a, Z' Q Z = L' D L, with det Z = +-1
/// and d_k, the variance of z_k given z_{k+1} ... z_{n-1}, falling towards the end (decorrelation.hpp). THE LAST z IS THE MOST
/// PRECISE AND IS FIXED FIRST; partial fixing takes z_first ... z_{n-1}.
///
/// Then the search. With e_k = z_k - zbar_k the objective separates over the levels k = n-1 ... 0,
///
///     zbar_k = zhat_k + sum_{i>k} L(i,k) e_i,   cost = sum_k e_k^2 / d_k,
///
/// and is searched depth first; each level tries the integers around zbar_k by increasing distance (zig-zag: Schnorr, Euchner,
/// 1994), so the first one beyond the bound ends the level. The bound is the cost of the K-th best vector so far.
///
/// round(a) is taken off first and put back at the end, so the size of the ambiguities costs no digits.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <searvins/ambiguity/decorrelation.hpp>
#include <searvins/ambiguity/success_rate.hpp>
#include <searvins/ambiguity/unimodular.hpp>
#include <searvins/core/status.hpp>

namespace searvins::ambiguity {

/// What can be set about the decorrelation and the search.
template <class Scalar>
struct LambdaSettings {
  /// A pair is exchanged when delta < exchange_factor * d_{k+1}; in (1/4, 1), below one so that rounding cannot swing a pair back and
  /// forth. 0.9 takes a quarter fewer exchanges than 1 and costs 3e-4 of success rate on the average of the benchmark.
  Scalar exchange_factor{Scalar(0.9)};
  /// Integers a search may try, about 50 million a second: a tenth of a second. Usual problems need 100, the worst of the
  /// benchmark 60,000.
  std::uint64_t max_nodes{5'000'000};
  /// Reduce every L(i,k) to at most 1/2 in the end. Neither d nor the result of a search depends on it, but the variances of the
  /// decorrelated ambiguities and the entries of Z become smallest, which conditions constraints built from combination() best.
  bool reduce_fully{false};
};

/// Integer least squares for up to MaxN ambiguities. All memory is in the object (MaxN^2 scalars, MaxSteps steps of 8 bytes): keep
/// it static or in a larger object rather than on a small stack.
///
/// Use: decompose(Q), then any number of searches with floats of that covariance.
///
/// MaxSteps bounds the decorrelation; where it is not enough the answers are the same, but the search takes longer.
template <class Scalar, int MaxN, int MaxSteps = 64 * MaxN>
class Lambda {
 public:
  static constexpr int kMaxBest = 4;  ///< how many of the best vectors a search can return

  /// The best integer vectors in the order of the input.
  struct SearchOutcome {
    int size{0};                                  ///< entries per vector, n
    int count{0};                                 ///< vectors found
    std::uint64_t nodes{0};                       ///< integers tried
    std::array<Scalar, kMaxBest> squared_norm{};  ///< (a - N)' Q^-1 (a - N), ascending; the first `count` hold
    std::array<std::array<std::int64_t, std::size_t{MaxN}>, kMaxBest> integers{};  ///< [candidate][ambiguity], cycles

    /// Second-best over best squared norm, >= 1; 0 when fewer than two were asked for.
    [[nodiscard]] Scalar ratio() const { return count < 2 ? Scalar(0) : ratio_of_norms(squared_norm[0], squared_norm[1]); }
  };

  /// Integers of the most precise decorrelated ambiguities only: z_k = values[candidate][k - first], k = first ... n-1, where
  /// z_k is the integer combination `combination(k)` of the ambiguities. The constraint to impose is combination(k) . N = z_k.
  struct PartialOutcome {
    int first{0};                                                                ///< decorrelated index of the first one fixed
    int size{0};                                                                 ///< how many are fixed, n - first
    int count{0};                                                                ///< candidates found
    std::uint64_t nodes{0};                                                      ///< integers tried
    std::array<Scalar, kMaxBest> squared_norm{};                                 ///< norm of the subset in its own covariance, ascending
    std::array<std::array<std::int64_t, std::size_t{MaxN}>, kMaxBest> values{};  ///< [candidate][k - first], cycles
    std::array<Scalar, std::size_t{MaxN}> conditional{};  ///< all ambiguities, input order, cycles: the float given the best values

    /// Second-best over best squared norm, >= 1; 0 when fewer than two were asked for.
    [[nodiscard]] Scalar ratio() const { return count < 2 ? Scalar(0) : ratio_of_norms(squared_norm[0], squared_norm[1]); }
  };

  Lambda() : Lambda(LambdaSettings<Scalar>{}) {}
  explicit Lambda(const LambdaSettings<Scalar>& settings) : settings_(settings) {}

  /// Factors and decorrelates the n x n covariance Q (cycles^2), row i at Q + i * ld. Both triangles are read and their mean is used.
  ///
  /// Errors: invalid_argument (n < 1, ld < n, a setting out of range, Q not symmetric to 1e-4 of its standard deviations: `index`
  /// and `detail` are row and column), capacity_exceeded (n > MaxN), non_finite (`index`, `detail`), not_positive_definite
  /// (`index` is the ambiguity whose conditional variance, `value`, is not positive, or at most 8 n epsilon of its variance and so
  /// lost in rounding). After an error the object holds nothing and searches are refused.
  Status decompose(const Scalar* Q, int ld, int n) {
    n_ = 0;
    if (Status s = decorrelation_.decompose(Q, ld, n, settings_.exchange_factor, settings_.reduce_fully); !s.ok()) return s;
    n_ = n;
    for (int k = 0; k < n_; ++k) inverse_d_[index(k)] = 1 / conditional_variances()[k];
    return ok_status();
  }

  /// The k_best <= 4 integer vectors nearest to a_hat (n values, cycles, |a| < 2^52 in double), best first.
  ///
  /// Errors: no_data (nothing decomposed), invalid_argument (k_best outside 1..4, or a value too large: `index`), non_finite
  /// (`index`), not_converged (max_nodes reached; `outcome` then holds the best found so far, which may not be the best there are).
  Status search(const Scalar* a_hat, int k_best, SearchOutcome& outcome) {
    outcome.size = n_;
    const Status status = search_levels(a_hat, 0, k_best, outcome);
    std::array<std::int64_t, std::size_t{MaxN}> z;
    for (int c = 0; c < outcome.count; ++c) {
      std::int64_t* N = outcome.integers[index(c)].data();
      for (int k = 0; k < n_; ++k) z[index(k)] = static_cast<std::int64_t>(candidate(c)[k]);
      transform().apply_inverse(z.data(), N);
      for (int i = 0; i < n_; ++i) N[i] = transform().wrapping_sum(N[i], offset_[index(i)]);
    }
    return status;
  }

  /// The same by value; what was found before max_nodes was reached is not returned.
  Result<SearchOutcome> search(const Scalar* a_hat, int k_best) {
    SearchOutcome outcome;
    if (Status s = search(a_hat, k_best, outcome); !s.ok()) return s;
    return outcome;
  }

  /// Fixes the decorrelated ambiguities first ... n-1 only (0 <= first < n), the most precise ones; the others stay real. `first` may
  /// come from first_reliable(). Errors as search(), and invalid_argument for `first`.
  Status search_partial(const Scalar* a_hat, int first, int k_best, PartialOutcome& outcome) {
    outcome.first = first;
    outcome.size = n_ - first;
    const Status status = search_levels(a_hat, first, k_best, outcome);
    if (outcome.count == 0) return status;

    std::array<std::int64_t, std::size_t{MaxN}> shift;  // Z' round(a)
    transform().apply(offset_.data(), shift.data());
    for (int c = 0; c < outcome.count; ++c)
      for (int k = first; k < n_; ++k)
        outcome.values[index(c)][index(k - first)] = transform().wrapping_sum(static_cast<std::int64_t>(candidate(c)[k]), shift[index(k)]);

    // The others take their conditional mean, zbar_k: e = 0, so that only the fixed ones move them.
    std::array<Scalar, std::size_t{MaxN}> z;
    for (int k = n_ - 1; k >= 0; --k) {
      const Scalar mean = zhat_[index(k)] + dot(decorrelation_.column(k) + k + 1, residual_.data() + k + 1, n_ - 1 - k);
      z[index(k)] = k < first ? mean : candidate(0)[k];
      residual_[index(k)] = z[index(k)] - mean;
    }
    transform().apply_inverse(z.data(), outcome.conditional.data());
    for (int i = 0; i < n_; ++i) outcome.conditional[index(i)] += static_cast<Scalar>(offset_[index(i)]);
    return status;
  }

  /// The same by value; what was found before max_nodes was reached is not returned.
  Result<PartialOutcome> search_partial(const Scalar* a_hat, int first, int k_best) {
    PartialOutcome outcome;
    if (Status s = search_partial(a_hat, first, k_best, outcome); !s.ok()) return s;
    return outcome;
  }

  /// Number of ambiguities decomposed, 0 when there is nothing.
  [[nodiscard]] int size() const { return n_; }

  /// Conditional variances (cycles^2) of the decorrelated ambiguities: entry k is that of z_k given z_{k+1} ... z_{n-1}.
  [[nodiscard]] const Scalar* conditional_variances() const { return decorrelation_.variances(); }

  /// L(i,k), i > k, of the decorrelated covariance Z' Q Z = L' D L.
  [[nodiscard]] Scalar factor(int i, int k) const { return decorrelation_.column(k)[i]; }

  /// Bootstrapped success rate of fixing the k most precise decorrelated ambiguities, z_{n-k} ... z_{n-1}; of none it is one.
  [[nodiscard]] Scalar success_rate_of_last(int k) const {
    return k < 0 || k > n_ ? Scalar(0) : bootstrapped_success_rate(conditional_variances() + (n_ - k), k);
  }

  /// Bootstrapped success rate of fixing them all; 0 when nothing is decomposed.
  [[nodiscard]] Scalar success_rate() const { return n_ == 0 ? Scalar(0) : success_rate_of_last(n_); }

  /// The smallest `first` with success_rate_of_last(n - first) >= minimum_rate; n when not even the last one can be trusted.
  [[nodiscard]] int first_reliable(Scalar minimum_rate) const {
    const Scalar log_minimum = std::log(minimum_rate);
    Scalar log_p = 0;
    int first = n_;
    while (first > 0) {
      log_p += log_bootstrapped_success_rate(conditional_variances() + (first - 1), 1);
      if (!(log_p >= log_minimum)) break;
      --first;
    }
    return first;
  }

  /// Row k of Z' (n values): z_k = sum_i row_of_z[i] N_i, i in the order of the input.
  void combination(int k, std::int64_t* row_of_z) const { transform().row(k, row_of_z); }

  /// N = Z'^-1 z for integer z; z is used up.
  void to_ambiguities(std::int64_t* z, std::int64_t* N) const { transform().apply_inverse(z, N); }

  /// Elementary steps of the decorrelation.
  [[nodiscard]] int steps() const { return transform().size(); }

  /// Whether the decorrelation ran to its end; false when MaxSteps stopped it.
  [[nodiscard]] bool decorrelated() const { return n_ > 0 && decorrelation_.complete(); }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  static constexpr Scalar kExact = kExactIntegers<Scalar>;

  [[nodiscard]] const auto& transform() const { return decorrelation_.transform(); }
  [[nodiscard]] const Scalar* candidate(int c) const { return candidates_[index(order_[index(c)])].data(); }

  /// Inner product in four interleaved sums, which do not wait for each other.
  static Scalar dot(const Scalar* a, const Scalar* b, int n) {
    Scalar s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    int i = 0;
    for (; i + 4 <= n; i += 4) {
      s0 += a[i] * b[i];
      s1 += a[i + 1] * b[i + 1];
      s2 += a[i + 2] * b[i + 2];
      s3 += a[i + 3] * b[i + 3];
    }
    for (; i < n; ++i) s0 += a[i] * b[i];
    return (s0 + s2) + (s1 + s3);
  }

  /// Takes round(a) off and searches levels n-1 ... first. Fills count, nodes and squared_norm of the outcome.
  template <class Outcome>
  Status search_levels(const Scalar* a_hat, int first, int k_best, Outcome& outcome) {
    outcome.count = 0;
    outcome.nodes = 0;
    if (Status s = prepare(a_hat, first, k_best); !s.ok()) return s;
    const Status status = visit_levels(first, k_best, outcome);
    for (int c = 0; c < outcome.count; ++c)
      for (int k = first; k < n_; ++k)
        if (!(std::abs(candidate(c)[k]) < kExact)) {
          outcome.count = 0;
          return failure(StatusCode::not_converged,
                         "LAMBDA: integers beyond the digits of the scalar; the covariance is too nearly singular", k);
        }
    return status;
  }

  /// Checks the request and sets zhat = Z' (a - round(a)).
  Status prepare(const Scalar* a_hat, int first, int k_best) {
    if (n_ == 0) return failure(StatusCode::no_data, "LAMBDA: no covariance was decomposed");
    if (k_best < 1 || k_best > kMaxBest) return failure(StatusCode::invalid_argument, "LAMBDA: k_best must lie in 1..4", k_best, kMaxBest);
    if (first < 0 || first >= n_) return failure(StatusCode::invalid_argument, "LAMBDA: first fixed index must lie in 0..n-1", first, n_);
    std::array<Scalar, std::size_t{MaxN}> fraction;
    for (int i = 0; i < n_; ++i) {
      if (!std::isfinite(a_hat[i])) return failure(StatusCode::non_finite, "LAMBDA: float ambiguity is not finite", i);
      if (!(std::abs(a_hat[i]) < kExact))
        return failure(StatusCode::invalid_argument, "LAMBDA: float ambiguity too large to hold a fraction", i, -1,
                       static_cast<double>(a_hat[i]));
      const Scalar whole = nearest_integer(a_hat[i]);
      offset_[index(i)] = static_cast<std::int64_t>(whole);
      fraction[index(i)] = a_hat[i] - whole;
    }
    transform().apply(fraction.data(), zhat_.data());
    for (int c = 0; c < kMaxBest; ++c) order_[index(c)] = c;
    return ok_status();
  }

  /// The depth-first walk. A level is left upward when its next integer is beyond the bound: all later ones are too.
  template <class Outcome>
  Status visit_levels(int first, int k_best, Outcome& outcome) {
    int level = n_ - 1;
    cost_above_[index(level)] = 0;
    enter(level, false);
    Scalar bound = std::numeric_limits<Scalar>::infinity();
    int left = -1;  // the level left upward last: on return only the e directly above it has changed
    while (outcome.nodes < settings_.max_nodes) {
      ++outcome.nodes;
      const Scalar e = residual_[index(level)];
      const Scalar cost = cost_above_[index(level)] + e * e * inverse_d_[index(level)];
      if (cost < bound) {
        if (level > first) {
          --level;
          cost_above_[index(level)] = cost;
          enter(level, level == left);
        } else {
          keep(cost, first, k_best, outcome);
          if (outcome.count == k_best) bound = outcome.squared_norm[index(k_best - 1)];
          step(level);
        }
      } else if (level == n_ - 1) {
        return outcome.count == k_best
                   ? ok_status()
                   : failure(StatusCode::not_converged, "LAMBDA: the norms overflow; check the units of Q", outcome.count);
      } else {
        left = level++;
        step(level);
      }
    }
    return failure(StatusCode::not_converged, "LAMBDA: max_nodes reached; the best found so far may not be the best there are",
                   outcome.count);
  }

  /// The integer nearest to zbar_k, and the side on which the next one lies. The part of zbar_k that does not depend on the level
  /// directly above is kept: it holds for all of that level's integers, which makes most entries O(1).
  void enter(int k, bool only_next_changed) {
    const int above = k + 2;
    const Scalar* l = decorrelation_.column(k);
    Scalar& settled = settled_[index(k)];
    if (!only_next_changed) settled = zhat_[index(k)] + (above < n_ ? dot(l + above, residual_.data() + above, n_ - above) : Scalar(0));
    const Scalar centre = k + 1 < n_ ? settled + l[k + 1] * residual_[index(k + 1)] : settled;
    const Scalar z = nearest_integer(centre);
    z_[index(k)] = z;
    residual_[index(k)] = z - centre;
    step_[index(k)] = z > centre ? Scalar(-1) : Scalar(1);
  }

  /// The next integer by distance from zbar_k: +1, -2, +3 ... or -1, +2, -3 ...
  void step(int k) {
    Scalar& s = step_[index(k)];
    z_[index(k)] += s;
    residual_[index(k)] += s;
    s = s > 0 ? -s - 1 : -s + 1;
  }

  /// Sorts the vector that has just been completed into the best ones; the worst gives way when k_best are there.
  template <class Outcome>
  void keep(Scalar cost, int first, int k_best, Outcome& outcome) {
    int place = outcome.count < k_best ? outcome.count++ : k_best - 1;
    const int slot = order_[index(place)];
    for (; place > 0 && outcome.squared_norm[index(place - 1)] > cost; --place) {
      outcome.squared_norm[index(place)] = outcome.squared_norm[index(place - 1)];
      order_[index(place)] = order_[index(place - 1)];
    }
    outcome.squared_norm[index(place)] = cost;
    order_[index(place)] = slot;
    for (int k = first; k < n_; ++k) candidates_[index(slot)][index(k)] = z_[index(k)];
  }

  using Row = std::array<Scalar, std::size_t{MaxN}>;

  LambdaSettings<Scalar> settings_{};
  Decorrelation<Scalar, MaxN, MaxSteps> decorrelation_{};
  int n_{0};  // 0: nothing decomposed
  Row inverse_d_{};

  // Of the search, by level.
  std::array<std::int64_t, std::size_t{MaxN}> offset_{};  // round(a), input order
  Row zhat_{};                                            // Z' (a - round(a))
  Row z_{}, residual_{}, step_{};                         // integer tried, e, next increment
  Row cost_above_{}, settled_{};                          // cost of the levels above; zbar_k without the term of level k+1
  std::array<Row, kMaxBest> candidates_{};
  std::array<int, kMaxBest> order_{};  // slots of candidates_, best first
};

/// One problem in one call: decomposes the n x n covariance Q (cycles^2, row i at Q + i * ld) and returns the k_best integer vectors
/// nearest to a_hat (cycles). The workspace lies on the stack: for larger MaxN keep a Lambda. Errors as Lambda's.
template <class Scalar, int MaxN>
[[nodiscard]] Result<typename Lambda<Scalar, MaxN>::SearchOutcome> integer_least_squares(const Scalar* Q, int ld, const Scalar* a_hat,
                                                                                         int n, int k_best = 2) {
  Lambda<Scalar, MaxN> lambda;
  if (Status s = lambda.decompose(Q, ld, n); !s.ok()) return s;
  return lambda.search(a_hat, k_best);
}

}  // namespace searvins::ambiguity
