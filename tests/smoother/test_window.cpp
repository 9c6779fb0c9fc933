// SPDX-License-Identifier: BSD-3-Clause
// Keys, capacities and the errors of binding: every misuse is an ordinary outcome that changes nothing.
#include "linear_problem.hpp"

#include <memory>

using namespace searvins;
using namespace searvins::test;
using smoother::Key;

namespace {

LinearFactor on(std::initializer_list<Key<TestState>> states, std::initializer_list<Key<TestChain>> chains = {},
                std::initializer_list<Key<TestLocal>> locals = {}) {
  LinearFactor f;
  for (const auto& k : states) (void)f.states.push_back(k);
  for (const auto& k : chains) (void)f.chains.push_back(k);
  for (const auto& k : locals) (void)f.locals.push_back(k);
  return f;
}

/// Names two local variables.
struct TwoLocals {
  using Scalar = double;
  static constexpr int max_rows = 2, max_keys = 2, max_columns = 4;
  static constexpr const char* name = "two locals";
  Key<TestLocal> a{}, b{};
  int row_count{2};
  int rows() const { return row_count; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(a), visit(b);
  }
  template <class Values>
  void evaluate(const Values&, double* e) const {
    e[0] = e[1] = 0;
  }
  template <class Values>
  void linearise(const Values&, double* e, smoother::JacobianRef<double>) const {
    e[0] = e[1] = 0;
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 2, w); }
};
struct SmallProblem {
  using Scalar = double;
  using Variables = smoother::Types<smoother::Capacity<TestState, 2>, smoother::Capacity<TestLocal, 3>>;
  using Factors = smoother::Types<smoother::Capacity<TwoLocals, 1>>;
};

}  // namespace

static_assert(smoother::Variable<TestState> && smoother::Factor<LinearFactor> && smoother::Factor<TwoLocals>);
static_assert(!smoother::Variable<int> && !smoother::Factor<TestState>);
static_assert(LinearProblem::Variables::index_of<TestChain>() == 1 && LinearProblem::Variables::index_of<int>() == -1);
static_assert(LinearProblem::Variables::offset_of(2) == 36 && LinearProblem::Variables::total == 60);

TEST_CASE("a key names its variable until that is gone, and never the next tenant of the slot") {
  auto w = std::make_unique<smoother::Window<LinearProblem>>();
  CHECK(w->find(Key<TestChain>{}) == nullptr);
  const auto first = w->add_variable(TestChain{Eigen::Matrix<double, 1, 1>{3.0}}, GpsTime{1});
  REQUIRE(first.ok());
  CHECK(w->find(*first)->value[0] == 3.0);
  CHECK(w->remove_variable(*first).ok());
  CHECK(w->find(*first) == nullptr);
  CHECK(w->remove_variable(*first).code == StatusCode::unknown_key);
  const auto second = w->add_variable(TestChain{}, GpsTime{2});
  CHECK(second->slot == first->slot);
  CHECK(second->generation != first->generation);
  CHECK(w->find(*first) == nullptr);
  CHECK(w->id_of(w->any(*first)) == -1);
  CHECK(w->id_of(w->any(*second)) == w->id_of(*second));
  CHECK(w->id_of(smoother::AnyKey{9, 0, 1}) == -1);
  CHECK(w->id_of(smoother::AnyKey{0, 4'000'000'000U, 1}) == -1);
  CHECK(w->key_of(w->id_of(*second)) == w->any(*second));
}

TEST_CASE("a full pool refuses, says which, changes nothing, and takes again after a removal") {
  auto w = std::make_unique<smoother::Window<SmallProblem>>();
  const auto a = w->add_variable(TestLocal{}, GpsTime{1}), b = w->add_variable(TestLocal{}, GpsTime{1});
  const auto c = w->add_variable(TestLocal{}, GpsTime{1});
  const auto refused = w->add_variable(TestLocal{}, GpsTime{1});
  CHECK(refused.status().code == StatusCode::capacity_exceeded);
  CHECK(refused.status().index == 1);
  CHECK(w->count<TestLocal>() == 3);
  CHECK(w->remove_variable(*b).ok());
  CHECK(w->add_variable(TestLocal{}, GpsTime{1}).ok());
  CHECK((a.ok() && c.ok()));
  REQUIRE(w->add_variable(TestState{}, GpsTime{5}).ok());
  CHECK(w->add_variable(TestState{}, GpsTime{4}).status().code == StatusCode::out_of_order);
  REQUIRE(w->add_variable(TestState{}, GpsTime{5}).ok());
  CHECK(w->add_variable(TestState{}, GpsTime{6}).status().code == StatusCode::capacity_exceeded);
  CHECK(w->states().size() == 2);
  CHECK(w->add_factor(TwoLocals{*a, *c}).status().code == StatusCode::invalid_argument);  // two locals
  CHECK(w->add_factor(TwoLocals{*a, *c, 0}).status().code == StatusCode::invalid_argument);
  CHECK(w->add_factor(TwoLocals{*a, *c, 3}).status().code == StatusCode::invalid_argument);
}

TEST_CASE("binding refuses unknown keys, keys named twice and too many, and leaves every degree as it was") {
  auto w = std::make_unique<smoother::Window<LinearProblem>>();
  const auto s = *w->add_variable(TestState{}, GpsTime{1}), t = *w->add_variable(TestState{}, GpsTime{2});
  const auto c = *w->add_variable(TestChain{}, GpsTime{2}), d = *w->add_variable(TestChain{}, GpsTime{2});
  const auto l = *w->add_variable(TestLocal{}, GpsTime{2});
  CHECK(w->add_factor(on({s, Key<TestState>{}})).status().code == StatusCode::unknown_key);
  CHECK(w->add_factor(on({s, Key<TestState>{}})).status().index == 1);
  CHECK(w->add_factor(on({s, s})).status().code == StatusCode::invalid_argument);
  CHECK(w->add_factor(on({s}, {c, c})).status().code == StatusCode::invalid_argument);
  CHECK(w->add_factor(on({s, t}, {c, d}, {l})).status().code == StatusCode::capacity_exceeded);
  for (const int id : {w->id_of(s), w->id_of(t), w->id_of(c), w->id_of(l)}) CHECK(w->info(id).degree == 0);
  const auto f = w->add_factor(on({s, t}, {c}, {}));
  REQUIRE(f.ok());
  CHECK(w->info(w->id_of(s)).degree == 1);
  CHECK(w->remove_variable(s).code == StatusCode::invalid_argument);
  CHECK(w->find(s) != nullptr);
  CHECK(w->remove_factor(*f).ok());
  CHECK(w->remove_factor(*f).code == StatusCode::unknown_key);
  CHECK(w->info(w->id_of(s)).degree == 0);
  CHECK(w->remove_variable(s).ok());
  CHECK(w->states().size() == 1);
}

TEST_CASE("factors run out as an ordinary outcome") {
  auto w = std::make_unique<smoother::Window<LinearProblem>>();
  const auto s = *w->add_variable(TestState{}, GpsTime{1});
  for (int i = 0; i < 400; ++i) REQUIRE(w->add_factor(on({s})).ok());
  CHECK(w->add_factor(on({s})).status().code == StatusCode::capacity_exceeded);
  CHECK(w->info(w->id_of(s)).degree == 400);
}
