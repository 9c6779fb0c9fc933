// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include <searvins/io/fixed_field.hpp>

#include "support/property.hpp"

using namespace searvins;
using io::FieldState;

TEST_CASE("an F field is read as the nearest double, in any width and number of decimals") {
  test::for_all_seeds(500, [](test::Rng& rng) {
    const double v = test::uniform(rng, -1, 1) * std::pow(10.0, test::integer(rng, -3, 9));
    char text[64];
    std::snprintf(text, sizeof text, "%*.*f", test::integer(rng, 0, 20), test::integer(rng, 0, 5), v);
    double read = 0;
    REQUIRE(io::read_fixed(text, read) == FieldState::number);
    CHECK(read == std::strtod(text, nullptr));
  });
}

TEST_CASE("a D field is read as strtod reads it with e for D") {
  test::for_all_seeds(500, [](test::Rng& rng) {
    const double v = test::uniform(rng, -1, 1) * std::pow(10.0, test::integer(rng, -30, 30));
    char text[64];
    std::snprintf(text, sizeof text, "%19.12e", v);
    const double expected = std::strtod(text, nullptr);
    std::string field = text;
    field[field.find('e')] = "DdEe"[test::integer(rng, 0, 3)];
    double read = 0;
    REQUIRE(io::read_exponential(field, read) == FieldState::number);
    CHECK(read == expected);
  });
  double v = 0;
  CHECK(io::read_exponential("  -.468854D-01", v) == FieldState::number);
  CHECK(v == -0.0468854);
}

TEST_CASE("seconds become nanoseconds without rounding through a double") {
  std::int64_t ns = 0;
  CHECK(io::read_nanoseconds(" 30.0000000", ns) == FieldState::number);
  CHECK(ns == 30'000'000'000);
  CHECK(io::read_nanoseconds("59.123456789123", ns) == FieldState::number);
  CHECK(ns == 59'123'456'789);
  CHECK(io::read_nanoseconds("0.0060000", ns) == FieldState::number);
  CHECK(ns == 6'000'000);
  CHECK(io::read_nanoseconds("999999999999999999", ns) == FieldState::malformed);
}

TEST_CASE("blank fields, malformed fields and fields beyond the line are told apart, and the target is left alone") {
  double v = 7;
  int i = 7;
  for (const char* text : {"", "   "}) {
    CHECK(io::read_fixed(text, v) == FieldState::blank);
    CHECK(io::read_exponential(text, v) == FieldState::blank);
    CHECK(io::read_integer(text, i) == FieldState::blank);
  }
  for (const char* text : {"NaN", "inf", "****", "1 2", "1.2.3", "-", ".", "+-1", "1e", "0x10", "1\t"}) {
    CAPTURE(text);
    CHECK(io::read_fixed(text, v) == FieldState::malformed);
    CHECK(io::read_exponential(text, v) == FieldState::malformed);
    CHECK(io::read_integer(text, i) == FieldState::malformed);
  }
  CHECK(io::read_fixed("1e5", v) == FieldState::malformed);
  CHECK(io::read_exponential("1e999", v) == FieldState::malformed);
  CHECK(io::read_integer("1234567890", i) == FieldState::malformed);
  CHECK(v == 7);
  CHECK(i == 7);
  CHECK(io::field("abc", 1, 5) == "bc");
  CHECK(io::field("abc", 3, 5).empty());
  CHECK(io::column("abc", 9) == ' ');
  CHECK(io::read_integer(" -12 ", i) == FieldState::number);
  CHECK(i == -12);
}
