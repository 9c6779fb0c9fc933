// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The symbolic half of the elimination: which front eliminates which variable, which factors it sums, and what its separator is.
///
/// One front a state. Front f eliminates E_f = {state f} and the chain variables whose last use is at state f. A factor belongs to the front of the
/// earliest-eliminated chain variable that it touches; a factor with a local variable belongs to the front of that variable, which is the earliest
/// among all its factors. The separator S_f is everything else that the front's factors and its children's update matrices touch; the children of a
/// front are those whose separator begins there.
///
/// Of a separator's variable the leading axes alone are members that anything of the front touches (leading_axes of the factors): a landmark seen from
/// ten states couples their poses, 6 axes of 15 each, and the front's cost goes with the square of its axes.
///
/// A front is known by a hash of E, S and its factors: while that stays, and those before it stay, its numbers may be used again.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <searvins/smoother/tables.hpp>

namespace searvins::smoother {

/// One front: E and S as global indices in the tree's members, numbers in the elimination's arena.
struct Front {
  int first{0}, eliminated{0}, separated{0};  ///< variables: members[first .. first + eliminated + separated), E before S
  int rows_e{0}, rows_s{0};                   ///< axes of E and S
  int offset{0};                              ///< of E in the stacked vector
  int parent{-1};
  int first_factor{-1}, first_local{-1};
  std::size_t storage{0};  ///< arena position: (rows_e+rows_s+1) x rows_e factor, (rows_s+1)^2 update, rows_s reference
  std::uint64_t shape{0};  ///< hash of E, S and the factors: a front of another shape is not reused
  bool clean{false};       ///< factor and update matrix are current

  [[nodiscard]] int border() const { return rows_e + rows_s; }  ///< index of the gradient row
  /// Scalars that it occupies in the arena.
  [[nodiscard]] std::size_t size() const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return at(border() + 1) * at(rows_e) + at(rows_s + 1) * at(rows_s + 1) + at(rows_s);
  }
};

/// See the file comment. `TablesType` is a Tables, `MemberCapacity` bounds the sum over fronts of eliminated + separator variables.
template <class TablesType, int MemberCapacity>
class FrontTree {
 public:
  static constexpr int kStates = TablesType::sizes.states;

  /// Decides who is eliminated where, and marks fronts whose structure changed. `prior_variables` are those of the marginal prior. False when
  /// MemberCapacity is exceeded.
  template <class Indices>
  [[nodiscard]] bool analyse(TablesType& tables, const Indices& prior_variables) {
    const int n = static_cast<int>(tables.states.size());
    for (int f = 0; f < n; ++f) shape_before_[at(f)] = fronts_[at(f)].shape, clean_before_[at(f)] = f < count_ && fronts_[at(f)].clean;
    count_ = n;
    tangent_size_ = 0;
    if (n == 0) return true;
    assign_variables(tables);
    assign_factors(tables);
    if (!collect_members(tables, prior_variables)) {
      mark_dirty_from(0);  // the shapes are already those of the refused structure
      return false;
    }
    bool reusable = true;
    for (int f = 0; f < n; ++f) {
      reusable = reusable && clean_before_[at(f)] && shape_before_[at(f)] == fronts_[at(f)].shape;
      fronts_[at(f)].clean = reusable;
    }
    return true;
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] Front& front(int f) { return fronts_[at(f)]; }
  [[nodiscard]] const Front& front(int f) const { return fronts_[at(f)]; }
  [[nodiscard]] int member(int i) const { return members_[at(i)]; }
  /// Leading axes of member i that are rows of its front: all of an eliminated variable's.
  [[nodiscard]] int axes(int i) const { return axes_[at(i)]; }
  [[nodiscard]] int tangent_size() const { return tangent_size_; }
  /// The front that sums the marginal prior, -1: there is none.
  [[nodiscard]] int prior_front() const { return prior_front_; }

