// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/admission.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "street_drive.hpp"
#include "support/allocation_counter.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using namespace searvins::vision;

namespace {

using Admission = StereoAdmission<StreetDrive::kTracks>;
using Frame = Admission::Frame;
using Admitted = Admission::Admitted;

AdmissionOptions sharp_options() {
  AdmissionOptions options;
  options.pnp.sigma_px = 0.3;
  return options;
}

/// A drive and its admission.
struct Run {
  explicit Run(Rng& rng, const AdmissionOptions& options = sharp_options())
      : drive(rng), admission(std::make_unique<Admission>(car_camera(), options)), out(std::make_unique<Admitted>()) {}

  /// The next frame, changed by `change`, with a perfect prediction.
  template <class Change>
  const Admitted& step(Change change) {
    Frame frame = drive.next();
    change(frame);
    REQUIRE(admission->add(frame, drive.prediction(), *out).ok());
    return *out;
  }
  const Admitted& step() {
    return step([](Frame&) {});
  }
  void warm_up() {
    for (int i = 0; i < 5; ++i) (void)step();
    REQUIRE(out->observations.size() >= 20);
  }
  [[nodiscard]] std::size_t fated(ObservationFate fate) const {
    return static_cast<std::size_t>(std::count(out->fates.begin(), out->fates.end(), fate));
  }

  StreetDrive drive;
  std::unique_ptr<Admission> admission;
  std::unique_ptr<Admitted> out;
};

/// Labels of one class.
struct Everywhere {
  SemanticClass label;
  [[nodiscard]] bool covers(double, double) const { return true; }
  [[nodiscard]] SemanticClass semantic_class(double, double) const { return label; }
  [[nodiscard]] bool any_within(double, double, double, const ClassSet& classes) const { return classes.contains(label); }
};
static_assert(SemanticMask<Everywhere>);

}  // namespace

TEST_CASE("admission: a clean drive is admitted from the third frame on, with its motion, and every observation is counted once") {
  for_all_seeds(5, [](Rng& rng) {
    Run run(rng);
    std::size_t offered = 0, admitted = 0;
    for (int i = 0; i < 60; ++i) {
      Frame copy;
      const Admitted& out = run.step([&](const Frame& f) { copy = f; });
      offered += copy.observations.size(), admitted += out.observations.size();
      CHECK(out.fate == (i == 0 ? FrameFate::no_previous : FrameFate::full));
      CHECK(out.fates.size() == copy.observations.size());
      CHECK(out.observations.empty() == (i < 2));
      if (i == 0) continue;
      REQUIRE(out.has_motion);
      CHECK(out.motion.minus(run.drive.motion()).tail<3>().norm() < 0.05);
      CHECK(out.difference.way_m < 0.05);
      CHECK_FALSE(out.stands_still);
      for (const AdmittedObservation& o : out.observations) CHECK(o.sigma_px == doctest::Approx(0.3 * out.sigma_scale));
    }
    const AdmissionCounts& counts = run.admission->counts();
    CHECK(counts.offered() == offered);
    CHECK(counts.of(ObservationFate::admitted) == admitted);
    CHECK(counts.of(FrameFate::full) == 59);
    CHECK(static_cast<double>(admitted) > 0.8 * static_cast<double>(offered));
    CHECK(run.admission->tracks().landmarks() == counts.landmarks);
  });
}

TEST_CASE("admission: n_min observations before a landmark, arcs of at most 25 frames, landmarks begin once") {
  Rng rng{2};
  Run run(rng);
  std::map<std::uint64_t, int> first_seen;
  std::map<std::uint64_t, std::pair<int, int>> arcs;  // landmark -> first and last frame
  for (int i = 0; i < 120; ++i) {
    const Admitted& out = run.step([&](const Frame& f) {
      for (const StereoObservation& o : f.observations) first_seen.try_emplace(o.track, i);
    });
    for (const AdmittedObservation& o : out.observations) {
      CHECK(i - first_seen[o.track] >= 2);
      CHECK(o.begins == !arcs.count(o.landmark));
      auto& arc = arcs.try_emplace(o.landmark, i, i).first->second;
      arc.second = i;
    }
  }
  int longest = 0;
  for (const auto& [landmark, arc] : arcs) longest = std::max(longest, arc.second - arc.first + 1);
  CHECK(longest == 25);
  CHECK(arcs.size() == run.admission->counts().landmarks);
}

