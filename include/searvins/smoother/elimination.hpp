// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The multifrontal elimination: assembly and factorisation of the normal equations, front by front in chronological order (front_tree.hpp).
///
/// The window minimises, with W = diag(w) held fixed (IRLS) and d the stacked tangent vector from theta,
///
///     1/2 d' H d + g' d + c,      H = sum J' W J (+ prior),   g = sum J' W e (+ prior)
///
/// A front's matrix, bordered with the gradient as a last row,
///
///     | H_EE  .     .  |      E: eliminated here
///     | H_SE  H_SS  .  |      S: separator
///     | g_E'  g_S'  c' |
///
/// is summed from the factors, the Schur products of its local variables and the update matrices of its children (the fronts whose separator begins
/// here), and partly factorised (math/block_cholesky.hpp). What stays in the trailing block is the front's update matrix: the marginal information
/// on S of all that was eliminated before, which is the marginal prior when the front's state leaves the window.
///
/// Fronts lie in one arena in order, so that refactoring from front f on reuses everything before it. Nothing here knows a type: tables in, tangent
/// vectors out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <searvins/math/block_cholesky.hpp>
#include <searvins/smoother/elimination_sizes.hpp>
#include <searvins/smoother/factor_assembly.hpp>
#include <searvins/smoother/front_matrix.hpp>
#include <searvins/smoother/front_tree.hpp>
#include <searvins/smoother/local_elimination.hpp>
#include <searvins/smoother/marginal_prior.hpp>
#include <searvins/smoother/symmetric_products.hpp>
#include <searvins/smoother/tables.hpp>

namespace searvins::smoother {

/// See the file comment.
template <class TablesT, EliminationSizes S>
class Elimination {
 public:
  using TablesType = TablesT;
  using Scalar = typename TablesType::Scalar;
  using Failure = EliminationFailure<Scalar>;
  using Prior = MarginalPrior<Scalar, S.max_front, TablesType::sizes.variables>;
  static constexpr int kMaxFront = S.max_front;
  static constexpr int kLocalDof = S.local_dof;

  /// Decides who is eliminated where, and marks fronts whose structure changed. False when an index capacity is exceeded.
  [[nodiscard]] bool analyse(TablesType& tables, const Prior& prior) { return tree_.analyse(tables, prior.variables); }

  [[nodiscard]] int front_count() const { return tree_.count(); }
  [[nodiscard]] const Front& front(int f) const { return tree_.front(f); }
  [[nodiscard]] int tangent_size() const { return tree_.tangent_size(); }
  [[nodiscard]] int member(int i) const { return tree_.member(i); }
  /// Leading axes of member i that are rows of its front.
  [[nodiscard]] int axes(int i) const { return tree_.axes(i); }
  [[nodiscard]] int first_dirty() const { return tree_.first_dirty(); }
  void mark_dirty_from(int f) { tree_.mark_dirty_from(f); }
  [[nodiscard]] const Scalar* factor_of(int f) const { return arena_.data() + front(f).storage; }
  [[nodiscard]] const Scalar* update_of(int f) const { return factor_of(f) + at(front(f).border() + 1) * at(front(f).rows_e); }
  [[nodiscard]] const Scalar* reference_of(int f) const { return update_of(f) + at(front(f).rows_s + 1) * at(front(f).rows_s + 1); }

  /// Factors every front that is not clean, in order, or front `only`. `prior` must have been evaluated at theta. `damping` is Marquardt's:
  /// damping * (information of the axis) is added to every diagonal and pulls towards the present estimate. On failure nothing but the fronts
  /// themselves has changed.
  [[nodiscard]] Failure factorise(TablesType& tables, const Prior& prior, Scalar damping, math::ZeroPivot policy, int only) {
    damping_ = damping;
    const int last = only < 0 ? tree_.count() : only + 1;
    for (int f = only < 0 ? 0 : only; f < last; ++f) {
      if (tree_.front(f).clean) continue;
      const Failure failure = factorise_front(tables, prior, f, damping, policy);
      if (!failure.ok()) {
        mark_dirty_from(f);
        return failure;
      }
      tree_.front(f).clean = true;
      if (f + 1 < tree_.count()) tree_.front(f + 1).clean = false;
    }
    return {};
  }

