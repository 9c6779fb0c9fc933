// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The fixed-lag workload (tests/vision/fixed_lag_workload.hpp) through the smoother, without a benchmark library: processor time of an
/// update (median, p99, mean), allocations, memory, and the accuracy that the figures come with. For profilers too:
///
///     g++ -std=c++20 -O3 -DNDEBUG -g -I include -I tests -isystem /usr/include/eigen3 tests/bench/fixed_lag_timing.cpp -o fixed_lag_timing
///     fixed_lag_timing DATA [steps=1] [frames=1200] [relinearise=0] [weight=0] [halvings=2] [print=0]
///     valgrind --tool=callgrind --toggle-collect=timed_update fixed_lag_timing DATA frames=150
///
/// An update is the preintegration of ten readings, the new factors, the optimisation, the newest state read and the oldest one
/// marginalised; the first 70 are left out, as for the other solvers. Allocations are those inside optimise() and marginalise_oldest(),
/// and the driver's own lists.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/processor_time.hpp"
#include "support/allocation_counter.hpp"
#include "vision/fixed_lag_workload.hpp"

namespace {

/// The number after `name=` among the arguments.
double option(int argc, char** argv, const std::string& name, double otherwise) {
  for (int i = 2; i < argc; ++i)
    if (const std::string a = argv[i]; a.rfind(name + "=", 0) == 0) return std::atof(a.c_str() + name.size() + 1);
  return otherwise;
}

}  // namespace

/// What a profiler is told to collect.
extern "C" [[gnu::noinline]] void timed_update(searvins::test::FixedLagRun* run) { run->update(); }

int main(int argc, char** argv) {
  using searvins::bench::processor_ms;
  using searvins::test::FixedLagRun, searvins::test::heap_allocations;
  if (argc < 2) return std::fprintf(stderr, "usage: fixed_lag_timing DATA [steps=1] [frames=1200] [relinearise=0] [weight=0] [halvings=2] [print=0]\n"), 2;
  const auto workload = searvins::test::read_fixed_lag_workload(argv[1]);
  if (!workload) return std::fprintf(stderr, "no workload in %s\n", argv[1]), 1;
  auto options = FixedLagRun::options_of(static_cast<int>(option(argc, argv, "steps", 1)));
  options.relinearise_threshold = option(argc, argv, "relinearise", 0);
  options.max_step_halvings = static_cast<int>(option(argc, argv, "halvings", options.max_step_halvings));
  options.weight_threshold = option(argc, argv, "weight", 0);
  const std::size_t frames = std::min(workload->frames.size(), static_cast<std::size_t>(option(argc, argv, "frames", 1200)));
  constexpr std::size_t kWarmUp = 70;

  FixedLagRun run(*workload, options);
  std::vector<double> ms;
  ms.reserve(frames);
  unsigned long long counted = 0;
  while (run.frame() < frames) {
    const double begin = processor_ms();
    const unsigned long long before = heap_allocations();
    if (run.frame() < kWarmUp) {
      run.update();
      continue;
    }
    timed_update(&run);
    ms.push_back(processor_ms() - begin);
    counted += heap_allocations() - before;
  }
  if (ms.empty()) return std::fprintf(stderr, "frames must exceed %zu\n", kWarmUp), 2;
  double sum = 0;
  for (double t : ms) sum += t;
  std::sort(ms.begin(), ms.end());
  const auto n = static_cast<double>(ms.size());
  const auto& c = run.counts();
  std::printf("processor ms an update: median %.3f  p99 %.3f  max %.3f  mean %.3f\n", ms[ms.size() / 2], ms[ms.size() * 99 / 100], ms.back(), sum / n);
  std::printf("allocations an update: %.1f (driver's lists included)   smoother: %.1f MB\n", static_cast<double>(counted) / n,
              static_cast<double>(sizeof(FixedLagRun::Smoother)) / 1e6);
  std::printf("newest state RMSE %.6f m   fronts factored an update %.1f   damped steps %d   refused %d   kept back %d\n",
              searvins::test::rms_distance_m(run.newest(), workload->truth), c.fronts_factored / static_cast<double>(run.frame()),
              c.damped_steps, c.refused, c.kept_back);
  if (option(argc, argv, "print", 0) > 0)
    for (const auto& p : run.newest()) std::printf("%.2f %.15g %.15g %.15g\n", p.t_s, p.p_w_m[0], p.p_w_m[1], p.p_w_m[2]);
  return 0;
}
