// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Drives with an inertial unit, simulated (examples/simulator, which shares no model with the library) or recorded, as events in the order of their
/// arrival; a run of the estimator over them; and its score against the truth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <searvins/estimator/estimator.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_observation.hpp>

#include "estimator/inertial_under_test.hpp"
#include "estimator/solution_numbers.hpp"
#include "support/property.hpp"

namespace searvins::test {

/// What the antenna and the body really did.
struct DriveTruth {
  Eigen::Vector3d antenna_e_m{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_nb{Eigen::Matrix3d::Identity()};
};

/// Everything of a drive that the estimator is told, and the truth.
struct InertialDrive {
  std::vector<gnss::ObservationEpoch> rover{}, base{};
  std::vector<imu::ImuSample> imu{};
  std::vector<gnss::Ephemeris> ephemerides{};
  gnss::KlobucharCoefficients ionosphere{};
  Eigen::Vector3d base_e_m{Eigen::Vector3d::Zero()}, lever_arm_b_m{Eigen::Vector3d::Zero()};
  imu::ImuNoise noise{};
  imu::SampleKind kind{imu::SampleKind::instantaneous};
  GpsTime start{};
  std::function<std::optional<DriveTruth>(GpsTime)> truth{};
  std::vector<vision::StereoFrame<128>> frames{};  ///< only where they were asked for
  vision::StereoCamera<double> camera{};
  std::vector<imu::CentrelinePoint> lanes{};  ///< the map that the estimator is given; empty: none

  [[nodiscard]] double seconds(GpsTime t) const { return seconds_between(start, t); }
};

/// Rates of a simulated drive, and what its unit is like.
struct DriveRates {
  double rover_hz{1}, imu_hz{100};
  imu::SampleKind kind{imu::SampleKind::instantaneous};
  bool has_frames{false};  ///< stereo tracks at 10 Hz
  double camera_offset_s{0};                                      ///< frames are exposed so much later than stamped
  Eigen::Vector3d camera_boresight_rad{Eigen::Vector3d::Zero()};  ///< the camera is turned against InertialDrive::camera
};

/// A simulated drive: 20 s of standing, then streets. Profiles: open, light, urban.
InertialDrive simulated_inertial_drive(const std::string& profile, double duration_s, std::uint64_t seed, const DriveRates& rates = {});

/// A simulated drive in the open: it stands until 10 s, drives figures of eight until `stop_s`, and stands again.
InertialDrive drive_that_stops(double stop_s, double duration_s, std::uint64_t seed);

/// Turns the body: the unit is mounted otherwise, and told so by its readings and its lever arm.
inline InertialDrive turned(InertialDrive d, const Eigen::Matrix3d& R_new_b) {
  for (imu::ImuSample& s : d.imu) s.gyro_b_radps = R_new_b * s.gyro_b_radps, s.accel_b_mps2 = R_new_b * s.accel_b_mps2;
  d.lever_arm_b_m = R_new_b * d.lever_arm_b_m;
  d.truth = [before = d.truth, R_new_b](GpsTime t) {
    auto truth = before(t);
    if (truth) truth->R_nb = truth->R_nb * R_new_b.transpose();
    return truth;
  };
  return d;
}

/// The library's defaults with what is known of the unit.
inline estimator::EstimatorOptions options_for(const InertialDrive& d) {
  estimator::EstimatorOptions o;
  o.inertial.preintegration.noise = d.noise, o.inertial.preintegration.kind = d.kind;
  o.inertial.lever_arm_b_m = d.lever_arm_b_m;
  return o;
}

inline InertialUnderTest estimator_for(const InertialDrive& d, const estimator::EstimatorOptions& options) {
  InertialUnderTest e{options};
  for (const gnss::Ephemeris& record : d.ephemerides) REQUIRE(e.add_ephemeris(record).ok());
  if (d.ionosphere.present()) e.set_ionosphere(d.ionosphere);
  REQUIRE(e.set_base_position(d.base_e_m).ok());
  e.set_centrelines(d.lanes);
  return e;
}

enum class Stream : std::uint8_t { imu, base, rover };

/// One reading or epoch, when it arrives.
struct Arrival {
  GpsTime at{};
  Stream stream{Stream::imu};
  std::size_t index{0};
};

/// How late each stream is.
struct Delays {
  double imu_s{0}, base_s{0}, rover_s{0};
};

/// All of a drive in the order of arrival; at the same time readings first, then the base.
inline std::vector<Arrival> arrivals(const InertialDrive& d, const Delays& delays = {}) {
  std::vector<Arrival> all;
  for (std::size_t i = 0; i < d.imu.size(); ++i) all.push_back({d.imu[i].time.plus_seconds(delays.imu_s), Stream::imu, i});
  for (std::size_t i = 0; i < d.base.size(); ++i) all.push_back({d.base[i].tag.plus_seconds(delays.base_s), Stream::base, i});
  for (std::size_t i = 0; i < d.rover.size(); ++i) all.push_back({d.rover[i].tag.plus_seconds(delays.rover_s), Stream::rover, i});
  std::stable_sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) { return a.at < b.at; });
  return all;
}