  /// Back-substitution: writes candidate_delta of every variable that a front eliminates or a factor ties to one.
  void solve(TablesType& tables) {
    for (int f = tree_.count() - 1; f >= 0; --f) {
      const Front& front = tree_.front(f);
      const Scalar* const L = factor_of(f);
      const int ld = front.border() + 1;
      Scalar* const x = step_.data() + front.offset;
      gather_separator(tables, front, step_.data());
      for (int j = 0; j < front.rows_e; ++j) x[j] = L[static_cast<std::ptrdiff_t>(j) * ld + front.border()];
      add_separator_products(front, L, x);
      for (int j = 0; j < front.rows_e; ++j) x[j] = -x[j];
      math::solve_lower_transposed(L, ld, front.rows_e, x);
    }
    for (int f = 0; f < tree_.count(); ++f) {
      const Front& front = tree_.front(f);
      for (int k = 0; k < front.eliminated; ++k) {
        const VariableInfo& v = tables.variable(member(front.first + k));
        std::copy_n(step_.data() + v.offset, v.dof, tables.candidate_delta.data() + v.tangent);
      }
      for (int l = front.first_local; l >= 0; l = tables.variable(l).next) solve_local(tables, l);
    }
  }

  /// x <- H^-1 b on the stacked chain axes for the undamped factor; b has support in E of front `from` and later. Entries of fronts before
  /// `down_to` are not computed. `b` is the stacked vector, overwritten with x.
  void solve_stacked(const TablesType& tables, Scalar* b, int from, int down_to) {
    for (int f = from; f < tree_.count(); ++f) {
      const Front& front = tree_.front(f);
      const Scalar* const L = factor_of(f);
      const int ld = front.border() + 1;
      Scalar* const y = b + front.offset;
      math::solve_lower(L, ld, front.rows_e, y);
      int row = front.rows_e;
      for (int k = front.eliminated; k < front.eliminated + front.separated; ++k) {
        const VariableInfo& info = tables.variable(member(front.first + k));
        for (int i = 0; i < axes(front.first + k); ++i, ++row) {
          Scalar s = 0;
          for (int j = 0; j < front.rows_e; ++j) s += L[static_cast<std::ptrdiff_t>(j) * ld + row] * y[j];
          b[info.offset + i] -= s;
        }
      }
    }
    for (int f = tree_.count() - 1; f >= down_to; --f) {
      const Front& front = tree_.front(f);
      const Scalar* const L = factor_of(f);
      const int ld = front.border() + 1;
      Scalar* const x = b + front.offset;
      gather_separator(tables, front, b);
      for (int j = 0; j < front.rows_e; ++j) {
        const Scalar* const column = L + static_cast<std::ptrdiff_t>(j) * ld;
        for (int i = 0; i < front.rows_s; ++i) x[j] -= column[front.rows_e + i] * separator_[at(i)];
      }
      math::solve_lower_transposed(L, ld, front.rows_e, x);
    }
  }

  /// Forgets front 0 after its state has left: the rest keeps its place and its numbers.
  void drop_first_front() {
    tree_.drop_first();
    const int n = tree_.count();
    if (n == 0) return;
    const std::size_t gap = tree_.front(0).storage;
    const Front& end = tree_.front(n - 1);
    if (end.clean) std::copy(factor_of(0), factor_of(n - 1) + end.size(), arena_.data());
    for (int f = 0; f < n; ++f) tree_.front(f).storage -= gap;
    if (!end.clean) mark_dirty_from(0);
  }

  /// Forgets every front.
  void clear() { tree_.clear(); }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  using Matrix = FrontMatrix<Scalar>;
  using Local = LocalElimination<Scalar, kLocalDof, kMaxFront>;
  /// What solve_local() needs of a local variable: H_ll = L L', and its diagonal before damping.
  struct LocalFactor {
    LocalMatrix<Scalar, kLocalDof> L{};
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> reference{};
  };

