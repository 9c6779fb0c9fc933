// SPDX-License-Identifier: BSD-3-Clause
// The dense kernel: tiles of outer products against the sums written out, in every width, height and rank.
#include <searvins/smoother/symmetric_products.hpp>

#include <Eigen/Dense>

#include <limits>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

template <class Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

/// n x columns numbers; a share of them zero, as the coefficients of measurements are that see few variables.
template <class Scalar>
Matrix<Scalar> sparse_columns(Rng& rng, int n, int columns, double zero_share) {
  return Matrix<Scalar>::NullaryExpr(n, columns, [&] { return chance(rng, zero_share) ? Scalar(0) : static_cast<Scalar>(normal(rng)); });
}

/// C - A A' tile by tile; beyond the lower triangle only the tile's own square may be written.
template <class Scalar, int MaxRank>
void check_tiles(Rng& rng, double tolerance) {
  using Tile = smoother::ColumnTile<Scalar, MaxRank>;
  constexpr Scalar untouched = 77;
  const int n = integer(rng, 1, 30), ldc = n + integer(rng, 0, 3), lda = n + integer(rng, 0, 3), rank = integer(rng, 0, MaxRank);
  Matrix<Scalar> a = Matrix<Scalar>::Zero(lda, MaxRank);
  a.topLeftCorner(n, rank) = sparse_columns<Scalar>(rng, n, rank, 0.4);
  Matrix<Scalar> c = Matrix<Scalar>::Constant(ldc, n, untouched);
  c.topRows(n).template triangularView<Eigen::Lower>() = sparse_columns<Scalar>(rng, n, n, 0.1);
  const Matrix<Scalar> before = c;

  static Tile tile;  // one for all: what a tile leaves behind must not matter to the next
  for (int j = 0, width = 0; j < n; j += width) {
    width = Tile::width_of(n - j);
    CHECK(width <= n - j);
    tile.pack(a.data(), lda, rank, j, width);
    tile.subtract(&c(j, j), ldc, a.data() + j, n - j);
    CHECK(c.col(j).head(j) == before.col(j).head(j));
    CHECK(c.bottomRows(ldc - n) == before.bottomRows(ldc - n));
  }
  const Matrix<Scalar> expected = before.topRows(n) - a.topRows(n) * a.topRows(n).transpose();
  CHECK(close(Matrix<Scalar>(c.topRows(n).template triangularView<Eigen::Lower>()),
              Matrix<Scalar>(expected.template triangularView<Eigen::Lower>()), tolerance));
}

}  // namespace

TEST_CASE("symmetric products: a tile takes the sum of outer products off, whatever its width and rank") {
  for_all_seeds(200, [](Rng& rng) {
    SUBCASE("straight code, double") { check_tiles<double, 3>(rng, 1e-14); }
    SUBCASE("straight code, float") { check_tiles<float, 4>(rng, 1e-6); }
    SUBCASE("loop, double") { check_tiles<double, 24>(rng, 1e-14); }
    SUBCASE("loop, float") { check_tiles<float, 24>(rng, 2e-6); }
  });
}

TEST_CASE("symmetric products: products that are zero in all columns of a tile are left out, even where the rows are not finite") {
  smoother::ColumnTile<double, 8> tile;
  Eigen::Matrix<double, 8, 2> a = Eigen::Matrix<double, 8, 2>::Ones();
  a.col(0).head<4>().setZero();
  a.col(0).tail<4>().setConstant(std::numeric_limits<double>::infinity());
  Eigen::Matrix<double, 8, 4> c = Eigen::Matrix<double, 8, 4>::Zero();
  tile.pack(a.data(), 8, 2, 0, 4);
  tile.subtract(c.data(), 8, a.data(), 8);
  CHECK((c.array() == -1).all());
}

TEST_CASE("symmetric products: rows apart from the tile, as the runs of a local variable's columns are") {
  for_all_seeds(100, [](Rng& rng) {
    smoother::ColumnTile<double, 3> tile;
    const Matrix<double> a = sparse_columns<double>(rng, 20, 3, 0.2);
    const int width = 1 << integer(rng, 0, 2), row = integer(rng, 0, 4), first = integer(rng, 8, 12), count = integer(rng, 0, 8);
    Matrix<double> c = sparse_columns<double>(rng, 20, 4, 0);
    const Matrix<double> before = c;
    tile.pack(a.data(), 20, 3, row, width);
    tile.subtract(&c(first, 0), 20, a.data() + first, count);
    Matrix<double> expected = before;
    expected.block(first, 0, count, width) -= a.middleRows(first, count) * a.middleRows(row, width).transpose();
    CHECK(close(c, expected, 1e-14));
    expected.block(first, 0, count, width) = c.block(first, 0, count, width);
    CHECK(c == expected);
  });
}
