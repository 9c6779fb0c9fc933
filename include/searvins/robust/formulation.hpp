// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Robust formulations of a batch of m residuals r_i that share a pivot [paper sec. "Correlation-Preserving Robust Estimation"].
///
/// **Signs.** r = z - h, observation minus prediction of candidate minus pivot, so at the truth r_i = eta_i - eta_o. The latent variable
/// n (units of r: metres for code and phase) estimates eta_o; hence r_i + n estimates eta_i, and the plus sign is right. Sigma, d_i, s
/// and the upper-triangular R (R'R = Sigma^-1) are those of shared_pivot.hpp; sigma_i = sqrt(d_i), sigma_o = sqrt(s).
///
///     formulation            rows e                                      total cost rho (J: the loss, over z)              weights
///     Batch                  e = R r                    m rows           J(|e|)                                            one
///     ScalarRows             e = R r                    m rows           sum J(e_i)                                        one a row
///     LatentPivot            e_i = (r_i + n)/sigma_i, e_m = n/sigma_o    sum_{i<m} J(e_i) + e_m^2/2                        one a candidate
///     LatentPivotSymmetric   the same                   m + 1 rows       sum_{i<m} J(e_i) + J(e_m)                         and the pivot
///
/// **Contract with a factor.** `whiten` and `whiten_jacobian` give e and de/dx from r and dr/dx; `weigh` then gives one information
/// weight w_i per row (rows are scaled by sqrt(w_i)) and the total cost, which step control compares. The cost is the one whose gradient
/// is J' W e, because w is derived from it; it is not sum w e^2/2. Weights are frozen inside a linear solve. As every loss is concave in
/// z^2 (loss.hpp), a full step on a linear residual never raises the cost.
///
/// **Unit weights** [paper eq. (robust-gaussian-equivalence)]. |R r|^2 = r' Sigma^-1 r. The latent forms, minimised over n, give
/// n* = -q and the same value (shared_pivot.hpp: sum (r_i - q)^2/d_i + q^2/s); eliminating n at any fixed r leaves gradient and Hessian of
/// r' Sigma^-1 r / 2 in x too. So all four are one Gaussian model and differ only in who is downweighted.
///
/// **What each is for.** Batch: one outlier pulls down its whole batch; note that E|e|^2 = m, so with a constant meant for one residual
/// a healthy batch is deflated as well (DCS, c = 1.5: weight 0.10 at m = 8); `normalise_by_size` compares |e|^2/m instead. ScalarRows:
/// row i mixes candidates i..m-1, so weights depend on row order (last row: one candidate only). LatentPivot: weights belong to
/// candidates; but the pivot's Gaussian prior cannot absorb a faulty pivot: all candidates then look wrong together, and a redescending
/// loss may drop good ones (30 m on the pivot of ten satellites moves a code snapshot further than under Batch; see
/// tests/robust/test_formulation_scenarios.cpp).
/// LatentPivotSymmetric: the pivot is a satellite like any other. Under a redescending loss it can be disbelieved at a bounded cost however
/// small s is; only the Gaussian prior pins n to 0 as s -> 0.
///
/// **The symmetric form does not depend on which satellite is the pivot.** Let v_k(x), k = 0..m, be the undifferenced residuals
/// (single differences between receivers, clock not removed) and o the pivot: r_i = v_i - v_o. Put b = v_o - n. Then
/// r_i + n = v_i - b and n = v_o - b: the m + 1 terms are J((v_k(x) - b)/sigma_k), k = 0..m, with no mention of o. For fixed x, n <-> b is
/// a bijection, so the cost minimised over n, and with it every minimum in x, is the same for each choice of o: it is the clock b,
/// estimated under the same loss. For residuals linear in x the map (x, n) <-> (x, b) is linear, so also every IRLS iterate agrees.
///
/// All functions take plain arrays: r of m numbers, e of m + extra_rows. `cov` is a SharedPivot of any capacity. Nothing allocates.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>

#include "searvins/robust/loss.hpp"
#include "searvins/robust/shared_pivot.hpp"

namespace searvins::robust {

/// What a factor asks of a formulation; `whiten_jacobian` is a template over matrices and is checked where it is used.
template <class F, class Cov>
concept Formulation = Loss<typename F::LossType> &&
    requires(const F& f, const Cov& cov, const typename F::Scalar* in, typename F::Scalar n, typename F::Scalar* out) {
  { F::has_latent } -> std::convertible_to<bool>;
  { F::extra_rows } -> std::convertible_to<int>;
  { F::name } -> std::convertible_to<const char*>;
  { f.whiten(cov, in, n, out) } -> std::same_as<void>;
  { f.weigh(in, 1, out) } -> std::same_as<typename F::Scalar>;
};

/// Rows e = R r without a local variable: what Batch and ScalarRows share.
template <Loss L>
struct FullCovarianceRows {
  using LossType = L;
  using Scalar = typename L::Scalar;
  static constexpr bool has_latent = false;  ///< no local variable
  static constexpr int extra_rows = 0;       ///< as many rows as candidates

