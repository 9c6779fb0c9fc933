// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the RTK estimator says of one epoch.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <limits>
#include <string_view>

#include <searvins/ambiguity/resolution.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>

namespace searvins::estimator {

/// Quality of a position, best first.
enum class SolutionStatus : std::uint8_t {
  fix,    ///< integers were accepted at this very epoch and the window re-optimised with them
  float_,  ///< carrier phases with real-valued ambiguities, or riding on earlier fixes
  dgnss,  ///< double-differenced codes only
  spp,    ///< single point, no base
  dr      ///< prediction, no GNSS used
};

/// The word for a status in files and tables.
[[nodiscard]] constexpr const char* name_of(SolutionStatus s) {
  constexpr const char* names[] = {"fix", "float", "dgnss", "spp", "dr"};
  return names[static_cast<std::size_t>(s)];
}

/// What made the estimator place a state.
enum class SolutionSource : std::uint8_t {
  rover,     ///< a rover epoch
  position,  ///< a position from elsewhere
  camera,    ///< a frame
  readings   ///< silence of all others
};

/// The newest-state estimate at one rover epoch, causal.
struct RtkSolution {
  GpsTime tag{};   ///< the receiver's own epoch tag
  GpsTime time{};  ///< GPS time of the state: tag minus the estimated receiver clock offset
  SolutionStatus status{SolutionStatus::dr};
  SolutionSource source{SolutionSource::rover};
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};           ///< antenna, ECEF
  Eigen::Vector3d velocity_e_mps{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d covariance_enu_m2{Eigen::Matrix3d::Zero()};      ///< of the position, East-North-Up at the position
  Eigen::Matrix3d velocity_covariance_enu{Eigen::Matrix3d::Zero()};  ///< (m/s)^2
  double clock_offset_s{0};
  int satellites{0};        ///< distinct satellites used
  int double_differences{0};  ///< code and phase
  int phases{0}, fixed_phases{0};
  int tracks{0};              ///< observations of landmarks that the newest frame brought
  double base_age_s{std::numeric_limits<double>::quiet_NaN()};
  ambiguity::ResolutionVerdict verdict{ambiguity::ResolutionVerdict::too_few};
  double success_rate{0}, ratio{0};
  Eigen::Vector3d innovation_enu_m{Eigen::Vector3d::Zero()};  ///< how far the last integers that were tried would move the float
  double code_weight{0}, phase_weight{0};  ///< mean robust weights of this epoch's rows, 0 without rows
  double code_scale{1}, phase_scale{1};  ///< learned factors on the sigmas of code and phase
  int held_integers{0};     ///< integer constraints in the window after this epoch
  int released_integers{0};  ///< taken back at this epoch
  int iterations{0};        ///< Gauss-Newton iterations, float and fixed together
  bool restarted{false};    ///< the window was started (anew) at this epoch
  bool has_attitude{false};  ///< an inertial estimator is aligned: the next members count
  bool stationary{false};    ///< the inertial unit says that the vehicle stands
  bool in_lane{false};       ///< a centre line of the map holds this state
  Eigen::Matrix3d R_nb{Eigen::Matrix3d::Identity()};            ///< body to East-North-Up at the position
  Eigen::Vector3d attitude_sigma_rad{Eigen::Vector3d::Zero()};  ///< about east, north, up
  Eigen::Vector3d accel_bias_b_mps2{Eigen::Vector3d::Zero()}, gyro_bias_b_radps{Eigen::Vector3d::Zero()};
  Status smoother_status{};  ///< of the last optimisation
};

/// What Estimator::next() says when no solution is due.
inline constexpr const char* kNothingDue = "no solution is due";

/// Whether a status of next() says that nothing is due, rather than what is wrong with the epoch that was next.
[[nodiscard]] inline bool is_nothing_due(const Status& s) {
  return s.code == StatusCode::no_data && std::string_view{s.what} == kNothingDue;
}

}  // namespace searvins::estimator
