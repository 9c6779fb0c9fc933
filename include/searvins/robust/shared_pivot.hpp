// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Covariance of m differences that share one pivot [paper eqs. (dd-covariance), (latent-pivot-decomposition)]:
///
///     r_i = eta_i - eta_o,  i = 0..m-1         eta_i ~ N(0, d_i) of the candidate, eta_o ~ N(0, s) of the pivot, all independent
///     Sigma = diag(d_i) + s 1 1'               units: those of r squared (m^2 for code and phase, (m/s)^2 for Doppler)
///
/// Everything below is a closed form of this "diagonal plus rank one"; no m x m matrix is ever stored or inverted.
///
/// **Inverse** (Sherman-Morrison). Let S0 = sum 1/d_j, S1 = sum r_j/d_j, and q = s S1 / (1 + s S0), the posterior mean of -eta_o given r.
/// Then, with no division by s,
///
///     (Sigma^-1 r)_i   = (r_i - q) / d_i
///     r' Sigma^-1 r    = sum (r_i - q)^2 / d_i  +  s (S1 / (1 + s S0))^2            sums of squares: nothing cancels
///     ln det Sigma     = sum ln d_i + ln(1 + s S0)
///
/// **Upper-triangular whitening** R, R' R = Sigma^-1, positive diagonal (hence unique). Sigma = R^-1 R^-T with R^-1 upper triangular says:
/// e = R r are the innovations of r taken from the last row to the first, row i predicted from the rows j > i. Given those rows, q has
/// posterior variance t_i and mean mu_i, a scalar Kalman filter:
///
///     t_{m-1} = s,  mu_{m-1} = 0                     nothing known yet
///     e_i      = (r_i - mu_i) / sqrt(d_i + t_i)      the innovation, by its standard deviation
///     g_i      = t_i / (d_i + t_i)                   the gain
///     mu_{i-1} = mu_i + g_i (r_i - mu_i),   t_{i-1} = t_i d_i / (d_i + t_i)
///
/// As 1/t_i = 1/s + sum_{j>i} 1/d_j and mu_i = t_i sum_{j>i} r_j/d_j, row i of R is one diagonal value and a constant times 1/d_j:
///
///     R_ii = 1 / sqrt(d_i + t_i),      R_ij = -(t_i R_ii) (1/d_j) for j > i,      R_ij = 0 for j < i
///
/// The last row depends on the last candidate only, the first on all: scalar (row-wise) robust weights therefore depend on the order of
/// rows. Give rows in a fixed order (ascending satellite id).
///
/// The recursion adds and divides positive numbers only, so t_i and g_i are right to a few units in the last place whatever the spread of
/// d_i; s = 0 gives t = g = 0 and R = diag(1/sqrt(d_i)); m = 1 gives R = 1/sqrt(d_0 + s). R costs O(m) per column, by one running mean.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

#include "searvins/core/status.hpp"

namespace searvins::robust {

/// Sigma = diag(d) + s 1 1' for up to Capacity candidates: Capacity + 1 numbers and a count. Without candidates (default constructed)
/// every operation is an empty one. Arrays passed to members hold size() numbers.
template <std::floating_point S, int Capacity>
class SharedPivot {
  static_assert(Capacity >= 1, "SharedPivot: Capacity is the largest number of candidates of a batch, at least 1");

 public:
  using Scalar = S;
  static constexpr int capacity = Capacity;

  SharedPivot() = default;

  /// From the m candidate variances d_i (finite, > 0) and the pivot variance s (finite, >= 0; 0: a pivot without error).
  /// no_data for m < 1, capacity_exceeded for m > Capacity, non_finite or invalid_argument with the candidate's index (m: the pivot).
  [[nodiscard]] static Result<SharedPivot> from(const S* candidate_variance, int m, S pivot_variance) {
    if (m < 1) return failure(StatusCode::no_data, "shared pivot: no candidate", m);
    if (m > Capacity) return failure(StatusCode::capacity_exceeded, "shared pivot: more candidates than Capacity", m, Capacity);
    SharedPivot cov;
    for (int i = 0; i <= m; ++i) {
      const S variance = i < m ? candidate_variance[i] : pivot_variance;
      const double shown = static_cast<double>(variance);
      if (!std::isfinite(variance)) return failure(StatusCode::non_finite, "shared pivot: variance is not finite", i, -1, shown);
      if (variance < 0 || (variance == 0 && i < m))
        return failure(StatusCode::invalid_argument, "shared pivot: variance must be positive (pivot: not negative)", i, -1, shown);
      if (i < m) cov.d_[index(i)] = variance;
    }
    cov.s_ = pivot_variance;
    cov.m_ = m;
    return cov;
  }

