// SPDX-License-Identifier: BSD-3-Clause
// Rendered pictures as files: read again as a recording in the EuRoC layout.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <cstddef>
#include <filesystem>
#include <string>

#include "examples/datasets/euroc.hpp"
#include "examples/simulator/image_set.hpp"
#include "tests/support/property.hpp"

using namespace searvins;
using namespace searvins::simulator;

TEST_CASE("pictures on disk: the layout is read as a recording, images and classes are those in memory") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "searvins_rendered_set";
  std::filesystem::remove_all(folder);
  SimulationOptions wanted;
  wanted.profile = "urban", wanted.duration_s = 20, wanted.seed = 9;
  wanted.camera_rate_hz = 0.5;
  const Simulation simulation(wanted);
  RenderOptions small;
  small.width_px = 160, small.height_px = 60;
  double share = 0;
  REQUIRE(write_images(simulation, small, folder, [&share](double now) { share = now; }).message.empty());
  CHECK(share == doctest::Approx(1));
  examples::EurocOptions options;
  options.nanoseconds = io::NanosecondScale::gps;
  const auto read = examples::read_euroc(folder, options);
  REQUIRE_MESSAGE(read.ok(), (read.error ? io::to_string(*read.error) : std::string{}));
  const examples::EurocRecording& recording = read.value;
  REQUIRE(recording.pairs.size() == 11);
  CHECK(recording.pairs.front().time == simulation.options().start);
  CHECK(read.skipped.total() == 0);
  const StereoRig rig = scaled_rig(StereoRig{}, 160, 60);
  CHECK(recording.left.model.fx_px == doctest::Approx(rig.fx_px).epsilon(1e-9));
  CHECK(recording.right.model.cy_px == doctest::Approx(rig.cy_px).epsilon(1e-9));
  CHECK(test::close(recording.left.pose.R_bs, rig.R_bc, 1e-9));
  const auto stereo = examples::stereo_calibration(recording.left, recording.right);
  CHECK(test::close(stereo.t_c1_c0_m, Eigen::Vector3d{-rig.baseline_m, 0, 0}, 1e-9));
  CHECK(test::close(stereo.R_c1_c0, Eigen::Matrix3d::Identity(), 1e-9));
  // Readings from a second before to a second after, and the truth: what the vehicle did.
  REQUIRE(recording.imu.samples.size() == 2201);
  CHECK(recording.imu.samples.front().time == simulation.options().start.plus_seconds(-1));
  CHECK(recording.imu.samples.front().accel_b_mps2.z() == doctest::Approx(9.8).epsilon(0.02));
  REQUIRE(recording.imu_noise.has_value());
  CHECK(recording.imu_noise->gyro_noise_radps_sqrt_hz == doctest::Approx(simulation.options().imu_noise.gyro_noise_radps_sqrt_hz).epsilon(1e-5));
  REQUIRE(recording.truth.size() == 401);
  for (const std::size_t i : {std::size_t{0}, std::size_t{200}, std::size_t{400}}) {
    const VehicleState x = simulation.vehicle().state(0.05 * static_cast<double>(i));
    CHECK(test::close(recording.truth[i].p_w_m, x.p_w_m, 1e-4));
    CHECK(test::close(recording.truth[i].q_wb.toRotationMatrix(), x.R_wb, 1e-7));
    CHECK(test::close(recording.truth[i].v_w_mps, x.v_w_mps, 1e-4));
  }
  std::size_t k = 0;
  for_each_frame(simulation, small, [&](GpsTime time, double, const StereoFrame& frame) {
    const examples::EurocPair& pair = recording.pairs[k++];
    CHECK(pair.time == time);
    const auto images = examples::read_euroc_pair(recording, pair);
    REQUIRE(images.ok());
    CHECK(images->left.pixels() == frame.left.pixels());
    CHECK(images->right.pixels() == frame.right.pixels());
    const auto labels = examples::read_image((folder / "labels0/data" / (std::to_string(time.ns) + ".png")).string());
    REQUIRE(labels.ok());
    CHECK(labels->pixels() == frame.left_classes.pixels());
  });
  CHECK(k == 11);
  std::filesystem::remove_all(folder);
  CHECK_FALSE(write_images(simulation, small, "/proc/nowhere", [](double) {}).message.empty());
}
