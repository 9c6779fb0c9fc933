// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Sums one factor into the normal equations of a front:  H += J' W J,  g += J' W e,  with its rows scaled by sqrt(w) first.
///
/// Columns of chain variables go to the front's matrix; those of the factor's local variable, if it has one, to the local elimination: H_ll, and
/// the coupling [H_lc g_l]. Two ways to the same sums:
///
///     small   up to 4 rows and 32 columns (a landmark seen, a position): dense, row by row, whole variables at a time
///     sparse  more (an epoch's measurements with their ambiguities): only where two columns have a row in common
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/smoother/front_matrix.hpp>
#include <searvins/smoother/local_elimination.hpp>
#include <searvins/smoother/tables.hpp>

namespace searvins::smoother {

/// See the file comment. Factors have at most MaxRows rows, MaxColumns columns with the residual, and MaxBlock scalars in both.
template <class TablesType, class Local, int MaxRows, int MaxColumns, int MaxBlock>
class FactorAssembly {
 public:
  using Scalar = typename TablesType::Scalar;
  using Matrix = FrontMatrix<Scalar>;

  /// `reference` sums the information of every axis of the front: J' W J's diagonal. `local` has been begun with the factor's local variable.
  void add(const TablesType& tables, const FactorInfo& f, const Matrix& front, Scalar* reference, Local& local) {
    const Target to{front, reference, local};
    if (!f.is_small()) return add_sparse(tables, f, to);
    switch (f.rows) {
      case 1: return add_small<1>(tables, f, to);
      case 2: return add_small<2>(tables, f, to);
      case 3: return add_small<3>(tables, f, to);
      default: return add_small<4>(tables, f, to);
    }
  }

 private:
  static constexpr int kSmallColumns = FactorInfo::kSmallColumns;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// One number a row.
  template <int R>
  using Coefficients = Eigen::Matrix<Scalar, R, 1>;

  struct Target {
    const Matrix& front;
    Scalar* reference;
    Local& local;
  };

  // ---- small ------------------------------------------------------------------------------------------------------------------------------

  /// Axes of one variable: columns [first, first + axes) of the packed rows, [target, ...) of the front.
  struct Block {
    int first, axes, target;
  };

  template <int R>
  void add_small(const TablesType& tables, const FactorInfo& f, const Target& to) {
    Block local{0, 0, 0};
    const int end = pack_rows<R>(tables, f, local), border = to.front.border();
    const Coefficients<R> residual = column_of<R>(end);
    for (int k = 0; k < block_count_; ++k) {
      const Block& b = blocks_[at(k)];
      if (b.axes == 6)
        add_block<R, 6>(b, 6, residual, to);
      else
        add_block<R, Eigen::Dynamic>(b, b.axes, residual, to);
      for (int l = 0; l < local.axes; ++l) add_combination<R>(to.local.coupling(l) + b.target, packed(b.first), column_of<R>(local.first + l), b.axes);
      if (local.axes > 0) to.local.touch(b.target, b.axes);
    }
    to.front(border, border) += dot<R>(residual, residual);
    if (local.axes == 0) return;
    to.local.touch(border, 1);
    for (int l = 0; l < local.axes; ++l) {
      const Coefficients<R> s = column_of<R>(local.first + l);
      to.local.coupling(l)[border] += dot<R>(s, residual);
      for (int m = l; m < local.axes; ++m) to.local.H(m, l) += dot<R>(s, column_of<R>(local.first + m));
    }
  }

  /// The columns of one chain variable: its own block, those of the variables below, its gradient. N: its axes, where the compiler knows them.
  template <int R, int N>
  void add_block(const Block& b, int axes, const Coefficients<R>& residual, const Target& to) {
    for (int c = 0; c < axes; ++c) {
      Scalar* const column = to.front.column(b.target + c);
      const Coefficients<R> s = column_of<R>(b.first + c);
      add_combination<R>(column + b.target, packed(b.first), s, N == Eigen::Dynamic ? axes : N);
      for (int k = 0; block_count_ > 1 && k < block_count_; ++k)
        if (const Block& a = blocks_[at(k)]; a.target > b.target) add_combination<R>(column + a.target, packed(a.first), s, a.axes);
      column[to.front.border()] += dot<R>(s, residual);
      to.reference[b.target + c] += dot<R>(s, s);
    }
  }

