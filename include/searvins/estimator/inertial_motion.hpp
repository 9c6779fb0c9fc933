// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The motion of an estimator with an inertial unit: navigation states tied by preintegrated readings, and held when the vehicle stands.
///
/// Between states the policy integrates what add_sample() brings; a state may be placed wherever readings reach (covers()). While the detector sees a
/// rest, each state gets a zero velocity and a zero angular rate, unless the state's own prediction says that the vehicle moves. While no integers are
/// held in a rest, its states also share a place (stationary/position_anchor.hpp), latched where the rest began or the integers ended; its prior is
/// widened, because the states of the window hold the same information already.
///
/// Where the caller gave a map of lanes (set_centrelines(); opt-in), a moving state without integers lies on the lane that imu/centreline.hpp finds it on:
/// one state in each lane_way_m, because the offset from the middle of a lane lasts and is no new measurement a second later.
///
/// The antenna of a state is a lever arm away and swings with the body (imu/lever_arm.hpp). Its covariance follows from that of the state by the
/// Jacobians of both.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/centreline.hpp>
#include <searvins/imu/centreline_factor.hpp>
#include <searvins/imu/earth.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/lever_arm.hpp>
#include <searvins/imu/navigation_prior.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/imu/position_factor.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegration.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/stationary/detector.hpp>
#include <searvins/stationary/position_anchor.hpp>
#include <searvins/stationary/stationary_factors.hpp>

namespace searvins::estimator {

/// Settings of the inertial part.
struct InertialOptions {
  imu::PreintegrationOptions preintegration{};
  Eigen::Vector3d lever_arm_b_m{Eigen::Vector3d::Zero()};  ///< from the unit to the antenna's phase centre
  stationary::DetectorSettings detector{};
  double position_floor_m{0.05};                           ///< sigma that is added to positions from elsewhere
  bool zero_velocity{true}, zero_angular_rate{true};       ///< hold states at rest
  double zero_velocity_sigma_mps{0.03}, zero_rate_sigma_radps{1e-3};
  bool position_anchor{true};                              ///< states of a rest without integers share a place
  double anchor_sigma_m{0.02};                             ///< of a state from the place
  double anchor_prior_scale{3}, anchor_floor_m{0.05};      ///< the latched prior's sigmas: those of the state times the scale, and the floor
  double max_rest_speed_sigmas{3};                         ///< a rest is not believed when the prediction moves faster than this, and than
  double max_rest_speed_mps{0.3};                          ///< this speed
  /// Integers that would move the antenna further than this from its prediction are not believed, and neither are those that the prediction rests on:
  /// chi-square of 3, the prediction's covariance widened by the floor on each axis.
  double max_fix_jump_statistic{25}, fix_jump_floor_m{0.02};
  bool non_holonomic{false};                               ///< no sliding of the point below, for wheeled vehicles
  Eigen::Vector3d axle_b_m{Eigen::Vector3d::Zero()};       ///< middle of the axle that does not steer
  double non_holonomic_sigma_mps{0.1};
  double non_holonomic_from_mps{1};                        ///< slower, the direction of travel is not the body's
  imu::CentrelineOptions lanes{};                          ///< how the map of set_centrelines() is matched
  double lane_way_m{50};                                   ///< driven between two states that a lane holds
};

/// See the file comment. `SampleCapacity`: readings between two states.
template <class Earth = imu::RotatingEarth, std::size_t SampleCapacity = 8192>
class InertialMotion {
 public:
  static constexpr bool is_inertial = true, has_camera = false;
  using EarthType = Earth;
  using Scalar = math::Deferred<double, Earth>;
  using State = math::Deferred<imu::NavigationState, Earth>;
  using Antenna = math::Deferred<imu::LeverArm, Earth>;
  using Options = InertialOptions;
  using Covariance = math::Deferred<imu::NavigationCovariance, Earth>;
  using Detector = math::Deferred<stationary::Detector, Earth>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  template <class Cap>
  using Variables = smoother::Types<smoother::Capacity<stationary::PositionAnchor, 4>>;
  template <class Cap>
  using Factors = smoother::Types<smoother::Capacity<imu::NavigationPriorFactor, 1>, smoother::Capacity<imu::ImuFactor<Earth>, Cap::states>,
                                  smoother::Capacity<stationary::ZeroVelocityFactor, Cap::states>, smoother::Capacity<stationary::ZeroAngularRateFactor, Cap::states>,
                                  smoother::Capacity<stationary::NonHolonomicFactor, Cap::states>, smoother::Capacity<imu::PositionFactor, Cap::states>,
                                  smoother::Capacity<imu::CentrelineFactor, Cap::states>,
                                  smoother::Capacity<stationary::PositionAnchorFactor, Cap::states>, smoother::Capacity<stationary::PositionAnchorPriorFactor, 4>>;

