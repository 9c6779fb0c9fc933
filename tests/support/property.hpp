// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The property harness: a body run over many seeded generators, the failing seed printed. SEARVINS_PROPERTY_RUNS scales every
/// property; SEARVINS_PROPERTY_SEED runs just one seed, to repeat a failure.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <cstdlib>
#include <random>

namespace searvins::test {

using Rng = std::mt19937_64;

/// Number of runs of a property whose default is `runs`: SEARVINS_PROPERTY_RUNS is a percentage of 100 runs (500: five times as many).
inline unsigned property_runs(unsigned runs) {
  const char* text = std::getenv("SEARVINS_PROPERTY_RUNS");
  if (!text) return runs;
  const double scale = std::atof(text) / 100.0;
  const double scaled = scale * runs;
  return scaled < 1 ? 1U : static_cast<unsigned>(scaled);
}

/// Calls body(rng) for `runs` seeds; a failing assertion prints the seed that repeats it.
template <class Body>
void for_all_seeds(unsigned runs, Body body) {
  if (const char* one = std::getenv("SEARVINS_PROPERTY_SEED")) {
    const auto seed = static_cast<std::uint64_t>(std::strtoull(one, nullptr, 10));
    CAPTURE(seed);
    Rng rng{seed};
    body(rng);
    return;
  }
  for (std::uint64_t seed = 1; seed <= property_runs(runs); ++seed) {
    CAPTURE(seed);
    Rng rng{seed};
    body(rng);
  }
}

inline double uniform(Rng& rng, double low, double high) { return std::uniform_real_distribution<double>{low, high}(rng); }
inline double normal(Rng& rng, double sigma = 1.0) { return std::normal_distribution<double>{0.0, sigma}(rng); }
inline int integer(Rng& rng, int low, int high) { return std::uniform_int_distribution<int>{low, high}(rng); }
inline bool chance(Rng& rng, double probability) { return std::bernoulli_distribution{probability}(rng); }

/// A vector of independent uniform numbers in [-size, size].
template <int N = 3>
Eigen::Matrix<double, N, 1> random_vector(Rng& rng, double size = 1.0) {
  Eigen::Matrix<double, N, 1> v;
  for (int i = 0; i < N; ++i) v[i] = uniform(rng, -size, size);
  return v;
}

/// A direction, uniform on the sphere.
inline Eigen::Vector3d random_direction(Rng& rng) {
  Eigen::Vector3d v;
  do v = random_vector<3>(rng);
  while (v.norm() < 0.1 || v.norm() > 1);
  return v.normalized();
}

/// A random symmetric positive definite matrix with condition number about `condition`.
inline Eigen::MatrixXd random_spd(Rng& rng, int n, double condition = 1e3) {
  Eigen::MatrixXd a(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) a(i, j) = normal(rng);
  const Eigen::MatrixXd s = a * a.transpose() / n;
  return s + Eigen::MatrixXd::Identity(n, n) * (s.trace() / (n * condition) * 10.0);
}

/// ||a - b|| <= tolerance * (1 + ||b||), for vectors and matrices.
template <class A, class B>
bool close(const A& a, const B& b, double tolerance) {
  return static_cast<double>((a - b).norm()) <= tolerance * (1.0 + static_cast<double>(b.norm()));
}

}  // namespace searvins::test
