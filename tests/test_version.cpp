// SPDX-License-Identifier: BSD-3-Clause
// version.hpp says the same thing three times (macros, string, CMake); they must agree.
#include <doctest/doctest.h>

#include <searvins/version.hpp>

#include <string>

TEST_CASE("the version string, the macros and CMake's version agree") {
  const std::string from_macros =
      std::to_string(SEARVINS_VERSION_MAJOR) + "." + std::to_string(SEARVINS_VERSION_MINOR) + "." + std::to_string(SEARVINS_VERSION_PATCH);
  CHECK(searvins::kVersionString == from_macros);
  CHECK(std::string{SEARVINS_CMAKE_VERSION} == from_macros);
}

TEST_CASE("SEARVINS_VERSION_AT_LEAST compares major, then minor, then patch") {
  constexpr int major = SEARVINS_VERSION_MAJOR, minor = SEARVINS_VERSION_MINOR, patch = SEARVINS_VERSION_PATCH;
  CHECK(SEARVINS_VERSION_AT_LEAST(major, minor, patch));
  CHECK_FALSE(SEARVINS_VERSION_AT_LEAST(major, minor, patch + 1));
  CHECK_FALSE(SEARVINS_VERSION_AT_LEAST(major, minor + 1, 0));
  CHECK_FALSE(SEARVINS_VERSION_AT_LEAST(major + 1, 0, 0));
  CHECK(SEARVINS_VERSION_AT_LEAST(major - 1, 99, 99));
}
