// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A front's matrix that owns its numbers, beside the dense symmetric matrix that it stands for.
#pragma once

#include <Eigen/Dense>

#include <vector>

#include <searvins/smoother/front_matrix.hpp>

#include "support/property.hpp"

namespace searvins::test {

/// E, S and the border: e + s + 1 rows. Numbers that nobody wrote are `kNobody`.
template <class Scalar>
class FrontUnderTest {
 public:
  using Dense = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  static constexpr Scalar kNobody = 77;

  FrontUnderTest(int rows_e, int rows_s)
      : numbers_(static_cast<std::size_t>((rows_e + rows_s + 1) * rows_e + (rows_s + 1) * (rows_s + 1)), kNobody),
        front_(numbers_.data(), rows_e, rows_s) {}
  FrontUnderTest(const FrontUnderTest&) = delete;
  FrontUnderTest& operator=(const FrontUnderTest&) = delete;

  [[nodiscard]] const smoother::FrontMatrix<Scalar>& front() const { return front_; }
  [[nodiscard]] int size() const { return front_.border() + 1; }
  void set(const Dense& symmetric) {
    for (int j = 0; j < size(); ++j)
      for (int i = j; i < size(); ++i) front_(i, j) = symmetric(i, j);
  }
  /// The lower triangle, zeros above.
  [[nodiscard]] Dense lower() const {
    Dense out = Dense::Zero(size(), size());
    for (int j = 0; j < size(); ++j)
      for (int i = j; i < size(); ++i) out(i, j) = front_(i, j);
    return out;
  }

 private:
  std::vector<Scalar> numbers_;
  smoother::FrontMatrix<Scalar> front_;
};

template <class Derived>
[[nodiscard]] auto lower_of(const Eigen::MatrixBase<Derived>& symmetric) {
  using Dense = Eigen::Matrix<typename Derived::Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  return Dense(symmetric.template triangularView<Eigen::Lower>());
}

/// Some of the rows [0, n) as ascending runs, none with rows on both sides of e.
inline std::vector<smoother::Run> random_runs(Rng& rng, int n, int e) {
  std::vector<smoother::Run> runs;
  for (int row = 0; row < n; ++row) {
    if (chance(rng, 0.3)) continue;
    if (runs.empty() || runs.back().end() != row || row == e || chance(rng, 0.2))
      runs.push_back({row, 1});
    else
      ++runs.back().count;
  }
  return runs;
}

/// All rows of the runs, one after the other.
inline std::vector<int> rows_of(const std::vector<smoother::Run>& runs) {
  std::vector<int> rows;
  for (const smoother::Run& run : runs)
    for (int i = run.first; i < run.end(); ++i) rows.push_back(i);
  return rows;
}

}  // namespace searvins::test
