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
#include <searvins/math/deferred.hpp>
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

/// What the filter says of an epoch besides the rows of its codes. Scalar: double or wider.
template <class Scalar>
struct BasicTrackedEstimate {
  using Vector3 = math::Vector3<Scalar>;
  using Matrix3 = math::Matrix3<Scalar>;

  GpsTime time{};
  TrackStatus status{TrackStatus::started};
  Vector3 position_e_m{Vector3::Zero()};
  Vector3 velocity_e_mps{Vector3::Zero()};
  Matrix3 position_covariance_m2{Matrix3::Zero()};
  Matrix3 velocity_covariance_m2ps2{Matrix3::Zero()};
  bool doppler_used{false};
  int doubts{0};  ///< consecutive contradictions so far
};

/// One epoch of the filter. Some 20 kB: where a stack is small, keep one and have it filled.
template <class Scalar>
struct BasicTrackedPosition : BasicTrackedEstimate<Scalar> {
  BasicSinglePointSolution<Scalar> single_point{};  ///< rows, residuals and clocks of this epoch; empty when coasted

  /// As it was made, without another one beside it.
  void clear() {
    static_cast<BasicTrackedEstimate<Scalar>&>(*this) = {};
    single_point.clear();
  }
};

using TrackedPosition = BasicTrackedPosition<double>;  ///< in double precision

/// The filter. Feed epochs in time order. Scalar: double or wider.
template <class Scalar>
class BasicSinglePointTracker {
 public:
  using Position = BasicTrackedPosition<Scalar>;

  explicit BasicSinglePointTracker(const TrackerOptions& options = {}) : options_(options) {}

  /// Forgets everything.
  void reset() { running_ = false; }
  [[nodiscard]] bool running() const { return running_; }

  /// Takes one epoch and fills `out`. Errors, `out` cleared: out_of_order (tag not after the last one; nothing is changed); those of
  /// solve_single_point while there is nothing to track; stale (no usable code for max_gap_s: the filter has forgotten its state).
  template <std::size_t N>
  Status update(const ObservationEpoch& epoch, const EphemerisStore<N>& store, Position& out) {
    out.clear();
    if (!running_) return start(epoch, store, TrackStatus::started, out);
    const double dt_s = seconds_between(tag_, epoch.tag);
    if (!(dt_s > 0)) return failure(StatusCode::out_of_order, "tracker: epoch not after the last one", -1, -1, dt_s);
    if (dt_s > options_.max_gap_s) return start(epoch, store, TrackStatus::started, out);
    predict(dt_s);
    tag_ = epoch.tag;
    out.doppler_used = absorb_doppler(epoch, store);

    SinglePointOptions options = options_.single_point;
    options.data_information_scale *= std::min(1.0, dt_s / options_.correlation_s);
    const std::optional<Prior> prior = position_prior();
    if (!prior) return start(epoch, store, TrackStatus::restarted, out);
    const Status located = solve_single_point(epoch, store, options, prior, out.single_point);
    const bool contradicted = contradicts(epoch, store, out.single_point);
    doubts_ = contradicted ? doubts_ + 1 : 0;
    if (doubts_ >= options_.doubts_until_restart) return start(epoch, store, TrackStatus::restarted, out);
    if (!located) return coast(located, dt_s, contradicted, out);
    coasting_s_ = 0;
    out.status = contradicted ? TrackStatus::doubtful : TrackStatus::tracked;
    absorb_position(*prior, out.single_point);
    out.time = out.single_point.time;
    fill(out);
    return ok_status();
  }

  /// The same by value: some 20 kB, several times on its way.
  template <std::size_t N>
  [[nodiscard]] Result<Position> update(const ObservationEpoch& epoch, const EphemerisStore<N>& store) {
    Position out;
    if (const Status s = update(epoch, store, out); !s) return s;
    return out;
  }

 private:
  static constexpr int kSize = 3 + kSinglePointUnknowns;
  using State = Eigen::Matrix<Scalar, kSize, 1>;
  using Covariance = Eigen::Matrix<Scalar, kSize, kSize>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  using Codes = BasicSinglePointVector<Scalar>;  // the part (p, b) of the state
  using Prior = BasicSinglePointPrior<Scalar>;
  using Solution = BasicSinglePointSolution<Scalar>;

