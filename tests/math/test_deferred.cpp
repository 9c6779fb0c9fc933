// SPDX-License-Identifier: BSD-3-Clause
// Types that are settled late: what converts to a parameter that is not deduced, and that nothing is looked at before it is used.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <type_traits>

#include <searvins/math/deferred.hpp>

#include "support/property.hpp"

namespace math = searvins::math;
using searvins::test::for_all_seeds;
using searvins::test::random_vector;
using searvins::test::Rng;

namespace {

template <class Scalar = double>
Scalar dot_of(const math::Vector3<Scalar>& a, const math::Vector3<Scalar>& b) {
  const math::Vector3<Scalar> sum = a + b;
  return sum.dot(b);
}

/// Eigen has no such function: this class compiles only because nobody calls `wrong`.
template <int N>
struct Lazy {
  using Vector = math::Vector<math::DeferredFor<double, N>, N>;
  Vector v{Vector::Ones()};
  auto wrong() const { return (v + v).no_such_function(); }
  double sum() const { return (v + v).sum(); }
};
template <class Policy>
struct LazyOfType {
  using Matrix = math::Matrix3<math::Deferred<double, Policy>>;
  Matrix m{Matrix::Identity()};
  auto wrong() const { return (m + m).no_such_function(); }
  double trace() const { return (m + m).trace(); }
};

static_assert(std::is_same_v<math::Vector3<double>, Eigen::Vector3d> && std::is_same_v<math::Matrix3<float>, Eigen::Matrix3f>);
static_assert(std::is_same_v<math::Matrix<double, 2, 3>, Eigen::Matrix<double, 2, 3>>);
static_assert(std::is_same_v<Lazy<4>::Vector, Eigen::Vector4d> && std::is_same_v<LazyOfType<int>::Matrix, Eigen::Matrix3d>);

}  // namespace

TEST_CASE("a parameter that is not deduced takes what a plain vector takes: vectors, expressions, views, braces") {
  for_all_seeds(20, [](Rng& rng) {
    const Eigen::Vector3d a = random_vector<3>(rng), b = random_vector<3>(rng);
    const double expected = (a + b).dot(b);
    Eigen::Matrix<double, 6, 1> both;
    both << a, b;
    CHECK(dot_of(a, b) == expected);
    CHECK(dot_of(both.head<3>(), both.tail<3>()) == expected);
    CHECK(dot_of({a.x(), a.y(), a.z()}, Eigen::Map<const Eigen::Vector3d>(b.data())) == expected);
    CHECK(dot_of(a - Eigen::Vector3d::Zero(), b) == expected);
    CHECK(dot_of<float>(a.cast<float>(), b.cast<float>()) == doctest::Approx(expected).epsilon(1e-3).scale(10));
  });
}

TEST_CASE("a class of deferred types compiles with functions that could not be called") {
  CHECK(Lazy<4>{}.sum() == 8);
  CHECK(LazyOfType<int>{}.trace() == 6);
}
