// SPDX-License-Identifier: BSD-3-Clause
// SO(3) as a group: products, quaternions, Jacobians against central differences of exp and log, removal of drift. The precision sweep
// is in test_so3.cpp.
#include <doctest/doctest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include <searvins/math/so3.hpp>

#include "support/property.hpp"

namespace so3 = searvins::so3;
using searvins::StatusCode;
using searvins::test::random_direction;
using searvins::test::Rng;

namespace {

template <class S>
constexpr S kMachineEps = std::numeric_limits<S>::epsilon();

/// |a - b|, each side evaluated first: one instantiation instead of one an expression.
double distance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) { return (a - b).norm(); }
double distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return (a - b).norm(); }

const Eigen::Matrix3d kIdentity = Eigen::Matrix3d::Identity();

}  // namespace

TEST_CASE("exp is a homomorphism on one axis, orthogonal, proper, and the Hamilton quaternion gives the same matrix") {
  searvins::test::for_all_seeds(500, [](Rng& rng) {
    const Eigen::Vector3d axis = random_direction(rng), theta = axis * searvins::test::uniform(rng, -20, 20);
    const Eigen::Matrix3d R = so3::exp(theta);
    CHECK(distance(R.transpose() * R, kIdentity) <= 1e-14);
    CHECK(R.determinant() == doctest::Approx(1).epsilon(1e-14));
    CHECK(distance(R * axis, axis) <= 1e-14);
    CHECK(distance(so3::exp(theta / 2) * so3::exp(theta / 2), R) <= 1e-14);
    CHECK(distance(so3::exp(-theta), R.transpose()) <= 1e-15);
    const Eigen::Quaterniond q = so3::quaternion_exp(theta);
    CHECK(distance(q.toRotationMatrix(), R) <= 1e-14);
    CHECK(distance(so3::matrix_from_quaternion(q), R) <= 1e-14);
    const Eigen::Quaterniond back = so3::quaternion_from_matrix(R);
    CHECK(back.w() >= 0);
    CHECK(std::abs(back.dot(q)) == doctest::Approx(1).epsilon(1e-14));
    const Eigen::Vector3d v = searvins::test::random_vector<3>(rng), u = searvins::test::random_vector<3>(rng);
    CHECK(distance(so3::skew(v) * u, v.cross(u)) <= 1e-15);
    CHECK(so3::vee(so3::skew(v)) == v);
    CHECK(distance(R * so3::skew(v) * R.transpose(), so3::skew(R * v)) <= 1e-14);
  });
  // Hamilton, active, right-handed: a quarter turn about z takes x to y
  const Eigen::Vector3d x{1, 0, 0}, y{0, 1, 0}, quarter{0, 0, std::acos(0.0)};
  CHECK(distance(so3::exp(quarter) * x, y) <= 1e-15);
}

TEST_CASE("Jacobians are what they say: central differences of exp and log") {
  searvins::test::for_all_seeds(200, [](Rng& rng) {
    const Eigen::Vector3d theta = random_direction(rng) * searvins::test::uniform(rng, 0.0, 3.1);
    const Eigen::Matrix3d R = so3::exp(theta);
    const double h = 1e-5;
    Eigen::Matrix3d right, left, right_of_log, left_of_log;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d d = Eigen::Vector3d::Unit(i) * h;
      right.col(i) = (so3::log(R.transpose() * so3::exp(theta + d)) - so3::log(R.transpose() * so3::exp(theta - d))) / (2 * h);
      left.col(i) = (so3::log(so3::exp(theta + d) * R.transpose()) - so3::log(so3::exp(theta - d) * R.transpose())) / (2 * h);
      right_of_log.col(i) = (so3::log(R * so3::exp(d)) - so3::log(R * so3::exp(-d))) / (2 * h);
      left_of_log.col(i) = (so3::log(so3::exp(d) * R) - so3::log(so3::exp(-d) * R)) / (2 * h);
    }
    CHECK(searvins::test::close(so3::right_jacobian(theta), right, 1e-9));
    CHECK(searvins::test::close(so3::left_jacobian(theta), left, 1e-9));
    CHECK(searvins::test::close(so3::right_jacobian_inverse(theta), right_of_log, 1e-8));
    CHECK(searvins::test::close(so3::left_jacobian_inverse(theta), left_of_log, 1e-8));
    CHECK(distance(so3::right_jacobian(theta) * so3::right_jacobian_inverse(theta), kIdentity) <= 1e-13);
    CHECK(distance(so3::left_jacobian(theta), R * so3::right_jacobian(theta)) <= 1e-14);
  });
}

TEST_CASE_TEMPLATE("normalise and orthonormalise remove drift and refuse what is no rotation", S, float, double) {
  using Matrix = Eigen::Matrix<S, 3, 3>;
  searvins::test::for_all_seeds(200, [](Rng& rng) {
    const Matrix R = so3::exp((random_direction(rng) * searvins::test::uniform(rng, 0, 3)).cast<S>());
    const double size = std::pow(10.0, searvins::test::uniform(rng, -7, -1));
    Matrix noise, stretch;
    for (int i = 0; i < 9; ++i) noise.data()[i] = static_cast<S>(searvins::test::uniform(rng, -size, size));
    const auto clean = so3::orthonormalise(R + noise);
    REQUIRE(clean.ok());
    CHECK((clean->transpose() * *clean - Matrix::Identity()).norm() <= 8 * kMachineEps<S>);
    CHECK((*clean - R).norm() <= noise.norm() * S(1.5) + 8 * kMachineEps<S>);
    CHECK((*so3::orthonormalise(*clean) - *clean).norm() <= 8 * kMachineEps<S>);
    stretch = R * (Matrix::Identity() + (noise + noise.transpose()) / S(4));  // R is the polar factor of R times a positive matrix
    CHECK((*so3::orthonormalise(stretch) - R).norm() <= 16 * kMachineEps<S>);

    const Eigen::Quaternion<S> q = so3::quaternion_from_matrix(R);
    for (const S scale : {std::numeric_limits<S>::min(), S(0.1), S(-2), std::numeric_limits<S>::max() / S(4)}) {
      Eigen::Quaternion<S> scaled;
      scaled.coeffs() = q.coeffs() * scale;
      const auto unit = so3::normalise(scaled);
      REQUIRE(unit.ok());
      CHECK((unit->coeffs() - (scale < S(0) ? S(-1) : S(1)) * q.coeffs()).norm() <= 8 * kMachineEps<S>);
      CHECK((so3::matrix_from_quaternion(scaled) - R).norm() <= 16 * kMachineEps<S>);
    }
  });
  Matrix reflection = Matrix::Identity();
  reflection(2, 2) = S(-1);
  CHECK(so3::orthonormalise(reflection).status().code == StatusCode::invalid_argument);
  CHECK(so3::orthonormalise(Matrix::Zero().eval()).status().code == StatusCode::invalid_argument);
  CHECK(so3::orthonormalise((Matrix::Identity() * S(2)).eval()).status().code == StatusCode::invalid_argument);
  CHECK(so3::normalise(Eigen::Quaternion<S>{S(0), S(0), S(0), S(0)}).status().code == StatusCode::invalid_argument);
}
