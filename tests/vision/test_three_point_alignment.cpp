// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/three_point_alignment.hpp>

#include <limits>

#include "support/property.hpp"
#include "two_views.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::align_three_points;
using vision::CameraMotion;
using vision::PointTriple;

namespace {

PointTriple random_triple(Rng& rng) {
  PointTriple p;
  do
    for (Eigen::Vector3d& x : p) x = random_vector<3>(rng, 20);
  while (vision::triangle_shape(p) < 0.1);
  return p;
}

CameraMotion any_motion(Rng& rng) { return {so3::exp(random_vector<3>(rng, 2)), random_vector<3>(rng, 10)}; }

double misfit(const PointTriple& prev, const PointTriple& cur, const CameraMotion& motion) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += (prev[i] - motion.to_previous(cur[i])).squaredNorm();
  return sum;
}

}  // namespace

TEST_CASE("three points: any motion is recovered exactly") {
  for_all_seeds(200, [](Rng& rng) {
    const CameraMotion truth = any_motion(rng);
    const PointTriple prev = random_triple(rng);
    PointTriple cur;
    for (std::size_t i = 0; i < 3; ++i) cur[i] = truth.to_current(prev[i]);
    const auto found = align_three_points(prev, cur);
    REQUIRE(found.ok());
    CHECK(found->minus(truth).norm() < 1e-11);
    CHECK((found->R_prev_cur.transpose() * found->R_prev_cur).isIdentity(1e-13));
    CHECK(found->R_prev_cur.determinant() > 0);
  });
}

TEST_CASE("three points with noise: no motion nearby fits better") {
  for_all_seeds(100, [](Rng& rng) {
    const CameraMotion truth = any_motion(rng);
    const PointTriple prev = random_triple(rng);
    PointTriple cur;
    for (std::size_t i = 0; i < 3; ++i) cur[i] = truth.to_current(prev[i]) + random_vector<3>(rng, 0.3);
    const auto found = align_three_points(prev, cur);
    REQUIRE(found.ok());
    const double least = misfit(prev, cur, *found);
    for (const double size : {1e-4, 1e-2, 0.3})
      for (int trial = 0; trial < 10; ++trial) CHECK(misfit(prev, cur, found->plus(random_vector<6>(rng, size))) >= least * (1 - 1e-9));
  });
}

TEST_CASE("three points: the order in which they come does not matter") {
  for_all_seeds(50, [](Rng& rng) {
    const CameraMotion truth = any_motion(rng);
    const PointTriple prev = random_triple(rng);
    PointTriple cur;
    for (std::size_t i = 0; i < 3; ++i) cur[i] = truth.to_current(prev[i]) + random_vector<3>(rng, 0.1);
    const auto one = align_three_points(prev, cur);
    const auto other = align_three_points({prev[2], prev[0], prev[1]}, {cur[2], cur[0], cur[1]});
    REQUIRE(one.ok());
    REQUIRE(other.ok());
    CHECK(one->minus(*other).norm() < 1e-10);
  });
}

TEST_CASE("three points on a line, in one place, or not finite are refused") {
  const PointTriple good{Eigen::Vector3d{0, 0, 5}, Eigen::Vector3d{1, 0, 5}, Eigen::Vector3d{0, 1, 5}};
  const PointTriple line{Eigen::Vector3d{0, 0, 5}, Eigen::Vector3d{1, 0, 5}, Eigen::Vector3d{2, 0.01, 5}};
  const PointTriple place{good[0], good[0], good[0]};
  PointTriple broken = good;
  broken[1].y() = std::numeric_limits<double>::quiet_NaN();
  CHECK(align_three_points(good, good).ok());
  for (const PointTriple& bad : {line, place, broken}) {
    CHECK(align_three_points(bad, good).status().code == StatusCode::under_determined);
    CHECK(align_three_points(good, bad).status().code == StatusCode::under_determined);
  }
}
