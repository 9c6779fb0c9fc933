// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Time of the ORB frontend on a pair, one thread: all of it, and its parts. Real pairs of 752 x 480 from the shared data where they are, a
/// texture of that size elsewhere; 2048 x 732 by enlarging (the cost depends on the size and on how much there is to find). 500 features,
/// the project's own flags (-O3, no -march). What it found is in the counters, so that fast is not mistaken for good.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "examples/euroc_pairs.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/synthetic_texture.hpp"

namespace {

using searvins::examples::GrayImage;
using Frontend = searvins::orb::OrbFrontend<512>;

struct Pairs {
  searvins::vision::StereoCamera<double> camera{};
  std::vector<GrayImage> left, right;
};

Pairs textures(int width, int height) {
  Pairs pairs;
  pairs.camera = searvins::test::small_camera();
  pairs.camera.width_px = width, pairs.camera.height_px = height;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    pairs.left.push_back(searvins::test::texture_image(searvins::test::Texture{seed, 14}, width, height));
    pairs.right.push_back(searvins::test::texture_image(searvins::test::Texture{seed, 14}, width, height, 20));
  }
  return pairs;
}

const Pairs& real_pairs() {
  static const Pairs all = [] {
    auto read = searvins::test::read_euroc_pairs();
    if (!read) return textures(752, 480);
    return Pairs{read->camera, std::move(read->left), std::move(read->right)};
  }();
  return all;
}

GrayImage enlarged(const GrayImage& image, int width, int height) {
  GrayImage out(width, height);
  const double sx = double(image.width()) / width, sy = double(image.height()) / height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = std::clamp((x + 0.5) * sx - 0.5, 0.0, image.width() - 1.001),
                   v = std::clamp((y + 0.5) * sy - 0.5, 0.0, image.height() - 1.001);
      const int i = int(u), k = int(v);
      const double a = u - i, b = v - k;
      out(x, y) = searvins::test::grey((1 - b) * ((1 - a) * image(i, k) + a * image(i + 1, k)) +
                                       b * ((1 - a) * image(i, k + 1) + a * image(i + 1, k + 1)));
    }
  return out;
}

const Pairs& wide_pairs() {
  static const Pairs all = [] {
    Pairs pairs{real_pairs().camera, {}, {}};
    pairs.camera.fx_px *= 2048.0 / 752, pairs.camera.cx_px *= 2048.0 / 752;
    pairs.camera.width_px = 2048, pairs.camera.height_px = 732;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, real_pairs().left.size()); ++i) {
      pairs.left.push_back(enlarged(real_pairs().left[i], 2048, 732));
      pairs.right.push_back(enlarged(real_pairs().right[i], 2048, 732));
    }
    return pairs;
  }();
  return all;
}

const Pairs& pairs_of(bool is_wide) { return is_wide ? wide_pairs() : real_pairs(); }

void run_pair(benchmark::State& state, bool is_wide) {
  const Pairs& pairs = pairs_of(is_wide);
  Frontend frontend{pairs.camera};
  std::size_t i = 0;
  double matched = 0, continued = 0, features = 0;
  for (auto _ : state) {
    Frontend::Frame frame;
    const bool done = frontend.process({pairs.left[i].view(), pairs.right[i].view(), {}, {}}, searvins::vision::CameraMotion{}, frame).ok();
    benchmark::DoNotOptimize(done);
    features += double(frontend.statistics().left_features);
    matched += double(frontend.statistics().stereo_matched()), continued += double(frontend.statistics().continued());
    i = (i + 1) % pairs.left.size();
  }
  const double runs = double(state.iterations());
  state.counters["features"] = features / runs;
  state.counters["stereo"] = matched / runs;
  state.counters["continued"] = continued / runs;
}

void run_extraction(benchmark::State& state, bool is_wide) {
  const Pairs& pairs = pairs_of(is_wide);
  searvins::orb::Extractor extractor;
  std::vector<searvins::orb::Feature> features;
  std::size_t i = 0;
  for (auto _ : state) {
    extractor.extract(pairs.left[i].view(), features);
    benchmark::DoNotOptimize(features.data());
    i = (i + 1) % pairs.left.size();
  }
}

void run_stereo(benchmark::State& state, bool is_wide) {
  const Pairs& pairs = pairs_of(is_wide);
  searvins::orb::Extractor left, right;
  std::vector<searvins::orb::Feature> a, b;
  left.extract(pairs.left[0].view(), a);
  right.extract(pairs.right[0].view(), b);
  searvins::orb::StereoMatcher matcher;
  std::vector<searvins::orb::StereoMatch> matches;
  for (auto _ : state) {
    matcher.match(a, left.pyramid(), b, right.pyramid(), matches);
    benchmark::DoNotOptimize(matches.data());
  }
}

BENCHMARK_CAPTURE(run_pair, orb_pair_752x480, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_pair, orb_pair_2048x732, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extraction, orb_one_image_752x480, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extraction, orb_one_image_2048x732, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_stereo, orb_stereo_match_752x480, false)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
