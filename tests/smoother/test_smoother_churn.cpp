// SPDX-License-Identifier: BSD-3-Clause
// Whatever is added, removed and marginalised in whatever order: a status each time, and the dense answer wherever there is one.
#include "linear_problem.hpp"
#include "support/allocation_counter.hpp"

#include <cstring>
#include <memory>

using namespace searvins;
using namespace searvins::test;
using smoother::Key;

namespace {

/// A smoother under random operations beside the list of every factor that should count.
struct Churn {
  struct Kept {
    Key<LinearFactor> key;
    LinearFactor factor;
  };
  std::unique_ptr<LinearSmoother> smoother = std::make_unique<LinearSmoother>();
  DenseBatch columns;  ///< for its column numbers
  std::vector<Kept> live;
  std::vector<LinearFactor> absorbed;  ///< marginalised: their information must live on in the prior
  std::vector<Key<TestState>> states;
  std::vector<Key<TestChain>> chains;
  std::vector<Key<TestLocal>> locals;
  std::int64_t now{0};
  int missed{0};  ///< singular, but the pivot that should be zero drowned in the rounding of an ill-conditioned elimination

  template <class V>
  void add_variable(std::vector<Key<V>>& keys) {
    const std::size_t before = smoother->window().count<V>();
    const auto key = smoother->add_variable(V{}, GpsTime{++now});
    if (!key.ok()) {
      CHECK(key.status().code == StatusCode::capacity_exceeded);
      CHECK(smoother->window().count<V>() == before);
      return;
    }
    keys.push_back(*key);
    columns.add(*key);
  }
  template <class V>
  static Key<V> any_of(Rng& rng, const std::vector<Key<V>>& keys) {
    return keys.empty() ? Key<V>{} : keys[static_cast<std::size_t>(integer(rng, 0, static_cast<int>(keys.size()) - 1))];
  }
  void add_factor(Rng& rng) {
    LinearFactor f;
    const int s = integer(rng, 0, 2), c = integer(rng, 0, 2), l = chance(rng, 0.3) ? 1 : 0;
    if (!states.empty() && s > 0) (void)f.states.push_back(chance(rng, 0.7) ? states.back() : any_of(rng, states));
    if (states.size() > 1 && s > 1) (void)f.states.push_back(chance(rng, 0.7) ? states[states.size() - 2] : any_of(rng, states));
    for (int i = 0; i < c && !chains.empty(); ++i) (void)f.chains.push_back(any_of(rng, chains));
    if (l == 1 && !locals.empty()) (void)f.locals.push_back(any_of(rng, locals));
    for (int r = 0; r < 2; ++r) {
      for (int k = 0; k < 9; ++k) f.A(r, k) = normal(rng);
      f.b[r] = normal(rng, 3.0);
    }
    bool stale = false, twice = f.states.size() == 2 && f.states[0] == f.states[1];
    twice = twice || (f.chains.size() == 2 && f.chains[0] == f.chains[1]);
    f.for_each_key([&](const auto& k) { stale = stale || smoother->find(k) == nullptr; });
    const auto key = smoother->add_factor(f);
    const bool large = f.states.size() + f.chains.size() + f.locals.size() > static_cast<std::size_t>(LinearFactor::max_keys);
    CHECK(key.ok() == (!stale && !twice && !large));
    if (stale && !twice && !large) CHECK(key.status().code == StatusCode::unknown_key);
    if (key.ok()) live.push_back({*key, f});
  }
  void remove_factor(Rng& rng) {
    if (live.empty()) {
      CHECK(smoother->remove_factor(Key<LinearFactor>{}).code == StatusCode::unknown_key);
      return;
    }
    const auto i = static_cast<std::size_t>(integer(rng, 0, static_cast<int>(live.size()) - 1));
    CHECK(smoother->remove_factor(live[i].key).ok());
    CHECK(smoother->remove_factor(live[i].key).code == StatusCode::unknown_key);
    live.erase(live.begin() + static_cast<std::ptrdiff_t>(i));
  }
  template <class V>
  void remove_variable(Rng& rng, std::vector<Key<V>>& keys) {
    const auto key = any_of(rng, keys);
    const bool alive = smoother->find(key) != nullptr;
    const Status s = smoother->remove_variable(key);
    if (!alive) CHECK(s.code == StatusCode::unknown_key);
    if (alive && !s.ok()) CHECK(s.code == StatusCode::invalid_argument);
    if (alive && s.ok()) CHECK(smoother->find(key) == nullptr);
  }
  void marginalise() {
    const std::size_t before = smoother->window().states().size();
    const auto report = smoother->marginalise_oldest();
    CHECK(report.status.ok() == (before > 0));
    if (!report.status.ok()) {
      CHECK(report.status.code == StatusCode::no_data);
      return;
    }
    CHECK(smoother->window().states().size() == before - 1);
    int gone = 0;
    std::erase_if(live, [&](const Kept& k) {
      if (smoother->find_factor(k.key)) return false;
      absorbed.push_back(k.factor), ++gone;
      return true;
    });
    CHECK(gone == report.factors);
  }

