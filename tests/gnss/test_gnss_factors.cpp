// SPDX-License-Identifier: BSD-3-Clause
// Factors of differenced observations: Jacobians under every formulation, latent against full covariance, and a snapshot solved through the smoother that
// does not depend on pivot or order.
#include <searvins/gnss/gnss_factors.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <memory>
#include <numeric>

#include <searvins/robust/loss.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "gnss/factor_check.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using gnss::Ambiguity;
using gnss::Observable;
using gnss::PivotError;
using gnss::Pva;

namespace {

constexpr int kMax = 12;
constexpr double kWavelength = 0.19;

template <template <class> class Form, class Loss, Observable kObservable>
using Difference = gnss::DifferenceFactor<Pva, Form<Loss>, kObservable, kMax>;

/// Undifferenced observations of one epoch: what a batch is made of.
struct RawSignal {
  Eigen::Vector3d satellite_e_m{Eigen::Vector3d::Zero()};
  double z{0}, variance{1};
  int cycles{0};
};

/// A sky over a random place with codes (sigma 0.3 m), phases (3 mm) and integer single-difference ambiguities; the rover stands at `truth_w_m`.
struct Snapshot {
  geodesy::LocalFrame frame{};
  Eigen::Vector3d truth_w_m{Eigen::Vector3d::Zero()};
  std::vector<RawSignal> code{}, phase{};

  Snapshot(Rng& rng, int n, double noise = 1) {
    frame = geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({uniform(rng, -1.1, 1.1), uniform(rng, -3.1, 3.1), 100}));
    truth_w_m = random_vector<3>(rng, 5);
    const double code_clock_m = uniform(rng, -1e4, 1e4), phase_clock_m = uniform(rng, -1e4, 1e4);
    for (int i = 0; i < n; ++i) {
      const double azimuth = uniform(rng, -3.14, 3.14), elevation = uniform(rng, 0.25, 1.5);
      const Eigen::Vector3d s_w_m = 2.2e7 * Eigen::Vector3d{std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth), std::sin(elevation)};
      RawSignal c, p;
      c.satellite_e_m = p.satellite_e_m = frame.to_ecef(s_w_m);
      const double range = gnss::range_m(frame.to_ecef(truth_w_m), c.satellite_e_m), grow = 1 / std::sin(elevation);
      c.variance = 0.09 * grow * grow, p.variance = 9e-6 * grow * grow;
      p.cycles = integer(rng, -100, 100);
      c.z = range + code_clock_m + noise * normal(rng, std::sqrt(c.variance));
      p.z = range + phase_clock_m + kWavelength * p.cycles + noise * normal(rng, std::sqrt(p.variance));
      code.push_back(c), phase.push_back(p);
    }
  }
};

/// Pivot, candidates and covariance of a batch, candidates in the given order.
template <class F>
F batch_of(const geodesy::LocalFrame& frame, const std::vector<RawSignal>& raw, int pivot, const std::vector<int>& order) {
  F f;
  f.frame = frame;
  f.wavelength_m = kWavelength;
  double variances[kMax];
  for (int i : order) {
    const RawSignal& s = raw[static_cast<std::size_t>(i)];
    if (i == pivot) {
      f.pivot = {s.satellite_e_m, s.z};
      continue;
    }
    variances[f.candidates.size()] = s.variance;
    REQUIRE(f.candidates.push_back({s.satellite_e_m, s.z}));
  }
  const auto cov = robust::SharedPivot<double, kMax>::from(variances, f.size(), raw[static_cast<std::size_t>(pivot)].variance);
  REQUIRE(cov.ok());
  f.covariance = *cov;
  return f;
}

