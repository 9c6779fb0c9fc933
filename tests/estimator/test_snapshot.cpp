// SPDX-License-Identifier: BSD-3-Clause
// The robust start of an epoch: exact on clean rows, unmoved by gross outliers, no satellite special, prior respected, nothing to say without rows.
#include <searvins/estimator/snapshot.hpp>

#include <algorithm>

#include <searvins/geodesy/local_frame.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::SnapshotRow;
using Snapshot = estimator::Snapshot<200>;

namespace {

struct Epoch {
  Snapshot snapshot{};
  Eigen::Vector3d truth_e_m{Eigen::Vector3d::Zero()};
};

/// `groups` groups of codes and as many of phases with known ambiguities over one sky of n satellites; the prediction is off by up to `off_m` per axis.
Epoch random_epoch(Rng& rng, int n, int groups, double off_m, double noise = 1) {
  Epoch epoch;
  const auto frame = geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({uniform(rng, -1.1, 1.1), uniform(rng, -3.1, 3.1), 100}));
  epoch.truth_e_m = frame.to_ecef(random_vector<3>(rng, 100));
  epoch.snapshot.predicted_e_m = epoch.truth_e_m + random_vector<3>(rng, off_m);
  epoch.snapshot.predicted_sigma_m = std::max(1.0, 2 * off_m);
  std::vector<Eigen::Vector3d> sky;
  for (int i = 0; i < n; ++i) {
    const double azimuth = 6.28 * i / n + uniform(rng, -0.3, 0.3), elevation = uniform(rng, 0.3, 1.5);
    sky.push_back(frame.to_ecef(2.2e7 * Eigen::Vector3d{std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth), std::sin(elevation)}));
  }
  for (int g = 0; g < 2 * groups; ++g) {
    const double common_m = uniform(rng, -3e5, 3e5), sigma_m = g % 2 == 0 ? 0.5 : 0.01;
    for (const Eigen::Vector3d& s : sky)
      REQUIRE(epoch.snapshot.rows.push_back(
          {s, gnss::range_m(epoch.truth_e_m, s) + common_m + noise * normal(rng, sigma_m), sigma_m * sigma_m, static_cast<std::uint16_t>(g)}));
  }
  return epoch;
}

}  // namespace

TEST_CASE("clean rows: the position to the noise of the phases, from a prediction tens of metres off") {
  int runs = 0, near = 0;
  for_all_seeds(200, [&](Rng& rng) {
    const Epoch exact = random_epoch(rng, integer(rng, 6, 14), 2, 60, 0);
    CHECK((exact.snapshot.solve() - exact.truth_e_m).norm() < 1e-3);
    const Epoch noisy = random_epoch(rng, integer(rng, 8, 14), 2, 60);
    ++runs, near += (noisy.snapshot.solve() - noisy.truth_e_m).norm() < 0.15 ? 1 : 0;
  });
  CHECK(near >= runs * 99 / 100);  // the rest: satellites that leave a direction to the codes
}

TEST_CASE("30 % gross outliers among codes and phases do not move it") {
  int runs = 0, survived = 0;
  for_all_seeds(300, [&](Rng& rng) {
    Epoch e = random_epoch(rng, integer(rng, 12, 16), 2, 30);
    for (SnapshotRow& row : e.snapshot.rows)
      if (chance(rng, 0.3)) row.z_m += (chance(rng, 0.5) ? 1 : -1) * (row.variance_m2 > 0.01 ? uniform(rng, 10, 200) : uniform(rng, 0.2, 5));
    ++runs;
    survived += (e.snapshot.solve() - e.truth_e_m).norm() < 0.5 ? 1 : 0;
  });
  MESSAGE(survived << " of " << runs << " within half a metre");
  CHECK(survived >= runs * 97 / 100);
}

TEST_CASE("graduated: a start that plain reweighting at the final scale would keep is left behind") {
  // All phases agree on a position 5 m from the prediction: at the final scale (2 sigma) every weight there is next to zero.
  for_all_seeds(100, [](Rng& rng) {
    Epoch e = random_epoch(rng, 10, 1, 0);
    e.snapshot.predicted_e_m = e.truth_e_m + 5 * random_vector<3>(rng).normalized();
    e.snapshot.predicted_sigma_m = 5;
    CHECK((e.snapshot.solve() - e.truth_e_m).norm() < 0.1);
  });
}

TEST_CASE("no row is special: order within groups does not matter, nor does a constant added to a group") {
  for_all_seeds(100, [](Rng& rng) {
    const Epoch e = random_epoch(rng, 10, 2, 10);
    Snapshot shuffled = e.snapshot;
    for (std::size_t g = 0; g < 4; ++g) {
      const auto first = shuffled.rows.begin() + static_cast<std::ptrdiff_t>(10 * g);
      std::shuffle(first, first + 10, rng);
      const double common_m = uniform(rng, -1000, 1000);
      std::for_each(first, first + 10, [&](SnapshotRow& row) { row.z_m += common_m; });
    }
    CHECK((shuffled.solve() - e.snapshot.solve()).norm() < 1e-4);
  });
}

TEST_CASE("too little to say: the prediction, or what prior and rows together determine") {
  Rng rng{3};
  Epoch e = random_epoch(rng, 10, 1, 10);
  Snapshot empty = e.snapshot;
  empty.rows.clear();
  CHECK(empty.solve() == empty.predicted_e_m);
  Snapshot single = e.snapshot;
  while (single.rows.size() > 1) single.rows.erase(single.rows.size() - 1);
  CHECK((single.solve() - single.predicted_e_m).norm() < 1e-6);  // one row is its own common part
  Snapshot certain = e.snapshot;
  certain.predicted_sigma_m = 1e-5;
  CHECK((certain.solve() - certain.predicted_e_m).norm() < 0.1);
  Snapshot broken = e.snapshot;
  broken.rows[0].z_m = std::numeric_limits<double>::quiet_NaN();
  CHECK(broken.solve().allFinite());
}