  struct Answer {
    bool reliable{false}, determined{false};
    std::vector<int> kept;  ///< columns, in the order of `keys`
    std::vector<smoother::AnyKey> keys;
    Eigen::VectorXd x;
    Eigen::MatrixXd P;
  };
  /// The marginal of what lives in the window, from all factors that ever counted; generalised Schur complement where the rest is singular.
  Answer dense() const {
    Answer a;
    std::vector<bool> is_kept(static_cast<std::size_t>(columns.columns), false);
    const auto keep = [&]<class V>(const Key<V>& key) {
      const int id = smoother->window().id_of(key);
      if (id < 0 || (V::role == smoother::Role::local && smoother->window().info(id).degree == 0)) return;
      a.keys.push_back(LinearSmoother::WindowType::any(key));
      for (int i = 0; i < V::dof; ++i) {
        a.kept.push_back(columns.first.at(DenseBatch::id(key)) + i);
        is_kept[static_cast<std::size_t>(a.kept.back())] = true;
      }
    };
    for (const auto& k : states) keep(k);
    for (const auto& k : chains) keep(k);
    for (const auto& k : locals) keep(k);
    DenseBatch all = columns;
    for (const auto& k : live) all.add(k.factor);
    for (const auto& f : absorbed) all.add(f);
    const Eigen::MatrixXd H = all.information();
    const Eigen::VectorXd g = all.gradient();
    std::vector<int> gone;
    for (int i = 0; i < columns.columns; ++i)
      if (!is_kept[static_cast<std::size_t>(i)]) gone.push_back(i);
    Eigen::MatrixXd S = H(a.kept, a.kept);
    Eigen::VectorXd s = g(a.kept);
    bool clear_rank = true;
    if (!gone.empty()) {
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(H(gone, gone));
      Eigen::VectorXd inverse = eigen.eigenvalues();
      const double top = std::max(1e-30, inverse.maxCoeff());
      for (double& v : inverse) {
        if (v > 1e-12 * top && v < 1e-4 * top) clear_rank = false;
        v = v > 1e-8 * top ? 1 / v : 0;
      }
      const Eigen::MatrixXd pinv = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
      S -= H(a.kept, gone) * pinv * H(gone, a.kept);
      s -= H(a.kept, gone) * (pinv * g(gone));
    }
    if (a.kept.empty()) return a;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
    const double top = std::max(1e-30, eigen.eigenvalues().maxCoeff()), low = eigen.eigenvalues().minCoeff();
    a.determined = low > 1e-5 * top;
    a.reliable = clear_rank && (a.determined || low < 1e-13 * top);
    if (a.determined) {
      a.P = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
      a.x = a.P * s;
    }
    return a;
  }
  Eigen::VectorXd values() const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(columns.columns);
    const auto put = [&](const auto& key) {
      if (const auto* v = smoother->find(key)) x.segment(columns.first.at(DenseBatch::id(key)), v->value.size()) = v->value;
    };
    for (const auto& k : states) put(k);
    for (const auto& k : chains) put(k);
    for (const auto& k : locals) put(k);
    return x;
  }
  void optimise(int& compared, int& refused) {
    const Eigen::VectorXd before = values();
    const auto report = smoother->optimise();
    if (smoother->window().states().empty()) {
      CHECK(report.status.code == StatusCode::no_data);
      return;
    }
    const Answer a = dense();
    if (!report.status.ok()) {
      CHECK(report.status.code == StatusCode::under_determined);
      CHECK(values() == before);
      CHECK(report.where.axis >= 0);
    }
    if (!a.reliable) return;
    if (a.determined) CHECK(report.status.ok());
    if (!a.determined) ++(report.status.ok() ? missed : refused);
    if (!a.determined || !report.status.ok()) return;
    ++compared;
    const Eigen::VectorXd x = values()(a.kept);
    CHECK(close(x, a.x, 1e-9));
    const int n = static_cast<int>(a.kept.size());
    Eigen::MatrixXd P(n, n);
    const auto size = smoother->joint_covariance(a.keys.data(), static_cast<int>(a.keys.size()), P.data(), n);
    REQUIRE(size.ok());
    CHECK(close(P, a.P, 1e-9));
  }
};

}  // namespace

