// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The window: typed pools of variables and factors, their keys, and who touches whom. Pure storage; the arithmetic is in elimination.hpp.
///
/// Every variable carries three values:
///
///     theta       where its factors are linearised
///     x           the estimate;  x = theta (+) delta
///     candidate   what the current step proposes; becomes x when the step is accepted
///
/// Global indices: variables of all types are numbered type by type (offset of the type + slot), factors likewise. Linked lists run over these
/// numbers, so nothing here is a pointer and the whole object can be copied as bytes.
#pragma once

#include <array>
#include <cstdint>
#include <tuple>
#include <utility>

#include <searvins/core/pool.hpp>
#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::smoother {

/// A variable in the window.
template <class V>
struct VariableRecord {
  V x{}, theta{}, candidate{}, prior_theta{};
  V saved_x{}, saved_theta{};  ///< what a failed update returns to
  Tangent<V> delta{Tangent<V>::Zero()}, candidate_delta{Tangent<V>::Zero()}, saved_delta{Tangent<V>::Zero()};
};

/// A factor in the window with its linearisation at theta and its rows at the estimate.
template <class F>
struct FactorRecord {
  F factor{};
  std::array<int, F::max_keys> variables{};  ///< global indices in the order of for_each_key
  int keys{0}, columns{0}, rows{0};
  int front{-1}, next{-1};  ///< set by the symbolic analysis: front, next factor of the same list
  bool linearised{false};
  std::array<typename F::Scalar, F::max_rows> e_theta{}, weights{};  ///< rows at theta, weights that the stored fronts contain
  std::array<typename F::Scalar, F::max_rows> e{}, weights_now{};    ///< rows and weights at the last evaluated point
  std::array<typename F::Scalar, static_cast<std::size_t>(F::max_rows) * F::max_columns> jacobian{};
};

/// What the elimination knows of a variable, whatever its type.
struct VariableInfo {
  bool alive{false};
  bool relinearised{false};  ///< theta moved since the fronts were last factored
  Role role{Role::chain};
  int type{-1}, dof{0};
  std::uint32_t slot{0}, generation{0};
  GpsTime stamp{};
  int degree{0};    ///< factors that touch it
  int front{-1};    ///< front that eliminates it
  int position{-1};  ///< column in the front under assembly
  int offset{-1};   ///< first element in the stacked step vector
  int prior{-1};    ///< first row in the marginal prior, -1: not in it
  int first_factor{-1};  ///< of a local variable: its factors
  int next{-1};     ///< next variable of the same front's list
};

namespace detail {
template <template <class> class Record, class List>
struct PoolsOf;
template <template <class> class Record, class... C>
struct PoolsOf<Record, Types<C...>> {
  using type = std::tuple<Pool<Record<typename C::type>, static_cast<std::size_t>(C::value)>...>;
};
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

/// Which of a variable's values a factor sees.
enum class Which : std::uint8_t { theta, estimate, candidate };

template <class Problem>
class Window {
 public:
  using Scalar = typename Problem::Scalar;
  using VariableTypes = typename Problem::Variables;
  using FactorTypes = typename Problem::Factors;
  static constexpr int kVariables = VariableTypes::total;
  static constexpr int kFactors = FactorTypes::total;
  /// Longest stacked tangent vector.
  static constexpr int kTangentCapacity = detail::Largest<VariableTypes>::sum([](auto* v) { return std::remove_pointer_t<decltype(v)>::dof; });
  static constexpr int kStates = detail::Largest<VariableTypes>::sum(
      [](auto* v) { return std::remove_pointer_t<decltype(v)>::role == Role::state ? 1 : 0; });

  /// Read access for factors: values(key).
  template <Which W>
  struct Values {
    const Window& window;
    template <class V>
    const V& operator()(const Key<V>& key) const {
      const VariableRecord<V>& r = *window.record(key);
      if constexpr (W == Which::theta) return r.theta;
      if constexpr (W == Which::candidate) return r.candidate;
      return r.x;
    }
  };

