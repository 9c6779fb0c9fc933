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
///     4. step          x' = theta (+) d,  accepted when sum rho(x') <= sum rho(x); otherwise damped and solved again
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

template <class Problem>
class FixedLagSmoother {
 public:
  using Scalar = typename Problem::Scalar;
  using WindowType = Window<Problem>;
  using EliminationType = Elimination<Problem>;
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
    r->x = value;
    r->delta = r->theta.local(value);
    return ok_status();
  }
  template <class F>
  [[nodiscard]] const F* find_factor(const Key<F>& key) {
    FactorRecord<F>* r = window_.factor_record(key);
    return r ? &r->factor : nullptr;
  }
  /// Robust weights of a factor's rows at the last accepted estimate, nullptr when the key is stale.
  template <class F>
  [[nodiscard]] const Scalar* weights(const Key<F>& key) {
    FactorRecord<F>* r = window_.factor_record(key);
    return r ? r->weights_now.data() : nullptr;
  }
  /// Whitened rows of a factor at the last evaluated estimate, nullptr when the key is stale.
  template <class F>
  [[nodiscard]] const Scalar* whitened_rows(const Key<F>& key) {
    FactorRecord<F>* r = window_.factor_record(key);
    return r ? r->e.data() : nullptr;
  }

  /// Switches all factors of a type off or on. Off, they keep their place and count for nothing, also when marginalised: what the prior should never
  /// contain (integer priors) is switched off before marginalise_oldest().
  template <class F>
  void set_enabled(bool on) {
    if (window_.template enabled<F>() == on) return;
    window_.template set_enabled<F>(on);
    const bool analysed = ensure_analysis();  // where not, every front is dirty already
    window_.for_each_factor([&]<class G>(FactorRecord<G>& r, int) {
      if constexpr (std::is_same_v<G, F>) {
        r.linearised = false;  // while off it does not follow its variables
        if (analysed) elimination_.mark_dirty_from(r.front);
      }
    });
  }

  [[nodiscard]] const WindowType& window() const { return window_; }
  [[nodiscard]] WindowType& window() { return window_; }
  [[nodiscard]] const auto& prior() const { return prior_; }

  /// Minimises the window. See the file comment and OptimiseReport.
  Report optimise(const Options& options = {}) {
    Report report;
    if (window_.states().empty()) {
      report.status = failure(StatusCode::no_data, "the window holds no state: add one first");
      return report;
    }
    save();
    if (!ensure_analysis()) return give_up(report, failure(StatusCode::capacity_exceeded, "Problem::member_capacity is too small for this window"));
    Scalar cost = evaluate<Which::estimate>();
    report.initial_cost = report.final_cost = cost;
    if (!std::isfinite(cost)) return give_up(report, failure(StatusCode::non_finite, "the cost of the present estimate is not finite: a factor or a value is broken"));
    for (report.iterations = 1; report.iterations <= options.max_iterations; ++report.iterations) {
      relinearise(options);
      if (damped_) elimination_.mark_dirty_from(0), damped_ = false;
      Scalar damping = 0;
      bool accepted = false;
      Scalar step = 0;
      for (int attempt = 0; attempt <= options.max_damping_steps; ++attempt) {
        report.fronts_factored += elimination_.front_count() - elimination_.first_dirty();
        const auto failure_report = elimination_.factorise(window_, prior_, damping);
        if (!failure_report.ok()) {
          const Status why = describe(failure_report, report.where);  // fills `where` before the report is copied
          return give_up(report, why);
        }
        elimination_.solve(window_);
        const Scalar proposed = evaluate<Which::candidate>();
        step = largest_step();
        if (std::isfinite(proposed) && proposed <= cost + kCostRounding * (Scalar(1) + std::abs(cost))) {
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
          (void)evaluate<Which::estimate>();
          report.last_step = step;
          report.status = ok_status();
          return report;
        }
        return give_up(report, failure(StatusCode::not_converged, "no damped step decreased the robust cost: values are as before"));
      }
      accept();
      report.final_cost = cost, report.last_step = step;
      if (step <= options.step_tolerance) {
        report.status = ok_status();
        return report;
      }
    }
    --report.iterations;
    report.status = failure(StatusCode::not_converged, "the iteration limit was reached; the improved values are kept", report.iterations);
    return report;
  }

  /// Marginalises the oldest state, with the chain variables whose last use it is, the local variables it sees first, and all their factors. Robust
  /// weights are re-evaluated before they are frozen. Errors: no_data; capacity_exceeded, non_finite (the window is then unchanged).
  MarginaliseReport marginalise_oldest(const Options& options = {}) {
    MarginaliseReport report;
    if (window_.states().empty()) {
      report.status = failure(StatusCode::no_data, "the window holds no state");
      return report;
    }
    if (!ensure_analysis()) {
      report.status = failure(StatusCode::capacity_exceeded, "Problem::member_capacity is too small for this window");
      return report;
    }
    (void)evaluate<Which::estimate>();
    relinearise(options);
    if (damped_) elimination_.mark_dirty_from(0), damped_ = false;
    const auto failed = elimination_.factorise(window_, prior_, Scalar(0), math::ZeroPivot::skip, 0);
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

  /// Forgets everything: no variables, factors or prior; every key is stale afterwards.
  void clear() {
    prior_.clear(window_);
    int n = 0;
    window_.for_each_factor([&](auto&, int id) { doomed_[static_cast<std::size_t>(n++)] = id; });
    for (int i = 0; i < n; ++i) window_.erase_factor(doomed_[static_cast<std::size_t>(i)]);
    n = 0;
    window_.for_each_variable([&](auto&, int id) { row_[static_cast<std::size_t>(n++)] = id; });
    for (int i = 0; i < n; ++i) window_.erase_variable(row_[static_cast<std::size_t>(i)]);
    elimination_.clear();
    changed_ = true, damped_ = false;
  }

  /// Joint covariance (column-major, leading dimension ld) of any living variables, in the order of the keys, from the undamped factor at the present
  /// linearisation. Returns its size. Errors: no_data, unknown_key, capacity_exceeded, under_determined, invalid_argument.
  Result<int> joint_covariance(const AnyKey* keys, int count, Scalar* out, int ld) {
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
    const int size = covariance_.joint(window_, elimination_, ids_.data(), count, out, ld);
    if (size < 0) return failure(StatusCode::under_determined, "a local variable without factors has no covariance");
    return size;
  }

  template <class V>
  Result<Eigen::Matrix<Scalar, V::dof, V::dof>> covariance(const Key<V>& key) {
    Eigen::Matrix<Scalar, V::dof, V::dof> out;
    const AnyKey any = WindowType::any(key);
    const auto size = joint_covariance(&any, 1, out.data(), V::dof);
    if (!size.ok()) return size.status();
    return out;
  }

  /// Sum of rho at the present estimate, prior included.
  [[nodiscard]] Scalar cost() { return evaluate<Which::estimate>(); }

 private:
  /// Share of the cost that its summation may round away: a step within it is no increase.
  static constexpr Scalar kCostRounding = std::max(Scalar(1e-9), 16 * std::numeric_limits<Scalar>::epsilon());

  /// Rows and weights of every enabled factor at the values W; returns the total cost.
  template <Which W>
  Scalar evaluate() {
    Scalar total = prior_.template evaluate<W>(window_);
    const typename WindowType::template Values<W> values{window_};
    window_.for_each_factor([&]<class F>(FactorRecord<F>& r, int) {
      if (!window_.template enabled<F>()) return;
      r.factor.evaluate(values, r.e.data());
      total += r.factor.weigh(r.e.data(), r.weights_now.data());
    });
    return total;
  }

  /// Steps 1 and 2 of the file comment. Needs weights_now at the estimate.
  void relinearise(const Options& options) {
    move_linearisation_points(options);
    linearise_factors(options.weight_threshold);
  }

  /// theta <- x of the variables that moved more than the threshold.
  void move_linearisation_points(const Options& options) {
    window_.for_each_variable([&]<class V>(VariableRecord<V>& r, int id) {
      VariableInfo& info = window_.info(id);
      if (info.prior >= 0 && options.prior == PriorLinearisation::first_estimate) return;
      const Tangent<V> scale = V::linearisation_scale();
      for (int i = 0; i < V::dof; ++i)
        if (std::abs(r.delta[i]) > options.relinearise_threshold * scale[i]) info.relinearised = true;
      if (!info.relinearised) return;
      r.theta = r.candidate = r.x;
      r.delta.setZero();
      r.candidate_delta.setZero();  // a local variable without factors gets no step: its candidate stays here
      if (info.prior >= 0) elimination_.mark_dirty_from(prior_front());
    });
  }

  /// Rows and Jacobians of the factors whose variables' theta moved; weights that changed by more than the threshold.
  void linearise_factors(Scalar weight_threshold) {
    const typename WindowType::template Values<Which::theta> values{window_};
    window_.for_each_factor([&]<class F>(FactorRecord<F>& r, int) {
      if (!window_.template enabled<F>()) return;
      bool moved = !r.linearised;
      for (int k = 0; k < r.keys; ++k) moved = moved || window_.info(r.variables[static_cast<std::size_t>(k)]).relinearised;
      if (moved) {
        r.jacobian.fill(0);
        r.factor.linearise(values, r.e_theta.data(), JacobianRef<Scalar>{r.jacobian.data(), F::max_rows});
        r.linearised = true;
      }
      bool reweighted = moved;
      for (int i = 0; i < r.rows; ++i)
        reweighted = reweighted || std::abs(r.weights_now[static_cast<std::size_t>(i)] - r.weights[static_cast<std::size_t>(i)]) > weight_threshold;
      if (!reweighted) return;
      r.weights = r.weights_now;
      elimination_.mark_dirty_from(r.front);
    });
    window_.for_each_variable([&](auto&, int id) { window_.info(id).relinearised = false; });
  }

  [[nodiscard]] int prior_front() const {
    int front = elimination_.front_count() - 1;
    for (int id : prior_.variables) front = std::min(front, window_.info(id).front);
    return front;
  }

  [[nodiscard]] bool ensure_analysis() {
    if (!changed_) return true;
    changed_ = !elimination_.analyse(window_, prior_);
    return !changed_;
  }

  /// A current, undamped factorisation of the present linearisation.
  Status ensure_factor() {
    bool pending = false;
    window_.for_each_factor([&]<class F>(FactorRecord<F>& r, int) { pending = pending || (window_.template enabled<F>() && !r.linearised); });
    if (pending) {
      (void)evaluate<Which::estimate>();
      linearise_factors(0);  // theta stays: whether a variable may move is for optimise() to say
    }
    if (damped_) elimination_.mark_dirty_from(0), damped_ = false;
    const auto failed = elimination_.factorise(window_, prior_, Scalar(0));
    UnderDetermined where;
    return failed.ok() ? ok_status() : describe(failed, where);
  }

  [[nodiscard]] Scalar largest_step() {
    Scalar largest = 0;
    window_.for_each_variable([&]<class V>(VariableRecord<V>& r, int) {
      const Tangent<V> scale = V::linearisation_scale();
      for (int i = 0; i < V::dof; ++i) largest = std::max(largest, std::abs(r.candidate_delta[i] - r.delta[i]) / scale[i]);
    });
    return largest;
  }

  void accept() {
    window_.for_each_variable([](auto& r, int) { r.x = r.candidate, r.delta = r.candidate_delta; });
  }
  void save() {
    window_.for_each_variable([](auto& r, int) {
      r.saved_x = r.x, r.saved_theta = r.theta, r.saved_delta = r.delta;
      r.candidate = r.x, r.candidate_delta = r.delta;
    });
  }

  /// Restores what optimise() found and reports why.
  Report give_up(Report report, const Status& status) {
    window_.for_each_variable([&](auto& r, int id) {
      r.x = r.saved_x, r.theta = r.saved_theta, r.delta = r.saved_delta;
      window_.info(id).relinearised = true;  // the factors may hold another linearisation
    });
    window_.for_each_factor([](auto& r, int) { r.linearised = false; });
    elimination_.mark_dirty_from(0);
    (void)evaluate<Which::estimate>();  // rows and weights are those of the estimate again
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
    window_.visit_variable(failed.variable, [&]<class V>(VariableRecord<V>&) { where.variable_name = V::name, where.axis_name = V::axis_name(failed.axis); });
    window_.for_each_factor([&]<class F>(FactorRecord<F>& r, int) {
      for (int k = 0; k < r.keys; ++k)
        if (r.variables[static_cast<std::size_t>(k)] == failed.variable) {
          bool known = false;
          for (const char* n : where.factor_names) known = known || n == F::name;
          if (!known) (void)where.factor_names.push_back(F::name);
        }
    });
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
    const auto append = [&](int id) {
      if (next.dimension + window_.info(id).dof > EliminationType::kMaxFront) return false;
      row_[static_cast<std::size_t>(id)] = next.dimension;
      next.dimension += window_.info(id).dof;
      return next.variables.push_back(id);
    };
    for (int k = front.eliminated; k < front.eliminated + front.separated; ++k)
      if (!append(elimination_.member(front.first + k))) return failure(StatusCode::capacity_exceeded, "the prior has more axes than Problem::max_front_dimension");
    if (join)
      for (int id : prior_.variables) {
        const bool known = std::find(next.variables.begin(), next.variables.end(), id) != next.variables.end();
        if (!known && !append(id)) return failure(StatusCode::capacity_exceeded, "the prior has more axes than Problem::max_front_dimension");
      }
    const std::size_t n = static_cast<std::size_t>(next.dimension);
    std::fill_n(next.H.begin(), n * n, Scalar(0));
    std::fill_n(next.g.begin(), n, Scalar(0));
    std::fill_n(next.reference.begin(), n, Scalar(0));
    const Scalar* const U = elimination_.update_of(0);
    const Scalar* const reference = elimination_.reference_of(0);
    const int m = front.rows_s;
    for (int j = 0; j < m; ++j) {
      for (int i = j; i < m; ++i) next.h(i, j) = U[static_cast<std::ptrdiff_t>(j) * (m + 1) + i];
      next.g[static_cast<std::size_t>(j)] = U[static_cast<std::ptrdiff_t>(j) * (m + 1) + m];
      next.reference[static_cast<std::size_t>(j)] = reference[j];
    }
    next.c = 0;  // counted from the expansion point: the sum of all past costs would swamp the differences that step control compares
    if (join) {
      prior_.move_to_theta(window_);
      for (int a : prior_.variables)
        for (int i = 0; i < window_.info(a).dof; ++i) {
          const int from = window_.info(a).prior + i, to = row_[static_cast<std::size_t>(a)] + i;
          next.g[static_cast<std::size_t>(to)] += prior_.g[static_cast<std::size_t>(from)];
          next.reference[static_cast<std::size_t>(to)] += prior_.reference[static_cast<std::size_t>(from)];
          for (int b : prior_.variables)
            for (int j = 0; j < window_.info(b).dof; ++j) {
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
    int gone = 0;
    window_.for_each_factor([&](auto& r, int id) {
      if (r.front == 0) doomed_[static_cast<std::size_t>(gone++)] = id;
    });
    for (int i = 0; i < gone; ++i) window_.erase_factor(doomed_[static_cast<std::size_t>(i)]);
    report.factors = gone;
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
      row += window_.info(id).dof;
      window_.visit_variable(id, [](auto& r) { r.prior_theta = r.theta; });
    }
    elimination_.drop_first_front();
    changed_ = true;
  }

  /// Local variables that lost their last factor leave with the state of their time.
  void erase_idle_locals(GpsTime leaving, MarginaliseReport& report) {
    int idle = 0;
    window_.for_each_variable([&](auto&, int id) {
      const VariableInfo& info = window_.info(id);
      if (info.role == Role::local && info.degree == 0 && info.stamp <= leaving) row_[static_cast<std::size_t>(idle++)] = id;
    });
    for (int i = 0; i < idle; ++i) window_.erase_variable(row_[static_cast<std::size_t>(i)]);
    report.unconnected += idle;
    report.variables += idle;
  }

  /// Axes of front 0 whose pivot was passed over: nothing is known about them.
  [[nodiscard]] int zero_pivots(const typename EliminationType::Front& front) const {
    const Scalar* const L = elimination_.factor_of(0);
    int zero = 0;
    for (int i = 0; i < front.rows_e; ++i) zero += L[static_cast<std::ptrdiff_t>(i) * (front.border() + 1) + i] > 0 ? 0 : 1;
    return zero;
  }

  WindowType window_{};
  EliminationType elimination_{};
  typename EliminationType::Prior prior_{}, next_prior_{};
  Covariance<Problem> covariance_{};
  std::array<int, static_cast<std::size_t>(WindowType::kVariables)> ids_{}, row_{};
  std::array<int, static_cast<std::size_t>(WindowType::kFactors)> doomed_{};
  bool changed_{true};
  bool damped_{false};  ///< the stored fronts contain damping
};

}  // namespace searvins::smoother
