// SPDX-License-Identifier: BSD-3-Clause
// One factor into the normal equations: both ways of summing against the dense J' W J, and the capacities that a Problem asks for.
#include <searvins/smoother/elimination_sizes.hpp>
#include <searvins/smoother/factor_assembly.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <vector>

#include "front_under_test.hpp"
#include "linear_problem.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxRows = 12, kMaxColumns = 50, kMaxFront = 60, kMaxLocal = 3;
constexpr smoother::TableSizes kSizes{8, 1, 1, 8, 80, 8, kMaxRows, kMaxColumns, kMaxRows* kMaxColumns};
using Tables = smoother::Tables<double, kSizes>;
using Local = smoother::LocalElimination<double, kMaxLocal, kMaxFront>;
using Assembly = smoother::FactorAssembly<Tables, Local, kMaxRows, kMaxColumns + 1, kMaxRows*(kMaxColumns + 1)>;

/// One factor over variables of a front whose places there are in no order, with the columns of each that it touches.
struct OneFactor {
  Tables tables{};
  smoother::FactorInfo factor{};
  int e{0}, s{0}, local_dof{0};
  std::vector<int> column_in_front;  ///< of each Jacobian column; the local variable's axes count from -local_dof

  /// `dofs` of the chain variables; a local variable of `local` axes, if any, is the first, middle or last key.
  OneFactor(Rng& rng, int rows, std::vector<int> dofs, int local, double zero_share) : local_dof(local) {
    place_in_front(rng, dofs);
    if (local > 0) add_local(rng, static_cast<int>(dofs.size()));
    factor.type = 0, factor.rows = rows, factor.keys = static_cast<int>(keys_.size());
    for (int k = 0; k < factor.keys; ++k) add_key(rng, k);
    fill(rng, zero_share);
    tables.find_spans(factor);
  }

  [[nodiscard]] int front_size() const { return e + s + 1; }

  /// J' W J over [local, front, residual].
  [[nodiscard]] MatrixXd normal_equations() const {
    MatrixXd J = MatrixXd::Zero(factor.rows, local_dof + front_size());
    for (int c = 0; c < factor.columns; ++c)
      for (int r = 0; r < factor.rows; ++r) J(r, local_dof + column_in_front[static_cast<std::size_t>(c)]) = tables.jacobian_column(factor, c)[r];
    for (int r = 0; r < factor.rows; ++r) J(r, J.cols() - 1) = tables.e_theta[static_cast<std::size_t>(r)];
    const VectorXd w = Eigen::Map<const VectorXd>(tables.weights.data(), factor.rows);
    return J.transpose() * w.asDiagonal() * J;
  }

 private:
  std::vector<int> keys_;

  /// The variables' places: shuffled, some of them in E.
  void place_in_front(Rng& rng, const std::vector<int>& dofs) {
    for (int id = 0; id < static_cast<int>(dofs.size()); ++id) keys_.push_back(id);
    std::vector<int> order = keys_;
    std::shuffle(order.begin(), order.end(), rng);
    const int in_e = integer(rng, 0, static_cast<int>(order.size()));
    int position = integer(rng, 0, 2);  // columns of variables that this factor does not touch
    for (int i = 0; i < static_cast<int>(order.size()); ++i) {
      if (i == in_e) e = position;
      smoother::VariableInfo& v = tables.variable(order[static_cast<std::size_t>(i)]);
      v.alive = true, v.dof = dofs[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])], v.position = position;
      position += v.dof + integer(rng, 0, 1);
    }
    if (in_e == static_cast<int>(order.size())) e = position;
    s = position - e;
  }

  void add_local(Rng& rng, int id) {
    smoother::VariableInfo& v = tables.variable(id);
    v.alive = true, v.dof = local_dof, v.role = smoother::Role::local;
    keys_.insert(keys_.begin() + integer(rng, 0, static_cast<int>(keys_.size())), id);
  }

  void add_key(Rng& rng, int k) {
    const int id = keys_[static_cast<std::size_t>(k)];
    const smoother::VariableInfo& v = tables.variable(id);
    const bool is_local = v.role == smoother::Role::local;
    tables.keys[static_cast<std::size_t>(k)] = id;
    tables.axes[static_cast<std::size_t>(k)] = is_local || chance(rng, 0.5) ? v.dof : integer(rng, 1, v.dof);
    for (int d = 0; d < v.dof; ++d) column_in_front.push_back(is_local ? d - local_dof : v.position + d);
    factor.columns += v.dof;
  }

  /// Numbers in the axes that are touched; zeros elsewhere, as leading_axes() promises.
  void fill(Rng& rng, double zero_share) {
    int column = 0;
    for (int k = 0; k < factor.keys; ++k)
      for (int d = 0; d < tables.variable(keys_[static_cast<std::size_t>(k)]).dof; ++d, ++column)
        for (int r = 0; r < factor.rows; ++r) {
          const bool zero = d >= tables.axes[static_cast<std::size_t>(k)] || chance(rng, zero_share);
          tables.jacobian[static_cast<std::size_t>(column * factor.rows + r)] = zero ? 0 : normal(rng);
        }
    for (int r = 0; r < factor.rows; ++r) {
      tables.e_theta[static_cast<std::size_t>(r)] = normal(rng);
      tables.weights[static_cast<std::size_t>(r)] = chance(rng, 0.1) ? 0 : uniform(rng, 0.1, 3);
    }
  }
};