TEST_CASE("admission: wrong associations are told apart, break their tracks, and mature again before they are believed") {
  for_all_seeds(10, [](Rng& rng) {
    Run run(rng);
    run.warm_up();
    std::set<std::uint64_t> wrong;
    (void)run.step([&](Frame& f) {
      for (StereoObservation& o : f.observations)
        if (chance(rng, 0.25) && run.admission->tracks().find(o.track)) {
          o.pixel_px += Eigen::Vector3d(uniform(rng, 8, 15), uniform(rng, 8, 15), uniform(rng, 8, 15));
          wrong.insert(o.track);
        }
    });
    CHECK(run.fated(ObservationFate::motion_outlier) >= wrong.size() * 8 / 10);  // some leave the image
    REQUIRE(wrong.size() > 10);
    for (const AdmittedObservation& o : run.out->observations) CHECK(wrong.count(o.track) == 0);
    for (const std::uint64_t track : wrong) CHECK(run.admission->tracks().find(track)->stage == TrackStage::broken);
    (void)run.step();  // the observation that broke the track contradicts this one: broken again, count 1
    for (const AdmittedObservation& o : run.out->observations) CHECK(wrong.count(o.track) == 0);
    (void)run.step();
    for (const AdmittedObservation& o : run.out->observations) CHECK(wrong.count(o.track) == 0);
    (void)run.step();
    std::size_t again = 0;
    for (const AdmittedObservation& o : run.out->observations) again += wrong.count(o.track);
    CHECK(again > wrong.size() / 2);
  });
}

TEST_CASE("admission: a track that was away for a frame is another landmark when it comes back, and matures again") {
  Rng rng{3};
  Run run(rng);
  run.warm_up();
  const std::set<std::uint64_t> away = [&] {
    std::set<std::uint64_t> tracks;
    for (const AdmittedObservation& o : run.out->observations)
      if (tracks.size() < 10) tracks.insert(o.track);
    return tracks;
  }();
  (void)run.step([&](Frame& f) { (void)f.observations.erase_if([&](const StereoObservation& o) { return away.count(o.track) > 0; }); });
  std::size_t back = 0;
  for (int i = 0; i < 3; ++i) {
    (void)run.step();
    for (const AdmittedObservation& o : run.out->observations)
      if (away.count(o.track)) {
        CHECK(i == 2);
        CHECK(o.begins);
        ++back;
      }
  }
  CHECK(back >= 5);
}

TEST_CASE("admission: a prediction that contradicts the picture allows reuse only, or nothing") {
  Rng rng{4};
  Run run(rng);
  run.warm_up();
  const auto offer = [&](double error_m) {
    const Frame frame = run.drive.next();
    std::optional<PredictedMotion> predicted = run.drive.prediction();
    predicted->motion.t_prev_cur_m.z() += error_m;
    REQUIRE(run.admission->add(frame, predicted, *run.out).ok());
  };
  offer(0.05);
  CHECK(run.out->fate == FrameFate::full);
  offer(0.22);
  CHECK(run.out->fate == FrameFate::reuse_only);
  CHECK(run.out->decision == FrameDecision::reuse_only);
  CHECK(run.out->observations.size() > 20);
  for (const AdmittedObservation& o : run.out->observations) CHECK_FALSE(o.begins);
  offer(0.5);
  CHECK(run.out->fate == FrameFate::differs);
  CHECK(run.out->observations.empty());
  CHECK(run.fated(ObservationFate::frame_rejected) > 20);
  offer(0);
  CHECK(run.out->fate == FrameFate::full);  // tracks were followed meanwhile
  CHECK(run.out->observations.size() > 20);
  const Frame unpredicted = run.drive.next();
  REQUIRE(run.admission->add(unpredicted, std::nullopt, *run.out).ok());
  CHECK(run.out->fate == FrameFate::full_alone);
}