std::vector<int> natural_order(std::size_t n) {
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

/// Range rates instead of ranges: unit vectors and a uniform velocity.
std::vector<RawSignal> rates(Rng& rng, const Snapshot& s) {
  std::vector<RawSignal> raw;
  const Eigen::Vector3d v = random_vector<3>(rng, 20);
  for (const RawSignal& c : s.code) {
    RawSignal d;
    d.satellite_e_m = gnss::direction_from_satellite(s.frame.to_ecef(s.truth_w_m), c.satellite_e_m);
    d.variance = uniform(rng, 0.001, 0.1);
    d.z = d.satellite_e_m.dot(v) + 3 + normal(rng, std::sqrt(d.variance));
    raw.push_back(d);
  }
  return raw;
}

template <template <class> class Form, Observable kObservable>
void check_difference_factor(Rng& rng, bool single_difference) {
  using F = Difference<Form, robust::Dcs<double>, kObservable>;
  const int n = integer(rng, 2, kMax);
  const Snapshot s{rng, n};
  const std::vector<RawSignal> raw = kObservable == Observable::doppler ? rates(rng, s) : kObservable == Observable::code ? s.code : s.phase;
  F f = batch_of<F>(s.frame, raw, integer(rng, 0, n - 1), natural_order(raw.size()));
  FactorValues values;
  Pva x;
  x.p_wa_m = s.truth_w_m + random_vector<3>(rng, 2), x.v_wa_mps = random_vector<3>(rng, 20), x.a_wa_mps2 = random_vector<3>(rng, 3);
  f.state = values.add(x);
  if constexpr (F::is_phase) {
    Ambiguity a;
    for (int i = 0; i < f.size(); ++i) {
      a.value = uniform(rng, -100, 100);
      REQUIRE(f.ambiguities.push_back(values.add(a)));
    }
    a.value = uniform(rng, -100, 100);
    if (single_difference) f.pivot_ambiguity = values.add(a);
  }
  PivotError latent;
  latent.value = normal(rng);
  if constexpr (Form<robust::Dcs<double>>::has_latent) f.latent = values.add(latent);
  // A range of 2.2e7 m is rounded to 4 nm: over a step of 0.5 m the quotient is good to that over the step and the smallest sigma.
  const double sigma = std::sqrt(std::min_element(raw.begin(), raw.end(), [](const auto& a, const auto& b) { return a.variance < b.variance; })->variance);
  check_jacobian(f, values, 1e-6, 0.5, 4e-8 / sigma);

  // The residuals, written out once more.
  double r[kMax];
  f.residuals(values, r);
  for (int i = 0; i < f.size(); ++i) {
    const auto& c = f.candidates[static_cast<std::size_t>(i)];
    const auto model = [&](const gnss::BatchMember& m) {
      if constexpr (kObservable == Observable::doppler)
        return m.satellite_e_m.dot(s.frame.R_ew * x.v_wa_mps);
      else
        return gnss::range_m(s.frame.to_ecef(x.p_wa_m), m.satellite_e_m);
    };
    double expected = c.z - model(c) - (f.pivot.z - model(f.pivot));
    if constexpr (F::is_phase)
      expected -= kWavelength * (values(f.ambiguities[static_cast<std::size_t>(i)]).value - (single_difference ? values(f.pivot_ambiguity).value : 0.0));
    CHECK(std::abs(r[i] - expected) < 1e-7);
  }
}

template <template <class> class Form>
void check_all_observables() {
  for_all_seeds(40, [](Rng& rng) {
    check_difference_factor<Form, Observable::code>(rng, false);
    check_difference_factor<Form, Observable::phase>(rng, false);
    check_difference_factor<Form, Observable::phase>(rng, true);
    check_difference_factor<Form, Observable::doppler>(rng, false);
  });
}

/// All the forms in one smoother, so that it is instantiated once.
struct SnapshotProblem {
  using Scalar = double;
  template <template <class> class Form, class Loss>
  using Code = Difference<Form, Loss, Observable::code>;
  template <template <class> class Form, class Loss>
  using Phase = Difference<Form, Loss, Observable::phase>;
  using Gauss = robust::Gaussian<double>;
  using Dcs = robust::Dcs<double>;
  using Variables = smoother::Types<smoother::Capacity<Pva, 4>, smoother::Capacity<Ambiguity, 40>, smoother::Capacity<PivotError, 16>>;
  using Factors = smoother::Types<smoother::Capacity<gnss::PvaPriorFactor, 4>, smoother::Capacity<gnss::WhiteJerkFactor, 4>, smoother::Capacity<gnss::AmbiguityDatum, 40>,
                                  smoother::Capacity<Code<robust::Batch, Gauss>, 8>, smoother::Capacity<Phase<robust::Batch, Gauss>, 8>,
                                  smoother::Capacity<Code<robust::Batch, Dcs>, 8>, smoother::Capacity<Phase<robust::Batch, Dcs>, 8>,
                                  smoother::Capacity<Code<robust::LatentPivotSymmetric, Dcs>, 8>, smoother::Capacity<Phase<robust::LatentPivotSymmetric, Dcs>, 8>,
                                  smoother::Capacity<Code<robust::LatentPivot, Gauss>, 8>, smoother::Capacity<Phase<robust::LatentPivot, Gauss>, 8>>;
  static constexpr int max_front_dimension = 80;
  static constexpr int member_capacity = 600;
  static constexpr std::size_t arena_scalars = 100'000;
};
using SnapshotSmoother = smoother::FixedLagSmoother<SnapshotProblem>;

struct SolvedSnapshot {
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d P_m2{Eigen::Matrix3d::Zero()};
  std::vector<double> cycles{};  ///< single differences, by satellite
};

/// Adds the code and phase batches of one epoch.
template <template <class> class Form, class Loss>
void add_epoch(SnapshotSmoother& smoother, const Snapshot& s, smoother::Key<Pva> state, const std::vector<smoother::Key<Ambiguity>>& ambiguities, int pivot,
               const std::vector<int>& order) {
  const auto add = [&](auto f) {
    f.state = state;
    if constexpr (decltype(f)::is_phase) {
      for (int i : order)
        if (i != pivot) REQUIRE(f.ambiguities.push_back(ambiguities[static_cast<std::size_t>(i)]));
      f.pivot_ambiguity = ambiguities[static_cast<std::size_t>(pivot)];
    }
    if constexpr (Form<Loss>::has_latent) {
      const auto values = smoother.window().values(smoother::Which::estimate);
      PivotError start;
      start.value = f.initial_latent(values);
      const auto latent = smoother.add_variable(start, GpsTime{1});
      REQUIRE(latent.ok());
      f.latent = *latent;
    }
    REQUIRE(smoother.add_factor(f).ok());
  };
  add(batch_of<Difference<Form, Loss, Observable::code>>(s.frame, s.code, pivot, order));
  add(batch_of<Difference<Form, Loss, Observable::phase>>(s.frame, s.phase, pivot, order));
}

smoother::OptimiseOptions<double> tight() {
  smoother::OptimiseOptions<double> o;
  o.max_iterations = 200, o.step_tolerance = 1e-11;
  return o;
}

template <template <class> class Form, class Loss>
SolvedSnapshot solve(const Snapshot& s, int pivot, const std::vector<int>& order, double start_error_m = 0.3) {
  auto smoother = std::make_unique<SnapshotSmoother>();
  Pva x;
  x.p_wa_m = s.truth_w_m + Eigen::Vector3d{start_error_m, -start_error_m, start_error_m};
  const auto state = smoother->add_variable(x, GpsTime{1});
  REQUIRE(state.ok());
  REQUIRE(smoother->add_factor(gnss::PvaPriorFactor{*state, x, 10, 10, 10}).ok());
  std::vector<smoother::Key<Ambiguity>> keys;
  const double level_m = s.phase[0].z - gnss::range_m(s.frame.to_ecef(x.p_wa_m), s.phase[0].satellite_e_m);
  for (const RawSignal& p : s.phase) {
    Ambiguity a;
    a.value = (p.z - gnss::range_m(s.frame.to_ecef(x.p_wa_m), p.satellite_e_m) - level_m) / kWavelength;
    const auto key = smoother->add_variable(a, GpsTime{1});
    REQUIRE(key.ok());
    REQUIRE(smoother->add_factor(gnss::AmbiguityDatum{*key, {}, a.value, 1000}).ok());
    keys.push_back(*key);
  }
  add_epoch<Form, Loss>(*smoother, s, *state, keys, pivot, order);
  const auto report = smoother->optimise(tight());
  CAPTURE(report.status.what);
  REQUIRE((report.status.ok() || report.status.code == StatusCode::not_converged));
  SolvedSnapshot out;
  out.p_w_m = smoother->find(*state)->p_wa_m;
  for (const auto& k : keys) out.cycles.push_back(smoother->find(k)->value);
  const auto P = smoother->covariance(*state);
  REQUIRE(P.ok());
  out.P_m2 = P->template topLeftCorner<3, 3>();
  return out;
}

/// The largest differences of two solutions, in sigmas of position.
double in_sigmas(const SolvedSnapshot& a, const SolvedSnapshot& b) {
  const Eigen::Vector3d sigma = b.P_m2.diagonal().cwiseSqrt();
  return (a.p_w_m - b.p_w_m).cwiseQuotient(sigma).cwiseAbs().maxCoeff();
}

template <template <class> class Form, class Loss>
void check_invariance(bool with_outlier, double tolerance) {
  for_all_seeds(12, [&](Rng& rng) {
    const int n = integer(rng, 6, 10);
    Snapshot s{rng, n, with_outlier ? 0.2 : 1};  // little noise: a redescending loss then has one minimum that counts
    if (with_outlier) s.code[static_cast<std::size_t>(integer(rng, 0, n - 1))].z += 30;
    std::vector<int> order = natural_order(s.code.size());
    const double start_error_m = with_outlier ? 0.05 : 0.3;
    const SolvedSnapshot reference = solve<Form, Loss>(s, 0, order, start_error_m);
    for (int pivot = 0; pivot < n; ++pivot) {
      CAPTURE(pivot);
      std::shuffle(order.begin(), order.end(), rng);
      const SolvedSnapshot other = solve<Form, Loss>(s, pivot, order, start_error_m);
      CHECK(in_sigmas(other, reference) < tolerance);
      CHECK((other.P_m2 - reference.P_m2).norm() < 1e-5 * reference.P_m2.norm());
      for (std::size_t i = 0; i < other.cycles.size(); ++i)
        CHECK(std::abs((other.cycles[i] - other.cycles[0]) - (reference.cycles[i] - reference.cycles[0])) < 1e-4);
    }
  });
}

}  // namespace

