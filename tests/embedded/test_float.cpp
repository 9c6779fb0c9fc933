// SPDX-License-Identifier: BSD-3-Clause
// P20: what is templated on the scalar keeps its properties in float, with bounds of float. Truth is the same code in double, whose own
// tests stand in the
// folders of the headers, and properties that need none.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <searvins/ambiguity/lambda.hpp>
#include <searvins/imu/preintegration.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "imu/simulated_motion.hpp"
#include "support/ambiguity_problems.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

constexpr double kFloatEpsilon = static_cast<double>(std::numeric_limits<float>::epsilon());

Eigen::Vector3d random_rotation(Rng& rng) {
  const double angle = std::pow(10.0, uniform(rng, -7, std::log10(3.1)));  // as many tiny ones as large ones
  return angle * random_vector<3>(rng).normalized();
}

template <class D>
auto in_float(const Eigen::MatrixBase<D>& m) {
  return m.template cast<float>().eval();
}
template <class D>
auto in_double(const Eigen::MatrixBase<D>& m) {
  return m.template cast<double>().eval();
}

}  // namespace

TEST_CASE("P20 float: rotations, their logarithms and Jacobians follow double to some epsilon at every angle") {
  for_all_seeds(500, [](Rng& rng) {
    const Eigen::Vector3f v = in_float(random_rotation(rng));
    const Eigen::Vector3d exact = in_double(v);
    const Eigen::Matrix3f R = so3::exp(v);
    CHECK((R.transpose() * R - Eigen::Matrix3f::Identity()).norm() < 16 * std::numeric_limits<float>::epsilon());
    CHECK(close(in_double(R), so3::exp(exact), 4 * kFloatEpsilon));
    CHECK((in_double(so3::log(R)) - exact).norm() < 8 * kFloatEpsilon * std::max(1.0, exact.norm()));
    CHECK((in_double(so3::quaternion_log(so3::quaternion_exp(v))) - exact).norm() <
          8 * kFloatEpsilon * exact.norm());  // relative: nothing vanishes
    CHECK(close(in_double(so3::right_jacobian(v)), so3::right_jacobian(exact), 8 * kFloatEpsilon));
    CHECK(close(in_double(so3::right_jacobian_inverse(v)), so3::right_jacobian_inverse(exact), 16 * kFloatEpsilon));
    CHECK(
        close(in_double((so3::left_jacobian(v) * so3::left_jacobian_inverse(v)).eval()), Eigen::Matrix3d::Identity(), 32 * kFloatEpsilon));
  });
}

TEST_CASE(
    "P20 float: preintegration over two seconds is within a tenth of a millimetre and a millimetre a second of double, its covariance "
    "intact") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const auto list = m.samples(uniform_times(2.1, 200), imu::SampleKind::instantaneous);
    const imu::ImuBias<double> bias{random_vector<3>(rng, 0.1), random_vector<3>(rng, 0.01)};
    const double end = uniform(rng, 0.05, 2.05);  // short intervals too: there the smallest variances are 1e-13
    const auto f = imu::preintegrate<float>(list, m.time(0.011), m.time(end), bias.cast<float>());
    const auto d = imu::preintegrate<double>(list, m.time(0.011), m.time(end), bias.cast<float>().cast<double>());
    REQUIRE((f.ok() && d.ok()));
    CHECK(so3::log((in_double(f->dR).transpose() * d->dR).eval()).norm() < 1e-5);
    CHECK((in_double(f->dp_m) - d->dp_m).norm() < 1e-4);
    CHECK((in_double(f->dv_mps) - d->dv_mps).norm() < 1e-4);
    CHECK(close(in_double(f->d_p_d_gyro_bias), d->d_p_d_gyro_bias, 1e-4));
    CHECK(close(in_double(f->d_R_d_gyro_bias), d->d_R_d_gyro_bias, 1e-5));

    // No variance vanishes: each is that of double to a thousandth, and the scaled covariance has a Cholesky factor in float.
    Eigen::Matrix<float, 9, 9> correlation;
    for (int i = 0; i < 9; ++i) {
      CHECK(std::abs(static_cast<double>(f->covariance(i, i)) / d->covariance(i, i) - 1) < 1e-3);
      for (int j = 0; j < 9; ++j) correlation(i, j) = f->covariance(i, j) / std::sqrt(f->covariance(i, i) * f->covariance(j, j));
    }
    const Eigen::Matrix<float, 9, 1> ones = Eigen::Matrix<float, 9, 1>::Ones();
    CHECK(math::partial_cholesky(correlation.data(), 9, 9, 9, ones.data()).ok());
  });
}

