// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Batches whose residuals are linear in x, seen through any formulation, for the tests of this folder.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "searvins/robust/formulation.hpp"
#include "support/property.hpp"

namespace searvins::test {

inline constexpr int kMost = 30;
template <class S>
using Cov = robust::SharedPivot<S, kMost>;
template <class S>
using MatrixX = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
template <class S>
using VectorX = Eigen::Matrix<S, Eigen::Dynamic, 1>;

/// A B without Eigen's blocked kernels, which would triple the compile time of these tests.
template <class A, class B>
auto times(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  using Product = Eigen::Matrix<typename A::Scalar, Eigen::Dynamic, B::ColsAtCompileTime>;
  if (a.cols() == 0) return Product(Product::Zero(a.rows(), b.cols()));  // an empty block has no address to offset
  return Product(a.derived().lazyProduct(b.derived()));
}

/// Dense A^-1 B for a positive definite A, by elimination without pivoting.
template <class S>
MatrixX<S> solve_dense(MatrixX<S> a, MatrixX<S> b) {
  const int n = static_cast<int>(a.rows()), columns = static_cast<int>(b.cols());
  const auto subtract_row = [&](int from, int to) {
    const S factor = a(to, from) / a(from, from);
    for (int j = from; j < n; ++j) a(to, j) -= factor * a(from, j);
    for (int c = 0; c < columns; ++c) b(to, c) -= factor * b(from, c);
  };
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i)
      if (i != k) subtract_row(k, i);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < columns; ++c) b(i, c) /= a(i, i);
  return b;
}

/// Residuals r = r0 + G x with their covariance.
template <class S>
struct Problem {
  Cov<S> cov;
  VectorX<S> r0;
  MatrixX<S> G;
  [[nodiscard]] int m() const { return cov.size(); }
  [[nodiscard]] VectorX<S> residual(const VectorX<S>& x) const { return r0 + times(G, x); }
};

/// Variances within 10^(+-decades), residuals of size `spread`.
template <class S>
Problem<S> random_problem(Rng& rng, int m, int columns, double decades, double spread = 3.0) {
  Problem<S> p;
  VectorX<S> d(m);
  p.r0.resize(m);
  p.G.resize(m, columns);
  for (int i = 0; i < m; ++i) {
    d[i] = static_cast<S>(std::pow(10.0, uniform(rng, -decades, decades)));
    p.r0[i] = static_cast<S>(normal(rng, spread));
    for (int c = 0; c < columns; ++c) p.G(i, c) = static_cast<S>(normal(rng));
  }
  p.cov = Cov<S>::from(d.data(), m, static_cast<S>(std::pow(10.0, uniform(rng, -decades, decades)))).value();
  return p;
}

/// Whitened rows at (x, n), their derivatives A = [de/dx de/dn], weights and total cost.
template <class S>
struct Rows {
  VectorX<S> e, w;
  MatrixX<S> A;
  S cost{};

  [[nodiscard]] VectorX<S> gradient() const { return times(A.transpose(), w.cwiseProduct(e)); }
  [[nodiscard]] MatrixX<S> hessian() const {
    MatrixX<S> weighted = A;
    for (int i = 0; i < w.size(); ++i) weighted.row(i) *= w[i];
    return times(A.transpose(), weighted);
  }
};

template <class S>
Rows<S> room_for(int rows, int columns) {
  return {VectorX<S>(rows), VectorX<S>(rows), MatrixX<S>(rows, columns), S(0)};
}

template <class F, class S = typename F::Scalar>
Rows<S> linearise(const F& f, const Problem<S>& p, const VectorX<S>& x, S n) {
  const int columns = static_cast<int>(p.G.cols());
  Rows<S> rows = room_for<S>(p.m() + F::extra_rows, columns + (F::has_latent ? 1 : 0));
  F::whiten(p.cov, p.residual(x).data(), n, rows.e.data());
  F::whiten_jacobian(p.cov, p.G, rows.A, F::has_latent ? &rows.A(0, columns) : nullptr);
  rows.cost = f.weigh(rows.e.data(), static_cast<int>(rows.e.size()), rows.w.data());
  return rows;
}

/// One formulation with one loss, its type forgotten. The starts of the latent are 0 where there is none.
template <class S>
struct Form {
  std::string name;
  bool has_latent;
  virtual ~Form() = default;
  [[nodiscard]] virtual Rows<S> at(const Problem<S>& p, const VectorX<S>& x, S n) const = 0;
  [[nodiscard]] virtual S gaussian_start(const Problem<S>& p, const VectorX<S>& x) const = 0;
  [[nodiscard]] virtual S robust_start(const Problem<S>& p, const VectorX<S>& x) const = 0;

 protected:
  Form(std::string title, bool latent) : name(std::move(title)), has_latent(latent) {}
};
template <class S>
using Forms = std::vector<std::shared_ptr<const Form<S>>>;

template <class F>
struct FormOf final : Form<typename F::Scalar> {
  using S = typename F::Scalar;
  F f;
  FormOf(const F& formulation, const char* suffix)
      : Form<S>(std::string{F::name} + suffix + " " + F::LossType::name, F::has_latent), f(formulation) {}
  [[nodiscard]] Rows<S> at(const Problem<S>& p, const VectorX<S>& x, S n) const override { return linearise(f, p, x, n); }
  [[nodiscard]] S gaussian_start(const Problem<S>& p, const VectorX<S>& x) const override {
    if constexpr (F::has_latent) return F::initial_latent(p.cov, p.residual(x).data());
    return S(0);
  }
  [[nodiscard]] S robust_start(const Problem<S>& p, const VectorX<S>& x) const override {
    if constexpr (F::has_latent) return f.robust_initial_latent(p.cov, p.residual(x).data());
    return S(0);
  }
};

template <class F, class S = typename F::Scalar>
std::shared_ptr<const Form<S>> form_of(const F& f, const char* suffix = "") {
  return std::shared_ptr<const Form<S>>(new FormOf<F>(f, suffix));
}

/// All formulations over one loss, both settings of Batch included: batch, batch by size, scalar, latent, symmetric.
template <class L, class S = typename L::Scalar>
Forms<S> forms_of(const L& loss) {
  robust::Batch<L> batch, by_size;
  batch.loss = by_size.loss = loss;
  by_size.normalise_by_size = true;
  robust::ScalarRows<L> scalar;
  scalar.loss = loss;
  return {form_of(batch), form_of(by_size, " by size"), form_of(scalar), form_of(robust::LatentPivot<L>{loss}),
          form_of(robust::LatentPivotSymmetric<L>{loss})};
}

/// All formulations over all losses; in float over the paper's two (compile time).
template <class S>
Forms<S> all_forms() {
  Forms<S> all;
  const auto add = [&](const auto& loss) {
    for (const auto& form : forms_of(loss)) all.push_back(form);
  };
  add(robust::Huber<S>{});
  add(robust::Dcs<S>{});
  if constexpr (std::is_same_v<S, double>) {
    add(robust::Gaussian<S>{});
    add(robust::Cauchy<S>{});
    add(robust::GemanMcClure<S>{});
    add(robust::Tukey<S>{});
  }
  return all;
}

}  // namespace searvins::test
