// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What goes into a single-point solution and what comes out of it; single_point.hpp computes it.
///
/// The state is x = (position in ECEF; c times the receiver clock offset, tag minus system time, of GPS, Galileo, BeiDou, QZSS; delay
/// of the receiver's other carriers against the L1 family): eight numbers, all in metres.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/gnss/weighting.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::gnss {

inline constexpr int kSinglePointClocks = static_cast<int>(kConstellations);  ///< one a constellation
inline constexpr int kSinglePointUnknowns = 3 + kSinglePointClocks + 1;  ///< position, clocks, delay of the other carriers
inline constexpr std::size_t kCodesPerSatellite = 2;  ///< carriers of one satellite that a single-point solution can use
inline constexpr std::size_t kMaxCodeRows = kCodesPerSatellite * kMaxSatellitesPerEpoch;  ///< codes of one solution

/// Position (0..2), clocks of the constellations (3..6) and delay of the other carriers (7), all metres.
/// Not aligned for vector registers: the layout of a solution does not follow machine flags.
template <class Scalar>
using BasicSinglePointVector = Eigen::Matrix<Scalar, kSinglePointUnknowns, 1, Eigen::DontAlign>;
using SinglePointVector = BasicSinglePointVector<double>;  ///< in double precision
/// Covariance of a SinglePointVector, m^2.
template <class Scalar>
using BasicSinglePointMatrix = Eigen::Matrix<Scalar, kSinglePointUnknowns, kSinglePointUnknowns, Eigen::DontAlign>;
using SinglePointMatrix = BasicSinglePointMatrix<double>;  ///< in double precision

/// What became of a satellite's code.
enum class CodeFate : std::uint8_t {
  used,          ///< in the solution
  no_code,       ///< no plausible code of a wanted signal
  weak,          ///< C/N0 below the limit
  no_ephemeris,  ///< no healthy record of sufficient age, or an unusable one
  low,           ///< below the elevation mask
  outlier,       ///< excluded: contradicts the others
};

/// Settings of a single-point solution.
struct SinglePointOptions {
  SigmaModel sigma{geodetic_profile()};  ///< codes; robust weights take care of what is far larger
  Screening screening{10 * std::numbers::pi / 180, 15};
  EphemerisPolicy ephemeris{};
  StaticVector<SignalCode, SigmaModel::kMaxSignals> signals{};  ///< wanted signals in order of preference; empty: any, L1/E1/B1I first
  std::size_t codes_per_satellite{1};                           ///< 1 .. kCodesPerSatellite
  double cn0_decade_db{5};                                      ///< of the growth of the code variance with falling C/N0
  double ionosphere_relative_sigma{0.3};                        ///< error of the modelled ionospheric delay, relative to it
  double troposphere_relative_sigma{0.05};                      ///< likewise
  double satellite_variance_factor{0.1};  ///< on the square of the broadcast accuracy, which bounds the error rather than describing it
  /// Of the constellations' clocks about a common one: GPS, Galileo, BeiDou, QZSS.
  std::array<double, kConstellations> clock_difference_sigma_m{1, 6, 15, 3};
  double late_factor{2};             ///< at least 1: robust weights and exclusion take a late code for so many times its sigmas
  double other_carrier_sigma_m{10};  ///< of the delay of the receiver's other carriers against the L1 family
  double outlier_sigmas{3};          ///< hard exclusion
  double false_alarm{1e-3};          ///< of the chi-square test of what is left
  double data_information_scale{1};  ///< against the prior: below 1 when the errors of consecutive epochs are alike
  Eigen::Vector3d start_e_m{Eigen::Vector3d::Zero()};  ///< without prior; any point up to a few Earth radii
};

/// A Gaussian prediction of position and clocks. Directions without information have zero rows: information need not be invertible.
/// Scalar: double or wider, as in everything here.
template <class Scalar>
struct BasicSinglePointPrior {
  using Vector = BasicSinglePointVector<Scalar>;
  using Matrix = BasicSinglePointMatrix<Scalar>;

  Vector mean{Vector::Zero()};
  Matrix information{Matrix::Zero()};
  bool knows_receiver_delays{false};  ///< true: the options' clock differences and carrier delay are not applied on top

  /// Position known to `sigma_m` in every axis, clocks unknown.
  [[nodiscard]] static BasicSinglePointPrior at(const math::Vector3<Scalar>& position_e_m, double sigma_m) {
    BasicSinglePointPrior p;
    p.mean.template head<3>() = position_e_m;
    p.information.diagonal().template head<3>().setConstant(1.0 / (sigma_m * sigma_m));
    return p;
  }
};

using SinglePointPrior = BasicSinglePointPrior<double>;  ///< in double precision

/// One code in the solution, or the reason why it is not.
struct CodeRow {
  SatelliteId satellite{};
  SignalCode signal{};
  CodeFate fate{CodeFate::used};
  Transmission transmission{};
  double corrected_m{0};   ///< code plus satellite clock of this signal
  double atmosphere_m{0};  ///< modelled delay; 0 until a position is known
  double azimuth_rad{0}, elevation_rad{0};
  double cn0_dbhz{kMissing};
  double sigma_m{0};
  double residual_m{0};  ///< corrected - modelled, at the solution; positive: late
};

/// What a solution says besides its rows.
template <class Scalar>
struct BasicSinglePointEstimate {
  using Vector3 = math::Vector3<Scalar>;
  using Vector = BasicSinglePointVector<Scalar>;
  using Matrix = BasicSinglePointMatrix<Scalar>;

  GpsTime time{};  ///< of the position: tag minus the mean clock offset of the used rows
  Vector3 position_e_m{Vector3::Zero()};
  Vector state{Vector::Zero()};                   ///< position and clocks, metres
  Matrix covariance{Matrix::Zero()};              ///< of state; scaled up by the chi-square test when that fails
  std::array<double, kConstellations> clock_s{};  ///< receiver tag minus system time
  std::array<bool, kConstellations> constellation_used{};
  int used{0}, excluded{0};  ///< rows in the solution; rows found to be outliers
  double gdop{0};            ///< sqrt trace of the unweighted cofactor of position and clocks
  double chi_square{0};      ///< weighted square sum of used rows and prior
  int redundancy{0};
  bool consistent{false};  ///< the chi-square test was passed, with redundancy

  [[nodiscard]] math::Matrix3<Scalar> position_covariance_m2() const { return covariance.template topLeftCorner<3, 3>(); }
};

/// Result of one epoch. Some 20 kB: where a stack is small, keep one and have it filled.
template <class Scalar>
struct BasicSinglePointSolution : BasicSinglePointEstimate<Scalar> {
  StaticVector<CodeRow, kMaxCodeRows> rows{};  ///< one for every code tried, and one for a satellite without code

  /// As it was made, without another one beside it.
  void clear() {
    static_cast<BasicSinglePointEstimate<Scalar>&>(*this) = {};
    rows.clear();
  }
};

using SinglePointSolution = BasicSinglePointSolution<double>;  ///< in double precision

}  // namespace searvins::gnss
