// SPDX-License-Identifier: BSD-3-Clause
// The rectified projection: against its definition, its Jacobian against differences, both sides of the least depth, and the continuation
// behind it.
#include <searvins/vision/stereo_camera.hpp>

#include <cmath>
#include <limits>

#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::StereoCamera;

namespace {

/// Largest entry of (analytic - central difference) against the largest of the row.
double jacobian_error(const StereoCamera<double>& c, const Eigen::Vector3d& p, double step) {
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero(), numeric = J;
  (void)c.continued(p, &J);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(i);
    numeric.col(i) = (c.continued(p + d) - c.continued(p - d)) / (2 * step);
  }
  double worst = 0;
  for (int r = 0; r < 3; ++r) worst = std::max(worst, (J.row(r) - numeric.row(r)).cwiseAbs().maxCoeff() / J.row(r).cwiseAbs().maxCoeff());
  return worst;
}

}  // namespace

TEST_CASE("the right eye sees what a pinhole at (B, 0, 0) sees, on the row of the left") {
  for_all_seeds(200, [](Rng& rng) {
    const StereoCamera<double> c = random_stereo_camera(rng);
    REQUIRE(check(c).ok());
    const Eigen::Vector3d p{uniform(rng, -30, 30), uniform(rng, -10, 10), uniform(rng, 1, 60)};
    const auto z = c.project(p);
    REQUIRE(z.ok());
    CHECK((*z)[0] == doctest::Approx(c.cx_px + c.fx_px * p.x() / p.z()));
    CHECK((*z)[1] == doctest::Approx(c.cx_px + c.fx_px * (p.x() - c.baseline_m) / p.z()));
    CHECK((*z)[2] == doctest::Approx(c.cy_px + c.fy_px * p.y() / p.z()));
    CHECK((*z)[0] - (*z)[1] == doctest::Approx(c.disparity_px(p.z())));
    CHECK(c.depth_m((*z)[0] - (*z)[1]) == doctest::Approx(p.z()));
    CHECK(close(c.camera_from_body(c.body_from_camera(p)), p, 1e-12));
  });
}

TEST_CASE("the Jacobian is that of the projection, in front, near and behind") {
  for_all_seeds(200, [](Rng& rng) {
    const StereoCamera<double> c = random_stereo_camera(rng);
    const double depth = chance(rng, 0.5) ? uniform(rng, 1, 60) : uniform(rng, -20, 0.09);
    const Eigen::Vector3d p{uniform(rng, -30, 30), uniform(rng, -10, 10), depth};
    CHECK(jacobian_error(c, p, 1e-5 * std::max(0.1, std::abs(depth))) < 1e-6);
  });
}

TEST_CASE("a float camera is a double camera to single precision") {
  for_all_seeds(100, [](Rng& rng) {
    const StereoCamera<double> c = random_stereo_camera(rng);
    const Eigen::Vector3d p{uniform(rng, -30, 30), uniform(rng, -10, 10), uniform(rng, 1, 60)};
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    Eigen::Matrix3f Jf = Eigen::Matrix3f::Zero();
    const Eigen::Vector3d z = *c.project(p, &J);
    const auto zf = c.cast<float>().project(p.cast<float>(), &Jf);
    REQUIRE(zf.ok());
    CHECK((zf->cast<double>() - z).norm() < 1e-5 * (2000 + z.norm()));
    CHECK((Jf.cast<double>() - J).norm() < 1e-5 * J.norm());
  });
}

TEST_CASE("nearer than the least depth, behind and not finite is refused; at the least depth it is not") {
  const StereoCamera<double> c = street_camera();
  const double m = c.min_depth_m, nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  CHECK(c.project({0.01, 0.02, m}).ok());
  CHECK(c.project({0, 0, std::nextafter(m, 0)}).status().code == StatusCode::rejected);
  CHECK(c.project({0, 0, -5}).status().code == StatusCode::rejected);
  CHECK(c.project({0, 0, -5}).status().value == -5);
  CHECK(c.project({0, 0, nan}).status().code == StatusCode::rejected);
  CHECK(c.project({nan, 0, 5}).status().code == StatusCode::rejected);
  CHECK(c.project({0, 0, infinity}).status().code == StatusCode::rejected);
}

