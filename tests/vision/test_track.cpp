// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/track.hpp>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>

#include "support/property.hpp"

using namespace searvins::test;
using namespace searvins::vision;

namespace {

const StereoPixel<double> kPixel{300, 280, 100};

/// What a track is expected to be, kept with a plain map.
struct Expected {
  int observations{0}, last_frame{0}, landmark_frame{0};
  bool has_landmark{false}, broken{false};
};

}  // namespace

TEST_CASE("the life of a track: new, maturing, mature; broken, and the same again") {
  TrackTable<8> table;
  const auto frame = [&] {
    table.begin_frame();
    return table.observe(7, kPixel);
  };
  CHECK(frame()->stage == TrackStage::fresh);
  CHECK(table.claim_landmark(7) == 0);
  CHECK(frame()->stage == TrackStage::maturing);
  CHECK(table.claim_landmark(7) == 0);
  CHECK(frame()->stage == TrackStage::mature);
  CHECK(table.claim_landmark(7) == 1);
  CHECK(frame()->stage == TrackStage::mature);
  CHECK(table.continues_landmark(*table.find(7)));
  CHECK(table.claim_landmark(7) == 1);

  table.begin_frame();
  table.break_with(7, {310, 290, 90});
  CHECK(table.find(7)->stage == TrackStage::broken);
  CHECK(table.find(7)->observations == 1);
  CHECK(table.find(7)->pixel_px[0] == 310);
  CHECK_FALSE(table.continues_landmark(*table.find(7)));
  CHECK(table.claim_landmark(7) == 0);
  CHECK(frame()->stage == TrackStage::maturing);  // the one that broke it counts
  CHECK(frame()->stage == TrackStage::mature);
  CHECK(table.claim_landmark(7) == 2);

  table.begin_frame();
  table.break_off(7);
  CHECK_FALSE(table.find(7)->has_pixel);
  CHECK(frame()->stage == TrackStage::fresh);
  table.break_off(99);  // never seen: nothing to break
  CHECK(table.find(99) == nullptr);
}

TEST_CASE("the arc of a landmark is bounded: after max_arc frames a living track has a fresh one") {
  for_all_seeds(20, [](Rng& rng) {
    TrackOptions options;
    options.max_arc = integer(rng, 2, 30), options.n_min = integer(rng, 1, 4);
    TrackTable<4> table(options);
    std::map<std::uint64_t, std::set<std::uint64_t>> frames_of;  // landmark -> frames
    for (int i = 0; i < 200; ++i) {
      table.begin_frame();
      if (chance(rng, 0.1)) continue;  // not seen
      (void)table.observe(5, kPixel);
      if (const std::uint64_t landmark = table.claim_landmark(5)) frames_of[landmark].insert(table.frame());
    }
    CHECK(frames_of.size() == table.landmarks());
    for (const auto& [landmark, frames] : frames_of)
      CHECK(*frames.rbegin() - *frames.begin() < static_cast<std::uint64_t>(options.max_arc));
    CHECK(frames_of.size() >= static_cast<std::size_t>(150 / options.max_arc));
  });
  TrackTable<4> table;
  for (int i = 1; i <= 2 + 25 + 1; ++i) {
    table.begin_frame();
    (void)table.observe(5, kPixel);
    const std::uint64_t landmark = table.claim_landmark(5);
    CHECK(landmark == (i < 3 ? 0 : i < 28 ? 1 : 2));  // 25 frames: 3 .. 27
  }
}

TEST_CASE("tracks that are not seen are forgotten, not before and not after max_missed frames") {
  TrackTable<8> table;
  table.begin_frame();
  (void)table.observe(1, kPixel);
  for (int missed = 1; missed <= 5; ++missed) table.begin_frame();
  CHECK(table.find(1) != nullptr);
  CHECK(table.observe(1, kPixel)->observations == 2);
  for (int missed = 1; missed <= 6; ++missed) table.begin_frame();
  CHECK(table.find(1) != nullptr);
  table.begin_frame();
  CHECK(table.find(1) == nullptr);
  CHECK(table.observe(1, kPixel)->stage == TrackStage::fresh);
}

