// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/stop_cue.hpp>

#include <limits>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::vision;

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

CameraMotion forward(double way_m, double turn_rad = 0) { return {so3::exp(Eigen::Vector3d{0, turn_rad, 0}), {0, 0, way_m}}; }

}  // namespace

TEST_CASE("stop cue: five still frames in a row raise it, one other ends it") {
  const Matrix6 sharp = 1e-8 * Matrix6::Identity();
  StopCue cue;
  const auto still = [&] { return cue.add(forward(0.003), sharp, 0.2, 0.2, 0.1); };
  for (int i = 1; i <= 4; ++i) CHECK_FALSE(still());
  CHECK(still());
  CHECK(still());
  CHECK_FALSE(cue.add(forward(0.03), sharp, 0.2, 0.2, 0.1));
  for (int i = 1; i <= 4; ++i) CHECK_FALSE(still());
  CHECK(still());
  cue.reset();
  CHECK_FALSE(cue.up());
}

TEST_CASE("stop cue: way, turn and displacement count each; noise that explains them is allowed for; ignorance is no rest") {
  const Matrix6 sharp = 1e-8 * Matrix6::Identity();
  const auto up = [](const CameraMotion& motion, const Matrix6& covariance, double median_px, double rms_px) {
    StopCue cue;
    for (int i = 0; i < 5; ++i) (void)cue.add(motion, covariance, median_px, rms_px, 0.1);
    return cue.up();
  };
  CHECK(up(forward(0.019), sharp, 0.2, 0.2));
  CHECK_FALSE(up(forward(0.021), sharp, 0.2, 0.2));
  CHECK(up(forward(0, 0.00086), sharp, 0.2, 0.2));
  CHECK_FALSE(up(forward(0, 0.00089), sharp, 0.2, 0.2));
  CHECK(up(forward(0), sharp, 0.49, 0.2));
  CHECK_FALSE(up(forward(0), sharp, 0.51, 0.2));
  CHECK(up(forward(0), sharp, 1.3, 0.7));  // 1.67 * 0.7 is what noise alone shows
  const Matrix6 noisy = (Eigen::Matrix<double, 6, 1>() << 1e-7, 1e-7, 1e-7, 3e-4, 3e-4, 3e-4).finished().asDiagonal();
  CHECK(up(forward(0.05), noisy, 0.2, 0.7));
  CHECK_FALSE(up(forward(0.07), noisy, 0.2, 0.7));
  CHECK_FALSE(up(forward(0), 9 * noisy, 0.2, 0.7));  // sigma 0.09 m: who knows
  CHECK_FALSE(up(forward(std::numeric_limits<double>::quiet_NaN()), sharp, 0.2, 0.2));
}

TEST_CASE("stop cue: the bound on the way is one on speed for a fast camera") {
  const Matrix6 sharp = 1e-8 * Matrix6::Identity();
  for (const double rate_hz : {10.0, 20.0, 30.0, 60.0}) {
    const auto up_at = [&](double speed_mps) {
      StopCue cue;
      for (int i = 0; i < 5; ++i) (void)cue.add(forward(speed_mps / rate_hz), sharp, 0.2, 0.2, 1 / rate_hz);
      return cue.up();
    };
    CHECK(up_at(0.19));
    CHECK_FALSE(up_at(0.21));
  }
  StopCue slow;  // at two frames a second 2 cm count
  for (int i = 0; i < 5; ++i) (void)slow.add(forward(0.03), sharp, 0.2, 0.2, 0.5);
  CHECK_FALSE(slow.up());
}
