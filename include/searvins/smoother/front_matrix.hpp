// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The numbers of one front: its bordered matrix in the arena, assembled and partly factorised in place.
///
///     | H_EE  .     .  |        | L      .    .  |       L L' = H_EE
///     | H_SE  H_SS  .  |   ->   | L_SE   U    .  |       L_SE = H_SE L^-T            U  = H_SS - L_SE L_SE'
///     | g_E'  g_S'  c' |        | y_E'   u'   .  |       y_E  = L^-1 g_E             u  = g_S - L_SE y_E
///
/// The columns of E, the panel, stand first (rows 0..border); the rest, the update matrix, follows by itself (rows and columns of S and the
/// border). Both are column-major. Only the lower triangle counts; elements above the diagonal are scratch.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <searvins/math/block_cholesky.hpp>
#include <searvins/smoother/symmetric_products.hpp>

namespace searvins::smoother {

/// See the file comment. A view: the arena owns the numbers.
template <class Scalar>
class FrontMatrix {
 public:
  FrontMatrix() = default;
  /// `numbers`: (E+S+1) E + (S+1)^2 scalars.
  FrontMatrix(Scalar* numbers, int rows_e, int rows_s)
      : panel_(numbers), update_(numbers + static_cast<std::ptrdiff_t>(rows_e + rows_s + 1) * rows_e), e_(rows_e), border_(rows_e + rows_s) {}

  [[nodiscard]] int border() const { return border_; }  ///< index of the gradient row, and of the last column
  [[nodiscard]] int rows_e() const { return e_; }

  /// Element (0, j); rows from e on exist where j >= e.
  [[nodiscard]] Scalar* column(int j) const {
    return j < e_ ? panel_ + static_cast<std::ptrdiff_t>(j) * panel_ld() : update_ + static_cast<std::ptrdiff_t>(j - e_) * update_ld() - e_;
  }
  [[nodiscard]] std::ptrdiff_t leading_dimension(int j) const { return j < e_ ? panel_ld() : update_ld(); }
  [[nodiscard]] Scalar& operator()(int row, int j) const { return column(j)[row]; }
  /// The element of the lower triangle that stands for (a, b) and (b, a).
  [[nodiscard]] Scalar& symmetric(int a, int b) const { return a >= b ? column(b)[a] : column(a)[b]; }

  /// Zeroes the lower triangle of columns [first, end), and the scratch next to it.
  void clear(int first, int end) const {
    for (int j = first; j < end; ++j) std::fill(column(j) + top(j), column(j) + border_ + 1, Scalar(0));
  }

  /// += the lower triangle of a symmetric matrix U (column-major, leading dimension ld), whose rows lie in `count` runs; run r begins here at
  /// row to[r], and no run has rows on both sides of e.
  void add(const Scalar* U, int ld, const Run* runs, const int* to, int count) const {
    for (int r = 0; r < count; ++r)
      for (int q = 0; q < runs[r].count; ++q) {
        const Scalar* const from = U + static_cast<std::ptrdiff_t>(runs[r].first + q) * ld;
        const int j = to[r] + q;
        Scalar* const c = column(j);
        add_rows(c + j, from + runs[r].first + q, runs[r].count - q);
        for (int s = r + 1; s < count; ++s)
          if (to[s] > j)
            add_rows(c + to[s], from + runs[s].first, runs[s].count);
          else
            for (int i = 0; i < runs[s].count; ++i) column(to[s] + i)[j] += from[runs[s].first + i];
      }
  }

  /// The same on a matrix that need not have been cleared, for runs that ascend here as they do in U.
  void assign(const Scalar* U, int ld, const Run* runs, const int* to, int count) const {
    int next = 0;  // column that has not been written
    for (int r = 0; r < count; ++r) {
      clear(next, to[r]);
      for (int q = 0; q < runs[r].count; ++q) {
        const Scalar* const from = U + static_cast<std::ptrdiff_t>(runs[r].first + q) * ld;
        const int j = to[r] + q;
        Scalar* const c = column(j);
        std::fill(c + top(j), c + j, Scalar(0));
        std::ptrdiff_t row = std::copy(from + runs[r].first + q, from + runs[r].end(), c + j) - c;
        for (int s = r + 1; s < count; ++s) {
          std::fill(c + row, c + to[s], Scalar(0));
          row = std::copy(from + runs[s].first, from + runs[s].end(), c + to[s]) - c;
        }
        std::fill(c + row, c + border_ + 1, Scalar(0));
      }
      next = to[r] + runs[r].count;
    }
    clear(next, border_ + 1);
  }

