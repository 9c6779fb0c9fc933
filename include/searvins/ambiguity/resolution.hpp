// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Integer ambiguity resolution: from a float solution to integers that may be believed, or to the reason why not.
///
/// Input is the joint marginal of the very window that made the float, without the priors of earlier fixes: a = float double differences (cycles),
/// p = antenna position in East-North-Up (metres),
///
///     | Q_aa  Q_ap |
///     | Q_pa  Q_pp |
///
/// With the integer least-squares candidate z [paper eq. (integer-least-squares)]:
///
///     dp      = Q_pa Q_aa^-1 (z - a)                      position innovation [paper eq. (ambiguity-position-innovation)]
///     Q_p|a   = Q_pp - Q_pa Q_aa^-1 Q_ap                  covariance after fixing
///     P_B     = prod_i (2 Phi(1/(2 sqrt d_i)) - 1)        bootstrapped success rate [paper eq. (bootstrap-success-rate)]
///
/// Gates, each with its own verdict:
///
///     success rate    P_B > 0.86
///     norm            (z - a)' Q_aa^-1 (z - a) <= chi-square quantile: the integers agree with the float's own covariance
///     ratio           second best over best squared norm, with a higher bound for a subset, and more so for a small one
///     covariance      horizontal and vertical sigma after fixing small enough
///     innovation      dp' (Q_pa Q_aa^-1 Q_ap)^-1 dp <= 16.27 (99.9 % of chi-square 3), and dp not larger than a bound in metres
///
/// Under wrong integers the squared norms of n ambiguities spread by sqrt(2 n) about their mean n, so chance alone makes ratios whose distance from 1 goes
/// with 1 / sqrt n. A bound that follows, 1 + (r - 1) sqrt(n0 / n), has its r at n0 ambiguities. It is worth its price where a float is good without
/// integers (with an inertial unit).
///
/// Partial mode takes ambiguities out one by one until all gates pass or too few are left: while the success rate is short, the least precise one;
/// afterwards the one that contradicts the candidate most, which is the largest drop of the squared norm,
///
///     (Q^-1 v)_i^2 / (Q^-1)_ii ,   v = z - a
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <searvins/ambiguity/lambda.hpp>
#include <searvins/ambiguity/success_rate.hpp>
#include <searvins/core/status.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/quantiles.hpp>

namespace searvins::ambiguity {

/// What to do when not all ambiguities can be resolved.
enum class ResolutionMode : std::uint8_t {
  full,     ///< all or nothing, as in the paper
  partial,  ///< a subset when the whole does not pass
  off       ///< float only
};

/// Why there is a fix, or none.
enum class ResolutionVerdict : std::uint8_t {
  accepted,
  off,
  too_few,          ///< fewer ambiguities than min_ambiguities
  ill_conditioned,  ///< the joint covariance is not positive definite
  success_rate,
  norm,
  ratio,
  covariance,
  innovation,
  contradiction     ///< the re-optimised window refused the integers (set by the estimator)
};

/// Name of a verdict, for reports.
[[nodiscard]] constexpr const char* name_of(ResolutionVerdict v) {
  constexpr const char* names[] = {"accepted", "off", "too few", "ill-conditioned", "success rate", "norm", "ratio", "covariance", "innovation", "contradiction"};
  return names[static_cast<std::size_t>(v)];
}

/// Settings of the gates.
struct ResolutionOptions {
  ResolutionMode mode{ResolutionMode::partial};
  double min_success_rate{0.86};
  double min_ratio{2};                  ///< second over best squared norm; 1 switches the test off
  double min_ratio_partial{5};          ///< the same for a subset: it was chosen for agreeing with its integers, so it must do so more clearly
  double ratio_subset_size{0};          ///< n0 > 0: smaller subsets need more than min_ratio_partial, larger ones less; 0: all the same
  double norm_confidence{0.9999};       ///< of the chi-square bound on the best squared norm
  int min_ambiguities{5};
  double min_share_partial{0.5};        ///< a subset holds at least this share of the ambiguities that were offered
  double max_sigma_horizontal_m{0.15};  ///< after fixing, larger axis
  double max_sigma_vertical_m{0.40};
  double max_innovation_statistic{16.27};
  double max_innovation_horizontal_m{1.0};  ///< or `innovation_sigmas` float sigmas, whichever is larger
  double max_innovation_vertical_m{2.0};
  double innovation_sigmas{3.5};
};

/// Float ambiguities with the joint covariance of position and ambiguities.
template <int MaxN>
struct FloatAmbiguities {
  int n{0};
  std::array<double, static_cast<std::size_t>(MaxN)> a_cycles{};
  std::array<double, static_cast<std::size_t>(MaxN) * MaxN> Q_aa{};  ///< row i at i * MaxN, cycles^2, both triangles
  std::array<Eigen::Vector3d, static_cast<std::size_t>(MaxN)> Q_pa{};  ///< covariance of position and ambiguity i, m * cycles
  Eigen::Matrix3d Q_pp{Eigen::Matrix3d::Zero()};                       ///< m^2, East-North-Up
};

/// What resolution found. `integers[i]` holds where `fixed[i]`.
template <int MaxN>
struct ResolutionOutcome {
  ResolutionVerdict verdict{ResolutionVerdict::too_few};
  int tried{0};   ///< ambiguities offered
  int count{0};   ///< ambiguities fixed (or in the last subset tried)
  std::array<bool, static_cast<std::size_t>(MaxN)> fixed{};
  std::array<std::int64_t, static_cast<std::size_t>(MaxN)> integers{};
  double success_rate{0}, ratio{0}, squared_norm{0};
  Eigen::Vector3d innovation_m{Eigen::Vector3d::Zero()};       ///< dp, East-North-Up
  Eigen::Matrix3d covariance_m2{Eigen::Matrix3d::Zero()};      ///< Q_p|a
  [[nodiscard]] bool accepted() const { return verdict == ResolutionVerdict::accepted; }
};

/// Search and gates of the file comment, for up to MaxN ambiguities. All memory is in the object.
template <int MaxN>
class Resolver {
 public:
  using Float = FloatAmbiguities<MaxN>;
  using Outcome = ResolutionOutcome<MaxN>;

