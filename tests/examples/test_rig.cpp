// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "examples/support/rig.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::examples;

namespace {

const std::string kImu =
    "\"imu\": {\"rate_hz\": 100, \"sample\": \"instantaneous\", \"axes\": [\"-x\", \"y\", \"-z\"],\n"
    " \"accel_noise_mps2_sqrt_hz\": 9.8e-4, \"gyro_noise_radps_sqrt_hz\": 1.7e-4, \"accel_bias_walk_mps3_sqrt_hz\": 3.9e-5,\n"
    " \"gyro_bias_walk_radps2_sqrt_hz\": 3.9e-6, \"accel_bias_sigma_mps2\": 0.05, \"gyro_bias_sigma_radps\": 9e-4}";
const std::string kAxes = "\"body_axes\": \"right-forward-up\"";
const std::string kGnss = "\"gnss\": {\"signals\": [\"G1C\", \"G2W\"], \"elevation_mask_deg\": 15, \"min_cn0_dbhz\": 20}";
const std::string kUnrectified =
    "\"camera\": {\"left\": {\"intrinsics_px\": [1373, 1378, 991, 333], \"distortion_radtan\": [-0.03, 0.04, 0.003, -0.004]},\n"
    " \"right\": {\"intrinsics_px\": [1319, 1324, 1021, 345], \"distortion_radtan\": [-0.03, 0.04, 0.003, -0.004]},\n"
    " \"T_c1_c0\": [[1,0,0,-0.5],[0,1,0,0],[0,0,1,0],[0,0,0,1]], \"size_px\": [2048, 732],\n"
    " \"R_b_c\": [[1,0,0],[0,0,1],[0,-1,0]], \"t_b_c_m\": [0,0,0], \"sigma_px\": 1}";

std::string file(const std::vector<std::string>& parts) {
  std::string text = "{\"schema\": 1";
  for (const std::string& part : parts) text += ",\n" + part;
  return text + "}";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& text) {
  const auto rig = parse_rig(text, "rig.json");
  return rig.ok() ? "accepted" : to_string(rig.error());
}

}  // namespace

TEST_CASE("rig: sections are optional, the four gnss defaults hold") {
  const auto bare = parse_rig("{\"schema\": 1}", "rig.json");
  REQUIRE(bare.ok());
  CHECK_FALSE((bare->imu || bare->camera || bare->gnss || bare->lever_arm_b_m || bare->base_position_e_m || bare->reject_classes));
  const auto rig = parse_rig(file({kGnss}), "rig.json");
  REQUIRE_MESSAGE(rig.ok(), to_string(rig.error()));
  CHECK(rig->gnss->signals.size() == 2);
  CHECK(rig->gnss->code_sigma_m.empty());
  CHECK(rig->gnss->phase_sigma_m == Eigen::Vector2d{0.003, 0.006});
  CHECK(rig->gnss->doppler_sigma_mps == 0.5);
  CHECK(rig->gnss->max_base_age_s == 30);
  const auto own = parse_rig(file({replaced(kGnss, "\"min_cn0_dbhz\": 20",
                                            "\"min_cn0_dbhz\": 20, \"code_sigma_m\": {\"G1C\": [0.9, 1.95]}, \"max_base_age_s\": 5")}),
                             "rig.json");
  REQUIRE_MESSAGE(own.ok(), to_string(own.error()));
  CHECK(own->gnss->code_sigma_m.at("G1C") == Eigen::Vector2d{0.9, 1.95});
  CHECK(own->gnss->max_base_age_s == 5);
}

TEST_CASE("rig: axes become a signed permutation, body axes a rotation to right-forward-up") {
  const auto rig = parse_rig(file({kImu, kAxes}), "rig.json");
  REQUIRE_MESSAGE(rig.ok(), to_string(rig.error()));
  CHECK(rig->imu->R_b_raw * Eigen::Vector3d{1, 2, 3} == Eigen::Vector3d{-1, 2, -3});
  CHECK(rig->R_rfu_b == Eigen::Matrix3d::Identity());
  const auto frd = parse_rig(file({kImu, "\"body_axes\": \"forward-right-down\""}), "rig.json");
  CHECK(frd->R_rfu_b * Eigen::Vector3d{1, 2, 3} == Eigen::Vector3d{2, 1, -3});
  const auto flu = parse_rig(file({kImu, "\"body_axes\": \"forward-left-up\""}), "rig.json");
  CHECK(flu->R_rfu_b * Eigen::Vector3d{1, 2, 3} == Eigen::Vector3d{-2, 1, 3});
  for (const auto* r : {&frd, &flu}) CHECK((*r)->R_rfu_b.determinant() == doctest::Approx(1));
}

