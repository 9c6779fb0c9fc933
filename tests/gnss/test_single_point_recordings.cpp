// SPDX-License-Identifier: BSD-3-Clause
// Single-point positions, Doppler velocities and the tracker on every recording, against its reference.
#include <doctest/doctest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <searvins/gnss/doppler_velocity.hpp>
#include <searvins/gnss/single_point.hpp>
#include <searvins/gnss/single_point_tracker.hpp>

#include "rover_recordings.hpp"

using namespace searvins;
using namespace searvins::gnss;
using Eigen::Vector3d;

namespace {

struct Figures {
  test::Errors errors;
  int epochs{0}, failed{0};
};

Figures run(const test::RoverRecording& r, std::size_t every, const SinglePointOptions& options = {}) {
  Figures f;
  for (std::size_t k = 0; k < r.epochs.size(); k += every) {
    const auto solution = solve_single_point(r.epochs[k], *r.store, options);
    ++f.epochs;
    if (!solution) {
      ++f.failed;
      continue;
    }
    if (const auto truth = r.truth(solution->time)) f.errors.add(solution->position_e_m, *truth);
  }
  return f;
}

std::string text(const char* name, const Figures& f) {
  const Vector3d m = f.errors.mean_m();
  char line[240];
  std::snprintf(line, sizeof line, "%s: %d epochs, %d failed, %zu scored, H rms %.3f m, p95 %.3f m, V rms %.3f m, mean ENU %.2f %.2f %.2f",
                name, f.epochs, f.failed, f.errors.enu_m.size(), f.errors.horizontal_rms_m(), f.errors.horizontal_quantile_m(0.95),
                f.errors.vertical_rms_m(), m.x(), m.y(), m.z());
  return line;
}

}  // namespace

TEST_CASE("recordings: every epoch has a position; open sky within metres, a noise-free simulator within centimetres") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  struct Expectation {
    const char* name;
    test::RoverRecording recording;
    std::size_t every;
    double horizontal_m, vertical_m;
  };
  const Expectation list[] = {{"kamakura", test::kamakura_rover(*shared), 1, 2.0, 1.0},
                              {"nagoya", test::nagoya_rover(*shared), 3, 3.0, 1.5},
                              {"geonet", test::geonet_rover(*shared), 1, 2.5, 4.0},
                              {"sf", test::sf_rover(*shared), 2, 1.1, 3.2},
                              {"spirent", test::spirent_rover(*shared), 5, 0.03, 0.2}};
  for (const Expectation& e : list) {
    const Figures f = run(e.recording, e.every);
    MESSAGE(text(e.name, f));
    CHECK(f.failed == 0);
    CHECK(f.errors.enu_m.size() > 0.9 * f.epochs);
    CHECK(f.errors.horizontal_rms_m() < e.horizontal_m);
    CHECK(f.errors.vertical_rms_m() < e.vertical_m);
  }
  const Figures walk = run(test::boulder_rover(*shared), 4);
  Figures scatter = walk;
  scatter.errors = walk.errors.centred();
  MESSAGE(text("boulder walk", walk) << "; about its mean " << text("", scatter));
  CHECK(walk.failed == 0);
  CHECK(scatter.errors.horizontal_rms_m() < 0.9);  // the reference frame is off by a constant
  CHECK(scatter.errors.vertical_rms_m() < 2.0);
}

TEST_CASE("recordings: in the streets of Tokyo, epoch by epoch, against 38.4 m rms and 81 m P95 of a least-squares solution") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const Figures f = run(test::tokyo_rover(*shared), 1);
  MESSAGE(text("tokyo", f));
  CHECK(f.failed == 0);
  CHECK(f.errors.horizontal_rms_m() < 13);
  CHECK(f.errors.horizontal_quantile_m(0.5) < 4.5);
  CHECK(f.errors.horizontal_quantile_m(0.95) < 32);
  const Figures twin = run(test::twin_rover(*shared, "a-urban"), 4);
  MESSAGE(text("twin urban", twin));
  CHECK(twin.failed == 0);
  CHECK(twin.errors.horizontal_rms_m() < 4.5);
  CHECK(twin.errors.horizontal_quantile_m(0.5) < 0.8);
}

namespace {

struct Tracking {
  Figures figures;
  int statuses[5]{};
  double nees{0};  ///< horizontal, per epoch: 2 when the covariance is right
};

Tracking track(const test::RoverRecording& r, const TrackerOptions& options = {}) {
  Tracking t;
  SinglePointTracker tracker{options};
  for (const ObservationEpoch& epoch : r.epochs) {
    const auto now = tracker.update(epoch, *r.store);
    ++t.figures.epochs;
    if (!now) {
      ++t.figures.failed;
      continue;
    }
    ++t.statuses[static_cast<int>(now->status)];
    const auto truth = r.truth(now->time);
    if (!truth) continue;
    t.figures.errors.add(now->position_e_m, *truth);
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(*truth));
    const Eigen::Matrix2d P = (R_ew.transpose() * now->position_covariance_m2 * R_ew).topLeftCorner<2, 2>();
    const Eigen::Vector2d d = t.figures.errors.enu_m.back().head<2>();
    t.nees += d.dot(math::SmallCholesky<2>(P).solve(d));
  }
  t.nees /= static_cast<double>(t.figures.errors.enu_m.size());
  return t;
}

