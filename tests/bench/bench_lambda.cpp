// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Time of one LAMBDA call, decompose() and search() for the two best vectors, beside Eigen's LDLT<MatrixXd> of the same matrices in
/// the same process. Machines drift and are shared: the ratio is what can be compared, the times only explain it.
///
/// Problems: those of the shared data (peers/lambda) where they are, else generated ones of the same kind. Per problem the two are
/// timed in turns, a few calls each, and the fastest turn of either counts; a row of the table is the median over the problems.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <searvins/ambiguity/lambda.hpp>

#include "support/ambiguity_problems.hpp"
#include "support/shared_data.hpp"

namespace {

using Lambda80 = searvins::ambiguity::Lambda<double, 80>;
using searvins::test::AmbiguityProblem;

struct Set {
  std::string name;
  bool shared{false};
  double aim{0};  // ratio to LDLT, one third of RTKLIB's; 0 where none is set
  std::vector<AmbiguityProblem> problems;
};

/// The shared problems of one set; generated ones (100 of one epoch, 100 of ten) where they are missing and the set has one size n.
Set load(const std::string& name, int n, double aim) {
  Set set{name, false, aim, {}};
  if (const auto folder = searvins::test::shared_data()) {
    if (auto problems = searvins::test::read_ambiguity_problems(*folder / "peers/lambda", name)) {
      set.problems = std::move(*problems);
      set.shared = true;
      return set;
    }
  }
  std::mt19937_64 rng{20260101};
  for (int i = 0; i < 200 && n > 0; ++i) set.problems.push_back(searvins::test::double_difference_problem(rng, n, i < 100 ? 1 : 10));
  return set;
}

const std::vector<Set>& sets() {
  static const std::vector<Set> all{load("n6", 6, 3),    load("n12", 12, 6),  load("n20", 20, 9), load("n30", 30, 10),
                                    load("n40", 40, 10), load("n60", 60, 10), load("hard", 0, 0)};
  return all;
}

struct Workspace {
  Lambda80 lambda;
  Lambda80::SearchOutcome outcome;
};

void solve(Workspace& work, const AmbiguityProblem& p) {
  bool ok = work.lambda.decompose(p.Q.data(), p.Q.columns, p.Q.rows).ok();
  ok = ok && work.lambda.search(p.a_hat.data(), 2, work.outcome).ok();
  benchmark::DoNotOptimize(ok);
}

Eigen::MatrixXd as_eigen(const AmbiguityProblem& p) { return Eigen::Map<const Eigen::MatrixXd>(p.Q.data(), p.Q.rows, p.Q.rows); }

void ldlt(const Eigen::MatrixXd& Q) {
  const Eigen::LDLT<Eigen::MatrixXd> factor(Q);
  benchmark::DoNotOptimize(factor.vectorD().data());
}

void BM_Lambda(benchmark::State& state, const Set* set) {
  const auto work = std::make_unique<Workspace>();
  std::size_t i = 0;
  for (auto _ : state) {
    solve(*work, set->problems[i]);
    i = (i + 1) % set->problems.size();
  }
}

void BM_Ldlt(benchmark::State& state, const Set* set) {
  std::vector<Eigen::MatrixXd> matrices;
  for (const AmbiguityProblem& p : set->problems) matrices.push_back(as_eigen(p));
  std::size_t i = 0;
  for (auto _ : state) {
    ldlt(matrices[i]);
    i = (i + 1) % matrices.size();
  }
}

/// Microseconds per call of `calls` calls.
template <class Call>
double microseconds(int calls, Call call) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < calls; ++i) call();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count() / calls;
}

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

void print_row(const Set& set) {
  const auto work = std::make_unique<Workspace>();
  std::vector<double> total, decompose, reference, ratio, nodes;
  for (const AmbiguityProblem& p : set.problems) {
    const Eigen::MatrixXd Q = as_eigen(p);
    const int calls = std::max(3, 4000 / (p.Q.rows * p.Q.rows));
    double best_total = 1e300, best_decompose = 1e300, best_reference = 1e300;
    for (int turn = 0; turn < 7; ++turn) {
      best_total = std::min(best_total, microseconds(calls, [&] { solve(*work, p); }));
      best_reference = std::min(best_reference, microseconds(calls, [&] { ldlt(Q); }));
      best_decompose = std::min(best_decompose, microseconds(calls, [&] {
                                  bool ok = work->lambda.decompose(p.Q.data(), p.Q.columns, p.Q.rows).ok();
                                  benchmark::DoNotOptimize(ok);
                                }));
    }
    total.push_back(best_total);
    decompose.push_back(best_decompose);
    reference.push_back(best_reference);
    ratio.push_back(best_total / best_reference);
    nodes.push_back(static_cast<double>(work->outcome.nodes));
  }
  std::printf("| %-4s | %-9s | %8.2f | %8.2f | %8.2f | %8.2f | %6.0f | %5.1f | ", set.name.c_str(), set.shared ? "shared" : "generated",
              median(total), *std::max_element(total.begin(), total.end()), median(decompose), median(reference), median(nodes),
              median(ratio));
  if (set.aim > 0)
    std::printf("%3.0f |\n", set.aim);
  else
    std::printf("    |\n");
}

}  // namespace

int main(int argc, char** argv) {
  for (const Set& set : sets()) {
    if (set.problems.empty()) continue;
    benchmark::RegisterBenchmark(("lambda/" + set.name).c_str(), BM_Lambda, &set);
    benchmark::RegisterBenchmark(("ldlt/" + set.name).c_str(), BM_Ldlt, &set);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();

  std::printf("\nLAMBDA, two best vectors, microseconds per call; medians over the problems of a set\n\n");
  std::printf("| set  | problems  | lambda   | slowest  | of which | Eigen    | nodes  | ratio | aim |\n");
  std::printf("|      |           |          | problem  | decomp.  | LDLT     |        |       |     |\n");
  std::printf("|------|-----------|----------|----------|----------|----------|--------|-------|-----|\n");
  for (const Set& set : sets())
    if (!set.problems.empty()) print_row(set);
  return 0;
}
