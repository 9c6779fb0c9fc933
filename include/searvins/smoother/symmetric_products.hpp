// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The dense kernel of the elimination: a sum of outer products taken off a few neighbouring columns of a symmetric matrix,
///
///     C(i, q)  <-  C(i, q) - sum_p a_p(i) a_p(q)          q in a tile of 4, 2 or 1 columns, i over rows from the tile on
///
/// The tile's coefficients a_p(q) are packed first, without the p that are zero in all its columns (fronts are sparse where measurements are
/// local); then blocks of 4 x 4 elements of C stay in registers while p runs. Rows and columns are column-major arrays of the caller; elements
/// of the tile above the diagonal are written too and mean nothing.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>

namespace searvins::smoother {

/// Rows or columns [first, first + count) of a matrix.
struct Run {
  int first{0}, count{0};
  [[nodiscard]] int end() const { return first + count; }
};

/// See the file comment. At most MaxRank products; up to 4, all of them always, in straight code.
template <class Scalar, int MaxRank>
class ColumnTile {
 public:
  static constexpr bool kStraight = MaxRank <= 4;

  /// Columns of the next tile when `left` remain: 4, 2 or 1.
  [[nodiscard]] static constexpr int width_of(int left) { return left >= 4 ? 4 : left >= 2 ? 2 : 1; }

  /// Takes a_p(q), q in [row, row + width), of `rank` columns a_p = a + p lda. In straight code a has MaxRank columns, those past `rank` zero.
  void pack(const Scalar* a, std::ptrdiff_t lda, int rank, int row, int width) {
    width_ = width;
    lda_ = lda;
    if (width == 4)
      pack_columns<4>(a + row, rank);
    else if (width == 2)
      pack_columns<2>(a + row, rank);
    else
      pack_columns<1>(a + row, rank);
  }

  /// C(i, q) -= sum_p a_p(i) a_p(q) for `count` rows: `c` is C's first element, with leading dimension ldc, `a` that row of a_0.
  void subtract(Scalar* c, std::ptrdiff_t ldc, const Scalar* a, int count) const {
    if (!kStraight && rank_ == 0) return;
    if (width_ == 4)
      subtract_columns<4>(c, ldc, a, count);
    else if (width_ == 2)
      subtract_columns<2>(c, ldc, a, count);
    else
      subtract_columns<1>(c, ldc, a, count);
  }

 private:
  template <int Columns>
  void pack_columns(const Scalar* a, int rank) {
    rank_ = 0;
    if constexpr (kStraight) {
      for (int p = 0; p < MaxRank; ++p) (void)pack_product<Columns>(p, a + p * lda_);
    } else {
      for (int p = 0; p < rank; ++p) {
        offset_[static_cast<std::size_t>(rank_)] = p * lda_;
        rank_ += pack_product<Columns>(rank_, a + p * lda_) ? 1 : 0;
      }
    }
  }
  /// Stores the coefficients of product p; says whether any is not zero.
  template <int Columns>
  bool pack_product(int p, const Scalar* from) {
    Scalar* const to = coefficients_.data() + static_cast<std::ptrdiff_t>(p) * Columns * kRows;
    bool used = false;
    for (int q = 0; q < Columns; ++q) {
      Eigen::Map<Eigen::Matrix<Scalar, kRows, 1>, Eigen::Aligned16>{to + q * kRows}.setConstant(from[q]);
      used = used || from[q] != 0;
    }
    return used;
  }

  template <int Columns>
  void subtract_columns(Scalar* c, std::ptrdiff_t ldc, const Scalar* a, int count) const {
    int i = 0;
    for (; i + 4 <= count; i += 4) subtract_block<4, Columns>(c + i, ldc, a + i);
    if (i + 2 <= count) subtract_block<2, Columns>(c + i, ldc, a + i), i += 2;
    if (i < count) subtract_block<1, Columns>(c + i, ldc, a + i);
  }

  /// One block of C, in registers while p runs.
  template <int Rows, int Columns>
  EIGEN_ALWAYS_INLINE void subtract_block(Scalar* c, std::ptrdiff_t ldc, const Scalar* a) const {
    using Column = Eigen::Matrix<Scalar, Rows, 1>;
    using In = Eigen::Map<const Column>;
    using Out = Eigen::Map<Column>;
    static_assert(Columns == 4 || Columns == 2 || Columns == 1);
    using Coefficient = Eigen::Map<const Column, Eigen::Aligned16>;
    Column c0 = In(c), c1, c2, c3;
    if constexpr (Columns > 1) c1 = In(c + ldc);
    if constexpr (Columns > 2) c2 = In(c + 2 * ldc), c3 = In(c + 3 * ldc);
    const auto subtract_product = [&](const Scalar* from, const Scalar* b) {
      const Column x = In(from);
      c0 -= x.cwiseProduct(Coefficient(b));
      if constexpr (Columns > 1) c1 -= x.cwiseProduct(Coefficient(b + kRows));
      if constexpr (Columns > 2) c2 -= x.cwiseProduct(Coefficient(b + 2 * kRows)), c3 -= x.cwiseProduct(Coefficient(b + 3 * kRows));
    };
    const Scalar* const b = coefficients_.data();
    if constexpr (kStraight)
      for (int p = 0; p < MaxRank; ++p) subtract_product(a + p * lda_, b + p * Columns * kRows);
    else
      for (int p = 0; p < rank_; ++p) subtract_product(a + offset_[static_cast<std::size_t>(p)], b + static_cast<std::ptrdiff_t>(p) * Columns * kRows);
    Out{c} = c0;
    if constexpr (Columns > 1) Out{c + ldc} = c1;
    if constexpr (Columns > 2) Out{c + 2 * ldc} = c2, Out{c + 3 * ldc} = c3;
  }

  static constexpr int kRows = 4;  ///< of a block; every coefficient is stored that often, as a vector to multiply with
  alignas(16) std::array<Scalar, static_cast<std::size_t>(MaxRank) * 4 * kRows> coefficients_{};
  std::array<std::ptrdiff_t, static_cast<std::size_t>(MaxRank)> offset_{};
  std::ptrdiff_t lda_{0};
  int width_{1}, rank_{0};
};

}  // namespace searvins::smoother
