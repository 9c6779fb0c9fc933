// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include <searvins/stationary/detector.hpp>

#include "tests/support/property.hpp"

using namespace searvins;
using imu::ImuSample;
using stationary::Detector;
using test::for_all_seeds;
using test::normal;
using test::Rng;
using test::uniform;

namespace {

/// A unit at 100 Hz on a vehicle: white noise, an idling engine, a road, and what the vehicle itself does.
struct Bench {
  Rng& rng;
  imu::ImuNoise noise{};
  Eigen::Vector3d gyro_bias{0.003, -0.002, 0.001};
  double idle_mps2{0}, road_mps2{0}, road_radps{0};  ///< amplitudes
  GpsTime time{1'000'000'000'000};

  ImuSample next(const Eigen::Vector3d& accel = Eigen::Vector3d::Zero(), const Eigen::Vector3d& rate = Eigen::Vector3d::Zero()) {
    time.ns += 10'000'000;
    const double t = static_cast<double>(time.ns % 1'000'000'000'000) * 1e-9;
    ImuSample s{time, gyro_bias + rate, Eigen::Vector3d{0.1, -0.05, 9.82} + accel};
    for (int k = 0; k < 3; ++k) {
      s.gyro_b_radps[k] += normal(rng, noise.gyro_noise_radps_sqrt_hz * 10);
      s.accel_b_mps2[k] += normal(rng, noise.accel_noise_mps2_sqrt_hz * 10);
      s.accel_b_mps2[k] += idle_mps2 * std::sin(2 * std::numbers::pi * 27.3 * t + k);
      for (const double hz : {1.3, 2.7, 5.1}) {
        s.accel_b_mps2[k] += road_mps2 * std::sin(2 * std::numbers::pi * hz * t + k * hz);
        s.gyro_b_radps[k] += road_radps * std::sin(2 * std::numbers::pi * hz * t + 2 * k * hz);
      }
    }
    return s;
  }
  /// Share of `seconds` in which the detector says rest.
  double share(Detector& detector, double seconds, const Eigen::Vector3d& accel = Eigen::Vector3d::Zero()) {
    int rest = 0;
    const int n = static_cast<int>(seconds * 100);
    for (int i = 0; i < n; ++i) {
      CHECK(detector.add(next(accel)).ok());
      rest += detector.stationary() ? 1 : 0;
    }
    return static_cast<double>(rest) / n;
  }
};

}  // namespace

TEST_CASE("detector: property: a rest is found within 1.1 s and kept, with noise of any size and an idling engine") {
  for_all_seeds(20, [](Rng& rng) {
    Bench bench{rng};
    bench.noise.accel_noise_mps2_sqrt_hz = uniform(rng, 2e-4, 2e-2);
    bench.noise.gyro_noise_radps_sqrt_hz = uniform(rng, 2e-5, 1e-3);
    bench.idle_mps2 = uniform(rng, 0, 0.2);
    Detector detector{bench.noise};
    (void)bench.share(detector, 1.1);
    CHECK(detector.stationary());
    CHECK(bench.share(detector, 60) == 1.0);
    CHECK(detector.rest_s() == doctest::Approx(61.1).epsilon(0.01));
    CHECK((detector.mean_gyro_b_radps() - bench.gyro_bias).norm() < 10 * bench.noise.gyro_noise_radps_sqrt_hz);
  });
}

TEST_CASE("detector: property: a drive on a road is no rest, pulling away ends one in 0.3 s, stopping begins one") {
  for_all_seeds(20, [](Rng& rng) {
    Bench bench{rng};
    bench.idle_mps2 = 0.1;
    Detector detector{bench.noise};
    const double road_mps2 = uniform(rng, 0.15, 0.6), road_radps = uniform(rng, 0.008, 0.04);
    for (int leg = 0; leg < 3; ++leg) {
      bench.road_mps2 = bench.road_radps = 0;
      (void)bench.share(detector, 1.5);
      CHECK(bench.share(detector, 10) == 1.0);
      (void)bench.share(detector, 0.3, {0, uniform(rng, 0.8, 2.5), 0});  // pulling away
      CHECK_FALSE(detector.stationary());
      bench.road_mps2 = road_mps2, bench.road_radps = road_radps;
      CHECK(bench.share(detector, 20) == 0.0);
    }
  });
}

TEST_CASE("detector: a constant turn is no rest once the bias is known") {
  Rng rng{1};
  Bench bench{rng};
  Detector detector{bench.noise};
  detector.set_gyro_bias(bench.gyro_bias);
  CHECK(bench.share(detector, 1.2) > 0);
  for (int i = 0; i < 300; ++i) CHECK(detector.add(bench.next(Eigen::Vector3d::Zero(), {0, 0, 0.03})).ok());
  CHECK_FALSE(detector.stationary());
}

TEST_CASE("detector: a speed hint vetoes a smooth ride, and teaches how still a confirmed rest is") {
  Rng rng{2};
  Bench bench{rng};
  Detector detector{bench.noise};
  CHECK(bench.share(detector, 2) > 0.4);
  detector.set_speed_hint(bench.time, 5, 0.5);  // a smooth ride at 5 m/s
  CHECK_FALSE(detector.stationary());
  CHECK(bench.share(detector, 1.4) == 0.0);
  CHECK(bench.share(detector, 2) > 0.5);  // the hint has expired, nothing shakes: the detector cannot know
  detector.set_speed_hint(bench.time, 0.5, 2.0);  // too vague to veto
  CHECK(detector.stationary());
  detector.set_speed_hint(bench.time, std::nan(""), 0.1);
  CHECK(detector.stationary());

  const double before = detector.accel_threshold_mps2();
  for (int i = 0; i < 20; ++i) {
    detector.set_speed_hint(bench.time, 0.02, 0.05);
    (void)bench.share(detector, 0.5);
  }
  CHECK(detector.accel_threshold_mps2() < 0.5 * before);
  CHECK(detector.stationary());
  bench.road_mps2 = 0.04;  // a smooth road that would have passed for an idling engine
  (void)bench.share(detector, 2.5);
  CHECK(bench.share(detector, 5) == 0.0);
}

TEST_CASE("detector: gaps and bad samples") {
  Rng rng{3};
  Bench bench{rng};
  Detector detector{bench.noise};
  (void)bench.share(detector, 2);
  CHECK(detector.stationary());
  ImuSample nan = bench.next();
  nan.accel_b_mps2.x() = std::nan("");
  CHECK(detector.add(nan).code == StatusCode::non_finite);
  const ImuSample good = bench.next();
  CHECK(detector.add(good).ok());
  CHECK(detector.add(good).code == StatusCode::duplicate);
  CHECK(detector.add({GpsTime{good.time.ns - 1}, good.gyro_b_radps, good.accel_b_mps2}).code == StatusCode::out_of_order);
  CHECK(detector.stationary());
  bench.time.ns += 400'000'000;
  CHECK(detector.add(bench.next()).ok());
  CHECK_FALSE(detector.stationary());
  CHECK_FALSE(detector.window_full());
}
