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

#include <searvins/core/static_vector.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/smoother/front_tree.hpp>
#include <searvins/smoother/marginal_prior.hpp>
#include <searvins/smoother/tables.hpp>

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

  /// Schur-eliminated block of one local variable: gradient and H_ll (lower).
  struct LocalBlock {
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> g{};
    std::array<Scalar, static_cast<std::size_t>(kLocalDof) * kLocalDof> H{};
  };

  [[nodiscard]] Scalar& work(int row, int column) { return work_[at(column) * at(ld_) + at(row)]; }

  [[nodiscard]] Failure factorise_front(TablesType& tables, const Prior& prior, int f, Scalar damping, math::ZeroPivot policy) {
    using Kind = typename Failure::Kind;
    Front& front = tree_.front(f);
    const int n = front.border();
    if (n > kMaxFront) return {Kind::front_too_large, tables.states[at(f)], n, 0};
    front.storage = f == 0 ? 0 : tree_.front(f - 1).storage + tree_.front(f - 1).size();
    if (front.storage + front.size() > arena_.size()) return {Kind::arena_full, tables.states[at(f)], n, 0};
    place(tables, front);
    for (int j = 0; j < ld_; ++j) std::fill_n(&work(j, j), ld_ - j, Scalar(0));  // only the lower triangle is used
    std::fill_n(reference_.begin(), at(n), Scalar(0));
    for (int c = 0; c < f; ++c)
      if (tree_.front(c).parent == f) add_update(tables, c);
    if (f == tree_.prior_front()) add_prior(tables, prior);
    for (int id = front.first_factor; id >= 0; id = tables.factor(id).next) add_factor(tables, tables.factor(id));
    for (int l = front.first_local; l >= 0; l = tables.variable(l).next) {
      const Failure failed = add_local(tables, l, damping);
      if (failed.kind == Kind::non_finite || (!failed.ok() && policy == math::ZeroPivot::fail)) return failed;
    }
    if (damping > 0) damp(tables, front, damping);
    const auto report = math::partial_cholesky(work_.data(), ld_, n + 1, front.rows_e, reference_.data(), policy);
    if (!report.ok()) return locate(tables, front, report);
    keep(front);
    return {};
  }

  /// Columns of the front's variables in the work matrix.
  void place(TablesType& tables, const Front& front) {
    int column = 0;
    for (int k = 0; k < front.eliminated + front.separated; ++k) {
      VariableInfo& info = tables.variable(member(front.first + k));
      info.position = column;
      column += axes(front.first + k);
    }
    ld_ = column + 1;
  }

  void add_update(TablesType& tables, int child_index) {
    const Front& child = tree_.front(child_index);
    const Scalar* const U = update_of(child_index);
    const Scalar* const reference = reference_of(child_index);
    const int m = child.rows_s;
    int row = 0;
    for (int k = child.eliminated; k < child.eliminated + child.separated; ++k) {
      const VariableInfo& info = tables.variable(member(child.first + k));
      for (int i = 0; i < axes(child.first + k); ++i, ++row) {
        map_[at(row)] = info.position + i;
        reference_[at(info.position + i)] += reference[row];
      }
    }
    map_[at(m)] = ld_ - 1;
    for (int j = 0; j <= m; ++j)
      for (int i = j; i <= m; ++i) add_symmetric(map_[at(i)], map_[at(j)], U[static_cast<std::ptrdiff_t>(j) * (m + 1) + i]);
  }

  void add_symmetric(int a, int b, Scalar value) { a >= b ? work(a, b) += value : work(b, a) += value; }

  void add_prior(TablesType& tables, const Prior& prior) {
    for (int id : prior.variables) {
      const VariableInfo& info = tables.variable(id);
      for (int i = 0; i < info.prior_axes; ++i) {
        map_[at(info.prior + i)] = info.position + i;
        reference_[at(info.position + i)] += prior.reference[at(info.prior + i)];
      }
    }
    Scalar corner = 2 * prior.c;
    for (int j = 0; j < prior.dimension; ++j) {
      for (int i = j; i < prior.dimension; ++i) add_symmetric(map_[at(i)], map_[at(j)], prior.h(i, j));
      work(ld_ - 1, map_[at(j)]) += prior.g[at(j)] + prior.Hd[at(j)];
      corner += prior.d[at(j)] * (2 * prior.g[at(j)] + prior.Hd[at(j)]);
    }
    work(ld_ - 1, ld_ - 1) += corner;
  }

  /// Scales the rows of a factor by sqrt(w) into `rows_`, column by column, the residual last, and sorts the columns by kind: of the local variable;
  /// with one row; the others and the residual.
  void scale_rows(const TablesType& tables, const FactorInfo& f) {
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
    target_[at(column)] = ld_ - 1;
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
  void add_product(int a, int b) { add_symmetric(target_[at(a)], target_[at(b)], inner(a, b)); }

  /// H += J'WJ, g += J'We on the chain columns.
  void add_factor(const TablesType& tables, const FactorInfo& f) {
    if (!tables.enabled(f)) return;
    scale_rows(tables, f);
    for (std::size_t x = 0; x < wide_.size(); ++x) {
      const int b = wide_[x];
      for (std::size_t y = x; y < wide_.size(); ++y) add_product(wide_[y], b);
      if (b < f.columns) reference_[at(target_[at(b)])] += inner(b, b);
      const Scalar* const pb = scaled(b);
      for (int a : single_) {
        const int row = span_[at(a)].first;
        if (span_[at(b)].has(row)) add_symmetric(target_[at(a)], target_[at(b)], scaled(a)[row] * pb[row]);
      }
    }
    add_singles();
  }

  /// Columns with one row meet where that is the same row.
  void add_singles() {
    for (int a : single_) {
      int& last = last_of_row_[at(span_[at(a)].first)];
      for (int b = last; b >= 0; b = previous_[at(b)]) add_product(a, b);
      add_product(a, a);
      reference_[at(target_[at(a)])] += inner(a, a);
      previous_[at(a)] = last;
      last = a;
    }
    for (int a : single_) last_of_row_[at(span_[at(a)].first)] = -1;
  }

  /// Adds the factors of one local variable and subtracts its Schur product  B' H_ll^-1 B,  B = [H_lc g_l].  Damped like the chain variables.
  [[nodiscard]] Failure add_local(TablesType& tables, int local, Scalar damping) {
    const int dof = std::min(tables.variable(local).dof, kLocalDof);  // the bound lets the compiler see that loops stay in the block
    block_ = LocalBlock{};
    touched_ = 0;
    for (int id = tables.variable(local).first_factor; id >= 0; id = tables.factor(id).next) add_local_factor(tables, tables.factor(id));
    for (int i = 0; i < dof; ++i) block_.g[at(i)] = block_.H[at(i * kLocalDof + i)];
    if (damping > 0) {
      Scalar* const gradient = touch(ld_ - 1);
      const Scalar* const delta = tables.delta.data() + tables.variable(local).tangent;
      for (int i = 0; i < dof; ++i) {
        const Scalar extra = damping * block_.g[at(i)];
        block_.H[at(i * kLocalDof + i)] += extra;
        gradient[i] -= extra * delta[i];
      }
    }
    const auto report = math::partial_cholesky(block_.H.data(), kLocalDof, dof, dof, block_.g.data(), math::ZeroPivot::skip);
    Failure failed;
    if (!report.ok()) failed = {Failure::Kind::non_finite, local, report.failed, report.value};
    if (report.ok() && report.skipped > 0)
      for (int i = dof - 1; i >= 0; --i)
        if (!(block_.H[at(i * kLocalDof + i)] > 0)) failed = {Failure::Kind::zero_pivot, local, i, 0};
    subtract_schur(dof);
    return failed;
  }

  /// A factor of a local variable: its chain columns to the front, H_ll and the coupling to the block.
  void add_local_factor(const TablesType& tables, const FactorInfo& f) {
    if (!tables.enabled(f)) return;
    add_factor(tables, f);
    for (int l : local_) {
      const int axis = target_[at(l)];
      for (int a : wide_) touch(target_[at(a)])[axis] += inner(a, l);
      for (int a : single_)
        if (span_[at(l)].has(span_[at(a)].first)) touch(target_[at(a)])[axis] += inner(a, l);
      for (int a : local_)
        if (target_[at(a)] >= axis) block_.H[at(axis * kLocalDof + target_[at(a)])] += inner(a, l);
    }
  }

  void subtract_schur(int dof) {
    std::sort(touched_columns_.begin(), touched_columns_.begin() + touched_);
    for (int t = 0; t < touched_; ++t) {  // packed, so that the product below runs over neighbours
      Scalar* const row = local_row(touched_columns_[at(t)]);
      math::solve_lower(block_.H.data(), kLocalDof, dof, row);
      std::copy_n(row, kLocalDof, packed_.data() + static_cast<std::ptrdiff_t>(t) * kLocalDof);
      std::fill_n(row, kLocalDof, Scalar(0));
      is_touched_[at(touched_columns_[at(t)])] = false;
    }
    for (int s = 0; s < touched_; ++s) {
      Scalar* const column = &work(0, touched_columns_[at(s)]);
      const Scalar* const b = packed_.data() + static_cast<std::ptrdiff_t>(s) * kLocalDof;
      for (int t = s; t < touched_; ++t) {
        const Scalar* const a = packed_.data() + static_cast<std::ptrdiff_t>(t) * kLocalDof;
        Scalar sum = 0;
        for (int i = 0; i < kLocalDof; ++i) sum += a[i] * b[i];  // zero beyond dof
        column[touched_columns_[at(t)]] -= sum;
      }
    }
  }

  [[nodiscard]] Scalar* local_row(int column) { return local_rows_.data() + static_cast<std::ptrdiff_t>(column) * kLocalDof; }
  [[nodiscard]] Scalar* touch(int column) {
    if (!is_touched_[at(column)]) is_touched_[at(column)] = true, touched_columns_[at(touched_++)] = column;
    return local_row(column);
  }

  /// Levenberg-Marquardt: (damping * D) with D the information of each axis, centred on the present estimate (delta), not on theta.
  void damp(const TablesType& tables, const Front& front, Scalar damping) {
    for (int k = 0; k < front.eliminated; ++k) {
      const VariableInfo& v = tables.variable(member(front.first + k));
      for (int i = 0; i < v.dof; ++i) {
        const int column = v.position + i;
        const Scalar extra = damping * reference_[at(column)];
        work(column, column) += extra;
        work(ld_ - 1, column) -= extra * tables.delta[at(v.tangent + i)];
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

  /// Copies the factor columns, the update matrix and its reference from the work matrix to the arena: lower triangles, nothing reads the rest.
  void keep(const Front& front) {
    Scalar* out = arena_.data() + front.storage;
    const int n = front.border() + 1;
    for (int j = 0; j < front.rows_e; ++j, out += n) std::copy_n(&work(j, j), n - j, out + j);
    for (int j = front.rows_e; j < n; ++j, out += front.rows_s + 1) std::copy_n(&work(j, j), n - j, out + (j - front.rows_e));
    std::copy_n(reference_.begin() + front.rows_e, front.rows_s, out);
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
    LocalBlock block;
    for (int id = v.first_factor; id >= 0; id = tables.factor(id).next)
      if (tables.enabled(tables.factor(id))) add_given_step(tables, tables.factor(id), dof, block);
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> reference{};
    for (int i = 0; i < dof; ++i) {
      reference[at(i)] = block.H[at(i * kLocalDof + i)];
      const Scalar extra = damping_ * reference[at(i)];
      block.H[at(i * kLocalDof + i)] += extra;
      block.g[at(i)] += extra * tables.delta[at(v.tangent + i)];
    }
    (void)math::partial_cholesky(block.H.data(), kLocalDof, dof, dof, reference.data(), math::ZeroPivot::skip);
    math::solve_lower(block.H.data(), kLocalDof, dof, block.g.data());
    math::solve_lower_transposed(block.H.data(), kLocalDof, dof, block.g.data());
    std::copy_n(block.g.data(), dof, tables.candidate_delta.data() + v.tangent);
  }

  /// H += J_l' W J_l, g -= J_l' W (e + J_c d_c) for one factor of a local variable.
  void add_given_step(const TablesType& tables, const FactorInfo& f, int dof, LocalBlock& block) {
    const Scalar *const e = tables.e_theta.data() + f.first_row, *const w = tables.weights.data() + f.first_row;
    Scalar* const t = root_.data();
    std::copy_n(e, f.rows, t);
    int column = 0, local_column = 0;
    for (int k = 0; k < f.keys; ++k) {
      const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
      if (v.role == Role::local) local_column = column;
      for (int d = 0; d < v.dof; ++d, ++column) {
        if (v.role == Role::local) continue;
        const Scalar* const J = tables.jacobian_column(f, column);
        const RowSpan span = tables.span(f, column);
        const Scalar step = step_[at(v.offset + d)];
        for (int i = span.first; i < span.end; ++i) t[i] += J[i] * step;
      }
    }
    for (int a = 0; a < dof; ++a) {
      const Scalar* const Ja = tables.jacobian_column(f, local_column + a);
      for (int i = 0; i < f.rows; ++i) block.g[at(a)] -= Ja[i] * w[i] * t[i];
      for (int b = 0; b <= a; ++b) {
        const Scalar* const Jb = tables.jacobian_column(f, local_column + b);
        for (int i = 0; i < f.rows; ++i) block.H[at(b * kLocalDof + a)] += Ja[i] * w[i] * Jb[i];
      }
    }
  }

  FrontTree<TablesType, S.members> tree_{};
  int ld_{1}, rows_ld_{1}, touched_{0};
  Scalar damping_{0};  ///< of the last factorisation
  std::array<Scalar, S.arena> arena_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxFront + 1) * (kMaxFront + 1)> work_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxFront + 1)> reference_{}, separator_{};
  std::array<int, static_cast<std::size_t>(kMaxFront + 1)> map_{}, touched_columns_{};
  std::array<bool, static_cast<std::size_t>(kMaxFront + 1)> is_touched_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxFront + 1) * kLocalDof> local_rows_{}, packed_{};
  std::array<Scalar, static_cast<std::size_t>(S.block)> rows_{};
  std::array<Scalar, static_cast<std::size_t>(S.rows)> root_{};
  std::array<RowSpan, static_cast<std::size_t>(S.columns)> span_{};
  std::array<int, static_cast<std::size_t>(S.columns)> target_{};    ///< column of the front, or axis of the local variable
  std::array<int, static_cast<std::size_t>(S.columns)> previous_{};  ///< of the single columns: the one before with the same row
  std::array<int, static_cast<std::size_t>(S.rows)> last_of_row_ = [] {
    std::array<int, static_cast<std::size_t>(S.rows)> none{};
    none.fill(-1);
    return none;
  }();
  StaticVector<int, static_cast<std::size_t>(S.columns)> wide_{}, single_{}, local_{};  ///< columns of the factor at hand
  std::array<Scalar, static_cast<std::size_t>(TablesType::sizes.tangent)> step_{};
  LocalBlock block_{};
};

}  // namespace searvins::smoother