std::string text(const char* name, const Tracking& t) {
  char line[120];
  std::snprintf(line, sizeof line, "; started %d, tracked %d, coasted %d, doubtful %d, restarted %d; horizontal NEES %.2f", t.statuses[0],
                t.statuses[1], t.statuses[2], t.statuses[3], t.statuses[4], t.nees);
  return text(name, t.figures) + line;
}

}  // namespace

TEST_CASE("tracker: causal, the streets of Tokyo to metres (least squares: 38.4 m rms, 81 m P95)") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const Tracking tokyo = track(test::tokyo_rover(*shared));
  MESSAGE(text("tokyo", tokyo));
  CHECK(tokyo.figures.failed == 0);
  CHECK(tokyo.figures.errors.horizontal_rms_m() < 5);
  CHECK(tokyo.figures.errors.horizontal_quantile_m(0.95) < 9);
  CHECK(tokyo.nees < 10);
  const Tracking twin = track(test::twin_rover(*shared, "a-urban"));
  MESSAGE(text("twin urban", twin));
  CHECK(twin.figures.failed == 0);
  CHECK(twin.figures.errors.horizontal_rms_m() < 1.3);
  CHECK(twin.figures.errors.horizontal_quantile_m(0.95) < 3);
  CHECK(twin.nees < 4);
}

TEST_CASE("tracker: does no harm under open sky, with or without Doppler") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  struct Expectation {
    const char* name;
    test::RoverRecording recording;
    double horizontal_m, vertical_m;
  };
  const Expectation list[] = {{"kamakura (no Doppler)", test::kamakura_rover(*shared), 2.2, 1.0},
                              {"nagoya", test::nagoya_rover(*shared), 3.2, 1.6},
                              {"geonet", test::geonet_rover(*shared), 2.0, 3.0},
                              {"sf", test::sf_rover(*shared), 1.1, 3.3},
                              {"spirent", test::spirent_rover(*shared), 0.05, 0.2}};
  for (const Expectation& e : list) {
    const Tracking t = track(e.recording);
    MESSAGE(text(e.name, t));
    CHECK(t.figures.failed == 0);
    CHECK(t.statuses[static_cast<int>(TrackStatus::restarted)] == 0);
    CHECK(t.figures.errors.horizontal_rms_m() < e.horizontal_m);
    CHECK(t.figures.errors.vertical_rms_m() < e.vertical_m);
  }
}

TEST_CASE("Doppler velocity: millimetres per second from a simulator, centimetres per second at rest") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const test::RoverRecording spirent = test::spirent_rover(*shared);
  double worst_mps = 0;
  int count = 0;
  for (const ObservationEpoch& epoch : spirent.epochs) {
    const auto before = spirent.truth(epoch.tag.plus_seconds(-0.1)), now = spirent.truth(epoch.tag),
               after = spirent.truth(epoch.tag.plus_seconds(0.1));
    if (!before || !now || !after) continue;
    const auto d = solve_doppler_velocity(epoch, *spirent.store, *now);
    REQUIRE(d);
    worst_mps = std::max(worst_mps, (d->velocity_e_mps - (*after - *before) / 0.2).norm());
    ++count;
  }
  MESSAGE("spirent: " << count << " epochs, largest velocity error " << worst_mps << " m/s");
  CHECK(count > 590);
  CHECK(worst_mps < 0.006);

  const test::RoverRecording nagoya = test::nagoya_rover(*shared);
  double sum = 0;
  for (const ObservationEpoch& epoch : nagoya.epochs) {
    const auto d = solve_doppler_velocity(epoch, *nagoya.store, *nagoya.fixed_e_m + Vector3d{5, -3, 4});
    REQUIRE(d);
    sum += d->velocity_e_mps.squaredNorm();
  }
  const double rms_mps = std::sqrt(sum / static_cast<double>(nagoya.epochs.size()));
  MESSAGE("nagoya: velocity of an antenna at rest " << rms_mps << " m/s rms");
  CHECK(rms_mps < 0.04);
  CHECK(solve_doppler_velocity(test::kamakura_rover(*shared).epochs[0], *nagoya.store, *nagoya.fixed_e_m).status().code ==
        StatusCode::too_few);
}
