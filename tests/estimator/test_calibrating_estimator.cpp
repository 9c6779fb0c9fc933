// SPDX-License-Identifier: BSD-3-Clause
// A drive whose camera has a clock that is 5 ms off and is mounted 0.3 degrees from where the calibration has it: what that costs an estimator that
// believes the calibration, and that one that does not finds both and is as good as with the camera it was told of.
#include <cmath>
#include <cstdio>

#include "estimator/inertial_drive.hpp"
#include "estimator/stereo_under_test.hpp"
#include "examples/support/angle_units.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::RtkSolution;
using estimator::SolutionSource;

namespace {

constexpr double kFrom = 68, kTo = 98, kEnd = 100;  ///< without a rover
using searvins::examples::kDegPerRad;
constexpr double kOffsetS = 5e-3;

/// 0.3 degrees.
Eigen::Vector3d boresight_rad() { return Eigen::Vector3d{0.2, -0.2, 0.1} / kDegPerRad; }

InertialDrive drive_with(double offset_s, const Eigen::Vector3d& turn_rad) {
  return simulated_inertial_drive("light", kEnd, 21, {1, 100, imu::SampleKind::instantaneous, true, offset_s, turn_rad});
}
const InertialDrive& drive_as_told() {
  static const InertialDrive d = drive_with(0, Eigen::Vector3d::Zero());
  return d;
}
const InertialDrive& drive_off() {
  static const InertialDrive d = drive_with(kOffsetS, boresight_rad());
  return d;
}

StereoUnderTest::Options options_of(const InertialDrive& d) {
  StereoUnderTest::Options o;
  static_cast<estimator::InertialOptions&>(o.inertial) = options_for(d).inertial;
  o.inertial.stereo.camera = d.camera;
  o.inertial.stereo.admission.pnp.sigma_px = 0.7;
  o.inertial.stereo.admission.semantic.dynamic = {vision::SemanticClass{3}, vision::SemanticClass{4}};
  o.inertial.stereo.admission.semantic.unstable = vision::ClassSet{};
  return o;
}

/// Hands a drive with an outage to an estimator.
template <class EstimatorUnderTest>
Run run_of(EstimatorUnderTest& e, const InertialDrive& d) {
  for (const gnss::Ephemeris& record : d.ephemerides) REQUIRE(e.add_ephemeris(record).ok());
  if (d.ionosphere.present()) e.set_ionosphere(d.ionosphere);
  REQUIRE(e.set_base_position(d.base_e_m).ok());
  std::vector<Arrival> all = arrivals(d);
  cut(all, d, Stream::rover, kFrom, kTo);
  Run run;
  std::size_t next = 0;
  const auto take = [&] {
    for (auto s = e.next(); s.ok() || !estimator::is_nothing_due(s.status()); s = e.next())
      s.ok() ? run.solutions.push_back(*s) : static_cast<void>(++run.errors);
  };
  for (const Arrival& a : all) {
    for (; next < d.frames.size() && d.frames[next].time <= a.at; ++next) {
      run.refused += e.add_stereo(d.frames[next]).ok() ? 0 : 1;
      take();
    }
    const Status s = a.stream == Stream::imu ? e.add_imu(d.imu[a.index]) : a.stream == Stream::base ? e.add_base(d.base[a.index]) : e.add_rover(d.rover[a.index]);
    run.refused += s.ok() ? 0 : 1;
    take();
  }
  e.finish(), take();
  run.alignments = e.alignments();
  std::erase_if(run.solutions, [](const RtkSolution& s) { return s.source == SolutionSource::camera && std::abs(std::remainder(s.time.sow(), 1.0)) > 1e-6; });
  return run;
}

void print(const char* what, const InertialDrive& d, const Run& run) {
  const DriveScore fixed = score_of(d, run, 40, kFrom - 0.5), outage = score_of(d, run, kFrom, kTo);
  char line[240];
  std::snprintf(line, sizeof line, "%s: horizontal RMS with GNSS %.4f m (nees %.1f, 2 is right), without %.3f m, largest %.3f m (nees %.1f)", what, fixed.rms_m(),
                fixed.mean_nees(), outage.rms_m(), outage.max_m, outage.mean_nees());
  MESSAGE(line);
}

}  // namespace

TEST_CASE("a camera 5 ms and 0.3 degrees off: believed, it spoils the solution; calibrated, it is as good as the camera that was told of") {
  StereoUnderTest with_good{options_of(drive_as_told())}, with_bad{options_of(drive_off())};
  CalibratingUnderTest calibrating{options_of(drive_off())};
  const Run good = run_of(with_good, drive_as_told()), bad = run_of(with_bad, drive_off()), found = run_of(calibrating, drive_off());
  print("as told", drive_as_told(), good), print("off, believed", drive_off(), bad), print("off, calibrated", drive_off(), found);
  for (const Run* run : {&good, &bad, &found}) CHECK((run->errors == 0 && run->refused == 0 && run->alignments == 1));

  const vision::CameraCorrectionEstimate& c = calibrating.motion().camera().estimate();
  const Eigen::Vector4d sigma = c.covariance.diagonal().cwiseSqrt();
  const Eigen::Vector3d off_rad = so3::log(Eigen::Matrix3d{c.value.R_nc.transpose() * so3::exp(boresight_rad())});
  char line[240];
  std::snprintf(line, sizeof line, "time offset %.2f +- %.2f ms; boresight off by %.3f, %.3f, %.3f +- %.3f, %.3f, %.3f deg", 1e3 * c.value.time_offset_s, 1e3 * sigma[0],
                kDegPerRad * off_rad[0], kDegPerRad * off_rad[1], kDegPerRad * off_rad[2],
                kDegPerRad * sigma[1], kDegPerRad * sigma[2], kDegPerRad * sigma[3]);
  MESSAGE(line);
  CHECK(std::abs(c.value.time_offset_s - kOffsetS) < 1e-3);
  CHECK(off_rad.cwiseAbs().maxCoeff() < 0.05 / kDegPerRad);
  CHECK(std::abs(c.value.time_offset_s - kOffsetS) < 3 * sigma[0]);
  for (int i = 0; i < 3; ++i) CHECK(std::abs(off_rad[i]) < 3 * sigma[1 + i]);

  const auto before = [&](const InertialDrive& d, const Run& run) { return score_of(d, run, 40, kFrom - 0.5); };
  const auto outage = [&](const InertialDrive& d, const Run& run) { return score_of(d, run, kFrom, kTo); };
  const DriveScore good_before = before(drive_as_told(), good), bad_before = before(drive_off(), bad), found_before = before(drive_off(), found);
  CHECK(bad_before.mean_nees() > 3);
  CHECK(bad_before.mean_nees() > 4 * found_before.mean_nees());
  CHECK(bad_before.rms_m() > 2 * good_before.rms_m());
  CHECK(found_before.rms_m() < 1.2 * good_before.rms_m() + 1e-3);
  const DriveScore good_outage = outage(drive_as_told(), good), bad_outage = outage(drive_off(), bad), found_outage = outage(drive_off(), found);
  CHECK(found_outage.max_m < bad_outage.max_m);
  CHECK(found_outage.max_m < good_outage.max_m + 0.1);
  CHECK(found_outage.mean_nees() < 4);
}
