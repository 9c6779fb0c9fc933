// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The window: typed pools of variables and factors, their keys, and who touches whom.
///
/// Every variable carries three values, and copies to go back to:
///
///     theta       where its factors are linearised
///     estimate    x = theta (+) delta
///     candidate   what the current step proposes; becomes x when the step is accepted
///
/// What depends on a type is here, each operation written once for all types: copy a value, (+), (-), evaluate, linearise, names. What does not is in
/// `tables` (tables.hpp), where the elimination works.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

#include <searvins/core/pool.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/tables.hpp>
#include <searvins/smoother/variable.hpp>

namespace searvins::smoother {

/// A variable's values. `prior`: where the marginal prior was made; `saved_...`: what a failed update returns to.
enum class Which : std::uint8_t { theta, estimate, candidate, prior, saved_theta, saved_estimate };

/// A variable in the window.
template <class V>
struct VariableRecord {
  std::array<V, 6> values{};
  [[nodiscard]] V& operator[](Which w) { return values[static_cast<std::size_t>(w)]; }
  [[nodiscard]] const V& operator[](Which w) const { return values[static_cast<std::size_t>(w)]; }
};

namespace detail {
template <class T, std::size_t N>
struct PoolHolder {
  Pool<T, N> pool{};
};
/// One pool a type; `pool_of<T>(pools)` finds it.
template <template <class> class Record, class List>
struct Pools;
template <template <class> class Record, class... C>
struct Pools<Record, Types<C...>> : PoolHolder<Record<typename C::type>, static_cast<std::size_t>(C::value)>... {};

template <class T, std::size_t N>
[[nodiscard]] Pool<T, N>& pool_of(PoolHolder<T, N>& holder) {
  return holder.pool;
}
template <class T, std::size_t N>
[[nodiscard]] const Pool<T, N>& pool_of(const PoolHolder<T, N>& holder) {
  return holder.pool;
}

/// `fn.operator()<T>()` for the type T at position `type` of the list.
template <class... C, class Fn>
void with_type(Types<C...>, int type, const Fn& fn) {
  int i = 0;
  (void)((type == i++ && (fn.template operator()<typename C::type>(), true)) || ...);
}

template <class T>
using Itself = T;
}  // namespace detail

/// See the file comment.
template <class Problem>
class Window {
 public:
  using Scalar = typename Problem::Scalar;
  using VariableTypes = typename Problem::Variables;
  using FactorTypes = typename Problem::Factors;
  using TablesType = Tables<Scalar, table_sizes<Problem>()>;

  /// Read access for factors: values(key).
  struct Values {
    const Window& window;
    Which which;
    template <class V>
    const V& operator()(const Key<V>& key) const {
      return (*window.record(key))[which];
    }
  };
  [[nodiscard]] Values values(Which which) const { return {*this, which}; }

  /// Adds a variable. Errors: capacity_exceeded; out_of_order when a state is older than the newest.
  template <class V>
  Result<Key<V>> add_variable(const V& value, GpsTime stamp) {
    static_assert(Variable<V>, "this type does not model searvins::smoother::Variable: see the list of members there");
    constexpr int type = VariableTypes::template index_of<V>();
    static_assert(type >= 0, "this variable type is not listed in Problem::Variables");
    auto& states = tables.states;
    if (V::role == Role::state && !states.empty() && stamp < info(states.back()).stamp)
      return failure(StatusCode::out_of_order, "a state is older than the newest state of the window");
    if (V::role == Role::state && states.full()) return failure(StatusCode::capacity_exceeded, "no room for another state: marginalise the oldest first", type);
    VariableRecord<V> fresh;
    fresh[Which::estimate] = fresh[Which::theta] = fresh[Which::candidate] = value;
    const auto inserted = pool<V>().insert(fresh);
    if (!inserted.ok()) return failure(StatusCode::capacity_exceeded, "the pool of this variable type is full: raise its capacity in Problem::Variables", type);
    const Key<V> key{inserted->slot, inserted->generation};
    enter(VariableTypes::offset_of(type) + static_cast<int>(key.slot), key, stamp);
    return key;
  }

