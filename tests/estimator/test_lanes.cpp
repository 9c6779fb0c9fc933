// SPDX-License-Identifier: BSD-3-Clause
// A map of lanes in the estimator: what it bounds while the rover is silent, and that it says nothing rather than something wrong.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "estimator/inertial_drive.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

constexpr double kSilentFromS = 60, kSilentToS = 120;

/// A drive in streets whose rover is silent for a minute.
struct Silent {
  InertialDrive drive;
  std::vector<Arrival> all{};

  explicit Silent(std::uint64_t seed) : drive(simulated_inertial_drive("light", 130, seed)), all(arrivals(drive)) {
    cut(all, drive, Stream::rover, kSilentFromS, kSilentToS);
  }
  [[nodiscard]] Run run() const { return run_all(drive, all, options_for(drive)); }
};

int in_lane(const Run& run) {
  return static_cast<int>(
      std::count_if(run.solutions.begin(), run.solutions.end(), [](const estimator::RtkSolution& s) { return s.in_lane; }));
}

}  // namespace

TEST_CASE("lanes hold a drive without a rover, and only there: less horizontal error over six drives, covariances that keep up") {
  double squares_with_m2 = 0, squares_without_m2 = 0, nees = 0;
  int n = 0, held = 0;
  for (std::uint64_t seed = 31; seed < 37; ++seed) {
    Silent s(seed);
    const Run without = s.run();
    s.drive.lanes = lane_of(s.drive, 0.2);
    const Run with = s.run();
    CHECK(in_lane(without) == 0);
    for (const estimator::RtkSolution& x : with.solutions)
      if (x.in_lane) CHECK(x.held_integers == 0);
    const DriveScore a = score_of(s.drive, without, kSilentFromS + 1, kSilentToS - 1),
                     b = score_of(s.drive, with, kSilentFromS + 1, kSilentToS - 1);
    MESSAGE("seed " << seed << ": RMS " << a.rms_m() << " -> " << b.rms_m() << " m, max " << a.max_m << " -> " << b.max_m << ", NEES "
                    << a.mean_nees() << " -> " << b.mean_nees() << ", held " << in_lane(with));
    squares_without_m2 += a.squares_m2, squares_with_m2 += b.squares_m2, nees += b.nees, n += b.solutions, held += in_lane(with);
  }
  CHECK(held > 20);
  CHECK(squares_with_m2 < 0.5 * squares_without_m2);  // 0.24
  CHECK(nees / n < 4);
  CHECK(nees / n > 0.2);
}

TEST_CASE("a map of elsewhere, and one that cannot tell two lanes apart, say nothing: the bits of a drive without a map") {
  Silent s(31);
  const auto reference = numbers_of(s.run());
  s.drive.lanes = lane_of(s.drive, 300);
  CHECK((numbers_of(s.run()) == reference));
  s.drive.lanes = lane_of(s.drive);
  const auto again = lane_of(s.drive, 0, 1000);
  s.drive.lanes.insert(s.drive.lanes.end(), again.begin(), again.end());
  CHECK((numbers_of(s.run()) == reference));
}
