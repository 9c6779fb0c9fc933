// SPDX-License-Identifier: BSD-3-Clause
// The estimator with a camera on a simulated drive: what frames are worth while GNSS is missing, what they may not disturb, and input that is no good.
#include <cmath>
#include <cstdio>
#include <limits>

#include "estimator/inertial_drive.hpp"
#include "estimator/stereo_under_test.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::RtkSolution;
using estimator::SolutionSource;
using estimator::SolutionStatus;

namespace {

constexpr double kFrom = 86, kTo = 116, kEnd = 130;  ///< without a rover, while the vehicle drives

const InertialDrive& drive() {
  static const InertialDrive d = simulated_inertial_drive("light", kEnd, 21, {1, 100, imu::SampleKind::instantaneous, true});
  return d;
}

StereoUnderTest::Options stereo_options(const InertialDrive& d) {
  const estimator::EstimatorOptions plain = options_for(d);
  StereoUnderTest::Options o;
  static_cast<estimator::InertialOptions&>(o.inertial) = plain.inertial;
  o.inertial.stereo.camera = d.camera;
  o.inertial.stereo.admission.pnp.sigma_px = 0.7;
  o.inertial.stereo.admission.semantic.dynamic = {vision::SemanticClass{3}, vision::SemanticClass{4}};
  o.inertial.stereo.admission.semantic.unstable = vision::ClassSet{};
  return o;
}

/// What of the drive a run is told.
struct Told {
  bool rover_in_gap{false};
  double frames_late_s{0}, rover_late_s{0};
  std::function<bool(StereoUnderTest::Frame&)> alter{};  ///< changes a frame; false leaves it out
};

struct StereoRun : Run {
  vision::AdmissionCounts counts{};
  long refused_frames{0}, dropped_landmarks{0};
};

StereoRun run_with(const InertialDrive& d, const StereoUnderTest::Options& options, bool has_frames, const Told& told = {}) {
  StereoUnderTest e{options};
  for (const gnss::Ephemeris& record : d.ephemerides) REQUIRE(e.add_ephemeris(record).ok());
  if (d.ionosphere.present()) e.set_ionosphere(d.ionosphere);
  REQUIRE(e.set_base_position(d.base_e_m).ok());
  std::vector<Arrival> all = arrivals(d, {0, 0, told.rover_late_s});
  if (!told.rover_in_gap) cut(all, d, Stream::rover, kFrom, kTo);
  StereoRun run;
  std::size_t next = 0;
  const auto take = [&] {
    for (auto s = e.next(); s.ok() || !estimator::is_nothing_due(s.status()); s = e.next())
      s.ok() ? run.solutions.push_back(*s) : static_cast<void>(++run.errors);
  };
  for (const Arrival& a : all) {
    for (; has_frames && next < d.frames.size() && d.frames[next].time.plus_seconds(told.frames_late_s) <= a.at; ++next) {
      StereoUnderTest::Frame frame = d.frames[next];
      if (told.alter && !told.alter(frame)) continue;
      run.refused += e.add_stereo(frame).ok() ? 0 : 1;
      take();
    }
    const Status s = a.stream == Stream::imu ? e.add_imu(d.imu[a.index]) : a.stream == Stream::base ? e.add_base(d.base[a.index]) : e.add_rover(d.rover[a.index]);
    run.refused += s.ok() ? 0 : 1;
    take();
  }
  e.finish(), take();
  run.alignments = e.alignments(), run.counts = e.motion().counts(), run.refused_frames = e.refused_frames(), run.dropped_landmarks = e.motion().dropped_landmarks();
  return run;
}

/// Without the solutions of the frames themselves.
DriveScore score_epochs(const InertialDrive& d, Run run, double from_s, double to_s) {
  std::erase_if(run.solutions, [](const RtkSolution& s) { return s.source == SolutionSource::camera && std::abs(std::remainder(s.time.sow(), 1.0)) > 1e-6; });
  return score_of(d, run, from_s, to_s);
}

void check_order(const Run& run) {
  for (std::size_t k = 1; k < run.solutions.size(); ++k) CHECK(run.solutions[k - 1].time < run.solutions[k].time);
  for (const RtkSolution& s : run.solutions) {
    CHECK(s.position_e_m.allFinite());
    CHECK(s.covariance_enu_m2.allFinite());
  }
}

const StereoRun& seeing() {
  static const StereoRun run = run_with(drive(), stereo_options(drive()), true);
  return run;
}

}  // namespace

