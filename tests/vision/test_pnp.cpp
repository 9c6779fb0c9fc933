// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/pnp.hpp>

#include <Eigen/LU>

#include <cmath>
#include <limits>
#include <memory>

#include "support/property.hpp"
#include "two_views.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::CameraMotion;
using vision::PixelPair;
using vision::PnpOptions;
using vision::StereoPnp;

namespace {

constexpr std::size_t kPairs = 256;
using Pnp = StereoPnp<kPairs>;
using Pairs = Pnp::Pairs;

Pairs street(Rng& rng, const CameraMotion& motion, std::size_t good, std::size_t wrong, double sigma_px) {
  const auto camera = car_camera();
  Pairs pairs;
  for (std::size_t i = 0; i < good + wrong; ++i)
    (void)pairs.push_back(i < good ? seen_twice(rng, camera, motion, random_point(rng, camera), sigma_px)
                                   : mismatched(rng, camera, sigma_px));
  return pairs;
}

bool same(const CameraMotion& a, const CameraMotion& b) { return a.R_prev_cur == b.R_prev_cur && a.t_prev_cur_m == b.t_prev_cur_m; }

/// Where a motion puts the current observation of a point observed at previous_px.
Eigen::Vector3d transfer(const CameraMotion& motion, const Eigen::Vector3d& previous_px) {
  const auto camera = car_camera();
  return camera.continued(motion.to_current(vision::point_at<double>(camera, previous_px)));
}

}  // namespace

TEST_CASE("PnP: without noise the motion is exact, whatever it is") {
  for_all_seeds(40, [](Rng& rng) {
    CameraMotion truth = random_motion(rng);
    if (chance(rng, 0.3)) truth.R_prev_cur = so3::exp(random_vector<3>(rng, 0.5));
    const Pairs pairs = street(rng, truth, static_cast<std::size_t>(integer(rng, 15, 60)), 0, 0);
    Pnp pnp(car_camera());
    REQUIRE(pnp.solve(pairs).ok());
    CHECK(pnp.motion().minus(truth).norm() < 1e-9);
    CHECK(pnp.statistics().rms_px < 1e-6);
    CHECK(pnp.statistics().inliers == pnp.statistics().usable);
  });
}

TEST_CASE("PnP: 40 % of the pairs are wrong; the motion is within four sigma, the wrong ones are told apart") {
  for_all_seeds(40, [](Rng& rng) {
    const CameraMotion truth = random_motion(rng);
    const std::size_t good = 90, wrong = 60;
    const Pairs pairs = street(rng, truth, good, wrong, 0.4);
    PnpOptions options;
    options.sigma_px = 0.4;
    Pnp pnp(car_camera(), options);
    REQUIRE(pnp.solve(pairs).ok());
    const Eigen::Matrix<double, 6, 1> error = pnp.motion().minus(truth);
    for (int i = 0; i < 6; ++i) CHECK(std::abs(error[i]) < 5 * std::sqrt(pnp.covariance()(i, i)));
    std::size_t kept = 0, taken_in = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) (i < good ? kept : taken_in) += pnp.is_inlier(i);
    CHECK(kept >= good - 2);
    CHECK(taken_in <= 3);
    CHECK(pnp.statistics().iterations < 200);  // 60 % of inliers need 29 samples for 0.999
    CHECK(pnp.statistics().rms_px == doctest::Approx(0.4).epsilon(0.25));
  });
}

TEST_CASE("PnP: a moving vehicle that fills a quarter of the view does not pull the motion") {
  for_all_seeds(20, [](Rng& rng) {
    const auto camera = car_camera();
    const CameraMotion truth = random_motion(rng);
    CameraMotion seen_from_vehicle = truth;
    seen_from_vehicle.t_prev_cur_m.z() -= 1.2;  // it drives ahead
    Pairs pairs = street(rng, truth, 75, 0, 0.3);
    for (int i = 0; i < 25; ++i)
      (void)pairs.push_back(seen_twice(rng, camera, seen_from_vehicle, {uniform(rng, -1, 1), uniform(rng, -1, 1), 8}, 0.3));
    Pnp pnp(camera, [] {
      PnpOptions options;
      options.sigma_px = 0.3;
      return options;
    }());
    REQUIRE(pnp.solve(pairs).ok());
    CHECK((pnp.motion().t_prev_cur_m - truth.t_prev_cur_m).norm() < 0.05);
    std::size_t taken_in = 0;
    for (std::size_t i = 75; i < 100; ++i) taken_in += pnp.is_inlier(i);
    CHECK(taken_in == 0);
  });
}

