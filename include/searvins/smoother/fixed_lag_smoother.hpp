// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The fixed-lag smoother: Gauss-Newton on a sliding window, with marginalisation of what leaves it.
///
/// A Problem names everything at compile time:
///
///     struct Problem {
///       using Scalar = double;
///       using Variables = Types<Capacity<Pva, 16>, Capacity<Ambiguity, 400>>;
///       using Factors = Types<Capacity<MotionFactor, 16>, ...>;
///       static constexpr int max_front_dimension = 256;      // axes of one front: eliminated + separator
///       static constexpr int member_capacity = 4096;         // sum over fronts of eliminated + separator variables
///       static constexpr std::size_t arena_scalars = 1 << 20;  // sum over fronts of (E+S+1) E + (S+1)^2 + S
///     };
///
/// `sizeof(FixedLagSmoother<Problem>)` is all the memory there is; nothing is allocated after construction. The object is large: make it static or
/// allocate it once, never a local.
///
/// One optimise() call repeats, until the step is small or the limit is reached:
///
///     1. relinearise   variables that moved more than the threshold: theta <- x; their factors: e, J at theta
///     2. reweight      robust weights at the estimate x
///     3. eliminate     from the first front that changed
///     4. step          x' = theta (+) d,  accepted when sum rho(x') <= sum rho(x); otherwise halved where the options allow it (d is a direction
///                      of descent: no new factorisation), then damped and solved again
///
/// Guarantees: an operation that fails leaves values, prior and structure as they were, bit for bit. Same calls, same bits.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <searvins/smoother/covariance.hpp>
#include <searvins/smoother/elimination.hpp>
#include <searvins/smoother/marginal_prior.hpp>
#include <searvins/smoother/optimise.hpp>
#include <searvins/smoother/window.hpp>

namespace searvins::smoother {

/// See the file comment.
template <class Problem>
class FixedLagSmoother {
 public:
  using Scalar = typename Problem::Scalar;
  using WindowType = Window<Problem>;
  using EliminationType = Elimination<typename WindowType::TablesType, elimination_sizes<Problem>()>;
  using Options = OptimiseOptions<Scalar>;
  using Report = OptimiseReport<Scalar>;

  /// Adds a variable; states in chronological order. Errors: capacity_exceeded, out_of_order.
  template <class V>
  Result<Key<V>> add_variable(const V& value, GpsTime stamp) {
    changed_ = true;
    return window_.add_variable(value, stamp);
  }
  /// Undoes add_variable. Errors: unknown_key, invalid_argument when the variable is in use.
  template <class V>
  Status remove_variable(const Key<V>& key) {
    changed_ = true;
    return window_.remove_variable(key);
  }
  /// Adds a factor. Errors: unknown_key, capacity_exceeded, invalid_argument.
  template <class F>
  Result<Key<F>> add_factor(const F& factor) {
    changed_ = true;
    return window_.add_factor(factor);
  }
  template <class F>
  Status remove_factor(const Key<F>& key) {
    changed_ = true;
    return window_.remove_factor(key);
  }

  /// The estimate of a variable, nullptr when the key is stale.
  template <class V>
  [[nodiscard]] const V* find(const Key<V>& key) const {
    return window_.find(key);
  }
  /// Overwrites an estimate (a better start). Errors: unknown_key.
  template <class V>
  Status set_value(const Key<V>& key, const V& value) {
    VariableRecord<V>* r = window_.record(key);
    if (!r) return failure(StatusCode::unknown_key, "the variable does not live (any more)");
    const int id = window_.id_of(key);
    (*r)[Which::estimate] = value;
    Eigen::Map<Tangent<V>>{tables().delta.data() + window_.info(id).tangent} = (*r)[Which::theta].local(value);
    for (int f : tables().living_factors) {
      FactorInfo& factor = tables().factor(f);
      const int* const ids = tables().variables_of(factor);
      if (std::find(ids, ids + factor.keys, id) != ids + factor.keys) factor.evaluated = false;
    }
    return ok_status();
  }
  template <class F>
  [[nodiscard]] const F* find_factor(const Key<F>& key) const {
    return window_.find_factor(key);
  }
  /// Robust weights of a factor's rows at the last accepted estimate, nullptr when the key is stale.
  template <class F>
  [[nodiscard]] const Scalar* weights(const Key<F>& key) const {
    const int id = window_.id_of_factor(key);
    return id < 0 ? nullptr : window_.tables.weights_now.data() + window_.tables.factor(id).first_row;
  }
  /// Whitened rows of a factor at the last evaluated estimate, nullptr when the key is stale.
  template <class F>
  [[nodiscard]] const Scalar* whitened_rows(const Key<F>& key) const {
    const int id = window_.id_of_factor(key);
    return id < 0 ? nullptr : window_.tables.e.data() + window_.tables.factor(id).first_row;
  }

