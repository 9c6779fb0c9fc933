// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Two steps of the GNSS side. robust/*: whitening residuals, whitening their Jacobian (three columns of position) and weighing one batch
/// of 8, 16 or 30 candidates that share a pivot, by each robust formulation, DCS loss. robust/dense: the same whitening without the closed
/// form, for comparison: Eigen's LLT of the batch's covariance, and no weights. double_differences: one epoch of rover and base under a
/// simulated sky, from pushing the base epoch to the groups with their pivots, continuity tests included.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include <searvins/gnss/double_difference.hpp>
#include <searvins/robust/formulation.hpp>

// The simulated sky brings the tests' harness along, of which nothing is used here.
#define DOCTEST_CONFIG_DISABLE
#include "gnss/simulated_sky.hpp"

namespace {

using namespace searvins;
using test::Rng;
using Loss = robust::Dcs<double>;

constexpr int kMost = 30, kColumns = 3;

using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, kColumns, 0, kMost + 1, kColumns>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost + 1, 1>;

/// Codes of m candidates and their pivot, sigmas of 0.3 .. 1.5 m, one error of 30 m.
struct CodeBatch {
  robust::SharedPivot<double, kMost> covariance;
  Vector residual_m;
  Jacobian d_residual;
};

CodeBatch code_batch(int m) {
  Rng rng{20261123};
  const auto variance_m2 = [&] { return std::pow(test::uniform(rng, 0.3, 1.5), 2); };
  CodeBatch batch{{}, Vector(m), Jacobian(m, kColumns)};
  Vector d(m);
  const double pivot_m2 = variance_m2(), pivot_error_m = test::normal(rng, std::sqrt(pivot_m2));
  for (int i = 0; i < m; ++i) {
    d[i] = variance_m2();
    batch.residual_m[i] = test::normal(rng, std::sqrt(d[i])) - pivot_error_m;
    batch.d_residual.row(i) = (test::random_vector<3>(rng).normalized() - Eigen::Vector3d::UnitZ()).transpose();
  }
  batch.residual_m[m / 2] += 30;
  batch.covariance = robust::SharedPivot<double, kMost>::from(d.data(), m, pivot_m2).value();
  return batch;
}

template <class Form>
void BM_Robust(benchmark::State& state) {
  const CodeBatch batch = code_batch(static_cast<int>(state.range(0)));
  Form form{};
  double n_m = 0;  // the latent variable: part of the estimate, so its start is no part of a linearisation
  if constexpr (Form::has_latent) n_m = form.robust_initial_latent(batch.covariance, batch.residual_m.data());
  const int rows = batch.covariance.size() + Form::extra_rows;
  Vector e(rows), de_dn(rows), weights(rows);
  Jacobian J(rows, kColumns);
  for (auto _ : state) {
    form.whiten(batch.covariance, batch.residual_m.data(), n_m, e.data());
    form.whiten_jacobian(batch.covariance, batch.d_residual, J, de_dn.data());
    double cost = form.weigh(e.data(), rows, weights.data());
    benchmark::DoNotOptimize(cost);
    benchmark::DoNotOptimize(J.data());
    benchmark::ClobberMemory();
  }
}

/// What the closed form saves: forming, factorising and applying the covariance as a dense matrix, without allocations either.
void BM_DenseWhitening(benchmark::State& state) {
  using Dense = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  const int m = static_cast<int>(state.range(0));
  const CodeBatch batch = code_batch(m);
  Vector e(m);
  Jacobian J(m, kColumns);
  for (auto _ : state) {
    Dense sigma = Dense::Constant(m, m, batch.covariance.pivot_variance());
    for (int i = 0; i < m; ++i) sigma(i, i) += batch.covariance.candidate_variance(i);
    const Eigen::LLT<Dense> factor(sigma);
    e = batch.residual_m, J = batch.d_residual;
    factor.matrixL().solveInPlace(e);
    factor.matrixL().solveInPlace(J);
    benchmark::DoNotOptimize(e.data());
    benchmark::DoNotOptimize(J.data());
    benchmark::ClobberMemory();
  }
}

/// A minute of 1 Hz epochs of rover and base, and where the rover is predicted.
struct Minute {
  test::SimulatedPair pair;
  std::vector<gnss::ObservationEpoch> rover, base;

  [[nodiscard]] Eigen::Vector3d predicted_e_m(std::size_t k) const {
    return pair.rover.p0_e_m + static_cast<double>(k) * pair.rover.v_e_mps + Eigen::Vector3d{3, -2, 1};
  }
};

Minute simulated_minute(std::array<int, 3> satellites) {
  Rng rng{7};
  Minute minute{test::random_pair(rng, satellites), {}, {}};
  for (int k = 0; k < 60; ++k) {
    minute.rover.push_back(test::simulate(minute.pair.sky, minute.pair.rover, k));
    minute.base.push_back(test::simulate(minute.pair.sky, minute.pair.base, k));
  }
  return minute;
}

/// The differencer and all that it needs; on the heap, as it is large.
struct Receiver {
  gnss::Differencer differencer{};
  gnss::BaseBuffer<> base{};
  gnss::DifferencedEpoch out{};
};

/// One epoch an iteration; from the first one again, with an empty memory, when the minute is over.
void BM_DoubleDifferences(benchmark::State& state) {
  const int of_a_system = static_cast<int>(state.range(0));
  const Minute minute = simulated_minute({of_a_system, of_a_system, of_a_system});
  gnss::DifferencingOptions options;
  options.troposphere = false;  // the simulated sky has none
  std::unique_ptr<Receiver> receiver;
  std::size_t k = minute.rover.size();
  bool ok = true;
  double differences = 0;
  for (auto _ : state) {
    if (k == minute.rover.size()) {
      state.PauseTiming();
      receiver = std::make_unique<Receiver>(), k = 0;
      ok = receiver->base.set_position(minute.pair.base.p0_e_m).ok() && ok;
      state.ResumeTiming();
    }
    ok = receiver->base.push(minute.base[k]).ok() && ok;
    const auto& store = minute.pair.sky.store;
    ok = receiver->differencer.difference(minute.rover[k], receiver->base, store, minute.predicted_e_m(k), options, receiver->out).ok() && ok;
    benchmark::DoNotOptimize(receiver->out.groups.size());
    for (const gnss::SignalGroup& group : receiver->out.groups) differences += static_cast<double>(group.candidates.size());
    ++k;
  }
  if (!ok || differences == 0) return state.SkipWithError("an epoch was refused");
  state.counters["differences"] = differences / static_cast<double>(state.iterations());
}

void batch_sizes(benchmark::internal::Benchmark* b) { b->ArgName("n")->Arg(8)->Arg(16)->Arg(kMost); }

BENCHMARK(BM_Robust<robust::Batch<Loss>>)->Name("robust/batch")->Apply(batch_sizes);
BENCHMARK(BM_Robust<robust::ScalarRows<Loss>>)->Name("robust/scalar")->Apply(batch_sizes);
BENCHMARK(BM_Robust<robust::LatentPivot<Loss>>)->Name("robust/latent")->Apply(batch_sizes);
BENCHMARK(BM_Robust<robust::LatentPivotSymmetric<Loss>>)->Name("robust/symmetric")->Apply(batch_sizes);
BENCHMARK(BM_DenseWhitening)->Name("robust/dense")->Apply(batch_sizes);
BENCHMARK(BM_DoubleDifferences)->Name("double_differences")->ArgName("satellites_a_system")->Arg(5)->Arg(10)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
