// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/camera_motion.hpp>

#include <limits>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::CameraMotion;

namespace {

CameraMotion any_motion(Rng& rng) { return {so3::exp(random_vector<3>(rng, 2)), random_vector<3>(rng, 10)}; }

}  // namespace

TEST_CASE("camera motions: a tangent vector leads there and back, and motions chain like the poses they come from") {
  for_all_seeds(100, [](Rng& rng) {
    const CameraMotion a = any_motion(rng), b = any_motion(rng);
    CHECK(a.plus(b.minus(a)).minus(b).norm() < 1e-12);
    const Eigen::Vector3d p = random_vector<3>(rng, 10);
    CHECK((a.to_previous(a.to_current(p)) - p).norm() < 1e-12);
    CHECK((a.then(b).to_previous(p) - a.to_previous(b.to_previous(p))).norm() < 1e-12);
    const double angle = uniform(rng, 0, 3);
    CHECK(CameraMotion{so3::exp(angle * random_vector<3>(rng).normalized()), {}}.angle_rad() == doctest::Approx(angle));
  });
}

TEST_CASE("camera motions: the rotation's tangent is on the right, in current axes; the position is added in previous axes") {
  for_all_seeds(50, [](Rng& rng) {
    const CameraMotion a = any_motion(rng);
    const Eigen::Matrix<double, 6, 1> d = random_vector<6>(rng, 1e-6);
    const CameraMotion moved = a.plus(d);
    CHECK(close(moved.R_prev_cur, Eigen::Matrix3d(a.R_prev_cur * (Eigen::Matrix3d::Identity() + so3::skew(d.head<3>()))), 1e-11));
    CHECK(moved.t_prev_cur_m == a.t_prev_cur_m + d.tail<3>());
  });
}

TEST_CASE("camera motions: a NaN anywhere is not finite") {
  CameraMotion motion;
  CHECK(motion.finite());
  motion.t_prev_cur_m.y() = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(motion.finite());
  motion = {};
  motion.R_prev_cur(1, 2) = std::numeric_limits<double>::infinity();
  CHECK_FALSE(motion.finite());
}
