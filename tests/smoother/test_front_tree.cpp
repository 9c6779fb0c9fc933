// SPDX-License-Identifier: BSD-3-Clause
// The symbolic elimination on random windows: who is eliminated where, which front sums which factor, what a front's separator must hold.
#include <searvins/smoother/front_tree.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <vector>

#include <searvins/smoother/window.hpp>

#include "linear_problem.hpp"

using namespace searvins;
using namespace searvins::test;
using smoother::Front;
using smoother::Key;
using smoother::Role;

namespace {

using TestWindow = smoother::Window<LinearProblem>;
using Tree = smoother::FrontTree<TestWindow::TablesType, 600>;

/// A window of consecutive states with chain and local variables that random factors tie together.
struct RandomWindow {
  std::unique_ptr<TestWindow> window = std::make_unique<TestWindow>();
  std::vector<Key<TestState>> states;

  explicit RandomWindow(Rng& rng) {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(uniform(rng, 0, 1) * static_cast<double>(n)) % n; };
    std::vector<Key<TestChain>> chains;
    std::vector<Key<TestLocal>> locals;
    const std::size_t n = 2 + below(8);
    for (std::size_t k = 0; k < n; ++k) states.push_back(*window->add_variable(TestState{}, GpsTime{static_cast<std::int64_t>(k)}));
    for (int k = 0; k < 12; ++k) chains.push_back(*window->add_variable(TestChain{}, GpsTime{0}));
    for (int k = 0; k < 6; ++k) locals.push_back(*window->add_variable(TestLocal{}, GpsTime{0}));
    for (std::size_t k = 0; k + 1 < n; ++k) tie({states[k], states[k + 1]}, {}, {});
    for (int k = 0; k < 30; ++k) {
      const std::size_t s = below(n), c = below(chains.size());
      std::vector<Key<TestChain>> two{chains[c]};
      if (chance(rng, 0.5)) two.push_back(chains[(c + 1) % chains.size()]);
      if (chance(rng, 0.3))
        chance(rng, 0.5) ? tie({states[s]}, {}, {locals[below(locals.size())]}) : tie<PoseFactor>({states[s]}, {}, {locals[below(locals.size())]});
      else
        tie({states[s]}, two, {});
    }
  }
  template <class F = LinearFactor>
  void tie(const std::vector<Key<TestState>>& s, const std::vector<Key<TestChain>>& c, const std::vector<Key<TestLocal>>& l) {
    F f;
    for (const auto& k : s) REQUIRE(f.states.push_back(k));
    for (const auto& k : c) REQUIRE(f.chains.push_back(k));
    for (const auto& k : l) REQUIRE(f.locals.push_back(k));
    REQUIRE(window->add_factor(f).ok());
  }
};

const std::array<int, 0> kNoPrior{};

/// Factors that a front sums: its own and those of its local variables.
std::vector<int> factors_of(const TestWindow& w, const Front& front) {
  std::vector<int> all;
  const auto walk = [&](int id) {
    for (; id >= 0; id = w.tables.factor(id).next) all.push_back(id);
  };
  walk(front.first_factor);
  for (int l = front.first_local; l >= 0; l = w.tables.variable(l).next) walk(w.tables.variable(l).first_factor);
  return all;
}

bool holds(const Tree& tree, const Front& front, int from, int count, int id) {
  for (int k = from; k < from + count; ++k)
    if (tree.member(front.first + k) == id) return true;
  return false;
}

}  // namespace

TEST_CASE("every state and chain variable is eliminated once, its axes stacked without a gap; every factor is summed once") {
  for_all_seeds(200, [](Rng& rng) {
    RandomWindow random(rng);
    auto& tables = random.window->tables;
    const auto tree = std::make_unique<Tree>();
    REQUIRE(tree->analyse(tables, kNoPrior));
    REQUIRE(tree->count() == static_cast<int>(random.states.size()));
    std::vector<int> eliminated, summed;
    int axes = 0;
    for (int f = 0; f < tree->count(); ++f) {
      const Front& front = tree->front(f);
      CHECK(front.offset == axes);
      for (int k = 0; k < front.eliminated; ++k) {
        const int id = tree->member(front.first + k);
        CHECK(tables.variable(id).front == f);
        CHECK(tables.variable(id).offset == axes);
        axes += tables.variable(id).dof;
        eliminated.push_back(id);
      }
      const auto factors = factors_of(*random.window, front);
      summed.insert(summed.end(), factors.begin(), factors.end());
    }
    CHECK(tree->tangent_size() == axes);
    std::vector<int> expected;
    for (int id : tables.living_variables)
      if (tables.variable(id).role != Role::local) expected.push_back(id);
    std::sort(eliminated.begin(), eliminated.end()), std::sort(summed.begin(), summed.end());
    CHECK(eliminated == expected);
    CHECK(summed == std::vector<int>(tables.living_factors.begin(), tables.living_factors.end()));
  });
}

