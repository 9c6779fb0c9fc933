// SPDX-License-Identifier: BSD-3-Clause
// RTK and inertial navigation on simulated drives: alignment, accuracy, order of input, gaps and losses of every stream, outages, mounting, rates,
// bad input, repeatability.
#include <cstdio>
#include <cstring>

#include "estimator/inertial_drive.hpp"
#include "estimator/rtk_under_test.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::EstimatorOptions;
using estimator::RtkSolution;
using estimator::SolutionStatus;

namespace {

/// Two and a half minutes in the open; made once.
const InertialDrive& open_drive() {
  static const InertialDrive d = simulated_inertial_drive("open", 150, 5);
  return d;
}
/// Its run without anything amiss.
const Run& open_run() {
  static const Run run = run_all(open_drive(), arrivals(open_drive()), options_for(open_drive()));
  return run;
}

std::string line_of(const char* name, const DriveScore& s) {
  char line[300];
  std::snprintf(line, sizeof line,
                "%s: %d solutions, fix %d float %d dgnss %d spp %d dr %d, aligned %d, horizontal rms %.3f max %.3f, of fixed %.4f m, %d "
                "wrong, nees %.2f, attitude max %.2f deg",
                name, s.solutions, s.by_status[0], s.by_status[1], s.by_status[2], s.by_status[3], s.by_status[4], s.aligned, s.rms_m(),
                s.max_m, s.fixed_rms_m(), s.wrong, s.mean_nees(), s.attitude_max_rad * 57.29578);
  return line;
}

/// Solutions at rover tags, and the longest time between two.
void check_nothing_silent(const InertialDrive& d, const Run& run, double from_s, double to_s, double longest_s = 1.3) {
  double last_s = from_s, longest = 0;
  for (const RtkSolution& s : run.solutions) {
    const double t = d.seconds(s.tag);
    if (t < from_s || t > to_s) continue;
    CHECK(s.position_e_m.allFinite());
    CHECK(s.covariance_enu_m2.allFinite());
    longest = std::max(longest, t - last_s), last_s = t;
  }
  longest = std::max(longest, to_s - last_s);
  CHECK(longest < longest_s);
}

/// Solutions come in the order of time, each once.
void check_order(const Run& run) {
  for (std::size_t k = 1; k < run.solutions.size(); ++k) {
    CAPTURE(k);
    CHECK(run.solutions[k].time > run.solutions[k - 1].time);
  }
}

}  // namespace

TEST_CASE(
    "an open drive: a solution for the first epoch and every other; what the alignment waits for is said; then centimetres, honest "
    "covariance and attitude") {
  const InertialDrive& d = open_drive();
  InertialUnderTest e = estimator_for(d, options_for(d));
  CHECK(std::strlen(e.waiting_text()) > 0);
  std::vector<std::string> texts;
  Run run;
  double aligned_s = -1;
  for (const Arrival& a : arrivals(d)) {
    REQUIRE(hand_over(e, d, a).ok());
    drain(e, run);
    if (texts.empty() || texts.back() != e.waiting_text()) texts.emplace_back(e.waiting_text());
    if (e.is_aligned() && aligned_s < 0) aligned_s = d.seconds(a.at);
    CHECK(e.is_aligned() == (e.alignment_state() == imu::AlignmentState::aligned));
  }
  e.finish(), drain(e, run);
  std::string said;
  for (const std::string& t : texts) said += "[" + t + "] ";
  MESSAGE("aligned at " << aligned_s << " s; said: " << said);
  CHECK(texts.size() >= 3);
  CHECK(aligned_s > 20);  // a heading needs motion
  CHECK(aligned_s < 40);
  CHECK(e.alignments() == 1);
  CHECK(run.errors == 0);
  REQUIRE(run.solutions.size() == d.rover.size() + (d.imu.back().time > d.rover.back().tag.plus_seconds(1) ? 1U : 0U));
  CHECK(run.solutions.front().tag == d.rover.front().tag);
  CHECK_FALSE(run.solutions.front().has_attitude);
  check_order(run);
  const DriveScore before = score_of(d, run, 0, aligned_s), after = score_of(d, run, aligned_s + 2, 150),
                   settled = score_of(d, run, 70, 150);
  MESSAGE(line_of("before", before));
  MESSAGE(line_of("aligned", after));
  MESSAGE(line_of("from 70 s", settled));
  CHECK(after.aligned == after.solutions);
  CHECK(after.fixed_percent() > 97);
  CHECK(after.rms_m() < 0.03);
  CHECK(after.max_m < 0.1);
  CHECK(after.wrong + before.wrong == 0);
  CHECK(after.mean_nees() < 4);
  CHECK(settled.attitude_max_rad < 0.02);
}