TEST_CASE("P1: 10,000 random add/remove/marginalise operations never crash, always report, and keep the marginal of the dense batch to 1e-9") {
  int operations = 0, compared = 0, refused = 0, missed = 0;
  for_all_seeds(300, [&](Rng& rng) {
    Churn churn;
    const bool anchored = chance(rng, 0.75);  // well-posed windows on the one hand, mere debris on the other
    for (int k = 0; k < 36; ++k, ++operations) {
      const double pick = uniform(rng, 0.0, 1.0);
      if (anchored && pick < 0.25) {
        churn.add_variable(churn.states);
        for (int i = 0; i < 4; ++i) churn.add_factor(rng);
      } else if (pick < 0.15) {
        churn.add_variable(churn.states);
      } else if (pick < 0.32) {
        chance(rng, 0.5) ? churn.add_variable(churn.chains) : churn.add_variable(churn.locals);
        for (int i = 0; anchored && i < 3; ++i) churn.add_factor(rng);
      } else if (pick < 0.62) {
        churn.add_factor(rng);
      } else if (pick < 0.68) {
        churn.remove_factor(rng);
      } else if (pick < 0.74) {
        const int kind = integer(rng, 0, 2);
        if (kind == 0) churn.remove_variable(rng, churn.states);
        if (kind == 1) churn.remove_variable(rng, churn.chains);
        if (kind == 2) churn.remove_variable(rng, churn.locals);
      } else if (pick < 0.84) {
        if (chance(rng, 0.3)) churn.remove_factor(rng);  // in the same breath
        churn.marginalise();
      } else {
        churn.optimise(compared, refused);
      }
    }
    churn.optimise(compared, refused);
    missed += churn.missed;
  });
  MESSAGE(operations, " operations, ", compared, " compared with the dense marginal, ", refused, " refused as under-determined like the dense batch, ", missed, " missed");
  CHECK(missed <= refused / 50);
  CHECK(compared > operations / 100);
  CHECK(refused > operations / 100);
}

TEST_CASE("P1: a chain variable that only the prior holds stays determined and equal to the batch") {
  Rng rng{7};
  Churn churn;
  int compared = 0, refused = 0;
  churn.add_variable(churn.states);
  churn.add_variable(churn.states);
  churn.add_variable(churn.chains);
  const auto add = [&](std::initializer_list<Key<TestState>> states, std::initializer_list<Key<TestChain>> chains) {
    LinearFactor f;
    for (const auto& s : states) (void)f.states.push_back(s);
    for (const auto& c : chains) (void)f.chains.push_back(c);
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 9; ++c) f.A(r, c) = normal(rng);
      f.b[r] = normal(rng);
    }
    const auto key = churn.smoother->add_factor(f);
    REQUIRE(key.ok());
    churn.live.push_back({*key, f});
    return *key;
  };
  const auto a = churn.states[0], b = churn.states[1];
  const auto c = churn.chains[0];
  add({a}, {}), add({a}, {}), add({a, b}, {}), add({a, b}, {}), add({a}, {c}), add({a, b}, {c});
  const auto last = add({b}, {c});
  churn.optimise(compared, refused);
  churn.marginalise();
  REQUIRE(churn.smoother->remove_factor(last).ok());
  std::erase_if(churn.live, [&](const auto& k) { return k.key == last; });
  churn.optimise(compared, refused);
  REQUIRE(churn.smoother->find(c) != nullptr);
  CHECK(compared == 2);
  churn.add_variable(churn.states);  // the chain moves on to the newest front
  churn.marginalise();
  churn.marginalise();
  CHECK(churn.smoother->find(c) == nullptr);
  CHECK(churn.smoother->optimise().status.code == StatusCode::no_data);
  CHECK(churn.smoother->marginalise_oldest().status.code == StatusCode::no_data);
}

TEST_CASE("P2: marginalising an unconnected variable is a counted no-op") {
  auto s = std::make_unique<LinearSmoother>();
  const auto lone = s->add_variable(TestState{}, GpsTime{1});
  const auto idle = s->add_variable(TestLocal{}, GpsTime{1});
  const auto kept = s->add_variable(TestState{}, GpsTime{2});
  REQUIRE((lone.ok() && idle.ok() && kept.ok()));
  for (int k = 0; k < 2; ++k) {
    LinearFactor f;
    (void)f.states.push_back(*kept);
    f.A.leftCols<3>() << 1 + k, 2, 0, 0, 1, 1 - 3 * k;
    f.b << 1, 2 + k;
    REQUIRE(s->add_factor(f).ok());
  }
  const auto report = s->marginalise_oldest();
  CHECK(report.status.ok());
  CHECK(report.unconnected == 2);
  CHECK(report.variables == 2);
  CHECK(report.skipped_axes == 3);
  CHECK(s->prior().empty());
  CHECK(s->find(*lone) == nullptr);
  CHECK(s->find(*idle) == nullptr);
  CHECK(s->optimise().status.ok());
}