  /// Adds a variable. Errors: capacity_exceeded; out_of_order when a state is older than the newest.
  template <class V>
  Result<Key<V>> add_variable(const V& value, GpsTime stamp) {
    static_assert(Variable<V>, "this type does not model searvins::smoother::Variable: see the list of members there");
    constexpr int type = VariableTypes::template index_of<V>();
    static_assert(type >= 0, "this variable type is not listed in Problem::Variables");
    if (V::role == Role::state && !states_.empty() && stamp < info_[index(states_.back())].stamp)
      return failure(StatusCode::out_of_order, "a state is older than the newest state of the window");
    if (V::role == Role::state && states_.full()) return failure(StatusCode::capacity_exceeded, "no room for another state: marginalise the oldest first", type);
    auto& pool = std::get<static_cast<std::size_t>(type)>(variables_);
    VariableRecord<V> fresh;
    fresh.x = fresh.theta = fresh.candidate = value;
    const auto inserted = pool.insert(fresh);
    if (!inserted.ok()) return failure(StatusCode::capacity_exceeded, "the pool of this variable type is full: raise its capacity in Problem::Variables", type);
    const Key<V> key{inserted->slot, inserted->generation};
    const int id = VariableTypes::offset_of(type) + static_cast<int>(key.slot);
    VariableInfo& info = info_[index(id)];
    info = VariableInfo{};
    info.alive = true, info.relinearised = true, info.role = V::role, info.type = type, info.dof = V::dof;
    info.slot = key.slot, info.generation = key.generation, info.stamp = stamp;
    if (V::role == Role::state) (void)states_.push_back(id);
    return key;
  }

  /// Removes a variable that no factor and no prior touches (undoes add_variable). Errors: unknown_key, invalid_argument when it is in use.
  template <class V>
  Status remove_variable(const Key<V>& key) {
    const int id = id_of(key);
    if (id < 0) return failure(StatusCode::unknown_key, "the variable does not live (any more)");
    if (info_[index(id)].degree > 0 || info_[index(id)].prior >= 0) return failure(StatusCode::invalid_argument, "the variable is in use: remove its factors first", id);
    erase_variable(id);
    return ok_status();
  }

  /// Adds a factor. Errors: unknown_key when a variable does not live, capacity_exceeded, invalid_argument (more than one local variable, a key twice).
  template <class F>
  Result<Key<F>> add_factor(const F& factor) {
    static_assert(Factor<F>, "this type does not model searvins::smoother::Factor: see the list of members there");
    constexpr int type = FactorTypes::template index_of<F>();
    static_assert(type >= 0, "this factor type is not listed in Problem::Factors");
    FactorRecord<F>& fresh = scratch<F>();
    fresh = FactorRecord<F>{};
    fresh.factor = factor;
    if (const Status s = bind(fresh); !s.ok()) return s;
    const auto inserted = std::get<static_cast<std::size_t>(type)>(factors_).insert(fresh);
    if (!inserted.ok()) return failure(StatusCode::capacity_exceeded, "the pool of this factor type is full: raise its capacity in Problem::Factors", type);
    for (int k = 0; k < fresh.keys; ++k) ++info_[index(fresh.variables[index(k)])].degree;
    return Key<F>{inserted->slot, inserted->generation};
  }

  template <class F>
  Status remove_factor(const Key<F>& key) {
    constexpr int type = FactorTypes::template index_of<F>();
    auto& pool = std::get<static_cast<std::size_t>(type)>(factors_);
    const PoolKey<FactorRecord<F>> pool_key{key.slot, key.generation};
    const FactorRecord<F>* r = pool.get(pool_key);
    if (!r) return failure(StatusCode::unknown_key, "the factor does not live (any more)");
    for (int k = 0; k < r->keys; ++k) --info_[index(r->variables[index(k)])].degree;
    return pool.erase(pool_key);
  }

  /// The estimate of a variable, nullptr when the key is stale.
  template <class V>
  [[nodiscard]] const V* find(const Key<V>& key) const {
    const VariableRecord<V>* r = record(key);
    return r ? &r->x : nullptr;
  }

  template <class V>
  [[nodiscard]] VariableRecord<V>* record(const Key<V>& key) {
    constexpr int type = VariableTypes::template index_of<V>();
    return std::get<static_cast<std::size_t>(type)>(variables_).get(PoolKey<VariableRecord<V>>{key.slot, key.generation});
  }
  template <class V>
  [[nodiscard]] const VariableRecord<V>* record(const Key<V>& key) const {
    constexpr int type = VariableTypes::template index_of<V>();
    static_assert(type >= 0, "this variable type is not listed in Problem::Variables");
    return std::get<static_cast<std::size_t>(type)>(variables_).get(PoolKey<VariableRecord<V>>{key.slot, key.generation});
  }
  template <class F>
  [[nodiscard]] FactorRecord<F>* factor_record(const Key<F>& key) {
    constexpr int type = FactorTypes::template index_of<F>();
    return std::get<static_cast<std::size_t>(type)>(factors_).get(PoolKey<FactorRecord<F>>{key.slot, key.generation});
  }

