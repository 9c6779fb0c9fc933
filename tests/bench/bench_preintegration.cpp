// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Preintegration: nanoseconds per sample, with covariance and bias Jacobians, and what surrounds it: the bare kernel, the online class
/// (which keeps its samples), a motion read off at every sample (output at IMU rate), and the factor's linearisation.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegration.hpp>

namespace {

using searvins::imu::ImuBias;
using searvins::imu::ImuSample;

constexpr int kSamples = 200;

searvins::GpsTime time_of(double t) { return searvins::GpsTime{1'300'000'000'000'000'000}.plus_seconds(t); }

/// One second of a swinging unit, and one sample more.
const std::vector<ImuSample>& samples() {
  static const std::vector<ImuSample> list = [] {
    std::vector<ImuSample> made;
    for (int k = 0; k <= kSamples; ++k) {
      const double t = static_cast<double>(k) / kSamples;
      made.push_back(
          {time_of(t), {0.3 * std::sin(5 * t), 0.2 * std::cos(3 * t), 0.5 * std::sin(2 * t + 1)}, {std::sin(4 * t), 2 * std::cos(t), 9.8}});
    }
    return made;
  }();
  return list;
}

searvins::imu::RotatingEarth earth() {
  return {searvins::geodesy::LocalFrame::at(searvins::geodesy::ecef_from_geodetic({0.53, -1.7, 150}))};
}

/// "per sample": seconds over the samples of one iteration.
void count(benchmark::State& state, int per_iteration) {
  state.counters["per_sample"] =
      benchmark::Counter(static_cast<double>(per_iteration), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

template <class S>
void BM_Kernel(benchmark::State& state) {
  std::vector<Eigen::Matrix<S, 3, 1>> gyro, accel;
  for (const ImuSample& s : samples()) gyro.push_back(s.gyro_b_radps.cast<S>()), accel.push_back(s.accel_b_mps2.cast<S>());
  for (auto _ : state) {
    searvins::imu::MotionAccumulator<S> motion;
    for (int k = 0; k < kSamples; ++k)
      motion.advance(S(0.005), gyro[static_cast<std::size_t>(k)], accel[static_cast<std::size_t>(k)], S(1e-6), S(1e-8));
    benchmark::DoNotOptimize(motion);
  }
  count(state, kSamples);
}

template <class S>
void BM_Range(benchmark::State& state) {
  for (auto _ : state) {
    auto motion = searvins::imu::preintegrate<S>(samples(), time_of(0), time_of(1), ImuBias<S>{});
    benchmark::DoNotOptimize(motion);
  }
  count(state, kSamples);
}

template <class S>
void BM_Online(benchmark::State& state) {
  static searvins::imu::Preintegration<S, 256> motion;
  for (auto _ : state) {
    bool ok = motion.start(time_of(0), ImuBias<S>{}).ok();
    for (const ImuSample& s : samples()) ok = motion.push(s).ok() && ok;
    auto result = motion.until(time_of(1));
    benchmark::DoNotOptimize(ok);
    benchmark::DoNotOptimize(result);
  }
  count(state, kSamples);
}

/// A predicted state at every sample.
void BM_PredictEverySample(benchmark::State& state) {
  static searvins::imu::Preintegration<double, 256> motion;
  const searvins::imu::NavigationState begin;
  for (auto _ : state) {
    bool ok = motion.start(time_of(0), ImuBias<double>{}).ok();
    for (const ImuSample& s : samples()) {
      ok = motion.push(s).ok() && ok;
      if (const auto result = motion.until(s.time)) {
        auto x = searvins::imu::predict(begin, *result, earth());
        benchmark::DoNotOptimize(x);
      }
    }
    benchmark::DoNotOptimize(ok);
  }
  count(state, kSamples);
}

void BM_FactorLinearise(benchmark::State& state) {
  using searvins::imu::NavigationState;
  const auto motion = searvins::imu::preintegrate<double>(samples(), time_of(0), time_of(1), ImuBias<double>{});
  const NavigationState begin, states[] = {begin, searvins::imu::predict(begin, *motion, earth())};
  const auto values = [&](const searvins::smoother::Key<NavigationState>& key) -> const NavigationState& { return states[key.slot]; };
  const auto factor = searvins::imu::ImuFactor<>::make({0, 1}, {1, 1}, *motion, {}, earth(), states[0].p_wb_m);
  double e[15];
  double J[15 * 30] = {};
  for (auto _ : state) {
    factor->linearise(values, e, {J, 15});
    benchmark::DoNotOptimize(J);
    benchmark::DoNotOptimize(e);
  }
}

BENCHMARK(BM_Kernel<double>);
BENCHMARK(BM_Kernel<float>);
BENCHMARK(BM_Range<double>);
BENCHMARK(BM_Range<float>);
BENCHMARK(BM_Online<double>);
BENCHMARK(BM_Online<float>);
BENCHMARK(BM_PredictEverySample);
BENCHMARK(BM_FactorLinearise);

}  // namespace

BENCHMARK_MAIN();