TEST_CASE("GNSS alone, no inertial unit at all: the same bits as the RTK estimator") {
  const InertialDrive& d = open_drive();
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::imu, -1e9);
  const Run run = run_all(d, all, options_for(d));
  RtkUnderTest rtk{estimator::RtkOptions{}};
  for (const gnss::Ephemeris& record : d.ephemerides) REQUIRE(rtk.add_ephemeris(record).ok());
  if (d.ionosphere.present()) rtk.set_ionosphere(d.ionosphere);
  REQUIRE(rtk.set_base_position(d.base_e_m).ok());
  Run alone;
  std::size_t next = 0;  // an epoch is answered when the next one is there: the base is then ahead
  for (const gnss::ObservationEpoch& epoch : d.rover) {
    while (next < d.base.size() && d.base[next].tag <= epoch.tag.plus_seconds(1.01)) (void)rtk.add_base(d.base[next++]);
    const auto s = rtk.update(epoch);
    if (s.ok()) alone.solutions.push_back(*s);
  }
  CHECK(run.solutions.size() == d.rover.size());
  CHECK(run.alignments == 0);
  CHECK(numbers_of(run) == numbers_of(alone));
}

TEST_CASE(
    "P27 the order of input within the latency does not matter: readings, base or rover epochs late by a tenth of a second give the same bits") {
  const InertialDrive& d = open_drive();
  for (const Delays& delays : {Delays{0.1, 0, 0}, Delays{0, 0, 0.1}, Delays{0, 0.15, 0}, Delays{0.07, 0.16, 0.13}}) {
    CAPTURE(delays.imu_s);
    CAPTURE(delays.base_s);
    CAPTURE(delays.rover_s);
    const Run run = run_all(d, arrivals(d, delays), options_for(d));
    CHECK(run.refused == 0);
    CHECK(numbers_of(run) == numbers_of(open_run()));
  }
}

TEST_CASE(
    "P27 a rover epoch later than the latency is refused with a status, and as if it had never come, whether the receiver's clock is ahead "
    "or behind") {
  for (const std::uint64_t seed : {std::uint64_t{1}, std::uint64_t{2}}) {  // clocks 0.13 ms ahead and 0.02 ms behind
    const InertialDrive d = simulated_inertial_drive("open", 60, seed);
    std::vector<Arrival> all = arrivals(d);
    std::size_t late = 0;
    for (Arrival& a : all)
      if (a.stream == Stream::rover && a.index >= 36 && a.index % 5 == 0) a.at = a.at.plus_seconds(0.7), ++late;
    std::stable_sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) { return a.at < b.at; });
    std::vector<Arrival> without = all;
    std::erase_if(without, [&](const Arrival& a) { return a.stream == Stream::rover && a.at != d.rover[a.index].tag; });
    InertialUnderTest e = estimator_for(d, options_for(d));
    Run run;
    std::size_t refused = 0;
    for (const Arrival& a : all) {
      const Status s = hand_over(e, d, a);
      if (!s.ok()) {
        ++refused;
        CHECK(s.code == StatusCode::out_of_order);
      }
      drain(e, run);
    }
    e.finish(), drain(e, run);
    CAPTURE(seed);
    CHECK(refused == late);
    check_order(run);
    CHECK(numbers_of(run) == numbers_of(run_all(d, without, options_for(d))));
  }
}