TEST_CASE("rig: an unrectified pair is read, and not beside a rectified one") {
  const auto rig = parse_rig(file({kUnrectified, kAxes}), "rig.json");
  REQUIRE_MESSAGE(rig.ok(), to_string(rig.error()));
  REQUIRE(rig->camera->unrectified);
  CHECK(rig->camera->unrectified->T_c1_c0(0, 3) == -0.5);
  CHECK(rig->camera->unrectified->right.intrinsics_px[0] == 1319);
  const std::string both = replaced(kUnrectified, "\"left\"",
                                    "\"rectified\": {\"fx_px\": 1, \"fy_px\": 1, \"cx_px\": 1, \"cy_px\": 1, \"baseline_m\": 1}, \"left\"");
  CHECK(error_of(file({both, kAxes})).find("camera.left stands beside camera.rectified") != std::string::npos);
}

TEST_CASE("rig: every field of a present section is required, and named with its line when missing or unknown") {
  CHECK(error_of(file({replaced(kImu, "\"rate_hz\": 100,", ""), kAxes})) == "rig.json:2: imu.rate_hz is missing");
  CHECK(error_of(file({replaced(kImu, "rate_hz", "rate_Hz"), kAxes})).find("imu.rate_hz is missing") != std::string::npos);
  CHECK(error_of(file({kImu, kAxes, "\"gnsss\": {}"})) == "rig.json:6: unknown field gnsss: did you mean gnss?");
  CHECK(error_of(file({replaced(kGnss, "\"elevation_mask_deg\": 15", "\"elevation_mask_deg\": 15, \"mask\": 1")})) ==
        "rig.json:2: unknown field gnss.mask");
  CHECK(error_of(file({kImu})).find("body_axes is missing") != std::string::npos);
  CHECK(error_of("{}").find("schema is missing") != std::string::npos);
  CHECK(error_of("{\"schema\": 2}").find("schema: 2 lies outside 1 .. 1") != std::string::npos);
  CHECK(error_of("[]").find("must be an object, not an array") != std::string::npos);
}

TEST_CASE("rig: types, sizes and ranges") {
  const std::string with_axes[] = {"\"axes\": [\"x\", \"x\", \"z\"]", "\"axes\": [\"x\", \"y\"]", "\"axes\": [\"x\", \"y\", \"up\"]",
                                   "\"axes\": [\"-x\", \"y\", \"z\"]", "\"axes\": \"xyz\""};
  for (const std::string& axes : with_axes)
    CHECK(error_of(file({replaced(kImu, "\"axes\": [\"-x\", \"y\", \"-z\"]", axes), kAxes})).find("imu.axes") != std::string::npos);
  CHECK(error_of(file({replaced(kImu, "100", "\"100\""), kAxes})).find("imu.rate_hz must be a number, not a string") != std::string::npos);
  CHECK(error_of(file({replaced(kImu, "9.8e-4", "0"), kAxes})).find("imu.accel_noise_mps2_sqrt_hz: 0 lies outside") != std::string::npos);
  CHECK(error_of(file({replaced(kGnss, "G2W", "R2W")})).find("\"R2W\" is no signal") != std::string::npos);
  CHECK(error_of(file({"\"base\": {\"position_ecef_m\": [1, 2]}"})).find("base.position_ecef_m has 2 elements, not 3") !=
        std::string::npos);
  CHECK(error_of(file({"\"semantic\": {\"reject_classes\": [3.5]}"})).find("is not a whole number") != std::string::npos);
  CHECK(error_of(file({replaced(kUnrectified, "[0,-1,0]", "[0,1,0]"), kAxes})).find("camera.R_b_c is not a rotation") != std::string::npos);
}

TEST_CASE("rig: both rigs of the simulated drive are read") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data");
    return;
  }
  for (const char* name : {"a-clean", "a-urban"}) {
    const auto rig = read_rig((*shared / "data" / "twin" / name / "rig.json").string());
    REQUIRE_MESSAGE(rig.ok(), to_string(rig.error()));
    CHECK(rig->imu->rate_hz == 100);
    CHECK(rig->imu->sample == RigImu::Sample::instantaneous);
    CHECK(rig->lever_arm_b_m->y() == -0.517);
    CHECK(rig->base_position_e_m->x() == -3817680.7301);
    CHECK(rig->camera->rectified->baseline_m == 0.498);
    CHECK(rig->gnss->signals.size() == 5);
    CHECK(*rig->reject_classes == std::vector<int>{3, 4});
  }
}
