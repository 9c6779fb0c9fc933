// SPDX-License-Identifier: BSD-3-Clause
// P25: an estimator is its sizeof. It allocates nothing from its construction on, touches nothing outside itself, and its size is a number
// that the compiler
// knows. P21: nothing that a program holds needs more alignment than the language promises, and the target brings no flags along.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <string>

#include "embedded/public_types.hpp"
#include "examples/cortex_m/baked_epochs.hpp"
#include "examples/cortex_m/capacities.hpp"
#include "support/allocation_counter.hpp"

using namespace searvins;

namespace {

namespace image = searvins::cortex_m;
using Rtk = image::Estimator<image::SmallCapacity>;

// Bytes by capacities, as docs/embedded.md prints them: 64-bit figures, a little above those of a Cortex-M.
static_assert(image::ram_budget<image::TinyCapacity>().whole <= 800'000);
static_assert(image::ram_budget<image::SmallCapacity>().whole <= 1'700'000);
static_assert(image::ram_budget<image::MediumCapacity>().whole <= 2'900'000);
static_assert(image::ram_budget<image::SmallCapacity>().smoother > image::ram_budget<image::SmallCapacity>().whole / 2);

/// A stretch of memory with a painted margin on both sides of the object in its middle.
struct Guarded {
  static constexpr std::size_t kMargin = 4096;
  static constexpr std::byte kPaint{0xA5};
  alignas(alignof(Rtk)) std::array<std::byte, kMargin + sizeof(Rtk) + kMargin> bytes;

  [[nodiscard]] bool margins_are_untouched() const {
    const auto painted = [](std::byte b) { return b == kPaint; };
    return std::all_of(bytes.begin(), bytes.begin() + kMargin, painted) && std::all_of(bytes.end() - kMargin, bytes.end(), painted);
  }
};

}  // namespace

TEST_CASE("P25 sizeof(RtkEstimator) is the whole memory: nothing is allocated from construction on, nothing outside it is touched") {
  const auto place = std::make_unique<Guarded>();
  place->bytes.fill(Guarded::kPaint);
  const auto epoch = std::make_unique<gnss::ObservationEpoch>();
  const unsigned long long before = test::heap_allocations();
  Rtk* const rtk = new (place->bytes.data() + Guarded::kMargin) Rtk;
  bool prepared = image::prepare(*rtk);
  int solutions = 0, fixes = 0;
  double worst_m = 0;
  unsigned long long first_update = 0;
  for (int k = 0; k < image::kEpochs; ++k) {
    image::unpack(image::kBaseEpochs[k], image::kBaseSignals, *epoch);
    prepared = rtk->add_base(*epoch).ok() && prepared;
    image::unpack(image::kRoverEpochs[k], image::kRoverSignals, *epoch);
    const auto solution = rtk->update(*epoch);
    if (k == 0) first_update = test::heap_allocations();
    if (!solution.ok()) continue;
    ++solutions, fixes += solution->status == estimator::SolutionStatus::fix ? 1 : 0;
    worst_m = std::max(worst_m, (solution->position_e_m - image::position_of(image::kTruth[k])).norm());
  }
  const unsigned long long after = test::heap_allocations();
  rtk->~Rtk();
  CHECK(prepared);
  CHECK(solutions == image::kEpochs);
  CHECK(fixes >= 12);
  CHECK(worst_m < 0.5);
  CHECK(first_update == before);  // no set-up cost that the first update pays
  CHECK(after == before);
  CHECK(place->margins_are_untouched());
}

TEST_CASE("P25 the counter counts: what the test above would see") {
  const unsigned long long before = test::heap_allocations();
  const auto something = std::make_unique<std::array<int, 100>>();
  CHECK(test::heap_allocations() == before + 1);
  CHECK(something != nullptr);
}

TEST_CASE("P21 no public type needs more alignment than max_align_t, whatever a program does with it") {
  static_assert(alignof(Rtk) <= alignof(std::max_align_t));
  static_assert(alignof(gnss::ObservationEpoch) <= alignof(std::max_align_t) && alignof(gnss::Ephemeris) <= alignof(std::max_align_t));
  static_assert(alignof(imu::ImuSample) <= alignof(std::max_align_t) && alignof(imu::NavigationState) <= alignof(std::max_align_t));
  static_assert(alignof(estimator::RtkSolution) <= alignof(std::max_align_t) &&
                alignof(estimator::RtkOptions) <= alignof(std::max_align_t));
  static_assert(alignof(vision::StereoFrame<16>) <= alignof(std::max_align_t) &&
                alignof(vision::StereoCamera<double>) <= alignof(std::max_align_t));
  int types = 0;
  test::for_each_public_type([&types](const char* name, std::size_t size, std::size_t alignment) {
    CAPTURE(name);
    CHECK(alignment <= alignof(std::max_align_t));
    CHECK(size % alignment == 0);
    ++types;
  });
  CHECK(types >= 36);
}

TEST_CASE("P21 searvins::searvins carries no flags, in the build and as it is installed; searvins::embedded is for who asks") {
  CHECK(std::string{SEARVINS_TARGET_FLAGS} == "");
  // The exported file as it will be installed: options stand with the target that they belong to.
  std::filesystem::path exported;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(SEARVINS_EXPORT_DIR))
    if (entry.path().filename() == "searvinsTargets.cmake") exported = entry.path();
  if (exported.empty()) {
    MESSAGE("SKIPPED: P21 flags as installed: this build has no install rules");
    return;
  }
  std::ifstream file(exported);
  const std::string text{std::istreambuf_iterator<char>{file}, {}};
  const std::size_t plain = text.find("add_library(searvins::searvins"), embedded = text.find("add_library(searvins::embedded");
  REQUIRE((plain != std::string::npos && embedded != std::string::npos && plain < embedded));
  const std::string mine = text.substr(plain, embedded - plain);
  for (const char* property : {"INTERFACE_COMPILE_OPTIONS", "INTERFACE_COMPILE_DEFINITIONS", "INTERFACE_LINK_OPTIONS"}) {
    CAPTURE(property);
    CHECK(mine.find(property) == std::string::npos);
  }
  CHECK(text.find("embedded_eigen.hpp", embedded) != std::string::npos);
}