  /// Number of candidates m.
  [[nodiscard]] int size() const { return m_; }
  /// d_i, the variance of candidate i alone.
  [[nodiscard]] S candidate_variance(int i) const { return d_[index(i)]; }
  /// s, the variance of the pivot.
  [[nodiscard]] S pivot_variance() const { return s_; }

  /// 1/sigma_o for a row n/sigma_o. A pivot without error would make it infinite: sigma_o is kept above epsilon times the smallest
  /// candidate sigma, which holds n at 0 within rounding and leaves every number finite.
  [[nodiscard]] S inverse_pivot_sigma() const {
    S least = m_ > 0 ? d_[0] : S(1);
    for (int i = 1; i < m_; ++i) least = d_[index(i)] < least ? d_[index(i)] : least;
    const S sigma = std::sqrt(s_), floor = std::numeric_limits<S>::epsilon() * std::sqrt(least);
    return 1 / (sigma > floor ? sigma : floor);
  }

  /// q = E[-eta_o | r] under the Gaussian model: the part of r that all candidates share, units of r.
  [[nodiscard]] S common_part(const S* r) const { return s_ * scaled_sum(r); }

  /// r' Sigma^-1 r, dimensionless, >= 0.
  [[nodiscard]] S quadratic_form(const S* r) const {
    const S u = scaled_sum(r), q = s_ * u;
    S sum = q * u;
    for (int i = 0; i < m_; ++i) sum += (r[i] - q) * ((r[i] - q) / d_[index(i)]);
    return sum;
  }

  /// x = Sigma^-1 r; x may be r.
  void apply_inverse(const S* r, S* x) const {
    const S q = common_part(r);
    for (int i = 0; i < m_; ++i) x[i] = (r[i] - q) / d_[index(i)];
  }

  /// ln det Sigma.
  [[nodiscard]] S log_det() const {
    S sum = std::log1p(s_ * information());
    for (int i = 0; i < m_; ++i) sum += std::log(d_[index(i)]);
    return sum;
  }

  /// e = R r, R upper triangular with R'R = Sigma^-1; e may be r.
  void whiten(const S* r, S* e) const {
    const Innovations in = innovations();
    S mu = 0;
    for (int i = m_ - 1; i >= 0; --i) {
      const S v = r[i] - mu;
      mu += in.gain[index(i)] * v;
      e[i] = v * in.inverse_sigma[index(i)];
    }
  }

  /// The first m rows of `out` = R times the first m rows of `in`: matrices with cols() and (row, column), such as Eigen matrices, blocks
  /// and maps; `out` may be `in`. O(m cols), nothing is allocated.
  template <class In, class Out>
  void whiten_rows(const In& in, Out&& out) const {
    const Innovations innovation = innovations();
    for (int c = 0; c < static_cast<int>(in.cols()); ++c) {
      S mu = 0;
      for (int i = m_ - 1; i >= 0; --i) {
        const S v = in(i, c) - mu;
        mu += innovation.gain[index(i)] * v;
        out(i, c) = v * innovation.inverse_sigma[index(i)];
      }
    }
  }

 private:
  struct Innovations {
    std::array<S, static_cast<std::size_t>(Capacity)> gain;           // g_i
    std::array<S, static_cast<std::size_t>(Capacity)> inverse_sigma;  // R_ii
  };

  [[nodiscard]] static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  // Recomputed for each use: m square roots cost less than carrying 2 m numbers in every factor of the window.
  [[nodiscard]] Innovations innovations() const {
    Innovations in;
    S t = s_;
    for (int i = m_ - 1; i >= 0; --i) {
      const S d = d_[index(i)], variance = d + t;
      in.gain[index(i)] = t / variance;
      in.inverse_sigma[index(i)] = 1 / std::sqrt(variance);
      t *= d / variance;
    }
    return in;
  }

  // S0 = sum 1/d_j.
  [[nodiscard]] S information() const {
    S sum = 0;
    for (int i = 0; i < m_; ++i) sum += 1 / d_[index(i)];
    return sum;
  }

  // S1 / (1 + s S0).
  [[nodiscard]] S scaled_sum(const S* r) const {
    S sum = 0;
    for (int i = 0; i < m_; ++i) sum += r[i] / d_[index(i)];
    return sum / (1 + s_ * information());
  }

  std::array<S, static_cast<std::size_t>(Capacity)> d_{};
  S s_{0};
  int m_{0};
};

}  // namespace searvins::robust
