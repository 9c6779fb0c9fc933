// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From nothing to a navigation state, and at every moment a word about what is missing.
///
///     collecting  ->  levelled  ->  aligned            also back to collecting, after a gap in the IMU data
///                up is known    heading is known
///
/// Up comes from a rest (alignment.hpp), or on the move from the specific force over an interval of T seconds, whose ends a GNSS velocity knows:
///
///     R_wb mean f = (v2 - v1) / T - g_w          sigma = sqrt(2) sigma_v / (T g), and the bias over g        f integrated in the axes of the interval's end
///
/// without velocities from the same with v2 - v1 = 0 and a generous sigma. After that the gyroscope carries the attitude in a frame l that is level and
/// has a heading of its own: R_lb, and R_wl is one turn about up. Heading comes from the caller, or from course minus heading in l (heading.hpp), for
/// velocities and displacements alike. Two estimates must agree within three sigma before they count, for one outlier must not point a vehicle backwards.
///
/// Reverse gear: from a rest the accelerometer, integrated in l, knows whether the vehicle moves along or against its forward axis. Without that
/// knowledge a heading waits for a speed at which nobody reverses.
///
/// Whether the body rests is told by the caller, who runs a stationary::Detector. Memory is fixed: sums and two blocks of half a second, which are
/// held back because a rest's last moments, before the detector sees its end, already move.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include <searvins/core/status.hpp>
#include <searvins/imu/alignment.hpp>
#include <searvins/imu/heading.hpp>
#include <searvins/imu/navigation_state.hpp>

namespace searvins::imu {

/// How far the initialisation is.
enum class AlignmentState : std::uint8_t { collecting, levelled, aligned };

/// What it waits for.
enum class AlignmentWait : std::uint8_t {
  gravity,               ///< set_local_gravity: a first position
  imu,                   ///< IMU samples
  rest_or_velocity,      ///< enough rest, or two velocities, or the coarse interval
  heading_source,        ///< no velocity, displacement or given heading so far
  heading_speed,         ///< too slow for a course
  heading_certainty,     ///< the course's sigma is too large
  heading_straight,      ///< the vehicle turns
  heading_confirmation,  ///< one estimate, or two that disagree
  nothing
};

/// Where the heading came from.
enum class HeadingSource : std::uint8_t { none, given, velocity, displacement };

/// Name of a state of the alignment, for reports.
[[nodiscard]] constexpr const char* name_of(AlignmentState s) {
  constexpr const char* names[] = {"collecting", "levelled", "aligned"};
  return names[static_cast<int>(s)];
}
/// Name of a source of the heading, for reports.
[[nodiscard]] constexpr const char* name_of(HeadingSource s) {
  constexpr const char* names[] = {"none", "given", "velocity", "displacement"};
  return names[static_cast<int>(s)];
}
/// In words: what is missing and what brings it.
[[nodiscard]] constexpr const char* text_of(AlignmentWait w) {
  switch (w) {
    case AlignmentWait::gravity: return "a first position, which gives gravity and the rate of the Earth";
    case AlignmentWait::imu: return "IMU samples";
    case AlignmentWait::rest_or_velocity: return "up: some seconds at rest, or of motion with GNSS velocities";
    case AlignmentWait::heading_source: return "heading: drive, so that GNSS shows a course, or give a heading";
    case AlignmentWait::heading_speed: return "heading: a higher speed";
    case AlignmentWait::heading_certainty: return "heading: a better velocity or a longer displacement";
    case AlignmentWait::heading_straight: return "heading: a straight stretch";
    case AlignmentWait::heading_confirmation: return "heading: a second estimate that agrees with the first";
    case AlignmentWait::nothing: return "nothing: aligned";
  }
  return "unknown";
}

/// See the file comment.
struct InitializerSettings {
  ImuNoise noise{};
  CourseModel course{};
  Eigen::Vector3d lever_arm_b_m{Eigen::Vector3d::Zero()};  ///< unit to antenna
  double min_rest_s{2};                                    ///< rest that levels
  double moving_interval_s{2};                             ///< interval that levels between two velocities
  double coarse_interval_s{10}, velocity_change_sigma_mps{5};  ///< levelling without velocities: interval, and how much the velocity may change over it
  double min_speed_mps{2};                                 ///< course counts above this when the direction of travel is known,
  double min_speed_unknown_gear_mps{4};                    ///< above this when it is not
  double max_rate_radps{0.3};                              ///< no course in sharper turns
  double max_heading_sigma_rad{0.26};                      ///< 15 degrees
  double min_displacement_m{2}, max_turn_rad{0.09};        ///< straight stretches: length, change of heading
  double max_gap_s{0.5};                                   ///< a longer gap between samples starts anew
  double velocity_life_s{1.5};                             ///< age at which a velocity no longer is the body's
  double gear_memory_s{20};                                ///< how long after a rest the accelerometer knows the gear
};

/// What an alignment is: the state, and its covariance in the tangent order of NavigationState.
template <class Scalar>
struct BasicAlignment {
  using Covariance = Eigen::Matrix<Scalar, NavigationState::dof, NavigationState::dof>;
  GpsTime time{};
  NavigationState state{};
  Covariance covariance{Covariance::Identity()};
  HeadingSource heading_source{HeadingSource::none};
  bool from_rest{false};  ///< levelled at rest, with a measured gyroscope bias
  bool reversed{false};   ///< the vehicle was in reverse gear when its heading was found

