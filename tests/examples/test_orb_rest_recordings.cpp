// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From real pixels to admission and the stop cue: twelve pairs of a camera at rest (EuRoC V1_01, 20 Hz; its rotors run), and motion that
/// must not be taken for rest: pictures that pan or tilt, the same tracks carried along at a known speed, the tracks of a car and its
/// streets seen slowly.
///
/// What does not move is its own truth: depth must repeat within what triangulation predicts, PnP must find no motion. The inertial unit
/// of the recording (no turn, no change of specific force over these frames) confirms the rest; the published poses, which begin half a
/// second later, keep within 2.5 mm.
///
/// Twelve frames are 0.55 s. Where longer rest is wanted the pairs are played to and fro: consecutive pictures are different ones then too.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/vision/admission.hpp>
#include <searvins/vision/rectification.hpp>

#include "examples/datasets/euroc.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/orb_frontend/remap.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;

namespace {

using Frontend = orb::OrbFrontend<512>;
using Frame = Frontend::Frame;
using Admission = vision::StereoAdmission<512>;
constexpr double kRateHz = 20, kCarRateHz = 10;

struct Pictures {
  vision::StereoCamera<double> camera{};
  std::vector<examples::GrayImage> left, right;
  io::ImuLog imu{};
  GpsTime first{}, last{};
};

std::optional<Pictures> read_pictures() {
  const auto shared = test::shared_data();
  if (!shared) return std::nullopt;
  const auto recording = examples::read_euroc(*shared / "data/real/euroc_v101_static");
  if (recording.error) return std::nullopt;
  const auto rectification = vision::rectify(examples::stereo_calibration(recording.value.left, recording.value.right));
  std::array<orb::Remap, 2> remaps;
  if (!rectification || !remaps[0].build(*rectification, vision::Eye::left).ok() ||
      !remaps[1].build(*rectification, vision::Eye::right).ok())
    return std::nullopt;
  Pictures pictures;
  pictures.camera = rectification->camera();
  pictures.imu = recording.value.imu;
  pictures.first = recording.value.pairs.front().time, pictures.last = recording.value.pairs.back().time;
  for (const examples::EurocPair& pair : recording.value.pairs) {
    const auto raw = examples::read_euroc_pair(recording.value, pair);
    if (!raw || !remaps[0].apply(raw->left.view(), pictures.left.emplace_back()).ok() ||
        !remaps[1].apply(raw->right.view(), pictures.right.emplace_back()).ok())
      return std::nullopt;
  }
  return pictures;
}

/// The recording, read once; nullptr where the shared data is not there.
const Pictures* pictures() {
  static const std::optional<Pictures> all = read_pictures();
  if (!all) MESSAGE("SKIPPED: shared data not found (data/real/euroc_v101_static)");
  return all ? &*all : nullptr;
}

/// Number of the pair that is the k-th picture when n pairs are played to and fro: 0 .. n-1, n-2 .. 0, 1 ..
std::size_t to_and_fro(std::size_t k, std::size_t n) {
  const std::size_t at = k % (2 * n - 2);
  return at < n ? at : 2 * n - 2 - at;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double x : values) sum += x * x;
  return std::sqrt(sum / static_cast<double>(values.size()));
}
double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }
/// Median of the absolute values.
double median_size(std::vector<double> values) {
  for (double& x : values) x = std::abs(x);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

using Frames = std::vector<Frame>;

/// What the frontend made of some pictures.
struct Tracked {
  Frames frames;
  std::size_t features{0}, matched{0};
};

/// `predicted`: whether the frontend is told that nothing moved, as the inertial unit would.
Tracked track(const Pictures& pictures, std::size_t frames, bool predicted) {
  Frontend frontend{pictures.camera};
  Tracked all;
  for (std::size_t k = 0; k < frames; ++k) {
    const std::size_t i = to_and_fro(k, pictures.left.size());
    const auto motion = predicted && k > 0 ? std::optional{vision::CameraMotion{}} : std::nullopt;
    REQUIRE(frontend.process({pictures.left[i].view(), pictures.right[i].view(), {}, {}}, motion, all.frames.emplace_back()).ok());
    all.features += frontend.statistics().left_features, all.matched += frontend.statistics().stereo_matched();
  }
  return all;
}

/// A second and a half of rest, told so: made once.
const Tracked& tracked_at_rest(const Pictures& pictures) {
  static const Tracked tracked = track(pictures, 30, true);
  return tracked;
}

/// What admission makes of frames, and how well these repeat, where nothing moves.
struct Rest {
  std::size_t frames{0}, offered{0}, admitted{0}, usable{0}, inliers{0};
  std::vector<bool> cue;                             ///< of each frame
  std::vector<double> rows_px;                       ///< v_left - v_right of every observation
  std::vector<double> depth_in_sigmas, depth_share;  ///< change between frames: in sigmas of both; of the depth, at 2 to 5 m
  std::vector<double> way_m, turn_rad;               ///< motion that PnP finds between frames
  std::vector<double> way_in_sigmas, turn_in_sigmas;
  std::vector<double> residual_px;

  [[nodiscard]] int first_cue() const { return static_cast<int>(std::find(cue.begin(), cue.end(), true) - cue.begin()); }
  [[nodiscard]] double cue_percent(std::size_t from) const {
    const auto up = std::count(cue.begin() + static_cast<std::ptrdiff_t>(from), cue.end(), true);
    return 100.0 * static_cast<double>(up) / static_cast<double>(cue.size() - from);
  }
};

/// Changes of depth of the tracks that two frames share, outliers of the motion left out.
void compare_depths(const vision::StereoCamera<double>& camera, const Frame& before, const Frame& now, const Admission::Admitted& out,
                    double sigma_px, Rest& rest) {
  const Eigen::Matrix3d covariance = sigma_px * sigma_px * Eigen::Matrix3d::Identity();
  std::map<std::uint64_t, vision::StereoPoint<double>> points;
  for (const auto& o : before.observations)
    if (const auto p = vision::triangulate(camera, o.pixel_px, covariance); p.ok()) points[o.track] = *p;
  for (std::size_t i = 0; i < now.observations.size(); ++i) {
    const auto seen = points.find(now.observations[i].track);
    const auto p = vision::triangulate(camera, now.observations[i].pixel_px, covariance);
    if (seen == points.end() || !p.ok() || out.fates[i] == vision::ObservationFate::motion_outlier) continue;
    const double change_m = p->p_c_m.z() - seen->second.p_c_m.z();
    rest.depth_in_sigmas.push_back(change_m / std::sqrt(p->covariance_c_m2(2, 2) + seen->second.covariance_c_m2(2, 2)));
    if (p->p_c_m.z() >= 2 && p->p_c_m.z() <= 5) rest.depth_share.push_back(change_m / p->p_c_m.z());
  }
}

/// Offers frames to admission, `rate_hz` of them a second; `look(k, admitted)` after each.
template <class Look>
void admit(const vision::StereoCamera<double>& camera, const Frames& frames, double rate_hz, const vision::AdmissionOptions& options,
           bool told_rest, const Look& look) {
  const auto admission = std::make_unique<Admission>(camera, options);
  const auto out = std::make_unique<Admission::Admitted>();
  const auto frame = std::make_unique<Frame>();
  for (std::size_t k = 0; k < frames.size(); ++k) {
    *frame = frames[k];
    frame->time = GpsTime{}.plus_seconds(static_cast<double>(k) / rate_hz);
    const auto predicted = told_rest && k > 0 ? std::optional{vision::PredictedMotion{}} : std::nullopt;
    REQUIRE(admission->add(*frame, predicted, *out).ok());
    look(k, *out);
  }
}

Rest look_at_rest(const vision::StereoCamera<double>& camera, const Frames& frames, double sigma_px) {
  Rest rest;
  rest.frames = frames.size();
  vision::AdmissionOptions options;
  options.pnp.sigma_px = sigma_px;
  admit(camera, frames, kRateHz, options, true, [&](std::size_t k, const Admission::Admitted& out) {
    rest.offered += frames[k].observations.size(), rest.admitted += out.observations.size();
    for (const auto& o : frames[k].observations) rest.rows_px.push_back(o.v_difference_px);
    rest.cue.push_back(out.stands_still);
    if (k == 0) return;
    REQUIRE(out.has_motion);
    compare_depths(camera, frames[k - 1], frames[k], out, sigma_px, rest);
    rest.way_m.push_back(out.motion.t_prev_cur_m.norm()), rest.turn_rad.push_back(out.motion.angle_rad());
    rest.way_in_sigmas.push_back(rest.way_m.back() / std::sqrt(out.covariance.bottomRightCorner<3, 3>().trace()));
    rest.turn_in_sigmas.push_back(rest.turn_rad.back() / std::sqrt(out.covariance.topLeftCorner<3, 3>().trace()));
    rest.residual_px.push_back(out.pnp.rms_px);
    rest.inliers += out.pnp.inliers, rest.usable += out.pnp.usable;
  });
  return rest;
}

/// Frames in which the cue is up.
std::size_t frames_with_cue(const vision::StereoCamera<double>& camera, const Frames& frames, double rate_hz) {
  const vision::AdmissionOptions options;
  std::size_t up = 0;
  admit(camera, frames, rate_hz, options, false, [&](std::size_t, const Admission::Admitted& out) { up += out.stands_still ? 1U : 0U; });
  return up;
}

/// Frames as they would have been seen from a camera that moves by `step_c_m` from one to the next, in its own axes; each point is taken
/// to be where its observation says, so that the noise of the observations stays. Points that the camera passes are left out.
Frames carried_along(const vision::StereoCamera<double>& camera, const Frames& at_rest, const Eigen::Vector3d& step_c_m) {
  Frames moving;
  for (std::size_t k = 0; k < at_rest.size(); ++k) {
    Frame& frame = moving.emplace_back();
    for (vision::StereoObservation o : at_rest[k].observations) {
      const auto seen = camera.project(vision::point_at(camera, o.pixel_px) - static_cast<double>(k) * step_c_m);
      if (!seen.ok()) continue;
      o.pixel_px = *seen;
      frame.add(o);
    }
  }
  return moving;
}

double percent(std::size_t part, std::size_t whole) { return 100.0 * static_cast<double>(part) / static_cast<double>(whole); }

void show(const std::string& name, const Rest& r) {
  MESSAGE(name << ", " << r.frames << " frames: row difference " << rms(r.rows_px) << " px rms; offered " << r.offered / r.frames
               << ", admitted " << r.admitted / r.frames << " a frame");
  MESSAGE("  depth from frame to frame: " << rms(r.depth_in_sigmas) << " sigma rms over " << r.depth_in_sigmas.size() << " changes; "
                                          << 100 * rms(r.depth_share) << " % rms, " << 100 * median_size(r.depth_share)
                                          << " % in the median at 2 to 5 m");
  MESSAGE("  false motion a frame: " << 1e3 * rms(r.way_m) << " mm and " << 1e3 * rms(r.turn_rad) << " mrad rms, at most "
                                     << 1e3 * largest(r.way_m) << " mm and " << 1e3 * largest(r.turn_rad) << " mrad; "
                                     << rms(r.way_in_sigmas) << " and " << rms(r.turn_in_sigmas) << " sigma rms; inliers "
                                     << percent(r.inliers, r.usable) << " % of " << r.usable / r.way_m.size() << ", residual "
                                     << rms(r.residual_px) << " px");
  MESSAGE("  cue up in " << r.cue_percent(0) << " % of the frames, first in frame " << r.first_cue() << " (from 0)");
}

/// A car's drive from KITTI: 10 Hz, one frame a pose.
struct Car {
  vision::StereoCamera<double> camera{};
  Frames frames;
  double slowest_mps{1e9};
};

Car read_car(const std::filesystem::path& folder, const std::string& size, const std::string& calibration) {
  Car car;
  vision::StereoCamera<double>& c = car.camera;
  double skew = 0;
  std::ifstream(folder / calibration) >> c.fx_px >> c.fy_px >> skew >> c.cx_px >> c.cy_px >> c.baseline_m;
  c.width_px = 1241, c.height_px = 376;
  std::map<int, Frame> frames;
  std::ifstream tracks(folder / ("VO_stereo_factors" + size + ".txt"));
  Eigen::Vector3d unused;
  vision::StereoObservation o;
  for (int pose = 0; tracks >> pose >> o.track >> o.pixel_px[0] >> o.pixel_px[1] >> o.pixel_px[2] >> unused[0] >> unused[1] >> unused[2];)
    frames[pose].add(o);
  for (const auto& [pose, frame] : frames) car.frames.push_back(frame);
  std::optional<Eigen::Vector3d> before;
  std::ifstream poses(folder / ("VO_camera_poses" + size + ".txt"));
  Eigen::Matrix4d T;
  for (int pose = 0; poses >> pose;) {
    for (int i = 0; i < 16; ++i) poses >> T(i / 4, i % 4);
    const Eigen::Vector3d place_m = T.topRightCorner<3, 1>();
    if (before) car.slowest_mps = std::min(car.slowest_mps, kCarRateHz * (place_m - *before).norm());
    before = place_m;
  }
  return car;
}

std::vector<Car> read_cars(const std::filesystem::path& shared) {
  const auto folder = shared / "data/real/kitti_stereo_tracks";
  return {read_car(folder, "_large", "VO_calibration.txt"), read_car(folder, "00s", "VO_calibration00s.txt")};
}

/// A street that a camera at rest looks at: the points of one frame again and again, with noise.
Frames noisy_street(const Frame& street, std::size_t frames, double sigma_px, test::Rng& rng) {
  Frames all(frames, street);
  for (Frame& frame : all)
    for (vision::StereoObservation& o : frame.observations)
      for (int i = 0; i < 3; ++i) o.pixel_px[i] += test::normal(rng, sigma_px);
  return all;
}

}  // namespace