  /// Switches all factors of a type off or on. Off, they keep their place and count for nothing, also when marginalised: what the prior should never
  /// contain (integer priors) is switched off before marginalise_oldest().
  template <class F>
  void set_enabled(bool on) {
    constexpr int type = WindowType::FactorTypes::template index_of<F>();
    static_assert(type >= 0, "this factor type is not listed in Problem::Factors");
    bool& enabled = tables().type_enabled[static_cast<std::size_t>(type)];
    if (enabled == on) return;
    enabled = on;
    const bool analysed = ensure_analysis();  // where not, every front is dirty already
    for (int id : tables().living_factors) {
      FactorInfo& f = tables().factor(id);
      if (f.type != type) continue;
      f.linearised = f.evaluated = false;  // while off it does not follow its variables
      if (analysed) elimination_.mark_dirty_from(f.front);
    }
  }

  [[nodiscard]] const WindowType& window() const { return window_; }
  [[nodiscard]] WindowType& window() { return window_; }
  [[nodiscard]] const auto& prior() const { return prior_; }

  /// Minimises the window. See the file comment and OptimiseReport.
  Report optimise(const Options& options = {});

  /// Marginalises the oldest state, with the chain variables whose last use it is, the local variables it sees first, and all their factors. Robust
  /// weights are re-evaluated before they are frozen. Errors: no_data; capacity_exceeded, non_finite (the window is then unchanged).
  MarginaliseReport marginalise_oldest(const Options& options = {});

  /// Forgets everything: no variables, factors or prior; every key is stale afterwards.
  void clear();

  /// Joint covariance (column-major, leading dimension ld) of any living variables, in the order of the keys, from the undamped factor at the present
  /// linearisation. Returns its size. Errors: no_data, unknown_key, capacity_exceeded, under_determined, invalid_argument.
  Result<int> joint_covariance(const AnyKey* keys, int count, Scalar* out, int ld);

  template <class V>
  Result<Eigen::Matrix<Scalar, V::dof, V::dof>> covariance(const Key<V>& key) {
    Eigen::Matrix<Scalar, V::dof, V::dof> out;
    const AnyKey any = WindowType::any(key);
    const auto size = joint_covariance(&any, 1, out.data(), V::dof);
    if (!size.ok()) return size.status();
    return out;
  }

  /// Sum of rho at the present estimate, prior included.
  [[nodiscard]] Scalar cost();

 private:
  /// Share of the cost that its summation may round away: a step within it is no increase.
  static constexpr Scalar kCostRounding = std::max(Scalar(1e-9), 16 * std::numeric_limits<Scalar>::epsilon());

  [[nodiscard]] typename WindowType::TablesType& tables() { return window_.tables; }

  /// Rows and weights of every enabled factor at the values `which`; returns the total cost. At the estimate, rows that are there already stay.
  Scalar evaluate(Which which) {
    Scalar total = prior_.evaluate(window_, which);
    for (int id : tables().living_factors) {
      FactorInfo& f = tables().factor(id);
      if (!tables().enabled(f)) continue;
      const bool known = which == Which::estimate && f.evaluated;
      total += known ? tables().cost[static_cast<std::size_t>(id)] : window_.evaluate(id, which);
      f.evaluated = which == Which::estimate;
    }
    return total;
  }

  /// Steps 1 and 2 of the file comment. Needs weights_now at the estimate.
  void relinearise(const Options& options) {
    move_linearisation_points(options);
    linearise_factors(options.weight_threshold);
  }

