// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The multifrontal elimination: symbolic analysis, assembly and factorisation of the normal equations, front by front in chronological order.
///
/// The window minimises, with W = diag(w) held fixed (IRLS) and d the stacked tangent vector from theta,
///
///     1/2 d' H d + g' d + c,      H = sum J' W J (+ prior),   g = sum J' W e (+ prior)
///
/// One front a state. Front f eliminates E_f = {state f} and the chain variables whose last use is at state f. A factor belongs to the front of the
/// earliest-eliminated chain variable that it touches; a factor with a local variable belongs to the front of that variable, which is the earliest
/// among all its factors. The front's matrix, bordered with the gradient as a last row,
///
///     | H_EE  .     .  |      E: eliminated here
///     | H_SE  H_SS  .  |      S: separator = everything else that the front's factors and its children's update matrices touch
///     | g_E'  g_S'  c' |
///
/// is summed from the factors, the Schur products of its local variables and the update matrices of its children (the fronts whose separator begins
/// here), and partly factorised (math/block_cholesky.hpp). What stays in the trailing block is the front's update matrix: the marginal information
/// on S of all that was eliminated before, which is the marginal prior when the front's state leaves the window.
///
/// Fronts lie in one arena in order, so that refactoring from front f on reuses everything before it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/smoother/marginal_prior.hpp>
#include <searvins/smoother/window.hpp>

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

template <class Problem>
class Elimination {
 public:
  using Scalar = typename Problem::Scalar;
  using WindowType = Window<Problem>;
  static constexpr int kMaxFront = Problem::max_front_dimension;  ///< axes of E and S together
  static constexpr int kMaxStates = WindowType::kStates;
  using Prior = MarginalPrior<Scalar, kMaxFront, WindowType::kVariables>;

  /// One front: E and S as global indices in `members`, numbers in `arena`.
  struct Front {
    int first{0}, eliminated{0}, separated{0};  ///< variables: members[first .. first + eliminated + separated), E before S
    int rows_e{0}, rows_s{0};                   ///< axes of E and S
    int offset{0};                              ///< of E in the stacked vector
    int parent{-1};
    int first_factor{-1}, first_local{-1};
    std::size_t storage{0};   ///< arena position: (rows_e+rows_s+1) x rows_e factor, (rows_s+1)^2 update, rows_s reference
    std::uint64_t shape{0};   ///< hash of E, S and the factors: a front of another shape is not reused
    bool clean{false};        ///< factor and update matrix are current
    [[nodiscard]] int border() const { return rows_e + rows_s; }  ///< index of the gradient row
  };

  /// Decides who is eliminated where, and marks fronts whose structure changed. False when an index capacity is exceeded.
  [[nodiscard]] bool analyse(WindowType& window, const Prior& prior) {
    const int n = static_cast<int>(window.states().size());
    std::array<std::uint64_t, static_cast<std::size_t>(kMaxStates)>& old_shape = shape_before_;
    std::array<bool, static_cast<std::size_t>(kMaxStates)>& was_clean = clean_before_;
    for (int f = 0; f < n; ++f) old_shape[at(f)] = fronts_[at(f)].shape, was_clean[at(f)] = f < count_ && fronts_[at(f)].clean;
    const int old_count = count_;
    count_ = n;
    tangent_size_ = 0;
    if (n == 0) return true;
    assign_variables(window);
    assign_factors(window);
    if (!collect_members(window, prior)) {
      mark_dirty_from(0);  // the shapes are already those of the refused structure
      return false;
    }
    bool reusable = true;
    for (int f = 0; f < n; ++f) {
      Front& front = fronts_[at(f)];
      front.clean = f < old_count && was_clean[at(f)] && old_shape[at(f)] == front.shape && reusable;
      reusable = front.clean;
    }
    return true;
  }

  [[nodiscard]] int front_count() const { return count_; }
  [[nodiscard]] const Front& front(int f) const { return fronts_[at(f)]; }
  [[nodiscard]] int tangent_size() const { return tangent_size_; }
  [[nodiscard]] int member(int i) const { return members_[at(i)]; }
  [[nodiscard]] const Scalar* factor_of(int f) const { return arena_.data() + fronts_[at(f)].storage; }
  [[nodiscard]] const Scalar* update_of(int f) const {
    const Front& front = fronts_[at(f)];
    return arena_.data() + front.storage + at(front.border() + 1) * at(front.rows_e);
  }
  [[nodiscard]] const Scalar* reference_of(int f) const { return update_of(f) + at(fronts_[at(f)].rows_s + 1) * at(fronts_[at(f)].rows_s + 1); }

