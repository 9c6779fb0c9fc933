// SPDX-License-Identifier: BSD-3-Clause
// The inertial unit beside two recordings: tightly coupled to a signal simulator's figure with exact readings made from its truth, and loosely coupled
// to the positions of a car's own receiver, with its own readings, through ten gaps.
#include <cstdio>
#include <fstream>
#include <sstream>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/imu/attitude_angles.hpp>
#include <searvins/math/so3.hpp>

#include "estimator/inertial_drive.hpp"
#include "examples/support/angle_units.hpp"
#include "gnss/recordings.hpp"
#include "stationary/imu_recording.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::EstimatorOptions;
using estimator::RtkSolution;
using estimator::SolutionStatus;

namespace {

/// A row of truth_pva_10hz.csv.
struct MotionKnot {
  GpsTime time{};
  Eigen::Vector3d p_e_m{Eigen::Vector3d::Zero()}, v_e_mps{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_eb{Eigen::Matrix3d::Identity()};
};

/// Columns: time, cycle, week, sow, ECEF position, ECEF velocity, roll, pitch, yaw in degrees (north-east-down). Body axes come out right, forward, up.
std::vector<MotionKnot> read_motion(const std::filesystem::path& path) {
  using searvins::examples::kRadPerDeg;
  std::vector<MotionKnot> knots;
  std::ifstream file{path};
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::array<double, 13> v{};
    std::stringstream cells{line};
    std::string cell;
    for (double& x : v) {
      REQUIRE(std::getline(cells, cell, ','));
      x = std::atof(cell.c_str());
    }
    MotionKnot& k = knots.emplace_back();
    k.time = GpsTime::from_week_sow(static_cast<std::int64_t>(v[1]) * 1024 + static_cast<std::int64_t>(v[2]), v[3]);
    k.p_e_m = {v[4], v[5], v[6]}, k.v_e_mps = {v[7], v[8], v[9]};
    k.R_eb = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(k.p_e_m)) *
             imu::R_wb_from({v[10] * kRadPerDeg, v[11] * kRadPerDeg, v[12] * kRadPerDeg});
  }
  return knots;
}

/// Readings of a perfect unit of 100 Hz that moves with constant acceleration and angular rate between the knots, with the noise and biases of a MEMS
/// unit. Each is the mean since the one before:
///     gyro = Log(R_eb' R_eb+) / dt + R_be w_ie        accel = R_be (dv/dt + 2 w_ie x v - g(p))
std::vector<imu::ImuSample> readings_of(const std::vector<MotionKnot>& knots, const imu::ImuNoise& noise, Rng& rng) {
  constexpr int kPerKnot = 10;
  const Eigen::Vector3d rate_e_radps{0, 0, geodesy::kEarthRateRadps};
  const Eigen::Vector3d gyro_bias{0.4 * noise.gyro_bias_sigma_radps, -0.7 * noise.gyro_bias_sigma_radps, 0.5 * noise.gyro_bias_sigma_radps};
  const Eigen::Vector3d accel_bias{0.5 * noise.accel_bias_sigma_mps2, 0.3 * noise.accel_bias_sigma_mps2, -0.6 * noise.accel_bias_sigma_mps2};
  std::vector<imu::ImuSample> samples;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const MotionKnot &a = knots[k], &b = knots[k + 1];
    const double h_s = seconds_between(a.time, b.time), dt_s = h_s / kPerKnot;
    const Eigen::Vector3d turn = so3::log(Eigen::Matrix3d{a.R_eb.transpose() * b.R_eb}), acceleration = (b.v_e_mps - a.v_e_mps) / h_s;
    for (int i = 1; i <= kPerKnot; ++i) {
      const double middle = (i - 0.5) / kPerKnot;
      const Eigen::Matrix3d R_be = (a.R_eb * so3::exp(Eigen::Vector3d{middle * turn})).transpose();
      const Eigen::Vector3d v = a.v_e_mps + middle * h_s * acceleration, p = a.p_e_m + middle * (b.p_e_m - a.p_e_m);
      imu::ImuSample s;
      s.time = a.time.plus_seconds(h_s * i / kPerKnot);
      s.gyro_b_radps = turn / h_s + R_be * rate_e_radps + gyro_bias;
      s.accel_b_mps2 = R_be * (acceleration + 2 * rate_e_radps.cross(v) - geodesy::gravity_e_mps2(p)) + accel_bias;
      for (int axis = 0; axis < 3; ++axis) {
        s.gyro_b_radps[axis] += normal(rng, noise.gyro_noise_radps_sqrt_hz / std::sqrt(dt_s));
        s.accel_b_mps2[axis] += normal(rng, noise.accel_noise_mps2_sqrt_hz / std::sqrt(dt_s));
      }
      samples.push_back(s);
    }
  }
  return samples;
}

