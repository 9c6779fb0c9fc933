// SPDX-License-Identifier: BSD-3-Clause
// States, inertial unit, stereo landmarks and positions together in the smoother, on a drive that other solvers have run: their answers,
// their accuracy.
//
// One Gauss-Newton step an update instead of their two: half the time, and a millimetre further from them. bench_fixed_lag does two as
// well.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "support/property.hpp"
#include "support/shared_data.hpp"
#include "vision/fixed_lag_workload.hpp"

using namespace searvins::test;

namespace {

/// What a run gives and what the others gave over the same frames, m.
struct WorkloadOutcome {
  std::size_t frames{0};
  bool whole{false};
  double rmse_m{0}, peer_rmse_m{0};  ///< newest state, against truth; the worse of the two peers
  double to_gtsam_m{0}, to_ceres_m{0};
  double median_ms{0};
  FixedLagRun::Counts counts{};
};

/// Nothing when the shared data is not there. SEARVINS_PROPERTY_RUNS below 100 shortens the drive.
std::optional<WorkloadOutcome> run(const std::string& name, const std::string& results) {
  const auto shared = shared_data();
  const auto workload = shared ? read_fixed_lag_workload(*shared / "peers/fixed_lag" / name) : std::nullopt;
  if (!workload) return std::nullopt;
  const std::size_t all = workload->frames.size();
  WorkloadOutcome o;
  o.frames = std::min<std::size_t>(all, property_runs(static_cast<unsigned>(all)));
  o.whole = o.frames == all;
  FixedLagRun run(*workload, FixedLagRun::options_of(1));
  std::vector<double> ms;
  while (run.frame() < o.frames) {
    const auto begin = std::chrono::steady_clock::now();
    run.update();
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  const auto peer = [&](const char* solver) {
    auto poses = read_workload_poses(*shared / "peers/fixed_lag" / results / (std::string{solver} + "_online.csv"));
    poses.resize(std::min(poses.size(), o.frames));
    return poses;
  };
  const auto gtsam = peer("gtsam_batch_it2"), ceres = peer("ceres_sparse_it2");
  o.rmse_m = rms_distance_m(run.newest(), workload->truth);
  o.peer_rmse_m = std::max(rms_distance_m(gtsam, workload->truth), rms_distance_m(ceres, workload->truth));
  o.to_gtsam_m = rms_distance_m(run.newest(), gtsam), o.to_ceres_m = rms_distance_m(run.newest(), ceres);
  std::nth_element(ms.begin(), ms.begin() + static_cast<std::ptrdiff_t>(ms.size() / 2), ms.end());
  o.median_ms = ms[ms.size() / 2];
  o.counts = run.counts();
  char text[320];
  std::snprintf(text, sizeof text,
                "%s: %zu frames, newest state 3-D RMSE %.4f m (peers at worst %.4f), %.1f mm RMS to GTSAM, %.1f mm to Ceres; median %.1f "
                "ms an update, %d damped steps",
                name.c_str(), o.frames, o.rmse_m, o.peer_rmse_m, 1e3 * o.to_gtsam_m, 1e3 * o.to_ceres_m, o.median_ms,
                o.counts.damped_steps);
  MESSAGE(text);
  return o;
}

}  // namespace

TEST_CASE("without outliers the smoother gives the trajectory of the other solvers") {
  const auto o = run("data_clean", "results_clean");
  if (!o) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  CHECK(o->counts.refused == 0);
  CHECK(o->counts.kept_back == 0);
  CHECK(o->rmse_m <= (o->whole ? 0.233 : o->peer_rmse_m + 0.005));
  CHECK(o->to_gtsam_m <= 0.005);
  CHECK(o->to_ceres_m <= 0.005);
}

TEST_CASE("with outlier tracks it is as accurate as they, and every update goes through") {
  const auto o = run("data", "results");
  if (!o) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  CHECK(o->counts.refused == 0);
  CHECK(o->counts.kept_back == 0);
  CHECK(o->rmse_m <= (o->whole ? 0.275 : o->peer_rmse_m + 0.005));
}