TEST_CASE("P8, P22 NaN, duplicate and backward input is refused with a status, and as if it had never come") {
  const InertialDrive& d = open_drive();
  InertialUnderTest e = estimator_for(d, options_for(d));
  Rng rng{3};
  Run run;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const Arrival& a : arrivals(d)) {
    REQUIRE(hand_over(e, d, a).ok());
    drain(e, run);
    if (a.stream == Stream::imu && chance(rng, 0.05)) {
      imu::ImuSample bad = d.imu[a.index];
      CHECK(e.add_imu(bad).code == StatusCode::duplicate);
      bad.time = bad.time.plus_seconds(-uniform(rng, 0.001, 100));
      CHECK(e.add_imu(bad).code == StatusCode::out_of_order);
      bad.time = d.imu[a.index].time.plus_seconds(uniform(rng, -5, 5));
      (chance(rng, 0.5) ? bad.gyro_b_radps : bad.accel_b_mps2)[integer(rng, 0, 2)] = chance(rng, 0.5) ? nan : -infinity;
      CHECK(e.add_imu(bad).code == StatusCode::non_finite);
    }
    if (a.stream == Stream::rover && a.index > 0) {
      CHECK(e.add_rover(d.rover[a.index]).code == StatusCode::duplicate);
      CHECK(e.add_rover(d.rover[a.index - 1]).code == StatusCode::out_of_order);
    }
    if (a.stream == Stream::base && a.index > 0) {
      CHECK(e.add_base(d.base[a.index]).code == StatusCode::duplicate);
      CHECK(e.add_base(d.base[a.index - 1]).code == StatusCode::out_of_order);
    }
    if (chance(rng, 0.01)) {
      CHECK_FALSE(e.set_base_position({nan, 0, 0}).ok());
      CHECK_FALSE(e.set_heading(nan, 1).ok());
      (void)e.predict(a.at.plus_seconds(uniform(rng, -10, 10)));
    }
  }
  e.finish(), drain(e, run);
  CHECK(numbers_of(run) == numbers_of(open_run()));
}

TEST_CASE("P19, P24 the same input gives the same bits; two estimators interleaved do not disturb each other; nor does a copy") {
  const InertialDrive& a = open_drive();
  static const InertialDrive b = simulated_inertial_drive("light", 60, 6);
  const std::vector<Arrival> from_a = arrivals(a), from_b = arrivals(b);
  CHECK(numbers_of(run_all(a, from_a, options_for(a))) == numbers_of(open_run()));
  const Run alone_b = run_all(b, from_b, options_for(b));
  InertialUnderTest ea = estimator_for(a, options_for(a)), eb = estimator_for(b, options_for(b));
  std::optional<InertialUnderTest> copy;
  Run run_a, run_b, run_copy;
  for (std::size_t i = 0; i < from_a.size(); ++i) {
    if (i == from_a.size() / 2) copy.emplace(ea), run_copy = run_a;
    (void)hand_over(ea, a, from_a[i]), drain(ea, run_a);
    if (copy) (void)hand_over(*copy, a, from_a[i]), drain(*copy, run_copy);
    if (i < from_b.size()) (void)hand_over(eb, b, from_b[i]), drain(eb, run_b);
  }
  for (InertialUnderTest* e : {&ea, &*copy, &eb}) e->finish();
  drain(ea, run_a), drain(*copy, run_copy), drain(eb, run_b);
  CHECK(numbers_of(run_a) == numbers_of(open_run()));
  CHECK(numbers_of(run_copy) == numbers_of(open_run()));
  CHECK(numbers_of(run_b) == numbers_of(alone_b));
}

TEST_CASE("P8 two seconds without readings: GNSS alone answers every epoch, then the unit is aligned anew") {
  const InertialDrive& d = open_drive();
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::imu, 75.3, 77.3);
  const Run run = run_all(d, all, options_for(d));
  check_order(run);
  check_nothing_silent(d, run, 0, 149);
  CHECK(run.errors == 0);
  CHECK(run.alignments == 2);
  const DriveScore gap = score_of(d, run, 76, 77), after = score_of(d, run, 110, 150);
  MESSAGE(line_of("in the gap", gap));
  MESSAGE(line_of("later", after));
  CHECK(gap.solutions == 2);
  CHECK(gap.aligned == 0);
  CHECK(gap.max_m < 10);
  CHECK(after.aligned == after.solutions);
  CHECK(after.fixed_percent() > 90);
  CHECK(after.max_m < 0.1);
  const DriveScore short_gap = score_of(
      d,
      [&] {
        std::vector<Arrival> some = arrivals(d);
        cut(some, d, Stream::imu, 75.3, 75.7);  // shorter than max_gap_s: bridged, at a price
        return run_all(d, some, options_for(d));
      }(),
      70, 90);
  CHECK(short_gap.aligned == short_gap.solutions);
  CHECK(short_gap.max_m < 0.3);
}

