// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The marginal prior: what the window remembers of everything that has left it.
///
/// A quadratic on the tangent space of the remaining variables at a fixed point x0 (Which::prior):
///
///     cost(x) = c + g' d + 1/2 d' H d,        d = x (-) x0
///     gradient at theta:  g + H (theta (-) x0)
///
/// It is the update matrix that the front of the leaving state left behind: the Schur complement of all factors that touched the state, plus the
/// prior that was absorbed in it. H is positive semidefinite; only its lower triangle is stored.
#pragma once

#include <array>
#include <cstddef>

#include <searvins/core/static_vector.hpp>
#include <searvins/smoother/variable.hpp>
#include <searvins/smoother/window.hpp>

namespace searvins::smoother {

/// See the file comment. At most MaxDimension tangent axes of MaxVariables variables.
template <class Scalar, int MaxDimension, int MaxVariables>
struct MarginalPrior {
  int dimension{0};
  StaticVector<int, static_cast<std::size_t>(MaxVariables)> variables{};  ///< global indices, in the order of their rows
  std::array<Scalar, static_cast<std::size_t>(MaxDimension) * MaxDimension> H{};  ///< lower triangle, column-major, leading dimension `dimension`
  std::array<Scalar, static_cast<std::size_t>(MaxDimension)> g{};
  std::array<Scalar, static_cast<std::size_t>(MaxDimension)> reference{};  ///< information before any elimination, per row: the scale of a zero pivot
  std::array<Scalar, static_cast<std::size_t>(MaxDimension)> d{}, Hd{};    ///< x (-) x0 and H d of the last evaluation
  Scalar c{0};

  [[nodiscard]] bool empty() const { return dimension == 0; }
  [[nodiscard]] Scalar& h(int row, int column) { return H[static_cast<std::size_t>(column) * static_cast<std::size_t>(dimension) + static_cast<std::size_t>(row)]; }
  [[nodiscard]] Scalar h(int row, int column) const {
    return H[static_cast<std::size_t>(column) * static_cast<std::size_t>(dimension) + static_cast<std::size_t>(row)];
  }

  /// Fills d and Hd for the variables' values `which` and returns the cost there.
  template <class WindowType>
  Scalar evaluate(WindowType& window, Which which) {
    if (empty()) return 0;
    for (int id : variables) window.local(id, Which::prior, which, window.info(id).prior_axes, d.data() + window.info(id).prior);
    return cost_at_d();
  }

  /// Moves the expansion point to theta: g and c there, x0 = theta. Exact on vector spaces, first order on curved ones.
  template <class WindowType>
  void move_to_theta(WindowType& window) {
    if (empty()) return;
    c = evaluate(window, Which::theta);
    for (int i = 0; i < dimension; ++i) g[at(i)] += Hd[at(i)];
    for (int id : variables) window.assign(id, Which::prior, Which::theta);
  }

  template <class WindowType>
  void clear(WindowType& window) {
    for (int id : variables) window.info(id).prior = -1;
    variables.clear();
    dimension = 0;
    c = 0;
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// Fills Hd.
  Scalar cost_at_d() {
    for (int i = 0; i < dimension; ++i) Hd[at(i)] = 0;
    for (int j = 0; j < dimension; ++j) {
      const Scalar dj = d[at(j)];
      Scalar sum = h(j, j) * dj;
      for (int i = j + 1; i < dimension; ++i) {
        Hd[at(i)] += h(i, j) * dj;
        sum += h(i, j) * d[at(i)];
      }
      Hd[at(j)] += sum;
    }
    Scalar cost = c;
    for (int i = 0; i < dimension; ++i) cost += d[at(i)] * (g[at(i)] + Hd[at(i)] / 2);
    return cost;
  }
};

}  // namespace searvins::smoother