  /// e = R r; n is not used (pass 0). e may be r.
  template <class Cov>
  static void whiten(const Cov& cov, const Scalar* r, Scalar /*n*/, Scalar* e) {
    cov.whiten(r, e);
  }

  /// d_e = R d_r, m rows each; d_e may be d_r. There is no n: de_dn is not used (pass nullptr).
  template <class Cov, class In, class Out>
  static void whiten_jacobian(const Cov& cov, const In& d_r, Out&& d_e, Scalar* /*de_dn*/) {
    cov.whiten_rows(d_r, d_e);
  }
};

/// One weight for the whole batch [paper eq. (batch-robust-objective)].
template <Loss L>
struct Batch : FullCovarianceRows<L> {
  using Scalar = typename L::Scalar;
  static constexpr const char* name = "batch";
  L loss{};                       ///< applied to |e|, or to |e|/sqrt(m)
  bool normalise_by_size{false};  ///< true: z^2 = |e|^2/m (mean 1 in a healthy batch) and cost m rho(z), same gradient; false: as published

  /// Total cost; w[0..rows) are the weights, all equal.
  Scalar weigh(const Scalar* e, int rows, Scalar* w) const {
    Scalar z2 = 0;
    for (int i = 0; i < rows; ++i) z2 += e[i] * e[i];
    const Scalar size = normalise_by_size && rows > 0 ? static_cast<Scalar>(rows) : Scalar(1);
    const Scalar weight = loss.weight(z2 / size);
    for (int i = 0; i < rows; ++i) w[i] = weight;
    return size * loss.rho(z2 / size);
  }
};

/// One weight per whitened row [paper eq. (scalar-robust-objective)]. Depends on the order of candidates: give them in a fixed order.
template <Loss L>
struct ScalarRows : FullCovarianceRows<L> {
  using Scalar = typename L::Scalar;
  static constexpr const char* name = "scalar";
  L loss{};  ///< applied to each |e_i|

  /// Total cost; w[0..rows) are the weights.
  Scalar weigh(const Scalar* e, int rows, Scalar* w) const {
    Scalar cost = 0;
    for (int i = 0; i < rows; ++i) {
      w[i] = loss.weight(e[i] * e[i]);
      cost += loss.rho(e[i] * e[i]);
    }
    return cost;
  }
};

/// The paper's name of ScalarRows.
template <Loss L>
using Scalar = ScalarRows<L>;

/// How the prior n/sigma_o of a latent pivot error is weighed.
enum class PivotPrior {
  gaussian,   ///< weight 1, as published: a faulty pivot cannot be absorbed
  same_loss,  ///< by the loss of the candidates: pivot and candidates are alike
};

/// One weight per candidate, given the latent pivot error n [paper eqs. (latent-pivot-residual), (latent-pivot-objective)].
/// The information on n is sum w_i/d_i + w_m/s; it can vanish only under a loss whose weight reaches zero (Tukey, same_loss).
template <Loss L, PivotPrior kPrior>
struct LatentPivotForm {
  using LossType = L;
  using Scalar = typename L::Scalar;
  static constexpr const char* name = kPrior == PivotPrior::gaussian ? "latent" : "symmetric";
  static constexpr bool has_latent = true;  ///< a local variable n, the pivot error, in units of r
  static constexpr int extra_rows = 1;      ///< the prior n/sigma_o, last row
  L loss{};                                 ///< applied to each candidate's |r_i + n|/sigma_i (and to |n|/sigma_o, if symmetric)

  /// e_i = (r_i + n)/sigma_i for i < m, e_m = n/sigma_o. e may be r where it has room for m + 1.
  template <class Cov>
  static void whiten(const Cov& cov, const Scalar* r, Scalar n, Scalar* e) {
    for (int i = 0; i < cov.size(); ++i) e[i] = (r[i] + n) / std::sqrt(cov.candidate_variance(i));
    e[cov.size()] = n * cov.inverse_pivot_sigma();
  }

  /// d_e (m + 1 rows) from d_r (m rows); the prior row does not depend on x. de_dn[0..m]: derivative of e with respect to n.
  /// d_e may be d_r where it has room for m + 1 rows.
  template <class Cov, class In, class Out>
  static void whiten_jacobian(const Cov& cov, const In& d_r, Out&& d_e, Scalar* de_dn) {
    const int m = cov.size(), columns = static_cast<int>(d_r.cols());
    for (int i = 0; i < m; ++i) {
      de_dn[i] = 1 / std::sqrt(cov.candidate_variance(i));
      for (int c = 0; c < columns; ++c) d_e(i, c) = d_r(i, c) * de_dn[i];
    }
    de_dn[m] = cov.inverse_pivot_sigma();
    for (int c = 0; c < columns; ++c) d_e(m, c) = 0;
  }