  /// Global index of a living variable, -1 when the key is stale.
  template <class V>
  [[nodiscard]] int id_of(const Key<V>& key) const {
    constexpr int type = VariableTypes::template index_of<V>();
    static_assert(type >= 0, "this variable type is not listed in Problem::Variables");
    if (!record(key)) return -1;
    return VariableTypes::offset_of(type) + static_cast<int>(key.slot);
  }
  [[nodiscard]] int id_of(const AnyKey& key) const {
    if (key.type < 0 || key.type >= VariableTypes::size) return -1;
    if (key.slot >= static_cast<std::uint32_t>(kVariables)) return -1;
    const int id = VariableTypes::offset_of(key.type) + static_cast<int>(key.slot);
    if (id >= kVariables) return -1;
    const VariableInfo& info = info_[index(id)];
    return info.alive && info.type == key.type && info.slot == key.slot && info.generation == key.generation ? id : -1;
  }
  template <class V>
  [[nodiscard]] static constexpr AnyKey any(const Key<V>& key) {
    return {VariableTypes::template index_of<V>(), key.slot, key.generation};
  }
  [[nodiscard]] AnyKey key_of(int id) const { return {info(id).type, info(id).slot, info(id).generation}; }

  /// States in chronological order, as global indices.
  [[nodiscard]] const auto& states() const { return states_; }
  [[nodiscard]] VariableInfo& info(int id) { return info_[index(id)]; }
  [[nodiscard]] const VariableInfo& info(int id) const { return info_[index(id)]; }

  /// fn(record) with the record of a variable by global index.
  template <class Fn>
  void visit_variable(int id, Fn&& fn) {
    visit_in(variables_, VariableTypes{}, id, fn, std::make_index_sequence<static_cast<std::size_t>(VariableTypes::size)>{});
  }
  template <class Fn>
  void visit_factor(int id, Fn&& fn) {
    visit_in(factors_, FactorTypes{}, id, fn, std::make_index_sequence<static_cast<std::size_t>(FactorTypes::size)>{});
  }
  /// fn(record, global index) over all living factors, type by type, slot by slot.
  template <class Fn>
  void for_each_factor(Fn&& fn) {
    for_each_in(factors_, FactorTypes{}, fn, std::make_index_sequence<static_cast<std::size_t>(FactorTypes::size)>{});
  }
  /// fn(record, global index) over all living variables.
  template <class Fn>
  void for_each_variable(Fn&& fn) {
    for_each_in(variables_, VariableTypes{}, fn, std::make_index_sequence<static_cast<std::size_t>(VariableTypes::size)>{});
  }

  template <class V>
  [[nodiscard]] std::size_t count() const {
    return std::get<static_cast<std::size_t>(VariableTypes::template index_of<V>())>(variables_).size();
  }
  template <class F>
  [[nodiscard]] std::size_t factor_count() const {
    return std::get<static_cast<std::size_t>(FactorTypes::template index_of<F>())>(factors_).size();
  }

  /// Switches a factor type off (its factors keep their place but count for nothing) or on again.
  template <class F>
  void set_enabled(bool on) {
    enabled_[index(FactorTypes::template index_of<F>())] = on;
  }
  template <class F>
  [[nodiscard]] bool enabled() const {
    return enabled_[index(FactorTypes::template index_of<F>())];
  }

  void erase_variable(int id) {
    VariableInfo& gone = info_[index(id)];
    const std::uint32_t slot = gone.slot, generation = gone.generation;
    visit_variable(id, [&]<class V>(VariableRecord<V>&) {
      (void)std::get<static_cast<std::size_t>(VariableTypes::template index_of<V>())>(variables_).erase(PoolKey<VariableRecord<V>>{slot, generation});
    });
    gone = VariableInfo{};
    (void)states_.erase_if([id](int s) { return s == id; });
  }