TEST_CASE("P8 readings dropped, doubled and shuffled: every epoch answered, finite, in order, decimetres") {
  const InertialDrive& d = open_drive();
  for_all_seeds(1, [&](Rng& rng) {
    std::vector<Arrival> all;
    for (const Arrival& a : arrivals(d)) {
      if (a.stream == Stream::imu && chance(rng, 0.02)) continue;
      all.push_back(a);
      if (a.stream == Stream::imu && chance(rng, 0.02)) all.push_back(a);
    }
    for (std::size_t i = 1; i < all.size(); ++i)
      if (chance(rng, 0.02)) std::swap(all[i], all[i - 1]);
    const Run run = run_all(d, all, options_for(d));
    CHECK(run.refused > 100);
    check_order(run);
    check_nothing_silent(d, run, 0, 149);
    const DriveScore s = score_of(d, run, 60, 150);
    MESSAGE(line_of("dropped, doubled, shuffled", s));
    CHECK(s.aligned == s.solutions);
    CHECK(s.max_m < 0.3);
  });
}

TEST_CASE("the base is lost for good: the window goes on with Doppler and readings, labels and ages say so") {
  const InertialDrive& d = open_drive();
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::base, 80);
  const Run run = run_all(d, all, options_for(d));
  check_nothing_silent(d, run, 0, 149);
  const DriveScore carried = score_of(d, run, 80, 105), lost = score_of(d, run, 112, 150);
  MESSAGE(line_of("base carried forward", carried));
  MESSAGE(line_of("base lost", lost));
  CHECK(carried.of(SolutionStatus::fix) + carried.of(SolutionStatus::float_) == carried.solutions);
  CHECK(lost.of(SolutionStatus::fix) + lost.of(SolutionStatus::float_) + lost.of(SolutionStatus::dgnss) == 0);
  CHECK(lost.aligned == lost.solutions);
  CHECK(lost.max_m < 2);
  CHECK(lost.mean_nees() < 6);
  for (const RtkSolution& s : run.solutions) {
    const double t = d.seconds(s.tag);
    if (t > 82 && t < 105) CHECK(s.base_age_s == doctest::Approx(t - 79).epsilon(0.02));
    if (t > 112) CHECK(std::isnan(s.base_age_s));
    if (t > 112) CHECK(s.verdict != ambiguity::ResolutionVerdict::accepted);
  }
}

namespace {

/// What an outage came to.
struct Outage {
  double error_m{0}, sigma_m{0}, nees{0};
};

}  // namespace