  /// Removes a variable that no factor and no prior touches (undoes add_variable). Errors: unknown_key, invalid_argument when it is in use.
  template <class V>
  Status remove_variable(const Key<V>& key) {
    const int id = id_of(key);
    if (id < 0) return failure(StatusCode::unknown_key, "the variable does not live (any more)");
    if (info(id).degree > 0 || info(id).prior >= 0) return failure(StatusCode::invalid_argument, "the variable is in use: remove its factors first", id);
    erase_variable(id);
    return ok_status();
  }

  /// Adds a factor. Errors: unknown_key when a variable does not live, capacity_exceeded, invalid_argument (more than one local variable, a key twice).
  template <class F>
  Result<Key<F>> add_factor(const F& factor) {
    static_assert(Factor<F>, "this type does not model searvins::smoother::Factor: see the list of members there");
    constexpr int type = FactorTypes::template index_of<F>();
    static_assert(type >= 0, "this factor type is not listed in Problem::Factors");
    static_assert(F::max_rows <= std::numeric_limits<std::int16_t>::max(), "a RowSpan counts rows in 16 bits");
    FactorInfo fresh;
    fresh.type = type;
    std::array<int, static_cast<std::size_t>(F::max_keys)> ids{}, axes{};
    if (const Status s = bind(factor, ids.data(), axes.data(), fresh); !s.ok()) return s;
    const auto inserted = factor_pool<F>().insert(factor);
    if (!inserted.ok()) return failure(StatusCode::capacity_exceeded, "the pool of this factor type is full: raise its capacity in Problem::Factors", type);
    enter<F>(static_cast<int>(inserted->slot), ids.data(), axes.data(), fresh);
    return Key<F>{inserted->slot, inserted->generation};
  }

  /// Errors: unknown_key.
  template <class F>
  Status remove_factor(const Key<F>& key) {
    const int id = id_of_factor(key);
    if (id < 0) return failure(StatusCode::unknown_key, "the factor does not live (any more)");
    erase_factor(id);
    return ok_status();
  }

  /// The estimate of a variable, nullptr when the key is stale.
  template <class V>
  [[nodiscard]] const V* find(const Key<V>& key) const {
    const VariableRecord<V>* r = record(key);
    return r ? &(*r)[Which::estimate] : nullptr;
  }
  /// All values of a variable, nullptr when the key is stale.
  template <class V>
  [[nodiscard]] VariableRecord<V>* record(const Key<V>& key) {
    return pool<V>().get(PoolKey<VariableRecord<V>>{key.slot, key.generation});
  }
  template <class V>
  [[nodiscard]] const VariableRecord<V>* record(const Key<V>& key) const {
    return pool<V>().get(PoolKey<VariableRecord<V>>{key.slot, key.generation});
  }
  /// A factor, nullptr when the key is stale.
  template <class F>
  [[nodiscard]] const F* find_factor(const Key<F>& key) const {
    return factor_pool<F>().get(PoolKey<F>{key.slot, key.generation});
  }

  /// Global index of a living variable, -1 when the key is stale.
  template <class V>
  [[nodiscard]] int id_of(const Key<V>& key) const {
    return record(key) ? VariableTypes::offset_of(VariableTypes::template index_of<V>()) + static_cast<int>(key.slot) : -1;
  }
  [[nodiscard]] int id_of(const AnyKey& key) const {
    if (key.type < 0 || key.type >= VariableTypes::size) return -1;
    if (key.slot >= static_cast<std::uint32_t>(VariableTypes::total)) return -1;
    const int id = VariableTypes::offset_of(key.type) + static_cast<int>(key.slot);
    if (id >= VariableTypes::total) return -1;
    const VariableInfo& v = info(id);
    return v.alive && v.type == key.type && v.slot == key.slot && v.generation == key.generation ? id : -1;
  }
  /// Global index of a living factor, -1 when the key is stale.
  template <class F>
  [[nodiscard]] int id_of_factor(const Key<F>& key) const {
    return find_factor(key) ? FactorTypes::offset_of(FactorTypes::template index_of<F>()) + static_cast<int>(key.slot) : -1;
  }
  template <class V>
  [[nodiscard]] static constexpr AnyKey any(const Key<V>& key) {
    return {VariableTypes::template index_of<V>(), key.slot, key.generation};
  }
  [[nodiscard]] AnyKey key_of(int id) const { return {info(id).type, info(id).slot, info(id).generation}; }

