// SPDX-License-Identifier: BSD-3-Clause
// Pinhole with a lens: Jacobians against differences, round trips, where the lens folds, and calibrations that are none.
#include <searvins/vision/camera_model.hpp>

#include <cmath>
#include <limits>

#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::PinholeCamera;
using vision::RadialTangential;

namespace {

Eigen::Vector2d random_point(Rng& rng, double size) { return random_vector<2>(rng, size); }

}  // namespace

TEST_CASE("without coefficients the lens does nothing") {
  for_all_seeds(20, [](Rng& rng) {
    const RadialTangential<double> none{};
    const Eigen::Vector2d x = random_point(rng, 3);
    Eigen::Matrix2d J = Eigen::Matrix2d::Zero();
    CHECK(none.distort(x, &J) == x);
    CHECK(J == Eigen::Matrix2d::Identity());
    CHECK(*none.undistort(x) == x);
    CHECK(none.one_to_one(1e6));
  });
}

TEST_CASE("the lens's terms, one by one") {
  const Eigen::Vector2d x{0.3, -0.4};  // s = 0.25
  CHECK(RadialTangential<double>{0.1, 0, 0, 0, 0}.distort(x).isApprox(1.025 * x, 1e-15));
  CHECK(RadialTangential<double>{0, 0.1, 0, 0, 0}.distort(x).isApprox(1.00625 * x, 1e-15));
  CHECK(RadialTangential<double>{0, 0, 0, 0, 0.1}.distort(x).isApprox(1.0015625 * x, 1e-15));
  CHECK((RadialTangential<double>{0, 0, 0.01, 0, 0}.distort(x) - x).isApprox(Eigen::Vector2d{0.02 * -0.12, 0.01 * (0.25 + 0.32)}, 1e-12));
  CHECK((RadialTangential<double>{0, 0, 0, 0.01, 0}.distort(x) - x).isApprox(Eigen::Vector2d{0.01 * (0.25 + 0.18), 0.02 * -0.12}, 1e-12));
}

TEST_CASE("Jacobians of the lens and of the projection") {
  for_all_seeds(100, [](Rng& rng) {
    const PinholeCamera<double> c = random_pinhole(rng);
    const Eigen::Vector2d x = random_point(rng, 0.8);
    Eigen::Matrix2d J = Eigen::Matrix2d::Zero(), numeric = J;
    (void)c.lens.distort(x, &J);
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d d = 1e-6 * Eigen::Vector2d::Unit(i);
      numeric.col(i) = (c.lens.distort(x + d) - c.lens.distort(x - d)) / 2e-6;
    }
    CHECK((J - numeric).norm() < 1e-8);
    const double z = uniform(rng, 0.5, 50);
    const Eigen::Vector3d p{0.5 * x[0] * z, 0.5 * x[1] * z, z};
    Eigen::Matrix<double, 2, 3> P, differences;
    REQUIRE(c.project(p, &P).ok());
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d d = 1e-6 * z * Eigen::Vector3d::Unit(i);
      differences.col(i) = (*c.project(p + d) - *c.project(p - d)) / (2e-6 * z);
    }
    CHECK((P - differences).norm() < 1e-7 * P.norm());
  });
}

TEST_CASE("a pixel's ray projects to the pixel, in double and in float") {
  for_all_seeds(200, [](Rng& rng) {
    const PinholeCamera<double> c = random_pinhole(rng);
    REQUIRE(check(c).ok());
    const Eigen::Vector2d pixel{uniform(rng, 0, c.width_px - 1), uniform(rng, 0, c.height_px - 1)};
    const auto ray = c.ray(pixel);
    REQUIRE(ray.ok());
    CHECK((*c.project(*ray * uniform(rng, 0.1, 100)) - pixel).norm() < 1e-9 * pixel.norm());
    const PinholeCamera<float> cf = c.cast<float>();
    const Eigen::Vector2f pixel_f = pixel.cast<float>();
    const auto ray_f = cf.ray(pixel_f);
    REQUIRE(ray_f.ok());
    CHECK((*cf.project(*ray_f) - pixel_f).norm() < 2e-2F);
  });
}

