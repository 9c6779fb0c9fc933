// SPDX-License-Identifier: BSD-3-Clause
// Triangulation: round trip, Jacobian, covariance against a Monte Carlo, both sides of every limit.
#include <searvins/vision/triangulation.hpp>

#include <cmath>
#include <limits>

#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::RangeFault;
using vision::StereoCamera;

namespace {

const vision::RangeLimits<double> kAnyRange{0, 1e9, 0};

Eigen::Vector3d point_in_view(Rng& rng, double near_m, double far_m) {
  const double depth = uniform(rng, near_m, far_m);
  return {depth * uniform(rng, -1, 1), depth * uniform(rng, -0.3, 0.3), depth};
}

}  // namespace

TEST_CASE("a projected point comes back, and the Jacobian is the inverse of the projection's") {
  for_all_seeds(200, [](Rng& rng) {
    const StereoCamera<double> c = random_stereo_camera(rng);
    const Eigen::Vector3d p = point_in_view(rng, 0.5, 100);
    Eigen::Matrix3d P = Eigen::Matrix3d::Zero(), J = P;
    const Eigen::Vector3d z = *c.project(p, &P);
    CHECK(close(vision::point_at(c, z, &J), p, 1e-9));
    CHECK((J * P).isApprox(Eigen::Matrix3d::Identity(), 1e-9));
    Eigen::Matrix3f Jf = Eigen::Matrix3f::Zero();
    const StereoCamera<float> cf = c.cast<float>();
    const Eigen::Vector3f zf = z.cast<float>();
    const double disparity_rounding = 3e-7 * z.norm() / (z[0] - z[1]);
    CHECK((vision::point_at(cf, zf, &Jf).cast<double>() - p).norm() <= 3 * disparity_rounding * p.norm());
  });
}

TEST_CASE("the covariance is that of many noisy looks") {
  for_all_seeds(3, [](Rng& rng) {
    const StereoCamera<double> c = street_camera();
    const Eigen::Vector3d p = point_in_view(rng, 5, 25);
    const Eigen::Vector3d z = *c.project(p);
    const Eigen::Matrix3d A = Eigen::Vector3d{uniform(rng, 0.3, 1), uniform(rng, 0.3, 1), uniform(rng, 0.3, 1)}.asDiagonal();
    Eigen::Matrix3d mix = A;
    mix(1, 0) = uniform(rng, -0.3, 0.3);  // the two eyes' errors may be alike
    const auto said = vision::triangulate(c, z, Eigen::Matrix3d{mix * mix.transpose()}, kAnyRange);
    REQUIRE(said.ok());
    constexpr int kLooks = 40000;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (int i = 0; i < kLooks; ++i) {
      const Eigen::Vector3d d = vision::point_at(c, Eigen::Vector3d{z + mix * Eigen::Vector3d{normal(rng), normal(rng), normal(rng)}}) - p;
      mean += d / kLooks, second += d * d.transpose() / kLooks;
    }
    const Eigen::Matrix3d seen = second - mean * mean.transpose();
    // 40000 looks give a variance to 0.7 %; second order in sigma_d / d <= 1.4 / 20 adds some per cent.
    const Eigen::Matrix3d W = said->covariance_c_m2.llt().matrixL().solve(Eigen::Matrix3d::Identity());
    CHECK((W * seen * W.transpose() - Eigen::Matrix3d::Identity()).norm() < 0.12);
    CHECK(mean.norm() < 0.2 * std::sqrt(said->covariance_c_m2.trace()));
  });
}

TEST_CASE("every limit, from both sides") {
  const StereoCamera<double> c = street_camera();  // f B = 500 px m
  const auto at_depth = [&](double depth_m) { return vision::StereoPixel<double>{1024, 1024 - 500 / depth_m, 366}; };
  const vision::RangeLimits<double> limits{1, 60, 3};
  CHECK(range_fault(c, at_depth(1.0001), limits) == RangeFault::none);
  CHECK(range_fault(c, at_depth(0.9999), limits) == RangeFault::too_near);
  CHECK(range_fault(c, at_depth(59.99), limits) == RangeFault::none);
  CHECK(range_fault(c, at_depth(60.01), limits) == RangeFault::too_far);
  CHECK(range_fault(c, {1024, 1024 - 2.99, 366}, {1, 1000, 3}) == RangeFault::too_far);
  CHECK(range_fault(c, {1024, 1024 - 3.01, 366}, {1, 1000, 3}) == RangeFault::none);
  CHECK(range_fault(c, {1024, 1024, 366}, limits) == RangeFault::no_disparity);
  CHECK(range_fault(c, {1024, 1025, 366}, limits) == RangeFault::no_disparity);
  CHECK(range_fault(c, {1024, std::nan(""), 366}, limits) == RangeFault::not_finite);
  CHECK(range_fault(c, at_depth(0.09), kAnyRange) == RangeFault::too_near);  // the camera's own least depth
}

TEST_CASE("a fault becomes a status that names it") {
  const StereoCamera<double> c = street_camera();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const auto behind = vision::triangulate(c, {1000, 1010, 300}, I);
  CHECK(behind.status().code == StatusCode::rejected);
  CHECK(behind.status().detail == static_cast<int>(RangeFault::no_disparity));
  CHECK(behind.status().value == -10);
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK(vision::triangulate(c, {infinity, 1010, 300}, I).status().code == StatusCode::non_finite);
  CHECK(vision::triangulate(c, {1000, 980, 300}, Eigen::Matrix3d{infinity * I}).status().code == StatusCode::non_finite);
  for (const RangeFault fault :
       {RangeFault::none, RangeFault::not_finite, RangeFault::no_disparity, RangeFault::too_near, RangeFault::too_far})
    CHECK(std::string{vision::name_of(fault)} != "?");
}
