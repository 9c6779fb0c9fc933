// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What a stereo frontend would hand on: tracks of points on facades, on the road and on posts, seen by a rectified pair.
///
/// The left camera is at p_w + R_wb t_bc with the axes R_wb R_bc (right, down, forward). A point at (X, Y, Z) in its axes is seen at
///
///     u_left = fx X / Z + cx        v = fy Y / Z + cy        u_right = u_left - fx baseline / Z
///
/// with white noise, a slow error of each track, a tail of larger errors, and now and then a match that is wrong altogether.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "city.hpp"
#include "propagation.hpp"
#include "random.hpp"
#include "vehicle.hpp"

namespace searvins::simulator {

/// The pair, as rig.json has it.
struct StereoRig {
  double fx_px{1373}, fy_px{1373}, cx_px{992}, cy_px{333}, baseline_m{0.498};
  double width_px{2048}, height_px{732};
  Eigen::Matrix3d R_bc{{0.9999870538278512, 0.004355280998742294, -0.002631293240253685},
                       {0.0026046393564179366, 0.0061142995759864574, 0.9999779153533933},
                       {0.004371273329043743, -0.999971823037088, 0.0061028764829139945}};
  Eigen::Vector3d t_bc_m{-0.303, 0.011, 0.033};
};

/// A point of the world with its class: 0 building, 1 road, 2 pole or sign, 5 other static.
struct Landmark {
  Eigen::Vector3d p_w_m;
  int semantic_class{0};
};

/// One observation of a track.
struct TrackObservation {
  int track{0};
  double u_left_px{0}, u_right_px{0}, v_px{0}, score{0};
  int semantic_class{0};
  std::size_t landmark{0};
  bool is_wrong{false};
};

/// Points on the facades, on the road and beside it.
[[nodiscard]] inline std::vector<Landmark> landmarks_of(const City& city, const std::vector<WayPoint>& way, Random& random) {
  std::vector<Landmark> all;
  for (const Wall& wall : city.walls) {
    const double length_m = (wall.b_m - wall.a_m).norm(), ground_m = wall.bottom_m + 3, high_m = std::min(wall.top_m - ground_m, 12.0);
    const int count = static_cast<int>(length_m * high_m / 5);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d p = wall.a_m + random.uniform(0, 1) * (wall.b_m - wall.a_m) + 0.02 * wall.normal;
      all.push_back({{p.x(), p.y(), ground_m + random.uniform(0.2, high_m)}, 0});
    }
  }
  for (const WayPoint& w : way) {
    const Eigen::Vector2d right{w.forward.y(), -w.forward.x()};
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d p = w.p_m + random.uniform(-5.5, 5.5) * right + random.uniform(0, 1) * w.forward;
      all.push_back({{p.x(), p.y(), w.ground_m}, 1});
    }
    const double side = random.uniform(0, 1) < 0.5 ? -1 : 1;
    const Eigen::Vector2d p = w.p_m + side * random.uniform(6, 25) * right;
    all.push_back({{p.x(), p.y(), w.ground_m + random.uniform(0, 5)}, random.uniform(0, 1) < 0.4 ? 2 : 5});
  }
  return all;
}

/// Follows landmarks from frame to frame.
class StereoCamera {
 public:
  StereoCamera(const StereoRig& rig, const City& city, std::vector<Landmark> landmarks, Random random)
      : rig_(rig), city_(city), landmarks_(std::move(landmarks)), random_(random) {
    for (std::size_t i = 0; i < landmarks_.size(); ++i) cells_[cell_of(landmarks_[i].p_w_m.head<2>())].push_back(i);
    is_tracked_.assign(landmarks_.size(), false);
  }

  [[nodiscard]] const std::vector<Landmark>& landmarks() const { return landmarks_; }

  /// The frame that the vehicle sees in a state; frames come in order of time.
  [[nodiscard]] std::vector<TrackObservation> frame(const VehicleState& s) {
    const Eigen::Vector3d camera_m = s.p_w_m + s.R_wb * rig_.t_bc_m;
    const Eigen::Matrix3d R_cw = (s.R_wb * rig_.R_bc).transpose();
    const Surroundings around(city_, camera_m);
    std::vector<Track> kept;
    for (Track& track : tracks_) {
      is_tracked_[track.landmark] = false;
      if (random_.uniform(0, 1) > 0.985 || !sees(track.landmark, camera_m, R_cw, around, track.pixel)) continue;
      is_tracked_[track.landmark] = true;
      kept.push_back(track);
    }
    tracks_ = std::move(kept);
    begin_tracks(camera_m, R_cw, around);
    std::vector<TrackObservation> seen;
    for (Track& track : tracks_) seen.push_back(observe(track));
    return seen;
  }