  explicit InertialMotion(const RtkOptions&, const Options& options = {}) : options_(options), detector_(options.preintegration.noise, options.detector) {}

  void set_frame(const geodesy::LocalFrame& frame) { earth_ = Earth{frame}, has_lane_ = false; }
  /// A map, in the caller's memory for as long as this is used; an empty one ends its use. Every state that is not on a lane yet searches all of it.
  void set_centrelines(imu::Centrelines lines) { lines_ = lines, has_lane_ = false; }
  [[nodiscard]] const Options& options() const { return options_; }
  [[nodiscard]] const Earth& earth() const { return earth_; }
  [[nodiscard]] const Detector& detector() const { return detector_; }

  /// The next reading. Errors: those of imu::Preintegration::push; nothing was changed then.
  Status add_sample(const imu::ImuSample& sample) {
    if (const Status s = integration_.push(sample); !s.ok()) return s;
    (void)detector_.add(sample);  // its gaps and repeats were refused above
    if (recent_.full()) recent_.erase(0);
    (void)recent_.push_back(sample);
    return ok_status();
  }
  /// Whether a state may be placed at `t`.
  [[nodiscard]] bool covers(GpsTime t) const { return integration_.newest_time() >= t && integration_.size() >= 2; }

  [[nodiscard]] Antenna antenna_at(GpsTime t) const { return {options_.lever_arm_b_m, gyro_at(t), earth_.rate_w_radps()}; }

  [[nodiscard]] Result<State> predict(const State& x, GpsTime, GpsTime to) const {
    const auto motion = integration_.until(to);
    if (!motion.ok()) return motion.status();
    return imu::predict(x, *motion, earth_);
  }
  /// State and covariance at the end of a motion from elsewhere.
  [[nodiscard]] std::pair<State, Covariance> predict_by(const State& x, const Covariance& P, const imu::PreintegratedMotion<double>& motion) const {
    return {imu::predict(x, motion, earth_), imu::predict_covariance(x, P, motion, options_.preintegration.noise, earth_)};
  }
  /// That of `x` itself where readings do not reach.
  [[nodiscard]] Covariance predicted_covariance(const State& x, const Covariance& P, GpsTime, GpsTime to) const {
    const auto motion = integration_.until(to);
    return motion.ok() ? imu::predict_covariance(x, P, *motion, options_.preintegration.noise, earth_) : P;
  }
  /// Covariance of the antenna's position and velocity in w.
  [[nodiscard]] static Eigen::Matrix<Scalar, 6, 6> antenna_covariance(const State& x, const Covariance& P, const Antenna& antenna) {
    Eigen::Matrix<Scalar, 6, 15> J;
    typename Antenna::Jacobian rows;
    (void)antenna.position_w_m(x, &rows);
    J.template topRows<3>() = rows;
    (void)antenna.velocity_w_mps(x, &rows);
    J.template bottomRows<3>() = rows;
    const Eigen::Matrix<Scalar, 6, 15> JP = J.lazyProduct(P);
    return JP.lazyProduct(J.transpose());
  }

  /// The predicted state moved so that its antenna is at p; its velocity is the prediction's, which no single epoch knows better.
  [[nodiscard]] State placed(const State& predicted, const Antenna& antenna, const Vector3& p_wa_m, const Vector3&) const {
    State x = predicted;
    x.p_wb_m += p_wa_m - antenna.position_w_m(predicted);
    return x;
  }
  /// A covariance after the window was given up: position, velocity and attitude may be wrong.
  [[nodiscard]] static Covariance widened(const Covariance& P, double sigma_position_m) {
    Covariance wide = P;
    for (int i = 0; i < 3; ++i) {
      wide(State::position + i, State::position + i) += sigma_position_m * sigma_position_m;
      wide(State::velocity + i, State::velocity + i) += 1;
      wide(State::attitude + i, State::attitude + i) += 0.03 * 0.03;
    }
    return wide;
  }