  void mark_dirty_from(int f) {
    for (int k = f < 0 ? 0 : f; k < count_; ++k) fronts_[at(k)].clean = false;
  }
  /// First front that must be factored again.
  [[nodiscard]] int first_dirty() const {
    for (int f = 0; f < count_; ++f)
      if (!fronts_[at(f)].clean) return f;
    return count_;
  }
  /// Removes front 0; the others keep their order.
  void drop_first() {
    if (count_ == 0) return;
    std::copy(fronts_.begin() + 1, fronts_.begin() + count_, fronts_.begin());
    fronts_[at(count_ - 1)] = Front{};
    --count_;
  }
  void clear() {
    fronts_.fill(Front{});
    count_ = tangent_size_ = 0;
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// The front of every chain variable: the last state that a factor ties it to; the newest state when none does.
  void assign_variables(TablesType& tables) {
    for (int id : tables.living_variables) {
      VariableInfo& v = tables.variable(id);
      v.next = v.first_factor = -1;
      v.position = 0;
      v.front = -1;
    }
    int order = 0;
    for (int id : tables.states) tables.variable(id).front = order++;
    for (int id : tables.living_factors) tie_to_newest_state(tables, tables.factor(id));
    for (int f = 0; f < count_; ++f) first_chain_[at(f)] = last_chain_[at(f)] = -1;
    for (int id : tables.living_variables) {
      VariableInfo& v = tables.variable(id);
      if (v.role != Role::chain) continue;
      if (v.front < 0) v.front = count_ - 1;
      int& last = last_chain_[at(v.front)];
      (last < 0 ? first_chain_[at(v.front)] : tables.variable(last).next) = id;
      last = id;
    }
  }

  static void tie_to_newest_state(TablesType& tables, const FactorInfo& f) {
    const int* const ids = tables.variables_of(f);
    int newest = -1;
    for (int k = 0; k < f.keys; ++k)
      if (tables.variable(ids[k]).role == Role::state) newest = std::max(newest, tables.variable(ids[k]).front);
    for (int k = 0; k < f.keys; ++k) {
      VariableInfo& v = tables.variable(ids[k]);
      if (v.role == Role::chain) v.front = std::max(v.front, newest);
    }
  }

  /// The front of every local variable and factor, as linked lists that run in ascending global index.
  void assign_factors(TablesType& tables) {
    for (int id : tables.living_factors) {  // a local variable sits in the earliest front among its factors
      FactorInfo& f = tables.factor(id);
      f.front = earliest_front(tables, f);
      const int local = tables.local_of(f);
      if (local < 0) continue;
      int& front = tables.variable(local).front;
      front = front < 0 ? f.front : std::min(front, f.front);
    }
    for (int f = 0; f < count_; ++f) fronts_[at(f)].first_factor = fronts_[at(f)].first_local = -1;
    for (int i = tables.living_factors.size() - 1; i >= 0; --i) {  // lists grow at their head, so walk backwards
      const int id = tables.living_factors[i];
      FactorInfo& f = tables.factor(id);
      const int local = tables.local_of(f);
      if (local >= 0) f.front = tables.variable(local).front;
      int& head = local >= 0 ? tables.variable(local).first_factor : fronts_[at(std::max(f.front, 0))].first_factor;
      f.next = head;
      head = id;
    }
    for (int id : tables.living_variables) {
      VariableInfo& v = tables.variable(id);
      if (v.role != Role::local || v.first_factor < 0) continue;
      int& head = fronts_[at(v.front)].first_local;
      v.next = head;
      head = id;
    }
  }

  [[nodiscard]] int earliest_front(const TablesType& tables, const FactorInfo& f) const {
    int earliest = count_ - 1;
    for (int k = 0; k < f.keys; ++k) {
      const VariableInfo& v = tables.variable(tables.variables_of(f)[k]);
      if (v.role != Role::local) earliest = std::min(earliest, v.front);
    }
    return earliest;
  }

  /// Lists E and S of every front.
  template <class Indices>
  [[nodiscard]] bool collect_members(TablesType& tables, const Indices& prior_variables) {
    used_ = 0;
    prior_front_ = prior_variables.empty() ? -1 : count_ - 1;
    for (int id : prior_variables) prior_front_ = std::min(prior_front_, tables.variable(id).front);
    for (int f = 0; f < count_; ++f) {
      Front& front = fronts_[at(f)];
      front.first = used_, front.eliminated = front.separated = front.rows_e = front.rows_s = 0;
      front.parent = -1;
      front.offset = tangent_size_;
      front.shape = 1469598103934665603ULL;
      bool fits = list_eliminated(tables, f);
      if (f == prior_front_)
        for (int id : prior_variables) fits = fits && take(tables, f, id, tables.variable(id).prior_axes);
      for (int c = 0; fits && c < f; ++c) {
        const Front& child = fronts_[at(c)];
        if (child.parent != f) continue;
        for (int k = child.eliminated; k < child.eliminated + child.separated; ++k) fits = fits && take(tables, f, members_[at(child.first + k)], axes(child.first + k));
      }
      const int inherited = used_;
      fits = fits && take_factors(tables, f, front.first_factor);
      for (int l = front.first_local; fits && l >= 0; l = tables.variable(l).next) fits = take_factors(tables, f, tables.variable(l).first_factor);
      if (fits) sort_members(tables, inherited);
      if (!fits) return false;
      close_separator(tables, front);
    }
    return true;
  }

  [[nodiscard]] bool list_eliminated(TablesType& tables, int f) {
    for (int id = first_chain_[at(f)]; id >= 0; id = tables.variable(id).next)
      if (!eliminate(tables, f, id)) return false;
    return eliminate(tables, f, tables.states[at(f)]);
  }
  [[nodiscard]] bool eliminate(TablesType& tables, int f, int id) {
    if (used_ == MemberCapacity) return false;
    Front& front = fronts_[at(f)];
    VariableInfo& v = tables.variable(id);
    members_[at(used_)] = id;
    axes_[at(used_++)] = v.dof;
    v.offset = tangent_size_;
    tangent_size_ += v.dof;
    front.rows_e += v.dof;
    ++front.eliminated;
    mix(front.shape, static_cast<std::uint64_t>(id) << 32 | v.generation);
    return true;
  }

  /// Takes the variables of a list of factors into the separator of front f.
  [[nodiscard]] bool take_factors(TablesType& tables, int f, int first) {
    for (int id = first; id >= 0; id = tables.factor(id).next) {
      const FactorInfo& factor = tables.factor(id);
      for (int k = 0; k < factor.keys; ++k)
        if (!take(tables, f, tables.variables_of(factor)[k], tables.axes_of(factor)[k])) return false;
      mix(fronts_[at(f)].shape, static_cast<std::uint64_t>(id) + 0x10000U);
    }
    return true;
  }
  /// Takes the leading axes of a variable into the separator of front f.
  [[nodiscard]] bool take(TablesType& tables, int f, int id, int axes) {
    VariableInfo& v = tables.variable(id);
    if (v.role == Role::local || v.front == f) return true;
    Front& front = fronts_[at(f)];
    const int first = front.first + front.eliminated;
    if (v.position >= first && v.position < used_ && members_[at(v.position)] == id) {  // it is there already
      axes_[at(v.position)] = std::max(axes_[at(v.position)], axes);
      return true;
    }
    if (used_ == MemberCapacity) return false;
    v.position = used_;
    members_[at(used_)] = id;
    axes_[at(used_++)] = axes;
    ++front.separated;
    if (front.parent < 0 || v.front < front.parent) front.parent = v.front;
    return true;
  }

  /// Brings the members from `first` on into an order that lasts: states by age, then chain variables by index. Those before it keep the order of
  /// the children (whose update matrices then are added by long runs).
  void sort_members(const TablesType& tables, int first) {
    const auto before = [&](int a, int b) {
      const VariableInfo &va = tables.variable(a), &vb = tables.variable(b);
      if (va.role != vb.role) return va.role == Role::state;
      return va.role == Role::state ? va.front < vb.front : a < b;
    };
    for (int k = first + 1; k < used_; ++k) {  // few, and nearly in order
      const int id = members_[at(k)], axes = axes_[at(k)];
      int to = k;
      for (; to > first && before(id, members_[at(to - 1)]); --to) members_[at(to)] = members_[at(to - 1)], axes_[at(to)] = axes_[at(to - 1)];
      members_[at(to)] = id, axes_[at(to)] = axes;
    }
  }

  /// Counts the axes of a separator that is complete.
  void close_separator(const TablesType& tables, Front& front) {
    for (int k = front.first + front.eliminated; k < used_; ++k) {
      front.rows_s += axes(k);
      mix(front.shape, static_cast<std::uint64_t>(members_[at(k)]) << 32 | tables.variable(members_[at(k)]).generation);
      mix(front.shape, static_cast<std::uint64_t>(axes(k)));
    }
  }

  static void mix(std::uint64_t& hash, std::uint64_t value) {  // FNV-1a on 64-bit words
    hash = (hash ^ value) * 1099511628211ULL;
    hash ^= hash >> 29;
  }

  std::array<Front, static_cast<std::size_t>(kStates)> fronts_{};
  std::array<int, static_cast<std::size_t>(MemberCapacity)> members_{}, axes_{};
  std::array<int, static_cast<std::size_t>(kStates)> first_chain_{}, last_chain_{};
  std::array<std::uint64_t, static_cast<std::size_t>(kStates)> shape_before_{};
  std::array<bool, static_cast<std::size_t>(kStates)> clean_before_{};
  int count_{0}, tangent_size_{0}, prior_front_{-1}, used_{0};
};

}  // namespace searvins::smoother