TEST_CASE("Real pairs at rest: depth repeats, PnP finds no motion, the stop cue comes up and stays") {
  const Pictures* const p = pictures();
  if (!p) return;
  REQUIRE(p->left.size() == 12);

  const Tracked& told = tracked_at_rest(*p);
  const Tracked alone = track(*p, 12, false);
  const Frames twelve(told.frames.begin(), told.frames.begin() + 12);
  const Rest once = look_at_rest(p->camera, twelve, 1), sharp = look_at_rest(p->camera, twelve, 0.3),
             untold = look_at_rest(p->camera, alone.frames, 1), longer = look_at_rest(p->camera, told.frames, 1);
  MESSAGE("matched in stereo " << percent(told.matched, told.features) << " % of " << told.features / told.frames.size()
                               << " features a frame");
  show("sigma 1 px", once);
  show("sigma 0.3 px", sharp);
  show("without prediction", untold);
  show("to and fro", longer);

  CHECK(percent(told.matched, told.features) > 40);
  for (const Rest* r : {&once, &sharp, &untold, &longer}) {
    CHECK(rms(r->rows_px) < 0.35);
    CHECK(rms(r->depth_share) < 0.004);
    CHECK(median_size(r->depth_share) < 0.0015);
    CHECK(rms(r->way_m) < 0.001);
    CHECK(rms(r->turn_rad) < 0.0005);
    CHECK(largest(r->way_m) < 0.0025);
    CHECK(largest(r->turn_rad) < 0.001);
    CHECK(rms(r->way_in_sigmas) < 1);
    CHECK(rms(r->turn_in_sigmas) < 1);
    CHECK(percent(r->inliers, r->usable) > 95);
    CHECK(r->first_cue() == 5);  // five still motions after the first frame
    CHECK(r->cue_percent(5) == 100);
  }
  // The sigma of depth is not understated, and at 0.3 px not ten times too large.
  CHECK(rms(once.depth_in_sigmas) < 1);
  CHECK(rms(sharp.depth_in_sigmas) > 0.05);
}