  void mark_dirty_from(int f) {
    for (int k = f < 0 ? 0 : f; k < count_; ++k) fronts_[at(k)].clean = false;
  }
  [[nodiscard]] bool all_clean() const { return count_ == 0 || fronts_[at(count_ - 1)].clean; }

  /// Factors every front that is not clean, in order. `damping` is Marquardt's: damping * (information of the axis) is added to every diagonal and
  /// pulls towards the present estimate. On failure nothing but the fronts themselves has changed.
  [[nodiscard]] EliminationFailure<Scalar> factorise(WindowType& window, Prior& prior, Scalar damping, math::ZeroPivot policy = math::ZeroPivot::fail, int only = -1) {
    (void)prior.template evaluate<Which::theta>(window);
    damping_ = damping;
    const int last = only < 0 ? count_ : only + 1;
    for (int f = only < 0 ? 0 : only; f < last; ++f) {
      if (fronts_[at(f)].clean) continue;
      const EliminationFailure<Scalar> failure = factorise_front(window, prior, f, damping, policy);
      if (!failure.ok()) {
        mark_dirty_from(f);
        return failure;
      }
      fronts_[at(f)].clean = true;
      if (f + 1 < count_) fronts_[at(f + 1)].clean = false;
    }
    return {};
  }

  /// Back-substitution: writes candidate_delta and candidate = theta (+) candidate_delta of every variable.
  void solve(WindowType& window) {
    for (int f = count_ - 1; f >= 0; --f) {
      const Front& front = fronts_[at(f)];
      const Scalar* const L = factor_of(f);
      const int ld = front.border() + 1;
      Scalar* const x = step_.data() + front.offset;
      gather_separator(window, front, step_.data());
      for (int j = 0; j < front.rows_e; ++j) {
        const Scalar* const column = L + static_cast<std::ptrdiff_t>(j) * ld;
        Scalar s = column[front.border()];
        for (int i = 0; i < front.rows_s; ++i) s += column[front.rows_e + i] * separator_[at(i)];
        x[j] = -s;
      }
      math::solve_lower_transposed(L, ld, front.rows_e, x);
    }
    for (int f = 0; f < count_; ++f) {
      const Front& front = fronts_[at(f)];
      for (int k = 0; k < front.eliminated; ++k) store_step(window, members_[at(front.first + k)]);
      for (int l = front.first_local; l >= 0; l = window.info(l).next) solve_local(window, l);
    }
  }

  /// x <- H^-1 b on the stacked chain axes for the undamped factor; b has support in E of front `from` and later. Entries of fronts before
  /// `down_to` are not computed. `b` is the stacked vector, overwritten with x.
  void solve_stacked(WindowType& window, Scalar* b, int from, int down_to) {
    for (int f = from; f < count_; ++f) {
      const Front& front = fronts_[at(f)];
      const Scalar* const L = factor_of(f);
      const int ld = front.border() + 1;
      Scalar* const y = b + front.offset;
      math::solve_lower(L, ld, front.rows_e, y);
      int row = front.rows_e;
      for (int k = front.eliminated; k < front.eliminated + front.separated; ++k) {
        const VariableInfo& info = window.info(members_[at(front.first + k)]);
        for (int i = 0; i < info.dof; ++i, ++row) {
          Scalar s = 0;
          for (int j = 0; j < front.rows_e; ++j) s += L[static_cast<std::ptrdiff_t>(j) * ld + row] * y[j];
          b[info.offset + i] -= s;
        }
      }
    }
    for (int f = count_ - 1; f >= down_to; --f) {
      const Front& front = fronts_[at(f)];
      const Scalar* const L = factor_of(f);
      const int ld = front.border() + 1;
      Scalar* const x = b + front.offset;
      gather_separator(window, front, b);
      for (int j = 0; j < front.rows_e; ++j) {
        const Scalar* const column = L + static_cast<std::ptrdiff_t>(j) * ld;
        for (int i = 0; i < front.rows_s; ++i) x[j] -= column[front.rows_e + i] * separator_[at(i)];
      }
      math::solve_lower_transposed(L, ld, front.rows_e, x);
    }
  }