  /// theta <- x of the variables that moved more than the threshold.
  void move_linearisation_points(const Options& options) {
    for (int id : tables().living_variables) {
      VariableInfo& info = window_.info(id);
      if (info.prior >= 0 && options.prior == PriorLinearisation::first_estimate) continue;
      Scalar* const delta = tables().delta.data() + info.tangent;
      const Scalar* const scale = tables().scale.data() + info.tangent;
      for (int i = 0; i < info.dof; ++i)
        if (std::abs(delta[i]) > options.relinearise_threshold * scale[i]) info.relinearised = true;
      if (!info.relinearised) continue;
      window_.assign(id, Which::theta, Which::estimate);
      window_.assign(id, Which::candidate, Which::estimate);
      std::fill_n(delta, info.dof, Scalar(0));
      std::fill_n(tables().candidate_delta.data() + info.tangent, info.dof, Scalar(0));  // a local variable without factors gets no step
      if (info.prior >= 0) elimination_.mark_dirty_from(prior_front());
    }
  }

  /// Rows and Jacobians of the factors whose variables' theta moved; weights that changed by more than the threshold.
  void linearise_factors(Scalar weight_threshold) {
    int first_changed = elimination_.front_count();
    for (int id : tables().living_factors) {
      FactorInfo& f = tables().factor(id);
      if (!tables().enabled(f)) continue;
      bool moved = !f.linearised;
      for (int k = 0; k < f.keys; ++k) moved = moved || window_.info(tables().variables_of(f)[k]).relinearised;
      if (moved) window_.linearise(id), f.linearised = true;
      Scalar* const weights = tables().weights.data() + f.first_row;
      const Scalar* const now = tables().weights_now.data() + f.first_row;
      bool reweighted = moved;
      for (int i = 0; i < f.rows; ++i) reweighted = reweighted || std::abs(now[i] - weights[i]) > weight_threshold;
      if (!reweighted) continue;
      std::copy_n(now, f.rows, weights);
      first_changed = std::min(first_changed, f.front);
    }
    elimination_.mark_dirty_from(first_changed);
    for (int id : tables().living_variables) window_.info(id).relinearised = false;
  }

  [[nodiscard]] EliminationFailure<Scalar> factorise(Scalar damping, math::ZeroPivot policy = math::ZeroPivot::fail, int only = -1) {
    (void)prior_.evaluate(window_, Which::theta);
    return elimination_.factorise(tables(), prior_, damping, policy, only);
  }

  /// candidate = theta (+) candidate_delta; returns its cost.
  [[nodiscard]] Scalar propose() {
    for (int id : tables().living_variables) {
      const VariableInfo& info = window_.info(id);
      if (info.role != Role::local || info.first_factor >= 0) window_.retract(id);
    }
    return evaluate(Which::candidate);
  }
  [[nodiscard]] static bool decreases(Scalar proposed, Scalar cost) {
    return std::isfinite(proposed) && proposed <= cost + kCostRounding * (Scalar(1) + std::abs(cost));
  }
  /// candidate_delta to the middle between the estimate and the candidate: same direction, along which the cost falls at first.
  void halve_step() {
    for (int id : tables().living_variables) {
      const VariableInfo& info = window_.info(id);
      Scalar* const candidate = tables().candidate_delta.data() + info.tangent;
      const Scalar* const delta = tables().delta.data() + info.tangent;
      for (int i = 0; i < info.dof; ++i) candidate[i] = (candidate[i] + delta[i]) / 2;
    }
  }

  [[nodiscard]] int prior_front() const {
    int front = elimination_.front_count() - 1;
    for (int id : prior_.variables) front = std::min(front, window_.info(id).front);
    return front;
  }

  [[nodiscard]] bool ensure_analysis() {
    if (!changed_) return true;
    changed_ = !elimination_.analyse(tables(), prior_);
    return !changed_;
  }

  /// A current, undamped factorisation of the present linearisation.
  Status ensure_factor() {
    bool pending = false;
    for (int id : tables().living_factors) {
      const FactorInfo& f = tables().factor(id);
      pending = pending || (tables().enabled(f) && !f.linearised);
    }
    if (pending) {
      (void)evaluate(Which::estimate);
      linearise_factors(0);  // theta stays: whether a variable may move is for optimise() to say
    }
    if (damped_) elimination_.mark_dirty_from(0), damped_ = false;
    const auto failed = factorise(0);
    UnderDetermined where;
    return failed.ok() ? ok_status() : describe(failed, where);
  }