  template <std::size_t N>
  [[nodiscard]] Status start(const ObservationEpoch& epoch, const EphemerisStore<N>& store, TrackStatus status, Position& out) {
    running_ = false;
    out.clear();
    if (const Status located = solve_single_point(epoch, store, options_.single_point, std::nullopt, out.single_point); !located)
      return located;
    const Solution& s = out.single_point;
    x_.setZero();
    P_.setZero();
    x_.template tail<kSinglePointUnknowns>() = s.state;
    P_.template bottomRightCorner<kSinglePointUnknowns, kSinglePointUnknowns>() = s.covariance;
    P_.diagonal().template segment<3>(3).array() += options_.start_sigma_m * options_.start_sigma_m;
    P_.diagonal().template head<3>().setConstant(kStartSpeedMps * kStartSpeedMps);
    tag_ = epoch.tag, running_ = true, doubts_ = 0, coasting_s_ = 0;
    out.status = status;
    out.doppler_used = absorb_doppler(epoch, store);
    out.time = s.time;
    fill(out);
    return ok_status();
  }

  void predict(double dt_s) {
    const Matrix3 R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(x_.template segment<3>(3)));
    const double h = options_.horizontal_acceleration_mps2, v = options_.vertical_acceleration_mps2;
    const Matrix3 acceleration = R_ew * Vector3(h * h, h * h, v * v).asDiagonal() * R_ew.transpose();
    x_.template segment<3>(3) += dt_s * x_.template head<3>();
    // P <- F P F' with F = I except p <- p + dt v, written as a row and a column operation.
    P_.template middleRows<3>(3) += dt_s * P_.template topRows<3>();
    P_.template middleCols<3>(3) += dt_s * P_.template leftCols<3>();
    P_.template topLeftCorner<3, 3>() += dt_s * dt_s * acceleration;
    P_.template block<3, 3>(0, 3) += 0.5 * dt_s * dt_s * dt_s * acceleration;
    P_.template block<3, 3>(3, 0) += 0.5 * dt_s * dt_s * dt_s * acceleration;
    P_.template block<3, 3>(3, 3) += 0.25 * dt_s * dt_s * dt_s * dt_s * acceleration;
    P_.diagonal().template segment<3>(3).array() += options_.position_walk_m * options_.position_walk_m * dt_s;
    P_.diagonal().template tail<kSinglePointClocks + 1>().array() += options_.receiver_delay_walk_m * options_.receiver_delay_walk_m * dt_s;
  }

  template <std::size_t N>
  [[nodiscard]] bool absorb_doppler(const ObservationEpoch& epoch, const EphemerisStore<N>& store) {
    const math::SmallCholesky<3, Scalar> factor(P_.template topLeftCorner<3, 3>());
    if (!factor.ok()) return false;
    const Matrix3 information = factor.inverse();
    const VelocityPrior prior{x_.template head<3>(), information};
    const BasicDopplerVelocity<Scalar>& d = doppler_;
    if (!solve_doppler_velocity(epoch, store, x_.template segment<3>(3), options_.doppler, prior, doppler_) || !d.consistent) return false;
    Matrix3 after = d.velocity_covariance_m2ps2();
    after.diagonal().array() += options_.doppler_floor_mps * options_.doppler_floor_mps;
    const Eigen::Matrix<Scalar, kSize, 3> gain = P_.template leftCols<3>().lazyProduct(information);
    const Matrix3 shrink = P_.template topLeftCorner<3, 3>() - after;
    const Vector3 change_mps = d.velocity_e_mps - x_.template head<3>();
    x_ += gain.lazyProduct(change_mps);
    const Eigen::Matrix<Scalar, kSize, 3> shrunk = gain.lazyProduct(shrink);
    P_ -= shrunk.lazyProduct(gain.transpose());
    symmetrise();
    return true;
  }

  /// (p, b) as predicted, the common clock unknown. Empty when the covariance has lost its definiteness.
  [[nodiscard]] std::optional<Prior> position_prior() const {
    Prior prior;
    const math::SmallCholesky<kSinglePointUnknowns, Scalar> factor(
        P_.template bottomRightCorner<kSinglePointUnknowns, kSinglePointUnknowns>());
    if (!factor.ok()) return std::nullopt;
    Codes common = Codes::Zero();
    common.template segment<kSinglePointClocks>(3).setOnes();
    const Codes y = factor.solve(common);
    prior.mean = x_.template tail<kSinglePointUnknowns>();
    prior.information = factor.inverse();
    prior.information -= (y / common.dot(y)).lazyProduct(y.transpose());
    prior.knows_receiver_delays = true;
    return prior;
  }

  void absorb_position(const Prior& prior, const Solution& s) {
    const Eigen::Matrix<Scalar, 3, kSinglePointUnknowns> cross = P_.template topRightCorner<3, kSinglePointUnknowns>();
    const Eigen::Matrix<Scalar, 3, kSinglePointUnknowns> gain = cross.lazyProduct(prior.information);
    x_.template head<3>() += gain.lazyProduct(s.state - prior.mean);
    x_.template tail<kSinglePointUnknowns>() = s.state;
    const Eigen::Matrix<Scalar, 3, kSinglePointUnknowns> carried = gain.lazyProduct(s.covariance);
    P_.template topLeftCorner<3, 3>() += (carried - cross).lazyProduct(gain.transpose());
    P_.template topRightCorner<3, kSinglePointUnknowns>() = carried;
    P_.template bottomLeftCorner<kSinglePointUnknowns, 3>() = P_.template topRightCorner<3, kSinglePointUnknowns>().transpose();
    P_.template bottomRightCorner<kSinglePointUnknowns, kSinglePointUnknowns>() = s.covariance;
    symmetrise();
  }

  /// Do the codes alone, with clearly more satellites than agree with the prediction, put the receiver somewhere else? `with_prior` is empty
  /// when none agree.
  template <std::size_t N>
  [[nodiscard]] bool contradicts(const ObservationEpoch& epoch, const EphemerisStore<N>& store, const Solution& with_prior) {
    const int agreeing = with_prior.used;
    if (with_prior.consistent && agreeing >= with_prior.excluded) return false;
    const Solution& alone = alone_;
    if (!solve_single_point(epoch, store, options_.single_point, std::nullopt, alone_)) return false;
    if (!alone.consistent || 4 * alone.used <= 5 * agreeing) return false;
    const Matrix3 sum = alone.position_covariance_m2() + P_.template block<3, 3>(3, 3);
    const math::SmallCholesky<3, Scalar> factor(sum);
    if (!factor.ok()) return false;
    const Vector3 apart_m = alone.position_e_m - x_.template segment<3>(3);
    const Result<double> bound = math::chi_square_threshold(options_.doubt_false_alarm, 3);
    return bound && apart_m.dot(factor.solve(apart_m)) > *bound;
  }

  [[nodiscard]] Status coast(const Status& why, double dt_s, bool contradicted, Position& out) {
    coasting_s_ += dt_s;
    if (coasting_s_ > options_.max_gap_s) {
      running_ = false;
      out.clear();
      return failure(StatusCode::stale, why.what, -1, -1, coasting_s_);
    }
    out.status = contradicted ? TrackStatus::doubtful : TrackStatus::coasted;
    out.time = tag_.plus_seconds(-x_.template segment<kSinglePointClocks>(6).mean() / kSpeedOfLightMps);
    fill(out);
    return ok_status();
  }

  void fill(Position& out) const {
    out.position_e_m = x_.template segment<3>(3);
    out.velocity_e_mps = x_.template head<3>();
    out.position_covariance_m2 = P_.template block<3, 3>(3, 3);
    out.position_covariance_m2.diagonal().array() += options_.systematic_sigma_m * options_.systematic_sigma_m;
    out.velocity_covariance_m2ps2 = P_.template topLeftCorner<3, 3>();
    out.doubts = doubts_;
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
  Solution alone_{};                        // room to work in: the codes without prior
  BasicDopplerVelocity<Scalar> doppler_{};  // likewise
};

using SinglePointTracker = BasicSinglePointTracker<double>;  ///< in double precision

}  // namespace searvins::gnss
