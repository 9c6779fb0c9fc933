// SPDX-License-Identifier: BSD-3-Clause
// Step control where Gauss-Newton overshoots: e = k atan(x) + b, from which a full step diverges for |x| > 1.39. Halving and damping
// both bring it home; halving without another factorisation.
#include <cmath>
#include <memory>

#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

struct Place {
  using Scalar = double;
  static constexpr int dof = 1;
  static constexpr smoother::Role role = smoother::Role::state;
  static constexpr const char* name = "place";
  static const char* axis_name(int) { return "x"; }
  double x{0};
  [[nodiscard]] Place retract(const smoother::Tangent<Place>& d) const { return {x + d[0]}; }
  [[nodiscard]] smoother::Tangent<Place> local(const Place& other) const { return smoother::Tangent<Place>{other.x - x}; }
  static smoother::Tangent<Place> linearisation_scale() { return smoother::Tangent<Place>{1.0}; }
};

struct AtanFactor {
  using Scalar = double;
  static constexpr int max_rows = 1, max_keys = 1, max_columns = 1;
  static constexpr const char* name = "atan";
  smoother::Key<Place> place{};
  double k{1}, b{0};
  [[nodiscard]] int rows() const { return 1; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(place);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    e[0] = k * std::atan(values(place).x) + b;
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    const double x = values(place).x;
    e[0] = k * std::atan(x) + b;
    J(0, 0) = k / (1 + x * x);
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 1, w); }
};

struct Problem {
  using Scalar = double;
  using Variables = smoother::Types<smoother::Capacity<Place, 4>>;
  using Factors = smoother::Types<smoother::Capacity<AtanFactor, 4>>;
  static constexpr int max_front_dimension = 8, member_capacity = 16;
  static constexpr std::size_t arena_scalars = 256;
};

struct Outcome {
  int halved{0}, damped{0}, fronts{0};
  double x{0};
};

/// From `start` to the zero of k atan(x) + b, one Gauss-Newton step a call, while the cost must not rise.
Outcome descend(double start, double k, double b, int halvings) {
  smoother::FixedLagSmoother<Problem> s;
  const auto key = s.add_variable(Place{start}, GpsTime{0});
  REQUIRE(key.ok());
  REQUIRE(s.add_factor(AtanFactor{*key, k, b}).ok());
  smoother::OptimiseOptions<double> options;
  options.max_iterations = 1, options.step_tolerance = 1e-10, options.max_step_halvings = halvings;
  Outcome o;
  double cost = s.cost();
  for (int i = 0; i < 200; ++i) {
    const auto report = s.optimise(options);
    o.halved += report.halved_steps, o.damped += report.damped_steps, o.fronts += report.fronts_factored;
    CHECK(report.halved_steps <= halvings);
    CHECK(report.final_cost <= cost + 2e-9 * (1 + cost));
    CHECK(std::abs(report.final_cost - s.cost()) <= 1e-12 * (1 + cost));
    cost = report.final_cost;
    if (report.status.ok()) break;
    REQUIRE(report.status.code == StatusCode::not_converged);
  }
  o.x = s.find(*key)->x;
  return o;
}

}  // namespace

TEST_CASE("a full step that overshoots is halved until the cost falls, and the zero is found all the same") {
  int halved = 0;
  for_all_seeds(200, [&](Rng& rng) {
    const double zero = uniform(rng, -1, 1), k = uniform(rng, 0.5, 20);
    const double start = zero + (chance(rng, 0.5) ? 1 : -1) * uniform(rng, 0, 6);
    const Outcome o = descend(start, k, -k * std::atan(zero), 12);
    CHECK(std::abs(o.x - zero) < 1e-6);
    CHECK(o.damped == 0);
    halved += o.halved;
  });
  CHECK(halved > 0);
}

TEST_CASE("without halvings the same step is damped, at a factorisation each") {
  const Outcome damped = descend(4, 3, 0, 0), halved = descend(4, 3, 0, 12);
  CHECK(damped.halved == 0);
  CHECK(damped.damped > 0);
  CHECK(halved.halved > 0);
  CHECK(halved.damped == 0);
  CHECK(halved.fronts < damped.fronts);
  CHECK(std::abs(damped.x) < 1e-6);
  CHECK(std::abs(halved.x) < 1e-6);
}

TEST_CASE("when the halvings do not suffice, damping takes over; a halved step is not taken for convergence") {
  const Outcome o = descend(50, 3, 0, 1);
  CHECK(o.damped > 0);
  CHECK(std::abs(o.x) < 1e-6);
  for (int halvings : {0, 1, 2, 12}) CHECK(std::abs(descend(1.5, 1, 0, halvings).x) < 1e-6);
}
