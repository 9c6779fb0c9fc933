// SPDX-License-Identifier: BSD-3-Clause
// Model-based: a RingBuffer and a std::deque live through the same random operations and look the same after each.
#include <searvins/core/ring_buffer.hpp>

#include <deque>
#include <string>

#include "support/property.hpp"

using searvins::RingBuffer;
using namespace searvins::test;

namespace {

template <std::size_t N>
void live_together(Rng& rng) {
  RingBuffer<int, N> ring;
  std::deque<int> model;
  CHECK(ring.capacity() == N);
  for (int step = 0; step < 400; ++step) {
    const double draw = uniform(rng, 0, 1), fills = (step / 50) % 2 == 0 ? 0.7 : 0.3;  // now nearly full, now nearly empty
    if (draw < 0.01) {
      ring.clear(), model.clear();
    } else if (draw < fills) {
      const int value = integer(rng, -1000, 1000);
      const bool has_room = model.size() < N;
      CHECK(ring.push(value) == has_room);
      if (has_room) model.push_back(value);
    } else {
      ring.pop();
      if (!model.empty()) model.pop_front();
    }
    REQUIRE(ring.size() == model.size());
    CHECK(ring.empty() == model.empty());
    CHECK(ring.full() == (model.size() == N));
    for (std::size_t i = 0; i < model.size(); ++i) CHECK(ring[i] == model[i]);
    if (model.empty()) continue;
    CHECK(ring.front() == model.front());
    CHECK(ring.back() == model.back());
  }
}

}  // namespace

TEST_CASE("a ring buffer is a queue: like a deque through random operations, with room for one, two, or many") {
  for_all_seeds(20, [](Rng& rng) {
    live_together<1>(rng);
    live_together<2>(rng);
    live_together<7>(rng);
    live_together<64>(rng);
  });
}

TEST_CASE("a full ring buffer refuses and keeps what it has; an empty one has nothing to drop") {
  RingBuffer<std::string, 3> ring;
  ring.pop();
  CHECK(ring.empty());
  for (const char* text : {"a", "b", "c"}) CHECK(ring.push(text));
  CHECK_FALSE(ring.push("d"));
  CHECK(ring.front() == "a");
  CHECK(ring.back() == "c");
  ring.pop();
  CHECK(ring.push("d"));
  CHECK(ring[0] + ring[1] + ring[2] == "bcd");
}

TEST_CASE("a ring buffer works at compile time") {
  constexpr int sum = [] {
    RingBuffer<int, 2> ring;
    (void)ring.push(1), (void)ring.push(2);
    ring.pop();
    (void)ring.push(4);
    return ring.front() + ring.back();
  }();
  static_assert(sum == 6);
  CHECK(sum == 6);
}
