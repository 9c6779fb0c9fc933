// SPDX-License-Identifier: BSD-3-Clause
// What an under-determined or broken window says, that it changes nothing, and that the next update works.
#include "linear_problem.hpp"

#include <cstring>
#include <limits>
#include <memory>
#include <string>

using namespace searvins;
using namespace searvins::test;
using smoother::Key;

namespace {

/// Two well-determined states, a chain and a local variable; `mask` zeroes the columns of one axis in all factors.
struct Graph {
  std::unique_ptr<LinearSmoother> smoother = std::make_unique<LinearSmoother>();
  Key<TestState> a{}, b{};
  Key<TestChain> chain{};
  Key<TestLocal> local{};
  Rng rng{5};
  int blind{-1}, blind_axis{-1};  ///< 0: a, 1: b, 2: chain, 3: local

  Graph(int blind_variable, int axis) : blind(blind_variable), blind_axis(axis) {
    a = *smoother->add_variable(TestState{}, GpsTime{10});
    b = *smoother->add_variable(TestState{}, GpsTime{20});
    chain = *smoother->add_variable(TestChain{}, GpsTime{30});
    local = *smoother->add_variable(TestLocal{}, GpsTime{40});
    for (int i = 0; i < 4; ++i) {
      add(true, i > 0, false, false);
      add(false, true, true, false);
      add(i > 1, true, false, true);
    }
  }
  LinearFactor make(bool with_a, bool with_b, bool with_chain, bool with_local) {
    LinearFactor f;
    int columns[4] = {-1, -1, -1, -1}, n = 0;
    if (with_a) (void)f.states.push_back(a), columns[0] = n, n += 3;
    if (with_b) (void)f.states.push_back(b), columns[1] = n, n += 3;
    if (with_chain) (void)f.chains.push_back(chain), columns[2] = n, n += 1;
    if (with_local) (void)f.locals.push_back(local), columns[3] = n, n += 2;
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 9; ++c) f.A(r, c) = normal(rng);
      f.b[r] = normal(rng);
    }
    if (blind >= 0 && columns[blind] >= 0) f.A.col(columns[blind] + blind_axis).setZero();
    return f;
  }
  Key<LinearFactor> add(bool with_a, bool with_b, bool with_chain, bool with_local) {
    const auto key = smoother->add_factor(make(with_a, with_b, with_chain, with_local));
    REQUIRE(key.ok());
    return *key;
  }
  Eigen::Matrix<double, 9, 1> values() const {
    Eigen::Matrix<double, 9, 1> x;
    x << smoother->find(a)->value, smoother->find(b)->value, smoother->find(chain)->value, smoother->find(local)->value;
    return x;
  }
};
bool same_bits(const Eigen::Matrix<double, 9, 1>& x, const Eigen::Matrix<double, 9, 1>& y) { return std::memcmp(x.data(), y.data(), sizeof(x)) == 0; }

}  // namespace

TEST_CASE("P5: every under-determined graph names its variable, axis, time and factor types") {
  const int dofs[] = {3, 3, 1, 2};
  const std::int64_t stamps[] = {10, 20, 30, 40};
  const char* names[] = {"state", "state", "chain", "local"};
  for (int v = 0; v < 4; ++v)
    for (int axis = 0; axis < dofs[v]; ++axis) {
      CAPTURE(v);
      CAPTURE(axis);
      Graph g(v, axis);
      const auto before = g.values();
      const auto report = g.smoother->optimise();
      CHECK(report.status.code == StatusCode::under_determined);
      CHECK(std::string(report.where.variable_name) == names[v]);
      CHECK(report.where.axis == axis);
      CHECK(std::string(report.where.axis_name) == std::string(1, "xyz"[axis]));
      CHECK(report.where.stamp == GpsTime{stamps[v]});
      CHECK(report.where.factor_count > 0);
      REQUIRE(report.where.factor_names.size() == 1);
      CHECK(std::string(report.where.factor_names[0]) == "linear");
      CHECK(std::abs(report.where.pivot) < 1e-12);
      CHECK(same_bits(before, g.values()));
      CHECK(g.smoother->covariance(g.a).status().code == StatusCode::under_determined);
    }
}

TEST_CASE("P5: a variable without any factor is named with zero factors") {
  Graph g(-1, -1);
  const auto lone = g.smoother->add_variable(TestState{}, GpsTime{50});
  const auto report = g.smoother->optimise();
  CHECK(report.status.code == StatusCode::under_determined);
  CHECK(report.where.variable == LinearSmoother::WindowType::any(*lone));
  CHECK(report.where.factor_count == 0);
  CHECK(report.where.factor_names.empty());
}

