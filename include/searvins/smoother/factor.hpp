// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the smoother minimises: the Factor concept.
///
/// A factor turns some variables x into whitened residual rows and says how much each row is believed:
///
///     e(x)          rows, dimensionless: residuals times the square root of their information
///     J = de/dx     columns in the order of for_each_key, tangent spaces concatenated
///     weigh(e, w)   -> rho(e), the robust cost; w_i is the information weight of row i, with  d rho = sum_i w_i e_i de_i
///
/// The normal equations are J' diag(w) J d = -J' diag(w) e (IRLS: w is held fixed in the linear solve), and step control compares sum rho, the
/// very function whose gradient is J' diag(w) e.
///
/// A factor that has columns of zeros at the end of a variable's tangent space, whatever the values, may say so by a member template
///
///     template <class V> static constexpr int leading_axes()       axes of V before those
///
/// which keeps the others out of the fronts before the one that eliminates the variable: a landmark ties together the poses that see it, not their
/// velocities and biases.
///
/// A plain struct models it: no base class, no virtual function. All members are const and touch nothing but their arguments.
#pragma once

#include <Eigen/Core>

#include <concepts>
#include <cstddef>

#include <searvins/smoother/variable.hpp>

namespace searvins::smoother {

/// A writable rows x columns Jacobian, column-major, zero on entry.
template <class Scalar>
struct JacobianRef {
  Scalar* data;
  int leading_dimension;

  [[nodiscard]] Scalar& operator()(int row, int column) const { return data[static_cast<std::ptrdiff_t>(column) * leading_dimension + row]; }

  /// The R x C block whose first element is (row, column).
  template <int R, int C>
  [[nodiscard]] auto block(int row, int column) const {
    return Eigen::Map<Eigen::Matrix<Scalar, R, C, (R == 1 && C > 1) ? Eigen::RowMajor : Eigen::ColMajor>, 0, Stride<R, C>>(
        &(*this)(row, column), stride<R, C>());
  }

 private:
  // A single row of a column-major matrix is strided by the leading dimension between its elements.
  template <int R, int C>
  using Stride = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
  template <int R, int C>
  [[nodiscard]] Stride<R, C> stride() const {
    if constexpr (R == 1 && C > 1) return {1, leading_dimension};
    return {leading_dimension, 1};
  }
};

namespace detail {
struct AnyValues {
  template <class V>
  const V& operator()(const Key<V>& key) const;
};
struct AnyVisitor {
  template <class V>
  void operator()(const Key<V>& key) const;
};
}  // namespace detail

/// See the file comment. Static members: Scalar, max_rows, max_keys, max_columns, name. `values(key)` gives the value of a variable.
template <class F>
concept Factor = std::default_initializable<F> &&
                 requires(const F& f, typename F::Scalar* e, typename F::Scalar* w, JacobianRef<typename F::Scalar> J) {
                   typename F::Scalar;
                   requires(F::max_rows > 0);
                   requires(F::max_keys > 0);
                   requires(F::max_columns > 0);
                   { F::name } -> std::convertible_to<const char*>;
                   { f.rows() } -> std::convertible_to<int>;
                   f.for_each_key(detail::AnyVisitor{});
                   f.evaluate(detail::AnyValues{}, e);
                   f.linearise(detail::AnyValues{}, e, J);
                   { f.weigh(static_cast<const typename F::Scalar*>(e), w) } -> std::convertible_to<typename F::Scalar>;
                 };

/// Axes of V that a factor may have non-zero columns for, counted from the first.
template <class F, class V>
[[nodiscard]] constexpr int leading_axes_of() {
  if constexpr (requires { F::template leading_axes<V>(); }) {
    static_assert(F::template leading_axes<V>() > 0 && F::template leading_axes<V>() <= V::dof, "leading_axes lies in 1..dof");
    return F::template leading_axes<V>();
  } else {
    return V::dof;
  }
}

/// Gaussian rows: every weight one, rho = |e|^2 / 2. For factors without a robust policy.
template <class Scalar>
[[nodiscard]] Scalar weigh_gaussian(const Scalar* e, int rows, Scalar* w) {
  Scalar sum = 0;
  for (int i = 0; i < rows; ++i) {
    w[i] = 1;
    sum += e[i] * e[i];
  }
  return sum / 2;
}

}  // namespace searvins::smoother