TEST_CASE("difference factors, batch: residuals and Jacobians") { check_all_observables<robust::Batch>(); }
TEST_CASE("difference factors, scalar rows: residuals and Jacobians") { check_all_observables<robust::ScalarRows>(); }
TEST_CASE("difference factors, latent pivot: residuals and Jacobians") { check_all_observables<robust::LatentPivot>(); }
TEST_CASE("difference factors, symmetric latent pivot: residuals and Jacobians") { check_all_observables<robust::LatentPivotSymmetric>(); }

TEST_CASE("ambiguity factors: residual and Jacobian, with and without a second ambiguity") {
  for_all_seeds(50, [](Rng& rng) {
    FactorValues values;
    Ambiguity a, b;
    a.value = uniform(rng, -50, 50), b.value = uniform(rng, -50, 50);
    gnss::IntegerFix f;
    f.a = values.add(a), f.mean_cycles = uniform(rng, -5, 5), f.sigma_cycles = uniform(rng, 0.01, 10);
    double e = 0;
    f.evaluate(values, &e);
    CHECK(e * f.sigma_cycles == doctest::Approx(a.value - f.mean_cycles));
    check_jacobian(f, values, 1e-8);
    f.b = values.add(b);
    f.evaluate(values, &e);
    CHECK(e * f.sigma_cycles == doctest::Approx(a.value - b.value - f.mean_cycles));
    check_jacobian(f, values, 1e-8);
    double w = 0;
    CHECK(f.weigh(&e, &w) == doctest::Approx(e * e / 2));
    CHECK(w == 1);
  });
}

