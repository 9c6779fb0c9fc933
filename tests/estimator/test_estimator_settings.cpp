// SPDX-License-Identifier: BSD-3-Clause
// P12 every settings field of the inertial estimator changes some output of a drive that has something for each of them; and none of its steps allocates.
#include <algorithm>
#include <vector>

#include "estimator/inertial_drive.hpp"
#include "support/allocation_count.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::EstimatorOptions;

namespace {

EstimatorOptions few_signals(const InertialDrive& d) {
  EstimatorOptions o = options_for(d);
  for (const char* name : {"G1C", "E1C"}) {
    gnss::SignalCode code;
    REQUIRE(gnss::signal_from_text(name, 3, code));
    (void)o.rtk.differencing.selection.wanted.push_back(code);
  }
  return o;
}

/// A light drive with lost readings (a short and a long gap), a silent rover, late rover epochs, and codes that disagree for half a minute.
struct Eventful {
  InertialDrive drive{simulated_inertial_drive("light", 95, 3)};
  std::vector<Arrival> all{};

  Eventful() {
    Rng rng{5};
    for (gnss::ObservationEpoch& epoch : drive.rover) {
      const double t = drive.seconds(epoch.tag);
      if (t < 60.5 || t > 85.5) continue;
      for (auto& satellite : epoch.satellites)
        for (auto& s : satellite.signals) s.code_m += uniform(rng, -60, 60);
    }
    all = arrivals(drive);
    for (Arrival& a : all)
      if (a.stream == Stream::rover && a.index % 4 == 0) a.at = a.at.plus_seconds(0.1);
    std::stable_sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) { return a.at < b.at; });
    cut(all, drive, Stream::imu, 12.2, 12.5);
    cut(all, drive, Stream::imu, 33.2, 33.5);
    cut(all, drive, Stream::rover, 40.5, 45.5);
  }
  [[nodiscard]] std::vector<double> outputs(const EstimatorOptions& options) const { return numbers_of(run_all(drive, all, options)); }
};

struct Flip {
  const char* name;
  void (*change)(EstimatorOptions&);
};

const Flip kFlips[] = {
    {"rtk.lag_s", [](EstimatorOptions& o) { o.rtk.lag_s = 3; }},
    {"latency_s", [](EstimatorOptions& o) { o.latency_s = 0.05; }},
    {"silence_s", [](EstimatorOptions& o) { o.silence_s = 0.5; }},
    {"restarts_to_realign", [](EstimatorOptions& o) { o.restarts_to_realign = 0; }},
    {"initializer.min_rest_s", [](EstimatorOptions& o) { o.initializer.min_rest_s = 15; }},
    {"initializer.min_speed_mps", [](EstimatorOptions& o) { o.initializer.min_speed_mps = 6; }},
    {"initializer.max_heading_sigma_rad", [](EstimatorOptions& o) { o.initializer.max_heading_sigma_rad = 0.02; }},
    {"inertial.lever_arm_b_m", [](EstimatorOptions& o) { o.inertial.lever_arm_b_m.x() += 0.1; }},
    {"inertial.detector.accel_idle_mps2",
     [](EstimatorOptions& o) {
       o.inertial.detector.accel_idle_mps2 = o.inertial.detector.gyro_idle_radps = 0, o.inertial.detector.noise_factor = 0.1;
     }},
    {"inertial.zero_velocity", [](EstimatorOptions& o) { o.inertial.zero_velocity = false; }},
    {"inertial.zero_angular_rate", [](EstimatorOptions& o) { o.inertial.zero_angular_rate = false; }},
    {"inertial.zero_velocity_sigma_mps", [](EstimatorOptions& o) { o.inertial.zero_velocity_sigma_mps = 0.3; }},
    {"inertial.zero_rate_sigma_radps", [](EstimatorOptions& o) { o.inertial.zero_rate_sigma_radps = 0.1; }},
    {"inertial.non_holonomic", [](EstimatorOptions& o) { o.inertial.non_holonomic = true; }},
    {"inertial.max_fix_jump_statistic", [](EstimatorOptions& o) { o.inertial.max_fix_jump_statistic = 1e-4; }},
    {"inertial.preintegration.kind", [](EstimatorOptions& o) { o.inertial.preintegration.kind = imu::SampleKind::mean_to_stamp; }},
    {"inertial.preintegration.max_gap_s", [](EstimatorOptions& o) { o.inertial.preintegration.max_gap_s = 0.25; }},
    {"inertial.preintegration.bridged_after_s", [](EstimatorOptions& o) { o.inertial.preintegration.bridged_after_s = 0.4; }},
    {"inertial.preintegration.bridge_accel_sigma_mps2",
     [](EstimatorOptions& o) { o.inertial.preintegration.bridge_accel_sigma_mps2 = 10; }},
    {"inertial.preintegration.bridge_gyro_sigma_radps", [](EstimatorOptions& o) { o.inertial.preintegration.bridge_gyro_sigma_radps = 1; }},
    {"inertial.preintegration.noise.accel_noise",
     [](EstimatorOptions& o) { o.inertial.preintegration.noise.accel_noise_mps2_sqrt_hz *= 2; }},
    {"inertial.preintegration.noise.gyro_noise",
     [](EstimatorOptions& o) { o.inertial.preintegration.noise.gyro_noise_radps_sqrt_hz *= 2; }},
    {"inertial.preintegration.noise.accel_bias_walk",
     [](EstimatorOptions& o) { o.inertial.preintegration.noise.accel_bias_walk_mps3_sqrt_hz *= 5; }},
    {"inertial.preintegration.noise.gyro_bias_walk",
     [](EstimatorOptions& o) { o.inertial.preintegration.noise.gyro_bias_walk_radps2_sqrt_hz *= 5; }},
    {"inertial.preintegration.noise.accel_bias_sigma",
     [](EstimatorOptions& o) { o.inertial.preintegration.noise.accel_bias_sigma_mps2 *= 3; }},
};