  /// Total cost; w[0..rows) are the weights, the last one that of the prior.
  Scalar weigh(const Scalar* e, int rows, Scalar* w) const {
    Scalar cost = 0;
    for (int i = 0; i < rows; ++i) {
      const Term term = weigh_row(e[i] * e[i], i + 1 == rows);
      w[i] = term.weight;
      cost += term.cost;
    }
    return cost;
  }

  /// The best n for unit weights, n = -q = -(sum r_i/d_i)/(1/s + sum 1/d_i). Starting at n = 0 instead would leave the pivot's error in
  /// every candidate when weights are first computed.
  template <class Cov>
  [[nodiscard]] static Scalar initial_latent(const Cov& cov, const Scalar* r) {
    return -cov.common_part(r);
  }

  /// A start inside a good basin when the loss redescends: the cost over n is that of a location estimate from the samples -r_i (scale
  /// sigma_i) and 0 (the pivot's prior, scale sigma_o), and one gross error moves their mean but not their consensus. Each sample and
  /// the Gaussian optimum is tried, one reweighted mean improves it, the least cost wins (ties: the earlier of optimum, 0, -r_0, ...),
  /// and a few more reweighted means follow. No start has a lower cost than the result. Deterministic, O(m^2). Symmetric: independent
  /// of the choice of pivot but for ties and rounding, because the samples only shift together.
  template <class Cov>
  [[nodiscard]] Scalar robust_initial_latent(const Cov& cov, const Scalar* r) const {
    const Scalar pivot = cov.inverse_pivot_sigma(), pivot_information = pivot * pivot;
    Probe best = improve(cov, r, pivot_information, probe(cov, r, pivot_information, initial_latent(cov, r)));
    for (int start = -1; start < cov.size(); ++start) {
      const Scalar n = start < 0 ? Scalar(0) : -r[start];
      const Probe other = improve(cov, r, pivot_information, probe(cov, r, pivot_information, n));
      if (other.cost < best.cost) best = other;
    }
    for (int pass = 0; pass < 5; ++pass) best = improve(cov, r, pivot_information, best);
    return best.n;
  }

 private:
  struct Term {
    Scalar cost, weight;
  };
  struct Probe {
    Scalar n, cost, next;  // a value of n, the total cost there, and the reweighted mean that follows it
  };

  [[nodiscard]] Term weigh_row(Scalar z2, bool is_prior) const {
    if (kPrior == PivotPrior::gaussian && is_prior) return {z2 / 2, Scalar(1)};
    return {loss.rho(z2), loss.weight(z2)};
  }

  template <class Cov>
  [[nodiscard]] Probe probe(const Cov& cov, const Scalar* r, Scalar pivot_information, Scalar n) const {
    const Term prior = weigh_row(n * n * pivot_information, true);
    Scalar cost = prior.cost, information = prior.weight * pivot_information, moment = 0;
    for (int i = 0; i < cov.size(); ++i) {
      const Scalar d = cov.candidate_variance(i);
      const Term term = weigh_row((r[i] + n) * ((r[i] + n) / d), false);
      cost += term.cost;
      information += term.weight / d;
      moment += term.weight / d * r[i];
    }
    return {n, cost, information > 0 ? -moment / information : n};
  }

  // One reweighted mean, kept only if it lowers the cost.
  template <class Cov>
  [[nodiscard]] Probe improve(const Cov& cov, const Scalar* r, Scalar pivot_information, const Probe& from) const {
    const Probe to = probe(cov, r, pivot_information, from.next);
    return to.cost < from.cost ? to : from;
  }
};

/// The paper's latent-pivot formulation: Gaussian prior on the pivot error.
template <Loss L>
using LatentPivot = LatentPivotForm<L, PivotPrior::gaussian>;

/// Beyond the paper: the pivot's prior under the same loss, so a faulty pivot is survived and the choice of pivot does not matter.
template <Loss L>
using LatentPivotSymmetric = LatentPivotForm<L, PivotPrior::same_loss>;

static_assert(Formulation<Batch<Dcs<double>>, SharedPivot<double, 4>> && Formulation<ScalarRows<Huber<float>>, SharedPivot<float, 4>> &&
              Formulation<LatentPivot<Dcs<double>>, SharedPivot<double, 4>> &&
              Formulation<LatentPivotSymmetric<Dcs<float>>, SharedPivot<float, 4>>);

}  // namespace searvins::robust