InertialDrive spirent_drive(const std::filesystem::path& shared, std::uint64_t seed) {
  Recording r = spirent_rose(shared);
  InertialDrive d;
  d.rover = std::move(r.rover), d.base = std::move(r.base), d.base_e_m = r.base_e_m, d.ionosphere = r.store->ionosphere;
  for (const gnss::Ephemeris& e : r.store->records()) d.ephemerides.push_back(e);
  const auto knots = std::make_shared<std::vector<MotionKnot>>(read_motion(shared / "data/real/spirent_rose_iono-Klob/truth_pva_10hz.csv"));
  REQUIRE(knots->size() > 6000);
  Rng rng{seed};
  d.kind = imu::SampleKind::mean_to_stamp;
  d.imu = readings_of(*knots, d.noise, rng);
  d.start = d.rover.front().tag;
  d.truth = [knots](GpsTime t) -> std::optional<DriveTruth> {
    const auto at = std::lower_bound(knots->begin(), knots->end(), t.plus_seconds(-1e-3), [](const MotionKnot& k, GpsTime x) { return k.time < x; });
    if (at == knots->end() || std::abs(seconds_between(at->time, t)) > 1e-3) return std::nullopt;
    const Eigen::Matrix3d R_ne = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(at->p_e_m)).transpose();
    return DriveTruth{at->p_e_m + seconds_between(at->time, t) * at->v_e_mps, R_ne * at->R_eb};
  };
  return d;
}

}  // namespace

TEST_CASE("spirent_rose with readings made from its truth: aligned while moving, fixed, millimetres, and through 15 s without GNSS") {
  const auto shared = shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data (set SEARVINS_SHARED_DIR)");
    return;
  }
  const InertialDrive d = spirent_drive(*shared, 3);
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::rover, 300, 315);
  const Run run = run_all(d, all, options_for(d));
  CHECK(run.errors == 0);
  CHECK(run.alignments == 1);
  const DriveScore before = score_of(d, run, 100, 299), gap = score_of(d, run, 300, 314.5), after = score_of(d, run, 318, 600);
  char line[300];
  std::snprintf(line, sizeof line, "spirent_rose, tightly coupled: before the gap %.1f %% fixed, rms %.4f m, attitude within %.2f deg; in the gap max %.3f m "
                                   "(nees %.1f); after it %.1f %% fixed, rms %.4f m, attitude within %.2f deg",
                before.fixed_percent(), before.rms_m(), before.attitude_max_rad * 57.3, gap.max_m, gap.mean_nees(), after.fixed_percent(), after.rms_m(),
                after.attitude_max_rad * 57.3);
  MESSAGE(line);
  for (const DriveScore* s : {&before, &after}) {
    CHECK(s->aligned == s->solutions);
    CHECK(s->fixed_percent() > 98);
    CHECK(s->wrong == 0);
    CHECK(s->rms_m() < 0.005);
  }
  CHECK(after.attitude_max_rad * 57.3 < 3);  // a figure of 0.3 m/s^2 shows little of the heading
  CHECK(gap.of(SolutionStatus::dr) == gap.solutions);
  CHECK(gap.solutions >= 14);
  CHECK(gap.max_m < 2);
  CHECK(gap.mean_nees() < 8);
}

