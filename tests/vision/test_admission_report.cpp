// SPDX-License-Identifier: BSD-3-Clause
// Fates and their counts: every fate has a name of its own, and what was counted can be found again and adds up.
#include <searvins/vision/admission_report.hpp>

#include <array>
#include <set>
#include <string>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::AdmissionCounts;
using vision::FrameFate;
using vision::kFrameFates;
using vision::kObservationFates;
using vision::ObservationFate;

namespace {

/// The names of the first `count` fates; one that is missing or twice there makes fewer.
template <class Fate>
std::set<std::string> names(std::size_t count) {
  std::set<std::string> all;
  for (std::size_t i = 0; i < count; ++i) {
    const char* name = vision::name_of(static_cast<Fate>(i));
    REQUIRE(name != nullptr);
    if (*name != '\0') all.insert(name);
  }
  return all;
}

}  // namespace

TEST_CASE("every fate of observations and frames has a name of its own, up to the last of the list") {
  CHECK(static_cast<std::size_t>(ObservationFate::capacity) + 1 == kObservationFates);
  CHECK(static_cast<std::size_t>(FrameFate::out_of_order) + 1 == kFrameFates);
  CHECK(names<ObservationFate>(kObservationFates).size() == kObservationFates);
  CHECK(names<FrameFate>(kFrameFates).size() == kFrameFates);
  CHECK(std::string{vision::name_of(ObservationFate::admitted)} == "admitted");
  CHECK(std::string{vision::name_of(ObservationFate::capacity)} == "over capacity");
  CHECK(std::string{vision::name_of(FrameFate::full)} == "full");
  CHECK(std::string{vision::name_of(FrameFate::out_of_order)} == "out of order");
}

TEST_CASE("counts are those of the fate they were counted under, and add up to what was offered") {
  for_all_seeds(50, [](Rng& rng) {
    AdmissionCounts counts;
    CHECK(counts.offered() == 0);
    std::array<std::size_t, kObservationFates> observations{};
    std::array<std::size_t, kFrameFates> frames{};
    std::size_t offered = 0;
    for (int k = 0; k < 200; ++k) {
      const auto o = static_cast<std::size_t>(integer(rng, 0, static_cast<int>(kObservationFates) - 1));
      const auto f = static_cast<std::size_t>(integer(rng, 0, static_cast<int>(kFrameFates) - 1));
      const auto n = static_cast<std::size_t>(integer(rng, 0, 9));
      counts.count(static_cast<ObservationFate>(o), n), counts.count(static_cast<ObservationFate>(o));
      counts.count(static_cast<FrameFate>(f));
      observations[o] += n + 1, ++frames[f], offered += n + 1;
    }
    for (std::size_t i = 0; i < kObservationFates; ++i) CHECK(counts.of(static_cast<ObservationFate>(i)) == observations[i]);
    for (std::size_t i = 0; i < kFrameFates; ++i) CHECK(counts.of(static_cast<FrameFate>(i)) == frames[i]);
    CHECK(counts.offered() == offered);
  });
}
