// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Everything about variables and factors that does not depend on their type: structure, tangent vectors, rows, weights and Jacobians, in flat tables.
///
/// Global indices: variables of all types are numbered type by type (offset of the type + slot), factors likewise. Every slot has its place in the
/// number tables, fixed at compile time by the type's sizes:
///
///     tangent of a variable       dof scalars from VariableInfo::tangent
///     keys of a factor            max_keys indices from FactorInfo::first_key
///     rows of a factor            max_rows scalars from FactorInfo::first_row
///     spans of a factor           max_columns row spans from FactorInfo::first_column
///     Jacobian of a factor        rows x columns, column-major, leading dimension `rows`, from FactorInfo::first_jacobian
///
/// Nothing is a pointer, so the whole can be copied as bytes. Elimination and covariance work on these tables alone: they are compiled once for all
/// problems of equal sizes, and no type is visited where numbers are all that matters.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/time.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::smoother {

/// What the elimination knows of a variable, whatever its type.
struct VariableInfo {
  bool alive{false};
  bool relinearised{false};  ///< theta moved since the fronts were last factored
  Role role{Role::chain};
  int type{-1}, dof{0};
  std::uint32_t slot{0}, generation{0};
  GpsTime stamp{};
  int tangent{0};        ///< first element in the tangent tables
  int degree{0};         ///< factors that touch it
  int front{-1};         ///< front that eliminates it
  int position{-1};      ///< column in the front under assembly; while fronts are listed, its place in the members
  int offset{-1};        ///< first element in the stacked step vector
  int prior{-1};         ///< first row in the marginal prior, -1: not in it
  int prior_axes{0};     ///< leading axes that the marginal prior knows
  int first_factor{-1};  ///< of a local variable: its factors
  int next{-1};          ///< next variable of the same front's list
};

/// What the elimination knows of a factor, whatever its type.
struct FactorInfo {
  bool linearised{false};  ///< e_theta and jacobian are those at theta
  bool evaluated{false};   ///< e, weights_now and cost are those at the estimate
  int type{-1};            ///< -1: no factor
  int keys{0}, columns{0}, rows{0};
  int first_key{0}, first_row{0}, first_column{0}, first_jacobian{0};  ///< places in the tables
  int front{-1}, next{-1};                            ///< set by the symbolic analysis: front, next factor of the same list

  /// Few rows and columns: summed as a dense block, for which the spans of its columns are not wanted.
  [[nodiscard]] bool is_small() const { return rows <= kSmallRows && columns <= kSmallColumns; }
  static constexpr int kSmallRows = 4, kSmallColumns = 32;
};

/// Rows [first, end) of a Jacobian column, outside of which it is zero: a row sees few of its batch's ambiguities.
struct RowSpan {
  std::int16_t first{0}, end{0};
  [[nodiscard]] bool empty() const { return first >= end; }
  [[nodiscard]] bool single() const { return end - first == 1; }
  [[nodiscard]] bool has(int row) const { return first <= row && row < end; }
};

namespace detail {
template <class List>
struct Largest;
template <class... C>
struct Largest<Types<C...>> {
  template <class Get>
  static constexpr int of(Get get) {
    int best = 0;
    ((get(static_cast<typename C::type*>(nullptr)) > best ? best = get(static_cast<typename C::type*>(nullptr)) : 0), ...);
    return best;
  }
  template <class Get>
  static constexpr int sum(Get get) {
    return (0 + ... + (C::value * get(static_cast<typename C::type*>(nullptr))));
  }
};
}  // namespace detail

/// Capacities of the tables.
struct TableSizes {
  int variables, factors, factor_types, states;
  int tangent;   ///< longest stacked tangent vector
  int keys, rows, columns, jacobian;  ///< of all factors together
};

/// Capacities that the type lists of a Problem ask for.
template <class Problem>
[[nodiscard]] constexpr TableSizes table_sizes() {
  using V = detail::Largest<typename Problem::Variables>;
  using F = detail::Largest<typename Problem::Factors>;
  return {Problem::Variables::total,
          Problem::Factors::total,
          Problem::Factors::size,
          V::sum([](auto* v) { return std::remove_pointer_t<decltype(v)>::role == Role::state ? 1 : 0; }),
          V::sum([](auto* v) { return std::remove_pointer_t<decltype(v)>::dof; }),
          F::sum([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_keys; }),
          F::sum([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_rows; }),
          F::sum([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_columns; }),
          F::sum([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_rows * std::remove_pointer_t<decltype(f)>::max_columns; })};
}