  /// Sigma of each tangent axis.
  [[nodiscard]] Eigen::Matrix<Scalar, NavigationState::dof, 1> sigmas() const { return covariance.diagonal().cwiseSqrt(); }
};
using Alignment = BasicAlignment<double>;  ///< in double precision

/// See the file comment.
template <class Scalar>
class BasicInitializer {
 public:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  explicit BasicInitializer(const InitializerSettings& settings = {}) : settings_(settings) { restart(); }

  /// Gravity and the rate of the Earth at the position, in w. Both can be set again at any time. Errors: non_finite, invalid_argument (size).
  Status set_local_gravity(const Vector3& gravity_w_mps2, const Vector3& earth_rate_w_radps) {
    if (!gravity_w_mps2.allFinite() || !earth_rate_w_radps.allFinite()) return failure(StatusCode::non_finite, "gravity or Earth rate is not finite");
    const double g = gravity_w_mps2.norm();
    if (g < 9 || g > 10.5) return failure(StatusCode::invalid_argument, "gravity must be a vector of about 9.8 m/s^2 that points down", -1, -1, g);
    gravity_w_ = gravity_w_mps2;
    earth_w_ = earth_rate_w_radps;
    has_gravity_ = true;
    return ok_status();
  }

  /// Takes a sample, and whether the body rests. Errors: non_finite, out_of_order, duplicate; nothing was changed then.
  Status add_imu(const ImuSample& sample, bool at_rest) {
    if (!sample.finite()) return failure(StatusCode::non_finite, "IMU sample is not finite");
    if (last_ && sample.time == last_->time) return failure(StatusCode::duplicate, "IMU sample of the same time as the last");
    if (last_ && sample.time < last_->time) return failure(StatusCode::out_of_order, "IMU sample before the last");
    if (last_ && seconds_between(last_->time, sample.time) > settings_.max_gap_s) restart();
    const double dt_s = last_ ? seconds_between(last_->time, sample.time) : 0.0;
    const ImuSample before = last_ ? *last_ : sample;
    last_ = sample;
    const Vector3 gyro_before = before.gyro_b_radps, accel_before = before.accel_b_mps2;
    const Vector3 gyro = (gyro_before + sample.gyro_b_radps) / 2, accel = (accel_before + sample.accel_b_mps2) / 2;
    integrate_interval(gyro, accel, dt_s);
    if (!has_gravity_) {  // a rest before the first position counts
      if (at_rest)
        gather(sample, gyro, dt_s);
      else
        end_rest();
      return ok_status();
    }
    if (at_rest)
      rest(sample, gyro, dt_s);
    else
      move(gyro, accel, dt_s);
    if (state_ == AlignmentState::collecting && interval_s_ >= settings_.coarse_interval_s) level_without_velocity();
    return ok_status();
  }