  [[nodiscard]] Scalar largest_step() {
    Scalar largest = 0;
    for (int id : tables().living_variables)
      for (int i = 0; i < window_.info(id).dof; ++i) {
        const std::size_t at = static_cast<std::size_t>(window_.info(id).tangent + i);
        largest = std::max(largest, std::abs(tables().candidate_delta[at] - tables().delta[at]) / tables().scale[at]);
      }
    return largest;
  }

  /// to <- from of a tangent table, for a variable.
  static void copy_tangent(const VariableInfo& info, auto& to, const auto& from) {
    std::copy_n(from.data() + info.tangent, info.dof, to.data() + info.tangent);
  }

  void accept() {
    for (int id : tables().living_variables) {
      window_.assign(id, Which::estimate, Which::candidate);
      copy_tangent(window_.info(id), tables().delta, tables().candidate_delta);
    }
    for (int id : tables().living_factors) {  // rows at the candidate are rows at the estimate from here on
      FactorInfo& f = tables().factor(id);
      f.evaluated = tables().enabled(f);
    }
  }
  void save() {
    for (int id : tables().living_variables) {
      window_.assign(id, Which::saved_estimate, Which::estimate);
      window_.assign(id, Which::saved_theta, Which::theta);
      window_.assign(id, Which::candidate, Which::estimate);
      copy_tangent(window_.info(id), tables().saved_delta, tables().delta);
      copy_tangent(window_.info(id), tables().candidate_delta, tables().delta);
    }
  }

  /// Restores what optimise() found and reports why.
  Report give_up(Report report, const Status& status) {
    for (int id : tables().living_variables) {
      window_.assign(id, Which::estimate, Which::saved_estimate);
      window_.assign(id, Which::theta, Which::saved_theta);
      copy_tangent(window_.info(id), tables().delta, tables().saved_delta);
      window_.info(id).relinearised = true;  // the factors may hold another linearisation
    }
    for (int id : tables().living_factors) tables().factor(id).linearised = tables().factor(id).evaluated = false;
    elimination_.mark_dirty_from(0);
    (void)evaluate(Which::estimate);  // rows and weights are those of the estimate again
    report.status = status;
    report.final_cost = report.initial_cost;
    return report;
  }

  [[nodiscard]] Status describe(const EliminationFailure<Scalar>& failed, UnderDetermined& where) {
    using Kind = typename EliminationFailure<Scalar>::Kind;
    switch (failed.kind) {
      case Kind::front_too_large: return failure(StatusCode::capacity_exceeded, "a front has more axes than Problem::max_front_dimension", failed.axis, EliminationType::kMaxFront);
      case Kind::arena_full: return failure(StatusCode::capacity_exceeded, "Problem::arena_scalars is too small for this window", failed.axis);
      case Kind::non_finite: return failure(StatusCode::non_finite, "a pivot is not finite: a Jacobian or a weight is broken", failed.variable, failed.axis);
      default: break;
    }
    where.variable = window_.key_of(failed.variable);
    where.stamp = window_.info(failed.variable).stamp;
    where.axis = failed.axis;
    where.pivot = static_cast<double>(failed.pivot);
    where.factor_count = window_.info(failed.variable).degree;
    where.variable_name = window_.variable_name(failed.variable), where.axis_name = window_.axis_name(failed.variable, failed.axis);
    for (int id : tables().living_factors) {
      const FactorInfo& f = tables().factor(id);
      const int* const ids = tables().variables_of(f);
      if (std::find(ids, ids + f.keys, failed.variable) == ids + f.keys) continue;
      const char* const name = window_.factor_name(id);
      if (std::find(where.factor_names.begin(), where.factor_names.end(), name) == where.factor_names.end()) (void)where.factor_names.push_back(name);
    }
    return failure(StatusCode::under_determined, "the window says nothing about an axis of a variable: see OptimiseReport::where", failed.variable, failed.axis,
                   static_cast<double>(failed.pivot));
  }