TEST_CASE("P20 float: a square root of information holds variables of units six decades apart") {
  for_all_seeds(100, [](Rng& rng) {
    constexpr int n = 12;
    const Eigen::MatrixXd A = random_spd(rng, n, 50);
    std::array<double, n> scale{};
    for (double& s : scale) s = std::pow(10.0, uniform(rng, -3, 3));
    std::array<float, n * n> a{};
    std::array<float, n> reference{}, x{};
    Eigen::VectorXd expected(n);
    for (int i = 0; i < n; ++i) expected[i] = normal(rng) / scale[static_cast<std::size_t>(i)];
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double information = A(i, j) * scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
        a[static_cast<std::size_t>(j * n + i)] = static_cast<float>(information);
        if (i == j) reference[static_cast<std::size_t>(i)] = static_cast<float>(information);
        x[static_cast<std::size_t>(i)] += static_cast<float>(information * expected[j]);
      }
    const double size = expected.cwiseProduct(Eigen::Map<Eigen::VectorXd>{scale.data(), n}).norm();
    REQUIRE(math::partial_cholesky(a.data(), n, n, n, reference.data()).ok());
    math::solve_lower(a.data(), n, n, x.data());
    math::solve_lower_transposed(a.data(), n, n, x.data());
    for (int i = 0; i < n; ++i)  // to a thousandth of its own scale
      CHECK(std::abs(static_cast<double>(x[static_cast<std::size_t>(i)]) - expected[i]) * scale[static_cast<std::size_t>(i)] <
            2e-3 * (1 + size));
  });
}

TEST_CASE_TEMPLATE("P20 float: robust losses are those of double", L, robust::Dcs<float>, robust::Huber<float>) {
  using D = std::conditional_t<std::is_same_v<L, robust::Dcs<float>>, robust::Dcs<double>, robust::Huber<double>>;
  for_all_seeds(300, [](Rng& rng) {
    const float s = static_cast<float>(std::pow(10.0, uniform(rng, -4, 4)));
    const double exact = static_cast<double>(s);
    CHECK(std::abs(static_cast<double>(L{}.weight(s)) - D{}.weight(exact)) < 16 * kFloatEpsilon);
    CHECK(std::abs(static_cast<double>(L{}.rho(s)) - D{}.rho(exact)) < 16 * kFloatEpsilon * (1 + D{}.rho(exact)));
  });
}

TEST_CASE("P20 float: LAMBDA finds the integers of double where the second best is further away than rounding") {
  int compared = 0;
  for_all_seeds(60, [&compared](Rng& rng) {
    const int n = 2 * integer(rng, 3, 6);
    const AmbiguityProblem p = double_difference_problem(rng, n, 4);
    std::vector<float> Q, a;
    for (const double q : p.Q.values) Q.push_back(static_cast<float>(q));
    for (const double x : p.a_hat) a.push_back(static_cast<float>(x));
    const auto d = ambiguity::integer_least_squares<double, 12>(p.Q.data(), n, p.a_hat.data(), n);
    const auto f = ambiguity::integer_least_squares<float, 12>(Q.data(), n, a.data(), n);
    REQUIRE(d.ok());
    if (!f.ok() || d->ratio() < 1.5) return;  // a covariance that float calls singular is refused, not answered
    ++compared;
    for (int i = 0; i < n; ++i) CHECK(f->integers[0][static_cast<std::size_t>(i)] == d->integers[0][static_cast<std::size_t>(i)]);
    CHECK(std::abs(static_cast<double>(f->squared_norm[0]) - d->squared_norm[0]) < 0.02 * (1 + d->squared_norm[1]));
  });
  CHECK(compared * 2 >= static_cast<int>(property_runs(60)));
}

namespace {

/// Position and velocity on a line.
template <class S>
struct LineState {
  using Scalar = S;
  static constexpr int dof = 2;
  static constexpr smoother::Role role = smoother::Role::state;
  static constexpr const char* name = "line state";
  static constexpr const char* axis_name(int i) { return i == 0 ? "position" : "velocity"; }
  using Step = Eigen::Matrix<S, 2, 1>;
  Step value = Step::Zero();
  LineState retract(const Step& d) const { return {value + d}; }
  Step local(const LineState& y) const { return y.value - value; }
  static Step linearisation_scale() { return Step::Ones(); }
};

/// A measured position; sigma in metres.
template <class S>
struct LinePosition {
  using Scalar = S;
  static constexpr int max_rows = 1, max_keys = 1, max_columns = 2;
  static constexpr const char* name = "line position";
  smoother::Key<LineState<S>> state{};
  S measured{0}, sigma{1};
  int rows() const { return 1; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(state);
  }
  template <class Values>
  void evaluate(const Values& values, S* e) const {
    e[0] = (values(state).value[0] - measured) / sigma;
  }
  template <class Values>
  void linearise(const Values& values, S* e, smoother::JacobianRef<S> J) const {
    evaluate(values, e);
    J(0, 0) = S(1) / sigma;
  }
  S weigh(const S* e, S* w) const { return smoother::weigh_gaussian(e, 1, w); }
};

/// Constant velocity over dt with small process noise.
template <class S>
struct LineMotion {
  using Scalar = S;
  static constexpr int max_rows = 2, max_keys = 2, max_columns = 4;
  static constexpr const char* name = "line motion";
  smoother::Key<LineState<S>> from{}, to{};
  S dt{1}, sigma_position{1}, sigma_velocity{1};
  int rows() const { return 2; }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    visit(from);
    visit(to);
  }
  template <class Values>
  void evaluate(const Values& values, S* e) const {
    const auto &a = values(from).value, &b = values(to).value;
    e[0] = (b[0] - a[0] - dt * a[1]) / sigma_position, e[1] = (b[1] - a[1]) / sigma_velocity;
  }
  template <class Values>
  void linearise(const Values& values, S* e, smoother::JacobianRef<S> J) const {
    evaluate(values, e);
    J(0, 0) = -1 / sigma_position, J(0, 1) = -dt / sigma_position, J(0, 2) = 1 / sigma_position;
    J(1, 1) = -1 / sigma_velocity, J(1, 3) = 1 / sigma_velocity;
  }
  S weigh(const S* e, S* w) const { return smoother::weigh_gaussian(e, 2, w); }
};