TEST_CASE("The unit says that the recording's camera rests while the pictures are taken, as it does where poses are published") {
  const Pictures* const p = pictures();
  if (!p) return;
  // Rotors run: single readings mean nothing, their means do.
  struct Mean {
    Eigen::Vector3d gyro_b_radps{Eigen::Vector3d::Zero()}, accel_b_mps2{Eigen::Vector3d::Zero()};
  };
  const auto mean_of = [&](GpsTime from, GpsTime to) {
    Mean mean;
    double count = 0;
    for (const imu::ImuSample& sample : p->imu.samples)
      if (sample.time >= from && sample.time <= to)
        mean.gyro_b_radps += sample.gyro_b_radps, mean.accel_b_mps2 += sample.accel_b_mps2, ++count;
    REQUIRE(count > 50);
    mean.gyro_b_radps /= count, mean.accel_b_mps2 /= count;
    return mean;
  };
  const GpsTime known = p->first.plus_seconds(1.05);  // the first published pose
  const Mean here = mean_of(p->first, p->last), there = mean_of(known, known.plus_seconds(3.65));
  const double rate_radps = (here.gyro_b_radps - there.gyro_b_radps).norm(), force_mps2 = (here.accel_b_mps2 - there.accel_b_mps2).norm();
  MESSAGE("mean rate differs by " << 1e3 * rate_radps << " mrad/s, mean specific force by " << force_mps2 << " m/s^2");
  CHECK(rate_radps < 0.01);
  CHECK(force_mps2 < 0.1);
}

