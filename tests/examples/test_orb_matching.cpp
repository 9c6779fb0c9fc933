// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Matching: the choice among candidates, the index of places, sub-pixel disparity, stereo on a texture whose disparity is known.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <vector>

#include "examples/orb_frontend/stereo_matching.hpp"
#include "examples/synthetic_texture.hpp"
#include "support/property.hpp"

using namespace searvins;
using examples::GrayImage;
using orb::Candidate;
using orb::MatchFate;

TEST_CASE("A choice: near enough, clearly nearer than the next elsewhere") {
  const orb::MatchLimits limits{60, 0.8F, 4};
  CHECK(orb::choose({}, limits, 1).fate == MatchFate::no_candidate);
  CHECK(orb::choose({{0, 61, 10, 10}}, limits, 1).fate == MatchFate::too_different);
  CHECK(orb::choose({{0, 60, 10, 10}}, limits, 1).fate == MatchFate::matched);
  CHECK(orb::choose({{0, 39, 10, 10}, {1, 50, 90, 10}}, limits, 1).fate == MatchFate::matched);
  CHECK(orb::choose({{0, 41, 10, 10}, {1, 50, 90, 10}}, limits, 1).fate == MatchFate::ambiguous);
  CHECK(orb::choose({{0, 41, 10, 10}, {1, 50, 13, 10}}, limits, 1).fate == MatchFate::matched);     // the same spot
  CHECK(orb::choose({{0, 41, 10, 10}, {1, 50, 15, 10}}, limits, 1).fate == MatchFate::ambiguous);   // 5 px are elsewhere
  CHECK(orb::choose({{0, 41, 10, 10}, {1, 50, 15, 10}}, limits, 1.5F).fate == MatchFate::matched);  // not on a coarser level
  CHECK(orb::choose({{0, 30, 10, 10}, {1, 20, 90, 10}, {2, 20, 91, 10}}, limits, 1).place == 1);
}

TEST_CASE("The mutual check knows the best partner; of equals the first") {
  orb::PartnerTable table;
  table.reset(2);
  table.offer(0, 7, 40);
  table.offer(0, 8, 40);
  table.offer(1, 7, 40);
  table.offer(1, 8, 39);
  CHECK(table.is_best(0, 7));
  CHECK_FALSE(table.is_best(0, 8));
  CHECK(table.is_best(1, 8));
  table.reset(1);
  table.offer(0, 9, 100);
  CHECK(table.is_best(0, 9));
}

TEST_CASE("The index gives every feature of a rectangle, each once") {
  test::for_all_seeds(30, [](test::Rng& rng) {
    const int width = test::integer(rng, 70, 300), height = test::integer(rng, 70, 200);
    std::vector<orb::Feature> features(static_cast<std::size_t>(test::integer(rng, 0, 300)));
    for (orb::Feature& f : features)
      f.u_px = float(test::uniform(rng, -0.5, width - 0.5)), f.v_px = float(test::uniform(rng, -0.5, height - 0.5));
    orb::FeatureIndex index;
    index.build(features, width, height, test::integer(rng, 1, 400), test::integer(rng, 1, 50));
    const float u_min = float(test::uniform(rng, -50, width)), u_max = u_min + float(test::uniform(rng, 0, 100));
    const float v_min = float(test::uniform(rng, -50, height)), v_max = v_min + float(test::uniform(rng, 0, 100));
    std::vector<std::size_t> found;
    index.for_each_near(u_min, u_max, v_min, v_max, [&](std::size_t i) { found.push_back(i); });
    const std::set<std::size_t> unique{found.begin(), found.end()};
    CHECK(unique.size() == found.size());
    for (std::size_t i = 0; i < features.size(); ++i)
      if (features[i].u_px >= u_min && features[i].u_px <= u_max && features[i].v_px >= v_min && features[i].v_px <= v_max)
        CHECK(unique.contains(i));
  });
}

TEST_CASE("Alignment finds any shift to a fraction of a pixel, whatever the exposure") {
  double sum2 = 0, sum = 0;
  int runs = 0;
  test::for_all_seeds(60, [&](test::Rng& rng) {
    const test::Texture texture{rng()};
    const double shift = test::uniform(rng, -2.8, 2.8), rise = test::uniform(rng, -0.6, 0.6), gain = test::uniform(rng, 0.85, 1.15),
                 offset = test::uniform(rng, -20, 20);
    const GrayImage left = test::texture_image(texture, 60, 40);
    GrayImage right(60, 40);
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 60; ++x) right(x, y) = test::grey(128 + offset + gain * (texture(x - shift, y - rise) - 128));
    const orb::Alignment found = orb::align_on_row(left.view(), 30, 20, right.view(), 30);
    if (!found.found) return;  // too flat or too steep a patch
    ++runs;
    const double error = double(found.x) - 30 - shift;
    sum += error, sum2 += error * error;
    CHECK(std::abs(error) < 1);
    CHECK(std::abs(double(found.y) - 20 - rise) < 1);
    CHECK(found.mismatch < 0.6);
  });
  MESSAGE("alignment: rms error " << std::sqrt(sum2 / runs) << " px, mean " << sum / runs << ", found in " << runs);
  CHECK(runs >= 48 * int(test::property_runs(60)) / 60);
  CHECK(std::sqrt(sum2 / runs) < 0.2);
}