  /// Forgets front 0 after its state has left: the rest keeps its place and its numbers.
  void drop_first_front() {
    if (count_ == 0) return;
    for (int f = 1; f < count_; ++f) fronts_[at(f - 1)] = fronts_[at(f)];
    fronts_[at(count_ - 1)] = Front{};
    --count_;
    if (count_ == 0) return;
    const std::size_t gap = fronts_[0].storage;
    const Front& end = fronts_[at(count_ - 1)];
    if (end.clean) std::move(arena_.begin() + static_cast<std::ptrdiff_t>(gap), arena_.begin() + static_cast<std::ptrdiff_t>(end.storage + storage_of(end)), arena_.begin());
    for (int f = 0; f < count_; ++f) {
      fronts_[at(f)].storage -= gap;
      if (!end.clean) fronts_[at(f)].clean = false;
    }
  }

  /// Forgets every front.
  void clear() {
    fronts_.fill(Front{});
    count_ = tangent_size_ = 0;
  }

  /// First front that must be factored again.
  [[nodiscard]] int first_dirty() const {
    for (int f = 0; f < count_; ++f)
      if (!fronts_[at(f)].clean) return f;
    return count_;
  }

  /// Schur-eliminated block of one local variable, at the present linearisation: H_ll (lower, factored in place), and its failing axis or -1.
  /// Used by covariance.hpp.
  struct LocalBlock {
    std::array<Scalar, static_cast<std::size_t>(detail::Largest<typename Problem::Variables>::of([](auto* v) {
                         return std::remove_pointer_t<decltype(v)>::role == Role::local ? std::remove_pointer_t<decltype(v)>::dof : 1;
                       }))>
        g{};
    std::array<Scalar, std::tuple_size_v<decltype(g)> * std::tuple_size_v<decltype(g)>> H{};
    int failed_axis{-1};
  };

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr int kLocalDof = static_cast<int>(std::tuple_size_v<decltype(LocalBlock::g)>);

  [[nodiscard]] static std::size_t storage_of(const Front& f) {
    return at(f.border() + 1) * at(f.rows_e) + at(f.rows_s + 1) * at(f.rows_s + 1) + at(f.rows_s);
  }

  // ---- symbolic ------------------------------------------------------------------------------------------------------------------------------

  /// The front of every chain variable: the last state that a factor ties it to; the newest state when none does.
  void assign_variables(WindowType& window) {
    int order = 0;
    for (int id : window.states()) window.info(id).front = order++;
    window.for_each_variable([&](auto&, int id) {
      VariableInfo& info = window.info(id);
      info.next = info.first_factor = -1;
      if (info.role != Role::state) info.front = -1;
    });
    window.for_each_factor([&](auto& r, int) {
      int newest = -1;
      for (int k = 0; k < r.keys; ++k) {
        const VariableInfo& info = window.info(r.variables[at(k)]);
        if (info.role == Role::state) newest = std::max(newest, info.front);
      }
      for (int k = 0; k < r.keys; ++k) {
        VariableInfo& info = window.info(r.variables[at(k)]);
        if (info.role == Role::chain) info.front = std::max(info.front, newest);
      }
    });
    for (int f = 0; f < count_; ++f) first_chain_[at(f)] = last_chain_[at(f)] = -1;
    window.for_each_variable([&](auto&, int id) {
      VariableInfo& info = window.info(id);
      info.position = 0;
      if (info.role != Role::chain) return;
      if (info.front < 0) info.front = count_ - 1;
      int& last = last_chain_[at(info.front)];
      (last < 0 ? first_chain_[at(info.front)] : window.info(last).next) = id;
      last = id;
    });
  }

  /// The front of every local variable and factor, as linked lists that run in ascending global index.
  void assign_factors(WindowType& window) {
    window.for_each_factor([&](auto& r, int) {  // a local variable sits in the earliest front among its factors
      const int local = local_of(window, r);
      if (local < 0) return;
      int& front = window.info(local).front;
      const int earliest = earliest_front(window, r);
      front = front < 0 ? earliest : std::min(front, earliest);
    });
    for (int f = 0; f < count_; ++f) fronts_[at(f)].first_factor = fronts_[at(f)].first_local = -1;
    // Lists grow at their head, so walk backwards: collect first, then push in reverse.
    int n = 0;
    window.for_each_factor([&](auto&, int id) { order_[at(n++)] = id; });
    for (int i = n - 1; i >= 0; --i)
      window.visit_factor(order_[at(i)], [&](auto& r) {
        const int local = local_of(window, r);
        r.front = local >= 0 ? window.info(local).front : earliest_front(window, r);
        int& head = local >= 0 ? window.info(local).first_factor : fronts_[at(std::max(r.front, 0))].first_factor;
        r.next = head;
        head = order_[at(i)];
      });
    window.for_each_variable([&](auto&, int id) {
      VariableInfo& info = window.info(id);
      if (info.role != Role::local || info.first_factor < 0) return;
      if (info.front < 0) info.front = count_ - 1;  // only unary factors: any front will do
      int& head = fronts_[at(info.front)].first_local;
      info.next = head;
      head = id;
    });
  }