  /// States in chronological order, as global indices.
  [[nodiscard]] const auto& states() const { return tables.states; }
  [[nodiscard]] VariableInfo& info(int id) { return tables.variable(id); }
  [[nodiscard]] const VariableInfo& info(int id) const { return tables.variable(id); }

  template <class V>
  [[nodiscard]] std::size_t count() const {
    return pool<V>().size();
  }
  template <class F>
  [[nodiscard]] std::size_t factor_count() const {
    return factor_pool<F>().size();
  }

  // ---- operations by global index, whatever the type ------------------------------------------------------------------------------------------

  /// fn(record) with the record of a variable. For tests and reports; what follows is enough for the smoother.
  template <class Fn>
  void visit_variable(int id, const Fn& fn) {
    detail::with_type(VariableTypes{}, info(id).type, [&]<class V>() { fn(*pool<V>().at_slot(info(id).slot)); });
  }
  /// One value of a variable <- another.
  void assign(int id, Which to, Which from) {
    visit_variable(id, [&](auto& r) { r[to] = r[from]; });
  }
  /// candidate <- theta (+) candidate_delta
  void retract(int id) {
    const Scalar* const step = tables.candidate_delta.data() + info(id).tangent;
    visit_variable(id, [step]<class V>(VariableRecord<V>& r) { r[Which::candidate] = r[Which::theta].retract(Eigen::Map<const Tangent<V>>(step)); });
  }
  /// out <- the first `axes` scalars of  value `to` (-) value `from`
  void local(int id, Which from, Which to, int axes, Scalar* out) {
    visit_variable(id, [&]<class V>(VariableRecord<V>& r) {
      const Tangent<V> d = r[from].local(r[to]);
      std::copy_n(d.data(), axes, out);
    });
  }
  [[nodiscard]] const char* variable_name(int id) const {
    const char* name = "";
    detail::with_type(VariableTypes{}, info(id).type, [&]<class V>() { name = V::name; });
    return name;
  }
  [[nodiscard]] const char* axis_name(int id, int axis) const {
    const char* name = "";
    detail::with_type(VariableTypes{}, info(id).type, [&]<class V>() { name = V::axis_name(axis); });
    return name;
  }
  [[nodiscard]] const char* factor_name(int id) const {
    const char* name = "";
    detail::with_type(FactorTypes{}, tables.factor(id).type, [&]<class F>() { name = F::name; });
    return name;
  }

  /// Rows, weights and cost of a factor at the values `which`; returns the cost.
  Scalar evaluate(int id, Which which) {
    const FactorInfo& info = tables.factor(id);
    Scalar *const e = tables.e.data() + info.first_row, *const w = tables.weights_now.data() + info.first_row;
    Scalar& cost = tables.cost[TablesType::at(id)];
    detail::with_type(FactorTypes{}, info.type, [&]<class F>() {
      const F& factor = factor_at<F>(id);
      factor.evaluate(values(which), e);
      cost = factor.weigh(e, w);
    });
    return cost;
  }
  /// Rows, Jacobian and its spans of a factor at theta.
  void linearise(int id) {
    const FactorInfo& info = tables.factor(id);
    const JacobianRef<Scalar> J{tables.jacobian.data() + info.first_jacobian, info.rows};
    std::fill_n(J.data, static_cast<std::ptrdiff_t>(info.rows) * info.columns, Scalar(0));
    Scalar* const e = tables.e_theta.data() + info.first_row;
    detail::with_type(FactorTypes{}, info.type, [&]<class F>() { factor_at<F>(id).linearise(values(Which::theta), e, J); });
    if (!info.is_small()) tables.find_spans(info);
  }

