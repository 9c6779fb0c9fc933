// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Factors of differenced GNSS observations: a batch of candidates against one pivot, under any robust formulation.
///
/// For the antenna at p_e = p_e0 + R_ew p_wa, satellites s (candidate) and o (pivot), and base-corrected observations z of one signal
/// [paper eqs. (dd-code-residual), (dd-phase-residual), (dd-doppler-residual)]:
///
///     code      r_s = (z_s - z_o) - (h_s(p) - h_o(p))
///     phase     r_s = (z_s - z_o) - (h_s(p) - h_o(p)) - lambda (N_s - N_o)         without N_o when N_s is the double difference itself
///     Doppler   r_s = (z_s - z_o) - (u_s - u_o)' v_e                               u: satellite to receiver, v_e = R_ew v_wa
///
/// h is the geometric range with Sagnac term (gnss/range.hpp). With u_s = d h_s / d p:
///
///     d r_s / d p_wa = -(u_s - u_o)' R_ew        d r_s / d N_s = -lambda      d r_s / d N_o = +lambda      d r_s / d v_wa = -(u_s - u_o)' R_ew
///
/// The covariance of the batch is diag(sigma_s^2) + sigma_o^2 11'; whitening, latent pivot and weights are those of robust/formulation.hpp. The change
/// of u_s with position is neglected in the Doppler Jacobian only (1 m moves a rate by v / 2e7).
///
/// Where the antenna is on a state is said by an antenna model: position_w_m(x, J*) and velocity_w_mps(x, J*), J = d / d state (3 x dof). The default
/// goes to the free functions antenna_position_w_m(x, J*) and antenna_velocity_w_mps(x, J*) of a state that is the antenna itself.
#pragma once

#include <Eigen/Core>

#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/gnss_variables.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/robust/formulation.hpp>
#include <searvins/robust/shared_pivot.hpp>
#include <searvins/smoother/factor.hpp>

namespace searvins::gnss {

/// What is differenced.
enum class Observable : std::uint8_t { code, phase, doppler };

/// One observation of a batch.
struct BatchMember {
  Eigen::Vector3d satellite_e_m{Eigen::Vector3d::Zero()};  ///< code, phase: satellite in ECEF at transmission; Doppler: unit vector satellite to receiver, ECEF
  double z{0};                                             ///< base-corrected observation, metres; Doppler: corrected range rate, m/s
};

/// The antenna of a state that describes the antenna itself.
struct DirectAntenna {
  template <class State>
  [[nodiscard]] Eigen::Vector3d position_w_m(const State& x, Eigen::Matrix<double, 3, State::dof>* d_state = nullptr) const {
    return antenna_position_w_m(x, d_state);
  }
  template <class State>
  [[nodiscard]] Eigen::Vector3d velocity_w_mps(const State& x, Eigen::Matrix<double, 3, State::dof>* d_state = nullptr) const {
    return antenna_velocity_w_mps(x, d_state);
  }
};

/// See the file comment. MaxCandidates: largest batch without the pivot.
template <class State, class FormulationType, Observable kObservable, int MaxCandidates, class Antenna = DirectAntenna>
struct DifferenceFactor {
  using Scalar = math::Deferred<double, State>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  static constexpr bool is_phase = kObservable == Observable::phase;
  static constexpr std::size_t kCandidates = static_cast<std::size_t>(MaxCandidates);
  static constexpr int max_rows = MaxCandidates + FormulationType::extra_rows;
  static constexpr int max_keys = 1 + (is_phase ? MaxCandidates + 1 : 0) + (FormulationType::has_latent ? 1 : 0);
  static constexpr int max_columns = State::dof + max_keys - 1;
  static constexpr const char* name = kObservable == Observable::code ? "code difference" : is_phase ? "phase difference" : "Doppler difference";

