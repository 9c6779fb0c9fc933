// SPDX-License-Identifier: BSD-3-Clause
// Status and Result: what they carry, what a failed one gives, and that neither can be mistaken for success.
#include <doctest/doctest.h>

#include <cstring>
#include <set>
#include <string>
#include <type_traits>

#include <searvins/core/status.hpp>

#include "support/property.hpp"

using searvins::failure;
using searvins::Result;
using searvins::Status;
using searvins::StatusCode;

namespace {

constexpr int kCodes = static_cast<int>(StatusCode::rejected) + 1;

Result<int> half_of(int x) {
  if (x % 2 != 0) return failure(StatusCode::invalid_argument, "odd", x, 1, 0.5);
  return x / 2;
}

}  // namespace

TEST_CASE("Status: every code has a name of its own, and only ok is true") {
  std::set<std::string> names;
  for (int i = 0; i < kCodes; ++i) {
    const auto code = static_cast<StatusCode>(i);
    CHECK(names.insert(searvins::name_of(code)).second);
    CHECK(std::strlen(searvins::name_of(code)) > 1);
    CHECK(std::string{searvins::name_of(code)} != "unknown status");
    CHECK(failure(code, "x").ok() == (code == StatusCode::ok));
    CHECK(static_cast<bool>(failure(code, "x")) == (code == StatusCode::ok));
  }
  CHECK(std::string{searvins::name_of(static_cast<StatusCode>(kCodes))} == "unknown status");  // grows with the enumeration
  CHECK(searvins::ok_status().ok());
  CHECK(Status{}.ok());
}

TEST_CASE("Status: the place and the number arrive; without them it says so") {
  const Status full = failure(StatusCode::not_positive_definite, "pivot", 7, 2, -1e-3);
  CHECK(std::string{full.what} == "pivot");
  CHECK(full.index == 7);
  CHECK(full.detail == 2);
  CHECK(full.value == -1e-3);
  const Status bare = failure(StatusCode::stale, "old");
  CHECK(bare.index == -1);
  CHECK(bare.detail == -1);
  static_assert(std::is_trivially_copyable_v<Status>);
}

TEST_CASE("Result: a value or the reason, never both") {
  searvins::test::for_all_seeds(200, [](searvins::test::Rng& rng) {
    const int x = searvins::test::integer(rng, -1000, 1000);
    const Result<int> half = half_of(x);
    CHECK(half.ok() == (x % 2 == 0));
    CHECK(half.ok() == half.status().ok());
    CHECK(static_cast<bool>(half) == half.ok());
    CHECK(*half == (half.ok() ? x / 2 : 0));
    CHECK(half.value() == *half);
    CHECK(half.value_or(12345) == (half.ok() ? x / 2 : 12345));
    if (!half.ok()) CHECK(half.status().index == x);
  });
}

TEST_CASE("Result: an ok status without a value is itself a failure") {
  const Result<int> hollow{searvins::ok_status()};
  CHECK_FALSE(hollow.ok());
  CHECK(hollow.status().code == StatusCode::invalid_argument);
  CHECK(hollow.value() == 0);
}

TEST_CASE("Result: members through the arrow, values may be changed in place") {
  struct Pair {
    int a{0}, b{0};
  };
  Result<Pair> pair{Pair{1, 2}};
  CHECK(pair->b == 2);
  pair->a = 5;
  (*pair).b = 6;
  CHECK(pair.value().a == 5);
  CHECK(pair.value().b == 6);
}

TEST_CASE("Status and Result work at compile time") {
  constexpr auto third = [](int x) -> Result<int> {
    if (x % 3 != 0) return failure(StatusCode::invalid_argument, "no multiple of three", x);
    return x / 3;
  };
  static_assert(third(9).ok() && *third(9) == 3);
  static_assert(!third(10).ok() && third(10).status().index == 10);
  CHECK(third(9).value_or(0) == 3);
}
