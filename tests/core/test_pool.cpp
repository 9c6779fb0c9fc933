// SPDX-License-Identifier: BSD-3-Clause
// Model-based: a Pool and a std::map from key to value live through the same random operations; every key ever given out is asked
// again after each step, so a stale key that is served shows.
#include <doctest/doctest.h>

#include <cstring>
#include <map>
#include <set>
#include <type_traits>
#include <vector>

#include <searvins/core/pool.hpp>

#include "support/property.hpp"

using searvins::Pool;
using searvins::PoolKey;
using searvins::StatusCode;
using searvins::test::integer;
using searvins::test::Rng;

namespace {

constexpr std::size_t kCapacity = 6;
using IntPool = Pool<int, kCapacity>;
using Key = PoolKey<int>;
using Model = std::map<Key, int>;

void check_same(const IntPool& pool, const Model& model, const std::vector<Key>& ever) {
  REQUIRE(pool.size() == model.size());
  CHECK(pool.empty() == model.empty());
  CHECK(pool.full() == (model.size() == kCapacity));
  for (const Key key : ever) {
    const auto found = model.find(key);
    CHECK(pool.contains(key) == (found != model.end()));
    const int* value = pool.get(key);
    REQUIRE((value != nullptr) == (found != model.end()));
    if (value) {
      CHECK(*value == found->second);
      CHECK(pool.at_slot(key.slot) == value);
      CHECK(pool.key_of_slot(key.slot) == key);
    }
  }
  std::vector<Key> visited;
  pool.for_each([&](Key key, const int& value) {
    visited.push_back(key);
    CHECK(model.at(key) == value);
  });
  REQUIRE(visited.size() == model.size());
  for (std::size_t i = 1; i < visited.size(); ++i) CHECK(visited[i - 1].slot < visited[i].slot);
  std::size_t alive = 0;
  for (std::size_t slot = 0; slot < kCapacity + 2; ++slot) {
    alive += pool.at_slot(slot) != nullptr;
    CHECK((pool.at_slot(slot) != nullptr) == (pool.key_of_slot(slot) != Key{}));
    if (slot >= pool.slot_end()) CHECK(pool.at_slot(slot) == nullptr);
  }
  CHECK(alive == model.size());
}

void random_step(Rng& rng, IntPool& pool, Model& model, std::vector<Key>& ever) {
  const int kind = integer(rng, 0, 99);
  if (kind < 50) {
    const int value = integer(rng, 1, 1000);
    const auto key = pool.insert(value);
    CHECK(key.ok() == (model.size() < kCapacity));
    if (key.ok()) {
      CHECK(model.emplace(*key, value).second);  // never a key that is alive
      for (const Key old : ever) CHECK(old != *key);
      ever.push_back(*key);
    } else {
      CHECK(key.status().code == StatusCode::capacity_exceeded);
      CHECK(key.status().detail == static_cast<int>(kCapacity));
    }
  } else if (kind < 97) {
    if (ever.empty()) return;
    const Key key = ever[static_cast<std::size_t>(integer(rng, 0, static_cast<int>(ever.size()) - 1))];
    const auto status = pool.erase(key);
    CHECK(status.ok() == (model.erase(key) == 1));
    if (!status.ok()) CHECK(status.code == StatusCode::unknown_key);
  } else if (kind < 99) {
    pool.for_each([&](Key key, int& value) {  // the visit changes one and erases another
      if (value % 3 == 0) {
        CHECK(pool.erase(key).ok());
        model.erase(key);
      } else {
        model[key] = ++value;
      }
    });
  } else {
    pool.clear();
    model.clear();
  }
}

}  // namespace

TEST_CASE("Pool: random insertions, erasures and visits agree with std::map; no key is ever given out twice or served stale") {
  searvins::test::for_all_seeds(60, [](Rng& rng) {
    IntPool pool;
    Model model;
    std::vector<Key> ever;
    for (int step = 0; step < 120; ++step) {
      CAPTURE(step);
      random_step(rng, pool, model, ever);
      check_same(pool, model, ever);
    }
  });
}