/// Adds the factor twice: sums must be added to what is there, and nothing may linger.
void check_sums(const OneFactor& one, Assembly& assembly, Local& local) {
  FrontUnderTest<double> f{one.e, one.s};
  f.front().clear(0, one.front_size());
  VectorXd reference = VectorXd::Zero(one.front_size());
  local.begin(one.e);
  for (int i = 0; i < 2; ++i) assembly.add(one.tables, one.factor, f.front(), reference.data(), local);

  const MatrixXd H = 2 * one.normal_equations();
  const int l = one.local_dof, n = one.front_size();
  CHECK(close(f.lower(), lower_of(H.bottomRightCorner(n, n)), 1e-13));
  CHECK(close(reference.head(n - 1), H.diagonal().segment(l, n - 1), 1e-13));
  for (int a = 0; a < l; ++a) {
    const Eigen::Map<const VectorXd> coupling{local.coupling(a), n};
    CHECK(close(coupling, H.row(a).tail(n).transpose(), 1e-13));
    for (int b = a; b < l; ++b) CHECK(local.H(b, a) == doctest::Approx(H(b, a)).epsilon(1e-12));
  }
  if (l == 0) return;

  // All that is coupled has been said to be touched: the elimination uses the touched columns only.
  for (int a = 0; a < l; ++a) local.H(a, a) += 1;
  const VectorXd diagonal = H.diagonal().head(l);
  REQUIRE(local.eliminate(l, diagonal.data(), f.front()).ok());
  const MatrixXd inverse = (H.topLeftCorner(l, l) + MatrixXd::Identity(l, l)).inverse();
  CHECK(close(f.lower(), lower_of(H.bottomRightCorner(n, n) - H.bottomLeftCorner(n, l) * inverse * H.topRightCorner(l, n)), 1e-12));
}

}  // namespace

TEST_CASE("factor assembly: J' W J, J' W e and e' W e, for few rows and for many, dense and sparse, with and without a local variable") {
  Assembly assembly;
  Local local;
  for_all_seeds(400, [&](Rng& rng) {
    SUBCASE("a landmark seen from a pose") { check_sums(OneFactor{rng, integer(rng, 1, 4), {6}, integer(rng, 1, 3), 0}, assembly, local); }
    SUBCASE("small, several variables") {
      check_sums(OneFactor{rng, integer(rng, 1, 4), {6, 3, 1, 6}, integer(rng, 0, 3), 0.2}, assembly, local);
    }
    SUBCASE("many rows") { check_sums(OneFactor{rng, integer(rng, 5, kMaxRows), {15, 3}, integer(rng, 0, 1), 0.1}, assembly, local); }
    SUBCASE("many rows, ambiguities that one row or two see") {
      check_sums(OneFactor{rng, integer(rng, 5, kMaxRows), {15, 1, 1, 1, 1, 1}, integer(rng, 0, 1), 0.85}, assembly, local);
    }
    SUBCASE("few rows, too many columns for the small way") { check_sums(OneFactor{rng, 3, {15, 15, 6}, 0, 0.5}, assembly, local); }
  });
}

TEST_CASE("elimination sizes: the largest of a Problem's variables and factors") {
  constexpr smoother::EliminationSizes sizes = smoother::elimination_sizes<LinearProblem>();
  static_assert(sizes.max_front == LinearProblem::max_front_dimension);
  static_assert(sizes.members == LinearProblem::member_capacity);
  static_assert(sizes.arena == LinearProblem::arena_scalars);
  static_assert(sizes.local_dof == TestLocal::dof);
  static_assert(sizes.rows == 2 && sizes.columns == 9 + 1 && sizes.block == 2 * (9 + 1), "the residual is a column");
  CHECK(smoother::EliminationFailure<double>{}.ok());
  CHECK_FALSE(smoother::EliminationFailure<double>{.kind = smoother::EliminationFailure<double>::Kind::arena_full}.ok());
}