  /// Takes the antenna's velocity in w and the sigma of each axis. Errors: non_finite, invalid_argument (sigma), stale (not near the last sample).
  Status add_velocity(GpsTime time, const Vector3& v_w_mps, double sigma_mps) {
    if (!v_w_mps.allFinite() || !std::isfinite(sigma_mps)) return failure(StatusCode::non_finite, "velocity is not finite");
    if (!(sigma_mps > 0)) return failure(StatusCode::invalid_argument, "the sigma of a velocity is positive", -1, -1, sigma_mps);
    if (!last_ || std::abs(seconds_between(time, last_->time)) > settings_.velocity_life_s)
      return failure(StatusCode::stale, "velocity without IMU samples around it");
    if (has_gravity_ && state_ != AlignmentState::aligned) use_velocity(time, v_w_mps, sigma_mps);
    velocity_ = Velocity{time, v_w_mps, sigma_mps};
    return ok_status();
  }

  /// Takes the antenna's position in w and the sigma of each horizontal axis; worth passing when it is RTK. Errors: non_finite, invalid_argument, stale.
  Status add_position(GpsTime time, const Vector3& p_w_m, double sigma_m) {
    if (!p_w_m.allFinite() || !std::isfinite(sigma_m)) return failure(StatusCode::non_finite, "position is not finite");
    if (!(sigma_m > 0)) return failure(StatusCode::invalid_argument, "the sigma of a position is positive", -1, -1, sigma_m);
    if (!last_ || std::abs(seconds_between(time, last_->time)) > settings_.velocity_life_s)
      return failure(StatusCode::stale, "position without IMU samples around it");
    if (state_ == AlignmentState::levelled) use_position(p_w_m, sigma_m);
    return ok_status();
  }

  /// A heading from elsewhere (a compass, two antennas, a user), clockwise from north, of the present moment.
  /// Errors: non_finite, invalid_argument (sigma); under_determined while up is not known: it is kept and used when up is.
  Status set_heading(double heading_rad, double sigma_rad) {
    if (!std::isfinite(heading_rad) || !std::isfinite(sigma_rad)) return failure(StatusCode::non_finite, "heading is not finite");
    if (!(sigma_rad > 0)) return failure(StatusCode::invalid_argument, "the sigma of a heading is positive", -1, -1, sigma_rad);
    given_ = HeadingEstimate{heading_rad, sigma_rad};
    if (state_ == AlignmentState::collecting) return failure(StatusCode::under_determined, "up is not known yet; the heading is kept");
    use_given();
    return ok_status();
  }

  [[nodiscard]] AlignmentState state() const { return state_; }
  [[nodiscard]] AlignmentWait waits_for() const {
    if (state_ == AlignmentState::aligned) return AlignmentWait::nothing;
    if (!has_gravity_) return AlignmentWait::gravity;
    if (!last_) return AlignmentWait::imu;
    return state_ == AlignmentState::collecting ? AlignmentWait::rest_or_velocity : heading_wait_;
  }
  [[nodiscard]] const char* waiting_text() const { return text_of(waits_for()); }
  /// Sigma of each level axis, radians; pi while up is not known.
  [[nodiscard]] double sigma_tilt_rad() const {
    if (state_ == AlignmentState::collecting) return std::numbers::pi;
    const double t = seconds_since_level(), bias = std::sqrt(gyro_bias_covariance_.trace() / 3);
    const double earth = state_ == AlignmentState::aligned ? 0.0 : horizontal_earth_rate();
    return std::sqrt(tilt_variance_ + (bias * bias + earth * earth) * t * t + settings_.noise.gyro_noise_radps_sqrt_hz * settings_.noise.gyro_noise_radps_sqrt_hz * t);
  }
  /// Sigma of the heading, radians; pi while it is not known.
  [[nodiscard]] double sigma_heading_rad() const { return state_ == AlignmentState::aligned ? std::sqrt(heading_variance_) : std::numbers::pi; }
  [[nodiscard]] HeadingSource heading_source() const { return source_; }
  /// Attitude in the level frame l, whose heading means nothing until aligned() - then it is R_wb.
  [[nodiscard]] const Matrix3& R_lb() const { return R_lb_; }
  [[nodiscard]] const Vector3& gyro_bias_b_radps() const { return gyro_bias_; }