TEST_CASE("PnP covariance: that of the normal equations with numeric derivatives") {
  for_all_seeds(10, [](Rng& rng) {
    const CameraMotion truth = random_motion(rng);
    const Pairs pairs = street(rng, truth, 40, 0, 0.2);
    PnpOptions options;
    options.sigma_px = 0.7;  // above the noise that there is, so that it alone scales the covariance
    Pnp pnp(car_camera(), options);
    REQUIRE(pnp.solve(pairs).ok());
    Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
    constexpr double h = 1e-6;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (!pnp.is_inlier(k)) continue;
      Eigen::Matrix<double, 3, 6> A;
      for (int i = 0; i < 6; ++i) {
        const Eigen::Matrix<double, 6, 1> d = h * Eigen::Matrix<double, 6, 1>::Unit(i);
        A.col(i) = (transfer(pnp.motion().plus(d), pairs[k].previous_px) - transfer(pnp.motion().plus(-d), pairs[k].previous_px)) / (2 * h);
      }
      Eigen::Matrix3d T;
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d d = 1e-4 * Eigen::Vector3d::Unit(i);
        T.col(i) = (transfer(pnp.motion(), pairs[k].previous_px + d) - transfer(pnp.motion(), pairs[k].previous_px - d)) / 2e-4;
      }
      const Eigen::Matrix3d S = Eigen::Matrix3d::Identity() + T * T.transpose();
      H += A.transpose() * S.inverse() * A;
    }
    const Eigen::Matrix<double, 6, 6> expected = 0.7 * 0.7 * H.inverse();
    const Eigen::Matrix<double, 6, 1> scale = expected.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::Matrix<double, 6, 6> found = scale.asDiagonal() * pnp.covariance() * scale.asDiagonal();
    CHECK((found - scale.asDiagonal() * expected * scale.asDiagonal()).cwiseAbs().maxCoeff() < 1e-5);
  });
}

TEST_CASE("PnP covariance: Monte Carlo agrees with it") {
  Rng rng{7};
  const auto camera = car_camera();
  const double sigma_px = 0.5;
  PnpOptions options;
  options.sigma_px = sigma_px;
  options.inlier_px = 2.5;
  Pnp pnp(camera, options);
  const int runs = 600;
  Eigen::Matrix<double, 6, 6> scatter = Eigen::Matrix<double, 6, 6>::Zero(), claimed = scatter;
  double nees = 0;
  const CameraMotion truth = random_motion(rng);
  StaticVector<Eigen::Vector3d, 60> points;
  for (std::size_t i = 0; i < points.capacity(); ++i) (void)points.push_back(random_point(rng, camera, 30));
  for (int run = 0; run < runs; ++run) {
    Pairs pairs;
    for (const Eigen::Vector3d& p : points) (void)pairs.push_back(seen_twice(rng, camera, truth, p, sigma_px));
    REQUIRE(pnp.solve(pairs).ok());
    const Eigen::Matrix<double, 6, 1> error = pnp.motion().minus(truth);
    scatter += error * error.transpose() / runs;
    claimed += pnp.covariance() / runs;
    nees += error.dot(pnp.covariance().inverse() * error) / runs;
  }
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i);
    CHECK(std::sqrt(scatter(i, i) / claimed(i, i)) == doctest::Approx(1.0).epsilon(0.12));
  }
  MESSAGE("mean normalised squared error of 6 numbers: " << nees);
  CHECK(nees > 5.0);
  CHECK(nees < 7.0);  // 6 +- 0.14 for a perfect covariance
}

TEST_CASE("PnP: the same input gives the same bits, whatever was solved before; another seed stays within the noise") {
  for_all_seeds(10, [](Rng& rng) {
    const CameraMotion truth = random_motion(rng);
    const Pairs pairs = street(rng, truth, 60, 20, 0.4), others = street(rng, random_motion(rng), 30, 10, 0.4);
    PnpOptions options;
    options.sigma_px = 0.4;
    Pnp fresh(car_camera(), options), used(car_camera(), options);
    (void)used.solve(others);
    REQUIRE(fresh.solve(pairs).ok());
    REQUIRE(used.solve(pairs).ok());
    CHECK(same(fresh.motion(), used.motion()));
    CHECK(fresh.covariance() == used.covariance());
    CHECK(fresh.statistics().iterations == used.statistics().iterations);
    options.seed = 12345;
    Pnp seeded(car_camera(), options);
    REQUIRE(seeded.solve(pairs).ok());
    CHECK(seeded.motion().minus(fresh.motion()).tail<3>().norm() < 2 * std::sqrt(fresh.covariance().diagonal().tail<3>().sum()));
  });
}