  [[nodiscard]] Failure factorise_front(TablesType& tables, const Prior& prior, int f, Scalar damping, math::ZeroPivot policy) {
    using Kind = typename Failure::Kind;
    Front& front = tree_.front(f);
    const int n = front.border();
    if (n > kMaxFront) return {Kind::front_too_large, tables.states[at(f)], n, 0};
    front.storage = f == 0 ? 0 : tree_.front(f - 1).storage + tree_.front(f - 1).size();
    if (front.storage + front.size() > arena_.size()) return {Kind::arena_full, tables.states[at(f)], n, 0};
    place(tables, front);
    const Matrix matrix(arena_.data() + front.storage, front.rows_e, front.rows_s);
    std::fill_n(reference_.begin(), at(n), Scalar(0));
    bool empty = true;
    for (int c = 0; c < f; ++c)
      if (tree_.front(c).parent == f) add_update(tables, matrix, c, empty), empty = false;
    if (empty) matrix.clear(0, n + 1);
    if (f == tree_.prior_front()) add_prior(tables, matrix, prior);
    for (int id = front.first_factor; id >= 0; id = tables.factor(id).next) add_factor(tables, matrix, tables.factor(id));
    for (int l = front.first_local; l >= 0; l = tables.variable(l).next) {
      const Failure failed = eliminate_local(tables, matrix, l, damping);
      if (failed.kind == Kind::non_finite || (!failed.ok() && policy == math::ZeroPivot::fail)) return failed;
    }
    if (damping > 0) damp(tables, front, matrix, damping);
    std::copy_n(reference_.begin() + front.rows_e, front.rows_s, arena_.data() + front.storage + front.size() - at(front.rows_s));
    const auto report = matrix.factorise(tile_, reference_.data(), policy);
    return report.ok() ? Failure{} : locate(tables, front, report);
  }

  /// Columns of the front's variables in its matrix.
  void place(TablesType& tables, const Front& front) {
    int column = 0;
    for (int k = 0; k < front.eliminated + front.separated; ++k) {
      tables.variable(member(front.first + k)).position = column;
      column += axes(front.first + k);
    }
  }

  /// Sums the update matrix of a child, or begins an empty front with it. Its rows stand here in the same order for the most part: by runs.
  void add_update(const TablesType& tables, const Matrix& matrix, int child_index, bool empty) {
    const Front& child = tree_.front(child_index);
    const int m = child.rows_s, runs = find_runs(tables, matrix, child);
    const Scalar *const reference = reference_of(child_index), *const U = update_of(child_index);
    for (int r = 0; r < runs; ++r)
      for (int i = 0; i < child_runs_[at(r)].count; ++i) reference_[at(parent_first_[at(r)] + i)] += reference[child_runs_[at(r)].first + i];
    child_runs_[at(runs)] = {m, 1}, parent_first_[at(runs)] = matrix.border();
    if (empty && std::is_sorted(parent_first_.begin(), parent_first_.begin() + runs)) return matrix.assign(U, m + 1, child_runs_.data(), parent_first_.data(), runs + 1);
    if (empty) matrix.clear(0, matrix.border() + 1);
    matrix.add(U, m + 1, child_runs_.data(), parent_first_.data(), runs + 1);
  }

  /// Runs of a child's separator that are neighbours in this front too, without its border: child_runs_ there, parent_first_ here.
  int find_runs(const TablesType& tables, const Matrix& matrix, const Front& child) {
    int runs = 0, row = 0;
    for (int k = child.first + child.eliminated; k < child.first + child.eliminated + child.separated; row += axes(k++)) {
      const int to = tables.variable(member(k)).position;
      if (runs > 0 && to == parent_first_[at(runs - 1)] + child_runs_[at(runs - 1)].count && to != matrix.rows_e()) {
        child_runs_[at(runs - 1)].count += axes(k);
      } else {
        child_runs_[at(runs)] = {row, axes(k)};
        parent_first_[at(runs++)] = to;
      }
    }
    return runs;
  }

