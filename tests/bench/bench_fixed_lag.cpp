// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The fixed-lag smoother with navigation states, landmarks, inertial, stereo and position factors: time of an update on the workload
/// that other solvers have run (peers/fixed_lag of the shared data; tests/vision/fixed_lag_workload.hpp). An update is the preintegration
/// of ten readings, the new factors, the optimisation, the newest state read and the oldest one marginalised. The first 70 are left out,
/// as for the others.
///
/// Machines drift and are shared: run the Ceres driver of the shared data in the same minute, and compare the ratio.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "support/shared_data.hpp"
#include "vision/fixed_lag_workload.hpp"

namespace {

using searvins::test::FixedLagRun;
using searvins::test::FixedLagWorkload;

constexpr std::size_t kWarmUp = 70, kFrames = 370;

const std::optional<FixedLagWorkload>& workload() {
  static const std::optional<FixedLagWorkload> read = [] {
    const auto shared = searvins::test::shared_data();
    return shared ? searvins::test::read_fixed_lag_workload(*shared / "peers/fixed_lag/data") : std::nullopt;
  }();
  return read;
}

/// One update an iteration; a fresh drive when one is used up. Counters in milliseconds.
void BM_Update(benchmark::State& state) {
  if (!workload()) {
    state.SkipWithError("the shared data is not there");
    return;
  }
  std::optional<FixedLagRun> run;
  std::vector<double> ms;
  for (auto _ : state) {
    if (!run || run->frame() == std::min(kFrames, workload()->frames.size())) {
      state.PauseTiming();
      run.emplace(*workload(), FixedLagRun::options_of(static_cast<int>(state.range(0))));
      while (run->frame() < kWarmUp) run->update();
      state.ResumeTiming();
    }
    const auto begin = std::chrono::steady_clock::now();
    run->update();
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  std::sort(ms.begin(), ms.end());
  state.counters["median_ms"] = ms[ms.size() / 2];
  state.counters["p99_ms"] = ms[std::min(ms.size() - 1, ms.size() * 99 / 100)];
  state.counters["MB"] = static_cast<double>(sizeof(FixedLagRun::Smoother)) / 1e6;
}

// Gauss-Newton steps an update.
BENCHMARK(BM_Update)->ArgName("steps")->Arg(1)->Arg(2)->Iterations(static_cast<int>(kFrames - kWarmUp))->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
