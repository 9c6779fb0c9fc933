// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The whole frontend on a textured plane under known motion: identities, places, depths; and what drivers deliver when they fail.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <searvins/math/so3.hpp>
#include <searvins/vision/frontend.hpp>

#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/synthetic_texture.hpp"
#include "support/property.hpp"

using namespace searvins;
using examples::GrayImage;
using SmallFrontend = orb::OrbFrontend<256>;
using vision::CameraMotion;

namespace {

vision::ImagePair pair_of(const GrayImage& left, const GrayImage& right) { return {left.view(), right.view(), {}, {}}; }

orb::OrbOptions small_options() {
  orb::OrbOptions options;
  options.extractor.features = 200;
  return options;
}

/// A drive towards the plane and along it, with a turn.
struct Drive {
  test::TexturedPlane plane;
  vision::StereoCamera<double> camera = test::small_camera();
  CameraMotion step{so3::exp(Eigen::Vector3d{0.002, 0.012, -0.004}), {0.03, -0.01, 0.06}};

  [[nodiscard]] CameraMotion pose(int k) const {
    CameraMotion pose;
    for (int i = 0; i < k; ++i) pose = pose.then(step);
    return pose;
  }
  [[nodiscard]] GrayImage image(int k, bool right) const { return plane.image(camera, pose(k).R_prev_cur, pose(k).t_prev_cur_m, right); }
  /// The point of the plane that a left pixel of frame k shows, in the world.
  [[nodiscard]] Eigen::Vector3d point(int k, double u, double v) const {
    return plane.point(camera, pose(k).R_prev_cur, pose(k).t_prev_cur_m, u, v);
  }
};

struct Followed {
  int continued{0}, in_view{0}, strayed{0}, observations{0};
  double disparity_error2{0};
  int longest{0};
};

/// Drives `frames` frames and compares every observation with the plane.
Followed follow(const Drive& drive, SmallFrontend& frontend, int frames, bool is_predicted) {
  Followed result;
  std::map<std::uint64_t, Eigen::Vector3d> first_point;
  std::map<std::uint64_t, int> length;
  for (int k = 0; k < frames; ++k) {
    const GrayImage left = drive.image(k, false), right = drive.image(k, true);
    SmallFrontend::Frame frame;
    const std::optional<CameraMotion> predicted = is_predicted && k > 0 ? std::optional{drive.step} : std::nullopt;
    REQUIRE(frontend.process(pair_of(left, right), predicted, frame).ok());
    std::set<std::uint64_t> tracks;
    for (const vision::StereoObservation& o : frame.observations) {
      CHECK(tracks.insert(o.track).second);
      CHECK(o.finite());
      CHECK((o.score >= 0 && o.score <= 1));
      ++result.observations;
      const Eigen::Vector3d p_w = drive.point(k, o.pixel_px[0], o.pixel_px[2]);
      const Eigen::Vector3d p_c = drive.pose(k).to_current(p_w);
      const double error = o.disparity_px() - drive.camera.disparity_px(p_c.z());
      if (std::abs(error) < 1)
        result.disparity_error2 += error * error;
      else
        ++result.strayed;
      const auto [at, is_new] = first_point.try_emplace(o.track, p_w);
      if (!is_new && (at->second - p_w).norm() > 3 * p_c.z() / drive.camera.fx_px) ++result.strayed;
      result.longest = std::max(result.longest, ++length[o.track]);
    }
    if (k == 0) continue;
    result.continued += static_cast<int>(frontend.statistics().continued());
    for (const std::size_t count : frontend.statistics().temporal) result.in_view += static_cast<int>(count);
  }
  return result;
}

}  // namespace

TEST_CASE("Tracks on a textured plane keep their numbers, their places and their depths") {
  for (const bool is_predicted : {true, false}) {
    CAPTURE(is_predicted);
    const Drive drive{{test::Texture{77}}};
    SmallFrontend frontend{drive.camera, small_options()};
    const Followed f = follow(drive, frontend, 10, is_predicted);
    const double rms_px = std::sqrt(f.disparity_error2 / f.observations);
    MESSAGE("plane, " << std::string(is_predicted ? "predicted" : "not predicted") << ": " << f.observations << " observations, "
                      << f.continued << " of " << f.in_view << " continued, " << f.strayed << " strayed, disparity rms " << rms_px
                      << " px, longest " << f.longest);
    CHECK(f.observations > 900);
    CHECK(f.continued > 0.6 * f.in_view);
    CHECK(f.strayed < (is_predicted ? 0.03 : 0.05) * f.observations);
    CHECK(rms_px < 0.15);
    CHECK(f.longest == 10);
  }
}