  /// sqrt(w) [J e] row by row, touched axes only; lists the chain variables in blocks_, the local one in `local`. Returns the residual's column.
  template <int R>
  int pack_rows(const TablesType& tables, const FactorInfo& f, Block& local) {
    Coefficients<R> root;
    for (int i = 0; i < R; ++i) root[i] = std::sqrt(tables.weights[at(f.first_row + i)]);
    block_count_ = 0;
    int end = 0;
    const Scalar* J = tables.jacobian_column(f, 0);
    for (int k = 0; k < f.keys; ++k) {
      const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
      const Block block{end, tables.axes_of(f)[k], v.position};
      for (int d = 0; d < block.axes; ++d)
        for (int i = 0; i < R; ++i) packed(end + d)[i * kStride] = J[d * R + i] * root[i];
      (v.role == Role::local ? local : blocks_[at(block_count_++)]) = block;
      end += block.axes;
      J += static_cast<std::ptrdiff_t>(v.dof) * R;
    }
    for (int i = 0; i < R; ++i) packed(end)[i * kStride] = tables.e_theta[at(f.first_row + i)] * root[i];
    return end;
  }

  [[nodiscard]] Scalar* packed(int column) { return packed_.data() + column; }
  /// A column of the packed rows.
  template <int R>
  [[nodiscard]] Coefficients<R> column_of(int c) const {
    Coefficients<R> s;
    for (int i = 0; i < R; ++i) s[i] = packed_[at(i * kStride + c)];
    return s;
  }
  template <int R>
  [[nodiscard]] static Scalar dot(const Coefficients<R>& a, const Coefficients<R>& b) {
    Scalar sum = a[0] * b[0];
    for (int i = 1; i < R; ++i) sum += a[i] * b[i];
    return sum;
  }

  /// out += s' rows, `count` columns. Those of a pose are a loop of their own, whose length the compiler knows.
  template <int R>
  static void add_combination(Scalar* out, const Scalar* rows, const Coefficients<R>& s, int count) {
    if (count == 6) {
      using Six = Eigen::Matrix<Scalar, 6, 1>;
      Six sum = Eigen::Map<const Six>(rows) * s[0];
      for (int r = 1; r < R; ++r) sum += Eigen::Map<const Six>(rows + r * kStride) * s[r];
      Eigen::Map<Six>{out} += sum;
      return;
    }
    for (int i = 0; i < count; ++i)
      for (int r = 0; r < R; ++r) out[i] += s[r] * rows[r * kStride + i];
  }

  // ---- sparse -----------------------------------------------------------------------------------------------------------------------------

  void add_sparse(const TablesType& tables, const FactorInfo& f, const Target& to) {
    scale_rows(tables, f, to.front.border());
    for (std::size_t x = 0; x < wide_.size(); ++x) {
      const int b = wide_[x];
      for (std::size_t y = x; y < wide_.size(); ++y) add_product(to, wide_[y], b);
      if (b < f.columns) to.reference[target_[at(b)]] += inner(b, b);
      const Scalar* const pb = scaled(b);
      for (int a : single_) {
        const int row = span_[at(a)].first;
        if (span_[at(b)].has(row)) to.front.symmetric(target_[at(a)], target_[at(b)]) += scaled(a)[row] * pb[row];
      }
    }
    add_singles(to);
    add_local_columns(to);
  }