  /// Searches and validates. The outcome's verdict is never an error: a covariance that LAMBDA refuses is `ill_conditioned`.
  void resolve(const Float& f, const ResolutionOptions& options, Outcome& out) {
    out = Outcome{};
    out.tried = f.n;
    if (options.mode == ResolutionMode::off) {
      out.verdict = ResolutionVerdict::off;
      return;
    }
    m_ = f.n;
    for (int i = 0; i < m_; ++i) subset_[at(i)] = i;
    while (true) {
      if (m_ < options.min_ambiguities || m_ < options.min_share_partial * f.n) {
        if (out.verdict == ResolutionVerdict::accepted || out.count == 0) out.verdict = ResolutionVerdict::too_few;
        return;
      }
      out.count = m_;
      out.verdict = judge(f, options, out);
      if (out.verdict == ResolutionVerdict::accepted) break;
      if (options.mode == ResolutionMode::full) return;
      if (out.verdict == ResolutionVerdict::covariance) return;  // fewer ambiguities cannot make it smaller
      drop(out.verdict == ResolutionVerdict::success_rate || out.verdict == ResolutionVerdict::ill_conditioned ? least_precise(f) : most_contradicting());
    }
    for (int k = 0; k < m_; ++k) {
      out.fixed[at(subset_[at(k)])] = true;
      out.integers[at(subset_[at(k)])] = search_.integers[0][at(k)];
    }
  }

 private:
  using Vector3 = math::Vector3<math::DeferredFor<double, MaxN>>;
  using Matrix3 = math::Matrix3<math::DeferredFor<double, MaxN>>;

  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  [[nodiscard]] ResolutionVerdict judge(const Float& f, const ResolutionOptions& options, Outcome& out) {
    for (int i = 0; i < m_; ++i) {
      a_[at(i)] = f.a_cycles[at(subset_[at(i)])];
      for (int j = 0; j < m_; ++j) Q_[at(i) * MaxN + at(j)] = f.Q_aa[at(subset_[at(i)]) * MaxN + at(subset_[at(j)])];
    }
    if (!lambda_.decompose(Q_.data(), MaxN, m_).ok()) return ResolutionVerdict::ill_conditioned;
    out.success_rate = lambda_.success_rate();
    if (out.success_rate <= options.min_success_rate) return ResolutionVerdict::success_rate;
    if (!lambda_.search(a_.data(), 2, search_).ok()) return ResolutionVerdict::ill_conditioned;
    out.squared_norm = search_.squared_norm[0];
    out.ratio = search_.ratio();
    if (!condition(f, out)) return ResolutionVerdict::ill_conditioned;
    const auto bound = math::chi_square_quantile(options.norm_confidence, m_);
    if (bound.ok() && out.squared_norm > *bound) return ResolutionVerdict::norm;
    if (out.ratio < least_ratio(options, m_ < f.n)) return ResolutionVerdict::ratio;
    return judge_position(f, options, out);
  }

  [[nodiscard]] double least_ratio(const ResolutionOptions& options, bool is_subset) const {
    if (!is_subset) return options.min_ratio;
    const double size = options.ratio_subset_size > 0 ? std::sqrt(options.ratio_subset_size / m_) : 1;
    return std::max(options.min_ratio, 1 + (options.min_ratio_partial - 1) * size);
  }