TEST_CASE("P13 the solution does not depend on pivot or satellite order: Gaussian") { check_invariance<robust::Batch, robust::Gaussian<double>>(false, 1e-6); }
TEST_CASE("P13 the solution does not depend on pivot or satellite order: batch") { check_invariance<robust::Batch, robust::Dcs<double>>(false, 1e-5); }
TEST_CASE("P13 the solution does not depend on pivot or satellite order: symmetric latent, one gross code") {
  check_invariance<robust::LatentPivotSymmetric, robust::Dcs<double>>(true, 1e-5);
}

TEST_CASE("the latent pivot, eliminated, is the full covariance: position, ambiguities and their covariance") {
  for_all_seeds(15, [](Rng& rng) {
    const int n = integer(rng, 5, 10);
    const Snapshot s{rng, n};
    const std::vector<int> order = natural_order(s.code.size());
    const int pivot = integer(rng, 0, n - 1);
    const SolvedSnapshot full = solve<robust::Batch, robust::Gaussian<double>>(s, pivot, order), latent = solve<robust::LatentPivot, robust::Gaussian<double>>(s, pivot, order);
    CHECK(in_sigmas(latent, full) < 1e-6);
    CHECK((latent.P_m2 - full.P_m2).norm() < 1e-7 * full.P_m2.norm());
    for (std::size_t i = 1; i < full.cycles.size(); ++i)
      CHECK(std::abs((latent.cycles[i] - latent.cycles[0]) - (full.cycles[i] - full.cycles[0])) < 1e-5);
  });
}

