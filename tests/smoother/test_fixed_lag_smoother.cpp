// SPDX-License-Identifier: BSD-3-Clause
// The heart's contract: a sliding window with marginalisation is the batch solution, its covariance the dense inverse, and a failure changes nothing.
#include "linear_problem.hpp"

#include <memory>

using namespace searvins;
using namespace searvins::test;
using smoother::Key;

namespace {

/// Grows a random but well-posed window: each epoch a state tied to the one before, chains that live some epochs, locals seen by several states.
struct RandomDrive {
  std::unique_ptr<LinearSmoother> smoother = std::make_unique<LinearSmoother>();
  DenseBatch batch;
  std::vector<Key<TestState>> states;
  std::vector<Key<TestChain>> chains;
  std::vector<Key<TestLocal>> locals;
  std::int64_t epoch{0};
  double share_of_pose_factors{0};  ///< of the factors of local variables: those that touch one axis of their state

  template <class F>
  void add_factor(Rng& rng, F f) {
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 9; ++c) f.A(r, c) = normal(rng);
      f.b[r] = normal(rng, 3.0);
    }
    f.clear_untouched_columns();
    REQUIRE(smoother->add_factor(f).ok());
    batch.add(f);
  }
  template <class V>
  Key<V> add_variable() {
    const auto key = smoother->add_variable(V{}, GpsTime{epoch});
    REQUIRE(key.ok());
    batch.add(*key);
    return *key;
  }
  void step(Rng& rng) {
    ++epoch;
    states.push_back(add_variable<TestState>());
    const auto now = states.back();
    for (int i = 0; i < (states.size() == 1 ? 2 : 1); ++i) {  // anchors the first state, ties the others
      LinearFactor f;
      if (states.size() > 1) (void)f.states.push_back(states[states.size() - 2]);
      (void)f.states.push_back(now);
      add_factor(rng, f);
    }
    LinearFactor unary;
    (void)unary.states.push_back(now);
    add_factor(rng, unary);
    if (chance(rng, 0.6)) chains.push_back(add_variable<TestChain>());
    for (const auto& c : chains) {
      LinearFactor f;
      (void)f.states.push_back(now);
      (void)f.chains.push_back(c);
      add_factor(rng, f);
    }
    if (chains.size() > 1 && chance(rng, 0.5)) {
      LinearFactor walk;
      (void)walk.chains.push_back(chains[0]);
      (void)walk.chains.push_back(chains[1]);
      add_factor(rng, walk);
    }
    if (chains.size() > 3 || (!chains.empty() && chance(rng, 0.3))) chains.erase(chains.begin());
    if (chance(rng, 0.7)) {
      locals.push_back(add_variable<TestLocal>());
      LinearFactor f;
      (void)f.locals.push_back(locals.back());
      add_factor(rng, f);
    }
    for (const auto& l : locals) chance(rng, share_of_pose_factors) ? see<PoseFactor>(rng, l) : see<LinearFactor>(rng, l);
    if (locals.size() > 3 || (!locals.empty() && chance(rng, 0.3))) locals.erase(locals.begin());
  }
  /// A local variable seen from the newest state.
  template <class F>
  void see(Rng& rng, const Key<TestLocal>& local) {
    F f;
    (void)f.states.push_back(states.back());
    if (!chains.empty() && chance(rng, 0.3)) (void)f.chains.push_back(chains.back());
    (void)f.locals.push_back(local);
    add_factor(rng, f);
  }
  void marginalise() {
    const auto report = smoother->marginalise_oldest();
    REQUIRE(report.status.ok());
    std::erase_if(locals, [&](const auto& l) { return smoother->find(l) == nullptr; });
    std::erase_if(chains, [&](const auto& c) { return smoother->find(c) == nullptr; });
  }
};

}  // namespace

TEST_CASE("a linear drive through the sliding window equals the dense batch solution, value and covariance, to 1e-9") {
  for_all_seeds(60, [](Rng& rng) {
    RandomDrive drive;
    drive.share_of_pose_factors = std::array{0.0, 0.5, 1.0}[static_cast<std::size_t>(integer(rng, 0, 2))];
    for (int k = 0; k < 14; ++k) {
      drive.step(rng);
      const auto report = drive.smoother->optimise();
      REQUIRE(report.status.ok());
      if (k >= 5) drive.marginalise();
    }
    REQUIRE(drive.smoother->optimise().status.ok());
    const Eigen::MatrixXd P = drive.batch.information().ldlt().solve(Eigen::MatrixXd::Identity(drive.batch.columns, drive.batch.columns));
    const Eigen::VectorXd x = P * drive.batch.gradient();
    int alive = 0;
    std::vector<smoother::AnyKey> keys;
    std::vector<int> columns;
    const auto check = [&](const auto& key) {
      const auto* value = drive.smoother->find(key);
      if (!value) return;
      ++alive;
      const int c = drive.batch.first.at(DenseBatch::id(key));
      keys.push_back(LinearSmoother::WindowType::any(key));
      for (int i = 0; i < value->value.size(); ++i) {
        CHECK(value->value[i] == doctest::Approx(x[c + i]).epsilon(1e-9));
        columns.push_back(c + i);
      }
    };
    for (const auto& k : drive.states) check(k);
    for (const auto& k : drive.chains) check(k);
    for (const auto& k : drive.locals) check(k);
    CHECK(alive >= 5);
    const int n = static_cast<int>(columns.size());
    Eigen::MatrixXd joint(n, n), expected(n, n);
    const auto size = drive.smoother->joint_covariance(keys.data(), static_cast<int>(keys.size()), joint.data(), n);
    REQUIRE(size.ok());
    CHECK(*size == n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) expected(i, j) = P(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
    CHECK((joint - expected).norm() <= 1e-9 * (1 + expected.norm()));
  });
}