  template <class Record>
  [[nodiscard]] static int local_of(const WindowType& window, const Record& r) {
    for (int k = 0; k < r.keys; ++k)
      if (window.info(r.variables[at(k)]).role == Role::local) return r.variables[at(k)];
    return -1;
  }
  template <class Record>
  [[nodiscard]] int earliest_front(const WindowType& window, const Record& r) const {
    int earliest = count_ - 1;
    for (int k = 0; k < r.keys; ++k) {
      const VariableInfo& info = window.info(r.variables[at(k)]);
      if (info.role != Role::local) earliest = std::min(earliest, info.front);
    }
    return earliest;
  }

  /// Lists E and S of every front.
  [[nodiscard]] bool collect_members(WindowType& window, const Prior& prior) {
    int used = 0;
    tangent_size_ = 0;
    int prior_front = prior.empty() ? -1 : count_ - 1;
    for (int id : prior.variables) prior_front = std::min(prior_front, window.info(id).front);
    prior_front_ = prior_front;
    for (int f = 0; f < count_; ++f) {
      Front& front = fronts_[at(f)];
      front.first = used, front.eliminated = front.separated = front.rows_e = front.rows_s = 0;
      front.parent = -1;
      front.offset = tangent_size_;
      front.shape = 1469598103934665603ULL;
      if (!list_eliminated(window, f, used)) return false;
      const auto take = [&](int id) {
        VariableInfo& info = window.info(id);
        if (info.role == Role::local || info.front == f || info.position == f + 1) return true;
        if (used == static_cast<int>(members_.size())) return false;
        info.position = f + 1;  // a mark while listing: already in the separator of front f
        members_[at(used++)] = id;
        ++front.separated;
        front.rows_s += info.dof;
        if (front.parent < 0 || info.front < front.parent) front.parent = info.front;
        mix(front.shape, static_cast<std::uint64_t>(id) << 32 | info.generation);
        return true;
      };
      bool fits = true;
      const auto take_factors = [&](int id) {
        while (id >= 0)
          window.visit_factor(id, [&](auto& r) {
            for (int k = 0; k < r.keys; ++k) fits = fits && take(r.variables[at(k)]);
            mix(front.shape, static_cast<std::uint64_t>(id) + 0x10000U);
            id = r.next;
          });
      };
      take_factors(front.first_factor);
      for (int l = front.first_local; l >= 0; l = window.info(l).next) take_factors(window.info(l).first_factor);
      for (int c = 0; c < f; ++c) {
        const Front& child = fronts_[at(c)];
        if (child.parent != f) continue;
        for (int k = child.eliminated; k < child.eliminated + child.separated; ++k) fits = fits && take(members_[at(child.first + k)]);
      }
      if (f == prior_front)
        for (int id : prior.variables) fits = fits && take(id);
      if (!fits) return false;
    }
    return true;
  }

  [[nodiscard]] bool list_eliminated(WindowType& window, int f, int& used) {
    Front& front = fronts_[at(f)];
    const auto add = [&](int id) {
      if (used == static_cast<int>(members_.size())) return false;
      VariableInfo& info = window.info(id);
      members_[at(used++)] = id;
      info.offset = tangent_size_;
      tangent_size_ += info.dof;
      front.rows_e += info.dof;
      ++front.eliminated;
      mix(front.shape, static_cast<std::uint64_t>(id) << 32 | info.generation);
      return true;
    };
    bool fits = true;
    for (int id = first_chain_[at(f)]; id >= 0; id = window.info(id).next) fits = fits && add(id);
    return fits && add(window.states()[at(f)]);
  }

  static void mix(std::uint64_t& hash, std::uint64_t value) {  // FNV-1a on 64-bit words
    hash = (hash ^ value) * 1099511628211ULL;
    hash ^= hash >> 29;
  }

  // ---- numeric -------------------------------------------------------------------------------------------------------------------------------

  [[nodiscard]] Scalar& work(int row, int column) { return work_[at(column) * at(ld_) + at(row)]; }