TEST_CASE("A camera at rest: nearly every track goes on; a track number is never used twice") {
  const Drive drive{{test::Texture{5}}};
  SmallFrontend frontend{drive.camera, small_options()};
  const GrayImage left = drive.image(0, false), right = drive.image(0, true), black(320, 240);
  std::set<std::uint64_t> before, after;
  SmallFrontend::Frame frame;
  for (int k = 0; k < 4; ++k) {
    frame = {};
    REQUIRE(frontend.process(pair_of(left, right), CameraMotion{}, frame).ok());
    for (const auto& o : frame.observations) before.insert(o.track);
    if (k > 0) CHECK(frontend.statistics().continued() == frontend.tracks().size());
  }
  for (int k = 0; k < 4; ++k) REQUIRE(frontend.process(pair_of(black, black), CameraMotion{}, frame).ok());
  for (int k = 0; k < 2; ++k) {
    frame = {};
    REQUIRE(frontend.process(pair_of(left, right), CameraMotion{}, frame).ok());
  }
  for (const auto& o : frame.observations) after.insert(o.track);
  REQUIRE(after.size() > 50);
  for (const std::uint64_t track : after) CHECK_FALSE(before.contains(track));
}

TEST_CASE("A track survives a missed frame and no more than max_missed of them") {
  const Drive drive{{test::Texture{8}}};
  const GrayImage left = drive.image(0, false), right = drive.image(0, true), black(320, 240);
  for (const int missed : {1, 2, 3}) {
    CAPTURE(missed);
    SmallFrontend frontend{drive.camera, small_options()};
    SmallFrontend::Frame frame;
    REQUIRE(frontend.process(pair_of(left, right), std::nullopt, frame).ok());
    std::set<std::uint64_t> tracks;
    for (const auto& o : frame.observations) tracks.insert(o.track);
    for (int k = 0; k < missed; ++k) {
      frame = {};
      REQUIRE(frontend.process(pair_of(black, black), CameraMotion{}, frame).ok());
      CHECK(frame.observations.empty());
    }
    CHECK(frontend.problems(orb::ImageProblem::featureless) == static_cast<std::size_t>(missed));
    frame = {};
    REQUIRE(frontend.process(pair_of(left, right), CameraMotion{}, frame).ok());
    const auto kept =
        std::count_if(frame.observations.begin(), frame.observations.end(), [&](const auto& o) { return tracks.contains(o.track); });
    if (missed <= frontend.options().max_missed)
      CHECK(kept == static_cast<std::ptrdiff_t>(frame.observations.size()));
    else
      CHECK(kept == 0);
  }
}

TEST_CASE("The same images give the same bits") {
  const Drive drive{{test::Texture{9}}};
  SmallFrontend one{drive.camera, small_options()}, two{drive.camera, small_options()};
  for (int k = 0; k < 3; ++k) {
    const GrayImage left = drive.image(k, false), right = drive.image(k, true);
    SmallFrontend::Frame a, b;
    REQUIRE(one.process(pair_of(left, right), drive.step, a).ok());
    REQUIRE(two.process(pair_of(left, right), drive.step, b).ok());
    REQUIRE(a.observations.size() == b.observations.size());
    for (std::size_t i = 0; i < a.observations.size(); ++i) {
      CHECK(a.observations[i].track == b.observations[i].track);
      CHECK(a.observations[i].pixel_px == b.observations[i].pixel_px);
      CHECK(a.observations[i].score == b.observations[i].score);
    }
  }
}

TEST_CASE("Missing, unequal and tiny images are refused, counted, and leave the tracks alone") {
  const Drive drive{{test::Texture{10}}};
  const GrayImage left = drive.image(0, false), right = drive.image(0, true), narrow(300, 240), tiny(20, 20);
  SmallFrontend frontend{drive.camera, small_options()};
  SmallFrontend::Frame frame;
  REQUIRE(frontend.process(pair_of(left, right), std::nullopt, frame).ok());
  const std::size_t tracks = frontend.tracks().size();
  REQUIRE(tracks > 50);
  frame = {};
  CHECK(frontend.process(pair_of(left, {}), std::nullopt, frame).code == StatusCode::no_data);
  CHECK(frontend.process(pair_of({}, right), std::nullopt, frame).code == StatusCode::no_data);
  CHECK(frontend.process(pair_of(left, narrow), std::nullopt, frame).code == StatusCode::invalid_argument);
  CHECK(frontend.process(pair_of(tiny, tiny), std::nullopt, frame).code == StatusCode::invalid_argument);
  CHECK(frontend.problems(orb::ImageProblem::missing_left) == 1);
  CHECK(frontend.problems(orb::ImageProblem::missing_right) == 1);
  CHECK(frontend.problems(orb::ImageProblem::sizes_differ) == 1);
  CHECK(frontend.problems(orb::ImageProblem::too_small) == 1);
  CHECK(frame.observations.empty());
  CHECK(frontend.tracks().size() == tracks);
  REQUIRE(frontend.process(pair_of(left, right), CameraMotion{}, frame).ok());
  CHECK(frontend.statistics().continued() == tracks);
}