TEST_CASE("Real pictures that pan or tilt by a pixel a frame are no rest") {
  const Pictures* const p = pictures();
  if (!p) return;
  constexpr int kFrames = 12;
  vision::StereoCamera<double> camera = p->camera;
  camera.width_px -= kFrames - 1, camera.height_px -= kFrames - 1;
  for (const Eigen::Vector2i& step_px : {Eigen::Vector2i{1, 0}, {0, 1}}) {
    Frontend frontend{camera};
    Frames all;
    for (int k = 0; k < kFrames; ++k) {
      const auto cut = [&](const examples::GrayImage& image) {
        return image.view().crop(k * step_px.x(), k * step_px.y(), camera.width_px, camera.height_px);
      };
      const auto i = static_cast<std::size_t>(k);
      REQUIRE(frontend.process({cut(p->left[i]), cut(p->right[i]), {}, {}}, std::nullopt, all.emplace_back()).ok());
    }
    // Where the motion that PnP finds moves the points: against the step, for what is cut out moves on. (No turn moves all by the same,
    // the edges of so wide a picture move by half as much again as its middle: the mean counts.)
    std::size_t up = 0, points = 0;
    Eigen::Vector2d moved_px = Eigen::Vector2d::Zero();
    admit(camera, all, kRateHz, {}, false, [&](std::size_t k, const Admission::Admitted& out) {
      up += out.stands_still ? 1U : 0U;
      if (k == 0) return;
      REQUIRE(out.has_motion);
      for (std::size_t i = 0; i < out.fates.size(); ++i) {
        if (out.fates[i] != vision::ObservationFate::admitted) continue;
        const Eigen::Vector3d now = all[k].observations[i].pixel_px;
        const Eigen::Vector3d moved = now - camera.continued(out.motion.to_previous(vision::point_at(camera, now)));
        moved_px += Eigen::Vector2d{moved[0], moved[2]}, ++points;
      }
    });
    REQUIRE(points > 500);
    moved_px /= static_cast<double>(points);
    MESSAGE("step " << step_px.transpose() << " px: the points move by " << moved_px.transpose() << " px a frame, cue in " << up
                    << " frames");
    CHECK((moved_px + step_px.cast<double>()).norm() < 0.1);
    CHECK(up == 0);
  }
}