  [[nodiscard]] EliminationFailure<Scalar> factorise_front(WindowType& window, const Prior& prior, int f, Scalar damping, math::ZeroPivot policy) {
    using Kind = typename EliminationFailure<Scalar>::Kind;
    Front& front = fronts_[at(f)];
    const int n = front.border();
    if (n > kMaxFront) return {Kind::front_too_large, window.states()[at(f)], n, 0};
    front.storage = f == 0 ? 0 : fronts_[at(f - 1)].storage + storage_of(fronts_[at(f - 1)]);
    if (front.storage + storage_of(front) > arena_.size()) return {Kind::arena_full, window.states()[at(f)], n, 0};
    place(window, front);
    std::fill_n(work_.begin(), at(ld_) * at(ld_), Scalar(0));
    std::fill_n(reference_.begin(), at(n), Scalar(0));
    for (int c = 0; c < f; ++c)
      if (fronts_[at(c)].parent == f) add_update(window, c);
    if (f == prior_front_) add_prior(window, prior);
    for (int id = front.first_factor; id >= 0;) window.visit_factor(id, [&](auto& r) { add_factor(window, r), id = r.next; });
    for (int l = front.first_local; l >= 0; l = window.info(l).next) {
      const EliminationFailure<Scalar> failed = add_local(window, l, damping);
      if (failed.kind == Kind::non_finite || (!failed.ok() && policy == math::ZeroPivot::fail)) return failed;
    }
    if (damping > 0) damp(window, front, damping);
    const auto report = math::partial_cholesky(work_.data(), ld_, n + 1, front.rows_e, reference_.data(), policy);
    if (!report.ok()) return locate(window, front, report);
    keep(front);
    return {};
  }

  /// Columns of the front's variables in the work matrix.
  void place(WindowType& window, const Front& front) {
    int column = 0;
    for (int k = 0; k < front.eliminated + front.separated; ++k) {
      VariableInfo& info = window.info(members_[at(front.first + k)]);
      info.position = column;
      column += info.dof;
    }
    ld_ = column + 1;
  }

  void add_update(WindowType& window, int child_index) {
    const Front& child = fronts_[at(child_index)];
    const Scalar* const U = update_of(child_index);
    const Scalar* const reference = reference_of(child_index);
    const int m = child.rows_s;
    int row = 0;
    for (int k = child.eliminated; k < child.eliminated + child.separated; ++k) {
      const VariableInfo& info = window.info(members_[at(child.first + k)]);
      for (int i = 0; i < info.dof; ++i, ++row) {
        map_[at(row)] = info.position + i;
        reference_[at(info.position + i)] += reference[row];
      }
    }
    map_[at(m)] = ld_ - 1;
    for (int j = 0; j <= m; ++j)
      for (int i = j; i <= m; ++i) add_symmetric(map_[at(i)], map_[at(j)], U[static_cast<std::ptrdiff_t>(j) * (m + 1) + i]);
  }

  void add_symmetric(int a, int b, Scalar value) { a >= b ? work(a, b) += value : work(b, a) += value; }