  /// The state at the last sample, once aligned. The caller gives the antenna's position in w and its covariance. The velocity is zero at rest, else the
  /// last one given while it is younger than its life, else zero with a sigma of 20 m/s. Errors: under_determined (not aligned), non_finite.
  [[nodiscard]] Result<BasicAlignment<Scalar>> alignment(const Vector3& antenna_w_m, const Matrix3& covariance_w_m2) const {
    if (state_ != AlignmentState::aligned) return failure(StatusCode::under_determined, waiting_text());
    if (!antenna_w_m.allFinite() || !covariance_w_m2.allFinite()) return failure(StatusCode::non_finite, "position or covariance is not finite");
    BasicAlignment<Scalar> a;
    a.time = last_->time;
    a.heading_source = source_, a.from_rest = from_rest_, a.reversed = reversed_;
    auto& x = a.state;
    x.R_wb = R_lb_;
    x.p_wb_m = antenna_w_m - x.R_wb * settings_.lever_arm_b_m;
    x.gyro_bias_b_radps = gyro_bias_;
    double sigma_v = 20;
    if (resting_) {
      sigma_v = 0.05;
    } else if (velocity_ && seconds_between(velocity_->time, last_->time) <= settings_.velocity_life_s) {
      const double age = std::abs(seconds_between(velocity_->time, last_->time));
      x.v_wb_mps = velocity_->v_w - x.R_wb * (last_->gyro_b_radps - gyro_bias_).cross(settings_.lever_arm_b_m);
      sigma_v = std::hypot(velocity_->sigma, 3 * age);  // a vehicle brakes with 3 m/s^2 and rarely more
    }
    fill_covariance(a, covariance_w_m2, sigma_v);
    return a;
  }

 private:
  struct Velocity {
    GpsTime time{};
    Vector3 v_w{Vector3::Zero()};
    double sigma{0};
  };
  /// Half a second of a rest, and how the body turned in it.
  struct Block {
    BasicRestStatistics<Scalar> statistics{};
    Vector3 turn_b{Vector3::Zero()};  ///< integral of the gyroscope
    double duration_s{0};
  };

  void restart() {
    state_ = AlignmentState::collecting;
    heading_wait_ = AlignmentWait::heading_source;
    source_ = HeadingSource::none;
    last_.reset(), velocity_.reset(), candidate_.reset(), place_.reset(), given_.reset();
    R_lb_.setIdentity();
    end_rest();
    start_interval();
    gyro_bias_.setZero();
    gyro_bias_covariance_ = settings_.noise.gyro_bias_sigma_radps * settings_.noise.gyro_bias_sigma_radps * Matrix3::Identity();
    from_rest_ = reversed_ = knows_gear_ = false;
    attitude_accel_bias_l_.setZero();
    since_rest_s_ = 0;
    velocity_l_.setZero();
    heading_variance_ = 0;
  }

  // The interval between two velocities: the integral of the specific force in the axes of its end.
  void start_interval() {
    interval_s_ = 0;
    interval_force_b_.setZero();
    interval_velocity_.reset();
  }
  void integrate_interval(const Vector3& gyro, const Vector3& accel, double dt_s) {
    const Matrix3 half = so3::exp((gyro - gyro_bias_) * (dt_s / 2));  // the mean of two readings belongs to the middle
    const Vector3 middle = half.transpose() * interval_force_b_ + accel * dt_s;
    interval_force_b_ = half.transpose() * middle;
    interval_s_ += dt_s;
  }

