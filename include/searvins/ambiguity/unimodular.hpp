// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// An integer change of variables z = Z' x that keeps integers integer both ways, held as the list of its elementary steps.
///
/// Each step acts on at most three entries of a vector and is undone exactly:
///
///     forward   x_t <- x_t - m x_s,   then, if it exchanges,   x_t <-> x_{t+1}
///     backward  x_t <-> x_{t+1} if it exchanges,   then   x_t <- x_t + m x_s
///
/// Both have determinant +-1 and integer entries, so their product Z' and its inverse have too: unimodular by construction. The
/// matrices are never formed. A vector goes through in O(steps), of which a decorrelation of n ambiguities takes a few n; a row
/// of Z' likewise. The first factor of Z' is a permutation: entry i of the permuted vector is entry source[i] of the original.
///
/// Integer vectors are carried modulo 2^64: an intermediate value may wrap, a result that fits in 63 bits is exact all the same.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

namespace searvins::ambiguity {

/// From here on every Scalar is an integer: 2^52 for double.
template <class Scalar>
inline constexpr Scalar kExactIntegers = Scalar(std::uint64_t{1} << (std::numeric_limits<Scalar>::digits - 1));

/// A nearest integer, halves away from zero. By truncation: one instruction, where std::round is a call on many targets.
template <class Scalar>
[[nodiscard]] Scalar nearest_integer(Scalar x) {
  if (!(std::abs(x) < kExactIntegers<Scalar>)) return x;
  return static_cast<Scalar>(static_cast<std::int64_t>(x + (x < 0 ? Scalar(-0.5) : Scalar(0.5))));
}

/// Z' of up to MaxN variables and MaxSteps steps.
template <int MaxN, int MaxSteps>
class UnimodularTransform {
 public:
  /// Identity of n <= MaxN variables, no step.
  void reset(int n) {
    n_ = n;
    size_ = 0;
    for (int i = 0; i < n; ++i) source_[index(i)] = static_cast<std::int16_t>(i);
  }

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] int room() const { return MaxSteps - size_; }

  /// Original index of the variable that the permutation puts at place i.
  [[nodiscard]] int source(int i) const { return source_[index(i)]; }
  /// Exchanges places i and k of the permutation; only before the first step.
  void exchange_sources(int i, int k) { std::swap(source_[index(i)], source_[index(k)]); }

  /// x_target -= multiplier * x_source, then x_target <-> x_{target+1} if `exchange`. The caller sees to it that room() > 0.
  void append(int target, int source, std::int32_t multiplier, bool exchange) {
    steps_[index(size_++)] = {multiplier, static_cast<std::int16_t>(target), static_cast<std::int16_t>(exchange ? ~source : source)};
  }

  /// z = Z' x, x in original order.
  template <class T>
  void apply(const T* x, T* z) const {
    for (int i = 0; i < n_; ++i) z[i] = x[source(i)];
    for (int k = 0; k < size_; ++k) {
      const Step& s = steps_[index(k)];
      const bool exchange = s.exchange();
      const T reduced = minus_product(z[s.target], s.multiplier, z[s.source()]);
      if (exchange) z[s.target] = z[s.target + 1];
      z[s.target + exchange] = reduced;
    }
  }

  /// x = Z'^-1 z, x in original order; z is used up.
  template <class T>
  void apply_inverse(T* z, T* x) const {
    for (int k = size_ - 1; k >= 0; --k) {
      const Step& s = steps_[index(k)];
      const bool exchange = s.exchange();
      const T reduced = z[s.target + exchange];
      if (exchange) z[s.target + 1] = z[s.target];
      z[s.target] = minus_product(reduced, -s.multiplier, z[s.source()]);
    }
    for (int i = 0; i < n_; ++i) x[source(i)] = z[i];
  }

  /// Row k of Z': z_k = sum_i row[i] x_i, i in original order. The row vector e_k' passes the steps from the last to the first.
  void row(int k, std::int64_t* row_of_z) const {
    std::array<std::int64_t, std::size_t{MaxN}> r{};
    r[index(k)] = 1;
    for (int q = size_ - 1; q >= 0; --q) {
      const Step& s = steps_[index(q)];
      if (s.exchange()) std::swap(r[index(s.target)], r[index(s.target + 1)]);
      r[index(s.source())] = minus_product(r[index(s.source())], s.multiplier, r[index(s.target)]);
    }
    for (int i = 0; i < n_; ++i) row_of_z[source(i)] = r[index(i)];
  }

  /// a + b modulo 2^64.
  static std::int64_t wrapping_sum(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
  }

 private:
  /// Eight bytes: a source that is stored complemented says that the step exchanges.
  struct Step {
    std::int32_t multiplier;
    std::int16_t target, coded_source;
    [[nodiscard]] bool exchange() const { return coded_source < 0; }
    [[nodiscard]] int source() const { return exchange() ? ~coded_source : coded_source; }
  };

  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  template <class T>
  static T minus_product(T a, std::int32_t m, T b) {
    if constexpr (std::is_integral_v<T>)
      return static_cast<T>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(std::int64_t{m}) * static_cast<std::uint64_t>(b));
    else
      return a - static_cast<T>(m) * b;
  }

  int n_{0};
  int size_{0};
  std::array<std::int16_t, std::size_t{MaxN}> source_{};
  std::array<Step, std::size_t{MaxSteps}> steps_{};
};

}  // namespace searvins::ambiguity
