// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How cost grows: a fixed-lag update with the window (2 .. 20 s) and with the tracks of a frame (20 .. 200), one LAMBDA call with the
/// ambiguities (6 .. 80). Prints tables and the exponent of each curve, and draws the curves:
///
///     cost_growth [FOLDER]      writes growth_window.svg, growth_tracks.svg and growth_ambiguities.svg there
///
/// Updates: peers/fixed_lag/data_clean of the shared data through tests/vision/fixed_lag_workload.hpp, one Gauss-Newton step, median
/// processor time over frames 210 .. 309: the same for all, and the longest window is full by then. Each run is repeated, the repetitions
/// of one apart from each other, and the least median counts: machines are shared. LAMBDA: generated double-difference problems, beside
/// Eigen's LDLT of the same matrices; fastest of some turns, median over the problems.
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <searvins/ambiguity/lambda.hpp>

#include "bench/processor_time.hpp"
#include "bench/svg_plot.hpp"
#include "support/ambiguity_problems.hpp"
#include "support/shared_data.hpp"
#include "vision/fixed_lag_workload.hpp"

namespace {

using namespace searvins::test;
using searvins::bench::processor_ms;

constexpr std::size_t kWarmUpFrames = 210, kTimedFrames = 100;
constexpr int kPasses = 3;
constexpr double kStatesPerSecond = 10;

/// The workload's types with room for 20 s, or for 220 tracks a frame over 6 s. Tracks are no longer than there, so neither are fronts.
struct GrowthProblem : FixedLagProblem {
  using Variables = searvins::smoother::Types<searvins::smoother::Capacity<State, 202>,
                                              searvins::smoother::Capacity<searvins::vision::Landmark, 2560>>;
  using Factors = searvins::smoother::Types<
      searvins::smoother::Capacity<searvins::imu::NavigationPriorFactor, 1>, searvins::smoother::Capacity<ImuFactor, 201>,
      searvins::smoother::Capacity<StereoFactor, 16384>, searvins::smoother::Capacity<searvins::vision::LandmarkPriorFactor, 2560>,
      searvins::smoother::Capacity<searvins::imu::PositionFactor, 24>>;
  static constexpr int member_capacity = 202 * 26;
  static constexpr std::size_t arena_scalars = std::size_t{202} * (391 * 15 + 376 * 376 + 375);
};
using GrowthRun = BasicFixedLagRun<GrowthProblem>;

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Least-squares slope of ln y over ln x: the exponent p of y ~ x^p.
double exponent(const Curve& curve) {
  const auto n = static_cast<double>(curve.x.size());
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const double x = std::log(curve.x[i]), y = std::log(curve.y[i]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// States that stay after an update: both ends of the window count.
std::size_t states_of(double window_s) { return static_cast<std::size_t>(std::lround(window_s * kStatesPerSecond)) + 1; }

double mean_tracks(const FixedLagWorkload& workload) {
  double sum = 0;
  for (std::size_t k = kWarmUpFrames; k < kWarmUpFrames + kTimedFrames; ++k) sum += static_cast<double>(workload.frames[k].size());
  return sum / kTimedFrames;
}

/// Copies of a track, the track itself included, so that on average `factor` of them are seen. The golden ratio spreads the remainder evenly
/// over the ids, and with them over the drive.
int copies_of(int landmark, double factor) {
  const double spread = std::fmod(landmark * 0.6180339887498949, 1.0);
  return static_cast<int>(factor) + (spread < factor - std::floor(factor) ? 1 : 0);
}

/// The drive with about `tracks` a frame: some ids left out, or copies of the tracks under fresh ids, each with its own 0.7 px of noise on
/// top of what it copies.
FixedLagWorkload with_tracks(const FixedLagWorkload& original, double tracks) {
  constexpr int kIdsOfACopy = 1'000'000;
  const double factor = tracks / mean_tracks(original);
  FixedLagWorkload changed = original;
  std::mt19937_64 rng{20261123};
  std::normal_distribution<double> noise_px{0, original.pixel_sigma_px};
  for (auto& frame : changed.frames) {
    const auto seen = std::exchange(frame, {});
    for (const auto& sighting : seen)
      for (int copy = 0; copy < copies_of(sighting.landmark, factor); ++copy) {
        frame.push_back({sighting.landmark + copy * kIdsOfACopy, sighting.pixel});
        if (copy > 0)
          for (double& value : frame.back().pixel) value += noise_px(rng);
      }
  }
  return changed;
}

/// Median processor time of an update; nothing when the run did not go as it should.
std::optional<double> update_ms(const FixedLagWorkload& workload, std::size_t window) {
  GrowthRun run(workload, GrowthRun::options_of(1), window);
  while (run.frame() < kWarmUpFrames) run.update();
  std::vector<double> ms;
  while (ms.size() < kTimedFrames) {
    const double begin = processor_ms();
    run.update();
    ms.push_back(processor_ms() - begin);
  }
  if (run.counts().refused == 0) return median(ms);
  std::fprintf(stderr, "%d operations were refused at a window of %zu states\n", run.counts().refused, window);
  return std::nullopt;
}

/// One point of a curve: its window, and its tracks by the drive it runs.
struct Setting {
  double x;
  std::size_t states;
  FixedLagWorkload workload;
};

/// The least median of each setting over the passes; false when a run did not go as it should.
bool measure(const std::vector<Setting>& settings, Curve& curve) {
  for (const Setting& setting : settings) curve.x.push_back(setting.x), curve.y.push_back(1e300);
  for (int pass = 0; pass < kPasses; ++pass)
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const auto ms = update_ms(settings[i].workload, settings[i].states);
      if (!ms) return false;
      curve.y[i] = std::min(curve.y[i], *ms);
    }
  return true;
}

void print(const std::vector<Setting>& settings, const Curve& curve) {
  std::printf("| window, s | states | tracks a frame | update, ms |\n|---|---|---|---|\n");
  for (std::size_t i = 0; i < settings.size(); ++i)
    std::printf("| %.0f | %zu | %.0f | %.2f |\n", static_cast<double>(settings[i].states - 1) / kStatesPerSecond, settings[i].states,
                mean_tracks(settings[i].workload), curve.y[i]);
  std::printf("\nexponent %.2f\n\n", exponent(curve));
  std::fflush(stdout);
}

std::vector<Setting> windows(const FixedLagWorkload& workload) {
  std::vector<Setting> settings;
  for (const double window_s : {2.0, 4.0, 6.0, 10.0, 14.0, 20.0}) settings.push_back({window_s, states_of(window_s), workload});
  return settings;
}

std::vector<Setting> densities(const FixedLagWorkload& workload) {
  std::vector<Setting> settings;
  for (const double tracks : {20.0, 40.0, 60.0, 100.0, 140.0, 200.0}) {
    settings.push_back({tracks, GrowthRun::kWindow, with_tracks(workload, tracks)});
    settings.back().x = mean_tracks(settings.back().workload);
  }
  return settings;
}

/// Microseconds per call of `calls` calls.
template <class Call>
double microseconds(int calls, Call call) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < calls; ++i) call();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count() / calls;
}

