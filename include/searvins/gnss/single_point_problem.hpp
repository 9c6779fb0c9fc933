// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The estimation behind single_point.hpp: the rows of one epoch, their residuals and the steps that every stage of the search repeats.
///
/// A step solves the normal equations of
///
///     s sum_i w_i (r_i - a_i' dx)^2 / sigma_i^2  +  |x + dx - prior|^2 in the prior's information  +  receiver delays
///
/// r = corrected code - model at x, a = d model / d x, w the robust weights, s the scale of the data's information against the prior's.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/atmosphere.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/single_point_solution.hpp>
#include <searvins/gnss/weighting.hpp>
#include <searvins/math/small_cholesky.hpp>
#include <searvins/robust/loss.hpp>

namespace searvins::gnss {

namespace detail {

/// Bands in order of preference when the caller names no signals.
[[nodiscard]] constexpr const char* preferred_bands(Constellation c) {
  switch (c) {
    case Constellation::beidou: return "216578";
    case Constellation::galileo: return "157864";
    case Constellation::gps:
    case Constellation::qzss: break;
  }
  return "1256";
}

/// The estimation of one epoch: rows, prior and the few linear-algebra steps that every stage repeats. Scalar: double or wider.
template <class Scalar>
class BasicSinglePointProblem {
 public:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Vector = BasicSinglePointVector<Scalar>;
  using Matrix = BasicSinglePointMatrix<Scalar>;
  using Prior = BasicSinglePointPrior<Scalar>;

  BasicSinglePointProblem(const SinglePointOptions& options, const std::optional<Prior>& prior, BasicSinglePointSolution<Scalar>& out)
      : options_(options), prior_(prior), rows_(out.rows) {}

  template <std::size_t N>
  void collect(const ObservationEpoch& epoch, const EphemerisStore<N>& store) {
    for (const SatelliteObservation& s : epoch.satellites) collect_satellite(s, epoch.tag, store);
    ionosphere_ = store.ionosphere.present() ? store.ionosphere : kTypicalIonosphere;
  }

  /// Rows that could be used, and unknowns that they have without prior.
  [[nodiscard]] int candidates() const {
    return static_cast<int>(std::count_if(rows_.begin(), rows_.end(), [](const CodeRow& r) { return r.fate == CodeFate::used; }));
  }

  /// Elevation, delays, sigmas and the mask at a position; rows hidden by the mask come back when the position changes.
  void place(const Vector3& p_e_m) {
    const geodesy::Geodetic g = geodesy::geodetic_from_ecef(p_e_m);
    for (CodeRow& r : rows_) {
      if (r.fate != CodeFate::used && r.fate != CodeFate::low && r.fate != CodeFate::outlier) continue;
      const geodesy::AzimuthElevation line = geodesy::azimuth_elevation(p_e_m, r.transmission.state.position_e_m);
      r.azimuth_rad = line.azimuth_rad, r.elevation_rad = line.elevation_rad;
      const double troposphere_m = troposphere_delay_m(g, line.elevation_rad);
      const double ionosphere_m = klobuchar_delay_m(ionosphere_, g, line, r.transmission.time, frequency_hz(r.signal));
      r.atmosphere_m = troposphere_m + ionosphere_m;
      const double model_m =
          std::hypot(options_.ionosphere_relative_sigma * ionosphere_m, options_.troposphere_relative_sigma * troposphere_m);
      r.sigma_m = std::sqrt(options_.sigma.undifferenced_code_variance_m2(r.signal, line.elevation_rad) *
                                cn0_variance_factor(r.cn0_dbhz, options_.cn0_decade_db) +
                            options_.satellite_variance_factor * r.transmission.state.variance_m2 + model_m * model_m);
      r.fate = high_enough(line.elevation_rad, options_.screening) ? CodeFate::used : CodeFate::low;
    }
  }

  void forget_place() {
    for (CodeRow& r : rows_) r.atmosphere_m = 0, r.sigma_m = 10;
  }

  /// Least squares without weights from a rough start. False when the geometry does not determine the unknowns.
  [[nodiscard]] bool converge_plainly(Vector& x) const {
    for (int i = 0; i < 12; ++i) {
      Vector step;
      if (!solve(
              x, [](const CodeRow&) { return 1.0; }, step))
        return false;
      x += step;
      if (!x.allFinite() || x.template head<3>().norm() > 1e9) return false;
      if (step.template head<3>().norm() < 1e-3) return true;
    }
    return true;
  }