TEST_CASE(
    "P18 no rover for 10, 30 and 60 s at twenty places: a dr row each second, the drift is what sigma says, and the way back is smooth") {
  static const InertialDrive d = simulated_inertial_drive("open", 1100, 9);
  const std::vector<Arrival> all = arrivals(d);
  InertialUnderTest e = estimator_for(d, options_for(d));
  std::array<std::vector<Outage>, 3> outages;
  const std::array<double, 3> lengths_s{10, 30, 60};
  Run main;
  double next_s = 75;
  for (std::size_t i = 0; i < all.size() && next_s < 1030; ++i) {
    (void)hand_over(e, d, all[i]), drain(e, main);
    if (d.seconds(all[i].at) < next_s + 0.5) continue;
    InertialUnderTest alone = e;
    Run run;
    for (std::size_t k = i + 1; k < all.size() && d.seconds(all[k].at) < next_s + 68; ++k) {
      if (all[k].stream == Stream::rover && d.seconds(d.rover[all[k].index].tag) < next_s + 60.5) continue;
      CHECK(hand_over(alone, d, all[k]).ok());
      drain(alone, run);
    }
    CHECK(alone.alignments() == 1);
    check_nothing_silent(d, run, next_s, next_s + 67, 1.5);
    check_order(run);
    double back_m = 0;
    for (const RtkSolution& s : run.solutions) {
      const double since_s = d.seconds(s.tag) - next_s;
      const Eigen::Vector3d error = *error_n_m(d, s);
      if (since_s < 60.5) {
        CHECK(s.status == SolutionStatus::dr);
        CHECK(s.satellites == 0);
      } else {
        back_m = error.head<2>().norm();
        CHECK(s.status != SolutionStatus::dr);
      }
      for (std::size_t l = 0; l < 3; ++l)
        if (std::abs(since_s - lengths_s[l]) < 0.5)
          outages[l].push_back({error.head<2>().norm(), horizontal_sigma_m(s), horizontal_nees(error, s)});
    }
    CHECK(back_m < 0.1);
    next_s += 50;
  }
  char line[200];
  for (std::size_t l = 0; l < 3; ++l) {
    std::vector<double> errors, sigmas, ratios;
    double nees = 0, worst = 0;
    for (const Outage& o : outages[l])
      errors.push_back(o.error_m), sigmas.push_back(o.sigma_m), nees += o.nees, worst = std::max(worst, o.nees);
    REQUIRE(errors.size() == 20);
    nees /= static_cast<double>(errors.size());
    std::snprintf(line, sizeof line,
                  "outage of %2.0f s (%d places): horizontal drift median %.2f max %.2f m, sigma median %.2f m, nees mean %.2f (2 is "
                  "right) worst %.1f",
                  lengths_s[l], static_cast<int>(errors.size()), median(errors), *std::max_element(errors.begin(), errors.end()),
                  median(sigmas), nees, worst);
    MESSAGE(line);
    CHECK(nees < 5);
    CHECK(worst < 18.4);  // one in ten thousand
    CHECK(median(errors) < 3 * median(sigmas));
  }
}

TEST_CASE("P18 the rover is silent for good, or from the start: dr to the end, and alignment as soon as there is GNSS") {
  const InertialDrive& d = open_drive();
  std::vector<Arrival> never_again = arrivals(d), late_start = arrivals(d);
  cut(never_again, d, Stream::rover, 100);
  cut(late_start, d, Stream::rover, -10, 60);
  const Run gone = run_all(d, never_again, options_for(d)), late = run_all(d, late_start, options_for(d));
  check_nothing_silent(d, gone, 0, 150);
  const DriveScore alone = score_of(d, gone, 100.5, 150);
  MESSAGE(line_of("readings alone", alone));
  CHECK(alone.of(SolutionStatus::dr) == alone.solutions);
  CHECK(alone.solutions >= 49);
  CHECK(alone.mean_nees() < 8);
  CHECK(late.solutions.front().tag == d.rover[60].tag);
  CHECK(late.alignments == 1);
  check_nothing_silent(d, late, 60, 149);
  const DriveScore after = score_of(d, late, 100, 150);
  MESSAGE(line_of("GNSS from 60 s on", after));
  CHECK(after.aligned == after.solutions);
  CHECK(after.max_m < 0.1);
}

TEST_CASE("the base is lost in streets for ten minutes: codes of the rover alone bound what Doppler shifts and readings let drift") {
  const InertialDrive d = simulated_inertial_drive("urban", 700, 42);
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::base, 70);
  std::array<DriveScore, 2> end;
  std::array<double, 2> sigma_m{};
  for (const std::size_t codes : {0U, 1U}) {
    EstimatorOptions options = options_for(d);
    options.rtk.use_undifferenced = codes == 1;
    const Run run = run_all(d, all, options);
    const DriveScore lost = score_of(d, run, 102, 700);
    end[codes] = score_of(d, run, 400, 700), sigma_m[codes] = horizontal_sigma_m(run.solutions.back());
    MESSAGE(line_of(codes == 1 ? "base lost, codes of the rover" : "base lost, no codes", lost) << ", sigma at the end " << sigma_m[codes] << " m, second half rms " << end[codes].rms_m());
    CHECK(lost.solutions >= 598);
    CHECK(lost.of(SolutionStatus::fix) + lost.of(SolutionStatus::float_) + lost.of(SolutionStatus::dgnss) == 0);
  }
  CHECK(end[1].of(SolutionStatus::spp) > 250);
  CHECK(sigma_m[1] < sigma_m[0]);
  CHECK(end[1].mean_nees() < 6);
  CHECK(end[1].max_m < 3);
}

