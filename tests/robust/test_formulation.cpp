// SPDX-License-Identifier: BSD-3-Clause
// Algebra of the formulations: equivalence, gradients, limits. What each is for: test_formulation_scenarios.cpp.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>

#include "linear_batch.hpp"

using namespace searvins::robust;
using namespace searvins::test;

namespace {

constexpr int kColumns = 3;

VectorX<double> random_x(Rng& rng) { return VectorX<double>{random_vector<kColumns>(rng, 2.0)}; }

/// (x, n) moved by h along column c of [x n].
Rows<double> moved(const Form<double>& form, const Problem<double>& p, VectorX<double> x, double n, int c, double h) {
  if (c < kColumns)
    x[c] += h;
  else
    n += h;
  return form.at(p, x, n);
}

}  // namespace

TEST_CASE("names, rows and latents of the formulations") {
  static_assert(std::is_same_v<Scalar<Dcs<double>>, ScalarRows<Dcs<double>>>);
  static_assert(!Batch<Dcs<double>>::has_latent && Batch<Dcs<double>>::extra_rows == 0);
  static_assert(!ScalarRows<Dcs<double>>::has_latent && ScalarRows<Dcs<double>>::extra_rows == 0);
  static_assert(LatentPivot<Dcs<double>>::has_latent && LatentPivot<Dcs<double>>::extra_rows == 1);
  static_assert(LatentPivotSymmetric<Dcs<double>>::has_latent && LatentPivotSymmetric<Dcs<double>>::extra_rows == 1);
  CHECK(std::string{Batch<Dcs<double>>::name} == "batch");
  CHECK(std::string{Scalar<Dcs<double>>::name} == "scalar");
  CHECK(std::string{LatentPivot<Dcs<double>>::name} == "latent");
  CHECK(std::string{LatentPivotSymmetric<Dcs<double>>::name} == "symmetric");
}

TEST_CASE_TEMPLATE("paper's equivalence: with unit weights all formulations have cost, gradient and Hessian of r' Sigma^-1 r / 2", S, float,
                   double) {
  const double tolerance = std::is_same_v<S, double> ? 1e-9 : 2e-3;
  const auto forms = forms_of(Gaussian<S>{});
  for_all_seeds(200, [&](Rng& rng) {
    const int m = integer(rng, 1, kMost);
    const Problem<S> p = random_problem<S>(rng, m, kColumns, std::is_same_v<S, double> ? 2.0 : 0.7);
    const VectorX<S> x = random_x(rng).template cast<S>();

    MatrixX<double> sigma = MatrixX<double>::Constant(m, m, static_cast<double>(p.cov.pivot_variance()));
    for (int i = 0; i < m; ++i) sigma(i, i) += static_cast<double>(p.cov.candidate_variance(i));
    MatrixX<double> G_and_r(m, kColumns + 1);
    G_and_r.leftCols(kColumns) = p.G.template cast<double>();
    G_and_r.col(kColumns) = p.residual(x).template cast<double>();
    const MatrixX<double> all = times(G_and_r.transpose(), solve_dense<double>(sigma, G_and_r));  // [G r]' Sigma^-1 [G r]
    const MatrixX<double> hessian = all.topLeftCorner(kColumns, kColumns);
    const VectorX<double> gradient = all.col(kColumns).head(kColumns);
    const double cost = all(kColumns, kColumns) / 2;

    for (const auto& form : forms) {
      INFO(form->name);
      const S n = form->gaussian_start(p, x);
      const Rows<S> at = form->at(p, x, n);
      CHECK((at.w.array() == S(1)).all());
      CHECK(std::abs(static_cast<double>(at.cost) - cost) <= tolerance * cost);
      VectorX<double> g = at.gradient().template cast<double>();
      MatrixX<double> H = at.hessian().template cast<double>();
      if (form->has_latent) {
        CHECK(std::abs(g[kColumns]) <= tolerance * std::sqrt(H(kColumns, kColumns)) * (1 + std::sqrt(cost)));  // n* is the minimum over n
        // Elsewhere in n the eliminated system is the same one: that is what a Schur complement hands to the smoother.
        const Rows<S> away = form->at(p, x, n + static_cast<S>(normal(rng, 0.3)));
        g = away.gradient().template cast<double>();
        for (int i = 0; i < kColumns; ++i) {
          g[i] -= H(i, kColumns) * g[kColumns] / H(kColumns, kColumns);
          for (int j = 0; j < kColumns; ++j) H(i, j) -= H(i, kColumns) * H(kColumns, j) / H(kColumns, kColumns);
        }
      }
      CHECK((g.head(kColumns) - gradient).norm() <= tolerance * (gradient.norm() + std::sqrt(cost * hessian.trace())));
      CHECK((H.topLeftCorner(kColumns, kColumns) - hessian).norm() <= tolerance * hessian.norm());
    }
  });
}