/// Up to N global indices in ascending order.
template <int N>
class IndexSet {
 public:
  void insert(int id) {
    int* const place = std::lower_bound(data_.data(), data_.data() + size_, id);
    std::copy_backward(place, data_.data() + size_, data_.data() + size_ + 1);
    *place = id;
    ++size_;
  }
  /// Removes, in one pass in ascending order, what `gone` holds for; returns how many.
  template <class Predicate>
  int erase_if(Predicate gone) {
    const int before = size_;
    size_ = static_cast<int>(std::remove_if(data_.data(), data_.data() + size_, gone) - data_.data());
    return before - size_;
  }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] int operator[](int i) const { return data_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const int* begin() const { return data_.data(); }
  [[nodiscard]] const int* end() const { return data_.data() + size_; }

 private:
  std::array<int, static_cast<std::size_t>(N)> data_{};
  int size_{0};
};

/// See the file comment.
template <class ScalarType, TableSizes S>
struct Tables {
  using Scalar = ScalarType;
  static constexpr TableSizes sizes = S;
  template <class T, int N>
  using Array = std::array<T, static_cast<std::size_t>(N)>;

  [[nodiscard]] static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  [[nodiscard]] VariableInfo& variable(int id) { return variable_info[at(id)]; }
  [[nodiscard]] const VariableInfo& variable(int id) const { return variable_info[at(id)]; }
  [[nodiscard]] FactorInfo& factor(int id) { return factor_info[at(id)]; }
  [[nodiscard]] const FactorInfo& factor(int id) const { return factor_info[at(id)]; }
  [[nodiscard]] bool enabled(const FactorInfo& f) const { return type_enabled[at(f.type)]; }

  /// Global indices of a factor's variables, f.keys of them, in the order of for_each_key.
  [[nodiscard]] const int* variables_of(const FactorInfo& f) const { return keys.data() + f.first_key; }
  /// How many leading axes of each of them the factor touches.
  [[nodiscard]] const int* axes_of(const FactorInfo& f) const { return axes.data() + f.first_key; }
  /// Column c of a factor's Jacobian, f.rows scalars.
  [[nodiscard]] const Scalar* jacobian_column(const FactorInfo& f, int c) const {
    return jacobian.data() + f.first_jacobian + static_cast<std::ptrdiff_t>(c) * f.rows;
  }
  [[nodiscard]] const RowSpan& span(const FactorInfo& f, int c) const { return spans[at(f.first_column + c)]; }
  /// Finds the spans of a factor's Jacobian.
  void find_spans(const FactorInfo& f) {
    for (int c = 0; c < f.columns; ++c) {
      const Scalar* const J = jacobian_column(f, c);
      int first = 0, end = f.rows;
      while (first < end && J[first] == 0) ++first;
      while (end > first && J[end - 1] == 0) --end;
      spans[at(f.first_column + c)] = {static_cast<std::int16_t>(first), static_cast<std::int16_t>(end)};
    }
  }
  /// A factor's local variable, -1: none.
  [[nodiscard]] int local_of(const FactorInfo& f) const {
    for (int k = 0; k < f.keys; ++k)
      if (variable(variables_of(f)[k]).role == Role::local) return variables_of(f)[k];
    return -1;
  }

  Array<VariableInfo, S.variables> variable_info{};
  Array<FactorInfo, S.factors> factor_info{};
  IndexSet<S.variables> living_variables{};
  IndexSet<S.factors> living_factors{};
  StaticVector<int, static_cast<std::size_t>(S.states)> states{};  ///< in chronological order

  Array<Scalar, S.tangent> delta{}, candidate_delta{}, saved_delta{};  ///< x, candidate and what a failed update returns to, (-) theta
  Array<Scalar, S.tangent> scale{};                                    ///< linearisation_scale()
  Array<Scalar, S.rows> e_theta{}, weights{};  ///< rows at theta, weights that the stored fronts contain
  Array<Scalar, S.rows> e{}, weights_now{};    ///< rows and weights at the last evaluated point
  Array<Scalar, S.factors> cost{};             ///< rho(e)
  Array<Scalar, S.jacobian> jacobian{};        ///< at theta
  Array<RowSpan, S.columns> spans{};           ///< of the Jacobian's columns
  Array<int, S.keys> keys{}, axes{};           ///< of all factors: variables, and how many of their leading axes each touches
  Array<bool, S.factor_types> type_enabled = [] {
    Array<bool, S.factor_types> all{};
    all.fill(true);
    return all;
  }();
};

}  // namespace searvins::smoother
