// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/stereo_observation.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "support/property.hpp"

using namespace searvins::test;
using namespace searvins::vision;

TEST_CASE("a frame that is full keeps the best scores and counts what it drops: 5000 keypoints") {
  for_all_seeds(5, [](Rng& rng) {
    const auto frame = std::make_unique<StereoFrame<100>>();
    std::vector<double> scores;
    for (std::uint64_t i = 0; i < 5000; ++i) {
      StereoObservation o;
      o.track = i, o.score = uniform(rng, 0, 1);
      if (chance(rng, 0.05)) o.score = std::numeric_limits<double>::quiet_NaN();
      scores.push_back(std::isnan(o.score) ? -1 : o.score);
      (void)frame->add(o);
    }
    std::sort(scores.rbegin(), scores.rend());
    CHECK(frame->observations.size() == 100);
    CHECK(frame->dropped == 4900);
    std::uint64_t before = 0;
    for (const StereoObservation& o : frame->observations) {
      CHECK(o.score >= scores[99]);
      CHECK(o.track >= before);  // in the order of the frontend
      before = o.track;
    }
  });
}

TEST_CASE("a new observation of an equal score does not displace an old one; a better one displaces the later of equals") {
  StereoFrame<2> frame;
  const auto add = [&](std::uint64_t track, double score) {
    StereoObservation o;
    o.track = track, o.score = score;
    return frame.add(o);
  };
  CHECK(add(1, 0.5));
  CHECK(add(2, 0.5));
  CHECK_FALSE(add(3, 0.5));
  CHECK(add(4, 0.6));
  CHECK(frame.observations[0].track == 1);
  CHECK(frame.observations[1].track == 4);
  CHECK(frame.dropped == 2);
}

TEST_CASE("an observation says its disparity, and whether its numbers are numbers") {
  StereoObservation o;
  o.pixel_px = {310, 290.5, 77};
  CHECK(o.disparity_px() == 19.5);
  CHECK(o.finite());  // rows of both views are unknown, which is no fault
  o.score = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(o.finite());
  o.score = 1, o.pixel_px[1] = std::numeric_limits<double>::infinity();
  CHECK_FALSE(o.finite());
}