  /// Erases the variables for whose global index `gone` holds, in ascending order; returns how many.
  template <class Predicate>
  int erase_variables(Predicate gone) {
    return tables.living_variables.erase_if([&](int id) { return gone(id) && (release_variable(id), true); });
  }
  void erase_variable(int id) {
    (void)erase_variables([id](int i) { return i == id; });
  }
  /// Erases the factors for whose global index `gone` holds, in ascending order; returns how many.
  template <class Predicate>
  int erase_factors(Predicate gone) {
    return tables.living_factors.erase_if([&](int id) { return gone(id) && (release_factor(id), true); });
  }
  void erase_factor(int id) {
    (void)erase_factors([id](int i) { return i == id; });
  }

  TablesType tables{};

 private:
  template <class V>
  [[nodiscard]] auto& pool() {
    static_assert(VariableTypes::template index_of<V>() >= 0, "this variable type is not listed in Problem::Variables");
    return detail::pool_of<VariableRecord<V>>(variables_);
  }
  template <class V>
  [[nodiscard]] const auto& pool() const {
    static_assert(VariableTypes::template index_of<V>() >= 0, "this variable type is not listed in Problem::Variables");
    return detail::pool_of<VariableRecord<V>>(variables_);
  }
  template <class F>
  [[nodiscard]] auto& factor_pool() {
    static_assert(FactorTypes::template index_of<F>() >= 0, "this factor type is not listed in Problem::Factors");
    return detail::pool_of<F>(factors_);
  }
  template <class F>
  [[nodiscard]] const auto& factor_pool() const {
    static_assert(FactorTypes::template index_of<F>() >= 0, "this factor type is not listed in Problem::Factors");
    return detail::pool_of<F>(factors_);
  }
  template <class F>
  [[nodiscard]] static std::size_t slot_of(int id) {
    return static_cast<std::size_t>(id - FactorTypes::offset_of(FactorTypes::template index_of<F>()));
  }
  template <class F>
  [[nodiscard]] const F& factor_at(int id) const {
    return *factor_pool<F>().at_slot(slot_of<F>(id));
  }

  void release_variable(int id) {
    const VariableInfo gone = info(id);
    detail::with_type(VariableTypes{}, gone.type, [&]<class V>() { (void)pool<V>().erase(PoolKey<VariableRecord<V>>{gone.slot, gone.generation}); });
    info(id) = VariableInfo{};
    (void)tables.states.erase_if([id](int s) { return s == id; });
  }
  void release_factor(int id) {
    FactorInfo& gone = tables.factor(id);
    for (int k = 0; k < gone.keys; ++k) --info(tables.variables_of(gone)[k]).degree;
    detail::with_type(FactorTypes{}, gone.type, [&]<class F>() { (void)factor_pool<F>().erase(factor_pool<F>().key_of_slot(slot_of<F>(id))); });
    gone = FactorInfo{};
  }

  /// Writes a fresh variable into the tables.
  template <class V>
  void enter(int id, const Key<V>& key, GpsTime stamp) {
    constexpr int type = VariableTypes::template index_of<V>();
    VariableInfo& v = info(id);
    v = VariableInfo{};
    v.alive = true, v.relinearised = true, v.role = V::role, v.type = type, v.dof = V::dof;
    v.slot = key.slot, v.generation = key.generation, v.stamp = stamp;
    v.tangent = kTangentOffset<V> + static_cast<int>(key.slot) * V::dof;
    const Tangent<V> scale = V::linearisation_scale();
    for (int i = 0; i < V::dof; ++i) {
      const std::size_t at = TablesType::at(v.tangent + i);
      tables.delta[at] = tables.candidate_delta[at] = tables.saved_delta[at] = 0;
      tables.scale[at] = scale[i];
    }
    tables.living_variables.insert(id);
    if (V::role == Role::state) (void)tables.states.push_back(id);
  }

