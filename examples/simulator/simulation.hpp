// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A whole simulated drive: vehicle, city, satellites, base station, from options and a seed. dataset.hpp turns it into files.
///
/// One seed gives one drive: every part draws from a stream of its own, so that another rate or another sampling of the IMU leaves the city
/// and the satellites alone.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>

#include "city.hpp"
#include "city_receiver.hpp"
#include "imu_sensor.hpp"
#include "orbit.hpp"
#include "random.hpp"
#include "stereo_camera.hpp"
#include "vehicle.hpp"

namespace searvins::simulator {

/// What the user may choose.
struct SimulationOptions {
  std::string profile{"texcup"};
  double duration_s{600};
  std::uint64_t seed{1};
  double rover_rate_hz{1}, imu_rate_hz{100}, camera_rate_hz{10};
  ImuSampling imu_sampling{ImuSampling::instantaneous};
  ImuNoise imu_noise{};
  double camera_offset_s{0};  ///< frames are exposed so much later than stamped
  Eigen::Vector3d camera_boresight_rad{Eigen::Vector3d::Zero()};  ///< the camera is turned against rig.json, about its axes right, down, forward
  GpsTime start = gps_from_civil({2025, 6, 11, 4, 20, 0});
  Eigen::Vector3d origin_e_m = geodesy::ecef_from_geodetic({48.1 * std::numbers::pi / 180, 11.5 * std::numbers::pi / 180, 560});
  std::vector<GivenPoint> route{};  ///< in the East-North-Up frame of the origin; empty: streets are generated
  std::vector<Orbit> orbits{};      ///< one record a satellite, times from `start`; empty: constellations are generated
};

/// The drive. Not copied: its parts refer to each other.
class Simulation {
 public:
  static constexpr double kRecordEveryS = 7200;

  /// The profile must be one that profile_named() knows; a given route needs two points.
  explicit Simulation(SimulationOptions options)
      : options_(std::move(options)),
        profile_(*profile_named(options_.profile, options_.duration_s)),
        frame_(geodesy::LocalFrame::at(options_.origin_e_m)),
        vehicle_(make_route(options_), frame_, Eigen::Vector3d{0.284, -0.517, 0.142}) {
    Random satellites = stream(2), city = stream(3), clock = stream(4), points = stream(5);
    orbits_ = options_.orbits.empty() ? make_satellites(options_.start, satellites) : options_.orbits;
    way_ = way_points(vehicle_, profile_, options_.duration_s + 1);
    city_ = CityBuilder(way_, profile_, city).build();
    landmarks_ = landmarks_of(city_, way_, points);
    base_e_m_ = frame_.to_ecef({-2400, 2700, 31});
    for (int i = 0; i < 3; ++i) base_e_m_[i] = std::round(base_e_m_[i] * 1e4) / 1e4;  // what the files say
    rover_clock_ = {clock.uniform(-3e-4, 3e-4), clock.uniform(-8e-8, 8e-8), 1e-9};
    base_clock_ = {clock.uniform(-5e-8, 5e-8), clock.uniform(-1e-11, 1e-11), 0};
  }
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  [[nodiscard]] const SimulationOptions& options() const { return options_; }
  [[nodiscard]] const Profile& profile() const { return profile_; }
  [[nodiscard]] const Vehicle& vehicle() const { return vehicle_; }
  [[nodiscard]] const City& city() const { return city_; }
  [[nodiscard]] const std::vector<Orbit>& orbits() const { return orbits_; }
  [[nodiscard]] const std::vector<WayPoint>& way() const { return way_; }
  [[nodiscard]] const Eigen::Vector3d& base_e_m() const { return base_e_m_; }
  [[nodiscard]] const Clock& rover_clock() const { return rover_clock_; }
  [[nodiscard]] const Clock& base_clock() const { return base_clock_; }

  [[nodiscard]] CityReceiver rover() const {
    CityReceiverPlan plan;
    plan.antenna_w_m = [this](double t_s) { return vehicle_.antenna_w_m(t_s); };
    plan.frame = frame_;
    plan.city = &city_;
    plan.district = [this](double t_s) { return district_on(way_, t_s); };
    plan.clock = rover_clock_;
    return {std::move(plan), orbits_, options_.seed * 1000 + 11};
  }
  [[nodiscard]] CityReceiver base() const {
    CityReceiverPlan plan;
    plan.antenna_w_m = [p = frame_.to_local(base_e_m_)](double) { return p; };
    plan.frame = frame_;
    plan.clock = base_clock_;
    plan.slips_by_chance = false;
    return {std::move(plan), orbits_, options_.seed * 1000 + 12};
  }
  [[nodiscard]] ImuSensor imu() const { return {options_.imu_noise, options_.imu_rate_hz, options_.imu_sampling, stream(6)}; }
  [[nodiscard]] StereoCamera camera() const { return {real_rig(), city_, landmarks_, stream(7)}; }
  /// The camera as it is mounted; rig.json describes StereoRig{}.
  [[nodiscard]] StereoRig real_rig() const {
    StereoRig rig;
    const Eigen::Vector3d& turn = options_.camera_boresight_rad;
    if (turn.norm() > 0) rig.R_bc = rig.R_bc * Eigen::AngleAxisd{turn.norm(), turn.normalized()}.toRotationMatrix();
    return rig;
  }
  /// The vehicle when the frame with the stamp `t_s` was exposed.
  [[nodiscard]] VehicleState at_exposure(double t_s) const { return vehicle_.state(t_s + options_.camera_offset_s); }

  /// The broadcast records of the satellites that are up at some time: one every two hours.
  [[nodiscard]] std::vector<Orbit> records() const {
    std::vector<Orbit> all;
    for (const Orbit& orbit : orbits_) {
      bool up = false;
      for (double t = 0; t <= options_.duration_s + 600; t += 600)
        up = up || flight_of(orbit, base_e_m_, std::min(t, options_.duration_s)).line.elevation_rad > 0;
      if (!up) continue;
      all.push_back(orbit);
      while (all.back().toe_since_start_s + kRecordEveryS < options_.duration_s + 1800)
        all.push_back(later_record(all.back(), kRecordEveryS));
    }
    return all;
  }

 private:
  [[nodiscard]] Random stream(std::uint64_t part) const { return Random(options_.seed * 1000 + part); }
  [[nodiscard]] static Vehicle::Route make_route(const SimulationOptions& options) {
    if (!options.route.empty()) return SplineRoute(options.route);
    Random random(options.seed * 1000 + 1);
    return StreetRoute(options.duration_s + 5, random);
  }

  SimulationOptions options_;
  Profile profile_;
  geodesy::LocalFrame frame_;
  Vehicle vehicle_;
  std::vector<Orbit> orbits_;
  std::vector<WayPoint> way_;
  City city_;
  std::vector<Landmark> landmarks_;
  Eigen::Vector3d base_e_m_;
  Clock rover_clock_, base_clock_;
};

}  // namespace searvins::simulator
