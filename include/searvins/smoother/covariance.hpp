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

template <class Problem>
class Covariance {
 public:
  using Scalar = typename Problem::Scalar;
  using WindowType = Window<Problem>;
  using EliminationType = Elimination<Problem>;

  /// Fills the n x n joint covariance (column-major, leading dimension ld >= n, n = sum of the dofs) of the variables `ids` (global indices), in
  /// their order. The factorisation must be current and undamped. Returns n, or -1 when a variable carries no information (a local one without
  /// factors).
  int joint(WindowType& window, EliminationType& elimination, const int* ids, int count, Scalar* out, int ld) {
    int earliest = elimination.front_count() - 1;
    for (int k = 0; k < count; ++k) {
      const VariableInfo& info = window.info(ids[k]);
      if (info.role == Role::local && info.first_factor < 0) return -1;
      if (info.role != Role::local) earliest = std::min(earliest, info.front);
      if (info.role == Role::local) earliest = 0;
    }
    int column = 0;
    for (int k = 0; k < count; ++k)
      for (int axis = 0; axis < window.info(ids[k]).dof; ++axis, ++column) {
        solve_column(window, elimination, ids[k], axis, earliest);
        int row = 0;
        for (int r = 0; r < count; ++r) row = read(window, ids[r], ids[r] == ids[k] ? axis : -1, out + static_cast<std::ptrdiff_t>(column) * ld, row);
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
  static constexpr int kLocalDof = static_cast<int>(std::tuple_size_v<decltype(EliminationType::LocalBlock::g)>);

  void solve_column(WindowType& window, EliminationType& elimination, int id, int axis, int earliest) {
    std::fill_n(stacked_.begin(), at(elimination.tangent_size()), Scalar(0));
    const VariableInfo& info = window.info(id);
    int from = info.front;
    if (info.role == Role::local) {
      factor_block(window, id);
      std::array<Scalar, static_cast<std::size_t>(kLocalDof)> b{};
      b[at(axis)] = 1;
      solve_block(window, id, b.data());
      apply(window, id, b.data(), [this](int offset, Scalar value) { stacked_[at(offset)] -= value; });
    } else {
      stacked_[at(info.offset + axis)] = 1;
    }
    elimination.solve_stacked(window, stacked_.data(), from, earliest);
  }

  /// Appends the rows of variable `id` to a column. `unit` is the axis of the right-hand side when it is this very (local) variable, else -1.
  int read(WindowType& window, int id, int unit, Scalar* column, int row) {
    const VariableInfo& info = window.info(id);
    if (info.role != Role::local) {
      for (int i = 0; i < info.dof; ++i) column[row++] = stacked_[at(info.offset + i)];
      return row;
    }
    factor_block(window, id);
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> b{};
    if (unit >= 0) b[at(unit)] = 1;
    gather(window, id, b.data());
    solve_block(window, id, b.data());
    for (int i = 0; i < info.dof; ++i) column[row++] = b[at(i)];
    return row;
  }

  /// fn(chain column, local axis, value of H_cl) over all entries of a local variable's coupling.
  template <class Fn>
  void for_each_coupling(WindowType& window, int local, Fn fn) {
    for (int id = window.info(local).first_factor; id >= 0;)
      window.visit_factor(id, [&]<class F>(FactorRecord<F>& r) {
        id = r.next;
        if (!window.template enabled<F>()) return;
        int local_column = 0, column = 0;
        for (int k = 0; k < r.keys; ++k) {
          if (window.info(r.variables[at(k)]).role == Role::local) local_column = column;
          column += window.info(r.variables[at(k)]).dof;
        }
        column = 0;
        for (int k = 0; k < r.keys; ++k) {
          const VariableInfo& info = window.info(r.variables[at(k)]);
          for (int d = 0; d < info.dof; ++d, ++column)
            for (int a = 0; a < window.info(local).dof; ++a) {
              Scalar sum = 0;
              for (int i = 0; i < r.rows; ++i)
                sum += r.jacobian[at(column * F::max_rows + i)] * r.weights[at(i)] * r.jacobian[at((local_column + a) * F::max_rows + i)];
              fn(info, info.role == Role::local ? -1 - d : info.offset + d, a, sum);
            }
        }
      });
  }

  void factor_block(WindowType& window, int local) {
    H_.fill(0);
    for_each_coupling(window, local, [this](const VariableInfo&, int column, int a, Scalar value) {
      if (column < 0 && -1 - column >= a) H_[at(a * kLocalDof - 1 - column)] += value;
    });
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> reference{};
    const int dof = window.info(local).dof;
    for (int i = 0; i < dof; ++i) reference[at(i)] = H_[at(i * kLocalDof + i)];
    (void)math::partial_cholesky(H_.data(), kLocalDof, dof, dof, reference.data(), math::ZeroPivot::skip);
  }
  void solve_block(const WindowType& window, int local, Scalar* b) const {
    math::solve_lower(H_.data(), kLocalDof, window.info(local).dof, b);
    math::solve_lower_transposed(H_.data(), kLocalDof, window.info(local).dof, b);
  }
  /// out(offset, (H_cl b)_offset)
  template <class Out>
  void apply(WindowType& window, int local, const Scalar* b, Out out) {
    for_each_coupling(window, local, [&](const VariableInfo&, int column, int a, Scalar value) {
      if (column >= 0) out(column, value * b[a]);
    });
  }
  /// b -= H_lc x_c
  void gather(WindowType& window, int local, Scalar* b) {
    for_each_coupling(window, local, [&](const VariableInfo&, int column, int a, Scalar value) {
      if (column >= 0) b[a] -= value * stacked_[at(column)];
    });
  }

  std::array<Scalar, static_cast<std::size_t>(WindowType::kTangentCapacity)> stacked_{};
  std::array<Scalar, static_cast<std::size_t>(kLocalDof) * kLocalDof> H_{};
};

}  // namespace searvins::smoother