TEST_CASE("across the least depth value and Jacobian are continuous, and below it the Jacobian keeps its rank") {
  for_all_seeds(100, [](Rng& rng) {
    StereoCamera<double> c = random_stereo_camera(rng);
    c.min_depth_m = uniform(rng, 0.1, 1);
    const double x = uniform(rng, -2, 2), y = uniform(rng, -2, 2), m = c.min_depth_m;
    Eigen::Matrix3d above = Eigen::Matrix3d::Zero(), below = above;
    const Eigen::Vector3d at = c.continued({x, y, m}, &above);
    CHECK((c.continued({x, y, m * (1 - 1e-9)}, &below) - at).norm() < 1e-8 * at.norm());
    CHECK((above - below).norm() < 1e-8 * above.norm());
    const double behind = m - std::exp(uniform(rng, -3, 8));
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    (void)c.continued({x, y, behind}, &J);
    const double q = (2 * m - behind) / (m * m), expected = -c.fx_px * c.fx_px * c.fy_px * c.baseline_m * q * q / (m * m);
    CHECK((so3::skew(Eigen::Vector3d{J.col(0)}) * J.col(1)).dot(J.col(2)) == doctest::Approx(expected));
  });
}

TEST_CASE("from behind, Newton's method climbs to the depth that the disparity says and never passes it") {
  for_all_seeds(100, [](Rng& rng) {
    const StereoCamera<double> c = random_stereo_camera(rng);
    const Eigen::Vector3d truth{uniform(rng, -5, 5), uniform(rng, -3, 3), uniform(rng, 1, 60)};
    const Eigen::Vector3d z = *c.project(truth);
    Eigen::Vector3d p{uniform(rng, -5, 5), uniform(rng, -3, 3), uniform(rng, -100, 0)};
    double before = p.z();
    for (int i = 0; i < 40; ++i) {
      Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
      const Eigen::Vector3d e = c.continued(p, &J) - z;
      p -= J.inverse() * e;
      CHECK(p.z() >= before - 1e-9);
      CHECK(p.z() <= truth.z() * (1 + 1e-9));
      before = p.z();
    }
    CHECK(close(p, truth, 1e-6));
  });
}

TEST_CASE("what cannot be a stereo camera is refused") {
  const StereoCamera<double> good = street_camera();
  CHECK(check(good).ok());
  const auto refused = [&](auto spoil) {
    StereoCamera<double> c = good;
    spoil(c);
    return check(c).code == StatusCode::invalid_argument;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(refused([](auto& c) { c.fx_px = 0; }));
  CHECK(refused([&](auto& c) { c.fy_px = nan; }));
  CHECK(refused([](auto& c) { c.baseline_m = -0.5; }));
  CHECK(refused([](auto& c) { c.width_px = 640, c.height_px = 480; }));
  CHECK(refused([](auto& c) { c.height_px = 0; }));
  CHECK(refused([](auto& c) { c.cx_px = -1; }));
  CHECK(refused([](auto& c) { c.min_depth_m = 0; }));
  CHECK(refused([](auto& c) { c.R_bc *= 2; }));
  CHECK(refused([](auto& c) { c.R_bc.col(0) *= -1; }));
  CHECK(refused([&](auto& c) { c.p_bc_m.x() = nan; }));
}

TEST_CASE("inside: the centres of the outermost pixels are the last that count, less the border") {
  const StereoCamera<double> c = street_camera();
  CHECK(c.inside(0, 0));
  CHECK(c.inside(2047, 731));
  CHECK_FALSE(c.inside(2047.1, 0));
  CHECK_FALSE(c.inside(0, -0.1));
  CHECK_FALSE(c.inside(std::numeric_limits<double>::quiet_NaN(), 5));
  CHECK(c.inside({100, 10, 50}, 10.0));
  CHECK_FALSE(c.inside({100, 9.9, 50}, 10.0));
}