  /// Turns the update matrix of front 0 into the prior that replaces the present one (or is joined with it, when it lies in a later front).
  Status form_prior() {
    const auto& front = elimination_.front(0);
    const bool join = !prior_.empty() && prior_front() != 0;
    auto& next = next_prior_;
    next.variables.clear();
    next.dimension = 0;
    const auto append = [&](int id, int axes) {
      if (next.dimension + axes > EliminationType::kMaxFront) return false;
      row_[static_cast<std::size_t>(id)] = next.dimension;
      axes_[static_cast<std::size_t>(id)] = axes;
      next.dimension += axes;
      return next.variables.push_back(id);
    };
    const auto known_axes = [&](int id) { return join ? window_.info(id).prior_axes : 0; };
    const int first = front.first + front.eliminated, end = first + front.separated;
    for (int k = first; k < end; ++k)
      if (const int id = elimination_.member(k); !append(id, std::max(elimination_.axes(k), known_axes(id)))) return failure(StatusCode::capacity_exceeded, "the prior has more axes than Problem::max_front_dimension");
    if (join)
      for (int id : prior_.variables) {
        const bool known = std::find(next.variables.begin(), next.variables.end(), id) != next.variables.end();
        if (!known && !append(id, known_axes(id))) return failure(StatusCode::capacity_exceeded, "the prior has more axes than Problem::max_front_dimension");
      }
    const std::size_t n = static_cast<std::size_t>(next.dimension);
    std::fill_n(next.H.begin(), n * n, Scalar(0));
    std::fill_n(next.g.begin(), n, Scalar(0));
    std::fill_n(next.reference.begin(), n, Scalar(0));
    const Scalar* const U = elimination_.update_of(0);
    const Scalar* const reference = elimination_.reference_of(0);
    const int m = front.rows_s;
    int rows = 0;  // of the update matrix; they keep their order in the prior
    for (int k = first; k < end; ++k)
      for (int i = 0; i < elimination_.axes(k); ++i) to_row_[static_cast<std::size_t>(rows++)] = row_[static_cast<std::size_t>(elimination_.member(k))] + i;
    for (int j = 0; j < m; ++j) {
      const int to = to_row_[static_cast<std::size_t>(j)];
      for (int i = j; i < m; ++i) next.h(to_row_[static_cast<std::size_t>(i)], to) = U[static_cast<std::ptrdiff_t>(j) * (m + 1) + i];
      next.g[static_cast<std::size_t>(to)] = U[static_cast<std::ptrdiff_t>(j) * (m + 1) + m];
      next.reference[static_cast<std::size_t>(to)] = reference[j];
    }
    next.c = 0;  // counted from the expansion point: the sum of all past costs would swamp the differences that step control compares
    if (join) {
      prior_.move_to_theta(window_);
      for (int a : prior_.variables)
        for (int i = 0; i < window_.info(a).prior_axes; ++i) {
          const int from = window_.info(a).prior + i, to = row_[static_cast<std::size_t>(a)] + i;
          next.g[static_cast<std::size_t>(to)] += prior_.g[static_cast<std::size_t>(from)];
          next.reference[static_cast<std::size_t>(to)] += prior_.reference[static_cast<std::size_t>(from)];
          for (int b : prior_.variables)
            for (int j = 0; j < window_.info(b).prior_axes; ++j) {
              const int from_b = window_.info(b).prior + j, to_b = row_[static_cast<std::size_t>(b)] + j;
              if (to >= to_b) next.h(to, to_b) += prior_.h(std::max(from, from_b), std::min(from, from_b));
            }
        }
      elimination_.mark_dirty_from(0);
    }
    bool finite = true;
    for (std::size_t i = 0; i < n; ++i) finite = finite && std::isfinite(next.g[i]);
    for (std::size_t i = 0; i < n * n; ++i) finite = finite && std::isfinite(next.H[i]);
    if (!finite) return failure(StatusCode::non_finite, "the information left by the oldest state is not finite: a Jacobian or a weight of its factors is broken");
    return ok_status();
  }