  void add_prior(const TablesType& tables, const Matrix& matrix, const Prior& prior) {
    for (int id : prior.variables) {
      const VariableInfo& info = tables.variable(id);
      for (int i = 0; i < info.prior_axes; ++i) {
        map_[at(info.prior + i)] = info.position + i;
        reference_[at(info.position + i)] += prior.reference[at(info.prior + i)];
      }
    }
    const int border = matrix.border();
    Scalar corner = 2 * prior.c;
    for (int j = 0; j < prior.dimension; ++j) {
      for (int i = j; i < prior.dimension; ++i) matrix.symmetric(map_[at(i)], map_[at(j)]) += prior.h(i, j);
      matrix(border, map_[at(j)]) += prior.g[at(j)] + prior.Hd[at(j)];
      corner += prior.d[at(j)] * (2 * prior.g[at(j)] + prior.Hd[at(j)]);
    }
    matrix(border, border) += corner;
  }

  void add_factor(const TablesType& tables, const Matrix& matrix, const FactorInfo& f) {
    if (tables.enabled(f)) assembly_.add(tables, f, matrix, reference_.data(), local_);
  }

  /// Adds the factors of one local variable and takes its Schur product off. Damped like the chain variables.
  [[nodiscard]] Failure eliminate_local(TablesType& tables, const Matrix& matrix, int local, Scalar damping) {
    const VariableInfo& v = tables.variable(local);
    const int dof = std::min(v.dof, kLocalDof);  // the bound lets the compiler see that loops stay in the block
    local_.begin(matrix.rows_e());
    for (int id = v.first_factor; id >= 0; id = tables.factor(id).next) add_factor(tables, matrix, tables.factor(id));
    auto& reference = local_factors_[at(local)].reference;
    for (int i = 0; i < dof; ++i) {
      reference[at(i)] = local_.H(i, i);
      const Scalar extra = damping * reference[at(i)];
      local_.H(i, i) += extra;
      local_.coupling(i)[matrix.border()] -= extra * tables.delta[at(v.tangent + i)];
    }
    const auto report = local_.eliminate(dof, reference.data(), matrix);
    local_factors_[at(local)].L = local_.H;
    if (!report.ok()) return {Failure::Kind::non_finite, local, report.failed, report.value};
    for (int i = 0; i < dof && report.skipped > 0; ++i)
      if (!(local_.H(i, i) > 0)) return {Failure::Kind::zero_pivot, local, i, 0};
    return {};
  }

  /// Levenberg-Marquardt: (damping * D) with D the information of each axis, centred on the present estimate (delta), not on theta.
  void damp(const TablesType& tables, const Front& front, const Matrix& matrix, Scalar damping) {
    for (int k = 0; k < front.eliminated; ++k) {
      const VariableInfo& v = tables.variable(member(front.first + k));
      for (int i = 0; i < v.dof; ++i) {
        const int column = v.position + i;
        const Scalar extra = damping * reference_[at(column)];
        matrix(column, column) += extra;
        matrix(matrix.border(), column) -= extra * tables.delta[at(v.tangent + i)];
      }
    }
  }

  [[nodiscard]] Failure locate(const TablesType& tables, const Front& front, const math::PivotReport<Scalar>& report) const {
    using Kind = typename Failure::Kind;
    for (int k = 0; k < front.eliminated; ++k) {
      const int id = member(front.first + k);
      const VariableInfo& info = tables.variable(id);
      if (report.failed >= info.position && report.failed < info.position + info.dof)
        return {report.non_finite ? Kind::non_finite : Kind::zero_pivot, id, report.failed - info.position, report.value};
    }
    return {Kind::non_finite, -1, -1, report.value};
  }

  /// x += L_SE' separator, four columns at a time: their sums do not wait for each other.
  void add_separator_products(const Front& front, const Scalar* L, Scalar* x) const {
    const int ld = front.border() + 1;
    int j = 0;
    for (; j + 4 <= front.rows_e; j += 4) {
      const Scalar *const c0 = L + static_cast<std::ptrdiff_t>(j) * ld + front.rows_e, *const c1 = c0 + ld, *const c2 = c1 + ld, *const c3 = c2 + ld;
      Scalar s0 = x[j], s1 = x[j + 1], s2 = x[j + 2], s3 = x[j + 3];
      for (int i = 0; i < front.rows_s; ++i) {
        const Scalar s = separator_[at(i)];
        s0 += c0[i] * s, s1 += c1[i] * s, s2 += c2[i] * s, s3 += c3[i] * s;
      }
      x[j] = s0, x[j + 1] = s1, x[j + 2] = s2, x[j + 3] = s3;
    }
    for (; j < front.rows_e; ++j) {
      const Scalar* const c = L + static_cast<std::ptrdiff_t>(j) * ld + front.rows_e;
      for (int i = 0; i < front.rows_s; ++i) x[j] += c[i] * separator_[at(i)];
    }
  }

