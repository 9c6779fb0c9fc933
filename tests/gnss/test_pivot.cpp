// SPDX-License-Identifier: BSD-3-Clause
// Pivot choice: eligibility, arg-max, hysteresis, fallback, independence of order.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include <searvins/gnss/pivot.hpp>

#include "examples/support/angle_units.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

using searvins::examples::kRadPerDeg;
constexpr SatelliteId kNone{};

PivotCandidate candidate(int number, double elevation_deg, double cn0, bool usable = true, bool slipped = false) {
  return {{Constellation::gps, static_cast<std::uint8_t>(number)}, elevation_deg * kRadPerDeg, cn0, usable, slipped};
}
SatelliteId gps(int number) { return {Constellation::gps, static_cast<std::uint8_t>(number)}; }

int chosen(const std::vector<PivotCandidate>& c, SatelliteId previous = kNone, const PivotOptions& o = {}) {
  const PivotChoice choice = choose_pivot(c, previous, o);
  return choice.index < 0 ? -1 : c[static_cast<std::size_t>(choice.index)].satellite.number;
}

}  // namespace

TEST_CASE("the strongest above 45 degrees, at equal strength the highest") {
  CHECK(chosen({candidate(1, 80, 42), candidate(2, 50, 47), candidate(3, 30, 55)}) == 2);
  CHECK(chosen({candidate(1, 80, 47), candidate(2, 50, 47)}) == 1);
  CHECK(chosen({candidate(1, 44.9, 50), candidate(2, 45.1, 31)}) == 2);
  CHECK(chosen({candidate(1, 50, 29.9), candidate(2, 45.1, 30.1)}) == 2);
  CHECK(chosen({}) == -1);
}

TEST_CASE("none eligible: the highest serves and is flagged, or nobody does") {
  const std::vector<PivotCandidate> low{candidate(1, 20, 40), candidate(2, 40, 35)};
  CHECK(choose_pivot(low, kNone).fallback);
  CHECK(chosen(low) == 2);
  PivotOptions strict;
  strict.allow_fallback = false;
  CHECK(chosen(low, kNone, strict) == -1);
  CHECK(!choose_pivot(std::vector<PivotCandidate>{candidate(1, 50, 40)}, kNone).fallback);
}

TEST_CASE("hysteresis: kept within 3 dB while eligible and sound; pure arg-max on request") {
  CHECK(chosen({candidate(1, 60, 45), candidate(2, 60, 47.9)}, gps(1)) == 1);
  CHECK(chosen({candidate(1, 60, 45), candidate(2, 60, 48.1)}, gps(1)) == 2);
  CHECK(chosen({candidate(1, 44, 45), candidate(2, 60, 46)}, gps(1)) == 2);
  CHECK(chosen({candidate(1, 60, 45, true, true), candidate(2, 60, 44)}, gps(1)) == 2);  // it slipped: a weaker sound one goes before it
  CHECK(chosen({candidate(1, 60, 45, false), candidate(2, 60, 44, true, true)}, gps(1)) == 2);
  PivotOptions pure;
  pure.hysteresis = false;
  CHECK(chosen({candidate(1, 60, 45), candidate(2, 60, 45.1)}, gps(1), pure) == 2);
}

TEST_CASE("without C/N0 the elevation decides, and an eligible pivot is kept") {
  const double none = std::nan("");
  CHECK(chosen({candidate(1, 60, none), candidate(2, 70, none), candidate(3, 50, 55)}) == 2);
  CHECK(chosen({candidate(1, 60, none), candidate(2, 70, none)}, gps(1)) == 1);
}

TEST_CASE("the choice does not depend on the order of the candidates, and it always satisfies its own conditions") {
  for_all_seeds(300, [](Rng& rng) {
    std::vector<PivotCandidate> c;
    for (int i = 1; i <= integer(rng, 1, 12); ++i)
      c.push_back(candidate(i, integer(rng, 15, 90), integer(rng, 25, 50), chance(rng, 0.9), chance(rng, 0.2)));
    const SatelliteId previous = gps(integer(rng, 0, 12));
    const PivotChoice first = choose_pivot(c, previous);
    REQUIRE(first.index >= 0);
    const PivotCandidate p = c[static_cast<std::size_t>(first.index)];
    bool any_eligible = false;
    for (const PivotCandidate& k : c) any_eligible = any_eligible || (k.elevation_rad >= 45 * kRadPerDeg && k.cn0_dbhz >= 30);
    CHECK(first.fallback == !any_eligible);
    if (any_eligible) CHECK((p.elevation_rad >= 45 * kRadPerDeg && p.cn0_dbhz >= 30));
    std::shuffle(c.begin(), c.end(), rng);
    CHECK(c[static_cast<std::size_t>(choose_pivot(c, previous).index)].satellite == p.satellite);
  });
}