  void remove_first_front(MarginaliseReport& report) {
    const auto front = elimination_.front(0);
    for (int k = 0; k < front.eliminated; ++k) {
      const VariableInfo& info = window_.info(elimination_.member(front.first + k));
      if (info.degree == 0 && info.prior < 0) ++report.unconnected;
    }
    report.skipped_axes = zero_pivots(front);
    prior_.clear(window_);
    report.factors = window_.erase_factors([this](int id) { return tables().factor(id).front == 0; });
    for (int l = front.first_local; l >= 0;) {
      const int next = window_.info(l).next;
      window_.erase_variable(l);
      ++report.variables;
      l = next;
    }
    erase_idle_locals(window_.info(window_.states().front()).stamp, report);
    for (int k = 0; k < front.eliminated; ++k) {
      const int id = elimination_.member(front.first + k);
      window_.erase_variable(id);
      ++report.variables;
    }
    prior_.variables = next_prior_.variables;
    prior_.dimension = next_prior_.dimension;
    const std::size_t n = static_cast<std::size_t>(prior_.dimension);
    std::copy_n(next_prior_.H.begin(), n * n, prior_.H.begin());
    std::copy_n(next_prior_.g.begin(), n, prior_.g.begin());
    std::copy_n(next_prior_.reference.begin(), n, prior_.reference.begin());
    prior_.c = next_prior_.c;
    int row = 0;
    for (int id : prior_.variables) {
      window_.info(id).prior = row;
      window_.info(id).prior_axes = axes_[static_cast<std::size_t>(id)];
      row += window_.info(id).prior_axes;
      window_.assign(id, Which::prior, Which::theta);
    }
    elimination_.drop_first_front();
    changed_ = true;
  }

  /// Local variables that lost their last factor leave with the state of their time.
  void erase_idle_locals(GpsTime leaving, MarginaliseReport& report) {
    const int idle = window_.erase_variables([&](int id) {
      const VariableInfo& info = window_.info(id);
      return info.role == Role::local && info.degree == 0 && info.stamp <= leaving;
    });
    report.unconnected += idle;
    report.variables += idle;
  }

  /// Axes of front 0 whose pivot was passed over: nothing is known about them.
  [[nodiscard]] int zero_pivots(const Front& front) const {
    const Scalar* const L = elimination_.factor_of(0);
    int zero = 0;
    for (int i = 0; i < front.rows_e; ++i) zero += L[static_cast<std::ptrdiff_t>(i) * (front.border() + 1) + i] > 0 ? 0 : 1;
    return zero;
  }

