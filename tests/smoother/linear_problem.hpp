// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A linear test problem with every role of variable, and the dense batch solution that the fixed-lag smoother must reproduce.
#pragma once

#include <Eigen/Dense>

#include <map>
#include <vector>

#include <searvins/smoother/fixed_lag_smoother.hpp>

#include "support/property.hpp"

namespace searvins::test {

/// A vector-space variable.
template <int N, smoother::Role R, int Tag>
struct VectorVariable {
  using Scalar = double;
  static constexpr int dof = N;
  static constexpr smoother::Role role = R;
  static constexpr const char* name = R == smoother::Role::state ? "state" : R == smoother::Role::chain ? "chain" : "local";
  static constexpr const char* axis_name(int i) {
    constexpr const char* names[] = {"x", "y", "z"};
    return names[i];
  }
  Eigen::Matrix<double, N, 1> value = Eigen::Matrix<double, N, 1>::Zero();
  using Step = Eigen::Matrix<double, N, 1>;
  VectorVariable retract(const Step& d) const { return {value + d}; }
  Step local(const VectorVariable& y) const { return y.value - value; }
  static Step linearisation_scale() { return Step::Constant(1.0); }
};
using TestState = VectorVariable<3, smoother::Role::state, 0>;
using TestChain = VectorVariable<1, smoother::Role::chain, 1>;
using TestLocal = VectorVariable<2, smoother::Role::local, 2>;

/// e = A_1 x_1 + A_2 x_2 + ... - b over any mix of variables, two rows. Of a state it touches the first StateAxes axes.
template <int StateAxes>
struct BasicLinearFactor {
  using Scalar = double;
  static constexpr int max_rows = 2, max_keys = 4, max_columns = 9;
  static constexpr const char* name = "linear";
  StaticVector<smoother::Key<TestState>, 2> states{};
  StaticVector<smoother::Key<TestChain>, 2> chains{};
  StaticVector<smoother::Key<TestLocal>, 1> locals{};
  Eigen::Matrix<double, 2, 9> A = Eigen::Matrix<double, 2, 9>::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();

  int rows() const { return 2; }
  template <class V>
  static constexpr int leading_axes() {
    return V::role == smoother::Role::state ? StateAxes : V::dof;
  }
  /// Columns that are zeros by what leading_axes() says.
  void clear_untouched_columns() {
    for (std::size_t k = 0; k < states.size(); ++k) A.middleCols(static_cast<int>(3 * k) + StateAxes, 3 - StateAxes).setZero();
  }
  template <class Visit>
  void for_each_key(Visit&& visit) const {
    for (const auto& k : states) visit(k);
    for (const auto& k : chains) visit(k);
    for (const auto& k : locals) visit(k);
  }
  template <class Values>
  void evaluate(const Values& values, double* e) const {
    Eigen::Vector2d sum = -b;
    int column = 0;
    const auto add = [&](const auto& x) {
      for (int i = 0; i < x.value.size(); ++i) sum += A.col(column++) * x.value[i];
    };
    for (const auto& k : states) add(values(k));
    for (const auto& k : chains) add(values(k));
    for (const auto& k : locals) add(values(k));
    e[0] = sum[0], e[1] = sum[1];
  }
  template <class Values>
  void linearise(const Values& values, double* e, smoother::JacobianRef<double> J) const {
    evaluate(values, e);
    const int columns = static_cast<int>(3 * states.size() + chains.size() + 2 * locals.size());
    for (int c = 0; c < columns; ++c) J(0, c) = A(0, c), J(1, c) = A(1, c);
  }
  double weigh(const double* e, double* w) const { return smoother::weigh_gaussian(e, 2, w); }
};

using LinearFactor = BasicLinearFactor<3>;
using PoseFactor = BasicLinearFactor<1>;

struct LinearProblem {
  using Scalar = double;
  using Variables = smoother::Types<smoother::Capacity<TestState, 12>, smoother::Capacity<TestChain, 24>, smoother::Capacity<TestLocal, 24>>;
  using Factors = smoother::Types<smoother::Capacity<LinearFactor, 400>, smoother::Capacity<PoseFactor, 200>>;
  static constexpr int max_front_dimension = 64;
  static constexpr int member_capacity = 600;
  static constexpr std::size_t arena_scalars = 12 * 65 * 65;
};
using LinearSmoother = smoother::FixedLagSmoother<LinearProblem>;

/// The same problem, never forgetting anything, as one dense least squares.
struct DenseBatch {
  std::map<std::pair<int, std::pair<unsigned, unsigned>>, int> first;  ///< (type, slot, generation) -> first column
  int columns{0};
  std::vector<Eigen::VectorXd> rows;
  std::vector<double> rhs;

  template <class V>
  static std::pair<int, std::pair<unsigned, unsigned>> id(const smoother::Key<V>& k) {
    return {LinearProblem::Variables::index_of<V>(), {k.slot, k.generation}};
  }
  template <class V>
  void add(const smoother::Key<V>& key) {
    first[id(key)] = columns;
    columns += V::dof;
  }
  template <int Axes>
  void add(const BasicLinearFactor<Axes>& f) {
    for (int r = 0; r < 2; ++r) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(columns);
      int c = 0;
      f.for_each_key([&]<class V>(const smoother::Key<V>& k) {
        for (int i = 0; i < V::dof; ++i) row[first.at(id(k)) + i] = f.A(r, c++);
      });
      rows.push_back(row);
      rhs.push_back(f.b[r]);
    }
  }
  Eigen::MatrixXd information() const {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<int>(rows.size()), columns);
    for (std::size_t r = 0; r < rows.size(); ++r) J.row(static_cast<int>(r)).head(rows[r].size()) = rows[r].transpose();
    return J.transpose() * J;
  }
  Eigen::VectorXd gradient() const {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(columns);
    for (std::size_t r = 0; r < rows.size(); ++r) g.head(rows[r].size()) += rows[r] * rhs[r];
    return g;
  }
};

}  // namespace searvins::test