  /// Graduated robust descent. While the scale is coarse, the constellation `without` (kConstellations: none) is left out and late codes
  /// count `lateness` times on top of the options' factor. Returns the robust cost.
  [[nodiscard]] double descend(Vector& x, std::size_t without, double lateness) const {
    double c = std::max(largest_residual(x), kFinalScale);
    for (int settled = 0, i = 0; settled < 5 && i < 60; ++i) {
      const robust::GemanMcClure<double> loss{c};
      Vector step;
      const bool coarse = c > kFinalScale;
      const auto weight = [&](const CodeRow& r) {
        if (coarse && static_cast<std::size_t>(r.satellite.constellation) == without) return 1e-6;
        const double z = suspicion(x, r) * (coarse && residual_m(x, r) > 0 ? lateness : 1.0);
        return loss.weight(z * z);
      };
      if (!solve(x, weight, step)) return std::numeric_limits<double>::infinity();
      x += step;
      if (!coarse) ++settled;
      c = std::max(kFinalScale, c * 0.6);
    }
    return robust_cost(x);
  }

  [[nodiscard]] double robust_cost(const Vector& x) const {
    const robust::GemanMcClure<double> loss{kFinalScale};
    double cost = 0;
    for (const CodeRow& r : rows_) {
      if (r.fate != CodeFate::used) continue;
      const double z = suspicion(x, r);
      cost += options_.data_information_scale * loss.rho(z * z);
    }
    return cost + prior_cost(x);
  }

  /// Solves with the used rows at full weight; x is improved, `covariance` filled.
  [[nodiscard]] bool refine(Vector& x, Matrix* covariance = nullptr) const {
    for (int i = 0; i < 3; ++i) {
      Vector step;
      if (!solve(
              x, [](const CodeRow&) { return 1.0; }, step, covariance))
        return false;
      x += step;
    }
    return x.allFinite();
  }

  /// Marks what lies beyond `outlier_sigmas` of x as outlier, and takes back what does not.
  void select(const Vector& x) {
    for (CodeRow& r : rows_)
      if (r.fate == CodeFate::used || r.fate == CodeFate::outlier)
        r.fate = suspicion(x, r) <= options_.outlier_sigmas ? CodeFate::used : CodeFate::outlier;
  }

  /// The used row with the largest residual over its own standard deviation given the others; nullptr when no row is checked by others.
  [[nodiscard]] CodeRow* least_plausible(const Vector& x, const Matrix& covariance) {
    CodeRow* worst = nullptr;
    double largest = 0;
    for (CodeRow& r : rows_) {
      if (r.fate != CodeFate::used) continue;
      const Vector a = direction(x, r);
      const double own_share = options_.data_information_scale * a.dot(covariance.lazyProduct(a)) / (r.sigma_m * r.sigma_m);
      if (own_share > 0.999) continue;
      const double z = std::abs(residual_m(x, r)) / (r.sigma_m * std::sqrt(1 - own_share));
      if (z > largest) largest = z, worst = &r;
    }
    return worst;
  }

  [[nodiscard]] double chi_square(const Vector& x) const {
    double sum = 2 * prior_cost(x);
    for (const CodeRow& r : rows_) {
      if (r.fate != CodeFate::used) continue;
      const double z = residual_m(x, r) / r.sigma_m;
      sum += z * z;
    }
    return sum;
  }

  /// Rows used minus the unknowns that nothing else determines: the common clock, and the position when there is no prior.
  [[nodiscard]] int redundancy() const { return candidates() - (prior_ ? 1 : 4); }

  [[nodiscard]] double residual_m(const Vector& x, const CodeRow& r) const {
    return r.corrected_m - r.atmosphere_m - range_m(x.template head<3>(), r.transmission.state.position_e_m) - x[clock_index(r)] -
           (is_other_carrier(r) ? x[3 + kSinglePointClocks] : 0.0);
  }

  /// Residual in sigmas, late ones counted `late_factor` times.
  [[nodiscard]] double suspicion(const Vector& x, const CodeRow& r) const {
    const double z = residual_m(x, r) / r.sigma_m;
    return z > 0 ? options_.late_factor * z : -z;
  }

  [[nodiscard]] static int clock_index(const CodeRow& r) { return 3 + static_cast<int>(r.satellite.constellation); }

  /// Anything but L1, E1, B1C and B1I.
  [[nodiscard]] static bool is_other_carrier(const CodeRow& r) {
    return r.signal.band != '1' && !(r.signal.band == '2' && r.satellite.constellation == Constellation::beidou);
  }

  /// d (modelled code) / d x.
  [[nodiscard]] static Vector direction(const Vector& x, const CodeRow& r) {
    Vector a = Vector::Zero();
    Vector3 d_range_d_p;
    static_cast<void>(range_m(x.template head<3>(), r.transmission.state.position_e_m, &d_range_d_p));
    a.template head<3>() = d_range_d_p;
    a[clock_index(r)] = 1;
    if (is_other_carrier(r)) a[3 + kSinglePointClocks] = 1;
    return a;
  }

