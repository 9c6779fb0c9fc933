// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/core/spsc_queue.hpp>
#include <searvins/vision/frontend.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using namespace searvins::vision;

namespace {

/// A picture with its memory; every row is longer than the picture, as cameras deliver it.
struct Picture {
  static constexpr int kPadding = 5;
  int width, height;
  std::vector<std::uint8_t> grey;

  Picture(int w, int h, int fill)
      : width(w), height(h), grey(static_cast<std::size_t>((w + kPadding) * h), static_cast<std::uint8_t>(fill)) {}
  std::uint8_t& at(int x, int y) { return grey[static_cast<std::size_t>(y * (width + kPadding) + x)]; }
  [[nodiscard]] ImageView view() const { return {grey.data(), width, height, width + kPadding}; }
};

Picture textured(Rng& rng, int width = 96, int height = 64) {
  Picture picture(width, height, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) picture.at(x, y) = static_cast<std::uint8_t>(integer(rng, 0, 255));
  return picture;
}

/// Sees one point: where the brightest pixel is. Fails when told to.
struct BrightestPixel {
  using Frame = StereoFrame<4>;
  bool fails{false};
  int calls{0};

  Status process(const ImagePair& images, const std::optional<CameraMotion>& predicted, Frame& frame) {
    ++calls;
    StereoObservation o;
    o.track = predicted ? 2 : 1;
    int best = -1;
    for (int y = 0; y < images.left.height; ++y)
      for (int x = 0; x < images.left.width; ++x)
        if (images.left(x, y) > best) best = images.left(x, y), o.pixel_px = Eigen::Vector3d(x, x - 1, y);
    (void)frame.add(o);
    return fails ? failure(StatusCode::no_data, "told to fail") : ok_status();
  }
};
static_assert(VisionFrontend<BrightestPixel> && VisionFrontend<CheckedFrontend<BrightestPixel>>);

struct WrongFrame {
  using Frame = BrightestPixel::Frame;
  void process(const ImagePair&, const std::optional<CameraMotion>&, Frame&) {}
};
static_assert(!VisionFrontend<WrongFrame>);

GpsTime at_s(double seconds) { return GpsTime::from_week_sow(2323, 1000 + seconds); }

}  // namespace

TEST_CASE("a good pair reaches the frontend; its time and the prediction go along") {
  Rng rng{2};
  const Picture left = textured(rng), right = textured(rng);
  BrightestPixel inner;
  CheckedFrontend checked(inner);
  BrightestPixel::Frame frame;
  REQUIRE(checked.process({left.view(), right.view(), at_s(1), at_s(1.001)}, std::nullopt, frame).ok());
  CHECK(frame.time == at_s(1));
  REQUIRE(frame.observations.size() == 1);
  CHECK(frame.observations[0].track == 1);
  REQUIRE(checked.process({left.view(), right.view(), at_s(1.1), at_s(1.1)}, CameraMotion{}, frame).ok());
  REQUIRE(frame.observations.size() == 1);
  CHECK(frame.observations[0].track == 2);
  CHECK(checked.count(ImageFate::processed) == 2);
}

TEST_CASE("images of different sizes are refused, and so is a pair that is not of the calibrated size") {
  Rng rng{3};
  const Picture left = textured(rng, 96, 64), right = textured(rng, 96, 62), small = textured(rng, 48, 32);
  BrightestPixel inner;
  ImagePairLimits limits;
  limits.width = 96, limits.height = 64;
  CheckedFrontend checked(inner, limits);
  BrightestPixel::Frame frame;
  CHECK(checked.process({left.view(), right.view(), at_s(1), at_s(1)}, {}, frame).code == StatusCode::invalid_argument);
  CHECK(checked.process({small.view(), small.view(), at_s(1), at_s(1)}, {}, frame).code == StatusCode::invalid_argument);
  CHECK(checked.count(ImageFate::sizes_differ) == 1);
  CHECK(checked.count(ImageFate::size_unexpected) == 1);
  CHECK(inner.calls == 0);
  CHECK(frame.observations.empty());
}

TEST_CASE("a missing image is refused") {
  Rng rng{4};
  const Picture picture = textured(rng);
  BrightestPixel inner;
  CheckedFrontend checked(inner);
  BrightestPixel::Frame frame;
  CHECK(checked.process({picture.view(), {}, at_s(1), at_s(1)}, {}, frame).code == StatusCode::no_data);
  CHECK(checked.process({{}, picture.view(), at_s(1), at_s(1)}, {}, frame).code == StatusCode::no_data);
  CHECK(checked.count(ImageFate::no_right) == 1);
  CHECK(checked.count(ImageFate::no_left) == 1);
  CHECK(inner.calls == 0);
}

