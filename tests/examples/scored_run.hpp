// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scored runs for tests: rows at whole seconds with errors of choice, beside a point that never moves.
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/trajectory.hpp>

#include "examples/support/evaluation.hpp"

namespace searvins::test {

inline const Eigen::Vector3d kTruth_e_m{-3810234.401, 3567867.762, 3652897.917};
inline const GpsTime kStart = GpsTime::from_week_sow(2323, 553980);

/// Rows at whole seconds beside a point that never moves, and their scores.
struct ScoredRun {
  std::vector<io::TrajectoryRow> rows;
  examples::Evaluation evaluation;

  void add(int second, const Eigen::Vector3d& error_enu_m, io::SolutionStatus status = io::SolutionStatus::float_,
           const Eigen::Matrix3d& covariance_m2 = Eigen::Matrix3d::Constant(io::kUnknown)) {
    io::TrajectoryRow row;
    row.time = kStart.plus_seconds(second);
    row.p_e_m = kTruth_e_m + geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(kTruth_e_m)) * error_enu_m;
    row.status = status;
    if (covariance_m2.allFinite()) row.set_covariance_enu_m2(covariance_m2);
    rows.push_back(row);
  }
  void score() {
    const auto result = examples::evaluate(examples::static_truth(kTruth_e_m), rows);
    REQUIRE_MESSAGE(result.ok(), io::to_string(result.error()));
    evaluation = *result;
  }
};

}  // namespace searvins::test
