// SPDX-License-Identifier: BSD-3-Clause
#include "inertial_drive.hpp"

#include <memory>
#include <numbers>

#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>

#include "examples/simulator/dataset.hpp"

namespace searvins::test {
namespace {

/// The simulator's stereo tracks and its camera.
void add_frames(const simulator::Simulation& drive, InertialDrive& d) {
  const simulator::StereoRig rig;
  vision::StereoCamera<double>& c = d.camera;
  c.fx_px = rig.fx_px, c.fy_px = rig.fy_px, c.cx_px = rig.cx_px, c.cy_px = rig.cy_px, c.baseline_m = rig.baseline_m;
  c.width_px = static_cast<int>(rig.width_px), c.height_px = static_cast<int>(rig.height_px);
  c.R_bc = rig.R_bc, c.p_bc_m = rig.t_bc_m;
  simulator::StereoCamera camera = drive.camera();
  for (int k = 0; k <= static_cast<int>(drive.options().duration_s * 10); ++k) {
    auto& frame = d.frames.emplace_back();
    frame.time = d.start.plus_seconds(k / 10.0);
    for (const simulator::TrackObservation& o : camera.frame(drive.at_exposure(k / 10.0))) {
      vision::StereoObservation seen;
      seen.track = static_cast<std::uint64_t>(o.track), seen.score = o.score;
      seen.pixel_px = {o.u_left_px, o.u_right_px, o.v_px};
      seen.semantic_class = static_cast<vision::SemanticClass>(o.semantic_class);
      frame.add(seen);
    }
  }
}

InertialDrive made(simulator::SimulationOptions options, const DriveRates& rates) {
  options.rover_rate_hz = rates.rover_hz, options.imu_rate_hz = rates.imu_hz;
  options.camera_offset_s = rates.camera_offset_s, options.camera_boresight_rad = rates.camera_boresight_rad;
  const double duration_s = options.duration_s;
  if (rates.kind == imu::SampleKind::mean_to_stamp) options.imu_sampling = simulator::ImuSampling::mean_to_stamp;
  const auto drive = std::make_shared<const simulator::Simulation>(options);
  InertialDrive d;
  d.start = options.start;
  simulator::CityReceiver rover = drive->rover(), base = drive->base();
  std::string rover_text = simulator::observation_header("ROVER", drive->vehicle().antenna_e_m(0), d.start, 1 / rates.rover_hz);
  std::string base_text = simulator::observation_header("BASE", drive->base_e_m(), d.start);
  for (int k = 0; k <= static_cast<int>(std::llround(duration_s * rates.rover_hz)); ++k)
    rover_text += simulator::observation_epoch(rover.measure(k / rates.rover_hz), d.start);
  for (int k = 0; k <= static_cast<int>(duration_s); ++k) base_text += simulator::observation_epoch(base.measure(k), d.start);
  d.rover = io::read_rinex_observation_text(rover_text).value.epochs;
  d.base = io::read_rinex_observation_text(base_text).value.epochs;
  const auto navigation = io::read_rinex_navigation_text(simulator::navigation_file(drive->records()));
  d.ephemerides = navigation.value.ephemerides, d.ionosphere = navigation.value.ionosphere;
  d.base_e_m = drive->base_e_m(), d.lever_arm_b_m = drive->vehicle().lever_arm_b_m();
  const simulator::ImuNoise& n = options.imu_noise;
  d.noise = {n.accel_noise_mps2_sqrt_hz,      n.gyro_noise_radps_sqrt_hz, n.accel_bias_walk_mps3_sqrt_hz,
             n.gyro_bias_walk_radps2_sqrt_hz, n.accel_bias_sigma_mps2,    n.gyro_bias_sigma_radps};
  d.kind = rates.kind;
  simulator::ImuSensor sensor = drive->imu();
  for (int k = -static_cast<int>(rates.imu_hz); k <= static_cast<int>((duration_s + 1) * rates.imu_hz); ++k) {
    const simulator::ImuTruth m = sensor.measure(drive->vehicle(), k / rates.imu_hz);
    d.imu.push_back({d.start.plus_seconds(k / rates.imu_hz), m.w_ib_b_radps, m.f_b_mps2});
  }
  if (rates.has_frames) add_frames(*drive, d);
  d.truth = [drive](GpsTime t) -> std::optional<DriveTruth> {
    const simulator::detail::TruthRow row = simulator::detail::truth_row(*drive, seconds_between(drive->options().start, t));
    return DriveTruth{row.antenna_e_m, row.R_enu_b};
  };
  return d;
}

}  // namespace

InertialDrive simulated_inertial_drive(const std::string& profile, double duration_s, std::uint64_t seed, const DriveRates& rates) {
  simulator::SimulationOptions options;
  options.profile = profile, options.duration_s = duration_s, options.seed = seed;
  return made(std::move(options), rates);
}

InertialDrive drive_that_stops(double stop_s, double duration_s, std::uint64_t seed) {
  simulator::SimulationOptions options;
  options.profile = "open", options.duration_s = duration_s, options.seed = seed;
  constexpr double kStartS = 10, kSpeedMps = 8, kRadiusM = 30, kRampS = 5;
  double way_m = 0;
  for (double t = -5; t <= duration_s + 5; t += 0.5) {
    const double speed = kSpeedMps * std::clamp((t - kStartS) / kRampS, 0.0, 1.0) * std::clamp((stop_s - t) / kRampS, 0.0, 1.0);
    way_m += 0.5 * speed;
    const double round = way_m / (2 * std::numbers::pi * kRadiusM), angle = 2 * std::numbers::pi * (round - std::floor(round));
    const double side = static_cast<int>(std::floor(round)) % 2 == 0 ? 1 : -1;
    options.route.push_back({t, {side * kRadiusM * (1 - std::cos(angle)), kRadiusM * std::sin(angle), 0}});
  }
  return made(std::move(options), {});
}

}  // namespace searvins::test
