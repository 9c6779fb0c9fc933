// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The frontend on twelve real pairs (EuRoC V1_01, 752 x 480, camera at rest within 2.5 mm): how many features are matched, how well they
/// keep the row, their place and their depth. What does not move is its own truth.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "examples/euroc_pairs.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"

using namespace searvins;
using Frontend = orb::OrbFrontend<512>;

namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Matches of two sets of features of which none can be right, or all may: the right image moved up by some rows.
std::size_t matches_with_rows_moved(const test::EurocPairs& pairs, int rows) {
  const examples::GrayImage& right = pairs.right[0];
  examples::GrayImage moved(right.width(), right.height());
  for (int y = 0; y < right.height(); ++y) std::copy_n(right.row((y + rows) % right.height()), right.width(), moved.row(y));
  orb::Extractor of_left, of_right;
  std::vector<orb::Feature> a, b;
  of_left.extract(pairs.left[0].view(), a);
  of_right.extract(moved.view(), b);
  orb::StereoMatchOptions options;
  options.max_disparity_px = 50;
  orb::StereoMatcher matcher{options};
  std::vector<orb::StereoMatch> matches;
  matcher.match(a, of_left.pyramid(), b, of_right.pyramid(), matches);
  return static_cast<std::size_t>(
      std::count_if(matches.begin(), matches.end(), [](const auto& m) { return m.fate == orb::MatchFate::matched; }));
}

}  // namespace

TEST_CASE("Real pairs at rest: stereo matches, epipolar residual, temporal agreement, repeated depth") {
  const auto pairs = test::read_euroc_pairs();
  if (!pairs) {
    MESSAGE("SKIPPED: shared data not found (data/real/euroc_v101_static)");
    return;
  }
  REQUIRE(pairs->left.size() == 12);
  Frontend frontend{pairs->camera};
  std::map<std::uint64_t, std::vector<Eigen::Vector3d>> seen;
  std::vector<double> rows_px;
  std::size_t features = 0, least_matched = 10000, matched = 0, right_place = 0, wrong_place = 0, continued = 0;
  std::map<std::uint64_t, Eigen::Vector3d> before;
  for (std::size_t i = 0; i < pairs->left.size(); ++i) {
    Frontend::Frame frame;
    REQUIRE(frontend.process(pairs->pair(i), i > 0 ? std::optional{vision::CameraMotion{}} : std::nullopt, frame).ok());
    const orb::FrameStatistics& s = frontend.statistics();
    features += s.left_features, matched += s.stereo_matched();
    std::size_t on_row = 0;
    for (const auto& o : frame.observations) {
      rows_px.push_back(std::abs(o.v_difference_px));
      on_row += std::abs(o.v_difference_px) < 2 ? 1U : 0U;
    }
    least_matched = std::min(least_matched, on_row);
    std::map<std::uint64_t, Eigen::Vector3d> now;
    for (const orb::Track& t : frontend.tracks())
      if (t.missed == 0) now[t.id] = {double(t.u_px), double(t.v_px), 0};
    for (const auto& [id, place] : now)
      if (const auto at = before.find(id); at != before.end()) ++((at->second - place).norm() < 2 ? right_place : wrong_place);
    continued += s.continued();
    before = std::move(now);
    for (const auto& o : frame.observations) seen[o.track].push_back(o.pixel_px);
  }
  std::vector<double> depth_spread, disparity_px, jitter_px;
  for (const auto& [id, z] : seen) {
    if (z.size() < 8) continue;
    double mean = 0;
    for (const auto& p : z) mean += (p[0] - p[1]) / static_cast<double>(z.size());
    double variance = 0;
    for (const auto& p : z) variance += std::pow(p[0] - p[1] - mean, 2) / static_cast<double>(z.size() - 1);
    disparity_px.push_back(std::sqrt(variance));
    depth_spread.push_back(std::sqrt(variance) / mean);
    for (std::size_t k = 1; k < z.size(); ++k) jitter_px.push_back(std::hypot(z[k][0] - z[k - 1][0], z[k][2] - z[k - 1][2]));
  }
  const double agreement = static_cast<double>(right_place) / static_cast<double>(right_place + wrong_place);
  MESSAGE("features a frame " << features / 12 << ", matched in stereo " << matched / 12 << " (least on the row " << least_matched
                              << "), continued a frame " << continued / 11 << ", within 2 px " << 100 * agreement << " %");
  MESSAGE("row difference: median " << median(rows_px) << " px, 95 % " << quantile(rows_px, 0.95) << " px; disparity over "
                                    << disparity_px.size() << " tracks of 8 frames and more: median deviation " << median(disparity_px)
                                    << " px, 90 % " << quantile(disparity_px, 0.9) << " px; depth: median " << 100 * median(depth_spread)
                                    << " %, 90 % " << 100 * quantile(depth_spread, 0.9) << " %; left place from frame to frame: median "
                                    << median(jitter_px) << " px");
  CHECK(least_matched >= 150);
  CHECK(static_cast<double>(matched) > 0.38 * static_cast<double>(features));
  CHECK(agreement >= 0.95);
  CHECK(continued / 11 >= 200);
  CHECK(median(rows_px) < 0.25);
  CHECK(quantile(rows_px, 0.95) < 0.8);
  CHECK(disparity_px.size() > 100);
  CHECK(median(disparity_px) < 0.05);
  CHECK(median(depth_spread) < 0.004);
}

TEST_CASE("Real pairs: hardly anything matches where nothing can be right") {
  const auto pairs = test::read_euroc_pairs();
  if (!pairs) {
    MESSAGE("SKIPPED: shared data not found (data/real/euroc_v101_static)");
    return;
  }
  const std::size_t right = matches_with_rows_moved(*pairs, 0);
  for (const int rows : {37, 90, 150}) {
    const std::size_t wrong = matches_with_rows_moved(*pairs, rows);
    MESSAGE("right image moved by " << rows << " rows: " << wrong << " matches, " << right << " in place");
    CHECK(wrong * 15 <= right);
  }
}
