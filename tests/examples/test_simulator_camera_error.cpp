// SPDX-License-Identifier: BSD-3-Clause
// A simulated camera whose clock and axes are not those of rig.json: which way, how much, and nothing else changes.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <vector>

#include "examples/simulator/dataset.hpp"
#include "simulated_files.hpp"

using namespace searvins;
using test::options_of;
using test::text_of;

namespace {

/// Median distance of the left pixels from where landmarks project by a camera with axes R_bc at a vehicle's state so much later than the stamp.
double median_miss_px(const simulator::Simulation& drive, const Eigen::Matrix3d& R_bc, double later_s) {
  simulator::StereoCamera camera = drive.camera();
  const simulator::StereoRig rig;
  std::vector<double> misses;
  for (int k = 250; k <= 400; ++k) {
    const simulator::VehicleState s = drive.vehicle().state(0.1 * k + later_s);
    for (const simulator::TrackObservation& o : camera.frame(drive.at_exposure(0.1 * k))) {
      const Eigen::Vector3d c = R_bc.transpose() * (s.R_wb.transpose() * (camera.landmarks()[o.landmark].p_w_m - s.p_w_m) - rig.t_bc_m);
      misses.push_back(std::hypot(o.u_left_px - (rig.fx_px * c.x() / c.z() + rig.cx_px), o.v_px - (rig.fy_px * c.y() / c.z() + rig.cy_px)));
    }
  }
  REQUIRE(misses.size() > 2000);
  std::nth_element(misses.begin(), misses.begin() + static_cast<std::ptrdiff_t>(misses.size() / 2), misses.end());
  return misses[misses.size() / 2];
}

}  // namespace

TEST_CASE("simulated camera error: a frame shows what is there offset seconds after its stamp, by axes turned about right, down, forward") {
  const Eigen::Vector3d turn_rad{0.02, -0.01, 0.015};
  for (const double offset_s : {0.05, -0.05}) {
    simulator::SimulationOptions options = options_of("light", 45, 3);
    options.camera_offset_s = offset_s, options.camera_boresight_rad = turn_rad;
    const simulator::Simulation drive(options);
    const simulator::StereoRig told;
    const double n = turn_rad.norm();
    const Eigen::Matrix3d R = told.R_bc * Eigen::AngleAxisd(n, turn_rad / n).toRotationMatrix();
    CHECK(median_miss_px(drive, R, offset_s) < 1.2);
    CHECK(median_miss_px(drive, R, 0) > 2);
    CHECK(median_miss_px(drive, R, -offset_s) > median_miss_px(drive, R, 0));
    CHECK(median_miss_px(drive, told.R_bc, offset_s) > 15);
    CHECK(median_miss_px(drive, told.R_bc * Eigen::AngleAxisd(-n, turn_rad / n).toRotationMatrix(), offset_s) > 30);
  }
}

TEST_CASE("simulated camera error: only what the camera sees changes, its description does not") {
  simulator::SimulationOptions options = options_of("light", 30, 3);
  const simulator::Simulation right(options);
  options.camera_offset_s = 5e-3, options.camera_boresight_rad = {3e-3, -3e-3, 2e-3};
  const simulator::Simulation wrong(options);
  const simulator::Dataset a = simulator::make_dataset(right, simulator::Layout::plain), b = simulator::make_dataset(wrong, simulator::Layout::plain);
  for (const char* name : {"rover.obs", "base.obs", "nav.rnx", "imu.csv", "truth.csv", "rig.json", "labels.csv"})
    CHECK_MESSAGE(text_of(a, name) == text_of(b, name), name);
  CHECK(text_of(a, "stereo_tracks.csv") != text_of(b, "stereo_tracks.csv"));
}