  /// Whether integers that put the antenna at `fixed` agree with its prediction, both in w with their covariances.
  [[nodiscard]] bool agrees(const Vector3& fixed_w_m, const Matrix3& fixed_m2, const Vector3& predicted_w_m, const Matrix3& predicted_m2) const {
    const Matrix3 S = fixed_m2 + predicted_m2 + options_.fix_jump_floor_m * options_.fix_jump_floor_m * Matrix3::Identity();
    const auto root = imu::square_root_information<3>(S);
    return root.ok() && (*root * (fixed_w_m - predicted_w_m)).squaredNorm() <= options_.max_fix_jump_statistic;
  }

  template <class Smoother>
  Status add_start(Smoother& smoother, smoother::Key<State> key, const State& start, const Covariance& P) const {
    const auto prior = imu::NavigationPriorFactor::make(key, start, P);
    return prior.ok() ? smoother.add_factor(*prior).status() : prior.status();
  }

  template <class Smoother>
  Status add_link(Smoother& smoother, smoother::Key<State> from, smoother::Key<State> to, GpsTime, GpsTime to_time, RtkSolution& out) {
    const auto motion = integration_.until(to_time);
    if (!motion.ok()) return motion.status();
    const auto factor = imu::ImuFactor<Earth>::make(from, to, *motion, options_.preintegration.noise, earth_, smoother.find(from)->p_wb_m);
    if (!factor.ok()) return factor.status();
    if (const Status s = smoother.add_factor(*factor).status(); !s.ok()) return s;
    out.stationary = is_at_rest(*smoother.find(to));
    if (out.stationary) hold(smoother, to);
    if (!out.stationary || !options_.position_anchor)
      anchor_ = {};
    else
      hold_place(smoother, to, to_time, imu::predict(*smoother.find(from), *motion, earth_).p_wb_m);
    if (options_.non_holonomic && !out.stationary && smoother.find(to)->v_wb_mps.norm() > options_.non_holonomic_from_mps) keep_on_wheels(smoother, to, to_time);
    if (!lines_.empty() && is_float_ && !out.stationary) out.in_lane = keep_in_lane(smoother, to, to_time);
    return ok_status();
  }

  /// The oldest state is about to leave the window.
  template <class Smoother>
  void before_marginalising(Smoother&, smoother::Key<State>) {}

  /// Another sensor's opinion that the vehicle stands; it counts as that of the detector does.
  void set_rest_cue(bool stands) { rest_cue_ = stands; }

  /// Adds a position from elsewhere to a state.
  template <class Smoother>
  Status add_position(Smoother& smoother, smoother::Key<State> key, const imu::PositionFix& fix, const Antenna& antenna) const {
    const Matrix3& R_ew = earth_.frame.R_ew;
    const auto factor = imu::PositionFactor::make(key, antenna, earth_.frame.to_local(fix.position_e_m), R_ew.transpose() * fix.covariance_e_m2 * R_ew,
                                                  options_.position_floor_m);
    return factor.ok() ? smoother.add_factor(*factor).status() : factor.status();
  }

  /// The newest state was estimated: the next interval begins there. is_float: no integer had a part in it.
  void settle(const State& x, const Covariance& P, GpsTime t, bool is_float) {
    is_float_ = is_float, position_covariance_m2_ = P.template block<3, 3>(State::position, State::position);
    sigma_velocity_mps_ = std::sqrt(std::max(1e-6, P.template block<3, 3>(State::velocity, State::velocity).trace() / 3));
    if (!integration_.restart(t, imu::bias_of(x)).ok()) (void)integration_.start(t, imu::bias_of(x), options_.preintegration);
    detector_.set_speed_hint(t, x.v_wb_mps.norm(), sigma_velocity_mps_);
    if (P.template block<3, 3>(State::gyro_bias, State::gyro_bias).trace() < 3e-6) detector_.set_gyro_bias(x.gyro_bias_b_radps);
  }

  /// Attitude and biases. R_nw: axes of w to East-North-Up at the position.
  void describe(const State& x, const Covariance& P, const Matrix3& R_nw, RtkSolution& out) const {
    out.has_attitude = true;
    out.R_nb = R_nw * x.R_wb;
    const Matrix3& R_nb = out.R_nb;
    const Matrix3 C = R_nb * P.template topLeftCorner<3, 3>() * R_nb.transpose();
    out.attitude_sigma_rad = C.diagonal().cwiseMax(0).cwiseSqrt();
    out.accel_bias_b_mps2 = x.accel_bias_b_mps2, out.gyro_bias_b_radps = x.gyro_bias_b_radps;
  }

