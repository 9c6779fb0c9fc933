// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The motion of an estimator without an inertial unit: position, velocity and acceleration of the antenna under white jerk.
///
/// A motion policy is what RtkEstimator does not know of its states: their type, the factors between them, where the antenna is on one, how the next
/// one is predicted. This is the simplest; the other is estimator/inertial_motion.hpp.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/gnss_factors.hpp>
#include <searvins/gnss/motion.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::estimator {

/// See the file comment. Scalar: double, as that of its states.
template <class Scalar>
class BasicFreeMotion {
 public:
  static constexpr bool is_inertial = false, has_camera = false;
  using State = math::Deferred<gnss::Pva, Scalar>;
  using Antenna = gnss::DirectAntenna;
  using Covariance = Eigen::Matrix<Scalar, State::dof, State::dof>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
  template <class Cap>
  using Variables = smoother::Types<>;
  template <class Cap>
  using Factors = smoother::Types<smoother::Capacity<gnss::PvaPriorFactor, 1>, smoother::Capacity<gnss::WhiteJerkFactor, Cap::states>>;

  struct Options {};
  explicit BasicFreeMotion(const RtkOptions& options, const Options& = {}) : options_(options) {}
  void set_frame(const geodesy::LocalFrame&) {}

  /// The antenna at the time of a state.
  [[nodiscard]] Antenna antenna_at(GpsTime) const { return {}; }

  /// The state at `to` by the motion alone.
  [[nodiscard]] Result<State> predict(const State& x, GpsTime from, GpsTime to) const { return x.predict(seconds_between(from, to)); }
  /// Covariance of the predicted state; of the position block, all that is asked for.
  [[nodiscard]] Covariance predicted_covariance(const State&, const Covariance& P, GpsTime from, GpsTime to) const {
    const double dt = seconds_between(from, to);
    const Matrix3 I = Matrix3::Identity();
    Covariance out = P;
    out.template topLeftCorner<3, 3>() += dt * dt * P.template block<3, 3>(3, 3) + options_.jerk_psd_m2ps5 * std::pow(dt, 5) / 60 * I;
    return out;
  }
  /// Covariance of the antenna's position and velocity in w, of a state's.
  [[nodiscard]] static Eigen::Matrix<Scalar, 6, 6> antenna_covariance(const State&, const Covariance& P, const Antenna&) {
    return P.template topLeftCorner<6, 6>();
  }

  /// A state whose antenna is at p with velocity v, in w; `near` is the predicted one.
  [[nodiscard]] State placed(const State& near, const Antenna&, const Vector3& p_wa_m, const Vector3& v_wa_mps) const {
    return {p_wa_m, v_wa_mps, near.a_wa_mps2};
  }
  /// A covariance after the window was given up: nothing of it counts for FreeMotion, whose start has sigmas of its own.
  [[nodiscard]] static Covariance widened(const Covariance& P, double) { return P; }

  /// A prediction without an inertial unit says little about integers.
  [[nodiscard]] static bool agrees(const Vector3&, const Matrix3&, const Vector3&, const Matrix3&) { return true; }

  /// Adds what is known of a window's first state.
  template <class Smoother>
  Status add_start(Smoother& smoother, smoother::Key<State> key, const State& start, const Covariance&) const {
    return smoother.add_factor(gnss::PvaPriorFactor{key, start, options_.start_sigma_m, options_.start_velocity_sigma_mps, options_.start_acceleration_sigma_mps2}).status();
  }
  /// Adds the motion between two states.
  template <class Smoother>
  Status add_link(Smoother& smoother, smoother::Key<State> from, smoother::Key<State> to, GpsTime from_time, GpsTime to_time, RtkSolution&) {
    return smoother.add_factor(gnss::WhiteJerkFactor{from, to, std::max(1e-3, seconds_between(from_time, to_time)), options_.jerk_psd_m2ps5}).status();
  }
  /// The newest state was estimated.
  void settle(const State&, const Covariance&, GpsTime, bool) {}
  /// The oldest state is about to leave the window.
  template <class Smoother>
  void before_marginalising(Smoother&, smoother::Key<State>) {}
  /// Attitude and biases: none.
  void describe(const State&, const Covariance&, const Matrix3&, RtkSolution&) const {}

 private:
  RtkOptions options_;
};
using FreeMotion = BasicFreeMotion<double>;  ///< in double precision

}  // namespace searvins::estimator