TEST_CASE("admission: a lorry that fills the view is believed by PnP and refused by the prediction") {
  Rng rng{5};
  AdmissionOptions options = sharp_options();
  Run run(rng, options);
  run.warm_up();
  const auto camera = car_camera();
  std::vector<Eigen::Vector3d> lorry;
  for (int i = 0; i < 60; ++i) lorry.emplace_back(uniform(rng, -1.5, 1.5), uniform(rng, -2, 1), uniform(rng, 6, 12));
  for (int i = 0; i < 4; ++i) {
    (void)run.step([&](Frame& f) {
      (void)f.observations.resize(std::min<std::size_t>(f.observations.size(), 25));
      for (std::size_t k = 0; k < lorry.size(); ++k) {
        StereoObservation o;
        o.track = 10000 + k, o.pixel_px = look_at(rng, camera, lorry[k], 0.3);  // it keeps its distance
        (void)f.add(o);
      }
    });
    if (i > 0) {
      CHECK(run.out->fate == FrameFate::differs);
      CHECK(run.out->motion.t_prev_cur_m.norm() < 0.1);
      CHECK(run.out->observations.empty());
    }
  }
}

TEST_CASE("admission: no more observations than asked for; landmarks that live go on") {
  Rng rng{17};
  AdmissionOptions options = sharp_options();
  options.max_admitted = 30;
  Run run(rng, options);
  run.warm_up();
  for (int i = 0; i < 10; ++i) {
    (void)run.step();
    CHECK(run.out->observations.size() == 30);
    CHECK(run.fated(ObservationFate::surplus) > 0);
    CHECK(std::count_if(run.out->observations.begin(), run.out->observations.end(), [](const AdmittedObservation& o) { return o.begins; }) <
          15);
  }
}

TEST_CASE("admission: too few points for a motion reject the frame") {
  Rng rng{6};
  Run run(rng);
  run.warm_up();
  (void)run.step([](Frame& f) { (void)f.observations.resize(14); });
  CHECK(run.out->fate == FrameFate::no_motion);
  CHECK(run.out->observations.empty());
  CHECK_FALSE(run.out->has_motion);
}

TEST_CASE("bad input: a frame that is masked throughout admits nothing, breaks all tracks, and says so") {
  Rng rng{7};
  Run run(rng);
  run.warm_up();
  const Frame frame = run.drive.next();
  REQUIRE(run.admission->add(frame, run.drive.prediction(), *run.out, Everywhere{13}, NoMask{}).ok());
  CHECK(run.out->fate == FrameFate::masked);
  CHECK(run.out->decision == FrameDecision::reject);
  CHECK(run.fated(ObservationFate::semantic_class) == frame.observations.size());
  REQUIRE(run.admission->add(run.drive.next(), std::nullopt, *run.out, NoMask{}, Everywhere{10}).ok());
  CHECK(run.out->fate == FrameFate::masked);  // the right view counts too
  CHECK(run.admission->counts().of(FrameFate::masked) == 2);
  REQUIRE(run.admission->add(run.drive.next(), std::nullopt, *run.out, Everywhere{2}, Everywhere{0}).ok());
  CHECK(run.out->fate != FrameFate::masked);
}