TEST_CASE("thirty seconds without GNSS: frames bound the drift of the unit, and the covariance says by how much") {
  const InertialDrive& d = drive();
  const StereoRun blind = run_with(d, stereo_options(d), false);
  const DriveScore without = score_epochs(d, blind, kFrom, kTo), with = score_epochs(d, seeing(), kFrom, kTo), later = score_epochs(d, seeing(), kTo + 3, kEnd);
  char line[240];
  std::snprintf(line, sizeof line, "horizontal error, largest: unit alone %.2f m, with frames %.2f m (mean nees %.1f, 2 is right); afterwards %.3f m, %.0f %% fixed",
                without.max_m, with.max_m, with.mean_nees(), later.max_m, later.fixed_percent());
  MESSAGE(line);
  MESSAGE("landmarks " << seeing().counts.landmarks << ", dropped as moving " << seeing().dropped_landmarks << ", observations admitted "
                       << seeing().counts.of(vision::ObservationFate::admitted));
  check_order(seeing());
  CHECK(seeing().errors == 0);
  CHECK(seeing().refused == 0);
  CHECK(seeing().refused_frames == 0);
  CHECK(seeing().counts.landmarks > 500);
  CHECK(with.max_m < 0.5);
  CHECK(with.max_m < without.max_m);
  CHECK(with.mean_nees() < 10);
  CHECK(later.max_m < 0.1);
  CHECK(later.fixed_percent() > 80);
  int of_frames = 0;
  for (const RtkSolution& s : seeing().solutions) {
    if (s.source != SolutionSource::camera) continue;
    ++of_frames;
    CHECK(s.status == SolutionStatus::dr);
  }
  CHECK(of_frames > 600);
}

TEST_CASE("reprojection in the left view alone: depth comes from motion, and the drift of the unit is bounded all the same") {
  const InertialDrive& d = drive();
  StereoUnderTest::Options left = stereo_options(d);
  left.inertial.stereo.eyes = vision::Eyes::left;
  const StereoRun one = run_with(d, left, true), blind = run_with(d, stereo_options(d), false);
  const DriveScore by_one = score_epochs(d, one, kFrom, kTo), by_two = score_epochs(d, seeing(), kFrom, kTo), by_none = score_epochs(d, blind, kFrom, kTo),
                   later = score_epochs(d, one, kTo + 3, kEnd);
  char line[240];
  std::snprintf(line, sizeof line, "horizontal error, largest: by no eye %.2f m, one %.2f m (mean nees %.1f), two %.2f m; dropped as moving %ld", by_none.max_m,
                by_one.max_m, by_one.mean_nees(), by_two.max_m, one.dropped_landmarks);
  MESSAGE(line);
  check_order(one);
  CHECK(one.errors == 0);
  CHECK(by_one.max_m < by_none.max_m);
  CHECK(by_one.mean_nees() < 10);
  CHECK(numbers_of(one) != numbers_of(seeing()));
  CHECK(later.max_m < 0.1);
}

