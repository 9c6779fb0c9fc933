// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/motion_consistency.hpp>

#include <cmath>
#include <limits>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using namespace searvins::vision;

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
constexpr double kDegree = 0.017453292519943295;

CameraMotion forward(double way_m, double turn_rad = 0) { return {so3::exp(Eigen::Vector3d{0, turn_rad, 0}), {0, 0, way_m}}; }

FrameDecision verdict(const CameraMotion& seen, const CameraMotion& predicted, const ConsistencyOptions& options = {}) {
  return decide(difference(seen, Matrix6::Zero(), {predicted, Matrix6::Zero()}, options), options);
}

}  // namespace

TEST_CASE("motion and prediction: full, reuse only, reject, on both sides of every bound") {
  const CameraMotion slow = forward(0.5);  // 10 % is 0.05 m, so 0.15 m holds
  CHECK(verdict(forward(0.649), slow) == FrameDecision::full);
  CHECK(verdict(forward(0.651), slow) == FrameDecision::reuse_only);
  CHECK(verdict(forward(0.799), slow) == FrameDecision::reuse_only);
  CHECK(verdict(forward(0.801), slow) == FrameDecision::reject);
  const CameraMotion fast = forward(3);  // 10 % is 0.3 m
  CHECK(verdict(forward(3.299), fast) == FrameDecision::full);
  CHECK(verdict(forward(3.301), fast) == FrameDecision::reuse_only);
  CHECK(verdict(forward(3.601), fast) == FrameDecision::reject);
  CHECK(verdict(forward(0.5, 0.99 * kDegree), slow) == FrameDecision::full);
  CHECK(verdict(forward(0.5, 1.01 * kDegree), slow) == FrameDecision::reuse_only);
  CHECK(verdict(forward(0.5, 2.01 * kDegree), slow) == FrameDecision::reject);
  CHECK(verdict(forward(std::numeric_limits<double>::quiet_NaN()), slow) == FrameDecision::reject);
  CHECK(verdict(slow, forward(std::numeric_limits<double>::quiet_NaN())) == FrameDecision::reject);
}

TEST_CASE("motion and prediction: what neither of them knows is allowed for when asked") {
  ConsistencyOptions options;
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal().tail<3>().setConstant(0.01);  // 0.1 m an axis, 0.17 m in all
  const PredictedMotion predicted{forward(1), covariance};
  CHECK(decide(difference(forward(1.7), covariance, predicted, options), options) == FrameDecision::reject);
  options.noise_sigmas = 3;
  CHECK(decide(difference(forward(1.7), covariance, predicted, options), options) == FrameDecision::full);
  CHECK(difference(forward(1.7), covariance, predicted, options).way_bound_m == doctest::Approx(0.15 + 3 * std::sqrt(0.06)));
}

TEST_CASE("motion and prediction: where the same motion is seen, the difference vanishes; it does not depend on who comes first") {
  for_all_seeds(50, [](Rng& rng) {
    const CameraMotion a{so3::exp(random_vector<3>(rng, 1)), random_vector<3>(rng, 2)},
        b{so3::exp(random_vector<3>(rng, 1)), random_vector<3>(rng, 2)};
    const MotionDifference none = difference(a, Matrix6::Zero(), {a, Matrix6::Zero()}),
                           ab = difference(a, Matrix6::Zero(), {b, Matrix6::Zero()}),
                           ba = difference(b, Matrix6::Zero(), {a, Matrix6::Zero()});
    CHECK(none.turn_rad < 1e-14);
    CHECK(none.way_m == 0);
    CHECK(ab.turn_rad == doctest::Approx(ba.turn_rad));
    CHECK(ab.way_m == doctest::Approx(ba.way_m));
  });
}

TEST_CASE("the sigma of a frame grows with misfit and with lack of support, within one and four") {
  const auto scale = [](std::size_t inliers, double rms_px, double sigma_px = 1) {
    PnpStatistics support;
    support.inliers = inliers, support.rms_px = rms_px;
    return sigma_scale(support, sigma_px);
  };
  CHECK(scale(60, 1) == 1);
  CHECK(scale(200, 0.3) == 1);
  CHECK(scale(15, 0.5) == 2);
  CHECK(scale(100, 2.5) == 2.5);
  CHECK(scale(100, 1.4, 0.7) == doctest::Approx(2));
  CHECK(scale(3, 1) == 4);
  CHECK(scale(0, 0) == 4);
  CHECK(scale(100, 50) == 4);
}
