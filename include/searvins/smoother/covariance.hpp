// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Joint covariance of any variables of the window, from the undamped factor.
///
/// The covariance is a set of columns of H^-1. A column is one forward sweep from the front of its variable to the last front and one backward sweep
/// down to the earliest front that is asked for; for the newest state and the ambiguities of the present epoch both stay in the trailing front.
/// A local variable l (eliminated by Schur complement) enters through its own block:
///
///     x_c = S^-1 (b_c - H_cl H_ll^-1 b_l)        x_l = H_ll^-1 (b_l - H_lc x_c)
#pragma once

#include <algorithm>
#include <array>

#include <searvins/smoother/elimination.hpp>

namespace searvins::smoother {

/// See the file comment. Needs an elimination that is factored, without damping.
template <class EliminationType>
class Covariance {
 public:
  using TablesType = typename EliminationType::TablesType;
  using Scalar = typename EliminationType::Scalar;

  /// Fills the n x n joint covariance (column-major, leading dimension ld >= n, n = sum of the dofs) of the variables `ids` (global indices), in
  /// their order. The factorisation must be current and undamped. Returns n, or -1 when a variable carries no information (a local one without
  /// factors).
  int joint(const TablesType& tables, EliminationType& elimination, const int* ids, int count, Scalar* out, int ld) {
    int earliest = elimination.front_count() - 1;
    for (int k = 0; k < count; ++k) {
      const VariableInfo& info = tables.variable(ids[k]);
      if (info.role == Role::local && info.first_factor < 0) return -1;
      if (info.role != Role::local) earliest = std::min(earliest, info.front);
      if (info.role == Role::local) earliest = 0;
    }
    int column = 0;
    for (int k = 0; k < count; ++k)
      for (int axis = 0; axis < tables.variable(ids[k]).dof; ++axis, ++column) {
        solve_column(tables, elimination, ids[k], axis, earliest);
        int row = 0;
        for (int r = 0; r < count; ++r) row = read(tables, ids[r], ids[r] == ids[k] ? axis : -1, out + static_cast<std::ptrdiff_t>(column) * ld, row);
      }
    for (int j = 0; j < column; ++j)  // the two triangles agree to rounding; make them equal
      for (int i = 0; i < j; ++i) {
        Scalar &a = out[static_cast<std::ptrdiff_t>(j) * ld + i], &b = out[static_cast<std::ptrdiff_t>(i) * ld + j];
        a = b = (a + b) / 2;
      }
    return column;
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr int kLocalDof = EliminationType::kLocalDof;
  static int dof_of(const TablesType& tables, int local) { return std::min(tables.variable(local).dof, kLocalDof); }

  void solve_column(const TablesType& tables, EliminationType& elimination, int id, int axis, int earliest) {
    std::fill_n(stacked_.begin(), at(elimination.tangent_size()), Scalar(0));
    const VariableInfo& info = tables.variable(id);
    int from = info.front;
    if (info.role == Role::local) {
      factor_block(tables, id);
      std::array<Scalar, static_cast<std::size_t>(kLocalDof)> b{};
      b[at(axis)] = 1;
      solve_block(tables, id, b.data());
      apply(tables, id, b.data(), [this](int offset, Scalar value) { stacked_[at(offset)] -= value; });
    } else {
      stacked_[at(info.offset + axis)] = 1;
    }
    elimination.solve_stacked(tables, stacked_.data(), from, earliest);
  }

  /// Appends the rows of variable `id` to a column. `unit` is the axis of the right-hand side when it is this very (local) variable, else -1.
  int read(const TablesType& tables, int id, int unit, Scalar* column, int row) {
    const VariableInfo& info = tables.variable(id);
    if (info.role != Role::local) {
      for (int i = 0; i < info.dof; ++i) column[row++] = stacked_[at(info.offset + i)];
      return row;
    }
    factor_block(tables, id);
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> b{};
    if (unit >= 0) b[at(unit)] = 1;
    gather(tables, id, b.data());
    solve_block(tables, id, b.data());
    for (int i = 0; i < info.dof; ++i) column[row++] = b[at(i)];
    return row;
  }

  /// fn(chain column, local axis, value of H_cl) over all entries of a local variable's coupling.
  template <class Fn>
  void for_each_coupling(const TablesType& tables, int local, Fn fn) {
    for (int id = tables.variable(local).first_factor; id >= 0; id = tables.factor(id).next) {
      const FactorInfo& f = tables.factor(id);
      if (!tables.enabled(f)) continue;
      const Scalar* const w = tables.weights.data() + f.first_row;
      int local_column = 0, column = 0;
      for (int k = 0; k < f.keys; ++k) {
        const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
        if (v.role == Role::local) local_column = column;
        column += v.dof;
      }
      column = 0;
      for (int k = 0; k < f.keys; ++k) {
        const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
        for (int d = 0; d < v.dof; ++d, ++column)
          for (int a = 0; a < tables.variable(local).dof; ++a) {
            const Scalar *const J = tables.jacobian_column(f, column), *const Jl = tables.jacobian_column(f, local_column + a);
            Scalar sum = 0;
            for (int i = 0; i < f.rows; ++i) sum += J[i] * w[i] * Jl[i];
            fn(v.role == Role::local ? -1 - d : v.offset + d, a, sum);
          }
      }
    }
  }

  void factor_block(const TablesType& tables, int local) {
    H_.fill(0);
    for_each_coupling(tables, local, [this](int column, int a, Scalar value) {
      if (column < 0 && -1 - column >= a) H_[at(a * kLocalDof - 1 - column)] += value;
    });
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> reference{};
    const int dof = dof_of(tables, local);
    for (int i = 0; i < dof; ++i) reference[at(i)] = H_[at(i * kLocalDof + i)];
    (void)math::partial_cholesky(H_.data(), kLocalDof, dof, dof, reference.data(), math::ZeroPivot::skip);
  }
  void solve_block(const TablesType& tables, int local, Scalar* b) const {
    math::solve_lower(H_.data(), kLocalDof, dof_of(tables, local), b);
    math::solve_lower_transposed(H_.data(), kLocalDof, dof_of(tables, local), b);
  }
  /// out(offset, (H_cl b)_offset)
  template <class Out>
  void apply(const TablesType& tables, int local, const Scalar* b, Out out) {
    for_each_coupling(tables, local, [&](int column, int a, Scalar value) {
      if (column >= 0) out(column, value * b[a]);
    });
  }
  /// b -= H_lc x_c
  void gather(const TablesType& tables, int local, Scalar* b) {
    for_each_coupling(tables, local, [&](int column, int a, Scalar value) {
      if (column >= 0) b[a] -= value * stacked_[at(column)];
    });
  }

  std::array<Scalar, static_cast<std::size_t>(TablesType::sizes.tangent)> stacked_{};
  std::array<Scalar, static_cast<std::size_t>(kLocalDof) * kLocalDof> H_{};
};

}  // namespace searvins::smoother