/// Leaves out what a stream says in [from_s, to_s), seconds since the start by its own stamps.
inline void cut(std::vector<Arrival>& all, const InertialDrive& d, Stream stream, double from_s, double to_s = 1e9) {
  std::erase_if(all, [&](const Arrival& a) {
    if (a.stream != stream) return false;
    const GpsTime t = stream == Stream::imu ? d.imu[a.index].time : stream == Stream::base ? d.base[a.index].tag : d.rover[a.index].tag;
    return d.seconds(t) >= from_s - 1e-6 && d.seconds(t) < to_s - 1e-6;
  });
}

inline Status hand_over(InertialUnderTest& e, const InertialDrive& d, const Arrival& a) {
  if (a.stream == Stream::imu) return e.add_imu(d.imu[a.index]);
  if (a.stream == Stream::base) return e.add_base(d.base[a.index]);
  return e.add_rover(d.rover[a.index]);
}

/// What a run said.
struct Run {
  std::vector<estimator::RtkSolution> solutions{};
  int refused{0};  ///< inputs
  int errors{0};   ///< epochs without a solution
  int alignments{0};
};

inline double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

/// Takes all solutions that are due.
inline void drain(InertialUnderTest& e, Run& run) {
  for (;;) {
    auto s = e.next();
    if (s.ok()) {
      run.solutions.push_back(*s);
      continue;
    }
    if (estimator::is_nothing_due(s.status())) return;
    ++run.errors;
  }
}

inline Run run_all(InertialUnderTest& e, const InertialDrive& d, const std::vector<Arrival>& all, bool finish = true) {
  Run run;
  for (const Arrival& a : all) {
    run.refused += hand_over(e, d, a).ok() ? 0 : 1;
    drain(e, run);
  }
  if (finish) e.finish(), drain(e, run);
  run.alignments = e.alignments();
  return run;
}

inline Run run_all(const InertialDrive& d, const std::vector<Arrival>& all, const estimator::EstimatorOptions& options) {
  InertialUnderTest e = estimator_for(d, options);
  return run_all(e, d, all);
}

/// The way of the antenna as one lane: a point a rover epoch, `right_m` to the right of it, lines numbered from `first_line` on (a new one after a stop).
inline std::vector<imu::CentrelinePoint> lane_of(const InertialDrive& d, double right_m = 0, std::uint32_t first_line = 1) {
  std::vector<imu::CentrelinePoint> points;
  std::uint32_t line = first_line;
  for (std::size_t k = 1; k < d.rover.size(); ++k) {
    const auto now = d.truth(d.rover[k - 1].tag), next = d.truth(d.rover[k].tag);
    if (!now || !next) continue;
    const Eigen::Vector3d way_m = next->antenna_e_m - now->antenna_e_m;
    if (way_m.norm() < 1) {
      ++line;
      continue;
    }
    const Eigen::Vector3d up_e = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(now->antenna_e_m)).col(2);
    points.push_back({now->antenna_e_m + right_m * way_m.cross(up_e).normalized(), line});
  }
  return points;
}

