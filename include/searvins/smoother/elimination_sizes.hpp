// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Capacities that the elimination needs for a Problem, known at compile time, and the outcome of a factorisation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <searvins/smoother/tables.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::smoother {

/// Why a factorisation stopped.
template <class Scalar>
struct EliminationFailure {
  enum class Kind : std::uint8_t { none, zero_pivot, non_finite, front_too_large, arena_full } kind{Kind::none};
  int variable{-1};  ///< global index
  int axis{-1};
  Scalar pivot{0};
  [[nodiscard]] bool ok() const { return kind == Kind::none; }
};

/// Capacities of the elimination.
struct EliminationSizes {
  int max_front;         ///< axes of E and S together
  int members;           ///< sum over fronts of eliminated + separator variables
  std::size_t arena;     ///< sum over fronts of (E+S+1) E + (S+1)^2 + S
  int local_dof;         ///< largest local variable
  int rows, columns;     ///< largest factor; columns with its residual
  int block;             ///< largest Jacobian with its residual column
};

/// Capacities that a Problem asks for.
template <class Problem>
[[nodiscard]] constexpr EliminationSizes elimination_sizes() {
  using F = detail::Largest<typename Problem::Factors>;
  return {Problem::max_front_dimension,
          Problem::member_capacity,
          Problem::arena_scalars,
          detail::Largest<typename Problem::Variables>::of([](auto* v) {
            return std::remove_pointer_t<decltype(v)>::role == Role::local ? std::remove_pointer_t<decltype(v)>::dof : 1;
          }),
          F::of([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_rows; }),
          F::of([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_columns + 1; }),
          F::of([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_rows * (std::remove_pointer_t<decltype(f)>::max_columns + 1); })};
}

}  // namespace searvins::smoother