TEST_CASE("Tracks of real pictures, carried along: the cue is up at rest and never at half a metre a second") {
  const Pictures* const p = pictures();
  if (!p) return;
  const Tracked& told = tracked_at_rest(*p);
  const Frames rest(told.frames.begin(), told.frames.begin() + 12);
  for (const double rate_hz : {20.0, 30.0})
    for (const Eigen::Vector3d& direction : {Eigen::Vector3d{0, 0, 1}, {1, 0, 0}, {0, 0, -1}}) {
      const auto up = [&](double speed_mps) {
        return frames_with_cue(p->camera, carried_along(p->camera, rest, speed_mps / rate_hz * direction), rate_hz);
      };
      CAPTURE(rate_hz);
      CAPTURE(direction.transpose());
      CHECK(up(0) == 7);
      for (const double speed_mps : {0.5, 2.0}) CHECK(up(speed_mps) == 0);
    }
}

TEST_CASE("Tracks of a car: no cue while it drives") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found (data/real/kitti_stereo_tracks)");
    return;
  }
  for (const Car& car : read_cars(*shared)) {
    REQUIRE(car.frames.size() >= 26);
    const std::size_t up = frames_with_cue(car.camera, car.frames, kCarRateHz);
    MESSAGE(car.frames.size() << " frames of a car at " << car.slowest_mps << " m/s and more: cue in " << up);
    CHECK(car.slowest_mps > 5);
    CHECK(up == 0);
  }
}

TEST_CASE("The car's streets seen slowly: the cue is up at rest, and not above the speed that its bound means at the frame rate") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found (data/real/kitti_stereo_tracks)");
    return;
  }
  test::Rng rng{5};
  const std::vector<Car> cars = read_cars(*shared);
  const auto cue_percent = [&](double speed_mps, double rate_hz) {
    constexpr std::size_t kFrames = 12, kFirst = 5;
    std::size_t up = 0, frames = 0;
    for (const Car& car : cars)
      for (std::size_t i = 0; i < car.frames.size(); i += 26) {
        const Frames street = noisy_street(car.frames[i], kFrames, 0.5, rng);
        up += frames_with_cue(car.camera, carried_along(car.camera, street, {0, 0, speed_mps / rate_hz}), rate_hz);
        frames += kFrames - kFirst;
      }
    return percent(up, frames);
  };
  // What is far away hardly moves in the picture, so the bound on the way between frames decides: 0.2 m/s.
  for (const double rate_hz : {10.0, 20.0, 30.0}) {
    const double at_rest = cue_percent(0, rate_hz), slow = cue_percent(0.3, rate_hz), faster = cue_percent(0.5, rate_hz),
                 fast = cue_percent(1, rate_hz);
    MESSAGE(rate_hz << " Hz: cue in " << at_rest << " % at rest, " << slow << " % at 0.3 m/s, " << faster << " % at 0.5 m/s, " << fast
                    << " % at 1 m/s (frames from the sixth on)");
    CHECK(at_rest > 90);
    CHECK(faster == 0);
    CHECK(fast == 0);
    CHECK(slow == 0);
  }
}