  WindowType window_{};
  EliminationType elimination_{};
  typename EliminationType::Prior prior_{}, next_prior_{};
  Covariance<EliminationType> covariance_{};
  std::array<int, static_cast<std::size_t>(WindowType::VariableTypes::total)> ids_{}, row_{}, axes_{};
  std::array<int, static_cast<std::size_t>(EliminationType::kMaxFront)> to_row_{};
  bool changed_{true};
  bool damped_{false};  ///< the stored fronts contain damping
};

// ---- the interface: outside the class, so that a file that sees it declared `extern template` does not instantiate it and all below it -------------------

template <class Problem>
auto FixedLagSmoother<Problem>::optimise(const Options& options) -> Report {
  Report report;
  if (window_.states().empty()) {
    report.status = failure(StatusCode::no_data, "the window holds no state: add one first");
    return report;
  }
  save();
  if (!ensure_analysis()) return give_up(report, failure(StatusCode::capacity_exceeded, "Problem::member_capacity is too small for this window"));
  Scalar cost = evaluate(Which::estimate);
  report.initial_cost = report.final_cost = cost;
  if (!std::isfinite(cost)) return give_up(report, failure(StatusCode::non_finite, "the cost of the present estimate is not finite: a factor or a value is broken"));
  for (report.iterations = 1; report.iterations <= options.max_iterations; ++report.iterations) {
    relinearise(options);
    if (damped_) elimination_.mark_dirty_from(0), damped_ = false;
    Scalar damping = 0;
    bool accepted = false, whole = true;
    Scalar step = 0;
    for (int attempt = 0; attempt <= options.max_damping_steps; ++attempt) {
      report.fronts_factored += elimination_.front_count() - elimination_.first_dirty();
      const auto failure_report = factorise(damping);
      if (!failure_report.ok()) {
        const Status why = describe(failure_report, report.where);  // fills `where` before the report is copied
        return give_up(report, why);
      }
      elimination_.solve(tables());
      Scalar proposed = propose();
      for (int halvings = 0; damping == 0 && !decreases(proposed, cost) && halvings < options.max_step_halvings; ++halvings) {
        halve_step();
        proposed = propose();
        ++report.halved_steps, whole = false;
      }
      step = largest_step();
      if (decreases(proposed, cost)) {
        cost = proposed, accepted = true;
        break;
      }
      damping = damping > 0 ? damping * 10 : options.initial_damping;
      damped_ = true;
      ++report.damped_steps;
      elimination_.mark_dirty_from(0);
    }
    if (!accepted) {
      // A vanishing step that rounding keeps from decreasing the cost is convergence, not failure.
      if (step <= options.step_tolerance) {
        (void)evaluate(Which::estimate);
        report.last_step = step;
        report.status = ok_status();
        return report;
      }
      return give_up(report, failure(StatusCode::not_converged, "no damped step decreased the robust cost: values are as before"));
    }
    accept();
    report.final_cost = cost, report.last_step = step;
    if (whole && step <= options.step_tolerance) {  // a halved step is short because it was halved
      report.status = ok_status();
      return report;
    }
  }
  --report.iterations;
  report.status = failure(StatusCode::not_converged, "the iteration limit was reached; the improved values are kept", report.iterations);
  return report;
}

template <class Problem>
auto FixedLagSmoother<Problem>::marginalise_oldest(const Options& options) -> MarginaliseReport {
  MarginaliseReport report;
  if (window_.states().empty()) {
    report.status = failure(StatusCode::no_data, "the window holds no state");
    return report;
  }
  if (!ensure_analysis()) {
    report.status = failure(StatusCode::capacity_exceeded, "Problem::member_capacity is too small for this window");
    return report;
  }
  (void)evaluate(Which::estimate);
  relinearise(options);
  if (damped_) elimination_.mark_dirty_from(0), damped_ = false;
  const auto failed = factorise(0, math::ZeroPivot::skip, 0);
  if (!failed.ok()) {
    UnderDetermined where;
    report.status = describe(failed, where);
    return report;
  }
  if (report.status = form_prior(); !report.status.ok()) {
    elimination_.mark_dirty_from(0);  // front 0 was factored without the test for zero pivots
    return report;
  }
  remove_first_front(report);
  return report;
}

template <class Problem>
void FixedLagSmoother<Problem>::clear() {
  prior_.clear(window_);
  (void)window_.erase_factors([](int) { return true; });
  (void)window_.erase_variables([](int) { return true; });
  elimination_.clear();
  changed_ = true, damped_ = false;
}

template <class Problem>
Result<int> FixedLagSmoother<Problem>::joint_covariance(const AnyKey* keys, int count, Scalar* out, int ld) {
  if (window_.states().empty()) return failure(StatusCode::no_data, "the window holds no state: add one first");
  if (!ensure_analysis()) return failure(StatusCode::capacity_exceeded, "Problem::member_capacity is too small for this window");
  int n = 0;
  if (count < 1 || count > static_cast<int>(ids_.size())) return failure(StatusCode::invalid_argument, "number of variables out of range", count);
  for (int k = 0; k < count; ++k) {
    ids_[static_cast<std::size_t>(k)] = window_.id_of(keys[k]);
    if (ids_[static_cast<std::size_t>(k)] < 0) return failure(StatusCode::unknown_key, "the variable does not live (any more)", k);
    n += window_.info(ids_[static_cast<std::size_t>(k)]).dof;
  }
  if (n > ld) return failure(StatusCode::invalid_argument, "the leading dimension is smaller than the joint tangent space", n, ld);
  if (const Status s = ensure_factor(); !s.ok()) return s;
  const int size = covariance_.joint(tables(), elimination_, ids_.data(), count, out, ld);
  if (size < 0) return failure(StatusCode::under_determined, "a local variable without factors has no covariance");
  return size;
}

template <class Problem>
auto FixedLagSmoother<Problem>::cost() -> Scalar { return evaluate(Which::estimate); }

}  // namespace searvins::smoother