TEST_CASE("with GNSS all the time frames disturb no fix, and every epoch is answered") {
  const InertialDrive& d = drive();
  const StereoRun run = run_with(d, stereo_options(d), true, {.rover_in_gap = true});
  check_order(run);
  std::size_t answered = 0;
  for (const RtkSolution& s : run.solutions) answered += s.source == SolutionSource::rover ? 1 : 0;
  CHECK(answered == d.rover.size());
  const DriveScore s = score_epochs(d, run, 45, kEnd);
  CHECK(s.aligned == s.solutions);
  CHECK(s.wrong == 0);
  CHECK(s.max_m < 0.1);
  CHECK(s.mean_nees() < 6);
}

TEST_CASE("P27 frames or rover epochs late within the latency: the same bits; the same input: the same bits") {
  const InertialDrive& d = drive();
  const auto same = [](const StereoRun& run) { return numbers_of(run) == numbers_of(seeing()); };
  CHECK(same(run_with(d, stereo_options(d), true)));
  CHECK(same(run_with(d, stereo_options(d), true, {.frames_late_s = 0.08})));
  CHECK(same(run_with(d, stereo_options(d), true, {.rover_late_s = 0.12})));
}

TEST_CASE("bad frames: masked, empty, doubled, doubled tracks, negative disparity, NaN, backward: counted, and the run is as good as without them") {
  const InertialDrive& d = drive();
  int k = 0;
  const StereoRun run = run_with(d, stereo_options(d), true, {.alter = [&k](StereoUnderTest::Frame& frame) {
    switch (++k % 12) {
      case 0:
        for (auto& o : frame.observations) o.semantic_class = 4;
        return true;
      case 2:
        frame.observations.clear();
        return true;
      case 4:
        for (auto& o : frame.observations) o.track = 7;
        return true;
      case 6:
        for (auto& o : frame.observations) std::swap(o.pixel_px[0], o.pixel_px[1]);
        return true;
      case 8:
        for (auto& o : frame.observations) o.pixel_px[2] = std::numeric_limits<double>::quiet_NaN();
        return true;
      case 10: frame.time = frame.time.plus_seconds(-0.1); return true;  // the time of the frame before
      default: return true;
    }
  }});
  check_order(run);
  CHECK(run.errors == 0);
  CHECK(run.refused > 50);
  for (const auto fate : {vision::FrameFate::masked, vision::FrameFate::empty}) CHECK(run.counts.of(fate) > 10);
  for (const auto fate : {vision::ObservationFate::semantic_class, vision::ObservationFate::duplicate_track, vision::ObservationFate::no_disparity, vision::ObservationFate::not_finite})
    CHECK(run.counts.of(fate) > 100);
  const DriveScore outage = score_epochs(d, run, kFrom, kTo), later = score_epochs(d, run, kTo + 3, kEnd);
  MESSAGE("with half of the frames spoilt: " << outage.max_m << " m at the most without GNSS");
  CHECK(outage.max_m < 15);
  CHECK(later.max_m < 0.1);
}

TEST_CASE("a point that moves alike in all frames, a lorry ahead, does not take the vehicle with it") {
  const InertialDrive& d = drive();
  const StereoRun run = run_with(d, stereo_options(d), true, {.rover_in_gap = true, .alter = [&d](StereoUnderTest::Frame& frame) {
    const double t = d.seconds(frame.time);
    if (t < 88 || t > 98) return true;
    frame.observations.clear();
    for (int i = 0; i < 40; ++i) {  // fixed in the picture: it drives as fast as we do
      vision::StereoObservation o;
      o.track = 1'000'000 + static_cast<std::uint64_t>(i), o.score = 0.9, o.semantic_class = 0;
      o.pixel_px = {800.0 + 10 * (i % 8), 760.0 + 10 * (i % 8), 300.0 + 15 * (i / 8)};
      (void)frame.add(o);
    }
    return true;
  }});
  const DriveScore s = score_epochs(d, run, 88, 100);
  MESSAGE("frames rejected " << run.counts.of(vision::FrameFate::differs) << ", largest error " << s.max_m << " m");
  CHECK(run.counts.of(vision::FrameFate::differs) > 30);
  CHECK(s.max_m < 0.1);
}