  /// Scales the rows into `rows_`, column by column, the residual last, and sorts the columns by kind: of the local variable; with one row; the
  /// others and the residual.
  void scale_rows(const TablesType& tables, const FactorInfo& f, int border) {
    rows_ld_ = f.rows;
    for (int i = 0; i < f.rows; ++i) root_[at(i)] = std::sqrt(tables.weights[at(f.first_row + i)]);
    wide_.clear(), single_.clear(), local_.clear();
    int column = 0;
    for (int k = 0; k < f.keys; ++k) {
      const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
      for (int d = 0; d < v.dof; ++d, ++column) {
        const RowSpan span = span_[at(column)] = tables.span(f, column);
        target_[at(column)] = v.role == Role::local ? d : v.position + d;
        if (span.empty() || d >= tables.axes_of(f)[k]) continue;
        (void)(v.role == Role::local ? local_ : span.single() ? single_ : wide_).push_back(column);
        scale_column(tables.jacobian_column(f, column), span, column);
      }
    }
    span_[at(column)] = {0, static_cast<std::int16_t>(f.rows)};
    target_[at(column)] = border;
    (void)wide_.push_back(column);
    scale_column(tables.e_theta.data() + f.first_row, span_[at(column)], column);
  }
  void scale_column(const Scalar* from, RowSpan span, int column) {
    Scalar* const out = scaled(column);
    for (int i = span.first; i < span.end; ++i) out[i] = from[i] * root_[at(i)];
  }
  [[nodiscard]] Scalar* scaled(int column) { return rows_.data() + static_cast<std::ptrdiff_t>(column) * rows_ld_; }

  /// Inner product of two columns of `rows_`, over the rows where both are non-zero.
  [[nodiscard]] Scalar inner(int a, int b) {
    const Scalar *const pa = scaled(a), *const pb = scaled(b);
    const int end = std::min(span_[at(a)].end, span_[at(b)].end);
    Scalar s = 0;
    for (int i = std::max(span_[at(a)].first, span_[at(b)].first); i < end; ++i) s += pa[i] * pb[i];
    return s;
  }
  void add_product(const Target& to, int a, int b) { to.front.symmetric(target_[at(a)], target_[at(b)]) += inner(a, b); }

  /// Columns with one row meet where that is the same row.
  void add_singles(const Target& to) {
    for (int a : single_) {
      int& last = last_of_row_[at(span_[at(a)].first)];
      for (int b = last; b >= 0; b = previous_[at(b)]) add_product(to, a, b);
      add_product(to, a, a);
      to.reference[target_[at(a)]] += inner(a, a);
      previous_[at(a)] = last;
      last = a;
    }
    for (int a : single_) last_of_row_[at(span_[at(a)].first)] = -1;
  }

  /// H_ll and the coupling.
  void add_local_columns(const Target& to) {
    for (int l : local_) {
      const int axis = target_[at(l)];
      const auto couple = [&](int a) {
        to.local.touch(target_[at(a)], 1);
        to.local.coupling(axis)[target_[at(a)]] += inner(a, l);
      };
      for (int a : wide_) couple(a);
      for (int a : single_)
        if (span_[at(l)].has(span_[at(a)].first)) couple(a);
      for (int a : local_)
        if (target_[at(a)] >= axis) to.local.H(target_[at(a)], axis) += inner(a, l);
    }
  }

  static constexpr int kStride = kSmallColumns + 1;
  std::array<Scalar, at(4 * kStride)> packed_{};
  std::array<Block, at(kSmallColumns)> blocks_{};
  int block_count_{0};

  int rows_ld_{1};
  std::array<Scalar, at(MaxBlock)> rows_{};
  std::array<Scalar, at(MaxRows)> root_{};
  std::array<RowSpan, at(MaxColumns)> span_{};
  std::array<int, at(MaxColumns)> target_{};    ///< column of the front, or axis of the local variable
  std::array<int, at(MaxColumns)> previous_{};  ///< of the single columns: the one before with the same row
  std::array<int, at(MaxRows)> last_of_row_ = [] {
    std::array<int, at(MaxRows)> none{};
    none.fill(-1);
    return none;
  }();
  StaticVector<int, at(MaxColumns)> wide_{}, single_{}, local_{};  ///< columns of the factor at hand
};

}  // namespace searvins::smoother