TEST_CASE(
    "P6: whitened Jacobians agree with central differences, and the gradient of the total cost is J' W e, for every formulation and loss") {
  const auto forms = all_forms<double>();
  for_all_seeds(60, [&](Rng& rng) {
    const Problem<double> p = random_problem<double>(rng, integer(rng, 1, 12), kColumns, 0.7);
    const VectorX<double> x = random_x(rng);
    const double n = normal(rng), h = 1e-5;
    for (const auto& form : forms) {
      INFO(form->name);
      const Rows<double> at = form->at(p, x, n);
      const VectorX<double> gradient = at.gradient();
      for (int c = 0; c < at.A.cols(); ++c) {
        const Rows<double> up = moved(*form, p, x, n, c, h), down = moved(*form, p, x, n, c, -h);
        const VectorX<double> de = (up.e - down.e) / (2 * h);  // e is linear: exact but for rounding
        CHECK((at.A.col(c) - de).norm() <= 1e-8 * (1 + de.norm() + at.e.norm()));
        // Allowed: h times the jump of curvature where a row crosses a seam within h, and rounding of the cost over h.
        const double allowed = 2 * h * at.A.col(c).squaredNorm() + 1e-9 * at.cost + 1e-8;
        CHECK(std::abs(gradient[c] - (up.cost - down.cost) / (2 * h)) <= allowed);
      }
    }
  });
}

TEST_CASE_TEMPLATE("one candidate: batch, batch by size and scalar are the same thing", S, float, double) {
  const auto forms = all_forms<S>();
  for_all_seeds(50, [&](Rng& rng) {
    const Problem<S> p = random_problem<S>(rng, 1, kColumns, 2.0);
    const VectorX<S> x = random_x(rng).template cast<S>();
    for (std::size_t k = 0; k < forms.size(); k += 5) {
      INFO(forms[k]->name);
      const Rows<S> batch = forms[k]->at(p, x, S(0));
      for (std::size_t other : {k + 1, k + 2}) {
        const Rows<S> rows = forms[other]->at(p, x, S(0));
        CHECK(rows.e == batch.e);
        CHECK(rows.A == batch.A);
        CHECK(rows.w == batch.w);
        CHECK(rows.cost == batch.cost);
      }
    }
  });
}