  // Rest.
  /// True when the sums of the rest have grown.
  bool gather(const ImuSample& sample, const Vector3& gyro, double dt_s) {
    if (resting_) newest_.turn_b += gyro * dt_s, newest_.duration_s += dt_s;
    resting_ = true;
    newest_.statistics.add(sample);
    if (newest_.duration_s < 0.5) return false;
    rest_.merge(held_.statistics);
    held_ = newest_;
    newest_ = {};
    return true;
  }
  void end_rest() {
    resting_ = levelled_in_rest_ = false;
    rest_.reset();
    held_ = newest_ = {};
  }

  void rest(const ImuSample& sample, const Vector3& gyro, double dt_s) {
    const bool grown = gather(sample, gyro, dt_s);
    since_rest_s_ = 0;
    velocity_l_.setZero();
    knows_gear_ = true;
    const double rested_s = rest_.duration_s() + held_.duration_s + newest_.duration_s;
    if (rested_s < settings_.min_rest_s || rest_.count() < 10)
      turn(gyro, dt_s);
    else if (grown || !levelled_in_rest_)
      level_at_rest();
  }

  void level_at_rest() {
    const bool aligned = state_ == AlignmentState::aligned;
    const double heading = state_ == AlignmentState::collecting ? 0.0 : heading_of(R_lb_);
    // Without a heading only the vertical part of the Earth's rate is known in b.
    const Vector3 up_w = -gravity_w_.normalized();
    const Vector3 up_l = aligned ? up_w : Vector3::UnitZ();
    const Vector3 earth_l = aligned ? earth_w_ : Vector3{earth_w_.dot(up_w) * up_l};
    const Result<RestAlignment> a = align_at_rest(rest_, settings_.noise, -gravity_w_.norm() * up_l, earth_l, heading, 0);
    if (!a.ok()) return;
    R_lb_ = a->R_wb;
    gyro_bias_ = a->gyro_bias_b_radps;
    const double unknown = aligned ? 0.0 : horizontal_earth_rate();
    gyro_bias_covariance_ = a->gyro_bias_covariance + unknown * unknown * Matrix3::Identity();
    tilt_variance_ = a->attitude_covariance.trace() / 2;
    attitude_accel_bias_l_ = R_lb_ * a->attitude_accel_bias;
    rest_R_lb_ = R_lb_;
    level_time_ = last_->time;
    from_rest_ = levelled_in_rest_ = true;
    if (state_ == AlignmentState::collecting) become_levelled();
  }

  // Motion.
  void move(const Vector3& gyro, const Vector3& accel, double dt_s) {
    if (resting_ && levelled_in_rest_) {  // the blocks that were held back may have turned already
      const double held_s = held_.duration_s + newest_.duration_s;
      R_lb_ = R_lb_ * so3::exp(held_.turn_b + newest_.turn_b - held_s * gyro_bias_);
    }
    if (resting_) end_rest();
    turn(gyro, dt_s);
    since_rest_s_ += dt_s;
    if (since_rest_s_ > settings_.gear_memory_s) knows_gear_ = false;
    const Vector3 down_l = state_ == AlignmentState::aligned ? Vector3{gravity_w_} : Vector3{0, 0, -gravity_w_.norm()};
    velocity_l_ += (R_lb_ * accel + down_l) * dt_s;
  }

  void turn(const Vector3& gyro, double dt_s) {
    if (state_ == AlignmentState::collecting) return;
    const Vector3 earth_b = state_ == AlignmentState::aligned ? Vector3{R_lb_.transpose() * earth_w_} : Vector3::Zero();
    R_lb_ = R_lb_ * so3::exp((gyro - gyro_bias_ - earth_b) * dt_s);
    if (place_) place_->track(heading_of(R_lb_), dt_s);
  }

  [[nodiscard]] double horizontal_earth_rate() const {
    const Vector3 up_w = -gravity_w_.normalized();
    return (earth_w_ - earth_w_.dot(up_w) * up_w).norm();
  }
  [[nodiscard]] double seconds_since_level() const { return last_ ? std::max(0.0, seconds_between(level_time_, last_->time)) : 0.0; }

  // Up on the move.
  void level_without_velocity() {
    level_from_interval(-gravity_w_, {}, std::numbers::sqrt2 * settings_.velocity_change_sigma_mps);
    start_interval();
  }

