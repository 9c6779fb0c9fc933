// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A positive definite matrix of a few rows and what is solved with it: A = L L' by partial_cholesky, in place, for the normal equations of
/// a handful of unknowns.
#pragma once

#include <Eigen/Core>

#include <searvins/math/block_cholesky.hpp>

namespace searvins::math {

/// Factor of an N x N matrix. A pivot that is zero against its own diagonal element, or not finite, means ok() == false; there is
/// nothing to solve with then.
template <int N, class Scalar = double>
class SmallCholesky {
  static_assert(N > 0 && N <= 16, "for a handful of unknowns; larger systems belong to the elimination of the smoother");

 public:
  using Matrix = Eigen::Matrix<Scalar, N, N>;
  using Vector = Eigen::Matrix<Scalar, N, 1>;

  /// Factors A, of which the lower triangle is read.
  explicit SmallCholesky(const Matrix& A) : L_(A) {
    const Vector reference = A.diagonal();
    ok_ = partial_cholesky(L_.data(), N, N, N, reference.data()).ok();
  }

  [[nodiscard]] bool ok() const { return ok_; }

  /// A^-1 b.
  [[nodiscard]] Vector solve(Vector b) const {
    solve_lower(L_.data(), N, N, b.data());
    solve_lower_transposed(L_.data(), N, N, b.data());
    return b;
  }

  /// A^-1, exactly symmetric.
  [[nodiscard]] Matrix inverse() const {
    Matrix X;
    for (int j = 0; j < N; ++j) X.col(j) = solve(Vector::Unit(j));
    for (int j = 0; j < N; ++j)
      for (int i = 0; i < j; ++i) X(i, j) = X(j, i) = Scalar(0.5) * (X(i, j) + X(j, i));
    return X;
  }

 private:
  Matrix L_;
  bool ok_{false};
};

}  // namespace searvins::math