/// LAMBDA with room for the largest problem, and what keeps the compiler from dropping calls whose result nobody reads.
struct LambdaBench {
  searvins::ambiguity::Lambda<double, 80> lambda;
  searvins::ambiguity::Lambda<double, 80>::SearchOutcome outcome;
  volatile double sink{0};

  void solve(const AmbiguityProblem& p) {
    const bool ok = lambda.decompose(p.Q.data(), p.Q.columns, p.Q.rows).ok() && lambda.search(p.a_hat.data(), 2, outcome).ok();
    sink = ok ? 1 : 0;
  }
  void factorise(const Eigen::MatrixXd& Q) { sink = Eigen::LDLT<Eigen::MatrixXd>(Q).vectorD()[0]; }
};

/// Times of a problem, us: LAMBDA and LDLT in turns, the fastest of each.
std::pair<double, double> call_us(LambdaBench& bench, const AmbiguityProblem& p) {
  const Eigen::MatrixXd Q = Eigen::Map<const Eigen::MatrixXd>(p.Q.data(), p.Q.rows, p.Q.rows);
  const int calls = std::max(3, 4000 / (p.Q.rows * p.Q.rows));
  double lambda_us = 1e300, ldlt_us = 1e300;
  for (int turn = 0; turn < 7; ++turn) {
    lambda_us = std::min(lambda_us, microseconds(calls, [&] { bench.solve(p); }));
    ldlt_us = std::min(ldlt_us, microseconds(calls, [&] { bench.factorise(Q); }));
  }
  return {lambda_us, ldlt_us};
}