  /// Levels by the interval's force, which is `force_w` in w but for the change of velocity, whose sigma is given. With a heading l becomes w.
  void level_from_interval(const Vector3& force_w, const std::optional<HeadingEstimate>& heading, double sigma_change_mps) {
    const Vector3 mean_b = interval_force_b_ / interval_s_;
    const double g = gravity_w_.norm(), heading_l = heading ? heading->heading_rad : state_ == AlignmentState::collecting ? 0.0 : heading_of(R_lb_);
    const Vector3 target = heading ? force_w : Vector3{0, 0, g};
    const Result<Matrix3> R = attitude_from_force<Scalar>(mean_b, target, heading_l);
    if (!R.ok()) return;
    const double bias = settings_.noise.gyro_bias_sigma_radps * interval_s_ / 2, force = sigma_change_mps / interval_s_;
    const double variance = (force * force + settings_.noise.accel_bias_sigma_mps2 * settings_.noise.accel_bias_sigma_mps2) / (g * g) + bias * bias;
    if (state_ != AlignmentState::collecting && variance >= sigma_tilt_rad() * sigma_tilt_rad()) return;
    R_lb_ = *R;
    tilt_variance_ = variance;
    attitude_accel_bias_l_.setZero();
    level_time_ = last_->time;
    from_rest_ = false;
    if (state_ == AlignmentState::collecting) become_levelled();
  }

  void become_levelled() {
    state_ = AlignmentState::levelled;
    candidate_.reset(), place_.reset();
    if (given_) use_given();
  }

  // Heading.
  void use_velocity(GpsTime time, const Vector3& v_w, double sigma) {
    const double speed = std::hypot(v_w.x(), v_w.y());
    if (interval_velocity_ && interval_s_ >= settings_.moving_interval_s && !from_rest_) {
      const Vector3 force_w = (v_w - interval_velocity_->v_w) / interval_s_ - gravity_w_;
      const double change = std::hypot(sigma, interval_velocity_->sigma);
      if (speed >= settings_.min_speed_unknown_gear_mps && state_ == AlignmentState::collecting) {
        const HeadingEstimate course{course_of(v_w), 0};
        level_from_interval(force_w, course, change);
      } else {  // the change of velocity cannot be told from tilt without a heading
        level_from_interval(force_w, {}, std::hypot(change, (v_w - interval_velocity_->v_w).norm()));
      }
    }
    if (!interval_velocity_ || interval_s_ >= settings_.moving_interval_s) {
      start_interval();
      interval_velocity_ = Velocity{time, v_w, sigma};
    }
    if (state_ == AlignmentState::levelled) use_course(time, v_w, sigma, speed);
  }

  void use_course(GpsTime time, const Vector3& v_w, double sigma, double speed) {
    const int gear = direction_of_travel();
    if (speed < (gear != 0 ? settings_.min_speed_mps : settings_.min_speed_unknown_gear_mps)) return void(heading_wait_ = AlignmentWait::heading_speed);
    const Matrix3 level_b = upright_axes<Scalar>(Vector3::UnitZ(), heading_of(R_lb_)).transpose() * R_lb_;
    const Vector3 rate = level_b * (last_->gyro_b_radps - gyro_bias_);
    if (std::abs(rate.z()) > settings_.max_rate_radps) return void(heading_wait_ = AlignmentWait::heading_straight);
    HeadingEstimate h = heading_from_velocity(v_w, sigma, rate, (gear < 0 ? -1.0 : 1.0) * (level_b * settings_.lever_arm_b_m), settings_.course);
    const double age_s = seconds_between(time, last_->time);
    h.heading_rad -= rate.z() * age_s;  // the course is of the velocity's time; turning left lowers the heading
    if (gear < 0) h.heading_rad += std::numbers::pi;
    offer({wrapped(h.heading_rad - heading_of(R_lb_)), h.sigma_rad}, HeadingSource::velocity, gear < 0);
  }