TEST_CASE("bad input: an all-black stretch is frames without observations; afterwards it goes on") {
  Rng rng{8};
  Run run(rng);
  run.warm_up();
  for (int i = 0; i < 3; ++i) {
    (void)run.step([](Frame& f) { f.observations.clear(); });
    CHECK(run.out->fate == FrameFate::empty);
    CHECK(run.out->decision == FrameDecision::reject);
  }
  CHECK(run.admission->counts().of(FrameFate::empty) == 3);
  // The reference is the last frame that was seen: a prediction from there on fits.
  const double since_s = seconds_between(*run.admission->reference_time(), run.drive.time());
  CHECK(since_s == doctest::Approx(0.3));
  Frame frame = run.drive.next();
  REQUIRE(run.admission->add(frame, std::nullopt, *run.out).ok());
  CHECK(run.out->fate == FrameFate::full_alone);
  CHECK(run.out->motion.t_prev_cur_m.norm() == doctest::Approx(4 * 0.7).epsilon(0.05));
  CHECK(run.out->observations.size() > 10);

  for (int i = 0; i < 6; ++i) (void)run.step([](Frame& f) { f.observations.clear(); });
  (void)run.step();
  CHECK(run.out->fate == FrameFate::no_previous);  // too long ago to compare with
  (void)run.step();
  CHECK(run.out->fate == FrameFate::full);
}

TEST_CASE("bad input: 5000 keypoints: what has no room in the frame or in the table is counted, the rest works") {
  Rng rng{9};
  Run run(rng);
  run.warm_up();
  const std::size_t before = run.admission->counts().offered();
  std::size_t shown = 0;
  (void)run.step([&](Frame& f) {
    const std::size_t good = f.observations.size();
    for (std::uint64_t i = 0; i < 5000; ++i) {
      StereoObservation o;
      o.track = 100000 + i, o.score = 0.4, o.pixel_px = look_at(rng, car_camera(), random_point(rng, car_camera()), 0.3);
      (void)f.add(o);
    }
    shown = good + 5000;
    CHECK(f.observations.size() == Frame::kCapacity);
  });
  CHECK(run.out->fate == FrameFate::full);
  CHECK(run.admission->counts().of(ObservationFate::capacity) == shown - Frame::kCapacity);
  CHECK(run.admission->counts().offered() - before == shown);

}

TEST_CASE("bad input: a table smaller than a frame: what has no room is counted, who is in it is admitted") {
  std::size_t admitted = 0, drives = 0;
  for_all_seeds(20, [&](Rng& rng) {
    Run run(rng);
    run.warm_up();
    using Small = StereoAdmission<StreetDrive::kTracks, 20>;
    const auto small = std::make_unique<Small>(car_camera(), sharp_options());
    for (int i = 0; i < 5; ++i) REQUIRE(small->add(run.drive.next(), run.drive.prediction(), *run.out).ok());
    CHECK(small->tracks().size() == 20);
    CHECK(small->counts().of(ObservationFate::no_room) > 0);
    CHECK(run.out->fate == FrameFate::full);
    CHECK(run.out->observations.size() <= 20);
    admitted += run.out->observations.size(), ++drives;
  });
  // Those that leave the picture give their room to points that have yet to mature: how many are left differs from drive to drive.
  CHECK(admitted > 5 * drives);
}

TEST_CASE("admission: what the frontend says to lie near a rejected class is refused as its boundary") {
  Rng rng{14};
  Run run(rng);
  run.warm_up();
  (void)run.step([](Frame& f) { f.observations[0].near_rejected_class = f.observations[4].near_rejected_class = true; });
  CHECK(run.fated(ObservationFate::semantic_boundary) == 2);
  CHECK(run.out->fates[4] == ObservationFate::semantic_boundary);
  AdmissionOptions blind = sharp_options();
  blind.use_semantic = false;
  Run without(rng, blind);
  without.warm_up();
  (void)without.step([](Frame& f) { f.observations[0].near_rejected_class = true; });
  CHECK(without.fated(ObservationFate::semantic_boundary) == 0);
}

TEST_CASE("bad input: duplicated track numbers: none of them is believed, and the track breaks") {
  Rng rng{10};
  Run run(rng);
  run.warm_up();
  // Of a track that exists already: a new one would not be kept after this frame, and nothing would break.
  std::uint64_t thrice = 0;
  (void)run.step([&](Frame& f) {
    std::size_t i = 0;
    while (run.admission->tracks().find(f.observations[i].track) == nullptr) ++i;
    thrice = f.observations[i].track;
    f.observations[i + 1].track = thrice;
    f.observations[i + 2].track = thrice;
  });
  CHECK(run.fated(ObservationFate::duplicate_track) == 3);
  for (const AdmittedObservation& o : run.out->observations) CHECK(o.track != thrice);
  const auto* const track = run.admission->tracks().find(thrice);
  REQUIRE(track != nullptr);
  CHECK(track->stage == TrackStage::broken);
  CHECK(run.out->fate == FrameFate::full);
}