TEST_CASE("Black, white, half white, and a prediction that is not finite: fewer observations, no failure") {
  const Drive drive{{test::Texture{12}}};
  const GrayImage left = drive.image(0, false), right = drive.image(0, true), black(320, 240), white(320, 240, 255);
  SmallFrontend frontend{drive.camera, small_options()};
  SmallFrontend::Frame frame;
  for (const GrayImage* image : {&black, &white}) {
    REQUIRE(frontend.process(pair_of(*image, *image), std::nullopt, frame).ok());
    CHECK(frame.observations.empty());
    CHECK(frontend.statistics().left_features == 0);
  }
  CHECK(frontend.problems(orb::ImageProblem::featureless) == 2);
  GrayImage burnt_left = left, burnt_right = right;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 320; ++x) burnt_left(x, y) = burnt_right(x, y) = 255;
  REQUIRE(frontend.process(pair_of(burnt_left, burnt_right), std::nullopt, frame).ok());
  CHECK(frame.observations.size() > 20);
  for (const auto& o : frame.observations) CHECK(o.pixel_px[2] > 115);
  CameraMotion broken;
  broken.t_prev_cur_m.x() = std::nan("");
  frame = {};
  REQUIRE(frontend.process(pair_of(burnt_left, burnt_right), broken, frame).ok());
  CHECK(frontend.statistics().continued() > 20);
}

TEST_CASE("Through CheckedFrontend times and the calibrated size are checked too") {
  const Drive drive{{test::Texture{13}}};
  const GrayImage left = drive.image(0, false), right = drive.image(0, true), black(320, 240);
  SmallFrontend frontend{drive.camera, small_options()};
  vision::CheckedFrontend checked{frontend, {320, 240}};
  SmallFrontend::Frame frame;
  vision::ImagePair images = pair_of(left, right);
  REQUIRE(checked.process(images, std::nullopt, frame).ok());
  CHECK(frame.observations.size() > 50);
  images.time_left.ns = 50'000'000;  // half a period of a 10 Hz camera
  CHECK_FALSE(checked.process(images, std::nullopt, frame).ok());
  CHECK(checked.count(vision::ImageFate::skewed) == 1);
  images.time_right = images.time_left;
  REQUIRE(checked.process({black.view(), black.view(), images.time_left, images.time_left}, std::nullopt, frame).ok());
  CHECK(checked.count(vision::ImageFate::featureless) == 1);
}

TEST_CASE("5000 keypoints: the frame takes what it has room for, the best, and counts the rest") {
  const vision::StereoCamera<double> camera = [] {
    vision::StereoCamera<double> c = test::small_camera();
    c.width_px = 800, c.height_px = 600;
    return c;
  }();
  const test::Texture fine{14, 4};
  const GrayImage left = test::texture_image(fine, 800, 600), right = test::texture_image(fine, 800, 600, 10);
  orb::OrbOptions options;
  options.extractor.features = 5000;
  options.extractor.levels = 2;
  options.max_tracks = 1500;
  SmallFrontend frontend{camera, options};
  SmallFrontend::Frame frame;
  REQUIRE(frontend.process(pair_of(left, right), std::nullopt, frame).ok());
  const orb::FrameStatistics& s = frontend.statistics();
  MESSAGE(s.left_features << " features, " << s.stereo_matched() << " matched, " << s.begun << " tracks, " << frame.dropped
                          << " observations dropped");
  CHECK(s.left_features > 3000);
  CHECK(s.left_features <= 5000);
  CHECK(s.begun == 1500);
  CHECK(s.not_begun == s.stereo_matched() - 1500);
  CHECK(frame.observations.size() == SmallFrontend::Frame::kCapacity);
  CHECK(frame.dropped == s.observations - frame.observations.size());
}
