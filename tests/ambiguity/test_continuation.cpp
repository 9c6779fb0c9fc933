// SPDX-License-Identifier: BSD-3-Clause
// The hybrid continuation rules, one by one: who is continued, who walks, who starts afresh, and what a full table does.
#include <searvins/ambiguity/continuation.hpp>

#include <map>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using ambiguity::ArcId;
using ambiguity::ContinuityMode;
using ambiguity::Transition;

namespace {

using Table = ambiguity::Continuation<int, 8>;

ArcId arc(int satellite, char band = '1') {
  const gnss::SignalCode code{gnss::Constellation::gps, band, 'C'};
  return {{gnss::Constellation::gps, static_cast<std::uint8_t>(satellite)}, code, code};
}
gnss::SatelliteId gps(int number) { return {gnss::Constellation::gps, static_cast<std::uint8_t>(number)}; }

/// One epoch of one arc as the estimator drives it: decide, then record under the handle `next` unless continued. Returns the decision.
Transition use(Table& table, const ArcId& id, int next, bool verified = true, gnss::SatelliteId pivot = {}) {
  const Transition t = table.decide(id, verified, pivot);
  const int handle = t == Transition::continued ? table.find(id)->handle : next;
  REQUIRE(table.record(id, t, handle, pivot));
  return t;
}

}  // namespace

TEST_CASE("hybrid: a state serves H epochs counting its first, then walks into a new one") {
  for (int H = 1; H <= 5; ++H) {
    CAPTURE(H);
    Table table;
    table.max_arc_epochs = H;
    for (int k = 0; k < 4 * H; ++k) {
      CAPTURE(k);
      table.begin_epoch();
      const Transition t = use(table, arc(3), k);
      CHECK(t == (k == 0 ? Transition::fresh : k % H == 0 ? Transition::walked : Transition::continued));
      CHECK(table.find(arc(3))->handle == k / H * H);
      CHECK(table.find(arc(3))->used == k % H + 1);
    }
  }
}

TEST_CASE("constant: one state for as long as continuity is verified; instantaneous: a fresh one every epoch") {
  Table constant, instantaneous;
  constant.mode = ContinuityMode::constant, instantaneous.mode = ContinuityMode::instantaneous;
  for (int k = 0; k < 50; ++k) {
    constant.begin_epoch(), instantaneous.begin_epoch();
    CHECK(use(constant, arc(1), k) == (k == 0 ? Transition::fresh : Transition::continued));
    CHECK(use(instantaneous, arc(1), k) == Transition::fresh);
  }
  CHECK(constant.find(arc(1))->handle == 0);
  CHECK(instantaneous.find(arc(1))->handle == 49);
  constant.begin_epoch();
  CHECK(use(constant, arc(1), 50, false) == Transition::fresh);
}

TEST_CASE("a phase starts afresh when it is unverified, was away one epoch, or an epoch was skipped") {
  for (const ContinuityMode mode : {ContinuityMode::hybrid, ContinuityMode::constant}) {
    Table table;
    table.mode = mode;
    const auto prepare = [&] {
      table.clear();
      table.begin_epoch();
      CHECK(use(table, arc(1), 0) == Transition::fresh);
      table.begin_epoch();
      CHECK(use(table, arc(1), 1) == Transition::continued);
    };
    prepare();
    table.begin_epoch();
    CHECK(table.decide(arc(1), true) == Transition::continued);
    CHECK(table.decide(arc(1), false) == Transition::fresh);
    CHECK(table.decide(arc(1, '2'), true) == Transition::fresh);  // another signal of the satellite
    CHECK(table.decide(arc(2), true) == Transition::fresh);
    table.begin_epoch();  // not recorded in the epoch before
    CHECK(table.decide(arc(1), true) == Transition::fresh);
    prepare();
    table.skip_epoch();
    table.begin_epoch();
    CHECK(table.decide(arc(1), true) == Transition::fresh);
    prepare();
    table.forget(arc(1));
    CHECK(table.find(arc(1)) == nullptr);
    table.begin_epoch();
    CHECK(table.decide(arc(1), true) == Transition::fresh);
  }
}

TEST_CASE("a double-difference state goes on only under its own pivot") {
  Table table;
  table.begin_epoch();
  CHECK(use(table, arc(1), 0, true, gps(9)) == Transition::fresh);
  table.begin_epoch();
  CHECK(table.decide(arc(1), true, gps(8)) == Transition::fresh);
  CHECK(table.decide(arc(1), true) == Transition::fresh);
  CHECK(table.decide(arc(1), true, gps(9)) == Transition::continued);
}

TEST_CASE("a full table refuses new arcs, keeps the old ones, and makes room for those that cannot go on") {
  Table table;
  table.begin_epoch();
  for (int s = 1; s <= 8; ++s) (void)use(table, arc(s), s);
  CHECK_FALSE(table.record(arc(9), Transition::fresh, 9));
  CHECK(table.find(arc(9)) == nullptr);
  CHECK(table.arcs().size() == 8);
  CHECK(table.record(arc(8), Transition::fresh, 80));  // one that is there can always be replaced
  table.begin_epoch();
  CHECK_FALSE(table.record(arc(9), Transition::fresh, 9));  // the others may still be continued at this epoch
  CHECK(use(table, arc(1), 0) == Transition::continued);
  table.begin_epoch();
  CHECK(table.record(arc(9), Transition::fresh, 9));
  CHECK(table.find(arc(1)) != nullptr);
  CHECK(table.find(arc(2)) == nullptr);
  CHECK(table.decide(arc(1), true) == Transition::continued);
}

TEST_CASE("random histories agree with a plain account of every arc") {
  for_all_seeds(300, [](Rng& rng) {
    struct Account {
      int last{-1000}, used{0}, pivot{0};
    };
    Table table;
    const int H = table.max_arc_epochs = integer(rng, 1, 4);
    table.mode = static_cast<ContinuityMode>(integer(rng, 0, 2));
    std::map<int, Account> accounts;
    int pivot = 1;
    for (int k = 0; k < 60; ++k) {
      if (chance(rng, 0.1)) {
        table.skip_epoch();
        continue;
      }
      table.begin_epoch();
      const int now = static_cast<int>(table.epoch());
      if (chance(rng, 0.1)) pivot = integer(rng, 1, 3);
      for (int s = 1; s <= 6; ++s) {
        if (chance(rng, 0.2)) continue;
        const bool verified = chance(rng, 0.9);
        Account& a = accounts[s];
        const bool goes_on = verified && table.mode != ContinuityMode::instantaneous && a.last == now - 1 && a.pivot == pivot;
        const Transition expected = !goes_on                                                ? Transition::fresh
                                    : table.mode == ContinuityMode::constant || a.used < H ? Transition::continued
                                                                                            : Transition::walked;
        CHECK(use(table, arc(s), k, verified, gps(pivot)) == expected);
        a = {now, expected == Transition::continued ? a.used + 1 : 1, pivot};
      }
    }
  });
}
