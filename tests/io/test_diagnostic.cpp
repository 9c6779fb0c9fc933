// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>

#include <searvins/io/diagnostic.hpp>

#include "support/property.hpp"

using namespace searvins;

TEST_CASE("a diagnostic reads file:line: message. hint, without the parts that are missing") {
  CHECK(io::to_string({"a.obs", 12, "bad count", "repair it"}) == "a.obs:12: bad count. repair it");
  CHECK(io::to_string({"a.obs", 0, "no such file", "check the path"}) == "a.obs: no such file. check the path");
  CHECK(io::to_string({"a.obs", 3, "bad count", ""}) == "a.obs:3: bad count");
}

TEST_CASE("a skip log counts by reason, keeps the first line, and never grows beyond its limit") {
  test::for_all_seeds(20, [](test::Rng& rng) {
    io::SkipLog log;
    const int reasons = test::integer(rng, 1, 200), events = test::integer(rng, 1, 500);
    long first_of_zero = 0, zeros = 0;
    for (int i = 1; i <= events; ++i) {
      const int reason = test::integer(rng, 0, reasons - 1);
      if (reason == 0) {
        ++zeros;
        if (first_of_zero == 0) first_of_zero = i;
      }
      log.add("reason <" + std::to_string(reason) + '>', i);
    }
    CHECK(log.total() == events);
    CHECK(log.items().size() <= io::SkipLog::kMaxReasons + 1);
    if (const io::SkippedItem* zero = log.find("<0>")) {
      CHECK(zero->first_line == first_of_zero);
      CHECK(zero->count == zeros);
      CHECK(log.count("<0>") == zeros);
    }
  });
}