void measure_ambiguities(Curve& lambda, Curve& ldlt) {
  constexpr int kProblems = 100;  // half of one epoch, half of ten
  const auto bench = std::make_unique<LambdaBench>();
  std::mt19937_64 rng{20260101};
  std::printf("| ambiguities | LAMBDA, microseconds | LDLT, microseconds | ratio |\n|---|---|---|---|\n");
  for (const int n : {6, 10, 14, 20, 30, 40, 50, 60, 70, 80}) {
    std::vector<double> lambda_us, ldlt_us, ratio;
    for (int i = 0; i < kProblems; ++i) {
      const auto [ours, eigens] = call_us(*bench, double_difference_problem(rng, n, i < kProblems / 2 ? 1 : 10));
      lambda_us.push_back(ours), ldlt_us.push_back(eigens), ratio.push_back(ours / eigens);
    }
    lambda.x.push_back(n), lambda.y.push_back(median(lambda_us));
    ldlt.x.push_back(n), ldlt.y.push_back(median(ldlt_us));
    std::printf("| %d | %.2f | %.2f | %.1f |\n", n, lambda.y.back(), ldlt.y.back(), median(ratio));
  }
  std::printf("\nexponents: LAMBDA %.2f, LDLT %.2f\n", exponent(lambda), exponent(ldlt));
}

std::optional<FixedLagWorkload> read_workload() {
  const auto shared = shared_data();
  auto workload = shared ? read_fixed_lag_workload(*shared / "peers/fixed_lag/data_clean") : std::nullopt;
  if (workload && workload->frames.size() < kWarmUpFrames + kTimedFrames) return std::nullopt;
  return workload;
}

bool draw(const std::string& folder, const std::string& name, const Plot& plot) {
  if (folder.empty() || write_svg(folder + "/" + name, plot)) return true;
  std::fprintf(stderr, "cannot write %s/%s\n", folder.c_str(), name.c_str());
  return false;
}

/// Fills the curve of a plot from its settings, prints and draws it.
bool grow(const std::vector<Setting>& settings, Plot plot, const std::string& folder, const std::string& name) {
  if (!measure(settings, plot.curves[0])) return false;
  print(settings, plot.curves[0]);
  return draw(folder, name, plot);
}

bool updates(const std::string& folder) {
  const auto workload = read_workload();
  if (!workload) {
    std::fprintf(stderr, "SKIPPED: the fixed-lag workload; peers/fixed_lag/data_clean of the shared data is not there\n");
    return true;
  }
  const Plot by_window{"Update as the window grows", "window, s", "processor time, ms", Scale::linear, {{"60 tracks a frame", {}, {}}}};
  const Plot by_tracks{"Update as the tracks grow", "tracks a frame", "processor time, ms", Scale::linear, {{"window of 6 s", {}, {}}}};
  return grow(windows(*workload), by_window, folder, "growth_window.svg") && grow(densities(*workload), by_tracks, folder, "growth_tracks.svg");
}

bool ambiguities(const std::string& folder) {
  Curve lambda{"LAMBDA: decompose, and search of two", {}, {}}, ldlt{"Eigen LDLT of the same matrix", {}, {}};
  measure_ambiguities(lambda, ldlt);
  return draw(folder, "growth_ambiguities.svg",
              {"LAMBDA as the ambiguities grow", "ambiguities", "time of a call, microseconds", Scale::logarithmic, {lambda, ldlt}});
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : "";
  const bool done = updates(folder);
  return ambiguities(folder) && done ? 0 : 1;
}
