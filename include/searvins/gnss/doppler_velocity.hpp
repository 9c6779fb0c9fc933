// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Velocity of one receiver from the Doppler shifts of one epoch, robustly.
///
/// Unknowns: velocity in ECEF (m/s) and c times the receiver clock drift (m/s), one drift for all constellations. With u the direction from
/// satellite to receiver, one Doppler D says (range.hpp for the exact form)
///
///     -wavelength D + c satellite_clock_rate  =  range_rate(p, v) + drift + noise
///
/// which is linear in v and drift: no start is needed. A position error of 1 km makes an error of 0.2 m/s, one of 10 m 2 mm/s.
/// Outliers (a reflection has the Doppler of its mirror path) fall to the same ladder as in single_point.hpp: graduated Geman-McClure
/// weights, hard exclusion, chi-square test with leave-one-out.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/weighting.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/quantiles.hpp>
#include <searvins/math/small_cholesky.hpp>
#include <searvins/robust/loss.hpp>

namespace searvins::gnss {

/// Settings of a Doppler velocity.
struct DopplerOptions {
  Screening screening{10 * std::numbers::pi / 180, 15};
  EphemerisPolicy ephemeris{};
  double sigma_mps{0.05};      ///< of a range rate at 45 dB-Hz at the zenith; grows with 1 / sin elevation and falling C/N0
  double cn0_decade_db{4};     ///< of that growth of the variance: a weak Doppler is that of a reflection, off by metres per second
  double outlier_sigmas{3.5};  ///< hard exclusion
  double false_alarm{1e-3};    ///< of the chi-square test of what is left
};

/// A Gaussian prediction of the velocity.
struct VelocityPrior {
  Eigen::Vector3d velocity_e_mps{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d information{Eigen::Matrix3d::Zero()};  ///< (m/s)^-2
};

/// One range rate, used or not. Scalar: double or wider, as in everything here.
template <class Scalar>
struct BasicDopplerRow {
  using Direction = Eigen::Matrix<Scalar, 4, 1, Eigen::DontAlign>;

  SatelliteId satellite{};
  SignalCode signal{};
  bool used{true};
  double rate_mps{0};  ///< measured, satellite clock removed, minus that of a receiver at rest
  double sigma_mps{0};
  double residual_mps{0};                  ///< at the solution
  Direction direction{Direction::Zero()};  ///< d rate / d (velocity, drift)
};

using DopplerRow = BasicDopplerRow<double>;  ///< in double precision

inline constexpr std::size_t kMaxDopplerRows = 2 * kMaxSatellitesPerEpoch;  ///< Dopplers of one solution

/// What a solution says besides its rows.
template <class Scalar>
struct BasicDopplerEstimate {
  using Vector3 = math::Vector3<Scalar>;
  using Covariance = Eigen::Matrix<Scalar, 4, 4, Eigen::DontAlign>;

  Vector3 velocity_e_mps{Vector3::Zero()};
  double drift_mps{0};                        ///< c times the rate of the receiver clock
  Covariance covariance{Covariance::Zero()};  ///< of (velocity, drift); scaled up when the chi-square test fails
  int used{0}, excluded{0};
  double chi_square{0};
  int redundancy{0};
  bool consistent{false};  ///< the chi-square test was passed, with redundancy

  [[nodiscard]] math::Matrix3<Scalar> velocity_covariance_m2ps2() const { return covariance.template topLeftCorner<3, 3>(); }
};

/// Velocity and drift of one epoch. Some 8 kB: where a stack is small, keep one and have it filled.
template <class Scalar>
struct BasicDopplerVelocity : BasicDopplerEstimate<Scalar> {
  StaticVector<BasicDopplerRow<Scalar>, kMaxDopplerRows> rows{};