TEST_CASE("single-difference ambiguities pass through a pivot change: two epochs under different pivots give the estimate of one pivot") {
  for_all_seeds(15, [](Rng& rng) {
    const int n = integer(rng, 6, 9);
    const Snapshot s{rng, n};
    const std::vector<int> order = natural_order(s.code.size());
    const auto run = [&](int first_pivot, int second_pivot, bool share_ambiguities) {
      auto smoother = std::make_unique<SnapshotSmoother>();
      Pva x;
      x.p_wa_m = s.truth_w_m + Eigen::Vector3d{0.1, 0.1, -0.1};
      std::vector<smoother::Key<Pva>> states;
      for (int k = 0; k < 2; ++k) states.push_back(*smoother->add_variable(x, GpsTime{1 + k}));
      REQUIRE(smoother->add_factor(gnss::PvaPriorFactor{states[0], x, 10, 10, 10}).ok());
      REQUIRE(smoother->add_factor(gnss::WhiteJerkFactor{states[0], states[1], 1.0, 100.0}).ok());
      std::vector<smoother::Key<Ambiguity>> keys[2];
      for (int k = 0; k < 2; ++k) {
        if (k == 1 && share_ambiguities) {
          keys[1] = keys[0];
          break;
        }
        for (const RawSignal& p : s.phase) {
          Ambiguity a;
          a.value = (p.z - gnss::range_m(s.frame.to_ecef(x.p_wa_m), p.satellite_e_m)) / kWavelength;
          keys[k].push_back(*smoother->add_variable(a, GpsTime{1 + k}));
          REQUIRE(smoother->add_factor(gnss::AmbiguityDatum{keys[k].back(), {}, a.value, 1000}).ok());
        }
      }
      add_epoch<robust::Batch, robust::Gaussian<double>>(*smoother, s, states[0], keys[0], first_pivot, order);
      add_epoch<robust::Batch, robust::Gaussian<double>>(*smoother, s, states[1], keys[1], second_pivot, order);
      const auto report = smoother->optimise(tight());
      REQUIRE((report.status.ok() || report.status.code == StatusCode::not_converged));
      SolvedSnapshot out;
      out.p_w_m = smoother->find(states[1])->p_wa_m;
      out.P_m2 = smoother->covariance(states[1])->template topLeftCorner<3, 3>();
      return out;
    };
    const SolvedSnapshot same = run(0, 0, true), changed = run(0, n - 1, true), apart = run(0, n - 1, false);
    CHECK(in_sigmas(changed, same) < 1e-6);
    CHECK((changed.P_m2 - same.P_m2).norm() < 1e-6 * same.P_m2.norm());
    CHECK((apart.P_m2 - same.P_m2).norm() > 1e-4 * same.P_m2.norm());  // without the common ambiguities there would be less to know
  });
}