TEST_CASE_TEMPLATE("no pivot error: scalar and latent have the same candidate weights and cost, and n stays 0 under a Gaussian prior", S,
                   float, double) {
  const S tolerance = 100 * std::numeric_limits<S>::epsilon();
  const auto forms = all_forms<S>();
  for_all_seeds(50, [&](Rng& rng) {
    Problem<S> p = random_problem<S>(rng, integer(rng, 1, 12), kColumns, 2.0);
    std::array<S, kMost> d{};
    for (int i = 0; i < p.m(); ++i) d[static_cast<std::size_t>(i)] = p.cov.candidate_variance(i);
    p.cov = Cov<S>::from(d.data(), p.m(), S(0)).value();
    const VectorX<S> x = random_x(rng).template cast<S>();
    for (std::size_t k = 0; k < forms.size(); k += 5) {
      INFO(forms[k]->name);
      const Rows<S> scalar = forms[k + 2]->at(p, x, S(0));
      CHECK(forms[k + 3]->gaussian_start(p, x) == S(0));
      CHECK(std::abs(forms[k + 3]->robust_start(p, x)) <= tolerance * p.residual(x).cwiseAbs().maxCoeff());
      for (std::size_t latent : {k + 3, k + 4}) {
        const Rows<S> rows = forms[latent]->at(p, x, S(0));
        CHECK((rows.w.head(p.m()) - scalar.w).cwiseAbs().maxCoeff() <= tolerance);
        CHECK(rows.w[p.m()] == S(1));
        CHECK(std::abs(rows.cost - scalar.cost) <= tolerance * scalar.cost);
        CHECK(rows.A.allFinite());
      }
    }
  });
}

TEST_CASE("batch by size: the loss sees |e|^2 / m, and a healthy batch keeps its weight") {
  Batch<Dcs<double>> published, by_size;
  by_size.normalise_by_size = true;
  std::array<double, 8> e{}, w{};
  e.fill(1.0);
  CHECK(published.weigh(e.data(), 8, w.data()) == doctest::Approx(Dcs<double>{}.rho(8.0)));
  CHECK(w[0] == doctest::Approx(std::pow(3.0 / 9.5, 2)).epsilon(1e-14));  // 0.0997: the figure for a healthy batch of eight
  CHECK(by_size.weigh(e.data(), 8, w.data()) == doctest::Approx(4.0).epsilon(1e-14));
  CHECK(w[7] == 1.0);
  e.fill(3.0);
  CHECK(by_size.weigh(e.data(), 8, w.data()) == doctest::Approx(8 * Dcs<double>{}.rho(9.0)).epsilon(1e-14));
  CHECK(w[0] == doctest::Approx(Dcs<double>{}.weight(9.0)).epsilon(1e-14));
}

TEST_CASE("the setting of the loss reaches the weights of every formulation") {
  Rng rng{3};
  const Problem<double> p = random_problem<double>(rng, 6, kColumns, 0.5, 6.0);
  const VectorX<double> x = random_x(rng);
  const auto usual = forms_of(Dcs<double>{}), tight = forms_of(Dcs<double>{0.1});
  for (std::size_t k = 0; k < usual.size(); ++k) {
    INFO(usual[k]->name);
    const Rows<double> a = usual[k]->at(p, x, 0.0), b = tight[k]->at(p, x, 0.0);
    CHECK(a.e == b.e);
    CHECK(a.w != b.w);
    CHECK(a.cost > b.cost);
  }
}

TEST_CASE("the arrays may be the same: e over r, de over dr") {
  for_all_seeds(30, [](Rng& rng) {
    const int m = integer(rng, 1, 12);
    const Problem<double> p = random_problem<double>(rng, m, kColumns, 1.0);
    const double n = normal(rng);
    const auto check = [&](const auto& f) {
      const Rows<double> apart = linearise(f, p, VectorX<double>(VectorX<double>::Zero(kColumns)), n);
      std::array<double, kMost + 1> e{}, dn{};
      Eigen::Matrix<double, kMost + 1, kColumns> J;
      for (int i = 0; i < m; ++i) {
        e[static_cast<std::size_t>(i)] = p.r0[i];
        for (int c = 0; c < kColumns; ++c) J(i, c) = p.G(i, c);
      }
      f.whiten(p.cov, e.data(), n, e.data());
      f.whiten_jacobian(p.cov, J, J, dn.data());
      for (int i = 0; i < apart.e.size(); ++i) {
        CHECK(e[static_cast<std::size_t>(i)] == apart.e[i]);
        for (int c = 0; c < kColumns; ++c) CHECK(J(i, c) == apart.A(i, c));
      }
    };
    check(Batch<Dcs<double>>{});
    check(LatentPivot<Dcs<double>>{});
  });
}
