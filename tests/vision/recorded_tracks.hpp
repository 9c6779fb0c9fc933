// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The stereo tracks of the simulated drives in the shared data, with the true motion of the camera and the faults that were put in.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_observation.hpp>

namespace searvins::test {

inline constexpr std::size_t kTwinTracks = 256;
using TwinFrame = vision::StereoFrame<kTwinTracks>;

/// Camera of the twins' rig.json.
inline vision::StereoCamera<double> twin_camera() {
  vision::StereoCamera<double> camera;
  camera.fx_px = camera.fy_px = 1373, camera.cx_px = 992, camera.cy_px = 333;
  camera.baseline_m = 0.498;
  camera.width_px = 2048, camera.height_px = 732;
  camera.R_bc << 0.9999870538278512, 0.004355280998742294, -0.002631293240253685, 0.0026046393564179366, 0.0061142995759864574,
      0.9999779153533933, 0.004371273329043743, -0.999971823037088, 0.0061028764829139945;
  camera.p_bc_m << -0.303, 0.011, 0.033;
  return camera;
}

/// Numbers of a line of comma-separated values.
inline bool read_numbers(std::ifstream& file, std::vector<double>& numbers) {
  std::string line;
  if (!std::getline(file, line)) return false;
  numbers.clear();
  const char* at = line.data();
  const char* const end = at + line.size();
  for (double x = 0; at < end;) {
    const auto [next, error] = std::from_chars(at, end, x);
    if (error != std::errc{}) break;
    numbers.push_back(x);
    at = next + 1;
  }
  return true;
}

inline std::int64_t tenth_of(double sow) { return std::llround(sow * 10); }

/// Everything of a drive, frame by frame.
struct TwinDrive {
  std::vector<TwinFrame> frames;
  std::vector<std::optional<vision::CameraMotion>> motions;      ///< true, from the frame before; none where truth is missing
  std::map<std::pair<std::int64_t, std::uint64_t>, int> faults;  ///< kind by tenths of a second and track
  /// Kind of fault of an observation: 0 none, 1 another point since a switch of identity, 2 repeated facade, 3 stereo mismatch, 4 gross,
  /// 6 vehicle without label.
  [[nodiscard]] int fault(const TwinFrame& frame, std::uint64_t track) const {
    const auto at = faults.find({tenth_of(frame.time.sow()), track});
    return at == faults.end() ? 0 : at->second;
  }
};

/// Reads a drive between two times of week.
inline TwinDrive read_twin(const std::filesystem::path& folder, double start_sow, double end_sow) {
  constexpr std::int64_t kWeek = 2323;
  TwinDrive drive;
  std::vector<double> n;
  std::ifstream tracks(folder / "stereo_tracks.csv");
  while (read_numbers(tracks, n)) {
    if (n.size() < 7 || n[0] < start_sow || n[0] > end_sow) continue;
    const GpsTime time = GpsTime::from_week_sow(kWeek, n[0]);
    if (drive.frames.empty() || drive.frames.back().time != time) drive.frames.emplace_back().time = time;
    vision::StereoObservation o;
    o.track = static_cast<std::uint64_t>(n[1]), o.pixel_px = {n[2], n[3], n[4]}, o.score = n[5];
    o.semantic_class = static_cast<vision::SemanticClass>(n[6]);
    (void)drive.frames.back().add(o);
  }
  std::ifstream faults(folder / "stereo_faults.csv");
  while (read_numbers(faults, n))
    if (n.size() == 3) drive.faults[{tenth_of(n[0]), static_cast<std::uint64_t>(n[1])}] = static_cast<int>(n[2]);

  struct Pose {
    std::int64_t tenth;
    vision::CameraMotion camera;  ///< in the local frame
  };
  std::vector<Pose> poses;
  std::optional<geodesy::LocalFrame> local;
  const auto camera = twin_camera();
  std::ifstream truth(folder / "truth.csv");
  while (read_numbers(truth, n)) {
    if (n.size() < 11) continue;
    const Eigen::Vector3d p_e_m{n[4], n[5], n[6]};
    if (!local) local = geodesy::LocalFrame::at(p_e_m);
    const Eigen::Matrix3d R_wb = Eigen::Quaterniond(n[7], n[8], n[9], n[10]).normalized().toRotationMatrix();
    poses.push_back({tenth_of(n[0]), {R_wb * camera.R_bc, local->to_local(p_e_m) + R_wb * camera.p_bc_m}});
  }
  const auto pose_at = [&](const TwinFrame& frame) {
    const std::int64_t tenth = tenth_of(frame.time.sow());
    const auto at = std::lower_bound(poses.begin(), poses.end(), tenth, [](const Pose& p, std::int64_t t) { return p.tenth < t; });
    return at != poses.end() && at->tenth == tenth ? std::optional(at->camera) : std::nullopt;
  };
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    drive.motions.emplace_back();
    if (i == 0) continue;
    const auto from = pose_at(drive.frames[i - 1]), to = pose_at(drive.frames[i]);
    if (from && to) drive.motions.back() = {from->R_prev_cur.transpose() * to->R_prev_cur, from->to_current(to->t_prev_cur_m)};
  }
  return drive;
}

}  // namespace searvins::test