TEST_CASE("Pool: keys that were never given out name nothing") {
  IntPool pool;
  const Key key = *pool.insert(5);
  CHECK_FALSE(pool.contains(Key{}));
  CHECK(pool.get(Key{}) == nullptr);
  CHECK(pool.erase(Key{}).code == StatusCode::unknown_key);
  CHECK(pool.get(Key{key.slot, key.generation + 2}) == nullptr);
  CHECK(pool.get(Key{key.slot, key.generation + 1}) == nullptr);
  CHECK(pool.get(Key{1, 0}) == nullptr);  // a slot never used has generation 0 and must not match
  CHECK(pool.get(Key{kCapacity, 1}) == nullptr);
  CHECK(pool.get(Key{0xffffffffU, 1}) == nullptr);
  CHECK(*pool.get(key) == 5);
}

TEST_CASE("Pool: the order of slots is last out, first in, then the lowest never used; clear() starts it anew but revives no key") {
  IntPool pool;
  std::vector<Key> keys;
  for (int i = 0; i < 4; ++i) keys.push_back(*pool.insert(i));
  for (std::uint32_t i = 0; i < 4; ++i) CHECK(keys[i].slot == i);
  CHECK(pool.erase(keys[0]).ok());
  CHECK(pool.erase(keys[2]).ok());
  CHECK(pool.insert(10)->slot == 2);
  CHECK(pool.insert(11)->slot == 0);
  CHECK(pool.insert(12)->slot == 4);
  pool.clear();
  for (std::uint32_t i = 0; i < kCapacity; ++i) CHECK(pool.insert(static_cast<int>(i))->slot == i);
  for (const Key key : keys) CHECK(pool.get(key) == nullptr);
}

TEST_CASE("Pool: an element of the pool itself may be inserted; elements do not move") {
  IntPool pool;
  const Key first = *pool.insert(7);
  const int* address = pool.get(first);
  for (std::size_t i = 1; i < kCapacity; ++i) CHECK(pool.insert(*pool.get(first)).ok());
  CHECK(pool.get(first) == address);
  pool.for_each([](Key, const int& value) { CHECK(value == 7); });
  CHECK_FALSE(pool.insert(*pool.get(first)).ok());
}

TEST_CASE("Pool: same calls, same bytes; a copy is independent") {
  struct Element {
    double x{0};
    std::int64_t id{0};
  };
  using Elements = Pool<Element, 5>;
  static_assert(std::is_trivially_copyable_v<Elements>);
  static_assert(!std::is_same_v<Elements::Key, Key>, "keys of different element types do not mix");
  searvins::test::for_all_seeds(100, [](Rng& rng) {
    static Elements a, b;  // static storage: padding starts as zero on both sides
    a.clear();
    b.clear();
    std::vector<PoolKey<Element>> keys;
    for (int step = 0; step < 60; ++step) {
      if (searvins::test::chance(rng, 0.6)) {
        const Element e{searvins::test::uniform(rng, -1, 1), step};
        const auto in_a = a.insert(e), in_b = b.insert(e);
        CHECK(in_a.ok() == in_b.ok());
        if (in_a.ok()) CHECK(*in_a == *in_b);
        if (in_a.ok()) keys.push_back(*in_a);
      } else if (!keys.empty()) {
        const auto key = keys[static_cast<std::size_t>(integer(rng, 0, static_cast<int>(keys.size()) - 1))];
        CHECK(a.erase(key).ok() == b.erase(key).ok());
      }
    }
    CHECK(std::memcmp(&a, &b, sizeof a) == 0);
    Elements copy = a;
    a.clear();
    CHECK(copy.size() == b.size());
  });
}

TEST_CASE("Pool: usable at compile time") {
  constexpr int total = [] {
    Pool<int, 3> pool;
    const auto first = pool.insert(1);
    static_cast<void>(pool.insert(2));
    static_cast<void>(pool.insert(3));
    const bool refused = !pool.insert(4).ok();
    static_cast<void>(pool.erase(*first));
    static_cast<void>(pool.insert(40));
    int sum = 0;
    pool.for_each([&](PoolKey<int>, int& value) { sum += value; });
    return refused ? sum : -1;
  }();
  static_assert(total == 45);
  CHECK(total == 45);
}
