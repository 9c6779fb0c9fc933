// SPDX-License-Identifier: BSD-3-Clause
// Stereo odometry on real tracks: the motions of PnP from frame to frame, chained, against the poses that come with the tracks.
#include <searvins/vision/pnp.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "examples/support/angle_units.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::CameraMotion;

namespace {

using RecordedPnp = vision::StereoPnp<1024>;
using Frame = std::map<std::uint64_t, vision::StereoPixel<double>>;

struct Drive {
  vision::StereoCamera<double> camera;
  std::map<int, CameraMotion> poses;  ///< camera in the axes of the first one
  std::map<int, Frame> frames;
};

Drive read_drive(const std::filesystem::path& calibration, const std::filesystem::path& poses, const std::filesystem::path& tracks) {
  Drive drive;
  vision::StereoCamera<double>& c = drive.camera;
  double skew = 0;
  std::ifstream(calibration) >> c.fx_px >> c.fy_px >> skew >> c.cx_px >> c.cy_px >> c.baseline_m;
  c.width_px = 1241, c.height_px = 376;
  std::ifstream pose_file(poses);
  for (int index = 0; pose_file >> index;) {
    Eigen::Matrix4d T;
    for (int i = 0; i < 16; ++i) pose_file >> T(i / 4, i % 4);
    drive.poses[index] = {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
  }
  std::ifstream track_file(tracks);
  std::uint64_t landmark = 0;
  Eigen::Vector3d z, unused;
  for (int index = 0; track_file >> index >> landmark >> z[0] >> z[1] >> z[2] >> unused[0] >> unused[1] >> unused[2];)
    drive.frames[index][landmark] = z;
  return drive;
}

struct Drift {
  double distance_m{0}, end_error_m{0}, end_turn_rad{0};
  double step_rms_m{0}, step_turn_rms_rad{0};  ///< of the motions one by one
  double rms_px{0}, share{0};
  int frames{0};
};

/// `wrong`: share of the pairs whose current observation is replaced by that of another track.
Drift chain(const Drive& drive, const vision::PnpOptions& options, double wrong = 0) {
  Rng rng{11};
  auto pnp = std::make_unique<RecordedPnp>(drive.camera, options);
  Drift drift;
  CameraMotion pose = drive.poses.begin()->second;
  for (auto now = std::next(drive.frames.begin()); now != drive.frames.end(); ++now) {
    const auto before = std::prev(now);
    RecordedPnp::Pairs pairs;
    for (const auto& [track, pixel] : now->second)
      if (const auto seen = before->second.find(track); seen != before->second.end()) (void)pairs.push_back({seen->second, pixel});
    const int last = static_cast<int>(pairs.size()) - 1;
    for (vision::PixelPair& pair : pairs)
      if (chance(rng, wrong)) pair.current_px = pairs[static_cast<std::size_t>(integer(rng, 0, last))].current_px;
    const Status status = pnp->solve(pairs);
    CAPTURE(now->first);
    CAPTURE(pairs.size());
    REQUIRE(status.ok());
    const CameraMotion &from = drive.poses.at(before->first), &to = drive.poses.at(now->first);
    const CameraMotion truth{from.R_prev_cur.transpose() * to.R_prev_cur, from.to_current(to.t_prev_cur_m)};
    const Eigen::Matrix<double, 6, 1> error = pnp->motion().minus(truth);
    drift.step_turn_rms_rad += error.head<3>().squaredNorm(), drift.step_rms_m += error.tail<3>().squaredNorm();
    drift.distance_m += truth.t_prev_cur_m.norm();
    drift.rms_px += pnp->statistics().rms_px, drift.share += pnp->statistics().inlier_share;
    ++drift.frames;
    pose = pose.then(pnp->motion());
  }
  const CameraMotion& end = drive.poses.rbegin()->second;
  drift.end_error_m = (pose.t_prev_cur_m - end.t_prev_cur_m).norm();
  drift.end_turn_rad = CameraMotion{end.R_prev_cur.transpose() * pose.R_prev_cur, {}}.angle_rad();
  drift.step_rms_m = std::sqrt(drift.step_rms_m / drift.frames),
  drift.step_turn_rms_rad = std::sqrt(drift.step_turn_rms_rad / drift.frames);
  drift.rms_px /= drift.frames, drift.share /= drift.frames;
  return drift;
}

std::string text_of(const Drift& d) {
  using searvins::examples::kDegPerRad;
  std::ostringstream out;
  out << d.frames + 1 << " frames, " << d.distance_m << " m: drift " << 100 * d.end_error_m / d.distance_m << " %, "
      << kDegPerRad * d.end_turn_rad / d.distance_m << " deg/m; a step is off by " << d.step_rms_m << " m and "
      << kDegPerRad * d.step_turn_rms_rad << " deg rms; inliers " << 100 * d.share << " %, " << d.rms_px << " px";
  return out.str();
}

}  // namespace

TEST_CASE("stereo odometry on real tracks of two drives: drift per distance") {
  const auto shared = shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto folder = *shared / "data/real/kitti_stereo_tracks";
  const Drive few = read_drive(folder / "VO_calibration.txt", folder / "VO_camera_poses_large.txt", folder / "VO_stereo_factors_large.txt");
  const Drive many = read_drive(folder / "VO_calibration00s.txt", folder / "VO_camera_poses00s.txt", folder / "VO_stereo_factors00s.txt");
  REQUIRE(few.frames.size() == 26);
  REQUIRE(many.frames.size() == 77);
  using searvins::examples::kDegPerRad;
  const Drift a = chain(few, {}), b = chain(many, {});
  MESSAGE(text_of(a));
  MESSAGE(text_of(b));
  for (const Drift& d : {a, b}) {
    CHECK(d.end_error_m < 0.002 * d.distance_m);
    CHECK(kDegPerRad * d.end_turn_rad < 0.005 * d.distance_m);
    CHECK(d.share > 0.95);
  }
  const Drift spoiled = chain(many, {}, 0.4);
  MESSAGE("with 40 % of the associations exchanged: " << text_of(spoiled));
  CHECK(spoiled.end_error_m < 0.003 * spoiled.distance_m);
  CHECK(kDegPerRad * spoiled.end_turn_rad < 0.006 * spoiled.distance_m);
  CHECK(spoiled.share < 0.65);
}