 private:
  /// The reading nearest to a time.
  [[nodiscard]] Vector3 gyro_at(GpsTime t) const {
    Vector3 gyro = Vector3::Zero();
    double nearest_s = 1e9;
    for (const imu::ImuSample& s : recent_) {
      const double away_s = std::abs(seconds_between(s.time, t));
      if (away_s < nearest_s) nearest_s = away_s, gyro = s.gyro_b_radps;
    }
    return gyro;
  }

  [[nodiscard]] bool is_at_rest(const State& predicted) const {
    const double speed = predicted.v_wb_mps.norm();
    return (detector_.stationary() || rest_cue_) && speed < std::max(options_.max_rest_speed_mps, options_.max_rest_speed_sigmas * sigma_velocity_mps_);
  }
  template <class Smoother>
  void hold(Smoother& smoother, smoother::Key<State> key) const {
    if (options_.zero_velocity) (void)smoother.add_factor(stationary::ZeroVelocityFactor{key, options_.zero_velocity_sigma_mps});
    if (options_.zero_angular_rate)
      (void)smoother.add_factor(stationary::ZeroAngularRateFactor{key, detector_.mean_gyro_b_radps(), earth_.rate_w_radps(), options_.zero_rate_sigma_radps});
  }
  /// Ties a state at rest to the anchor. There must be none before: the prior would carry what integers said into the float.
  template <class Smoother>
  void hold_place(Smoother& smoother, smoother::Key<State> key, GpsTime t, const Vector3& predicted_w_m) {
    if (!anchor_.valid() || !smoother.find(anchor_)) {
      anchor_ = {};
      if (!is_float_) return;
      const auto anchor = smoother.add_variable(stationary::PositionAnchor{predicted_w_m}, t);
      if (!anchor.ok()) return;
      const double scale2 = options_.anchor_prior_scale * options_.anchor_prior_scale;
      const auto prior = stationary::latch(*anchor, predicted_w_m, scale2 * position_covariance_m2_, options_.anchor_floor_m);
      if (!prior.ok() || !smoother.add_factor(*prior).ok()) return void(smoother.remove_variable(*anchor));
      anchor_ = *anchor;
    }
    (void)smoother.add_factor(stationary::PositionAnchorFactor{key, anchor_, options_.anchor_sigma_m});
  }
  template <class Smoother>
  void keep_on_wheels(Smoother& smoother, smoother::Key<State> key, GpsTime t) const {
    stationary::NonHolonomicFactor f;
    f.state = key;
    f.gyro_b_radps = gyro_at(t), f.earth_rate_w_radps = earth_.rate_w_radps(), f.point_b_m = options_.axle_b_m;
    f.sigma_lateral_mps = f.sigma_vertical_mps = options_.non_holonomic_sigma_mps;
    (void)smoother.add_factor(f);
  }
  /// Whether the map holds this state. Its covariance is that of the state before, which matters little: a lane is metres wide.
  template <class Smoother>
  bool keep_in_lane(Smoother& smoother, smoother::Key<State> key, GpsTime t) {
    const State& x = *smoother.find(key);
    const Antenna antenna = antenna_at(t);
    const Matrix3& R_ew = earth_.frame.R_ew;
    const Vector3 p_w_m = antenna.position_w_m(x);
    if (has_lane_ && (p_w_m - lane_place_w_m_).norm() < options_.lane_way_m) return false;
    const imu::CentrelineMatch lane = imu::match_centreline(lines_, earth_.frame.to_ecef(p_w_m), R_ew * antenna.velocity_w_mps(x),
                                                            R_ew * position_covariance_m2_ * R_ew.transpose(), options_.lanes);
    if (lane.verdict != imu::CentrelineVerdict::matched) return false;
    const imu::CentrelineFactor factor{key, antenna, earth_.frame.to_local(lane.point_e_m), R_ew.transpose() * lane.right_e, options_.lanes.sigma_m};
    if (!smoother.add_factor(factor).ok()) return false;
    has_lane_ = true, lane_place_w_m_ = p_w_m;
    return true;
  }

  Options options_;
  Earth earth_{};
  imu::Preintegration<double, SampleCapacity> integration_{};
  Detector detector_;
  StaticVector<imu::ImuSample, 32> recent_{};
  smoother::Key<stationary::PositionAnchor> anchor_{};  ///< of the present rest
  Matrix3 position_covariance_m2_{Matrix3::Identity()};
  double sigma_velocity_mps_{1};
  imu::Centrelines lines_{};
  Vector3 lane_place_w_m_{Vector3::Zero()};  ///< of the last state that a lane holds
  bool has_lane_{false};
  bool is_float_{true}, rest_cue_{false};
};

}  // namespace searvins::estimator