  /// +1 along the forward axis, -1 against it, 0 not known: from the velocity that the accelerometer has gathered since the rest.
  [[nodiscard]] int direction_of_travel() const {
    if (!knows_gear_ || !from_rest_) return 0;
    const double h = heading_of(R_lb_), forward = velocity_l_.x() * std::sin(h) + velocity_l_.y() * std::cos(h);
    const double doubt = 0.5 + 2 * settings_.noise.accel_bias_sigma_mps2 * since_rest_s_;
    return forward > doubt ? 1 : forward < -doubt ? -1 : 0;
  }

  void use_position(const Vector3& p_w, double sigma) {
    const double turned = place_ ? place_->most_turn : 0.0;
    if (!place_ || turned > settings_.max_turn_rad) {
      if (place_) heading_wait_ = AlignmentWait::heading_straight;
      return void(place_ = Place{p_w, sigma, heading_of(R_lb_)});
    }
    const Vector3 d = p_w - place_->p_w;
    const double both = std::hypot(sigma, place_->sigma);
    if (std::hypot(d.x(), d.y()) < std::max(settings_.min_displacement_m, 8 * both)) return;
    const int gear = direction_of_travel();
    if (gear == 0 && !(velocity_ && velocity_->v_w.template head<2>().norm() > settings_.min_speed_unknown_gear_mps))
      return void(heading_wait_ = AlignmentWait::heading_speed);
    const Vector3 lever_arm_b_m = settings_.lever_arm_b_m;
    HeadingEstimate h = heading_from_displacement(d, both, turned, lever_arm_b_m.norm(), settings_.course);
    if (gear < 0) h.heading_rad += std::numbers::pi;
    const double mean_l = place_->heading_l + place_->mean_turn();
    place_ = Place{p_w, sigma, heading_of(R_lb_)};
    offer({wrapped(h.heading_rad - mean_l), h.sigma_rad}, HeadingSource::displacement, gear < 0);
  }

  /// An estimate of the turn from l to w. Two that agree are fused and count.
  void offer(const HeadingEstimate& turn, HeadingSource source, bool reversed) {
    if (turn.sigma_rad > settings_.max_heading_sigma_rad) return void(heading_wait_ = AlignmentWait::heading_certainty);
    const bool agrees = candidate_ && std::abs(wrapped(turn.heading_rad - candidate_->heading_rad)) <= 3 * std::hypot(turn.sigma_rad, candidate_->sigma_rad);
    if (!agrees) {
      candidate_ = turn;
      heading_wait_ = AlignmentWait::heading_confirmation;
      return;
    }
    // Both share the course error of the model, so the fused sigma stays that of the better one.
    const double a = 1 / (turn.sigma_rad * turn.sigma_rad), b = 1 / (candidate_->sigma_rad * candidate_->sigma_rad);
    const double fused = candidate_->heading_rad + a / (a + b) * wrapped(turn.heading_rad - candidate_->heading_rad);
    reversed_ = reversed;
    become_aligned(fused, std::min(turn.sigma_rad, candidate_->sigma_rad), source);
  }

  void use_given() {
    if (state_ == AlignmentState::collecting || !given_) return;
    become_aligned(wrapped(given_->heading_rad - heading_of(R_lb_)), given_->sigma_rad, HeadingSource::given);
    given_.reset();
  }

  /// Turns l into w: about the up axis of w.
  void become_aligned(double turn_rad, double sigma_rad, HeadingSource source) {
    if (state_ == AlignmentState::aligned) return;
    const Matrix3 R_wl = upright_axes<Scalar>(-gravity_w_, turn_rad);
    R_lb_ = R_wl * R_lb_;
    rest_R_lb_ = R_wl * rest_R_lb_;
    attitude_accel_bias_l_ = R_wl * attitude_accel_bias_l_;
    if (from_rest_) {  // the horizontal part of the Earth's rate was not known in the rest
      const Vector3 up_w = -gravity_w_.normalized();
      gyro_bias_ -= rest_R_lb_.transpose() * (earth_w_ - earth_w_.dot(up_w) * up_w);
    }
    velocity_l_ = R_wl * velocity_l_;
    tilt_variance_ = sigma_tilt_rad() * sigma_tilt_rad();
    level_time_ = last_->time;
    heading_variance_ = sigma_rad * sigma_rad;
    source_ = source;
    state_ = AlignmentState::aligned;
  }