TEST_CASE("a front's variables cover its factors and its children's separators; a separator is eliminated later, first in the parent") {
  for_all_seeds(200, [](Rng& rng) {
    RandomWindow random(rng);
    auto& tables = random.window->tables;
    const auto tree = std::make_unique<Tree>();
    REQUIRE(tree->analyse(tables, kNoPrior));
    for (int f = 0; f < tree->count(); ++f) {
      const Front& front = tree->front(f);
      for (int id : factors_of(*random.window, front))
        for (int k = 0; k < tables.factor(id).keys; ++k) {
          const int v = tables.variables_of(tables.factor(id))[k];
          if (tables.variable(v).role != Role::local) CHECK(holds(*tree, front, 0, front.eliminated + front.separated, v));
        }
      int earliest = -1, rows = 0;
      for (int k = front.eliminated; k < front.eliminated + front.separated; ++k) {
        const int id = tree->member(front.first + k), later = tables.variable(id).front;
        CHECK(later > f);
        earliest = earliest < 0 ? later : std::min(earliest, later);
        rows += tree->axes(front.first + k);
        if (front.parent >= 0) {
          const Front& parent = tree->front(front.parent);
          CHECK(holds(*tree, parent, 0, parent.eliminated + parent.separated, id));
        }
      }
      CHECK(front.parent == earliest);
      CHECK(front.rows_s == rows);
    }
  });
}

TEST_CASE("fronts stay clean up to the first one whose factors changed, and no further") {
  for_all_seeds(200, [](Rng& rng) {
    RandomWindow random(rng);
    auto& tables = random.window->tables;
    const auto tree = std::make_unique<Tree>();
    REQUIRE(tree->analyse(tables, kNoPrior));
    for (int f = 0; f < tree->count(); ++f) tree->front(f).clean = true;
    REQUIRE(tree->analyse(tables, kNoPrior));
    CHECK(tree->first_dirty() == tree->count());
    const int touched = static_cast<int>(uniform(rng, 0, 1) * tree->count()) % tree->count();
    random.tie({random.states[static_cast<std::size_t>(touched)]}, {}, {});
    REQUIRE(tree->analyse(tables, kNoPrior));
    CHECK(tree->first_dirty() == touched);
    tree->clear();
    CHECK(tree->count() == 0);
  });
}

TEST_CASE("a prior is summed where its first variable is eliminated; too few places for members is said") {
  Rng rng{4};
  RandomWindow random(rng);
  auto& tables = random.window->tables;
  const auto tree = std::make_unique<Tree>();
  const std::array<int, 2> prior{tables.states[1], tables.states[0]};
  REQUIRE(tree->analyse(tables, prior));
  CHECK(tree->prior_front() == 0);
  CHECK(holds(*tree, tree->front(0), tree->front(0).eliminated, tree->front(0).separated, prior[0]));
  REQUIRE(tree->analyse(tables, kNoPrior));
  CHECK(tree->prior_front() == -1);
  const auto narrow = std::make_unique<smoother::FrontTree<TestWindow::TablesType, 3>>();
  CHECK_FALSE(narrow->analyse(tables, kNoPrior));
}

TEST_CASE("of a separator's variable those axes are rows that a factor or a child's separator touches") {
  for_all_seeds(200, [](Rng& rng) {
    RandomWindow w(rng);
    TestWindow& window = *w.window;
    auto tree = std::make_unique<Tree>();
    REQUIRE(tree->analyse(window.tables, kNoPrior));
    std::vector<std::map<int, int>> expected(static_cast<std::size_t>(tree->count()));  // by front: variable -> axes
    for (int f = 0; f < tree->count(); ++f) {
      const Front& front = tree->front(f);
      auto& axes = expected[static_cast<std::size_t>(f)];
      const auto need = [&](int id, int n) {
        const auto& v = window.tables.variable(id);
        if (v.role != Role::local && v.front != f) axes[id] = std::max(axes[id], n);
      };
      for (int id : factors_of(window, front)) {
        const auto& factor = window.tables.factor(id);
        for (int k = 0; k < factor.keys; ++k) need(window.tables.variables_of(factor)[k], window.tables.axes_of(factor)[k]);
      }
      for (int c = 0; c < f; ++c)
        if (tree->front(c).parent == f)
          for (const auto& [id, n] : expected[static_cast<std::size_t>(c)]) need(id, n);
      int rows = 0;
      for (int k = front.first + front.eliminated; k < front.first + front.eliminated + front.separated; ++k) {
        CHECK(tree->axes(k) == axes.at(tree->member(k)));
        rows += tree->axes(k);
      }
      CHECK(static_cast<std::size_t>(front.separated) == axes.size());
      CHECK(front.rows_s == rows);
    }
  });
}

TEST_CASE("a local variable seen from six states ties the axes that its factors touch") {
  const auto rows = []<class F>(F) {
    TestWindow window;
    const Key<TestLocal> local = *window.add_variable(TestLocal{}, GpsTime{0});
    Key<TestState> before{};
    for (int k = 0; k < 6; ++k) {
      const Key<TestState> state = *window.add_variable(TestState{}, GpsTime{k});
      F sight;
      REQUIRE((sight.states.push_back(state) && sight.locals.push_back(local)));
      REQUIRE(window.add_factor(sight).ok());
      LinearFactor tie;
      REQUIRE(tie.states.push_back(state));
      if (k > 0) REQUIRE(tie.states.push_back(before));
      REQUIRE(window.add_factor(tie).ok());
      before = state;
    }
    auto tree = std::make_unique<Tree>();
    REQUIRE(tree->analyse(window.tables, kNoPrior));
    return tree->front(0).rows_s;
  };
  CHECK(rows(LinearFactor{}) == 5 * 3);
  CHECK(rows(PoseFactor{}) == 3 + 4 * 1);  // the next state whole, by the tie
}
