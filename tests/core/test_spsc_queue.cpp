// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/core/spsc_queue.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <thread>

#include "support/property.hpp"

using searvins::SpscQueue;
using namespace searvins::test;

namespace {

template <std::size_t N>
void queued_live_together(Rng& rng) {
  SpscQueue<int, N> queue;
  std::deque<int> model;
  CHECK(queue.capacity() == N);
  for (int step = 0; step < 600; ++step) {
    const double fills = (step / 50) % 2 == 0 ? 0.7 : 0.3;  // now nearly full, now nearly empty
    if (chance(rng, fills)) {
      const int value = integer(rng, -1000, 1000);
      const bool has_room = model.size() < N;
      if (chance(rng, 0.5)) {
        CHECK(queue.push(value) == has_room);
      } else {
        int* const slot = queue.back();
        REQUIRE((slot != nullptr) == has_room);
        if (slot) *slot = value;
        queue.publish();
      }
      if (has_room) model.push_back(value);
    } else if (chance(rng, 0.5)) {
      int value = 0;
      CHECK(queue.pop(value) == !model.empty());
      if (!model.empty()) {
        CHECK(value == model.front());
        model.pop_front();
      }
    } else {
      queue.pop();
      if (!model.empty()) model.pop_front();
    }
    REQUIRE(queue.size() == model.size());
    CHECK(queue.empty() == model.empty());
    const int* const oldest = queue.front();
    REQUIRE((oldest != nullptr) == !model.empty());
    if (oldest) CHECK(*oldest == model.front());
  }
}

/// Large enough to be torn if it were read while it is written.
struct Message {
  std::uint64_t number{0};
  std::uint64_t copies[30]{};
  std::uint64_t check{0};
};

std::uint64_t mixed(std::uint64_t x) { return (x ^ (x >> 13U)) * 0x9E3779B97F4A7C15ULL; }

}  // namespace

TEST_CASE("a queue of one thread: like a deque through random operations, with room for one, two, or many") {
  for_all_seeds(20, [](Rng& rng) {
    queued_live_together<1>(rng);
    queued_live_together<2>(rng);
    queued_live_together<7>(rng);
    queued_live_together<64>(rng);
  });
}

TEST_CASE("a queue between two threads: all messages arrive once, whole, in order") {
  constexpr std::uint64_t kMessages = 60000;
  const auto queue = std::make_unique<SpscQueue<Message, 5>>();
  std::uint64_t refused = 0;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kMessages; ++i) {
      Message* slot = nullptr;
      while (!(slot = queue->back())) ++refused, std::this_thread::yield();
      slot->number = i;
      for (std::uint64_t& copy : slot->copies) copy = i;
      slot->check = mixed(i);
      queue->publish();
    }
  });
  std::uint64_t expected = 1, broken = 0;
  while (expected <= kMessages) {
    const Message* const message = queue->front();
    if (!message) {
      std::this_thread::yield();
      continue;
    }
    broken += message->number != expected || message->check != mixed(expected);
    for (const std::uint64_t copy : message->copies) broken += copy != expected;
    queue->pop();
    ++expected;
  }
  writer.join();
  CHECK(broken == 0);
  CHECK(queue->empty());
  MESSAGE("the writer met a full queue " << refused << " times");
}
