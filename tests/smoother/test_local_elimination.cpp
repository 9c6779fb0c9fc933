// SPDX-License-Identifier: BSD-3-Clause
// Local variables: their Schur complement, by the touched columns alone, against the dense one; back-substitution; reuse after success and failure.
#include <searvins/smoother/local_elimination.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <limits>

#include "front_under_test.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

constexpr int kFrontRows = 40, kDof = 3;
using LocalOfThree = smoother::LocalElimination<double, kDof, kFrontRows>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Measurements of one local variable from a few blocks of the front's columns: their normal equations, dense and as the elimination takes them.
struct Measured {
  int dof, n;
  MatrixXd H;  ///< of [local, front, residual]

  /// `rows` of them each from one block; those of `rank` < dof see the first axes of the local variable only.
  Measured(Rng& rng, int dof_, int e, int s, int rank, LocalOfThree& local)
      : dof(dof_), n(e + s + 1), H(MatrixXd::Zero(dof_ + n, dof_ + n)) {
    local.begin(e);
    for (int m = 0; m < 6; ++m) {
      const int side = e == 0 ? 1 : s == 0 ? 0 : integer(rng, 0, 1);
      const int low = side == 0 ? 0 : e, high = side == 0 ? e : e + s;
      const int first = integer(rng, low, high - 1), count = integer(rng, 1, std::min(6, high - first));
      MatrixXd J = MatrixXd::Zero(2, dof + n);
      J.leftCols(rank).setRandom();
      J.middleCols(dof + first, count).setRandom();
      J.rightCols(1).setRandom();
      add(J, first, count, local);
    }
  }

  /// The matrix of the front, before.
  [[nodiscard]] MatrixXd of_front() const { return H.bottomRightCorner(n, n); }
  /// After: a generalised inverse will do, for the coupling lies in the range of H_ll.
  [[nodiscard]] MatrixXd schur() const {
    const MatrixXd inverse = H.topLeftCorner(dof, dof).completeOrthogonalDecomposition().pseudoInverse();
    return of_front() - H.bottomLeftCorner(n, dof) * inverse * H.topRightCorner(dof, n);
  }

 private:
  void add(const MatrixXd& J, int first, int count, LocalOfThree& local) {
    H += J.transpose() * J;
    local.touch(first, count);
    local.touch(n - 1, 1);
    for (int l = 0; l < dof; ++l) {
      for (int c = first; c < first + count; ++c) local.coupling(l)[c] += J.col(l).dot(J.col(dof + c));
      local.coupling(l)[n - 1] += J.col(l).dot(J.col(dof + n - 1));
      for (int m = l; m < dof; ++m) local.H(m, l) += J.col(l).dot(J.col(m));
    }
  }
};

VectorXd diagonal_of(const Measured& m) { return m.H.diagonal().head(m.dof); }

}  // namespace

TEST_CASE("local elimination: the front becomes the Schur complement, time after time with one object") {
  for_all_seeds(100, [](Rng& rng) {
    LocalOfThree local;
    for (int again = 0; again < 4; ++again) {
      const int e = integer(rng, 0, 20), s = integer(rng, e == 0 ? 1 : 0, 19), dof = integer(rng, 1, kDof), rank = integer(rng, 1, dof);
      const Measured m{rng, dof, e, s, rank, local};
      FrontUnderTest<double> f{e, s};
      f.set(m.of_front());
      const auto report = local.eliminate(dof, diagonal_of(m).data(), f.front());
      CHECK(report.ok());
      CHECK(report.skipped == dof - rank);
      CHECK(close(f.lower(), lower_of(m.schur()), 1e-9));
    }
  });
}

TEST_CASE("local elimination: columns that no measurement touched keep their bits") {
  for_all_seeds(100, [](Rng& rng) {
    LocalOfThree local;
    const Measured m{rng, 3, 20, 19, 3, local};
    FrontUnderTest<double> f{20, 19};
    const MatrixXd before = random_spd(rng, 40);
    f.set(before);
    REQUIRE(local.eliminate(3, diagonal_of(m).data(), f.front()).ok());
    for (int c = 0; c < 40; ++c)
      if (m.H.col(3 + c).head(3).isZero(0)) CHECK(f.lower().col(c) == lower_of(before).col(c));
  });
}

TEST_CASE("local elimination: a number that is none is reported, the front is as before and the next variable unharmed") {
  for_all_seeds(50, [](Rng& rng) {
    LocalOfThree local;
    const Measured bad{rng, 3, 10, 10, 3, local};
    local.H(1, 1) = std::numeric_limits<double>::quiet_NaN();
    FrontUnderTest<double> f{10, 10};
    const MatrixXd before = random_spd(rng, 21);
    f.set(before);
    const auto report = local.eliminate(3, diagonal_of(bad).data(), f.front());
    CHECK(report.failed == 1);
    CHECK(report.non_finite);
    CHECK(f.lower() == lower_of(before));

    const Measured good{rng, 3, 10, 10, 3, local};
    f.set(good.of_front());
    REQUIRE(local.eliminate(3, diagonal_of(good).data(), f.front()).ok());
    CHECK(close(f.lower(), lower_of(good.schur()), 1e-9));
  });
}

TEST_CASE("local matrix: solving gives the least-squares answer, zero along axes without information") {
  for_all_seeds(100, [](Rng& rng) {
    const int dof = integer(rng, 1, kDof);
    const MatrixXd H = random_spd(rng, dof, 1e2);
    VectorXd x = random_vector<3>(rng).head(dof);
    const VectorXd b = x, reference = H.diagonal();
    smoother::LocalMatrix<double, kDof> matrix;
    for (int c = 0; c < dof; ++c)
      for (int r = c; r < dof; ++r) matrix(r, c) = H(r, c);
    REQUIRE(matrix.factorise(dof, reference.data()).ok());
    matrix.solve(dof, x.data());
    CHECK(close(H * x, b, 1e-12));
  });
  smoother::LocalMatrix<double, kDof> flat;
  flat(0, 0) = 4, flat(1, 0) = 2, flat(1, 1) = 1;  // one direction known: (2, 1)
  const Eigen::Vector3d reference{4, 1, 0};
  REQUIRE(flat.factorise(3, reference.data()).skipped == 2);
  Eigen::Vector3d x{2, 1, 0};
  flat.solve(3, x.data());
  CHECK(close(x, Eigen::Vector3d{0.5, 0, 0}, 1e-15));
}