TEST_CASE("tightly coupled without any base: aligned by single points, metres, honest covariance, nothing called better than it is") {
  const InertialDrive d = simulated_inertial_drive("light", 200, 44);
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::base, -10);
  const Run run = run_all(d, all, options_for(d));
  check_nothing_silent(d, run, 0, 199);
  const DriveScore whole = score_of(d, run, 0, 200), driven = score_of(d, run, 60, 200);
  MESSAGE(line_of("rover only", whole));
  CHECK(whole.of(SolutionStatus::spp) + whole.of(SolutionStatus::dr) == whole.solutions);
  CHECK(driven.aligned == driven.solutions);
  CHECK(driven.rms_m() < 3);
  CHECK(driven.mean_nees() < 6);
}

TEST_CASE("P18 two satellites or one after the alignment: the window goes on and stays within a metre") {
  for (const std::size_t left : {std::size_t{1}, std::size_t{2}, std::size_t{3}}) {
    CAPTURE(left);
    InertialDrive d = open_drive();
    for (gnss::ObservationEpoch& epoch : d.rover) {
      const double t = d.seconds(epoch.tag);
      if (t > 80.5 && t < 90.5)
        while (epoch.satellites.size() > left) epoch.satellites.pop_back();
    }
    const Run run = run_all(d, arrivals(d), options_for(d));
    CHECK(run.alignments == 1);
    const DriveScore few = score_of(d, run, 81, 90), after = score_of(d, run, 93, 150);
    MESSAGE(line_of("few satellites", few));
    CHECK(few.solutions == 10);
    CHECK(few.max_m < 1.5);
    CHECK(after.fixed_percent() > 90);
    CHECK(after.max_m < 0.1);
  }
}

TEST_CASE("P9 a stop of a minute without GNSS: the vehicle does not drift, and the next epoch is where it was") {
  const InertialDrive d = drive_that_stops(70, 150, 4);
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::rover, 78, 140);
  const Run run = run_all(d, all, options_for(d));
  check_nothing_silent(d, run, 0, 149);
  const DriveScore moving = score_of(d, run, 40, 77), rest = score_of(d, run, 78, 139.5), later = score_of(d, run, 140, 150);
  MESSAGE(line_of("moving", moving));
  MESSAGE(line_of("at rest, readings alone", rest));
  CHECK(moving.aligned == moving.solutions);
  CHECK(rest.of(SolutionStatus::dr) == rest.solutions);
  CHECK(rest.max_m < 0.3);
  CHECK(rest.mean_nees() < 6);
  CHECK(later.aligned == later.solutions);
  CHECK(later.max_m < 0.1);
  int held = 0;
  for (const RtkSolution& s : run.solutions) held += d.seconds(s.tag) > 78 && d.seconds(s.tag) < 139.5 && s.stationary ? 1 : 0;
  CHECK(held > 55);
  EstimatorOptions blind = options_for(d);  // what the rest detection is worth
  blind.inertial.zero_velocity = blind.inertial.zero_angular_rate = blind.inertial.position_anchor = false;
  const DriveScore drifting = score_of(d, run_all(d, all, blind), 78, 139.5);
  MESSAGE(line_of("at rest, not held", drifting));
  CHECK(drifting.max_m > 3 * rest.max_m);
}

TEST_CASE("P9 a heading from elsewhere aligns at rest") {
  const InertialDrive& d = open_drive();
  const Eigen::Matrix3d R = d.truth(d.start)->R_nb;
  InertialUnderTest e = estimator_for(d, options_for(d));
  (void)e.set_heading(std::atan2(R(0, 1), R(1, 1)), 0.01);
  const Run run = run_all(e, d, arrivals(d));
  const DriveScore rest = score_of(d, run, 6, 19.4), away = score_of(d, run, 19.6, 150);
  MESSAGE(line_of("aligned at rest", rest));
  MESSAGE(line_of("pulled away", away));
  CHECK(rest.aligned == rest.solutions);
  CHECK(away.aligned == away.solutions);
  CHECK(away.max_m < 0.1);
}