TEST_CASE(
    "bad input: negative disparity, NaN, low scores, rows that differ, pixels off the image, points too near or too far: refused, each "
    "with its reason") {
  Rng rng{11};
  Run run(rng);
  run.warm_up();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto camera = car_camera();
  (void)run.step([&](Frame& f) {
    auto& o = f.observations;
    std::swap(o[0].pixel_px[0], o[0].pixel_px[1]);
    o[1].pixel_px[2] = nan;
    o[2].score = nan;
    o[3].score = 0.29;
    o[4].v_difference_px = -2.1;
    o[5].pixel_px[2] = camera.height_px + 3;
    o[6].pixel_px = {700, 700 - camera.disparity_px(0.9), 100};
    o[7].pixel_px = {700, 700 - camera.disparity_px(61), 100};
    o[8].semantic_class = 13;
    o[9].pixel_px[1] = -std::numeric_limits<double>::infinity();
    o[10].v_difference_px = nan;  // a frontend that does not say
  });
  const std::vector<ObservationFate> expected{
      ObservationFate::no_disparity,       ObservationFate::not_finite,    ObservationFate::not_finite, ObservationFate::low_score,
      ObservationFate::vertical_disparity, ObservationFate::outside_image, ObservationFate::too_near,   ObservationFate::too_far,
      ObservationFate::semantic_class,     ObservationFate::not_finite,    ObservationFate::admitted};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CAPTURE(i);
    CHECK(std::string(name_of(run.out->fates[i])) == name_of(expected[i]));
  }
  CHECK(run.out->fate == FrameFate::full);
  (void)run.step([&](Frame& f) {
    for (std::size_t i = 0; i < f.observations.size(); ++i) i % 2 == 0 ? f.observations[i].score = 0 : f.observations[i].pixel_px[0] = nan;
  });
  CHECK(run.out->fate == FrameFate::nothing_usable);
}

TEST_CASE("bad input: frames that are not in order of time are refused and change nothing but a count") {
  Rng rng{12}, same_rng{12};
  Run run(rng), undisturbed(same_rng);
  run.warm_up(), undisturbed.warm_up();
  const auto before = run.admission->tracks().frame();
  Frame late;
  late.time = run.drive.time().plus_seconds(-0.05);
  Admitted out;
  CHECK(run.admission->add(late, std::nullopt, out).code == StatusCode::out_of_order);
  late.time = run.drive.time();
  CHECK(run.admission->add(late, std::nullopt, out).code == StatusCode::duplicate);
  CHECK(out.fate == FrameFate::out_of_order);
  CHECK(run.admission->counts().of(FrameFate::out_of_order) == 2);
  CHECK(run.admission->tracks().frame() == before);
  const Admitted &a = run.step(), &b = undisturbed.step();
  REQUIRE(a.observations.size() == b.observations.size());
  CHECK(a.motion.t_prev_cur_m == b.motion.t_prev_cur_m);
}

TEST_CASE("bad input: a camera that is none is refused") {
  const auto admission = std::make_unique<Admission>(StereoCamera<double>{});
  Admitted out;
  CHECK(admission->add(Frame{}, std::nullopt, out).code == StatusCode::invalid_argument);
}

TEST_CASE("admission: the vehicle stops and the cue comes up; it drives on and the cue goes at once") {
  Rng rng{13};
  Run run(rng);
  run.warm_up();
  const auto stand = [&] {
    const Frame frame = run.drive.next(0, 0);
    REQUIRE(run.admission->add(frame, run.drive.prediction(), *run.out).ok());
    return run.out->stands_still;
  };
  int up = 0;
  for (int i = 0; i < 20; ++i) up += stand();
  CHECK(up >= 12);
  CHECK(run.admission->counts().still_frames == static_cast<std::size_t>(up));
  (void)run.step();
  CHECK_FALSE(run.out->stands_still);
}