  void fill_covariance(BasicAlignment<Scalar>& a, const Matrix3& position, double sigma_v) const {
    typename BasicAlignment<Scalar>::Covariance& C = a.covariance;
    const Vector3 up_b = -(a.state.R_wb.transpose() * gravity_w_).normalized();
    const Matrix3 vertical = up_b * up_b.transpose();
    const double tilt = sigma_tilt_rad(), bias = settings_.noise.accel_bias_sigma_mps2;
    const Matrix3 attitude = tilt * tilt * (Matrix3::Identity() - vertical) + heading_variance_ * vertical;
    const Vector3 lever_arm_b_m = settings_.lever_arm_b_m;
    const Matrix3 arm = -a.state.R_wb * so3::skew(lever_arm_b_m);  // d p_wa / d attitude; p_wb = p_wa - R l
    C.setZero();
    C.template block<3, 3>(0, 0) = attitude;
    C.template block<3, 3>(3, 0) = -arm * attitude;
    C.template block<3, 3>(0, 3) = C.template block<3, 3>(3, 0).transpose();
    C.template block<3, 3>(3, 3) = position + arm * attitude * arm.transpose();
    C.template block<3, 3>(6, 6) = sigma_v * sigma_v * Matrix3::Identity();
    C.template block<3, 3>(9, 9) = bias * bias * Matrix3::Identity();
    C.template block<3, 3>(0, 9) = a.state.R_wb.transpose() * attitude_accel_bias_l_;
    C.template block<3, 3>(9, 0) = C.template block<3, 3>(0, 9).transpose();
    C.template block<3, 3>(3, 9) = -arm * C.template block<3, 3>(0, 9);
    C.template block<3, 3>(9, 3) = C.template block<3, 3>(3, 9).transpose();
    C.template block<3, 3>(12, 12) = gyro_bias_covariance_;
  }

  /// Where a displacement began, and how the heading went since.
  struct Place {
    Vector3 p_w{Vector3::Zero()};
    double sigma{0}, heading_l{0};
    double most_turn{0}, turn_seconds{0}, seconds{0};
    void track(double heading, double dt_s) {
      const double turn = wrapped(heading - heading_l);
      most_turn = std::max(most_turn, std::abs(turn));
      turn_seconds += turn * dt_s;
      seconds += dt_s;
    }
    [[nodiscard]] double mean_turn() const { return seconds > 0 ? turn_seconds / seconds : 0.0; }
  };

  InitializerSettings settings_;
  AlignmentState state_{AlignmentState::collecting};
  AlignmentWait heading_wait_{AlignmentWait::heading_source};
  HeadingSource source_{HeadingSource::none};
  bool has_gravity_{false}, resting_{false}, levelled_in_rest_{false}, from_rest_{false}, reversed_{false}, knows_gear_{false};
  Vector3 gravity_w_{0, 0, -9.8}, earth_w_{Vector3::Zero()};
  std::optional<ImuSample> last_;
  std::optional<Velocity> velocity_, interval_velocity_;
  std::optional<HeadingEstimate> candidate_, given_;
  std::optional<Place> place_;
  BasicRestStatistics<Scalar> rest_;
  Block held_, newest_;
  Matrix3 R_lb_{Matrix3::Identity()}, rest_R_lb_{Matrix3::Identity()};
  Matrix3 attitude_accel_bias_l_{Matrix3::Zero()};  ///< cov(d, b_a) of the rest with its attitude rows turned into l (or w)
  Vector3 gyro_bias_{Vector3::Zero()};
  Matrix3 gyro_bias_covariance_{Matrix3::Identity()};
  double tilt_variance_{0}, heading_variance_{0};
  GpsTime level_time_{};
  double since_rest_s_{0};
  Vector3 velocity_l_{Vector3::Zero()};
  double interval_s_{0};
  Vector3 interval_force_b_{Vector3::Zero()};
};
using Initializer = BasicInitializer<double>;  ///< in double precision

}  // namespace searvins::imu
