// SPDX-License-Identifier: BSD-3-Clause
// The prior after marginalisation is the dense Schur complement; equivalent ways of stating a problem give one answer.
#include <algorithm>
#include <memory>

#include <searvins/smoother/marginal_prior.hpp>

#include "linear_problem.hpp"

using namespace searvins;
using namespace searvins::test;
using smoother::Key;

namespace {

struct Stated {
  std::unique_ptr<LinearSmoother> smoother = std::make_unique<LinearSmoother>();
  Key<TestState> a{}, b{};
  Key<TestChain> c{};
  Key<TestLocal> l{};
  std::vector<LinearFactor> factors;
  explicit Stated(Rng& rng) {
    a = *smoother->add_variable(TestState{}, GpsTime{1});
    b = *smoother->add_variable(TestState{}, GpsTime{2});
    c = *smoother->add_variable(TestChain{}, GpsTime{1});
    l = *smoother->add_variable(TestLocal{}, GpsTime{1});
    for (int i = 0; i < 16; ++i) {
      LinearFactor f;
      if (i % 2 == 0) (void)f.states.push_back(a);
      if (i % 4 > 0) (void)f.states.push_back(b);
      if (i % 3 == 0) (void)f.chains.push_back(c);
      if (i % 4 == 2) (void)f.locals.push_back(l);
      for (int r = 0; r < 2; ++r) {
        for (int k = 0; k < 9; ++k) f.A(r, k) = normal(rng);
        f.b[r] = normal(rng, 3.0);
      }
      factors.push_back(f);
    }
  }
  void load() {
    for (const auto& f : factors) REQUIRE(smoother->add_factor(f).ok());
  }
  Eigen::Matrix<double, 9, 1> solve() {
    const auto report = smoother->optimise();
    REQUIRE(report.status.ok());
    Eigen::Matrix<double, 9, 1> x;
    x << smoother->find(a)->value, smoother->find(b)->value, smoother->find(c)->value, smoother->find(l)->value;
    return x;
  }
};

}  // namespace

TEST_CASE("the prior left by the oldest state is the dense Schur complement of its factors, information and gradient") {
  for_all_seeds(50, [](Rng& rng) {
    Stated p(rng);
    p.load();
    (void)p.solve();
    DenseBatch leaving;  // factors that touch a, or l, which a sees first: the others stay in the window
    leaving.add(p.a), leaving.add(p.l), leaving.add(p.b), leaving.add(p.c);
    for (const auto& f : p.factors) {
      const bool touches_a = std::find(f.states.begin(), f.states.end(), p.a) != f.states.end();
      if (touches_a || !f.locals.empty()) leaving.add(f);
    }
    REQUIRE(p.smoother->marginalise_oldest().status.ok());
    const Eigen::MatrixXd H = leaving.information();
    const Eigen::VectorXd g = leaving.gradient();
    const Eigen::MatrixXd gain = H.bottomLeftCorner(4, 5) * H.topLeftCorner(5, 5).inverse();
    const Eigen::MatrixXd S = H.bottomRightCorner(4, 4) - gain * H.topRightCorner(5, 4);
    const auto& prior = p.smoother->prior();
    REQUIRE(prior.dimension == 4);
    Eigen::Vector4d x0, s;
    x0 << p.smoother->find(p.b)->value, p.smoother->find(p.c)->value;
    auto& window = p.smoother->window();
    x0 << (*window.record(p.b))[smoother::Which::prior].value, (*window.record(p.c))[smoother::Which::prior].value;
    s = S * x0 - (g.tail(4) - gain * g.head(5));  // gradient at the expansion point
    const int rb = window.info(window.id_of(p.b)).prior, rc = window.info(window.id_of(p.c)).prior;
    const int row[] = {rb, rb + 1, rb + 2, rc};
    for (int i = 0; i < 4; ++i) {
      CHECK(prior.g[static_cast<std::size_t>(row[i])] == doctest::Approx(s[i]).epsilon(1e-9).scale(1 + s.norm()));
      for (int j = 0; j < 4; ++j)
        CHECK(std::abs(prior.h(std::max(row[i], row[j]), std::min(row[i], row[j])) - S(i, j)) <= 1e-9 * (1 + S.norm()));
    }
  });
}

TEST_CASE("another order of adding, or a factor split into two of doubled covariance, changes nothing") {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    CAPTURE(seed);
    Rng r1{seed}, r2{seed}, r3{seed}, shuffle{seed + 77};
    Stated plain(r1), shuffled(r2), split(r3);
    std::shuffle(shuffled.factors.begin(), shuffled.factors.end(), shuffle);
    LinearFactor half = split.factors[3];
    half.A /= std::sqrt(2.0), half.b /= std::sqrt(2.0);
    split.factors[3] = half;
    split.factors.push_back(half);
    plain.load(), shuffled.load(), split.load();
    const auto x = plain.solve();
    CHECK(close(shuffled.solve(), x, 1e-9));
    CHECK(close(split.solve(), x, 1e-9));
  }
}

TEST_CASE("P14: the joint covariance of a local, a state and a chain variable, in any order, is the block of the dense inverse") {
  for_all_seeds(30, [](Rng& rng) {
    Stated p(rng);
    p.load();
    (void)p.solve();
    DenseBatch batch;
    batch.add(p.l), batch.add(p.b), batch.add(p.c), batch.add(p.a);
    for (const auto& f : p.factors) batch.add(f);
    const Eigen::MatrixXd P = batch.information().inverse();
    using W = LinearSmoother::WindowType;
    const smoother::AnyKey keys[] = {W::any(p.l), W::any(p.b), W::any(p.c)};
    Eigen::Matrix<double, 6, 6> joint;
    const auto size = p.smoother->joint_covariance(keys, 3, joint.data(), 6);
    REQUIRE(size.ok());
    CHECK(*size == 6);
    CHECK(close(joint, P.topLeftCorner(6, 6).eval(), 1e-9));
    CHECK(joint == joint.transpose());
    CHECK(p.smoother->joint_covariance(keys, 3, joint.data(), 5).status().code == StatusCode::invalid_argument);
    const smoother::AnyKey stale{0, 5, 9};
    CHECK(p.smoother->joint_covariance(&stale, 1, joint.data(), 6).status().code == StatusCode::unknown_key);
  });
}
