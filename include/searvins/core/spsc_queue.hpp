// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A bounded queue between two threads, one that writes and one that reads, without a lock and without the heap.
///
/// A ring of N + 1 slots, one of which is always empty, so that equal indices mean empty and nothing else. Each index is written by one
/// thread alone; the other reads it with acquire after it was stored with release, and so sees the content of every slot that the index
/// says is there [Lamport, "Specifying concurrent program modules", TOPLAS 1983]. The two indices lie in different cache lines.
///
/// Writer and reader may be the same thread, or an interrupt and the main loop. Two writers, or two readers, are not allowed.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <utility>

namespace searvins {

/// Up to N values of T on the way; see the file comment. Overflow is an ordinary outcome: push says false and changes nothing.
template <class T, std::size_t N>
class SpscQueue {
  static_assert(N > 0, "a queue has room for one");
  static_assert(std::atomic<std::size_t>::is_always_lock_free, "an index must be written in one piece");

 public:
  SpscQueue() = default;
  SpscQueue(const SpscQueue&) = delete;
  SpscQueue& operator=(const SpscQueue&) = delete;

  [[nodiscard]] static constexpr std::size_t capacity() { return N; }

  /// Writer: appends a copy; false when full.
  [[nodiscard]] bool push(const T& value) {
    T* const slot = back();
    if (!slot) return false;
    *slot = value;
    publish();
    return true;
  }

  /// Writer: the slot that the next publish() hands over, to be filled in place (it holds an old value); nullptr when full.
  [[nodiscard]] T* back() {
    const std::size_t write = write_.load(std::memory_order_relaxed);
    return after(write) == read_.load(std::memory_order_acquire) ? nullptr : &slots_[write];
  }

  /// Writer: hands over the slot that back() gave. Without room it does nothing.
  void publish() {
    const std::size_t write = write_.load(std::memory_order_relaxed), next = after(write);
    if (next != read_.load(std::memory_order_acquire)) write_.store(next, std::memory_order_release);
  }

  /// Reader: the oldest value, nullptr when empty. It stays until pop().
  [[nodiscard]] T* front() {
    const std::size_t read = read_.load(std::memory_order_relaxed);
    return read == write_.load(std::memory_order_acquire) ? nullptr : &slots_[read];
  }

  /// Reader: gives the slot of the oldest value back; nothing when empty.
  void pop() {
    const std::size_t read = read_.load(std::memory_order_relaxed);
    if (read != write_.load(std::memory_order_acquire)) read_.store(after(read), std::memory_order_release);
  }

  /// Reader: moves the oldest value out; false when empty.
  [[nodiscard]] bool pop(T& value) {
    T* const oldest = front();
    if (!oldest) return false;
    value = std::move(*oldest);
    pop();
    return true;
  }

  /// Values on the way, as of a moment ago: the writer may see too many, the reader too few.
  [[nodiscard]] std::size_t size() const {
    const std::size_t read = read_.load(std::memory_order_acquire), write = write_.load(std::memory_order_acquire);
    return write >= read ? write - read : write + N + 1 - read;
  }
  [[nodiscard]] bool empty() const { return size() == 0; }

 private:
  static constexpr std::size_t kCacheLine = 64;

  [[nodiscard]] static constexpr std::size_t after(std::size_t i) { return i == N ? 0 : i + 1; }

  alignas(kCacheLine) std::atomic<std::size_t> write_{0};
  alignas(kCacheLine) std::atomic<std::size_t> read_{0};
  alignas(kCacheLine) std::array<T, N + 1> slots_{};
};

}  // namespace searvins
