// SPDX-License-Identifier: BSD-3-Clause
// The tracker under a made-up sky: convergence, streets, outages, contradiction and restart, order of epochs.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <optional>

#include <searvins/gnss/single_point_tracker.hpp>

#include "simulated_sky.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using Eigen::Vector3d;
using test::for_all_seeds;
using test::integer;
using test::Rng;
using test::uniform;

namespace {

/// A uniform drive under a made-up sky; the solver's atmosphere is added to the codes.
struct Drive {
  test::SimulatedSky sky;
  test::SimulatedReceiver receiver;

  explicit Drive(Rng& rng) {
    receiver.t0 = GpsTime::from_week_sow(2300, integer(rng, 4000, 600'000));
    receiver.p0_e_m = test::random_place(rng);
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(receiver.p0_e_m));
    receiver.v_e_mps = R_ew * Vector3d{uniform(rng, -15, 15), uniform(rng, -15, 15), 0};
    receiver.clock_s = uniform(rng, -0.005, 0.005), receiver.drift_sps = uniform(rng, -1e-7, 1e-7);
    receiver.signals = {test::signal("G1C"), test::signal("E1C"), test::signal("C2I")};
    sky = test::random_sky(rng, receiver.t0, receiver.p0_e_m, {6, 5, 5});
  }
  [[nodiscard]] Vector3d position(double t) const { return receiver.p0_e_m + t * receiver.v_e_mps; }

  [[nodiscard]] ObservationEpoch epoch(Rng& rng, double t, double noise_m = 0.5) const {
    ObservationEpoch e = test::simulate(sky, receiver, t);
    const geodesy::Geodetic g = geodesy::geodetic_from_ecef(position(t));
    for (SatelliteObservation& s : e.satellites)
      for (SignalObservation& o : s.signals) {
        const auto sent = transmission_from_code(sky.store, s.satellite, e.tag, o.code_m);
        const auto line = geodesy::azimuth_elevation(position(t), sent->state.position_e_m);
        o.code_m +=
            troposphere_delay_m(g, line.elevation_rad) + klobuchar_delay_m(kTypicalIonosphere, g, line, sent->time, frequency_hz(o.signal));
        o.code_m += test::normal(rng, noise_m);
      }
    return e;
  }
};

}  // namespace

TEST_CASE("tracker: follows position and velocity, and does not mind millisecond jumps of the receiver clock") {
  for_all_seeds(10, [](Rng& rng) {
    Drive drive{rng};
    SinglePointTracker tracker;
    for (int k = 0; k < 30; ++k) {
      if (k == 15) drive.receiver.clock_s += 0.001;
      const auto now = tracker.update(drive.epoch(rng, k), drive.sky.store);
      REQUIRE(now);
      CHECK(now->status == (k == 0 ? TrackStatus::started : TrackStatus::tracked));
      CHECK(std::abs(seconds_between(drive.receiver.t0.plus_seconds(k), now->time)) < 1e-7);
      if (k < 5) continue;
      CHECK((now->position_e_m - drive.position(k)).norm() < 4);
      CHECK((now->velocity_e_mps - drive.receiver.v_e_mps).norm() < 0.3);
      CHECK(now->doppler_used);
    }
  });
}

TEST_CASE("tracker: through a street where most codes are late, on Doppler and the few good ones") {
  int far = 0, drives = 0;
  for_all_seeds(20, [&](Rng& rng) {
    const Drive drive{rng};
    SinglePointTracker tracker;
    double worst_m = 0;
    for (int k = 0; k < 40; ++k) {
      ObservationEpoch e = drive.epoch(rng, k);
      if (k >= 15)  // ten of sixteen satellites seen by reflection, each with its own constant delay
        for (std::size_t i = 0; i < 10; ++i)
          for (SignalObservation& o : e.satellites[i].signals) o.code_m += 30 + 12 * static_cast<double>(i), o.cn0_dbhz = 38;
      const auto now = tracker.update(e, drive.sky.store);
      REQUIRE(now);
      if (k >= 15) worst_m = std::max(worst_m, (now->position_e_m - drive.position(k)).norm());
    }
    far += worst_m > 10;
    ++drives;
  });
  MESSAGE(far << " of " << drives << " drives strayed by more than 10 m");
  CHECK(far * 10 <= drives);
}

TEST_CASE("tracker: coasts through an outage with growing covariance, forgets after max_gap_s") {
  Rng rng{4};
  const Drive drive{rng};
  TrackerOptions options;
  options.max_gap_s = 10;
  SinglePointTracker tracker{options};
  for (int k = 0; k < 20; ++k) REQUIRE(tracker.update(drive.epoch(rng, k), drive.sky.store));
  double before_m2 = 0;
  for (int k = 20; k < 30; ++k) {
    ObservationEpoch e = drive.epoch(rng, k);
    e.satellites.clear();
    const auto now = tracker.update(e, drive.sky.store);
    REQUIRE(now);
    CHECK(now->status == TrackStatus::coasted);
    CHECK(now->position_covariance_m2.trace() > before_m2);
    before_m2 = now->position_covariance_m2.trace();
    CHECK((now->position_e_m - drive.position(k)).norm() < 6);
    CHECK(std::abs(seconds_between(drive.receiver.t0.plus_seconds(k), now->time)) < 1e-5);
  }
  ObservationEpoch e = drive.epoch(rng, 30);
  e.satellites.clear();
  CHECK(tracker.update(e, drive.sky.store).status().code == StatusCode::stale);
  CHECK_FALSE(tracker.running());
  CHECK(tracker.update(drive.epoch(rng, 31), drive.sky.store)->status == TrackStatus::started);
}

TEST_CASE("tracker: a gap longer than max_gap_s starts anew, a shorter one does not") {
  Rng rng{6};
  const Drive drive{rng};
  SinglePointTracker tracker;
  REQUIRE(tracker.update(drive.epoch(rng, 0), drive.sky.store));
  CHECK(tracker.update(drive.epoch(rng, 20), drive.sky.store)->status == TrackStatus::tracked);
  CHECK(tracker.update(drive.epoch(rng, 60), drive.sky.store)->status == TrackStatus::started);
}

TEST_CASE("tracker: when the receiver is suddenly elsewhere it says so, and follows within the stated number of epochs") {
  for_all_seeds(10, [](Rng& rng) {
    Drive drive{rng};
    SinglePointTracker tracker;
    int k = 0;
    for (; k < 20; ++k) REQUIRE(tracker.update(drive.epoch(rng, k), drive.sky.store));
    drive.receiver.p0_e_m += test::random_vector<3>(rng, 1).normalized() * uniform(rng, 200, 5000);
    for (int n = 1; n <= TrackerOptions{}.doubts_until_restart; ++n, ++k) {
      const auto now = tracker.update(drive.epoch(rng, k), drive.sky.store);
      REQUIRE(now);
      CHECK(now->status == (n < TrackerOptions{}.doubts_until_restart ? TrackStatus::doubtful : TrackStatus::restarted));
    }
    const auto now = tracker.update(drive.epoch(rng, k), drive.sky.store);
    CHECK(now->status == TrackStatus::tracked);
    CHECK((now->position_e_m - drive.position(k)).norm() < 6);
  });
}

TEST_CASE("tracker: epochs out of order change nothing; reruns are bit-identical; reset forgets") {
  Rng rng{8};
  const Drive drive{rng};
  SinglePointTracker first, second;
  TrackedPosition b;  // filled again and again
  for (int k = 0; k < 14; ++k) {
    ObservationEpoch e = drive.epoch(rng, k);
    if (k == 10 || k == 11) e.satellites.clear();  // coasts
    const auto a = first.update(e, drive.sky.store);
    CHECK(first.update(e, drive.sky.store).status().code == StatusCode::out_of_order);
    REQUIRE(second.update(e, drive.sky.store, b));
    REQUIRE(a);
    CHECK(a->position_e_m == b.position_e_m);
    CHECK(a->position_covariance_m2 == b.position_covariance_m2);
    CHECK(a->velocity_e_mps == b.velocity_e_mps);
    CHECK(a->time == b.time);
    CHECK(a->status == b.status);
    CHECK(a->doppler_used == b.doppler_used);
    CHECK(a->single_point.used == b.single_point.used);
    CHECK(a->single_point.rows.size() == b.single_point.rows.size());
    CHECK(b.single_point.rows.empty() == e.satellites.empty());
  }
  CHECK(second.update(drive.epoch(rng, 3), drive.sky.store, b).code == StatusCode::out_of_order);
  CHECK(b.single_point.rows.empty());
  CHECK(b.position_e_m == Vector3d::Zero());
  CHECK(first.update({}, drive.sky.store).status().code == StatusCode::out_of_order);
  first.reset();
  CHECK_FALSE(first.running());
  CHECK(first.update(ObservationEpoch{}, drive.sky.store).status().code == StatusCode::no_data);
  CHECK(first.update(drive.epoch(rng, 0), drive.sky.store)->status == TrackStatus::started);
}