 private:
  static constexpr double kCellM = 20, kNearM = 2, kFarM = 55;
  static constexpr std::size_t kTracks = 48;
  using Cell = std::pair<int, int>;
  struct Track {
    int id{0};
    std::size_t landmark{0};
    Eigen::Vector3d pixel{Eigen::Vector3d::Zero()};  // u_left, v, u_right without errors
    Eigen::Vector3d slow{Eigen::Vector3d::Zero()};
    double score{0.9};
  };

  [[nodiscard]] static Cell cell_of(const Eigen::Vector2d& p_m) {
    return {static_cast<int>(std::floor(p_m.x() / kCellM)), static_cast<int>(std::floor(p_m.y() / kCellM))};
  }

  [[nodiscard]] bool projects(std::size_t landmark, const Eigen::Vector3d& camera_m, const Eigen::Matrix3d& R_cw,
                              Eigen::Vector3d& pixel) const {
    const Eigen::Vector3d p = R_cw * (landmarks_[landmark].p_w_m - camera_m);
    if (p.z() < kNearM || p.z() > kFarM) return false;
    pixel.x() = rig_.fx_px * p.x() / p.z() + rig_.cx_px, pixel.y() = rig_.fy_px * p.y() / p.z() + rig_.cy_px;
    pixel.z() = pixel.x() - rig_.fx_px * rig_.baseline_m / p.z();
    const auto inside = [](double x, double size) { return x > 4 && x < size - 4; };
    return inside(pixel.x(), rig_.width_px) && inside(pixel.z(), rig_.width_px) && inside(pixel.y(), rig_.height_px);
  }

  [[nodiscard]] bool sees(std::size_t landmark, const Eigen::Vector3d& camera_m, const Eigen::Matrix3d& R_cw, const Surroundings& around,
                          Eigen::Vector3d& pixel) const {
    if (!projects(landmark, camera_m, R_cw, pixel)) return false;
    const Eigen::Vector3d way = landmarks_[landmark].p_w_m - camera_m;
    const double length_m = way.norm();
    return around.is_free(camera_m, way / length_m, length_m - 0.1);
  }

  void begin_tracks(const Eigen::Vector3d& camera_m, const Eigen::Matrix3d& R_cw, const Surroundings& around) {
    if (tracks_.size() >= kTracks) return;
    std::vector<std::size_t> candidates;
    const Cell c = cell_of(camera_m.head<2>());
    const int reach = static_cast<int>(kFarM / kCellM) + 1;
    Eigen::Vector3d pixel;
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y) {
        const auto found = cells_.find({c.first + x, c.second + y});
        if (found == cells_.end()) continue;
        for (const std::size_t i : found->second)
          if (!is_tracked_[i] && projects(i, camera_m, R_cw, pixel)) candidates.push_back(i);
      }
    for (std::size_t tries = 0; tries < 60 && tracks_.size() < kTracks && !candidates.empty(); ++tries) {
      const auto pick = static_cast<std::size_t>(random_.integer(0, static_cast<std::int64_t>(candidates.size()) - 1));
      const std::size_t landmark = candidates[pick];
      candidates[pick] = candidates.back(), candidates.pop_back();
      if (!sees(landmark, camera_m, R_cw, around, pixel)) continue;
      const bool crowded =
          std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& t) { return (t.pixel - pixel).head<2>().norm() < 24; });
      if (crowded) continue;
      is_tracked_[landmark] = true;
      tracks_.push_back({++last_id_, landmark, pixel, 0.27 * normals(), random_.uniform(0.75, 0.99)});
    }
  }

  [[nodiscard]] TrackObservation observe(Track& track) {
    constexpr double keep = 0.9;
    track.slow = keep * track.slow + 0.27 * std::sqrt(1 - keep * keep) * normals();
    const double tail = random_.uniform(0, 1) < 0.05 ? 2.2 : 0.42;
    Eigen::Vector3d pixel = track.pixel + track.slow + tail * normals();
    const double luck = random_.uniform(0, 1);
    const bool wrong = luck < 0.015;
    if (luck < 0.008)
      pixel.z() += random_.uniform(-25, 25);  // the right view matched something else
    else if (wrong)
      for (int i = 0; i < 3; ++i) pixel[i] += random_.uniform(-40, 40);
    return {track.id, pixel.x(), pixel.z(), pixel.y(), track.score, landmarks_[track.landmark].semantic_class, track.landmark, wrong};
  }

  [[nodiscard]] Eigen::Vector3d normals() {
    Eigen::Vector3d n;
    for (int i = 0; i < 3; ++i) n[i] = random_.normal();
    return n;
  }

  StereoRig rig_;
  const City& city_;
  std::vector<Landmark> landmarks_;
  Random random_;
  std::map<Cell, std::vector<std::size_t>> cells_;
  std::vector<bool> is_tracked_;
  std::vector<Track> tracks_;
  int last_id_{0};
};

}  // namespace searvins::simulator