namespace {

/// One epoch of a steady small problem: a state tied to the last, a landmark seen twice, a chain now and then.
struct Steady {
  Key<TestState> last{};
  Key<TestChain> chain{};
  Key<TestLocal> landmark{};
  std::int64_t epoch{0};

  LinearFactor make(int tag) const {
    LinearFactor f;
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 9; ++c) f.A(r, c) = std::sin(1.0 + 3.1 * (r + 1) * (c + 2) * (c + 2) + 0.9 * tag * (c + 1));
      f.b[r] = std::cos(0.37 * static_cast<double>(epoch % 1000) + tag + r);
    }
    return f;
  }
  bool update(LinearSmoother& s) {
    ++epoch;
    const auto state = s.add_variable(TestState{}, GpsTime{epoch * 100'000'000});
    bool good = state.ok();
    for (int i = 0; i < 2; ++i) {
      LinearFactor f = make(i);
      if (last.valid()) (void)f.states.push_back(last);
      (void)f.states.push_back(*state);
      good = s.add_factor(f).ok() && good;
    }
    LinearFactor unary = make(2);
    (void)unary.states.push_back(*state);
    good = s.add_factor(unary).ok() && good;
    if (epoch % 5 == 1) chain = *s.add_variable(TestChain{}, GpsTime{epoch * 100'000'000});
    LinearFactor on_chain = make(3);
    (void)on_chain.states.push_back(*state), (void)on_chain.chains.push_back(chain);
    good = s.add_factor(on_chain).ok() && good;
    if (epoch % 2 == 1) landmark = *s.add_variable(TestLocal{}, GpsTime{epoch * 100'000'000});
    for (int i = 4; i < 6; ++i) {
      LinearFactor seen = make(i);
      (void)seen.states.push_back(*state), (void)seen.locals.push_back(landmark);
      good = s.add_factor(seen).ok() && good;
    }
    if (s.window().states().size() > 5) good = s.marginalise_oldest().status.ok() && good;
    good = s.optimise().status.ok() && good;
    last = *state;
    return good;
  }
};

}  // namespace

TEST_CASE("P2, P3: thirty minutes at 10 Hz keep every pool at constant size") {
  auto s = std::make_unique<LinearSmoother>();
  Steady drive;
  std::size_t most_chains = 0, most_locals = 0, most_factors = 0;
  int failures = 0, prior = 0, worst_prior = 0;
  for (int k = 0; k < 18'000; ++k) {
    failures += drive.update(*s) ? 0 : 1;
    const auto& w = s->window();
    if (k == 100) {
      most_chains = w.count<TestChain>(), most_locals = w.count<TestLocal>(), most_factors = w.factor_count<LinearFactor>();
      prior = s->prior().dimension;
    }
    if (k > 100 && (k - 100) % 10 == 0) {
      CHECK(w.count<TestChain>() == most_chains);
      CHECK(w.count<TestLocal>() == most_locals);
      CHECK(w.factor_count<LinearFactor>() == most_factors);
      worst_prior = std::max(worst_prior, s->prior().dimension);
    }
  }
  CHECK(failures == 0);
  CHECK(worst_prior == prior);
}

TEST_CASE("P3: 1000 updates allocate nothing on the heap") {
  auto s = std::make_unique<LinearSmoother>();
  Steady drive;
  const auto started = heap_allocations();
  { const auto probe = std::make_unique<Steady>(); REQUIRE(probe->epoch == 0); }
  REQUIRE(heap_allocations() > started);
  const auto before = heap_allocations();
  bool good = true;
  double sum = 0;
  for (int k = 0; k < 1000; ++k) {
    good = drive.update(*s) && good;
    const auto P = s->covariance(drive.last);
    good = good && P.ok();
    sum += (*P)(0, 0);
  }
  const auto after = heap_allocations();
  CHECK(good);
  CHECK(sum > 0);
  CHECK(after == before);
  if (!counts_malloc) MESSAGE("malloc belongs to the sanitizer here: only operator new was counted");
}

TEST_CASE("P19, P24: reruns are bit-identical and two smoothers interleaved do not disturb each other") {
  auto alone = std::make_unique<LinearSmoother>(), one = std::make_unique<LinearSmoother>(), two = std::make_unique<LinearSmoother>();
  Steady a, b, c;
  c.epoch = 500;
  for (int k = 0; k < 300; ++k) {
    REQUIRE(a.update(*alone));
    REQUIRE(b.update(*one));
    REQUIRE(c.update(*two));
    const TestState &x = *alone->find(a.last), &y = *one->find(b.last);
    CHECK(std::memcmp(x.value.data(), y.value.data(), sizeof(double) * 3) == 0);
    const auto P = alone->covariance(a.last), Q = one->covariance(b.last);
    CHECK(std::memcmp(P->data(), Q->data(), sizeof(double) * 9) == 0);
  }
}