/// Flips that count only together with another setting.
const Flip kWheels[] = {
    {"inertial.axle_b_m",
     [](EstimatorOptions& o) {
       o.inertial.axle_b_m = {0, 1, 0};
     }},
    {"inertial.non_holonomic_sigma_mps", [](EstimatorOptions& o) { o.inertial.non_holonomic_sigma_mps = 0.01; }},
    {"inertial.non_holonomic_from_mps", [](EstimatorOptions& o) { o.inertial.non_holonomic_from_mps = 9; }},
};
const Flip kWithoutBase[] = {
    {"rtk.use_undifferenced", [](EstimatorOptions& o) { o.rtk.use_undifferenced = false; }},
    {"rtk.undifferenced_correlation_s", [](EstimatorOptions& o) { o.rtk.undifferenced_correlation_s = 5; }},
};
const Flip kRestSpeeds[] = {
    {"inertial.max_rest_speed_sigmas", [](EstimatorOptions& o) { o.inertial.max_rest_speed_sigmas = 0; }},
    {"inertial.max_rest_speed_mps", [](EstimatorOptions& o) { o.inertial.max_rest_speed_mps = 0.3; }},
};
const Flip kRestarts[] = {{"realign_within_s", [](EstimatorOptions& o) { o.realign_within_s = 0.5; }}};
const Flip kMovingStart[] = {{"inertial.preintegration.noise.gyro_bias_sigma",
                              [](EstimatorOptions& o) { o.inertial.preintegration.noise.gyro_bias_sigma_radps *= 3; }}};
const Flip kJumps[] = {{"inertial.fix_jump_floor_m", [](EstimatorOptions& o) { o.inertial.fix_jump_floor_m = 10; }}};

const Flip kAnchors[] = {
    {"inertial.position_anchor", [](EstimatorOptions& o) { o.inertial.position_anchor = false; }},
    {"inertial.anchor_sigma_m", [](EstimatorOptions& o) { o.inertial.anchor_sigma_m = 0.2; }},
    {"inertial.anchor_prior_scale", [](EstimatorOptions& o) { o.inertial.anchor_prior_scale = 1; }},
    {"inertial.anchor_floor_m", [](EstimatorOptions& o) { o.inertial.anchor_floor_m = 1; }},
};

const Flip kPredictedMotion[] = {
    {"rtk.differencing.slips.predicted_motion", [](EstimatorOptions& o) { o.rtk.differencing.slips.predicted_motion = true; }}};