TEST_CASE("where the lens folds nothing is seen, and undistort says so") {
  const RadialTangential<double> barrel{-0.3, 0, 0, 0, 0};  // r - 0.3 r^3 turns at r = 1.054, 0.703
  const double turn = 1 / std::sqrt(0.9);
  CHECK(barrel.one_to_one(0.999 * turn * turn));
  CHECK_FALSE(barrel.one_to_one(1.001 * turn * turn));
  CHECK(barrel.undistort({0.70, 0}).ok());
  CHECK((*barrel.undistort({0.70, 0}))[0] < turn);
  CHECK(barrel.undistort({0.71, 0}).status().code == StatusCode::not_converged);
  CHECK(barrel.undistort({1e200, 0}).status().code == StatusCode::not_converged);
  // Turns and turns back: outside is one to one again by itself, but not together with the inside.
  const RadialTangential<double> wave{-0.6, 0.1, 0, 0, 0};
  CHECK_FALSE(wave.one_to_one(4));
  CHECK(wave.one_to_one(0.5));
  const RadialTangential<double> sixth{-0.6, 0, 0, 0, 0.03};
  CHECK_FALSE(sixth.one_to_one(4));
  PinholeCamera<double> c;
  c.width_px = 1000, c.height_px = 1000, c.fx_px = c.fy_px = 800, c.cx_px = c.cy_px = 499.5, c.lens = barrel;
  CHECK(c.project({0, 0, 1}).ok());
  CHECK(c.project({1.2, 0, 1}).status().code == StatusCode::rejected);
}

TEST_CASE("the slope's sign over the whole disc, against a scan") {
  for_all_seeds(300, [](Rng& rng) {
    const RadialTangential<double> lens{uniform(rng, -1, 1), uniform(rng, -1, 1), 0, 0, chance(rng, 0.3) ? 0 : uniform(rng, -1, 1)};
    const double s = uniform(rng, 0.01, 3);
    double least = 1;
    for (int i = 0; i <= 2000; ++i) {
      const double t = s * i / 2000;
      least = std::min(least, 1 + 3 * lens.k1 * t + 5 * lens.k2 * t * t + 7 * lens.k3 * t * t * t);
    }
    if (std::abs(least) > 1e-4) CHECK(lens.one_to_one(s) == (least > 0));
  });
}

TEST_CASE("points behind the camera and numbers that are none are refused") {
  const PinholeCamera<double> c = euroc_left();
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  CHECK(c.project({0, 0, 0}).status().code == StatusCode::rejected);
  CHECK(c.project({0, 0, -1}).status().code == StatusCode::rejected);
  CHECK(c.project({0, nan, 1}).status().code == StatusCode::rejected);
  CHECK(c.project({1, 1, 1e-320}).status().code == StatusCode::rejected);
  CHECK(c.ray({infinity, 0}).status().code == StatusCode::non_finite);
  PinholeCamera<double> broken = c;
  broken.lens.k1 = nan;
  CHECK_FALSE(broken.ray({10, 10}).ok());
}

TEST_CASE("a calibration that is none, or is for another image size") {
  const PinholeCamera<double> good = euroc_left();
  CHECK(check(good).ok());
  const auto refused = [&](auto spoil) {
    PinholeCamera<double> c = good;
    spoil(c);
    return check(c).code == StatusCode::invalid_argument;
  };
  CHECK(refused([](auto& c) { c.width_px = 0; }));
  CHECK(refused([](auto& c) { c.fx_px = -458; }));
  CHECK(refused([](auto& c) { c.fy_px = std::numeric_limits<double>::infinity(); }));
  CHECK(refused([](auto& c) { c.cx_px = 752; }));
  CHECK(refused([](auto& c) { c.cy_px = std::nan(""); }));
  CHECK(refused([](auto& c) { c.lens.p1 = std::nan(""); }));
  CHECK(refused([](auto& c) { c.lens.k1 = -1.5; }));  // folds inside the image
  CHECK(check_size(good, 752, 480).ok());
  CHECK(check_size(good, 640, 480).code == StatusCode::invalid_argument);
  CHECK(check_size(good, 640, 480).index == 640);
}