  /// C -= sum_p a_p a_p' on rows and columns that lie in `count` ascending runs, none of which has columns on both sides of e. The rows of the
  /// runs stand packed, one after the other, in a_p = a + p lda.
  template <class Tile>
  void subtract(Tile& tile, const Run* runs, int count, const Scalar* a, std::ptrdiff_t lda, int rank) const {
    for (int r = 0, packed = 0; r < count; packed += runs[r++].count)
      for (int q = 0; q < runs[r].count;) {
        const int width = Tile::width_of(runs[r].count - q), j = runs[r].first + q;
        tile.pack(a, lda, rank, packed + q, width);
        tile.subtract(column(j) + j, leading_dimension(j), a + packed + q, runs[r].count - q);
        for (int s = r + 1, row = packed + runs[r].count; s < count; row += runs[s++].count)
          tile.subtract(column(j) + runs[s].first, leading_dimension(j), a + row, runs[s].count);
        q += width;
      }
  }

  /// Factorises the columns of E and leaves the update matrix. `reference[j]` is the scale of pivot j, as in math::partial_cholesky.
  template <class Tile>
  [[nodiscard]] math::PivotReport<Scalar> factorise(Tile& tile, const Scalar* reference, math::ZeroPivot policy) const {
    math::PivotReport<Scalar> report;
    for (int k = 0; k < e_; k += 4) {
      const int end = std::min(k + 4, e_);
      subtract_panel(tile, k, end, k);
      for (int j = k; j < end; ++j)
        if (!factorise_column(k, j, reference[j], policy, report)) return report;
    }
    subtract_panel(tile, e_, border_ + 1, e_);
    return report;
  }

 private:
  [[nodiscard]] std::ptrdiff_t panel_ld() const { return border_ + 1; }
  [[nodiscard]] std::ptrdiff_t update_ld() const { return border_ + 1 - e_; }

  /// Takes the products of the first `rank` columns off the columns [first, end).
  template <class Tile>
  void subtract_panel(Tile& tile, int first, int end, int rank) const {
    for (int j = first; j < end;) {
      const int width = Tile::width_of(end - j);
      tile.pack(panel_, panel_ld(), rank, j, width);
      tile.subtract(column(j) + j, leading_dimension(j), panel_ + j, border_ + 1 - j);
      j += width;
    }
  }

  /// Column j of the factor, given those before it; those before `done`, at most three columns back, have been subtracted.
  [[nodiscard]] bool factorise_column(int done, int j, Scalar reference, math::ZeroPivot policy, math::PivotReport<Scalar>& report) const {
    Scalar* const c = column(j);
    Scalar pivot = c[j];
    for (int p = done; p < j; ++p) pivot -= column(p)[j] * column(p)[j];
    const math::PivotVerdict verdict = math::judge_pivot(pivot, reference, j, policy, report);
    if (verdict != math::PivotVerdict::use) {
      if (verdict == math::PivotVerdict::skip) std::fill(c + j, c + border_ + 1, Scalar(0));
      return verdict == math::PivotVerdict::skip;
    }
    c[j] = std::sqrt(pivot);
    const Scalar inverse = 1 / c[j];
    switch (j - done) {
      case 0: finish_column<0>(j, inverse); break;
      case 1: finish_column<1>(j, inverse); break;
      case 2: finish_column<2>(j, inverse); break;
      default: finish_column<3>(j, inverse); break;
    }
    return true;
  }

  /// Rows below the diagonal of column j:  (C - the products of the `Before` columns before it) / L_jj.
  template <int Before>
  void finish_column(int j, Scalar inverse) const {
    Scalar* const c = column(j);
    const Scalar* const q = column(j - Before);
    std::array<Scalar, 3> b{};
    for (int p = 0; p < Before; ++p) b[static_cast<std::size_t>(p)] = q[p * panel_ld() + j];
    for (int i = j + 1; i <= border_; ++i) {
      Scalar sum = c[i];
      for (int p = 0; p < Before; ++p) sum -= b[static_cast<std::size_t>(p)] * q[p * panel_ld() + i];
      c[i] = sum * inverse;
    }
  }

  /// First row of column j that is written: that of the scratch next to the diagonal.
  [[nodiscard]] int top(int j) const { return std::max(j - 3, j < e_ ? 0 : e_); }
  static void add_rows(Scalar* to, const Scalar* from, int count) {
    for (int i = 0; i < count; ++i) to[i] += from[i];
  }

  Scalar *panel_{nullptr}, *update_{nullptr};
  int e_{0}, border_{0};
};

}  // namespace searvins::smoother