template <class S>
struct LineProblem {
  using Scalar = S;
  using Variables = smoother::Types<smoother::Capacity<LineState<S>, 8>>;
  using Factors = smoother::Types<smoother::Capacity<LinePosition<S>, 16>, smoother::Capacity<LineMotion<S>, 8>>;
  static constexpr int max_front_dimension = 16;
  static constexpr int member_capacity = 64;
  static constexpr std::size_t arena_scalars = 8 * 17 * 17;
};

struct LineEstimate {
  double position{0}, velocity{0}, variance{0}, velocity_variance{0};
};

/// A window of five states driven over the measurements, marginalising all the way; the newest state at each step.
template <class S>
std::vector<LineEstimate> drive(const std::vector<double>& measurements) {
  const auto smoother = std::make_unique<smoother::FixedLagSmoother<LineProblem<S>>>();
  smoother::OptimiseOptions<S> options;
  options.step_tolerance = S(1e-5);
  std::vector<LineEstimate> estimates;
  smoother::Key<LineState<S>> last{};
  int states = 0;
  for (const double measured : measurements) {
    LineState<S> start;
    if (last.valid()) start = *smoother->find(last);
    const auto key = smoother->add_variable(start, GpsTime{static_cast<std::int64_t>(estimates.size()) * 100'000'000});
    REQUIRE(key.ok());
    if (last.valid()) {
      REQUIRE(smoother->add_factor(LineMotion<S>{last, *key, S(0.1), S(1e-3), S(1e-2)}).ok());
    } else {
      REQUIRE(smoother->add_factor(LinePosition<S>{*key, S(0), S(100)}).ok());
    }
    REQUIRE(smoother->add_factor(LinePosition<S>{*key, static_cast<S>(measured), S(0.02)}).ok());
    ++states, last = *key;
    if (states < 2) {
      estimates.push_back({});
      continue;
    }
    const auto report = smoother->optimise(options);
    CHECK((report.status.ok() || report.status.code == StatusCode::not_converged));
    const auto P = smoother->covariance(last);
    REQUIRE(P.ok());
    const auto& x = smoother->find(last)->value;
    estimates.push_back(
        {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>((*P)(0, 0)), static_cast<double>((*P)(1, 1))});
    if (states <= 5) continue;
    REQUIRE(smoother->marginalise_oldest(options).status.ok());
    --states;
  }
  return estimates;
}

}  // namespace

TEST_CASE("P20 float: the fixed-lag smoother over 2000 marginalisations: variances neither collapse nor grow, estimates follow double") {
  for_all_seeds(3, [](Rng& rng) {
    std::vector<double> measurements;
    double position = 0, velocity = uniform(rng, -1, 1);
    for (int k = 0; k < 2000; ++k) {
      position += 0.1 * velocity, velocity = 0.999 * velocity + normal(rng, 1e-2);
      measurements.push_back(position + normal(rng, 0.02));
    }
    const auto f = drive<float>(measurements), d = drive<double>(measurements);
    double worst = 0, worst_variance = 0;
    for (std::size_t k = 10; k < f.size(); ++k) {
      worst = std::max(worst, std::abs(f[k].position - d[k].position) / std::sqrt(d[k].variance));
      worst = std::max(worst, std::abs(f[k].velocity - d[k].velocity) / std::sqrt(d[k].velocity_variance));
      worst_variance = std::max(
          {worst_variance, std::abs(f[k].variance / d[k].variance - 1), std::abs(f[k].velocity_variance / d[k].velocity_variance - 1)});
    }
    CAPTURE(worst);
    CAPTURE(worst_variance);
    CHECK(worst < 0.05);           // of a standard deviation
    CHECK(worst_variance < 0.01);  // relative
  });
}
