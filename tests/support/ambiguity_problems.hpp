// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Integer least-squares problems for tests and benchmarks: a generator of double-difference problems, and the reader of the
/// problems with known answers in the shared data (folder peers/lambda).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace searvins::test {

/// A dense matrix of plain loops: it compiles in no time and shares no code with what it checks.
struct Matrix {
  Matrix() = default;
  Matrix(int row_count, int column_count, double value = 0)
      : rows(row_count),
        columns(column_count),
        values(static_cast<std::size_t>(row_count) * static_cast<std::size_t>(column_count), value) {}

  [[nodiscard]] double& operator()(int i, int k) {
    return values[static_cast<std::size_t>(i) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(k)];
  }
  [[nodiscard]] double operator()(int i, int k) const {
    return values[static_cast<std::size_t>(i) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(k)];
  }
  [[nodiscard]] const double* data() const { return values.data(); }

  int rows{0}, columns{0};
  std::vector<double> values;  // row by row
};

inline Matrix transposed(const Matrix& a) {
  Matrix t(a.columns, a.rows);
  for (int i = 0; i < a.rows; ++i)
    for (int k = 0; k < a.columns; ++k) t(k, i) = a(i, k);
  return t;
}

inline Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c(a.rows, b.columns);
  for (int i = 0; i < a.rows; ++i)
    for (int m = 0; m < a.columns; ++m)
      for (int k = 0; k < b.columns; ++k) c(i, k) += a(i, m) * b(m, k);
  return c;
}

/// a + factor * b
inline Matrix sum(Matrix a, double factor, const Matrix& b) {
  for (std::size_t i = 0; i < a.values.size(); ++i) a.values[i] += factor * b.values[i];
  return a;
}

/// (a + a') / 2
inline Matrix symmetric(const Matrix& a) {
  Matrix s = sum(a, 1, transposed(a));
  for (double& v : s.values) v /= 2;
  return s;
}

/// Gauss-Jordan with row pivoting.
inline Matrix inverse(Matrix a) {
  const int n = a.rows;
  Matrix x(n, n);
  for (int i = 0; i < n; ++i) x(i, i) = 1;
  for (int p = 0; p < n; ++p) {
    int pivot = p;
    for (int i = p + 1; i < n; ++i)
      if (std::abs(a(i, p)) > std::abs(a(pivot, p))) pivot = i;
    for (int k = 0; k < n; ++k) {
      std::swap(a(p, k), a(pivot, k));
      std::swap(x(p, k), x(pivot, k));
    }
    const double scale = 1 / a(p, p);
    for (int k = 0; k < n; ++k) {
      a(p, k) *= scale;
      x(p, k) *= scale;
    }
    for (int i = 0; i < n; ++i) {
      const double f = a(i, p);
      if (i == p || f == 0) continue;
      for (int k = 0; k < n; ++k) {
        a(i, k) -= f * a(p, k);
        x(i, k) -= f * x(p, k);
      }
    }
  }
  return x;
}

/// Lower G with G G' = a.
inline Matrix cholesky(const Matrix& a) {
  Matrix g(a.rows, a.rows);
  for (int i = 0; i < a.rows; ++i)
    for (int k = 0; k <= i; ++k) {
      double v = a(i, k);
      for (int m = 0; m < k; ++m) v -= g(i, m) * g(k, m);
      g(i, k) = i == k ? std::sqrt(v) : v / g(k, k);
    }
  return g;
}

/// A float solution, its covariance and, where known, the best two integer vectors.
struct AmbiguityProblem {
  std::vector<double> a_hat;  ///< cycles
  Matrix Q;                   ///< cycles^2
  std::vector<std::int64_t> best, second;
  double best_norm{0}, second_norm{0};
};