  /// Conditions the position on the candidate: dp, Q_p|a, and Q^-1 v for the choice of what to drop.
  [[nodiscard]] bool condition(const Float& f, Outcome& out) {
    std::array<double, static_cast<std::size_t>(MaxN)>& reference = reference_;
    for (int j = 0; j < m_; ++j) {
      reference[at(j)] = Q_[at(j) * MaxN + at(j)];
      for (int i = j; i < m_; ++i) L_[at(j) * MaxN + at(i)] = Q_[at(i) * MaxN + at(j)];
    }
    if (!math::partial_cholesky(L_.data(), MaxN, m_, m_, reference.data()).ok()) return false;
    for (int i = 0; i < m_; ++i) v_[at(i)] = static_cast<double>(search_.integers[0][at(i)]) - a_[at(i)];
    solution_ = v_;
    math::solve_lower(L_.data(), MaxN, m_, solution_.data());
    math::solve_lower_transposed(L_.data(), MaxN, m_, solution_.data());
    out.innovation_m.setZero();
    for (int i = 0; i < m_; ++i) out.innovation_m += f.Q_pa[at(subset_[at(i)])] * solution_[at(i)];
    explained_.setZero();
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < m_; ++i) column_[at(axis)][at(i)] = f.Q_pa[at(subset_[at(i)])][axis];
      math::solve_lower(L_.data(), MaxN, m_, column_[at(axis)].data());
    }
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        for (int i = 0; i < m_; ++i) explained_(a, b) += column_[at(a)][at(i)] * column_[at(b)][at(i)];
    out.covariance_m2 = f.Q_pp - explained_;
    return true;
  }

  [[nodiscard]] ResolutionVerdict judge_position(const Float& f, const ResolutionOptions& options, const Outcome& out) const {
    const auto horizontal = [](const Matrix3& P) {
      const double mean = (P(0, 0) + P(1, 1)) / 2, half = (P(0, 0) - P(1, 1)) / 2;
      return std::sqrt(std::max(0.0, mean + std::hypot(half, P(0, 1))));  // larger eigenvalue of the east-north block
    };
    if (horizontal(out.covariance_m2) > options.max_sigma_horizontal_m || std::sqrt(std::max(0.0, out.covariance_m2(2, 2))) > options.max_sigma_vertical_m)
      return ResolutionVerdict::covariance;
    const double bound_h = std::max(options.max_innovation_horizontal_m, options.innovation_sigmas * horizontal(f.Q_pp));
    const double bound_v = std::max(options.max_innovation_vertical_m, options.innovation_sigmas * std::sqrt(std::max(0.0, f.Q_pp(2, 2))));
    if (out.innovation_m.template head<2>().norm() > bound_h || std::abs(out.innovation_m.z()) > bound_v) return ResolutionVerdict::innovation;
    Matrix3 L = explained_;
    const Vector3 reference = L.diagonal();
    if (!math::partial_cholesky(L.data(), 3, 3, 3, reference.data()).ok()) return ResolutionVerdict::ill_conditioned;
    Vector3 y = out.innovation_m;
    math::solve_lower(L.data(), 3, 3, y.data());
    return y.squaredNorm() > options.max_innovation_statistic ? ResolutionVerdict::innovation : ResolutionVerdict::accepted;
  }

  [[nodiscard]] int least_precise(const Float& f) const {
    int worst = 0;
    const auto variance = [&](int k) { return f.Q_aa[at(subset_[at(k)]) * MaxN + at(subset_[at(k)])]; };
    for (int k = 1; k < m_; ++k)
      if (variance(k) > variance(worst)) worst = k;
    return worst;
  }

  /// Position in the subset of the ambiguity whose removal lowers the squared norm most. Needs L_ and solution_ = Q^-1 v.
  [[nodiscard]] int most_contradicting() {
    int worst = 0;
    double largest = -1;
    for (int k = 0; k < m_; ++k) {
      std::fill_n(work_.begin(), at(m_), 0.0);
      work_[at(k)] = 1;
      math::solve_lower(L_.data(), MaxN, m_, work_.data());
      double inverse_diagonal = 0;  // (Q^-1)_kk = |L^-1 e_k|^2
      for (int i = k; i < m_; ++i) inverse_diagonal += work_[at(i)] * work_[at(i)];
      const double gain = solution_[at(k)] * solution_[at(k)] / inverse_diagonal;
      if (gain > largest) largest = gain, worst = k;
    }
    return worst;
  }

  void drop(int k) {
    for (int i = k + 1; i < m_; ++i) subset_[at(i - 1)] = subset_[at(i)];
    --m_;
  }

  Lambda<double, MaxN> lambda_{};
  typename Lambda<double, MaxN>::SearchOutcome search_{};
  int m_{0};
  std::array<int, static_cast<std::size_t>(MaxN)> subset_{};
  std::array<double, static_cast<std::size_t>(MaxN)> a_{}, v_{}, solution_{}, work_{}, reference_{};
  std::array<std::array<double, static_cast<std::size_t>(MaxN)>, 3> column_{};
  std::array<double, static_cast<std::size_t>(MaxN) * MaxN> Q_{}, L_{};
  Matrix3 explained_{Matrix3::Zero()};
};

}  // namespace searvins::ambiguity
