// SPDX-License-Identifier: BSD-3-Clause
// Robust RTK from baked-in observations through the same estimator and smoother as on a desktop, with small capacities: eight seconds
// under open sky, then eight between walls with reflections. Passes when every position is right within bounds and integers were found.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "examples/cortex_m/baked_epochs.hpp"
#include "examples/cortex_m/capacities.hpp"
#include "examples/cortex_m/transcript.hpp"

namespace searvins::cortex_m {
namespace {

// Megabytes: static, never on the stack.
Estimator<SmallCapacity> rtk;
gnss::ObservationEpoch epoch;

void report_solution(int k, const estimator::RtkSolution& s) {
  report("status", k, static_cast<std::int64_t>(s.status));
  report("satellites", k, s.satellites);
  report("double_differences", k, s.double_differences);
  report("fixed_phases", k, s.fixed_phases);
  report("held_integers", k, s.held_integers);
  report("iterations", k, s.iterations);
  report("smoother_status", k, static_cast<std::int64_t>(s.smoother_status.code));
  const Eigen::Vector3d from_base_m = s.position_e_m - position_of(kBasePosition);
  for (int i = 0; i < 3; ++i) report_close("baseline_m", 3 * k + i, from_base_m[i], 9);
  for (int i = 0; i < 3; ++i) report_close("velocity_mps", 3 * k + i, s.velocity_e_mps[i], 6);
  report_close("horizontal_sigma_m", k, std::sqrt(s.covariance_enu_m2.topLeftCorner<2, 2>().trace()), 6);
  report_close("mean_weight", 2 * k, s.code_weight, 5);
  report_close("mean_weight", 2 * k + 1, s.phase_weight, 5);
}

/// Base and rover of one epoch; the error of the position, metres, or something large.
double solve(int k) {
  unpack(kBaseEpochs[k], kBaseSignals, epoch);
  (void)rtk.add_base(epoch);
  unpack(kRoverEpochs[k], kRoverSignals, epoch);
  const std::uint64_t before = instructions();
  const auto solution = rtk.update(epoch);
  const std::uint64_t after = instructions();
  if (!solution.ok()) return 1e9;
  report_solution(k, *solution);
  remark("  update", static_cast<std::int64_t>((after - before) / 1000), "thousand instructions");
  const double error_m = (solution->position_e_m - position_of(kTruth[k])).norm();
  report_close("error_m", k, error_m, 6);
  return solution->smoother_status.ok() || solution->smoother_status.code == StatusCode::not_converged ? error_m : 1e9;
}

bool run() {
  remark("estimator", static_cast<std::int64_t>(sizeof rtk), "bytes");
  if (!prepare(rtk)) return false;
  double worst_m = 0, worst_open_m = 0;
  for (int k = 0; k < kEpochs; ++k) {
    const double error_m = solve(k);
    worst_m = std::max(worst_m, error_m);
    if (k > 0 && k < kEpochs / 2) worst_open_m = std::max(worst_open_m, error_m);
  }
  return worst_open_m < 0.05 && worst_m < 0.5;
}

}  // namespace
}  // namespace searvins::cortex_m

int main() { return searvins::cortex_m::finish(searvins::cortex_m::run()); }
