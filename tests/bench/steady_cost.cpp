// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Does an update grow dearer with the length of a drive? Ten thousand updates of a problem whose every frame looks like the last: a straight
/// drive at 10 m/s, states at 10 Hz over 3 s, 30 stereo tracks of ten frames each, a position a second. Noise repeats with the tracks.
///
///     steady_cost                                    processor time, heap and memory of updates 1000 .. 1999 and 9000 .. 9999
///     valgrind --tool=callgrind --callgrind-out-file=OUT --toggle-collect=early_update --toggle-collect=late_update steady_cost
///     callgrind_annotate --inclusive=yes OUT | grep _update
///
/// Heap: everything that optimise(), marginalise_oldest() and the driver ask for; the driver's map takes one a new landmark, three an update.
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

#include "bench/processor_time.hpp"
#include "support/allocation_counter.hpp"
#include "vision/fixed_lag_workload.hpp"

namespace {

using namespace searvins;
using bench::processor_ms;
using test::FixedLagRun;
using test::FixedLagWorkload;
using test::heap_allocations;

constexpr std::size_t kFrames = 10'000, kWindow = 31;
constexpr int kBornAFrame = 3, kTrackLength = 10, kPatterns = 9;
constexpr double kPeriodS = 0.1, kSpeedMps = 10, kGravityMps2 = 9.81, kFirstDepthM = 30;

long peak_kilobytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

/// A number in -1 .. 1 that repeats with the pattern of a track.
double noise(int pattern, int age, int row) { return std::sin(1.7 * pattern + 2.3 * age + 4.1 * row); }

/// (u left, u right, v) of a track at an age in frames: it comes nearer as the vehicle drives.
Eigen::Vector3d pixel_of(const vision::StereoCamera<double>& camera, int pattern, int age) {
  const double z_m = kFirstDepthM - age * kSpeedMps * kPeriodS, x_m = 2.0 * (pattern - kPatterns / 2), y_m = 0.4 * (pattern % 4 - 2);
  const double u_px = camera.fx_px * x_m / z_m + camera.cx_px, v_px = camera.fy_px * y_m / z_m + camera.cy_px;
  return {u_px + 0.5 * noise(pattern, age, 0), u_px - camera.fx_px * camera.baseline_m / z_m + 0.5 * noise(pattern, age, 1),
          v_px + 0.5 * noise(pattern, age, 2)};
}

/// Body axes are those of the world, y forward.
FixedLagWorkload steady_drive() {
  FixedLagWorkload w;
  w.camera.fx_px = w.camera.fy_px = 400, w.camera.cx_px = 320, w.camera.cy_px = 240, w.camera.baseline_m = 0.5;
  w.camera.width_px = 640, w.camera.height_px = 480;
  w.camera.R_bc << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  w.pixel_sigma_px = 0.7, w.lever_arm_b_m.setZero();
  w.earth.gravity_w_mps2 = {0, 0, -kGravityMps2};
  w.start.v_wb_mps = {0, kSpeedMps, 0};
  w.start_covariance = Eigen::Matrix<double, 15, 15>::Identity() * 1e-4;
  const Eigen::Vector3d force_b_mps2{0, 0, kGravityMps2};
  for (std::size_t i = 0; i <= 10 * kFrames; ++i)
    w.readings.push_back({test::workload_time(0.01 * static_cast<double>(i)), Eigen::Vector3d::Zero(), force_b_mps2});
  for (std::size_t k = 0; k < kFrames; ++k) {
    const double t_s = kPeriodS * static_cast<double>(k);
    w.frame_times_s.push_back(t_s);
    w.frames.emplace_back();
    for (int age = 0; age < kTrackLength && static_cast<std::size_t>(age) <= k; ++age)
      for (int born = 0; born < kBornAFrame; ++born) {
        const int id = (static_cast<int>(k) - age) * kBornAFrame + born;
        w.frames.back().push_back({id, pixel_of(w.camera, id % kPatterns, age)});
      }
    if (k % 10 == 0) w.positions.push_back({t_s, {0, kSpeedMps * t_s, 0}, 0.5});
  }
  return w;
}

struct Stretch {
  const char* name;
  double ms{0};
  unsigned long long heap{0};
  long peak_kb{0};
};

}  // namespace

/// What a profiler is told to collect.
extern "C" [[gnu::noinline]] void early_update(FixedLagRun* run) { run->update(); }
extern "C" [[gnu::noinline]] void late_update(FixedLagRun* run) { run->update(); }

int main() {
  const FixedLagWorkload workload = steady_drive();
  FixedLagRun run(workload, FixedLagRun::options_of(1), kWindow);
  std::array<Stretch, 2> stretches{{{"1000 .. 1999"}, {"9000 .. 9999"}}};
  while (!run.done()) {
    const std::size_t k = run.frame();
    const bool early = k >= 1000 && k < 2000, late = k >= 9000;
    if (!early && !late) {
      run.update();
      continue;
    }
    Stretch& s = stretches[late ? 1 : 0];
    const double begin = processor_ms();
    const unsigned long long before = heap_allocations();
    early ? early_update(&run) : late_update(&run);
    s.ms += processor_ms() - begin, s.heap += heap_allocations() - before, s.peak_kb = peak_kilobytes();
  }
  for (const Stretch& s : stretches)
    std::printf("updates %s: mean %.4f ms, %.2f allocations, peak of the process %ld kB\n", s.name, s.ms / 1000, static_cast<double>(s.heap) / 1000,
                s.peak_kb);
  const auto& c = run.counts();
  std::printf("fronts factored an update %.2f   damped steps %d   refused %d\n", c.fronts_factored / static_cast<double>(kFrames), c.damped_steps, c.refused);
  return c.refused == 0 ? 0 : 1;
}