const Flip kLanes[] = {
    {"inertial.lane_way_m", [](EstimatorOptions& o) { o.inertial.lane_way_m = 10; }},
    {"inertial.lanes.sigma_m", [](EstimatorOptions& o) { o.inertial.lanes.sigma_m = 2; }},
    {"inertial.lanes.gate_sigmas", [](EstimatorOptions& o) { o.inertial.lanes.gate_sigmas = 0.01; }},
    {"inertial.lanes.max_direction_rad", [](EstimatorOptions& o) { o.inertial.lanes.max_direction_rad = 1e-3; }},
    {"inertial.lanes.both_ways", [](EstimatorOptions& o) { o.inertial.lanes.both_ways = false; }},
    {"inertial.lanes.min_speed_mps", [](EstimatorOptions& o) { o.inertial.lanes.min_speed_mps = 9; }},
    {"inertial.lanes.max_bend_m", [](EstimatorOptions& o) { o.inertial.lanes.max_bend_m = 1e-3; }},
};

template <std::size_t N>
void check_flips(const Eventful& e, const EstimatorOptions& reference, const Flip (&flips)[N]) {
  const std::vector<double> before = e.outputs(reference);
  for (const Flip& flip : flips) {
    EstimatorOptions options = reference;
    flip.change(options);
    const std::string name = flip.name;
    CAPTURE(name);
    const bool changed = e.outputs(options) != before;
    CHECK(changed);
  }
}

}  // namespace

TEST_CASE("P12 every settings field of the inertial estimator changes some output") {
  const Eventful e;
  EstimatorOptions options = few_signals(e.drive);
  check_flips(e, options, kFlips);
  EstimatorOptions wheels = options, rests = options, jumps = options, impatient = options;
  wheels.inertial.non_holonomic = true;
  check_flips(e, wheels, kWheels);
  Eventful rover_only;
  cut(rover_only.all, rover_only.drive, Stream::base, -10);
  check_flips(rover_only, options, kWithoutBase);
  rests.inertial.max_rest_speed_mps = 0;
  check_flips(e, rests, kRestSpeeds);
  impatient.rtk.min_suspect_epochs = 1;  // windows are given up often
  check_flips(e, impatient, kRestarts);
  Eventful moving;  // no rest that measures the gyroscope's bias
  cut(moving.all, moving.drive, Stream::imu, -10, 25);
  check_flips(moving, options, kMovingStart);
  jumps.inertial.max_fix_jump_statistic = 1e-4;
  check_flips(e, jumps, kJumps);
  EstimatorOptions floating = options;  // integers would make the anchor needless
  floating.rtk.resolution.mode = ambiguity::ResolutionMode::off;
  check_flips(e, floating, kAnchors);
  Eventful few;  // four satellites of one frequency, and no Doppler shift to tell how they moved
  for (gnss::ObservationEpoch& epoch : few.drive.rover)
    if (few.drive.seconds(epoch.tag) > 46 && few.drive.seconds(epoch.tag) < 60)
      epoch.satellites.resize(std::min<std::size_t>(epoch.satellites.size(), 4));
  EstimatorOptions blind = options;
  blind.rtk.differencing.slips.doppler = false;
  check_flips(few, blind, kPredictedMotion);
  Eventful on_map;
  on_map.drive.lanes = lane_of(on_map.drive);
  std::reverse(on_map.drive.lanes.begin(), on_map.drive.lanes.end());  // against the traffic
  check_flips(on_map, floating, kLanes);
}

TEST_CASE("a minute of readings and epochs, GNSS alone, aligned, bridged and aligned anew, without one heap allocation") {
  const InertialDrive d = simulated_inertial_drive("light", 60, 2);
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::rover, 40.5, 45.5);
  cut(all, d, Stream::imu, 50, 52);
  InertialUnderTest e = estimator_for(d, few_signals(d));
  const auto alive = heap_allocations();
  CHECK(std::vector<double>(100, 1.0).size() == 100);
  CHECK(heap_allocations() > alive);  // the counter counts
  const auto before = heap_allocations();
  int solutions = 0, aligned = 0;
  for (const Arrival& a : all) {
    (void)hand_over(e, d, a);
    for (auto s = e.next(); s.ok(); s = e.next()) ++solutions, aligned += s->has_attitude ? 1 : 0;
    (void)e.predict(a.at);
  }
  const auto allocations = heap_allocations() - before;
  CHECK(allocations == 0);
  CHECK(solutions >= 59);
  CHECK(aligned > 20);
}
