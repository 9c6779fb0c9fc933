// SPDX-License-Identifier: BSD-3-Clause
// White jerk: covariance against integration, two intervals against one, whitening, Jacobians; the state prior; the state as a manifold.
#include <searvins/gnss/motion.hpp>

#include "gnss/factor_check.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using gnss::Pva;

namespace {

Pva random_pva(Rng& rng, double size = 10) {
  Pva x;
  x.p_wa_m = random_vector<3>(rng, size), x.v_wa_mps = random_vector<3>(rng, size), x.a_wa_mps2 = random_vector<3>(rng, size);
  return x;
}

Eigen::Matrix3d transition(double dt) {
  Eigen::Matrix3d F;
  F << 1, dt, dt * dt / 2, 0, 1, dt, 0, 0, 1;
  return F;
}

/// cov(w) = integral of F(dt - t) G q G' F(dt - t)' over the interval, G = (0, 0, 1)', by Simpson's rule: exact to its order for degree 4 after refinement.
Eigen::Matrix3d integrated_covariance(double dt, double q) {
  const int n = 200;
  Eigen::Matrix3d Q = Eigen::Matrix3d::Zero();
  for (int k = 0; k <= n; ++k) {
    const Eigen::Vector3d g = transition(dt * k / n).col(2);
    Q += (k == 0 || k == n ? 1.0 : k % 2 == 1 ? 4.0 : 2.0) * q * g * g.transpose();
  }
  return Q * (dt / n / 3);
}

Eigen::Matrix3d factor_covariance(double dt, double q) {
  gnss::WhiteJerkFactor f;
  f.dt_s = dt, f.jerk_psd_m2ps5 = q;
  const Eigen::Matrix3d R_inverse = f.whitening().inverse();
  return R_inverse * R_inverse.transpose();
}

/// Largest difference of two covariances in units of the sigmas of the second.
double relative_difference(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const Eigen::Vector3d s = b.diagonal().cwiseSqrt().cwiseInverse();
  return (s.asDiagonal() * (a - b) * s.asDiagonal()).cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("the whitening of white jerk is that of the integrated covariance") {
  for_all_seeds(200, [](Rng& rng) {
    const double dt = std::pow(10.0, uniform(rng, -3, 2)), q = std::pow(10.0, uniform(rng, -4, 3));
    CAPTURE(dt);
    CHECK(relative_difference(factor_covariance(dt, q), integrated_covariance(dt, q)) < 1e-8);
  });
}

TEST_CASE("two intervals of white jerk compose to one: Q(a + b) = F(b) Q(a) F(b)' + Q(b)") {
  for_all_seeds(200, [](Rng& rng) {
    const double a = std::pow(10.0, uniform(rng, -2, 1)), b = std::pow(10.0, uniform(rng, -2, 1)), q = std::pow(10.0, uniform(rng, -3, 2));
    const Eigen::Matrix3d F = transition(b), composed = F * factor_covariance(a, q) * F.transpose() + factor_covariance(b, q);
    CHECK(relative_difference(composed, factor_covariance(a + b, q)) < 1e-10);
  });
}

TEST_CASE("white jerk: a predicted state has no residual, a displaced one is whitened per axis, Jacobians equal differences") {
  for_all_seeds(100, [](Rng& rng) {
    FactorValues values;
    gnss::WhiteJerkFactor f;
    f.dt_s = uniform(rng, 0.05, 30), f.jerk_psd_m2ps5 = uniform(rng, 0.1, 10);
    const Pva from = random_pva(rng), to = from.predict(f.dt_s);
    f.from = values.add(from), f.to = values.add(to);
    double e[9];
    f.evaluate(values, e);
    for (double x : e) CHECK(std::abs(x) < 1e-6);
    Pva::Step d = random_vector<9>(rng);
    values.at(f.to) = to.retract(d);
    f.evaluate(values, e);
    const Eigen::Matrix3d information = integrated_covariance(f.dt_s, f.jerk_psd_m2ps5).inverse();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d r{d[axis], d[3 + axis], d[6 + axis]}, w{e[3 * axis], e[3 * axis + 1], e[3 * axis + 2]};
      CHECK(w.squaredNorm() == doctest::Approx(r.dot(information * r)).epsilon(1e-6));
    }
    check_jacobian(f, values, 1e-7);
  });
}

TEST_CASE("the state prior: sigmas per group, Jacobians equal differences") {
  for_all_seeds(50, [](Rng& rng) {
    FactorValues values;
    gnss::PvaPriorFactor f;
    f.mean = random_pva(rng);
    f.sigma_position_m = uniform(rng, 1, 100), f.sigma_velocity_mps = uniform(rng, 1, 50), f.sigma_acceleration_mps2 = uniform(rng, 0.1, 5);
    f.state = values.add(random_pva(rng));
    double e[9];
    f.evaluate(values, e);
    const Pva::Step d = f.mean.local(values(f.state));
    for (int i = 0; i < 9; ++i)
      CHECK(e[i] * (i < 3 ? f.sigma_position_m : i < 6 ? f.sigma_velocity_mps : f.sigma_acceleration_mps2) == doctest::Approx(d[i]));
    check_jacobian(f, values, 1e-7);
  });
}

TEST_CASE("position-velocity-acceleration is a manifold and predicts in steps as in one") {
  for_all_seeds(100, [](Rng& rng) {
    const Pva x = random_pva(rng);
    const Pva::Step d = random_vector<9>(rng, 3);
    CHECK(close(x.local(x.retract(d)), d, 1e-14));
    const double a = uniform(rng, 0, 3), b = uniform(rng, 0, 3);
    CHECK(x.predict(a).predict(b).local(x.predict(a + b)).norm() < 1e-11);
    Eigen::Matrix<double, 3, 9> dp, dv;
    const Eigen::Vector3d p = gnss::antenna_position_w_m(x, &dp), v = gnss::antenna_velocity_w_mps(x, &dv);
    CHECK(close(gnss::antenna_position_w_m(x.retract(d)), (p + dp * d).eval(), 1e-14));
    CHECK(close(gnss::antenna_velocity_w_mps(x.retract(d)), (v + dv * d).eval(), 1e-14));
  });
  for (int i = 0; i < 9; ++i) CHECK(std::string{Pva::axis_name(i)} != "?");
  CHECK(std::string{Pva::axis_name(9)} == "?");
}
