// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/spread.hpp>

#include <algorithm>
#include <array>

#include "support/property.hpp"

using namespace searvins::test;
using namespace searvins::vision;

namespace {

constexpr int kWidth = 800, kHeight = 400;  // cells of 100 x 100
using Candidates = searvins::StaticVector<SpreadCandidate, 300>;

std::size_t chosen(const Candidates& candidates) {
  return static_cast<std::size_t>(std::count_if(candidates.begin(), candidates.end(), [](const SpreadCandidate& c) { return c.chosen; }));
}

}  // namespace

TEST_CASE("spread: as many as asked for, all when there are no more; what is preferred comes first") {
  for_all_seeds(50, [](Rng& rng) {
    Candidates candidates;
    const int n = integer(rng, 0, 300);
    std::size_t preferred = 0;
    for (int i = 0; i < n; ++i) {
      (void)candidates.push_back(
          {uniform(rng, -10, kWidth + 10), uniform(rng, -10, kHeight + 10), uniform(rng, 0, 1), chance(rng, 0.3), false});
      preferred += candidates.back().preferred;
    }
    const auto most = static_cast<std::size_t>(integer(rng, 0, 200));
    choose_spread(candidates, most, kWidth, kHeight);
    CHECK(chosen(candidates) == std::min(most, candidates.size()));
    const auto both = static_cast<std::size_t>(
        std::count_if(candidates.begin(), candidates.end(), [](const SpreadCandidate& c) { return c.chosen && c.preferred; }));
    CHECK(both == std::min(most, preferred));
  });
}

TEST_CASE("spread: a crowd in one cell leaves room for the others, and sends its best scores") {
  for_all_seeds(20, [](Rng& rng) {
    Candidates candidates;
    for (int i = 0; i < 200; ++i)
      (void)candidates.push_back({uniform(rng, 0, 99), uniform(rng, 0, 99), uniform(rng, 0.5, 1), false, false});
    for (int cell = 1; cell < 32; ++cell)
      for (int i = 0; i < 2; ++i)
        (void)candidates.push_back({100.0 * (cell % 8) + uniform(rng, 0, 99), 100.0 * (cell / 8) + uniform(rng, 0, 99), 0.1, false, false});
    choose_spread(candidates, 72, kWidth, kHeight);
    double worst_in = 1, best_out = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (i >= 200) CHECK(candidates[i].chosen);
      if (i < 200 && candidates[i].chosen) worst_in = std::min(worst_in, candidates[i].score);
      if (i < 200 && !candidates[i].chosen) best_out = std::max(best_out, candidates[i].score);
    }
    CHECK(worst_in >= best_out);
    CHECK(chosen(candidates) == 72);
  });
}