  /// As it was made, without another one beside it.
  void clear() {
    static_cast<BasicDopplerEstimate<Scalar>&>(*this) = {};
    rows.clear();
  }
};

using DopplerVelocity = BasicDopplerVelocity<double>;  ///< in double precision

namespace detail {

/// Weighted least squares over the used rows. False when the geometry does not determine the four unknowns.
template <class Scalar, class Weight>
[[nodiscard]] bool solve_doppler(const BasicDopplerVelocity<Scalar>& d, const VelocityPrior& prior, Weight weight,
                                 Eigen::Matrix<Scalar, 4, 1>& x, Eigen::Matrix<Scalar, 4, 4, Eigen::DontAlign>* covariance = nullptr) {
  using Vector4 = Eigen::Matrix<Scalar, 4, 1>;
  using Matrix4 = Eigen::Matrix<Scalar, 4, 4>;
  const math::Matrix3<Scalar> information = prior.information;
  Matrix4 N = Matrix4::Zero();
  Vector4 g = Vector4::Zero();
  N.template topLeftCorner<3, 3>() = information;
  g.template head<3>() = information * prior.velocity_e_mps;
  for (const auto& r : d.rows) {
    if (!r.used) continue;
    const double w = weight(r) / (r.sigma_mps * r.sigma_mps);
    N.noalias() += w * r.direction * r.direction.transpose();
    g += w * r.rate_mps * r.direction;
  }
  const math::SmallCholesky<4, Scalar> factor(N);
  if (!factor.ok()) return false;
  x = factor.solve(g);
  if (covariance) *covariance = factor.inverse();
  return x.allFinite();
}

template <class Scalar>
[[nodiscard]] inline double standardised(const BasicDopplerRow<Scalar>& r, const Eigen::Matrix<Scalar, 4, 1>& x) {
  return (r.rate_mps - r.direction.dot(x)) / r.sigma_mps;
}

/// Graduated Geman-McClure weights from the plain solution down to two sigma, one constellation (kConstellations: none) left out while the
/// scale is coarse. Returns the robust cost, infinite when the geometry fails.
template <class Scalar>
[[nodiscard]] inline double descend_doppler(const BasicDopplerVelocity<Scalar>& d, const VelocityPrior& prior, std::size_t without,
                                            Eigen::Matrix<Scalar, 4, 1>& x) {
  constexpr double failed = std::numeric_limits<double>::infinity(), final_scale = 2;
  const auto left_out = [&](const auto& r) { return static_cast<std::size_t>(r.satellite.constellation) == without; };
  if (!solve_doppler(
          d, prior, [&](const auto& r) { return left_out(r) ? 1e-6 : 1.0; }, x))
    return failed;
  double c = final_scale;
  for (const auto& r : d.rows) c = std::max(c, std::abs(standardised(r, x)));
  for (int settled = 0, i = 0; settled < 5 && i < 60; ++i) {
    const robust::GemanMcClure<double> loss{c};
    const Eigen::Matrix<Scalar, 4, 1> at = x;
    const bool coarse = c > final_scale;
    const auto weight = [&](const auto& r) {
      const double z = standardised(r, at);
      return coarse && left_out(r) ? 1e-6 : loss.weight(z * z);
    };
    if (!solve_doppler(d, prior, weight, x)) return failed;
    if (!coarse) ++settled;
    c = std::max(final_scale, 0.6 * c);
  }
  const robust::GemanMcClure<double> loss{final_scale};
  const math::Vector3<Scalar> off = x.template head<3>() - prior.velocity_e_mps;
  double cost = 0.5 * off.dot(prior.information * off);
  for (const auto& r : d.rows) cost += loss.rho(standardised(r, x) * standardised(r, x));
  return cost;
}

/// The descent of least cost: with all satellites, or with a constellation left out at first.
template <class Scalar>
[[nodiscard]] inline bool best_doppler(const BasicDopplerVelocity<Scalar>& d, const VelocityPrior& prior,
                                       Eigen::Matrix<Scalar, 4, 1>& best) {
  double best_cost = std::numeric_limits<double>::infinity();
  for (std::size_t without = 0; without <= kConstellations; ++without) {
    Eigen::Matrix<Scalar, 4, 1> x;
    const double cost = descend_doppler(d, prior, without, x);
    if (cost < best_cost) best = x, best_cost = cost;
  }
  return std::isfinite(best_cost);
}

/// Excludes rows until the chi-square test passes or there is no redundancy left; x and covariance are of what is left.
template <class Scalar>
[[nodiscard]] inline Status exclude_doppler_outliers(const DopplerOptions& options, const VelocityPrior& prior,
                                                     BasicDopplerVelocity<Scalar>& d, Eigen::Matrix<Scalar, 4, 1>& x) {
  for (auto& r : d.rows) r.used = std::abs(standardised(r, x)) <= options.outlier_sigmas;
  for (;;) {
    const int used = static_cast<int>(std::count_if(d.rows.begin(), d.rows.end(), [](const auto& r) { return r.used; }));
    if (used < 4) return failure(StatusCode::too_few, "Doppler velocity: too few range rates agree", used, 4);
    if (!solve_doppler(
            d, prior, [](const auto&) { return 1.0; }, x, &d.covariance))
      return failure(StatusCode::under_determined, "Doppler velocity: the satellites that agree do not determine a velocity");
    d.used = used, d.redundancy = used - 4, d.chi_square = 0;
    BasicDopplerRow<Scalar>* worst = nullptr;
    double largest = 0;
    for (auto& r : d.rows) {
      if (!r.used) continue;
      const double z = standardised(r, x), own_share = r.direction.dot(d.covariance * r.direction) / (r.sigma_mps * r.sigma_mps);
      d.chi_square += z * z;
      if (own_share < 0.999 && std::abs(z) / std::sqrt(1 - own_share) > largest)
        largest = std::abs(z) / std::sqrt(1 - own_share), worst = &r;
    }
    const Result<double> bound = math::chi_square_threshold(options.false_alarm, std::max(d.redundancy, 1));
    if (!bound) return bound.status();
    d.consistent = d.redundancy > 0 && d.chi_square <= *bound;
    if (d.consistent || d.redundancy <= 1 || !worst) return ok_status();
    worst->used = false;
  }
}

/// The range rates of an epoch that pass the screens, up to two carriers a satellite.
template <class Scalar, std::size_t N>
void collect_range_rates(const ObservationEpoch& epoch, const EphemerisStore<N>& store, const math::Vector3<Scalar>& position_e_m,
                         const DopplerOptions& options, BasicDopplerVelocity<Scalar>& d) {
  using Vector3 = math::Vector3<Scalar>;
  for (const SatelliteObservation& s : epoch.satellites) {
    std::array<char, 2> bands{};
    std::size_t taken = 0;
    for (const SignalObservation& o : s.signals) {
      if (taken == bands.size() || (taken == 1 && bands[0] == o.signal.band)) continue;
      if (!o.has_doppler() || !plausible_code(o) || !strong_enough(o, options.screening)) continue;
      const Result<Transmission> t = transmission_from_code(store, s.satellite, epoch.tag, o.code_m, options.ephemeris);
      if (!t) continue;
      const double elevation_rad = geodesy::azimuth_elevation(position_e_m, t->state.position_e_m).elevation_rad;
      if (!high_enough(elevation_rad, options.screening)) continue;
      BasicDopplerRow<Scalar> r;
      r.satellite = s.satellite, r.signal = o.signal;
      Vector3 d_rate_d_v;
      const double at_rest_mps = range_rate_mps(position_e_m, Vector3::Zero(), t->state.position_e_m, t->state.velocity_e_mps, &d_rate_d_v);
      r.rate_mps = -wavelength_m(o.signal) * o.doppler_hz + kSpeedOfLightMps * t->state.clock_rate_sps - at_rest_mps;
      r.direction << d_rate_d_v, 1.0;
      r.sigma_mps = options.sigma_mps * std::sqrt(cn0_variance_factor(o.cn0_dbhz, options.cn0_decade_db)) / std::sin(elevation_rad);
      if (d.rows.push_back(r)) bands[taken++] = o.signal.band;
    }
  }
}

/// The velocity from the rows of `d`; the rest of `d` is filled when that succeeds.
template <class Scalar>
[[nodiscard]] inline Status velocity_from_range_rates(const DopplerOptions& options, const VelocityPrior& prior,
                                                      BasicDopplerVelocity<Scalar>& d) {
  if (d.rows.size() < 4)
    return failure(StatusCode::too_few, "Doppler velocity: fewer than four range rates", static_cast<int>(d.rows.size()), 4);
  Eigen::Matrix<Scalar, 4, 1> x;
  if (!best_doppler(d, prior, x))
    return failure(StatusCode::under_determined, "Doppler velocity: the satellites do not determine a velocity");
  if (const Status s = exclude_doppler_outliers(options, prior, d, x); !s) return s;
  for (auto& r : d.rows) r.residual_mps = r.rate_mps - r.direction.dot(x);
  d.excluded = static_cast<int>(d.rows.size()) - d.used;
  if (!d.consistent && d.redundancy > 0) d.covariance *= std::max(1.0, d.chi_square / d.redundancy);
  d.velocity_e_mps = x.template head<3>();
  d.drift_mps = x[3];
  return ok_status();
}

}  // namespace detail

/// Velocity at an epoch whose position is roughly known, into `out`. Every Doppler that passes the screens takes part, up to two carriers
/// a satellite. A prior with zero information is none. Errors, `out` cleared: non_finite (position), too_few (fewer than four range
/// rates, or than four that agree), under_determined (geometry).
template <class Scalar, std::size_t N>
Status solve_doppler_velocity(const ObservationEpoch& epoch, const EphemerisStore<N>& store, const math::Vector3<Scalar>& position_e_m,
                              const DopplerOptions& options, const VelocityPrior& prior, BasicDopplerVelocity<Scalar>& out) {
  out.clear();
  if (!position_e_m.allFinite()) return failure(StatusCode::non_finite, "Doppler velocity: position is not finite");
  detail::collect_range_rates(epoch, store, position_e_m, options, out);
  const Status s = detail::velocity_from_range_rates(options, prior, out);
  if (!s) out.clear();
  return s;
}

/// The same by value: some 8 kB, several times on its way.
template <class Scalar = double, std::size_t N>
[[nodiscard]] Result<BasicDopplerVelocity<Scalar>> solve_doppler_velocity(const ObservationEpoch& epoch, const EphemerisStore<N>& store,
                                                                          const math::Vector3<Scalar>& position_e_m,
                                                                          const DopplerOptions& options = {},
                                                                          const VelocityPrior& prior = {}) {
  BasicDopplerVelocity<Scalar> out;
  if (const Status s = solve_doppler_velocity(epoch, store, position_e_m, options, prior, out); !s) return s;
  return out;
}

}  // namespace searvins::gnss