TEST_CASE("Alignment says no at the end of its search, at the edge of the image and to something else") {
  const test::Texture texture{21}, other{22};
  const GrayImage left = test::texture_image(texture, 80, 40), far = test::texture_image(texture, 80, 40, -6),
                  stranger = test::texture_image(other, 80, 40);
  CHECK_FALSE(orb::align_on_row(left.view(), 40, 20, left.view(), 10).found);
  CHECK_FALSE(orb::align_on_row(left.view(), 40, 3, left.view(), 40).found);
  CHECK_FALSE(orb::align_on_row(left.view(), 75, 20, left.view(), 40).found);
  const orb::Alignment same = orb::align_on_row(left.view(), 40, 20, left.view(), 41),
                       not_same = orb::align_on_row(left.view(), 40, 20, stranger.view(), 40);
  CHECK(same.found);
  CHECK(same.mismatch == 0);
  CHECK((!not_same.found || not_same.mismatch > 0.5F));
  const orb::Alignment beyond = orb::align_on_row(left.view(), 40, 20, far.view(), 40);  // it lies at 46, the search ends at 44
  CHECK((!beyond.found || beyond.mismatch > 0.1F));
}

TEST_CASE("Stereo on a texture of constant disparity: most are matched, all but a few rightly, to a fraction of a pixel") {
  double sum2 = 0;
  int matched = 0, wrong = 0, features = 0;
  test::for_all_seeds(6, [&](test::Rng& rng) {
    const test::Texture texture{rng()};
    const double disparity = test::uniform(rng, 3, 60);
    const GrayImage left = test::texture_image(texture, 320, 200), right = test::texture_image(texture, 320, 200, disparity);
    orb::Extractor of_left{{200, 3}}, of_right{{200, 3}};
    std::vector<orb::Feature> a, b;
    of_left.extract(left.view(), a);
    of_right.extract(right.view(), b);
    orb::StereoMatcher matcher;
    std::vector<orb::StereoMatch> matches;
    matcher.match(a, of_left.pyramid(), b, of_right.pyramid(), matches);
    REQUIRE(matches.size() == a.size());
    std::set<std::size_t> partners;
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (double(a[i].u_px) > disparity + 20) ++features;
      if (matches[i].fate != MatchFate::matched) continue;
      ++matched;
      CHECK(partners.insert(matches[i].right).second);  // mutual: nobody has two
      const double error = double(matches[i].disparity_px) - disparity;
      if (std::abs(error) > 1)
        ++wrong;
      else
        sum2 += error * error;
    }
  });
  const double rms_px = std::sqrt(sum2 / (matched - wrong));
  MESSAGE("stereo: " << matched << " of " << features << " matched, " << wrong << " wrong, rms " << rms_px << " px");
  CHECK(matched > 0.6 * features);
  CHECK(wrong <= 0.02 * matched);
  CHECK(rms_px < 0.15);
}

TEST_CASE("Points behind infinity or nearer than anything are not matched") {
  const test::Texture texture{31};
  const GrayImage left = test::texture_image(texture, 320, 200), right = test::texture_image(texture, 320, 200, -8),
                  near = test::texture_image(texture, 320, 200, 90);
  orb::Extractor of_left{{200, 2}}, of_right{{200, 2}};
  std::vector<orb::Feature> a, b;
  std::vector<orb::StereoMatch> matches;
  orb::StereoMatchOptions options;
  options.max_disparity_px = 60;
  orb::StereoMatcher matcher{options};
  for (const GrayImage* image : {&right, &near}) {
    of_left.extract(left.view(), a);
    of_right.extract(image->view(), b);
    matcher.match(a, of_left.pyramid(), b, of_right.pyramid(), matches);
    const auto count =
        std::count_if(matches.begin(), matches.end(), [](const orb::StereoMatch& m) { return m.fate == MatchFate::matched; });
    CHECK(static_cast<double>(count) < 0.06 * static_cast<double>(a.size()));
    for (const orb::StereoMatch& m : matches)
      if (m.fate == MatchFate::matched) CHECK((m.disparity_px >= options.min_disparity_px && m.disparity_px <= options.max_disparity_px));
  }
}