/// Double differences of code (0.3 m) and phase (3 mm) on GPS L1 (n odd) or L1 and L2 (n even) over `epochs` equal epochs, position
/// free at each: n ambiguities, sigma growing toward the horizon, the highest satellite as reference.
inline AmbiguityProblem double_difference_problem(std::mt19937_64& rng, int n, int epochs = 1) {
  const int frequencies = n % 2 == 0 ? 2 : 1, pairs = n / frequencies;
  const double degree = std::numbers::pi / 180;
  std::uniform_real_distribution<double> sine_of_elevation{std::sin(10 * degree), std::sin(88 * degree)}, azimuth{0, 360 * degree};
  std::vector<double> sines(static_cast<std::size_t>(pairs) + 1);
  for (double& s : sines) s = sine_of_elevation(rng);
  std::iter_swap(sines.begin(), std::max_element(sines.begin(), sines.end()));

  Matrix lines(pairs + 1, 3), R(pairs, pairs), A(pairs, 3);  // R: covariance of the double differences over sigma^2
  for (int i = 0; i <= pairs; ++i) {
    const double s = sines[static_cast<std::size_t>(i)], c = std::sqrt(1 - s * s), az = azimuth(rng);
    lines(i, 0) = c * std::sin(az);
    lines(i, 1) = c * std::cos(az);
    lines(i, 2) = s;
  }
  const auto variance = [&sines](int i) { return 1 + 1 / (sines[static_cast<std::size_t>(i)] * sines[static_cast<std::size_t>(i)]); };
  for (int i = 0; i < pairs; ++i) {
    for (int k = 0; k < pairs; ++k) R(i, k) = variance(0) + (i == k ? variance(i + 1) : 0);
    for (int k = 0; k < 3; ++k) A(i, k) = lines(0, k) - lines(i + 1, k);
  }
  const Matrix W = inverse(R), WA = product(W, A), AWA = product(transposed(A), WA);

  // Normal equations of position (summed over code and phase) and ambiguities; then the position is eliminated.
  const double phase_information = 1 / (0.003 * 0.003), code_information = 1 / (0.3 * 0.3);
  const double wavelengths_m[2] = {0.190293672798, 0.244210213425};
  Matrix information(n, n), cross(n, 3), position(3, 3);
  for (int f = 0; f < frequencies; ++f)
    for (int i = 0; i < pairs; ++i) {
      for (int k = 0; k < pairs; ++k)
        information(f * pairs + i, f * pairs + k) = wavelengths_m[f] * wavelengths_m[f] * phase_information * W(i, k);
      for (int k = 0; k < 3; ++k) cross(f * pairs + i, k) = wavelengths_m[f] * phase_information * WA(i, k);
    }
  position = sum(position, frequencies * (phase_information + code_information), AWA);
  information = sum(information, -1, product(cross, product(inverse(position), transposed(cross))));

  AmbiguityProblem problem;
  problem.Q = symmetric(inverse(symmetric(information)));
  for (double& q : problem.Q.values) q /= epochs;
  const Matrix G = cholesky(problem.Q);
  std::normal_distribution<double> noise;
  std::uniform_int_distribution<int> whole{-1000, 1000};
  problem.a_hat.resize(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) {
    const double w = noise(rng);
    for (int i = k; i < n; ++i) problem.a_hat[static_cast<std::size_t>(i)] += G(i, k) * w;
  }
  for (double& a : problem.a_hat) a += whole(rng);
  return problem;
}

/// The problems of one set ("n6" ... "n60", "hard") with their answers; nothing when a file is missing or malformed.
inline std::optional<std::vector<AmbiguityProblem>> read_ambiguity_problems(const std::filesystem::path& folder, const std::string& set) {
  std::ifstream problems{folder / ("problems_" + set + ".txt")}, answers{folder / ("answers_" + set + ".txt")};
  std::string comment, tag;
  std::getline(problems, comment);
  std::getline(answers, comment);
  int count = 0, answer_count = 0;
  if (!(problems >> count) || !(answers >> answer_count) || count != answer_count || count < 1) return std::nullopt;
  std::vector<AmbiguityProblem> all(static_cast<std::size_t>(count));
  for (AmbiguityProblem& p : all) {
    int number = 0, n = 0, whole = 0;
    double unused = 0;
    problems >> tag >> number >> n >> whole >> whole >> whole >> unused >> unused;
    if (!problems || tag != "P" || n < 1) return std::nullopt;
    problems >> tag;
    for (int i = 0; i < n; ++i) problems >> unused;
    problems >> tag;
    p.a_hat.resize(static_cast<std::size_t>(n));
    for (double& a : p.a_hat) problems >> a;
    problems >> tag;
    p.Q = Matrix(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) {
        problems >> p.Q(i, j);
        p.Q(j, i) = p.Q(i, j);
      }
    p.best.resize(static_cast<std::size_t>(n));
    p.second.resize(static_cast<std::size_t>(n));
    answers >> tag >> number >> n >> whole >> p.best_norm >> p.second_norm >> whole >> tag;
    for (std::int64_t& z : p.best) answers >> z;
    answers >> tag;
    for (std::int64_t& z : p.second) answers >> z;
    if (!problems || !answers) return std::nullopt;
  }
  return all;
}

}  // namespace searvins::test
