// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the smoother estimates: the Variable concept, typed keys, and lists of types with capacities.
///
/// A variable is a value on a manifold with a tangent space of `dof` dimensions:
///
///     x.retract(d)  =  x (+) d        a value near x
///     x.local(y)    =  y (-) x        the tangent d with x (+) d = y
///
/// and a role in the elimination:
///
///     state   opens a front: states are chronological, the oldest leaves first (navigation state, position-velocity-acceleration)
///     chain   eliminated in the front of the last state that a common factor ties it to (ambiguity, anchor, clock)
///     local   eliminated first, on its own small block, by Schur complement (landmark, pivot error); at most one in a factor
#pragma once

#include <Eigen/Core>

#include <concepts>
#include <cstdint>
#include <type_traits>

namespace searvins::smoother {

/// See the file comment.
enum class Role : std::uint8_t { state, chain, local };

/// Tangent vector of a variable.
template <class V>
using Tangent = Eigen::Matrix<typename V::Scalar, V::dof, 1>;

/// A manifold value that the smoother can estimate. Members:
///   Scalar, dof, role, name (text for messages), axis_name(i), retract(d), local(y),
///   linearisation_scale(): per tangent axis, how far a factor's linear model stays good (its own units); it scales the convergence test too.
template <class V>
concept Variable = std::default_initializable<V> && requires(const V& x, const Tangent<V>& d) {
  typename V::Scalar;
  requires(V::dof > 0);
  { V::role } -> std::convertible_to<Role>;
  { V::name } -> std::convertible_to<const char*>;
  { V::axis_name(0) } -> std::convertible_to<const char*>;
  { x.retract(d) } -> std::same_as<V>;
  { x.local(x) } -> std::convertible_to<Tangent<V>>;
  { V::linearisation_scale() } -> std::convertible_to<Tangent<V>>;
};

/// Names one living variable of type V. A default key names nothing; a key outlives its variable harmlessly (the generation differs).
template <class V>
struct Key {
  std::uint32_t slot{0};
  std::uint32_t generation{0};  ///< 0: no variable
  [[nodiscard]] constexpr bool valid() const { return generation != 0; }
  friend constexpr bool operator==(const Key&, const Key&) = default;
};

/// A key whose type is known by its index in Problem::Variables.
struct AnyKey {
  std::int32_t type{-1};
  std::uint32_t slot{0};
  std::uint32_t generation{0};
  friend constexpr bool operator==(const AnyKey&, const AnyKey&) = default;
};

/// A type and how many of it may live at once.
template <class T, int N>
struct Capacity {
  static_assert(N > 0, "a capacity is at least one");
  using type = T;
  static constexpr int value = N;
};

/// A list of Capacity<T, N>.
template <class... C>
struct Types {
  static constexpr int size = static_cast<int>(sizeof...(C));
  static constexpr int total = (0 + ... + C::value);

  /// Position of T in the list, -1 when it is not there.
  template <class T>
  static constexpr int index_of() {
    int i = 0, found = -1;
    ((std::is_same_v<T, typename C::type> && found < 0 ? found = i : 0, ++i), ...);
    return found;
  }

  /// Sum of the capacities before type i: the first global index of that type.
  static constexpr int offset_of(int i) {
    int k = 0, sum = 0;
    ((k++ < i ? sum += C::value : 0), ...);
    return sum;
  }
};

namespace detail {
template <class A, class B>
struct JoinedTypes;
template <class... A, class... B>
struct JoinedTypes<Types<A...>, Types<B...>> {
  using type = Types<A..., B...>;
};
}  // namespace detail

/// Two lists one after the other.
template <class A, class B>
using Joined = typename detail::JoinedTypes<A, B>::type;

}  // namespace searvins::smoother