TEST_CASE("a full table refuses new tracks and follows the ones it has") {
  TrackTable<3> table;
  table.begin_frame();
  for (const std::uint64_t id : {30U, 10U, 20U}) CHECK(table.observe(id, kPixel) != nullptr);
  CHECK(table.observe(15, kPixel) == nullptr);
  CHECK(table.size() == 3);
  CHECK(table.observe(10, kPixel)->observations == 2);
  CHECK(std::is_sorted(table.begin(), table.end(), [](const Track& a, const Track& b) { return a.id < b.id; }));
}

TEST_CASE("a full table makes room for what is seen by forgetting what has been away for longest") {
  TrackTable<3> table;
  table.begin_frame();
  for (const std::uint64_t id : {30U, 10U, 20U}) (void)table.observe(id, kPixel);
  table.begin_frame();
  (void)table.observe(10, kPixel), (void)table.observe(30, kPixel);
  table.begin_frame();
  (void)table.observe(30, kPixel);
  CHECK(table.observe(40, kPixel) != nullptr);  // 20 goes
  CHECK((table.find(20) == nullptr && table.find(10) != nullptr && table.find(30) != nullptr));
  CHECK(table.observe(5, kPixel) != nullptr);  // 10 goes
  CHECK(table.find(10) == nullptr);
  CHECK(table.observe(6, kPixel) == nullptr);
  CHECK(std::is_sorted(table.begin(), table.end(), [](const Track& a, const Track& b) { return a.id < b.id; }));
}

TEST_CASE("a landmark that the estimator gave up is followed by another one; cleared tables do not repeat numbers") {
  TrackOptions options;
  options.n_min = 1;
  TrackTable<4> table(options);
  table.begin_frame();
  (void)table.observe(1, kPixel);
  CHECK(table.claim_landmark(1) == 1);
  table.end_landmark(1);
  CHECK_FALSE(table.continues_landmark(*table.find(1)));
  table.begin_frame();
  (void)table.observe(1, kPixel);
  CHECK(table.claim_landmark(1) == 2);
  table.clear();
  CHECK(table.size() == 0);
  table.begin_frame();
  (void)table.observe(1, kPixel);
  CHECK(table.claim_landmark(1) == 3);
}

TEST_CASE("tracks through random lives: like a map") {
  for_all_seeds(20, [](Rng& rng) {
    const TrackOptions options;
    TrackTable<64> table(options);
    std::map<std::uint64_t, Expected> model;
    for (int frame = 1; frame <= 150; ++frame) {
      table.begin_frame();
      std::erase_if(model, [&](const auto& entry) { return frame - entry.second.last_frame > options.max_missed + 1; });
      for (std::uint64_t id = 0; id < 40; ++id) {
        const double luck = uniform(rng, 0, 1);
        if (luck < 0.6) {
          Expected& e = model[id];
          ++e.observations, e.last_frame = frame, e.broken = false;
          REQUIRE(table.observe(id, kPixel) != nullptr);
          if (chance(rng, 0.7) && e.observations >= options.n_min) {
            if (!e.has_landmark || frame - e.landmark_frame >= options.max_arc) e.has_landmark = true, e.landmark_frame = frame;
            CHECK(table.claim_landmark(id) > 0);
          }
        } else if (luck < 0.7) {
          const bool with = chance(rng, 0.5);
          if (model.count(id)) model[id] = {with ? 1 : 0, frame, 0, false, true};
          with ? table.break_with(id, kPixel) : table.break_off(id);
        }
      }
      REQUIRE(table.size() == model.size());
      for (const auto& [id, e] : model) {
        const Track* const track = table.find(id);
        REQUIRE(track != nullptr);
        CHECK(track->observations == e.observations);
        CHECK(track->has_landmark == e.has_landmark);
        CHECK((track->stage == TrackStage::broken) == e.broken);
        CHECK((track->stage == TrackStage::mature) == (e.observations >= options.n_min));
      }
    }
  });
}