TEST_CASE("P5b: a failed update leaves every estimate bit-identical, and the next one gives what it would have given without the failure") {
  for (const int kind : {0, 1, 2}) {
    CAPTURE(kind);
    Graph hurt(-1, -1), well(-1, -1);
    REQUIRE(hurt.smoother->optimise().status.ok());
    REQUIRE(well.smoother->optimise().status.ok());
    const auto before = hurt.values();
    LinearFactor broken = hurt.make(true, true, false, false);
    if (kind == 0) broken.b[1] = std::numeric_limits<double>::quiet_NaN();
    if (kind == 1) broken.A(0, 4) = std::numeric_limits<double>::infinity();
    if (kind == 2) broken = hurt.make(false, false, false, true), broken.A(0, 0) = std::numeric_limits<double>::quiet_NaN();
    const auto key = hurt.smoother->add_factor(broken);
    REQUIRE(key.ok());
    for (int again = 0; again < 5; ++again) {
      CHECK(hurt.smoother->optimise().status.code == StatusCode::non_finite);
      CHECK(same_bits(before, hurt.values()));
    }
    CHECK(hurt.smoother->remove_factor(*key).ok());
    CHECK(hurt.smoother->optimise().status.ok());
    REQUIRE(well.smoother->optimise().status.ok());
    CHECK(close(hurt.values(), well.values(), 1e-12));
  }
}

TEST_CASE("P22: marginalising never turns a broken factor into a broken prior") {
  Graph g(-1, -1);
  REQUIRE(g.smoother->optimise().status.ok());
  const auto before = g.values();
  LinearFactor broken = g.make(true, true, false, false);
  broken.A(0, 4) = std::numeric_limits<double>::quiet_NaN();  // in the columns of b: the pivots of a stay finite
  const auto key = g.smoother->add_factor(broken);
  CHECK(g.smoother->marginalise_oldest().status.code == StatusCode::non_finite);
  CHECK(same_bits(before, g.values()));
  CHECK(g.smoother->prior().empty());
  REQUIRE(g.smoother->remove_factor(*key).ok());
  CHECK(g.smoother->marginalise_oldest().status.ok());
  CHECK(g.smoother->optimise().status.ok());
}

TEST_CASE("an empty window, or one with variables but no state, answers no_data") {
  auto s = std::make_unique<LinearSmoother>();
  const auto chain = s->add_variable(TestChain{}, GpsTime{1});
  LinearFactor f;
  (void)f.chains.push_back(*chain);
  REQUIRE(s->add_factor(f).ok());
  CHECK(s->optimise().status.code == StatusCode::no_data);
  CHECK(s->marginalise_oldest().status.code == StatusCode::no_data);
  CHECK(s->covariance(*chain).status().code == StatusCode::no_data);
  s->set_enabled<LinearFactor>(false);
  s->set_enabled<LinearFactor>(true);
  s->clear();
  CHECK(s->find(*chain) == nullptr);
}

TEST_CASE("switched off and on again, a factor type counts as if it had never been off") {
  Graph g(-1, -1), reference(-1, -1);
  REQUIRE(g.smoother->optimise().status.ok());
  REQUIRE(reference.smoother->optimise().status.ok());
  const auto expected = reference.values();
  g.smoother->set_enabled<LinearFactor>(false);
  CHECK(g.smoother->optimise().status.code == StatusCode::under_determined);
  REQUIRE(g.smoother->set_value(g.a, TestState{Eigen::Vector3d{50, -20, 7}}).ok());
  CHECK_FALSE(g.smoother->optimise().status.ok());
  g.smoother->set_enabled<LinearFactor>(true);
  CHECK(g.smoother->optimise().status.ok());
  CHECK(close(g.values(), expected, 1e-10));
}

TEST_CASE("a local variable that lost its factors does not keep the window from converging") {
  Graph g(-1, -1);
  REQUIRE(g.smoother->optimise().status.ok());
  const auto idle = *g.smoother->add_variable(TestLocal{}, GpsTime{20});
  REQUIRE(g.smoother->set_value(idle, TestLocal{Eigen::Vector2d{30, 40}}).ok());
  CHECK(g.smoother->optimise().status.ok());
  CHECK(g.smoother->find(idle)->value == Eigen::Vector2d{30, 40});
}
