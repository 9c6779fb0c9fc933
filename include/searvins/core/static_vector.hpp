// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A vector of at most N elements that lives where it is declared. Overflow is an ordinary outcome: `push_back` says false.
#pragma once

#include <array>
#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

namespace searvins {

/// Up to N values of T in place; T is made by default without fail. Elements past size() are default values, so a copied vector of the same
/// content is the same bytes whatever its history (bit-identical reruns). Order of push_back is kept; iteration is by pointer.
template <class T, std::size_t N>
class StaticVector {
 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  [[nodiscard]] static constexpr std::size_t capacity() { return N; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  [[nodiscard]] constexpr bool full() const { return size_ == N; }

  /// Appends; false (and no change) when full.
  constexpr bool push_back(const T& value) {
    if (size_ == N) return false;
    data_[size_++] = value;
    return true;
  }

  /// Appends a default value and returns its address, nullptr when full.
  [[nodiscard]] constexpr T* append() {
    if (size_ == N) return nullptr;
    return &data_[size_++];
  }

  constexpr void pop_back() {
    if (size_ > 0) renew(--size_);
  }
  constexpr void clear() { resize(0); }

  /// New size, at most N: elements that appear or vanish are set to T{}. False (and no change) when n > N.
  constexpr bool resize(std::size_t n) {
    if (n > N) return false;
    for (std::size_t i = n; i < size_; ++i) renew(i);
    size_ = n;
    return true;
  }

  /// Removes element i and keeps the order of the rest.
  constexpr void erase(std::size_t i) {
    if (i >= size_) return;
    for (std::size_t k = i + 1; k < size_; ++k) data_[k - 1] = std::move(data_[k]);
    pop_back();
  }

  /// Removes every element for which `gone` holds, keeps the order of the rest, returns how many went.
  template <class Predicate>
  constexpr std::size_t erase_if(Predicate gone) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i)
      if (!gone(data_[i])) {
        if (kept != i) data_[kept] = std::move(data_[i]);
        ++kept;
      }
    const std::size_t removed = size_ - kept;
    resize(kept);
    return removed;
  }

  /// Inserts before position i (i <= size()); false when full.
  constexpr bool insert(std::size_t i, const T& value) {
    if (size_ == N || i > size_) return false;
    T copy = value;  // `value` may be an element of this vector that is about to move
    for (std::size_t k = size_; k > i; --k) data_[k] = std::move(data_[k - 1]);
    data_[i] = std::move(copy);
    ++size_;
    return true;
  }

  [[nodiscard]] constexpr T& operator[](std::size_t i) { return data_[i]; }
  [[nodiscard]] constexpr const T& operator[](std::size_t i) const { return data_[i]; }
  [[nodiscard]] constexpr T& front() { return data_[0]; }
  [[nodiscard]] constexpr const T& front() const { return data_[0]; }
  [[nodiscard]] constexpr T& back() { return data_[size_ - 1]; }
  [[nodiscard]] constexpr const T& back() const { return data_[size_ - 1]; }
  [[nodiscard]] constexpr T* data() { return data_.data(); }
  [[nodiscard]] constexpr const T* data() const { return data_.data(); }
  [[nodiscard]] constexpr iterator begin() { return data_.data(); }
  [[nodiscard]] constexpr iterator end() { return data_.data() + size_; }
  [[nodiscard]] constexpr const_iterator begin() const { return data_.data(); }
  [[nodiscard]] constexpr const_iterator end() const { return data_.data() + size_; }

 private:
  /// Element i as a default value, made in place: an epoch of observations is 25 kB, too much for a temporary on a small stack.
  constexpr void renew(std::size_t i) {
    if (std::is_constant_evaluated()) {
      data_[i] = T{};
    } else {
      data_[i].~T();
      ::new (static_cast<void*>(&data_[i])) T{};
    }
  }

  std::array<T, N> data_{};
  std::size_t size_{0};
};

}  // namespace searvins
