// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Elimination of one local variable (landmark, pivot error) by Schur complement: all its factors lie in one front, so
///
///     | H_ll    .   |      H_ll = L_l L_l'       B = L_l^-1 [H_lc  g_l]       | H_cc  g_c | -= B' B
///     | H_cl   H_cc |
///
/// over the front's columns c that its factors touch, and its gradient. B is kept as dof arrays over the front's columns: the products then run
/// over neighbours. Afterwards, with the chain variables' step d_c at hand,
///
///     H_ll d_l = -(g_l + H_lc d_c) = -sum J_l' W (e + J_c d_c)
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include <searvins/math/block_cholesky.hpp>
#include <searvins/smoother/front_matrix.hpp>
#include <searvins/smoother/symmetric_products.hpp>

namespace searvins::smoother {

/// Lower triangle of a small symmetric matrix, column-major with leading dimension Dof, that turns into its factor.
template <class Scalar, int Dof>
struct LocalMatrix {
  std::array<Scalar, static_cast<std::size_t>(Dof) * Dof> numbers{};

  [[nodiscard]] Scalar& operator()(int row, int column) { return numbers[static_cast<std::size_t>(column * Dof + row)]; }
  [[nodiscard]] Scalar operator()(int row, int column) const { return numbers[static_cast<std::size_t>(column * Dof + row)]; }
  [[nodiscard]] math::PivotReport<Scalar> factorise(int dof, const Scalar* reference) {
    return math::partial_cholesky(numbers.data(), Dof, dof, dof, reference, math::ZeroPivot::skip);
  }
  /// x <- (L L')^-1 x, zero along axes without information.
  void solve(int dof, Scalar* x) const {
    math::solve_lower(numbers.data(), Dof, dof, x);
    math::solve_lower_transposed(numbers.data(), Dof, dof, x);
  }
};

/// See the file comment. Fronts have at most MaxFront axes, local variables at most Dof.
template <class Scalar, int Dof, int MaxFront>
class LocalElimination {
 public:
  using Matrix = LocalMatrix<Scalar, Dof>;

  /// Begins with a local variable, in a front whose columns of E end at `rows_e`.
  void begin(int rows_e) {
    H = Matrix{};
    rows_e_ = rows_e;
  }

  /// Says that columns [first, first + count) of the front are touched; then coupling(axis) + first may be added to.
  void touch(int first, int count) {
    int& known = touched_[at(first)];
    if (known == 0) first_[at(touches_++)] = first;
    known = std::max(known, count);
  }
  /// Row `axis` of [H_lc g_l], by the front's columns.
  [[nodiscard]] Scalar* coupling(int axis) { return coupling_.data() + static_cast<std::ptrdiff_t>(axis) * kColumns; }

  /// Factorises H and takes B' B off the front. `reference` is H's diagonal before damping. Whatever the outcome, it is ready for the next.
  [[nodiscard]] math::PivotReport<Scalar> eliminate(int dof, const Scalar* reference, const FrontMatrix<Scalar>& front) {
    collect_runs();
    const int columns = pack(dof);
    const auto report = H.factorise(dof, reference);
    if (!report.ok()) return report;
    solve_lower(dof, columns);
    front.subtract(tile_, runs_.data(), run_count_, packed_.data(), kColumns, dof);
    return report;
  }

  Matrix H{};

 private:
  static constexpr int kColumns = MaxFront + 1;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// The touched columns as ascending runs: merged where they meet, parted where E ends.
  void collect_runs() {
    std::sort(first_.begin(), first_.begin() + touches_);
    run_count_ = 0;
    int end = -1;
    for (int t = 0; t < touches_; ++t) {
      const int first = std::max(first_[at(t)], end), last = first_[at(t)] + touched_[at(first_[at(t)])];
      touched_[at(first_[at(t)])] = 0;
      if (last <= first) continue;
      if (first == end && first != rows_e_)
        runs_[at(run_count_ - 1)].count += last - first;
      else
        runs_[at(run_count_++)] = {first, last - first};
      end = last;
    }
    touches_ = 0;
  }

  /// Moves the touched columns of the coupling together, leaves zeros there; returns how many.
  int pack(int dof) {
    int columns = 0;
    for (int r = 0; r < run_count_; columns += runs_[at(r++)].count)
      for (int l = 0; l < dof; ++l) {
        Scalar* const from = coupling(l) + runs_[at(r)].first;
        std::copy_n(from, runs_[at(r)].count, packed(l) + columns);
        std::fill_n(from, runs_[at(r)].count, Scalar(0));
      }
    return columns;
  }

  /// B = L^-1 [H_lc g_l], zero along axes without information and past the last.
  void solve_lower(int dof, int columns) {
    for (int l = dof; l < Dof; ++l) std::fill_n(packed(l), columns, Scalar(0));
    for (int l = 0; l < dof; ++l) {
      Scalar* const b = packed(l);
      for (int m = 0; m < l; ++m) {
        const Scalar factor = H(l, m);
        const Scalar* const known = packed(m);
        for (int i = 0; i < columns; ++i) b[i] -= factor * known[i];
      }
      const Scalar inverse = H(l, l) > 0 ? 1 / H(l, l) : Scalar(0);
      for (int i = 0; i < columns; ++i) b[i] *= inverse;
    }
  }
  [[nodiscard]] Scalar* packed(int axis) { return packed_.data() + static_cast<std::ptrdiff_t>(axis) * kColumns; }

  std::array<Scalar, static_cast<std::size_t>(Dof) * kColumns> coupling_{}, packed_{};
  std::array<int, static_cast<std::size_t>(kColumns)> first_{}, touched_{};  ///< where touched columns begin; how many, by where they begin
  std::array<Run, static_cast<std::size_t>(kColumns)> runs_{};
  ColumnTile<Scalar, Dof> tile_{};
  int touches_{0}, run_count_{0}, rows_e_{0};
};

}  // namespace searvins::smoother
