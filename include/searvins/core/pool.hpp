// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A pool of at most N elements that are named by keys which notice when their element is gone.
///
/// A key is a slot number and the generation of that slot. Each slot counts up once when it is filled and once when it is emptied:
///
///     generation even   slot is free          (0: never used, so the default key, generation 0, names nothing)
///     generation odd    slot holds an element
///
/// A key is valid while its generation equals the slot's and is odd; so a key that was kept too long is refused, not served the
/// slot's next tenant. The count wraps after 2^31 tenants of one slot: only a key kept that long (248 days, were one slot refilled
/// a hundred times a second) could be mistaken.
///
/// Order. Emptied slots are refilled last-out-first-in; when none is left, the lowest slot never used since `clear()` is taken. This
/// depends on the sequence of calls alone, so reruns are bit-identical. Iteration is by ascending slot, not by age.
///
/// Cost. `insert`, `erase`, `get` are O(1); iteration is O(largest number of elements since `clear()`). Elements never move.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include <searvins/core/status.hpp>

namespace searvins {

/// Names an element of a Pool<T, N>. The type T keeps keys of different pools apart; the default key names nothing.
template <class T>
struct PoolKey {
  std::uint32_t slot{0};
  std::uint32_t generation{0};

  friend constexpr bool operator==(PoolKey, PoolKey) = default;
  friend constexpr auto operator<=>(PoolKey, PoolKey) = default;  ///< by slot, then generation: an order to sort by, without meaning
};

/// Up to N values of T in place, T default constructible and copyable. Trivially copyable when T is. Free slots hold T{}.
template <class T, std::size_t N>
class Pool {
  static_assert(N >= 1 && N < std::numeric_limits<std::int32_t>::max(), "a Pool needs 1 <= N < 2^31 slots");

 public:
  using value_type = T;
  using Key = PoolKey<T>;

  [[nodiscard]] static constexpr std::size_t capacity() { return N; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr bool full() const { return size_ == N; }

  /// Stores a copy and returns its key. Errors: capacity_exceeded (nothing was changed; detail = N).
  constexpr Result<Key> insert(const T& value) {
    if (full()) return failure(StatusCode::capacity_exceeded, "the Pool is full: erase or raise N", -1, static_cast<std::int32_t>(N));
    const std::uint32_t slot = free_head_ != kNone ? free_head_ : used_;
    values_[slot] = value;  // before any bookkeeping: `value` may be an element of this pool
    if (slot == free_head_)
      free_head_ = next_free_[slot];
    else
      ++used_;
    ++generation_[slot];
    ++size_;
    return Key{slot, generation_[slot]};
  }

  /// Removes an element; its key and every copy of it become invalid. Errors: unknown_key (nothing was changed; index = slot).
  constexpr Status erase(Key key) {
    if (!contains(key))
      return failure(StatusCode::unknown_key, "the key names no living element of this Pool", static_cast<std::int32_t>(key.slot));
    release(key.slot);
    next_free_[key.slot] = free_head_;
    free_head_ = key.slot;
    return ok_status();
  }

  /// Removes every element and forgets the order of free slots, as in a new pool; keys given out so far stay invalid for good.
  constexpr void clear() {
    for (std::uint32_t slot = 0; slot < used_; ++slot)
      if (alive(slot)) release(slot);
    free_head_ = kNone;
    used_ = 0;
  }

  [[nodiscard]] constexpr bool contains(Key key) const { return alive(key.slot) && generation_[key.slot] == key.generation; }

  /// The element of a key, nullptr when the key is stale or was never given out. Valid until that element is erased.
  [[nodiscard]] constexpr T* get(Key key) { return contains(key) ? &values_[key.slot] : nullptr; }
  [[nodiscard]] constexpr const T* get(Key key) const { return contains(key) ? &values_[key.slot] : nullptr; }

  /// The element that lives in a slot now, nullptr when the slot is free or out of range.
  [[nodiscard]] constexpr T* at_slot(std::size_t slot) { return alive(slot) ? &values_[slot] : nullptr; }
  [[nodiscard]] constexpr const T* at_slot(std::size_t slot) const { return alive(slot) ? &values_[slot] : nullptr; }

  /// The key of the element that lives in a slot now, the default key when the slot is free or out of range.
  [[nodiscard]] constexpr Key key_of_slot(std::size_t slot) const {
    return alive(slot) ? Key{static_cast<std::uint32_t>(slot), generation_[slot]} : Key{};
  }

  /// One past the highest slot that can be alive: a bound for loops over `at_slot`.
  [[nodiscard]] constexpr std::size_t slot_end() const { return used_; }

  /// Calls visit(key, element) for every element by ascending slot. The visit may erase any element; one that it inserts is visited
  /// if its slot is still ahead.
  template <class Visit>
  constexpr void for_each(Visit visit) {
    for (std::size_t slot = 0; slot < used_; ++slot)
      if (alive(slot)) visit(key_of_slot(slot), values_[slot]);
  }
  template <class Visit>
  constexpr void for_each(Visit visit) const {
    for (std::size_t slot = 0; slot < used_; ++slot)
      if (alive(slot)) visit(key_of_slot(slot), values_[slot]);
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  [[nodiscard]] constexpr bool alive(std::size_t slot) const { return slot < N && generation_[slot] % 2 == 1; }

  constexpr void release(std::uint32_t slot) {
    values_[slot] = T{};
    ++generation_[slot];
    --size_;
  }

  std::array<T, N> values_{};
  std::array<std::uint32_t, N> generation_{};
  std::array<std::uint32_t, N> next_free_{};  ///< meaningful for free slots below used_
  std::uint32_t free_head_{kNone};            ///< the slot emptied last, kNone when every slot below used_ is alive
  std::uint32_t used_{0};                     ///< slots [used_, N) have not been filled since clear()
  std::uint32_t size_{0};
};

}  // namespace searvins