  smoother::Key<State> state{};
  smoother::Key<Ambiguity> pivot_ambiguity{};  ///< invalid: the candidates' ambiguities are double differences
  StaticVector<smoother::Key<Ambiguity>, is_phase ? static_cast<std::size_t>(MaxCandidates) : 1> ambiguities{};  ///< one a candidate, phase only
  smoother::Key<PivotError> latent{};          ///< latent formulations only
  geodesy::LocalFrame frame{};
  Antenna antenna{};
  BatchMember pivot{};
  StaticVector<BatchMember, static_cast<std::size_t>(MaxCandidates)> candidates{};
  double wavelength_m{0};
  robust::SharedPivot<Scalar, MaxCandidates> covariance{};
  FormulationType formulation{};
  /// What the batch counts for, after its robust weights: below 1 when the errors of consecutive epochs are alike and would add up to too much. The
  /// scale of what is an outlier stays that of one observation.
  double information_share{1};

  [[nodiscard]] int size() const { return static_cast<int>(candidates.size()); }
  [[nodiscard]] int rows() const { return size() + FormulationType::extra_rows; }

  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
    if constexpr (is_phase) {
      for (const auto& n : ambiguities) visit(n);
      if (pivot_ambiguity.valid()) visit(pivot_ambiguity);
    }
    if constexpr (FormulationType::has_latent) visit(latent);
  }

  /// Unwhitened residuals r of the candidates, metres or m/s.
  template <class Values>
  void residuals(const Values& values, double* r, Eigen::Matrix<double, MaxCandidates, 3>* d_r_d_antenna = nullptr) const {
    const State& x = values(state);
    Vector3 u_o;
    Vector3 at;  // ECEF position, or velocity for Doppler
    if constexpr (kObservable == Observable::doppler)
      at = frame.R_ew * antenna.velocity_w_mps(x);
    else
      at = frame.to_ecef(antenna.position_w_m(x));
    const double h_o = model(at, pivot, u_o);
    for (int i = 0; i < size(); ++i) {
      const BatchMember& c = candidates[static_cast<std::size_t>(i)];
      Vector3 u;
      r[i] = (c.z - pivot.z) - (model(at, c, u) - h_o);
      if constexpr (is_phase) {
        const double n_o = pivot_ambiguity.valid() ? values(pivot_ambiguity).value : 0.0;
        r[i] -= wavelength_m * (values(ambiguities[static_cast<std::size_t>(i)]).value - n_o);
      }
      if (d_r_d_antenna) d_r_d_antenna->row(i) = -(u - u_o).transpose() * frame.R_ew;
    }
  }