TEST_CASE("boulder_drive, loosely coupled to its receiver's positions: ten gaps of 15 s, and what the non-holonomic constraint is worth") {
  const auto shared = shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: no shared data (set SEARVINS_SHARED_DIR)");
    return;
  }
  constexpr double kFirstGapS = 90, kEveryS = 45, kGapS = 15;
  const ImuRecording car = read_imu_recording(*shared / "data/real/boulder_drive_2025", car_axes());
  const GpsTime start = car.samples.front().time;
  const auto gap_at = [&](GpsTime t) {  // -1: none
    const double s = seconds_between(start, t) - kFirstGapS;
    const int gap = static_cast<int>(std::floor(s / kEveryS));
    return s >= 0 && gap < 10 && s - gap * kEveryS < kGapS ? gap : -1;
  };
  for (const bool on_wheels : {false, true}) {
    EstimatorOptions options;
    imu::ImuNoise& n = options.inertial.preintegration.noise;  // a phone's unit in a car that shakes
    n.accel_noise_mps2_sqrt_hz = 5e-3, n.gyro_noise_radps_sqrt_hz = 5e-4, n.accel_bias_walk_mps3_sqrt_hz = 2e-4, n.gyro_bias_walk_radps2_sqrt_hz = 1e-5;
    n.accel_bias_sigma_mps2 = 0.2, n.gyro_bias_sigma_radps = 5e-3;
    options.inertial.lever_arm_b_m = {-0.05, 0, 0};
    options.inertial.non_holonomic = on_wheels;
    InertialUnderTest e{options};
    std::array<std::pair<double, double>, 10> at_end{};  // error and sigma of the last solution in each gap
    std::size_t fix = 0;
    Run run;
    for (const imu::ImuSample& s : car.samples) {
      for (; fix < car.fixes.size() && car.fixes[fix].time <= s.time; ++fix)
        if (gap_at(car.fixes[fix].time) < 0) CHECK(e.add_position(car.fixes[fix]).ok());
      CHECK(e.add_imu(s).ok());
      drain(e, run);
    }
    e.finish(), drain(e, run);
    CHECK(run.errors == 0);
    CHECK(e.alignments() == 1);
    std::size_t next = 0;
    for (const RtkSolution& s : run.solutions) {
      while (next < car.fixes.size() && car.fixes[next].time < s.time) ++next;
      if (next == 0 || next == car.fixes.size() || gap_at(s.time) < 0) continue;
      const imu::PositionFix &a = car.fixes[next - 1], &b = car.fixes[next];
      const double part = seconds_between(a.time, s.time) / seconds_between(a.time, b.time);
      const Eigen::Vector3d truth_e_m = a.position_e_m + part * (b.position_e_m - a.position_e_m);
      const Eigen::Vector3d error = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(truth_e_m)).transpose() * (s.position_e_m - truth_e_m);
      CHECK(s.status == SolutionStatus::dr);
      at_end[static_cast<std::size_t>(gap_at(s.time))] = {error.head<2>().norm(), horizontal_sigma_m(s)};
    }
    std::vector<double> errors, sigmas;
    std::string line = on_wheels ? "boulder_drive with the non-holonomic constraint, at the end of each gap:" : "boulder_drive, at the end of each gap:";
    for (const auto& [error, sigma] : at_end) {
      char text[40];
      std::snprintf(text, sizeof text, " %.1f", error);
      line += text, errors.push_back(error), sigmas.push_back(sigma);
    }
    MESSAGE(line << " m; median " << median(errors) << " m, sigma " << median(sigmas) << " m");
    CHECK(median(errors) < (on_wheels ? 8.0 : 20.0));
    CHECK(*std::max_element(errors.begin(), errors.end()) < (on_wheels ? 40.0 : 100.0));
    double apart_m = 0;  // between the gaps the solution is the receiver's
    int compared = 0;
    for (const RtkSolution& s : run.solutions)
      for (const imu::PositionFix& f : car.fixes)
        if (f.time == s.time && s.has_attitude && gap_at(s.time) < 0) apart_m += (f.position_e_m - s.position_e_m).norm(), ++compared;
    REQUIRE(compared > 500);
    MESSAGE("mean distance from the receiver's positions " << apart_m / compared << " m over " << compared);
    CHECK(apart_m / compared < 0.5);
  }
}
