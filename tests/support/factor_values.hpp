// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Values of variables by key, for factors under test outside a smoother, and the numeric Jacobian of a factor among them.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cstdint>
#include <tuple>
#include <vector>

#include <searvins/smoother/variable.hpp>

namespace searvins::test {

/// One list a type of variable; a key names a place in its list.
template <class... Variables>
class FactorValuesOf {
 public:
  template <class V>
  smoother::Key<V> add(const V& value) {
    auto& list = std::get<std::vector<V>>(lists_);
    list.push_back(value);
    return {static_cast<std::uint32_t>(list.size() - 1), 1};
  }
  template <class V>
  [[nodiscard]] const V& operator()(const smoother::Key<V>& key) const {
    REQUIRE(key.valid());
    return std::get<std::vector<V>>(lists_).at(key.slot);
  }
  template <class V>
  [[nodiscard]] V& at(const smoother::Key<V>& key) {
    return std::get<std::vector<V>>(lists_).at(key.slot);
  }

 private:
  std::tuple<std::vector<Variables>...> lists_{};
};

/// The columns that variable `key` has in a factor's Jacobian, by central differences along each of its axes.
template <int Rows, class F, class Values, class V>
[[nodiscard]] Eigen::Matrix<double, Rows, V::dof> numeric_columns(const F& f, Values& values, const smoother::Key<V>& key, double step) {
  Eigen::Matrix<double, Rows, V::dof> J;
  const V before = values.at(key);
  const auto residual_at = [&](double d, int axis) {
    Eigen::Matrix<double, Rows, 1> e;
    values.at(key) = before.retract(typename V::Step{d * V::Step::Unit(axis)});
    f.evaluate(values, e.data());
    return e;
  };
  for (int i = 0; i < V::dof; ++i) J.col(i) = (residual_at(step, i) - residual_at(-step, i)) / (2 * step);
  values.at(key) = before;
  return J;
}

/// Largest difference of two matrices in columns [first, first + count), against the largest entry of the first there.
template <class Derived>
[[nodiscard]] double part_error(const Eigen::MatrixBase<Derived>& J, const Derived& other, int first, int count) {
  return (J - other).middleCols(first, count).cwiseAbs().maxCoeff() / J.middleCols(first, count).cwiseAbs().maxCoeff();
}

}  // namespace searvins::test
