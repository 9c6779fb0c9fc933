// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A causal filter over single-point solutions: Doppler carries the position across the streets where most codes are reflected.
///
/// State x = (v, p, b): velocity and position in ECEF, clocks and carrier delay as in single_point.hpp; metres and seconds. Per epoch
///
///     1. predict     p += v dt, white acceleration (horizontal and vertical sigma), a slow walk of the clock differences and the delay
///     2. velocity    robust Doppler solution with the predicted velocity as prior
///     3. position    robust single point with the predicted (p, b) as prior
///
/// The receiver clock itself is not predicted: the prior of (p, b) is P^-1 with the common clock u (1 at every clock) taken out,
///
///     L = P^-1 - P^-1 u u' P^-1 / (u' P^-1 u)
///
/// the limit of P + k u u' for k -> infinity, so jumps of any size do not matter. Steps 2 and 3 return posteriors of a part s of the
/// state that contain the prior; the rest follows by x_r += G (s+ - s-), P_r,s = G C+, P_rr -= G (P_ss - C+) G' with G = P_rs L.
///
/// Code errors in a street last for many seconds, so one epoch must not count as independent of the last: its information is scaled by
/// dt / correlation_s. When the codes alone tell a consistent story that excludes the prediction, for several epochs in a row, the
/// filter starts anew from them. Every answer says how it came about; there is no silent hold.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/doppler_velocity.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/single_point.hpp>
#include <searvins/math/quantiles.hpp>
#include <searvins/math/small_cholesky.hpp>