TEST_CASE("PnP: pairs agree or not by their smallest displacement") {
  for_all_seeds(50, [](Rng& rng) {
    const auto camera = car_camera();
    const CameraMotion truth = random_motion(rng);
    const Eigen::Vector3d p = random_point(rng, camera, 25);
    const PixelPair exact = seen_twice(rng, camera, truth, p, 0);
    const Pnp pnp(camera);
    CHECK(pnp.distance_px(exact, truth) < 1e-9);
    const Eigen::Vector3d a = random_vector<3>(rng, 0.02), b = random_vector<3>(rng, 0.02);
    const PixelPair displaced{exact.previous_px + a, exact.current_px + b};
    CHECK(pnp.distance_px(displaced, truth) <=
          std::sqrt(a.squaredNorm() + b.squaredNorm()) * 1.02);  // some displacement exists: the smallest is no larger
    const PixelPair far_off{exact.previous_px, exact.current_px + Eigen::Vector3d{0, 0, 50}};
    CHECK(pnp.distance_px(far_off, truth) > 5);
  });
}

TEST_CASE("PnP: what cannot give a motion is refused with its reason") {
  Rng rng{3};
  const auto camera = car_camera();
  const CameraMotion truth = random_motion(rng);
  Pnp pnp(camera);
  CHECK(pnp.solve(Pairs{}).code == StatusCode::too_few);
  CHECK(pnp.solve(street(rng, truth, 14, 0, 0.1)).code == StatusCode::too_few);

  Pairs chaos = street(rng, truth, 0, 100, 0.3);
  const Status nothing_agrees = pnp.solve(chaos);
  CHECK(nothing_agrees.code == StatusCode::rejected);
  CHECK(nothing_agrees.index < 15);
  CHECK(pnp.statistics().iterations == 200);
  for (std::size_t i = 0; i < chaos.size(); ++i) CHECK_FALSE(pnp.is_inlier(i));
  CHECK(same(pnp.motion(), CameraMotion{}));

  Pairs line;
  for (int i = 0; i < 40; ++i)
    (void)line.push_back(seen_twice(rng, camera, truth, Eigen::Vector3d{0, 1, 5} + 0.3 * i * Eigen::Vector3d{0.1, 0.02, 1}, 0));
  CHECK(pnp.solve(line).code == StatusCode::under_determined);

  Pairs repeated;
  const PixelPair one = seen_twice(rng, camera, truth, {1, 1, 10}, 0.3);
  for (int i = 0; i < 40; ++i) (void)repeated.push_back(one);
  CHECK(pnp.solve(repeated).code == StatusCode::under_determined);
  CHECK(pnp.statistics().degenerate == 200);
}

TEST_CASE("PnP: negative disparity, NaN and far points among the pairs are left out, the rest is solved") {
  Rng rng{4};
  const CameraMotion truth = random_motion(rng);
  Pairs pairs = street(rng, truth, 40, 0, 0.2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  pairs[0].previous_px[1] = pairs[0].previous_px[0] + 5;
  pairs[1].current_px[1] = pairs[1].current_px[0] + 5;
  pairs[2].previous_px[0] = nan;
  pairs[3].current_px[2] = nan;
  pairs[4].previous_px[1] = pairs[4].previous_px[0] - 0.1;  // kilometres away
  Pnp pnp(car_camera());
  REQUIRE(pnp.solve(pairs).ok());
  CHECK(pnp.statistics().usable == 35);
  for (std::size_t i = 0; i < 5; ++i) CHECK_FALSE(pnp.is_inlier(i));
  CHECK(pnp.motion().minus(truth).tail<3>().norm() < 0.05);
  CHECK(std::isinf(pnp.distance_px(pairs[1], truth)));
}

TEST_CASE("PnP: options out of their domain are refused") {
  const Pairs pairs;
  const auto refused = [&](auto change) {
    PnpOptions options;
    change(options);
    Pnp pnp(car_camera(), options);
    return pnp.solve(pairs).code == StatusCode::invalid_argument;
  };
  CHECK_FALSE(refused([](PnpOptions&) {}));
  CHECK(refused([](PnpOptions& o) { o.inlier_px = 0; }));
  CHECK(refused([](PnpOptions& o) { o.sigma_px = -1; }));
  CHECK(refused([](PnpOptions& o) { o.huber = std::numeric_limits<double>::quiet_NaN(); }));
  CHECK(refused([](PnpOptions& o) { o.confidence = 1; }));
  CHECK(refused([](PnpOptions& o) { o.max_iterations = 0; }));
  CHECK(refused([](PnpOptions& o) { o.min_inliers = 2; }));
  Pnp blind{vision::StereoCamera<double>{}};
  CHECK(blind.solve(pairs).code == StatusCode::invalid_argument);
}