  void add_prior(WindowType& window, const Prior& prior) {
    for (int id : prior.variables) {
      const VariableInfo& info = window.info(id);
      for (int i = 0; i < info.dof; ++i) {
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

  /// Scales the rows of a factor by sqrt(w) into `rows_`, column by column, the residual last, and finds each column's span of non-zero rows.
  template <class F>
  void scale_rows(WindowType& window, const FactorRecord<F>& r) {
    std::array<Scalar, F::max_rows> root{};
    for (int i = 0; i < r.rows; ++i) root[at(i)] = std::sqrt(r.weights[at(i)]);
    int column = 0;
    for (int k = 0; k < r.keys; ++k) {
      const VariableInfo& info = window.info(r.variables[at(k)]);
      for (int d = 0; d < info.dof; ++d, ++column) {
        target_[at(column)] = info.role == Role::local ? -1 - d : info.position + d;
        const Scalar* const J = r.jacobian.data() + static_cast<std::ptrdiff_t>(column) * F::max_rows;
        Scalar* const out = rows_.data() + static_cast<std::ptrdiff_t>(column) * F::max_rows;
        int low = r.rows, high = 0;
        for (int i = 0; i < r.rows; ++i) {
          out[i] = J[i] * root[at(i)];
          if (out[i] != 0) low = std::min(low, i), high = i + 1;
        }
        low_[at(column)] = low, high_[at(column)] = high;
      }
    }
    Scalar* const out = rows_.data() + static_cast<std::ptrdiff_t>(column) * F::max_rows;
    for (int i = 0; i < r.rows; ++i) out[i] = r.e_theta[at(i)] * root[at(i)];
    target_[at(column)] = ld_ - 1;
    low_[at(column)] = 0, high_[at(column)] = r.rows;
  }

  /// Inner product of two columns of `rows_`, over the rows where both are non-zero.
  template <int MaxRows>
  [[nodiscard]] Scalar inner(int a, int b) const {
    const Scalar *const pa = rows_.data() + static_cast<std::ptrdiff_t>(a) * MaxRows, *const pb = rows_.data() + static_cast<std::ptrdiff_t>(b) * MaxRows;
    const int high = std::min(high_[at(a)], high_[at(b)]);
    Scalar s = 0;
    for (int i = std::max(low_[at(a)], low_[at(b)]); i < high; ++i) s += pa[i] * pb[i];
    return s;
  }

  /// H += J'WJ, g += J'We on the chain columns.
  template <class F>
  void add_factor(WindowType& window, FactorRecord<F>& r) {
    if (!window.template enabled<F>()) return;
    scale_rows(window, r);
    for (int b = 0; b <= r.columns; ++b) {
      if (target_[at(b)] < 0 || low_[at(b)] >= high_[at(b)]) continue;
      for (int a = b; a <= r.columns; ++a)
        if (target_[at(a)] >= 0 && low_[at(a)] < high_[at(b)] && low_[at(b)] < high_[at(a)]) add_symmetric(target_[at(a)], target_[at(b)], inner<F::max_rows>(a, b));
      if (b < r.columns) reference_[at(target_[at(b)])] += inner<F::max_rows>(b, b);
    }
  }

  /// Adds the factors of one local variable and subtracts its Schur product  B' H_ll^-1 B,  B = [H_lc g_l].  Damped like the chain variables.
  [[nodiscard]] EliminationFailure<Scalar> add_local(WindowType& window, int local, Scalar damping) {
    const int dof = window.info(local).dof;
    block_ = LocalBlock{};
    touched_ = 0;
    for (int id = window.info(local).first_factor; id >= 0;)
      window.visit_factor(id, [&]<class F>(FactorRecord<F>& r) {
        id = r.next;
        if (!window.template enabled<F>()) return;
        add_factor(window, r);
        for (int l = 0; l < r.columns; ++l) {
          if (target_[at(l)] >= 0) continue;
          const int axis = -1 - target_[at(l)];
          for (int a = 0; a <= r.columns; ++a) {
            const Scalar value = inner<F::max_rows>(a, l);
            if (target_[at(a)] >= 0)
              touch(target_[at(a)])[axis] += value;
            else if (-1 - target_[at(a)] >= axis)
              block_.H[at(axis * kLocalDof - 1 - target_[at(a)])] += value;
          }
        }
      });
    for (int i = 0; i < dof; ++i) block_.g[at(i)] = block_.H[at(i * kLocalDof + i)];
    if (damping > 0) {
      Scalar* const gradient = touch(ld_ - 1);
      visit_local(window, local, [&]<class V>(VariableRecord<V>& r) {
        for (int i = 0; i < V::dof; ++i) {
          const Scalar extra = damping * block_.g[at(i)];
          block_.H[at(i * kLocalDof + i)] += extra;
          gradient[i] -= extra * r.delta[i];
        }
      });
    }
    const auto report = math::partial_cholesky(block_.H.data(), kLocalDof, dof, dof, block_.g.data(), math::ZeroPivot::skip);
    EliminationFailure<Scalar> failed;
    if (!report.ok()) failed = {EliminationFailure<Scalar>::Kind::non_finite, local, report.failed, report.value};
    if (report.ok() && report.skipped > 0)
      for (int i = dof - 1; i >= 0; --i)
        if (!(block_.H[at(i * kLocalDof + i)] > 0)) failed = {EliminationFailure<Scalar>::Kind::zero_pivot, local, i, 0};
    for (int t = 0; t < touched_; ++t) math::solve_lower(block_.H.data(), kLocalDof, dof, local_row(touched_columns_[at(t)]));
    std::sort(touched_columns_.begin(), touched_columns_.begin() + touched_);
    for (int s = 0; s < touched_; ++s) {
      const int column = touched_columns_[at(s)];
      const Scalar* const b = local_row(column);
      for (int t = s; t < touched_; ++t) {
        const Scalar* const a = local_row(touched_columns_[at(t)]);
        Scalar sum = 0;
        for (int i = 0; i < dof; ++i) sum += a[i] * b[i];
        work(touched_columns_[at(t)], column) -= sum;
      }
    }
    for (int t = 0; t < touched_; ++t) {
      Scalar* const row = local_row(touched_columns_[at(t)]);
      std::fill_n(row, kLocalDof, Scalar(0));
      is_touched_[at(touched_columns_[at(t)])] = false;
    }
    return failed;
  }

  [[nodiscard]] Scalar* local_row(int column) { return local_rows_.data() + static_cast<std::ptrdiff_t>(column) * kLocalDof; }
  [[nodiscard]] Scalar* touch(int column) {
    if (!is_touched_[at(column)]) is_touched_[at(column)] = true, touched_columns_[at(touched_++)] = column;
    return local_row(column);
  }

  /// Levenberg-Marquardt: (damping * D) with D the information of each axis, centred on the present estimate (delta), not on theta.
  void damp(WindowType& window, const Front& front, Scalar damping) {
    for (int k = 0; k < front.eliminated; ++k) {
      const int id = members_[at(front.first + k)];
      const int column = window.info(id).position;
      window.visit_variable(id, [&]<class V>(VariableRecord<V>& r) {
        for (int i = 0; i < V::dof; ++i) {
          const Scalar extra = damping * reference_[at(column + i)];
          work(column + i, column + i) += extra;
          work(ld_ - 1, column + i) -= extra * r.delta[i];
        }
      });
    }
  }

  [[nodiscard]] EliminationFailure<Scalar> locate(const WindowType& window, const Front& front, const math::PivotReport<Scalar>& report) const {
    using Kind = typename EliminationFailure<Scalar>::Kind;
    for (int k = 0; k < front.eliminated; ++k) {
      const int id = members_[at(front.first + k)];
      const VariableInfo& info = window.info(id);
      if (report.failed >= info.position && report.failed < info.position + info.dof)
        return {report.non_finite ? Kind::non_finite : Kind::zero_pivot, id, report.failed - info.position, report.value};
    }
    return {Kind::non_finite, -1, -1, report.value};
  }

  /// Copies the factor columns, the update matrix and its reference from the work matrix to the arena.
  void keep(const Front& front) {
    Scalar* out = arena_.data() + front.storage;
    const int n = front.border() + 1;
    for (int j = 0; j < front.rows_e; ++j, out += n) std::copy_n(&work(0, j), n, out);
    for (int j = front.rows_e; j < n; ++j, out += front.rows_s + 1) std::copy_n(&work(front.rows_e, j), front.rows_s + 1, out);
    std::copy_n(reference_.begin() + front.rows_e, front.rows_s, out);
  }

  void gather_separator(const WindowType& window, const Front& front, const Scalar* stacked) {
    int row = 0;
    for (int k = front.eliminated; k < front.eliminated + front.separated; ++k) {
      const VariableInfo& info = window.info(members_[at(front.first + k)]);
      for (int i = 0; i < info.dof; ++i) separator_[at(row++)] = stacked[info.offset + i];
    }
  }

  void store_step(WindowType& window, int id) {
    const int offset = window.info(id).offset;
    window.visit_variable(id, [&]<class V>(VariableRecord<V>& r) {
      for (int i = 0; i < V::dof; ++i) r.candidate_delta[i] = step_[at(offset + i)];
      r.candidate = r.theta.retract(r.candidate_delta);
    });
  }

  /// fn(record) of a local variable; not instantiated for other roles, whose tangent spaces may be larger.
  template <class Fn>
  static void visit_local(WindowType& window, int local, Fn fn) {
    window.visit_variable(local, [&]<class V>(VariableRecord<V>& r) {
      if constexpr (V::role == Role::local) fn(r);
    });
  }

  /// Local variable given the chain step:  H_ll d_l = -(g_l + H_lc d_c) = -sum J_l' W (e + J_c d_c), damped as the fronts are.
  void solve_local(WindowType& window, int local) {
    const int dof = window.info(local).dof;
    LocalBlock block;
    for (int id = window.info(local).first_factor; id >= 0;)
      window.visit_factor(id, [&]<class F>(FactorRecord<F>& r) {
        id = r.next;
        if (!window.template enabled<F>()) return;
        std::array<Scalar, F::max_rows> t{};
        for (int i = 0; i < r.rows; ++i) t[at(i)] = r.e_theta[at(i)];
        int column = 0, local_column = 0;
        for (int k = 0; k < r.keys; ++k) {
          const VariableInfo& info = window.info(r.variables[at(k)]);
          if (info.role == Role::local) local_column = column;
          for (int d = 0; d < info.dof; ++d, ++column) {
            if (info.role == Role::local) continue;
            const Scalar* const J = r.jacobian.data() + static_cast<std::ptrdiff_t>(column) * F::max_rows;
            const Scalar step = step_[at(info.offset + d)];
            for (int i = 0; i < r.rows; ++i) t[at(i)] += J[i] * step;
          }
        }
        for (int a = 0; a < dof; ++a) {
          const Scalar* const Ja = r.jacobian.data() + static_cast<std::ptrdiff_t>(local_column + a) * F::max_rows;
          for (int i = 0; i < r.rows; ++i) block.g[at(a)] -= Ja[i] * r.weights[at(i)] * t[at(i)];
          for (int b = 0; b <= a; ++b) {
            const Scalar* const Jb = r.jacobian.data() + static_cast<std::ptrdiff_t>(local_column + b) * F::max_rows;
            for (int i = 0; i < r.rows; ++i) block.H[at(b * kLocalDof + a)] += Ja[i] * r.weights[at(i)] * Jb[i];
          }
        }
      });
    std::array<Scalar, static_cast<std::size_t>(kLocalDof)> reference{};
    for (int i = 0; i < dof; ++i) reference[at(i)] = block.H[at(i * kLocalDof + i)];
    visit_local(window, local, [&]<class V>(VariableRecord<V>& r) {
      for (int i = 0; i < V::dof; ++i) {
        const Scalar extra = damping_ * reference[at(i)];
        block.H[at(i * kLocalDof + i)] += extra;
        block.g[at(i)] += extra * r.delta[i];
      }
    });
    (void)math::partial_cholesky(block.H.data(), kLocalDof, dof, dof, reference.data(), math::ZeroPivot::skip);
    math::solve_lower(block.H.data(), kLocalDof, dof, block.g.data());
    math::solve_lower_transposed(block.H.data(), kLocalDof, dof, block.g.data());
    visit_local(window, local, [&]<class V>(VariableRecord<V>& r) {
      for (int i = 0; i < V::dof; ++i) r.candidate_delta[i] = block.g[at(i)];
      r.candidate = r.theta.retract(r.candidate_delta);
    });
  }

  static constexpr int kRowScratch = detail::Largest<typename Problem::Factors>::of([](auto* f) {
    using F = std::remove_pointer_t<decltype(f)>;
    return F::max_rows * (F::max_columns + 1);
  });
  static constexpr int kColumnScratch = detail::Largest<typename Problem::Factors>::of([](auto* f) { return std::remove_pointer_t<decltype(f)>::max_columns + 1; });

  std::array<Front, static_cast<std::size_t>(kMaxStates)> fronts_{};
  int count_{0}, tangent_size_{0}, prior_front_{-1}, ld_{1}, touched_{0};
  Scalar damping_{0};  ///< of the last factorisation
  std::array<int, static_cast<std::size_t>(Problem::member_capacity)> members_{};
  std::array<int, static_cast<std::size_t>(WindowType::kFactors)> order_{};
  std::array<int, static_cast<std::size_t>(kMaxStates)> first_chain_{}, last_chain_{};
  std::array<std::uint64_t, static_cast<std::size_t>(kMaxStates)> shape_before_{};
  std::array<bool, static_cast<std::size_t>(kMaxStates)> clean_before_{};
  std::array<Scalar, static_cast<std::size_t>(Problem::arena_scalars)> arena_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxFront + 1) * (kMaxFront + 1)> work_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxFront + 1)> reference_{}, separator_{};
  std::array<int, static_cast<std::size_t>(kMaxFront + 1)> map_{}, touched_columns_{};
  std::array<bool, static_cast<std::size_t>(kMaxFront + 1)> is_touched_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxFront + 1) * kLocalDof> local_rows_{};
  std::array<Scalar, static_cast<std::size_t>(kRowScratch)> rows_{};
  std::array<int, static_cast<std::size_t>(kColumnScratch)> target_{}, low_{}, high_{};
  std::array<Scalar, static_cast<std::size_t>(WindowType::kTangentCapacity)> step_{};
  LocalBlock block_{};
};

}  // namespace searvins::smoother