namespace searvins::gnss {

/// How the filter moves and when it doubts itself.
struct TrackerOptions {
  SinglePointOptions single_point{};
  DopplerOptions doppler{};
  double horizontal_acceleration_mps2{2};  ///< sigma of the unmodelled acceleration over one epoch
  double vertical_acceleration_mps2{0.3};
  double position_walk_m{0.5};         ///< per root second: what velocity errors do not explain
  double receiver_delay_walk_m{0.05};  ///< per root second: differences of the constellation clocks, delay of the other carriers
  double doppler_floor_mps{0.2};       ///< added in quadrature to the Doppler velocity: reflections move it as a whole
  double correlation_s{5};             ///< of code errors
  double systematic_sigma_m{1.5};      ///< added in quadrature to the reported position: the atmosphere's error does not average out
  double start_sigma_m{5};             ///< least sigma of a start: one epoch in a street can be consistent and wrong
  double doubt_false_alarm{1e-4};      ///< of the test of codes alone against the prediction
  int doubts_until_restart{3};         ///< consecutive epochs that contradict
  double max_gap_s{30};                ///< longer gaps start anew; also the longest time without any code
};

/// How a tracked position came about.
enum class TrackStatus : std::uint8_t {
  started,    ///< from codes alone, for the first time or after a gap
  tracked,    ///< prediction and codes agree
  coasted,    ///< prediction (and Doppler) only: no codes at this epoch, or none that agree
  doubtful,   ///< codes alone contradict the prediction; the answer is the filter's
  restarted,  ///< contradicted several times: from codes alone
};

/// One epoch of the filter.
struct TrackedPosition {
  GpsTime time{};
  TrackStatus status{TrackStatus::started};
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity_e_mps{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d position_covariance_m2{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d velocity_covariance_m2ps2{Eigen::Matrix3d::Zero()};
  bool doppler_used{false};
  int doubts{0};                       ///< consecutive contradictions so far
  SinglePointSolution single_point{};  ///< rows, residuals and clocks of this epoch; empty when coasted
};

/// The filter. Feed epochs in time order.
class SinglePointTracker {
 public:
  explicit SinglePointTracker(const TrackerOptions& options = {}) : options_(options) {}

  /// Forgets everything.
  void reset() { *this = SinglePointTracker(options_); }
  [[nodiscard]] bool running() const { return running_; }

  /// Takes one epoch. Errors: out_of_order (tag not after the last one; nothing is changed); those of solve_single_point while there
  /// is nothing to track; stale (no usable code for max_gap_s: the filter has forgotten its state).
  template <std::size_t N>
  [[nodiscard]] Result<TrackedPosition> update(const ObservationEpoch& epoch, const EphemerisStore<N>& store) {
    if (!running_) return start(epoch, store, TrackStatus::started);
    const double dt_s = seconds_between(tag_, epoch.tag);
    if (!(dt_s > 0)) return failure(StatusCode::out_of_order, "tracker: epoch not after the last one", -1, -1, dt_s);
    if (dt_s > options_.max_gap_s) return start(epoch, store, TrackStatus::started);
    predict(dt_s);
    tag_ = epoch.tag;
    TrackedPosition out;
    out.doppler_used = absorb_doppler(epoch, store);

    SinglePointOptions options = options_.single_point;
    options.data_information_scale *= std::min(1.0, dt_s / options_.correlation_s);
    const std::optional<SinglePointPrior> prior = position_prior();
    if (!prior) return start(epoch, store, TrackStatus::restarted);
    const Result<SinglePointSolution> with_prior = solve_single_point(epoch, store, options, prior);
    const bool contradicted = contradicts(epoch, store, with_prior);
    doubts_ = contradicted ? doubts_ + 1 : 0;
    if (doubts_ >= options_.doubts_until_restart) return start(epoch, store, TrackStatus::restarted);
    if (!with_prior) return coast(with_prior.status(), dt_s, contradicted, out);
    coasting_s_ = 0;
    out.status = contradicted ? TrackStatus::doubtful : TrackStatus::tracked;
    absorb_position(*prior, *with_prior);
    out.single_point = *with_prior;
    out.time = with_prior->time;
    return filled(out);
  }

 private:
  static constexpr int kSize = 3 + kSinglePointUnknowns;
  using State = Eigen::Matrix<double, kSize, 1>;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;

  template <std::size_t N>
  [[nodiscard]] Result<TrackedPosition> start(const ObservationEpoch& epoch, const EphemerisStore<N>& store, TrackStatus status) {
    running_ = false;
    const Result<SinglePointSolution> s = solve_single_point(epoch, store, options_.single_point);
    if (!s) return s.status();
    x_.setZero();
    P_.setZero();
    x_.tail<kSinglePointUnknowns>() = s->state;
    P_.bottomRightCorner<kSinglePointUnknowns, kSinglePointUnknowns>() = s->covariance;
    P_.diagonal().segment<3>(3).array() += options_.start_sigma_m * options_.start_sigma_m;
    P_.diagonal().head<3>().setConstant(kStartSpeedMps * kStartSpeedMps);
    tag_ = epoch.tag, running_ = true, doubts_ = 0, coasting_s_ = 0;
    TrackedPosition out;
    out.status = status;
    out.doppler_used = absorb_doppler(epoch, store);
    out.single_point = *s;
    out.time = s->time;
    return filled(out);
  }

  void predict(double dt_s) {
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(x_.segment<3>(3)));
    const double h = options_.horizontal_acceleration_mps2, v = options_.vertical_acceleration_mps2;
    const Eigen::Matrix3d acceleration = R_ew * Eigen::Vector3d(h * h, h * h, v * v).asDiagonal() * R_ew.transpose();
    x_.segment<3>(3) += dt_s * x_.head<3>();
    // P <- F P F' with F = I except p <- p + dt v, written as a row and a column operation.
    P_.middleRows<3>(3) += dt_s * P_.topRows<3>();
    P_.middleCols<3>(3) += dt_s * P_.leftCols<3>();
    P_.topLeftCorner<3, 3>() += dt_s * dt_s * acceleration;
    P_.block<3, 3>(0, 3) += 0.5 * dt_s * dt_s * dt_s * acceleration;
    P_.block<3, 3>(3, 0) += 0.5 * dt_s * dt_s * dt_s * acceleration;
    P_.block<3, 3>(3, 3) += 0.25 * dt_s * dt_s * dt_s * dt_s * acceleration;
    P_.diagonal().segment<3>(3).array() += options_.position_walk_m * options_.position_walk_m * dt_s;
    P_.diagonal().tail<kSinglePointClocks + 1>().array() += options_.receiver_delay_walk_m * options_.receiver_delay_walk_m * dt_s;
  }

  template <std::size_t N>
  [[nodiscard]] bool absorb_doppler(const ObservationEpoch& epoch, const EphemerisStore<N>& store) {
    const math::SmallCholesky<3> factor(P_.topLeftCorner<3, 3>());
    if (!factor.ok()) return false;
    const Eigen::Matrix3d information = factor.inverse();
    const Result<DopplerVelocity> d =
        solve_doppler_velocity(epoch, store, x_.segment<3>(3), options_.doppler, VelocityPrior{x_.head<3>(), information});
    if (!d || !d->consistent) return false;
    Eigen::Matrix3d after = d->velocity_covariance_m2ps2();
    after.diagonal().array() += options_.doppler_floor_mps * options_.doppler_floor_mps;
    const Eigen::Matrix<double, kSize, 3> gain = P_.leftCols<3>().lazyProduct(information);
    const Eigen::Matrix3d shrink = P_.topLeftCorner<3, 3>() - after;
    const Eigen::Vector3d change_mps = d->velocity_e_mps - x_.head<3>();
    x_ += gain.lazyProduct(change_mps);
    const Eigen::Matrix<double, kSize, 3> shrunk = gain.lazyProduct(shrink);
    P_ -= shrunk.lazyProduct(gain.transpose());
    symmetrise();
    return true;
  }

  /// (p, b) as predicted, the common clock unknown. Empty when the covariance has lost its definiteness.
  [[nodiscard]] std::optional<SinglePointPrior> position_prior() const {
    SinglePointPrior prior;
    const math::SmallCholesky<kSinglePointUnknowns> factor(P_.bottomRightCorner<kSinglePointUnknowns, kSinglePointUnknowns>());
    if (!factor.ok()) return std::nullopt;
    SinglePointVector common = SinglePointVector::Zero();
    common.segment<kSinglePointClocks>(3).setOnes();
    const SinglePointVector y = factor.solve(common);
    prior.mean = x_.tail<kSinglePointUnknowns>();
    prior.information = factor.inverse();
    prior.information -= (y / common.dot(y)).lazyProduct(y.transpose());
    prior.knows_receiver_delays = true;
    return prior;
  }

  void absorb_position(const SinglePointPrior& prior, const SinglePointSolution& s) {
    const Eigen::Matrix<double, 3, kSinglePointUnknowns> cross = P_.topRightCorner<3, kSinglePointUnknowns>();
    const Eigen::Matrix<double, 3, kSinglePointUnknowns> gain = cross.lazyProduct(prior.information);
    x_.head<3>() += gain.lazyProduct(s.state - prior.mean);
    x_.tail<kSinglePointUnknowns>() = s.state;
    const Eigen::Matrix<double, 3, kSinglePointUnknowns> carried = gain.lazyProduct(s.covariance);
    P_.topLeftCorner<3, 3>() += (carried - cross).lazyProduct(gain.transpose());
    P_.topRightCorner<3, kSinglePointUnknowns>() = carried;
    P_.bottomLeftCorner<kSinglePointUnknowns, 3>() = P_.topRightCorner<3, kSinglePointUnknowns>().transpose();
    P_.bottomRightCorner<kSinglePointUnknowns, kSinglePointUnknowns>() = s.covariance;
    symmetrise();
  }

  /// Do the codes alone, with clearly more satellites than agree with the prediction, put the receiver somewhere else?
  template <std::size_t N>
  [[nodiscard]] bool contradicts(const ObservationEpoch& epoch, const EphemerisStore<N>& store,
                                 const Result<SinglePointSolution>& with_prior) const {
    const int agreeing = with_prior ? with_prior->used : 0;
    if (with_prior && with_prior->consistent && agreeing >= with_prior->excluded) return false;
    const Result<SinglePointSolution> alone = solve_single_point(epoch, store, options_.single_point);
    if (!alone || !alone->consistent || 4 * alone->used <= 5 * agreeing) return false;
    const Eigen::Matrix3d sum = alone->position_covariance_m2() + P_.block<3, 3>(3, 3);
    const math::SmallCholesky<3> factor(sum);
    if (!factor.ok()) return false;
    const Eigen::Vector3d apart_m = alone->position_e_m - x_.segment<3>(3);
    const Result<double> bound = math::chi_square_threshold(options_.doubt_false_alarm, 3);
    return bound && apart_m.dot(factor.solve(apart_m)) > *bound;
  }

  [[nodiscard]] Result<TrackedPosition> coast(const Status& why, double dt_s, bool contradicted, TrackedPosition& out) {
    coasting_s_ += dt_s;
    if (coasting_s_ > options_.max_gap_s) {
      running_ = false;
      return failure(StatusCode::stale, why.what, -1, -1, coasting_s_);
    }
    out.status = contradicted ? TrackStatus::doubtful : TrackStatus::coasted;
    out.time = tag_.plus_seconds(-x_.segment<kSinglePointClocks>(6).mean() / kSpeedOfLightMps);
    return filled(out);
  }

  [[nodiscard]] TrackedPosition filled(TrackedPosition& out) const {
    out.position_e_m = x_.segment<3>(3);
    out.velocity_e_mps = x_.head<3>();
    out.position_covariance_m2 = P_.block<3, 3>(3, 3);
    out.position_covariance_m2.diagonal().array() += options_.systematic_sigma_m * options_.systematic_sigma_m;
    out.velocity_covariance_m2ps2 = P_.topLeftCorner<3, 3>();
    out.doubts = doubts_;
    return out;
  }

  void symmetrise() { P_ = (0.5 * (P_ + P_.transpose())).eval(); }

  static constexpr double kStartSpeedMps = 30;  // sigma of a velocity of which nothing is known

  TrackerOptions options_;
  State x_{State::Zero()};
  Covariance P_{Covariance::Zero()};
  GpsTime tag_{};
  double coasting_s_{0};
  int doubts_{0};
  bool running_{false};
};

}  // namespace searvins::gnss
