// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A solution as a list of numbers, for tests that compare runs bit by bit.
#pragma once

#include <cmath>
#include <vector>

#include <searvins/estimator/rtk_solution.hpp>

namespace searvins::test {

/// Every number of a solution, to be compared bit by bit.
inline std::vector<double> numbers_of(const estimator::RtkSolution& s) {
  std::vector<double> v{static_cast<double>(s.tag.ns % 1'000'000'000'000'000),
                        static_cast<double>(s.time.ns % 1'000'000'000'000'000),
                        static_cast<double>(s.status),
                        s.clock_offset_s,
                        static_cast<double>(s.satellites),
                        static_cast<double>(s.double_differences),
                        static_cast<double>(s.phases),
                        static_cast<double>(s.fixed_phases),
                        std::isnan(s.base_age_s) ? -1 : s.base_age_s,
                        static_cast<double>(s.verdict),
                        s.success_rate,
                        s.ratio,
                        s.code_weight,
                        s.phase_weight,
                        s.code_scale,
                        s.phase_scale,
                        static_cast<double>(s.held_integers),
                        static_cast<double>(s.released_integers),
                        static_cast<double>(s.iterations),
                        static_cast<double>(s.restarted),
                        static_cast<double>(s.has_attitude),
                        static_cast<double>(s.stationary),
                        static_cast<double>(s.in_lane)};
  for (int i = 0; i < 3; ++i) {
    v.insert(v.end(), {s.position_e_m[i], s.velocity_e_mps[i], s.attitude_sigma_rad[i], s.accel_bias_b_mps2[i], s.gyro_bias_b_radps[i]});
    for (int j = 0; j < 3; ++j) v.insert(v.end(), {s.covariance_enu_m2(i, j), s.velocity_covariance_enu(i, j), s.R_nb(i, j)});
  }
  return v;
}

}  // namespace searvins::test