  /// Erases a factor by global index.
  void erase_factor(int id) {
    visit_factor(id, [&]<class F>(FactorRecord<F>& r) {
      for (int k = 0; k < r.keys; ++k) --info_[index(r.variables[index(k)])].degree;
      auto& pool = std::get<static_cast<std::size_t>(FactorTypes::template index_of<F>())>(factors_);
      const auto slot = static_cast<std::uint32_t>(id - FactorTypes::offset_of(FactorTypes::template index_of<F>()));
      (void)pool.erase(pool.key_of_slot(slot));
    });
  }

  [[nodiscard]] static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

 private:
  /// Resolves a factor's keys to global indices and counts its columns.
  template <class F>
  Status bind(FactorRecord<F>& r) {
    Status status = ok_status();
    int locals = 0;
    r.factor.for_each_key([&]<class V>(const Key<V>& key) {
      const int id = id_of(key);
      if (id < 0) status = failure(StatusCode::unknown_key, "a variable of the factor does not live (any more)", r.keys);
      if (!status.ok()) return;
      if (r.keys == F::max_keys) {
        status = failure(StatusCode::capacity_exceeded, "the factor names more variables than its max_keys", r.keys);
        return;
      }
      for (int k = 0; k < r.keys; ++k)
        if (r.variables[index(k)] == id) status = failure(StatusCode::invalid_argument, "the factor names a variable twice", r.keys);
      locals += V::role == Role::local ? 1 : 0;
      r.variables[index(r.keys++)] = id;
      r.columns += V::dof;
    });
    if (!status.ok()) return status;
    r.rows = r.factor.rows();
    if (r.rows < 1 || r.rows > F::max_rows) return failure(StatusCode::invalid_argument, "rows() of the factor lies outside 1..max_rows", r.rows);
    if (r.columns > F::max_columns) return failure(StatusCode::capacity_exceeded, "the factor's variables have more axes than its max_columns", r.columns);
    if (locals > 1) return failure(StatusCode::invalid_argument, "a factor may touch one local variable at most", locals);
    return status;
  }

  template <class Tuple, class... C, class Fn, std::size_t... I>
  static void visit_in(Tuple& pools, Types<C...>, int id, Fn& fn, std::index_sequence<I...>) {
    const auto try_one = [&](auto& pool, int first, int capacity) {
      if (id < first || id >= first + capacity) return;
      if (auto* r = pool.at_slot(static_cast<std::uint32_t>(id - first))) fn(*r);
    };
    (try_one(std::get<I>(pools), Types<C...>::offset_of(static_cast<int>(I)), C::value), ...);
  }
  template <class Tuple, class... C, class Fn, std::size_t... I>
  static void for_each_in(Tuple& pools, Types<C...>, Fn& fn, std::index_sequence<I...>) {
    const auto all_of = [&](auto& pool, int first) {
      std::size_t left = pool.size();
      for (std::uint32_t slot = 0; left > 0; ++slot)
        if (auto* r = pool.at_slot(slot)) fn(*r, first + static_cast<int>(slot)), --left;
    };
    (all_of(std::get<I>(pools), Types<C...>::offset_of(static_cast<int>(I))), ...);
  }

  // A record is several kilobytes: it is built here, not on the caller's stack.
  template <class F>
  FactorRecord<F>& scratch() {
    return std::get<static_cast<std::size_t>(FactorTypes::template index_of<F>())>(scratch_);
  }
  template <class List>
  struct ScratchOf;
  template <class... C>
  struct ScratchOf<Types<C...>> {
    using type = std::tuple<FactorRecord<typename C::type>...>;
  };

  typename detail::PoolsOf<VariableRecord, VariableTypes>::type variables_{};
  typename detail::PoolsOf<FactorRecord, FactorTypes>::type factors_{};
  typename ScratchOf<FactorTypes>::type scratch_{};
  std::array<VariableInfo, static_cast<std::size_t>(kVariables)> info_{};
  std::array<bool, static_cast<std::size_t>(FactorTypes::size)> enabled_ = [] {
    std::array<bool, static_cast<std::size_t>(FactorTypes::size)> all{};
    for (bool& b : all) b = true;
    return all;
  }();
  StaticVector<int, static_cast<std::size_t>(kStates)> states_{};
};

}  // namespace searvins::smoother