  /// Writes a fresh factor into the tables.
  template <class F>
  void enter(int slot, const int* ids, const int* axes, FactorInfo& fresh) {
    constexpr int type = FactorTypes::template index_of<F>();
    const int id = FactorTypes::offset_of(type) + slot;
    fresh.first_key = kFactorOffset<F, 0> + slot * F::max_keys;
    fresh.first_row = kFactorOffset<F, 1> + slot * F::max_rows;
    fresh.first_column = kFactorOffset<F, 2> + slot * F::max_columns;
    fresh.first_jacobian = kFactorOffset<F, 3> + slot * F::max_rows * F::max_columns;
    tables.factor(id) = fresh;
    std::copy_n(ids, fresh.keys, tables.keys.data() + fresh.first_key);
    std::copy_n(axes, fresh.keys, tables.axes.data() + fresh.first_key);
    for (auto* rows : {&tables.e_theta, &tables.weights, &tables.e, &tables.weights_now}) std::fill_n(rows->data() + fresh.first_row, F::max_rows, Scalar(0));
    for (int k = 0; k < fresh.keys; ++k) ++info(ids[k]).degree;
    tables.living_factors.insert(id);
  }

  /// Resolves a factor's keys to global indices, with the leading axes that it touches, and counts its columns.
  template <class F>
  Status bind(const F& factor, int* ids, int* axes, FactorInfo& f) const {
    Status status = ok_status();
    int locals = 0;
    factor.for_each_key([&]<class V>(const Key<V>& key) {
      const int id = id_of(key);
      if (id < 0) status = failure(StatusCode::unknown_key, "a variable of the factor does not live (any more)", f.keys);
      if (!status.ok()) return;
      if (f.keys == F::max_keys) {
        status = failure(StatusCode::capacity_exceeded, "the factor names more variables than its max_keys", f.keys);
        return;
      }
      if (std::find(ids, ids + f.keys, id) != ids + f.keys) status = failure(StatusCode::invalid_argument, "the factor names a variable twice", f.keys);
      locals += V::role == Role::local ? 1 : 0;
      axes[f.keys] = leading_axes_of<F, V>();
      ids[f.keys++] = id;
      f.columns += V::dof;
    });
    if (!status.ok()) return status;
    f.rows = factor.rows();
    if (f.rows < 1 || f.rows > F::max_rows) return failure(StatusCode::invalid_argument, "rows() of the factor lies outside 1..max_rows", f.rows);
    if (f.columns > F::max_columns) return failure(StatusCode::capacity_exceeded, "the factor's variables have more axes than its max_columns", f.columns);
    if (locals > 1) return failure(StatusCode::invalid_argument, "a factor may touch one local variable at most", locals);
    return status;
  }

  /// Places before those of a type: tangents of variables; keys (0), rows (1), columns (2) and Jacobian scalars (3) of factors.
  template <class V, class... C>
  [[nodiscard]] static constexpr int tangents_before(Types<C...>) {
    bool reached = false;
    int sum = 0;
    ((reached = reached || std::is_same_v<V, typename C::type>, sum += reached ? 0 : C::value * C::type::dof), ...);
    return sum;
  }
  template <class F>
  [[nodiscard]] static constexpr int places(int what) {
    const int each[] = {F::max_keys, F::max_rows, F::max_columns, F::max_rows * F::max_columns};
    return each[what];
  }
  template <class F, int What, class... C>
  [[nodiscard]] static constexpr int places_before(Types<C...>) {
    bool reached = false;
    int sum = 0;
    ((reached = reached || std::is_same_v<F, typename C::type>, sum += reached ? 0 : C::value * places<typename C::type>(What)), ...);
    return sum;
  }
  template <class V>
  static constexpr int kTangentOffset = tangents_before<V>(VariableTypes{});
  template <class F, int What>
  static constexpr int kFactorOffset = places_before<F, What>(FactorTypes{});

  detail::Pools<VariableRecord, VariableTypes> variables_{};
  detail::Pools<detail::Itself, FactorTypes> factors_{};
};

}  // namespace searvins::smoother