TEST_CASE("admission: each piece of screening can be switched off by itself") {
  const auto fates_with = [](auto change) {
    Rng rng{14};
    AdmissionOptions options = sharp_options();
    change(options);
    auto run = std::make_unique<Run>(rng, options);
    for (int i = 0; i < 5; ++i) (void)run->step();
    (void)run->step([](Frame& f) {
      auto& o = f.observations;
      o[0].score = 0.1;
      o[1].semantic_class = 13;
      o[2].pixel_px += Eigen::Vector3d(20, 20, 20);
      o.back().track = 777777;  // never seen before
    });
    const auto& fates = run->out->fates;
    return std::vector<ObservationFate>{fates[0], fates[1], fates[2], fates.back()};
  };
  using F = ObservationFate;
  CHECK((fates_with([](AdmissionOptions&) {}) == std::vector<F>{F::low_score, F::semantic_class, F::motion_outlier, F::maturing}));
  CHECK((fates_with([](AdmissionOptions& o) { o.use_geometric = false; }) ==
         std::vector<F>{F::admitted, F::semantic_class, F::motion_outlier, F::maturing}));
  CHECK((fates_with([](AdmissionOptions& o) { o.use_semantic = false; }) ==
         std::vector<F>{F::low_score, F::admitted, F::motion_outlier, F::maturing}));
  CHECK((fates_with([](AdmissionOptions& o) { o.use_motion = false; }) ==
         std::vector<F>{F::low_score, F::semantic_class, F::admitted, F::maturing}));
  CHECK((fates_with([](AdmissionOptions& o) { o.use_maturity = false; }) ==
         std::vector<F>{F::low_score, F::semantic_class, F::motion_outlier, F::admitted}));
}

TEST_CASE("admission: the same frames give the same bits") {
  Rng a_rng{15}, b_rng{15};
  Run a(a_rng), b(b_rng);
  for (int i = 0; i < 20; ++i) {
    const Admitted &x = a.step(), &y = b.step();
    CHECK(x.motion.t_prev_cur_m == y.motion.t_prev_cur_m);
    CHECK(x.covariance == y.covariance);
    REQUIRE(x.observations.size() == y.observations.size());
    for (std::size_t k = 0; k < x.observations.size(); ++k) CHECK(x.observations[k].landmark == y.observations[k].landmark);
  }
}

TEST_CASE("admission: a landmark that the estimator gave up is begun anew by its track") {
  Rng rng{16};
  Run run(rng);
  run.warm_up();
  const AdmittedObservation given_up = run.out->observations[0];
  run.admission->end_landmark(given_up.track);
  (void)run.step();
  for (const AdmittedObservation& o : run.out->observations)
    if (o.track == given_up.track) {
      CHECK(o.begins);
      CHECK(o.landmark > given_up.landmark);
    }
}

TEST_CASE("admission: no heap, whatever comes") {
  Rng rng{18};
  Run run(rng);
  std::vector<Frame> frames;
  std::vector<PredictedMotion> predictions;
  for (int i = 0; i < 20; ++i) {
    frames.push_back(run.drive.next());
    predictions.push_back(*run.drive.prediction());
    if (i == 12) frames.back().observations.clear();
    for (StereoObservation& o : frames.back().observations)
      if (chance(rng, 0.1)) o.pixel_px += random_vector<3>(rng, 30);
  }
  std::size_t admitted = 0;
  const auto before = heap_allocations();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    (void)run.admission->add(frames[i], predictions[i], *run.out, Everywhere{2}, NoMask{});
    admitted += run.out->observations.size();
  }
  const auto after = heap_allocations();
  CHECK(after == before);
  CHECK(admitted > 300);
}
