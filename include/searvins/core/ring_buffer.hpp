// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A queue of at most N elements that lives where it is declared: what came first leaves first.
#pragma once

#include <array>
#include <cstddef>

namespace searvins {

/// First in, first out. Overflow is an ordinary outcome: push says false.
template <class T, std::size_t N>
class RingBuffer {
  static_assert(N > 0, "a queue has room for one");

 public:
  [[nodiscard]] static constexpr std::size_t capacity() { return N; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr bool full() const { return size_ == N; }

  /// Appends; false (and no change) when full.
  constexpr bool push(const T& value) {
    if (full()) return false;
    data_[(first_ + size_) % N] = value;
    ++size_;
    return true;
  }
  /// Drops the oldest; nothing when empty.
  constexpr void pop() {
    if (empty()) return;
    first_ = (first_ + 1) % N;
    --size_;
  }
  constexpr void clear() { first_ = size_ = 0; }

  /// The oldest and the newest; the queue must not be empty.
  [[nodiscard]] constexpr const T& front() const { return data_[first_]; }
  [[nodiscard]] constexpr const T& back() const { return data_[(first_ + size_ - 1) % N]; }
  /// Element i from the oldest on, i < size().
  [[nodiscard]] constexpr const T& operator[](std::size_t i) const { return data_[(first_ + i) % N]; }

 private:
  std::array<T, N> data_{};
  std::size_t first_{0}, size_{0};
};

}  // namespace searvins