  template <class Values>
  void evaluate(const Values& values, double* e) const {
    double r[kCandidates];
    residuals(values, r);
    formulation.whiten(covariance, r, latent_value(values), e);
  }

  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<Scalar> J) const {
    double r[kCandidates], de_dn[kCandidates + 1];
    Eigen::Matrix<double, MaxCandidates, 3> d_antenna;
    residuals(values, r, &d_antenna);
    formulation.whiten(covariance, r, latent_value(values), e);

    const int m = size();
    const int columns = State::dof + static_cast<int>(is_phase ? ambiguities.size() : 0) + (is_phase && pivot_ambiguity.valid() ? 1 : 0);
    Eigen::Matrix<double, 3, State::dof> d_state;
    if constexpr (kObservable == Observable::doppler)
      (void)antenna.velocity_w_mps(values(state), &d_state);
    else
      (void)antenna.position_w_m(values(state), &d_state);
    Dense d_r;
    d_r.m = m, d_r.n = columns;
    for (int i = 0; i < m; ++i)
      for (int c = 0; c < State::dof; ++c) d_r(i, c) = d_antenna.row(i).dot(d_state.col(c));
    if constexpr (is_phase) {
      for (int i = 0; i < m; ++i)
        for (int c = State::dof; c < columns; ++c) d_r(i, c) = 0;
      for (int i = 0; i < m; ++i) {
        d_r(i, State::dof + i) = -wavelength_m;
        if (pivot_ambiguity.valid()) d_r(i, columns - 1) = wavelength_m;
      }
    }
    formulation.whiten_jacobian(covariance, d_r, J, de_dn);
    if constexpr (FormulationType::has_latent)
      for (int i = 0; i <= m; ++i) J(i, columns) = de_dn[i];
  }

  double weigh(const double* e, double* w) const {
    const double rho = formulation.weigh(e, rows(), w);
    for (int i = 0; i < rows(); ++i) w[i] *= information_share;
    return rho * information_share;
  }

  /// A start for the latent pivot error at given values of the other variables.
  template <class Values>
  [[nodiscard]] double initial_latent(const Values& values) const {
    double r[kCandidates];
    residuals(values, r);
    if constexpr (FormulationType::has_latent) return formulation.robust_initial_latent(covariance, r);
    return 0;
  }

 private:
  /// A plain m x n matrix on the stack for whiten_jacobian.
  struct Dense {
    int m{0}, n{0};
    double data[static_cast<std::size_t>(MaxCandidates) * static_cast<std::size_t>(max_columns)];
    [[nodiscard]] double& operator()(int i, int c) { return data[c * MaxCandidates + i]; }
    [[nodiscard]] double operator()(int i, int c) const { return data[c * MaxCandidates + i]; }
    [[nodiscard]] int rows() const { return m; }
    [[nodiscard]] int cols() const { return n; }
  };

  [[nodiscard]] static double model(const Vector3& at_e, const BatchMember& s, Vector3& u) {
    if constexpr (kObservable == Observable::doppler) {
      u = s.satellite_e_m;
      return u.dot(at_e);
    } else {
      return range_m(at_e, s.satellite_e_m, &u);
    }
  }
  template <class Values>
  [[nodiscard]] double latent_value(const Values& values) const {
    if constexpr (FormulationType::has_latent)
      return values(latent).value;
    else
      return 0;
  }
};

/// What a scalar constraint on ambiguities stands for; each purpose is a factor type of its own, so that it can be switched on and off.
enum class AmbiguityConstraint : std::uint8_t {
  datum,       ///< weak: makes a fresh ambiguity well-posed
  continuity,  ///< random walk between the arcs of one satellite [paper eq. (ambiguity-random-walk)]
  integer      ///< an accepted integer [paper eq. (fixed-ambiguity-factor)]
};

/// (a - b - mean) / sigma, cycles; b may be absent.
template <AmbiguityConstraint kPurpose>
struct AmbiguityFactor {
  using Scalar = math::DeferredFor<double, kPurpose>;
  static constexpr int max_rows = 1, max_keys = 2, max_columns = 2;
  static constexpr const char* name =
      kPurpose == AmbiguityConstraint::datum ? "ambiguity datum" : kPurpose == AmbiguityConstraint::continuity ? "ambiguity walk" : "integer fix";
  smoother::Key<Ambiguity> a{}, b{};
  double mean_cycles{0}, sigma_cycles{1};

  [[nodiscard]] int rows() const { return 1; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(a);
    if (b.valid()) visit(b);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    const double difference = values(a).value - (b.valid() ? values(b).value : 0.0);
    e[0] = (difference - mean_cycles) / sigma_cycles;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<Scalar> J) const {
    evaluate(values, e);
    J(0, 0) = 1 / sigma_cycles;
    if (b.valid()) J(0, 1) = -1 / sigma_cycles;
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 1, w); }
};

/// Weak prior of a fresh ambiguity: (a - mean) / sigma.
using AmbiguityDatum = AmbiguityFactor<AmbiguityConstraint::datum>;
/// Random walk from one arc of a satellite to the next: (a - b) / sigma.
using AmbiguityWalk = AmbiguityFactor<AmbiguityConstraint::continuity>;
/// An accepted integer: (a - b - mean) / sigma with a tight sigma.
using IntegerFix = AmbiguityFactor<AmbiguityConstraint::integer>;
static_assert(smoother::Factor<AmbiguityDatum> && smoother::Factor<IntegerFix>);

}  // namespace searvins::gnss