 private:
  static constexpr double kFinalScale = 2;  // of the Geman-McClure weights, sigmas

  template <std::size_t N>
  void collect_satellite(const SatelliteObservation& s, GpsTime tag, const EphemerisStore<N>& store) {
    CodeRow row;
    row.satellite = s.satellite;
    row.fate = CodeFate::no_code;
    std::size_t taken = 0;
    const auto consider = [&](const SignalObservation& o) {
      if (taken >= options_.codes_per_satellite || !plausible_code(o)) return;
      row.signal = o.signal, row.cn0_dbhz = o.cn0_dbhz;
      row.fate = CodeFate::weak;
      if (!strong_enough(o, options_.screening)) return;
      const Result<Transmission> t = transmission_from_code(store, s.satellite, tag, o.code_m, options_.ephemeris);
      row.fate = t ? CodeFate::used : CodeFate::no_ephemeris;
      if (!t) return;
      row.transmission = *t;
      row.corrected_m = o.code_m + kSpeedOfLightMps * (t->state.clock_s - group_delay_s(*t->ephemeris, o.signal));
      if (rows_.push_back(row)) ++taken;
    };
    if (!options_.signals.empty()) {
      for (const SignalCode& wanted : options_.signals)
        if (const SignalObservation* o = s.find(wanted)) consider(*o);
    } else {
      for (const char* band = preferred_bands(s.satellite.constellation); *band; ++band) {
        const std::size_t before = taken;
        for (const SignalObservation& o : s.signals)
          if (o.signal.band == *band && taken == before) consider(o);
      }
    }
    if (taken == 0) static_cast<void>(rows_.push_back(row));
  }

  [[nodiscard]] double prior_cost(const Vector& x) const {
    if (!prior_) return 0;
    const Vector d = x - prior_->mean;
    return 0.5 * d.dot(prior_->information.lazyProduct(d));
  }

  [[nodiscard]] double largest_residual(const Vector& x) const {
    double largest = 0;
    for (const CodeRow& r : rows_)
      if (r.fate == CodeFate::used) largest = std::max(largest, suspicion(x, r));
    return largest;
  }

  /// Information of the receiver's delays; it also ties the clock of a constellation without rows to the others.
  void add_receiver_delays(const Vector& x, Matrix& N, Vector& g) const {
    constexpr int n = kSinglePointClocks;
    Eigen::Matrix<Scalar, n, 1> d;
    for (int c = 0; c < n; ++c)
      d[c] = 1.0 / (options_.clock_difference_sigma_m[static_cast<std::size_t>(c)] *
                    options_.clock_difference_sigma_m[static_cast<std::size_t>(c)]);
    Eigen::Matrix<Scalar, n, n> form = -d * d.transpose() / d.sum();
    form.diagonal() += d;
    N.template block<n, n>(3, 3) += form;
    g.template segment<n>(3) -= form * x.template segment<n>(3);
    const double other = 1.0 / (options_.other_carrier_sigma_m * options_.other_carrier_sigma_m);
    N(3 + n, 3 + n) += other;
    g[3 + n] -= other * x[3 + n];
  }

  /// One weighted Gauss-Newton step; weights multiply the information of the rows. False when the system is not positive definite.
  template <class Weight>
  [[nodiscard]] bool solve(const Vector& x, Weight weight, Vector& step, Matrix* covariance = nullptr) const {
    Matrix N = Matrix::Zero();
    Vector g = Vector::Zero();
    for (const CodeRow& r : rows_) {
      if (r.fate != CodeFate::used) continue;
      const Vector a = direction(x, r);
      const double w = options_.data_information_scale * weight(r) / (r.sigma_m * r.sigma_m);
      for (int i = 0; i < kSinglePointUnknowns; ++i)
        for (int j = 0; j <= i; ++j) N(i, j) += w * a[i] * a[j];
      g += w * residual_m(x, r) * a;
    }
    if (prior_) {
      N += prior_->information;
      g += prior_->information.lazyProduct(prior_->mean - x);
    }
    if (!prior_ || !prior_->knows_receiver_delays) add_receiver_delays(x, N, g);
    const math::SmallCholesky<kSinglePointUnknowns, Scalar> factor(N);
    if (!factor.ok()) return false;
    step = factor.solve(g);
    if (covariance) *covariance = factor.inverse();
    return step.allFinite();
  }

  const SinglePointOptions& options_;
  const std::optional<Prior>& prior_;
  StaticVector<CodeRow, kMaxCodeRows>& rows_;
  KlobucharCoefficients ionosphere_{};
};

using SinglePointProblem = BasicSinglePointProblem<double>;  ///< in double precision

}  // namespace detail
}  // namespace searvins::gnss