TEST_CASE("time stamps off by half a period: halves of different pairs are refused") {
  Rng rng{5};
  const Picture picture = textured(rng);
  BrightestPixel inner;
  CheckedFrontend checked(inner);
  BrightestPixel::Frame frame;
  const auto offered = [&](double left_s, double right_s) {
    return checked.process({picture.view(), picture.view(), at_s(left_s), at_s(right_s)}, {}, frame);
  };
  CHECK(offered(1, 1.05).code == StatusCode::stale);
  CHECK(offered(1, 0.95).code == StatusCode::stale);
  CHECK(offered(1, 1.0051).code == StatusCode::stale);
  CHECK(offered(1, 1.0049).ok());
  CHECK(checked.count(ImageFate::skewed) == 3);
  CHECK(inner.calls == 1);
  CHECK(offered(1, 1).code == StatusCode::out_of_order);
  CHECK(offered(0.9, 0.9).code == StatusCode::out_of_order);
  CHECK(checked.count(ImageFate::out_of_order) == 2);
  CHECK(offered(1.1, 1.1).ok());
}

TEST_CASE("an all-black or overexposed stretch gives frames without observations, then goes on") {
  Rng rng{6};
  const Picture picture = textured(rng), black(96, 64, 0), white(96, 64, 255);
  BrightestPixel inner;
  CheckedFrontend checked(inner);
  BrightestPixel::Frame frame;
  for (int i = 0; i < 10; ++i) {
    const bool dark = i >= 3 && i < 7;
    const Picture& shown = !dark ? picture : i % 2 == 0 ? black : white;
    REQUIRE(checked.process({shown.view(), picture.view(), at_s(0.1 * i), at_s(0.1 * i)}, {}, frame).ok());
    CHECK(frame.observations.size() == (dark ? 0 : 1));
    CHECK(frame.time == at_s(0.1 * i));
  }
  CHECK(checked.count(ImageFate::featureless) == 4);
  CHECK(checked.count(ImageFate::processed) == 6);
  CHECK(coarse_contrast(black.view()) == 0);
  Picture nearly = black;
  nearly.at(0, 0) = 8;
  CHECK(coarse_contrast(nearly.view()) == 8);
}

TEST_CASE("a frontend that fails is counted, and what it left behind is not handed on") {
  Rng rng{7};
  const Picture picture = textured(rng);
  BrightestPixel inner;
  inner.fails = true;
  CheckedFrontend checked(inner);
  BrightestPixel::Frame frame;
  CHECK_FALSE(checked.process({picture.view(), picture.view(), at_s(1), at_s(1)}, {}, frame).ok());
  CHECK(frame.observations.empty());
  CHECK(checked.count(ImageFate::frontend_failed) == 1);
}

TEST_CASE("a frontend in a thread of its own gives the estimator the same frames as one that is called") {
  Rng rng{8};
  std::vector<Picture> pictures;
  for (int i = 0; i < 30; ++i) pictures.push_back(textured(rng));
  const auto pair_of = [&](std::size_t i) {
    return ImagePair{pictures[i].view(), pictures[i].view(), at_s(0.1 * static_cast<double>(i)), at_s(0.1 * static_cast<double>(i))};
  };
  std::vector<BrightestPixel::Frame> called(pictures.size());
  BrightestPixel direct;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    called[i].time = pair_of(i).time_left;
    REQUIRE(direct.process(pair_of(i), {}, called[i]).ok());
  }

  SpscQueue<BrightestPixel::Frame, 3> queue;
  std::thread frontend([&] {
    BrightestPixel inner;
    CheckedFrontend checked(inner);
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      BrightestPixel::Frame* slot = nullptr;
      while (!(slot = queue.back())) std::this_thread::yield();
      (void)checked.process(pair_of(i), {}, *slot);
      queue.publish();
    }
  });
  std::size_t same = 0;
  for (std::size_t i = 0; i < pictures.size();) {
    const BrightestPixel::Frame* const frame = queue.front();
    if (!frame) {
      std::this_thread::yield();
      continue;
    }
    same += frame->time == called[i].time && frame->observations.size() == 1 &&
            frame->observations[0].pixel_px == called[i].observations[0].pixel_px;
    queue.pop();
    ++i;
  }
  frontend.join();
  CHECK(same == pictures.size());
}
