// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Twelve real stereo pairs (EuRoC V1_01, camera at rest) of the shared data, rectified by their published calibration.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <searvins/vision/frontend.hpp>
#include <searvins/vision/rectification.hpp>

#include "examples/orb_frontend/remap.hpp"
#include "examples/support/gray_image.hpp"
#include "examples/support/image_reader.hpp"
#include "support/shared_data.hpp"

namespace searvins::test {

/// The calibration of the folder's sensor.yaml files. T_bs: camera axes in the body, rows of the file.
inline vision::StereoCalibration<double> euroc_calibration() {
  vision::StereoCalibration<double> calibration;
  const Eigen::Matrix3d R_b_c0{{0.0148655429818, -0.999880929698, 0.00414029679422},
                               {0.999557249008, 0.0149672133247, 0.025715529948},
                               {-0.0257744366974, 0.00375618835797, 0.999660727178}};
  const Eigen::Matrix3d R_b_c1{{0.0125552670891, -0.999755099723, 0.0182237714554},
                               {0.999598781151, 0.0130119051815, 0.0251588363115},
                               {-0.0253898008918, 0.0179005838253, 0.999517347078}};
  const Eigen::Vector3d p_b_c0{-0.0216401454975, -0.064676986768, 0.00981073058949},
      p_b_c1{-0.0198435579556, 0.0453689425024, 0.00786212447038};
  const auto eye = [](double fx, double fy, double cx, double cy, double k1, double k2, double p1, double p2) {
    vision::PinholeCamera<double> camera;
    camera.fx_px = fx, camera.fy_px = fy, camera.cx_px = cx, camera.cy_px = cy;
    camera.lens.k1 = k1, camera.lens.k2 = k2, camera.lens.p1 = p1, camera.lens.p2 = p2;
    camera.width_px = 752, camera.height_px = 480;
    return camera;
  };
  calibration.eyes[0] = eye(458.654, 457.296, 367.215, 248.375, -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05);
  calibration.eyes[1] = eye(457.587, 456.134, 379.999, 255.238, -0.28368365, 0.07451284, -0.00010473, -3.55590700e-05);
  calibration.R_c1_c0 = R_b_c1.transpose() * R_b_c0;
  calibration.t_c1_c0_m = R_b_c1.transpose() * (p_b_c0 - p_b_c1);
  calibration.R_b_c0 = R_b_c0;
  calibration.p_b_c0_m = p_b_c0;
  return calibration;
}

/// The pairs in order of time.
struct EurocPairs {
  vision::StereoCamera<double> camera{};
  std::vector<examples::GrayImage> left, right;

  [[nodiscard]] vision::ImagePair pair(std::size_t i) const {
    const GpsTime time{static_cast<std::int64_t>(i) * 50'000'000};
    return {left[i].view(), right[i].view(), time, time};
  }
};

/// Nothing when the shared data, or an image of theirs, are not there.
inline std::optional<EurocPairs> read_euroc_pairs() {
  const auto shared = shared_data();
  if (!shared) return std::nullopt;
  const std::filesystem::path folder = *shared / "data/real/euroc_v101_static/mav0";
  const auto rectification = vision::rectify(euroc_calibration());
  orb::Remap remap_left, remap_right;
  if (!rectification || !remap_left.build(*rectification, vision::Eye::left).ok() ||
      !remap_right.build(*rectification, vision::Eye::right).ok())
    return std::nullopt;
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "cam0/data", error))
    if (entry.path().extension() == ".png") names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  EurocPairs pairs;
  pairs.camera = rectification->camera();
  for (const std::string& name : names) {
    const auto raw_left = examples::read_image((folder / "cam0/data" / name).string()),
               raw_right = examples::read_image((folder / "cam1/data" / name).string());
    pairs.left.emplace_back();
    pairs.right.emplace_back();
    if (!raw_left || !raw_right || !remap_left.apply(raw_left->view(), pairs.left.back()).ok() ||
        !remap_right.apply(raw_right->view(), pairs.right.back()).ok())
      return std::nullopt;
  }
  if (pairs.left.empty()) return std::nullopt;
  return pairs;
}

}  // namespace searvins::test