  void gather_separator(const TablesType& tables, const Front& front, const Scalar* stacked) {
    int row = 0;
    for (int k = front.eliminated; k < front.eliminated + front.separated; ++k) {
      const VariableInfo& info = tables.variable(member(front.first + k));
      for (int i = 0; i < axes(front.first + k); ++i) separator_[at(row++)] = stacked[info.offset + i];
    }
  }

  /// Local variable given the chain step:  H_ll d_l = -(g_l + H_lc d_c) = -sum J_l' W (e + J_c d_c), damped as the fronts are.
  void solve_local(TablesType& tables, int local) {
    const VariableInfo& v = tables.variable(local);
    const int dof = std::min(v.dof, kLocalDof);
    std::array<Scalar, at(kLocalDof)> x{};
    for (int id = v.first_factor; id >= 0; id = tables.factor(id).next)
      if (tables.enabled(tables.factor(id))) add_given_step(tables, tables.factor(id), dof, x.data());
    for (int i = 0; i < dof; ++i) x[at(i)] += damping_ * local_factors_[at(local)].reference[at(i)] * tables.delta[at(v.tangent + i)];
    local_factors_[at(local)].L.solve(dof, x.data());
    std::copy_n(x.data(), dof, tables.candidate_delta.data() + v.tangent);
  }

  /// x -= J_l' W (e + J_c d_c) for one factor of a local variable.
  void add_given_step(const TablesType& tables, const FactorInfo& f, int dof, Scalar* x) {
    if constexpr (S.rows >= 3)
      if (f.rows == 3) return add_given_step(tables, f, std::integral_constant<int, 3>{}, dof, x);
    add_given_step(tables, f, f.rows, dof, x);
  }
  /// `Rows` is an int, or a constant where the compiler is to know it (a landmark's rows).
  template <class Rows>
  void add_given_step(const TablesType& tables, const FactorInfo& f, Rows rows, int dof, Scalar* x) {
    std::array<Scalar, at(S.rows)> t;
    std::copy_n(tables.e_theta.data() + f.first_row, rows, t.data());
    const Scalar *J = tables.jacobian_column(f, 0), *local = J;
    for (int k = 0; k < f.keys; ++k) {
      const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
      if (v.role == Role::local) local = J;
      const Scalar* const step = step_.data() + v.offset;
      for (int d = 0; v.role != Role::local && d < tables.axes_of(f)[k]; ++d)
        for (int i = 0; i < rows; ++i) t[at(i)] += J[d * rows + i] * step[d];
      J += v.dof * rows;
    }
    for (int i = 0; i < rows; ++i) t[at(i)] *= tables.weights[at(f.first_row + i)];
    for (int a = 0; a < dof; ++a)
      for (int i = 0; i < rows; ++i) x[a] -= local[a * rows + i] * t[at(i)];
  }

  FrontTree<TablesType, S.members> tree_{};
  Scalar damping_{0};  ///< of the last factorisation
  std::array<Scalar, S.arena> arena_{};
  std::array<Scalar, at(kMaxFront + 1)> reference_{}, separator_{};
  std::array<int, at(kMaxFront + 1)> map_{}, parent_first_{};
  std::array<Run, at(kMaxFront + 1)> child_runs_{};
  std::array<Scalar, at(TablesType::sizes.tangent)> step_{};
  std::array<LocalFactor, at(TablesType::sizes.variables)> local_factors_{};  ///< by global index
  ColumnTile<Scalar, kMaxFront> tile_{};
  Local local_{};
  FactorAssembly<TablesType, Local, S.rows, S.columns, S.block> assembly_{};
};

}  // namespace searvins::smoother