TEST_CASE("P16 the unit mounted otherwise and told so: the same trajectory; with the lever arm left out it is not") {
  const InertialDrive& d = open_drive();
  const Eigen::Matrix3d R = so3::exp(Eigen::Vector3d{0, 0.35, 0});  // rolled on its forward axis
  const InertialDrive other = turned(d, R);
  const Run run = run_all(other, arrivals(other), options_for(other));
  REQUIRE(run.solutions.size() == open_run().solutions.size());
  double worst = 0, turn_rad = 0;
  for (std::size_t k = 0; k < run.solutions.size(); ++k) {
    const RtkSolution &a = open_run().solutions[k], &b = run.solutions[k];
    if (d.seconds(a.tag) < 60) continue;
    worst = std::max(worst, (a.position_e_m - b.position_e_m).norm() / std::sqrt(a.covariance_enu_m2.trace()));
    turn_rad = std::max(turn_rad, so3::log((b.R_nb * R * a.R_nb.transpose()).eval()).norm());
  }
  MESSAGE("worst difference " << worst << " sigma, attitude " << turn_rad * 57.3 << " deg");
  CHECK(worst < 0.3);
  CHECK(turn_rad < 2e-3);
  EstimatorOptions without = options_for(d);
  without.inertial.lever_arm_b_m.setZero();
  const DriveScore told = score_of(d, open_run(), 60, 150), untold = score_of(d, run_all(d, arrivals(d), without), 60, 150);
  MESSAGE(line_of("lever arm left out", untold));
  CHECK(untold.attitude_max_rad + untold.mean_nees() > told.attitude_max_rad + told.mean_nees());
}

TEST_CASE(
    "P17 rates: rover at 1, 2 and 5 Hz, unit at 50, 100 and 200 Hz, instantaneous or mean readings: aligned, every epoch answered, "
    "centimetres") {
  struct Case {
    double rover_hz, imu_hz;
    imu::SampleKind kind;
  };
  for (const Case& c : {Case{1, 50, imu::SampleKind::instantaneous}, Case{2, 200, imu::SampleKind::mean_to_stamp},
                        Case{5, 100, imu::SampleKind::instantaneous}}) {
    const InertialDrive d = simulated_inertial_drive("open", 60, 5, {c.rover_hz, c.imu_hz, c.kind});
    const Run run = run_all(d, arrivals(d), options_for(d));
    check_order(run);
    char name[100];
    std::snprintf(name, sizeof name, "rover %.0f Hz, unit %.0f Hz", c.rover_hz, c.imu_hz);
    const DriveScore s = score_of(d, run, 45, 60);
    MESSAGE(line_of(name, s));
    CHECK(run.errors == 0);
    CHECK(run.alignments == 1);
    CHECK(run.solutions.size() >= d.rover.size());
    CHECK(s.aligned == s.solutions);
    CHECK(s.fixed_percent() > 90);
    CHECK(s.max_m < 0.1);
  }
}

TEST_CASE(
    "prediction at the unit's rate: between the epochs it meets the truth, and the next epoch's state; beyond the readings it is refused") {
  const InertialDrive& d = open_drive();
  InertialUnderTest e = estimator_for(d, options_for(d));
  CHECK(e.predict(d.start).status().code == StatusCode::no_data);
  Run run;
  double worst_m = 0;
  int predicted = 0;
  for (const Arrival& a : arrivals(d)) {
    (void)hand_over(e, d, a), drain(e, run);
    if (a.stream != Stream::imu || !e.is_aligned() || d.seconds(a.at) < 70 || run.solutions.empty()) continue;
    CHECK_FALSE(e.predict(a.at.plus_seconds(5)).ok());
    const auto s = e.predict(a.at);
    if (!s.ok()) continue;
    ++predicted;
    worst_m = std::max(worst_m, error_n_m(d, *s)->norm());
    CHECK(s->status == SolutionStatus::dr);
  }
  MESSAGE(predicted << " predictions, worst " << worst_m << " m");
  CHECK(predicted > 6000);
  CHECK(worst_m < 0.2);
}