/// Error of a solution, East-North-Up metres; nothing where the truth says nothing.
inline std::optional<Eigen::Vector3d> error_n_m(const InertialDrive& d, const estimator::RtkSolution& s) {
  const auto truth = d.truth(s.time);
  if (!truth) return std::nullopt;
  return Eigen::Vector3d{geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(truth->antenna_e_m)).transpose() *
                         (s.position_e_m - truth->antenna_e_m)};
}

/// Normalised squared horizontal error, 2 on the average when the covariance is right.
inline double horizontal_nees(const Eigen::Vector3d& error, const estimator::RtkSolution& s) {
  const Eigen::Matrix2d P = s.covariance_enu_m2.topLeftCorner<2, 2>();
  const double det = P(0, 0) * P(1, 1) - P(0, 1) * P(1, 0);
  return (error.x() * error.x() * P(1, 1) - 2 * error.x() * error.y() * P(0, 1) + error.y() * error.y() * P(0, 0)) / det;
}
inline double horizontal_sigma_m(const estimator::RtkSolution& s) {
  return std::sqrt(s.covariance_enu_m2(0, 0) + s.covariance_enu_m2(1, 1));
}

/// Figures over solutions between two times.
struct DriveScore {
  int solutions{0}, fixed{0}, wrong{0}, aligned{0};
  std::array<int, 5> by_status{};
  double squares_m2{0}, fixed_squares_m2{0}, max_m{0}, nees{0}, attitude_max_rad{0};
  [[nodiscard]] double rms_m() const { return std::sqrt(squares_m2 / std::max(solutions, 1)); }
  [[nodiscard]] double fixed_rms_m() const { return std::sqrt(fixed_squares_m2 / std::max(fixed, 1)); }
  [[nodiscard]] double mean_nees() const { return nees / std::max(solutions, 1); }
  [[nodiscard]] double fixed_percent() const { return 100.0 * fixed / std::max(solutions, 1); }
  [[nodiscard]] int of(estimator::SolutionStatus s) const { return by_status[static_cast<std::size_t>(s)]; }
};

inline DriveScore score_of(const InertialDrive& d, const Run& run, double from_s = -1e9, double to_s = 1e9) {
  DriveScore score;
  for (const estimator::RtkSolution& s : run.solutions) {
    if (d.seconds(s.tag) < from_s || d.seconds(s.tag) > to_s) continue;
    const auto error = error_n_m(d, s);
    if (!error) continue;
    const double h = error->head<2>().norm();
    ++score.solutions, ++score.by_status[static_cast<std::size_t>(s.status)], score.aligned += s.has_attitude ? 1 : 0;
    score.squares_m2 += h * h, score.max_m = std::max(score.max_m, h), score.nees += horizontal_nees(*error, s);
    if (s.has_attitude) {
      const Eigen::Matrix3d off = s.R_nb * d.truth(s.time)->R_nb.transpose();
      score.attitude_max_rad = std::max(score.attitude_max_rad, so3::log(off).norm());
    }
    if (s.status != estimator::SolutionStatus::fix) continue;
    ++score.fixed, score.wrong += h >= 0.5 ? 1 : 0, score.fixed_squares_m2 += h * h;
  }
  return score;
}

inline std::vector<double> numbers_of(const Run& run) {
  std::vector<double> all;
  for (const estimator::RtkSolution& s : run.solutions) {
    const auto v = numbers_of(s);
    all.insert(all.end(), v.begin(), v.end());
  }
  all.push_back(run.errors);
  return all;
}

}  // namespace searvins::test
