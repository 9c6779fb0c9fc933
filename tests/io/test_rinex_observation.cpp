// SPDX-License-Identifier: BSD-3-Clause
// The observation reader: what is written comes back, any beginning of a file gives a beginning of its epochs, no bytes harm it.
// The meaning of each part of the format and bad input have their own files.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include <searvins/io/rinex_observation.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;

namespace {

const GpsTime kStart = gps_from_civil({2024, 6, 24, 8, 20, 0.0});

test::RinexTextPlan modern_plan(double version) {
  return {version,
          {test::signal("G1C"), test::signal("G2W"), test::signal("G2L"), test::signal("G5Q"), test::signal("E1C"), test::signal("E5Q"),
           test::signal("E7Q"), test::signal("C2I"), test::signal("C7I"), test::signal("J1C"), test::signal("J2L")}};
}

/// Random rising tags on the grid of 100 ns.
std::vector<GpsTime> random_tags(test::Rng& rng, int n) {
  std::vector<GpsTime> tags;
  GpsTime t = kStart;
  for (int i = 0; i < n; ++i) {
    t.ns += test::chance(rng, 0.7) ? kNanosecondsPerSecond : 100LL * test::integer(rng, 1, 900'000'000);
    tags.push_back(t);
  }
  return tags;
}

struct Recording {
  std::string text;
  std::vector<gnss::ObservationEpoch> epochs;
};

Recording random_modern(test::Rng& rng, int n) {
  const double versions[] = {3.00, 3.03, 3.04, 3.05, 4.00, 4.01};
  const test::RinexTextPlan plan = modern_plan(versions[test::integer(rng, 0, 5)]);
  Recording r{test::header_3(plan), {}};
  for (const GpsTime tag : random_tags(rng, n)) {
    r.epochs.push_back(test::random_epoch(rng, plan, tag));
    r.text += test::epoch_3(plan, r.epochs.back());
  }
  return r;
}

Recording random_legacy(test::Rng& rng, int n) {
  Recording r{test::observation_header(test::chance(rng, 0.5) ? 2.10 : 2.11, test::types_2(test::legacy_types())), {}};
  for (const GpsTime tag : random_tags(rng, n)) {
    r.epochs.push_back(test::random_legacy_epoch(rng, tag));
    r.text += test::epoch_2(r.epochs.back());
  }
  return r;
}

bool same_epochs(const std::vector<gnss::ObservationEpoch>& a, const std::vector<gnss::ObservationEpoch>& b, std::size_t n) {
  return a.size() >= n && b.size() >= n && std::equal(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(n), b.begin(), test::same_epoch);
}

/// The text with trailing blanks of lines removed, as many writers do.
std::string trimmed_lines(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') out.resize(out.find_last_not_of(' ') + 1);
    out += c;
  }
  return out;
}

std::string with_crlf(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '\n' ? "\r\n" : std::string(1, c);
  return out;
}

}  // namespace

TEST_CASE("random epochs written as RINEX 3 or 4 are read back equal, trimmed or not, LF or CR LF") {
  test::for_all_seeds(40, [](test::Rng& rng) {
    const Recording r = random_modern(rng, test::integer(rng, 1, 20));
    for (const std::string& text : {r.text, trimmed_lines(r.text), with_crlf(r.text)}) {
      const auto parsed = io::read_rinex_observation_text(text);
      REQUIRE(parsed.ok());
      CHECK(parsed.value.epochs.size() == r.epochs.size());
      CHECK(same_epochs(parsed.value.epochs, r.epochs, r.epochs.size()));
      CHECK(parsed.skipped.total() == 0);
      CHECK(parsed.value.summary.first == r.epochs.front().tag);
      CHECK(parsed.value.summary.last == r.epochs.back().tag);
    }
  });
}

TEST_CASE("random epochs written as RINEX 2 are read back equal, more than 12 satellites and wrapped lines included") {
  test::for_all_seeds(40, [](test::Rng& rng) {
    const Recording r = random_legacy(rng, test::integer(rng, 1, 20));
    for (const std::string& text : {r.text, trimmed_lines(r.text), with_crlf(r.text)}) {
      const auto parsed = io::read_rinex_observation_text(text);
      REQUIRE(parsed.ok());
      CHECK(parsed.value.epochs.size() == r.epochs.size());
      CHECK(same_epochs(parsed.value.epochs, r.epochs, r.epochs.size()));
      CHECK(parsed.skipped.total() == 0);
    }
  });
}

TEST_CASE("a file cut at any byte gives a beginning of its epochs, or an error that says what is missing") {
  test::for_all_seeds(3, [](test::Rng& rng) {
    for (const Recording& r : {random_modern(rng, 3), random_legacy(rng, 3)}) {
      std::size_t most = 0;
      for (std::size_t cut = 0; cut < r.text.size(); cut += static_cast<std::size_t>(test::integer(rng, 1, 12))) {
        CAPTURE(cut);
        const auto parsed = io::read_rinex_observation_text(r.text.substr(0, cut));
        const std::size_t n = parsed.value.epochs.size();
        if (!same_epochs(parsed.value.epochs, r.epochs, n)) FAIL_CHECK("not a beginning");
        if (parsed.ok() == (n == 0)) FAIL_CHECK("an error exactly where there is no epoch");
        if (n < most) FAIL_CHECK("fewer epochs from more text");
        most = n;
      }
      CHECK(most + 1 == r.epochs.size());
      CHECK(io::read_rinex_observation_text(r.text).value.epochs.size() == r.epochs.size());
    }
  });
}

TEST_CASE("random damage does no harm: tags rise, satellites are sorted and single, undamaged beginnings stay as they are") {
  test::for_all_seeds(60, [](test::Rng& rng) {
    const Recording r = test::chance(rng, 0.5) ? random_modern(rng, 6) : random_legacy(rng, 6);
    std::string text = r.text;
    const int changes = test::integer(rng, 1, 30);
    for (int i = 0; i < changes; ++i) {
      const auto at = static_cast<std::size_t>(test::integer(rng, 0, static_cast<int>(text.size()) - 1));
      const char c =
          test::chance(rng, 0.5) ? static_cast<char>(test::integer(rng, 0, 255)) : "0123456789 GECJR>.-\n\t"[test::integer(rng, 0, 20)];
      const int what = test::integer(rng, 0, 2);
      if (what == 0) text[at] = c;
      if (what == 1) text.insert(at, 1, c);
      if (what == 2) text.erase(at, static_cast<std::size_t>(test::integer(rng, 1, 100)));
      if (text.empty()) text = "x";
    }
    const auto parsed = io::read_rinex_observation_text(text);
    const auto& epochs = parsed.value.epochs;
    for (std::size_t i = 0; i < epochs.size(); ++i) {
      if (i > 0) CHECK(epochs[i - 1].tag < epochs[i].tag);
      const auto& satellites = epochs[i].satellites;
      for (std::size_t k = 1; k < satellites.size(); ++k) CHECK(satellites[k - 1].satellite < satellites[k].satellite);
    }
    CHECK((!epochs.empty() || parsed.error.has_value()));
  });
}

TEST_CASE("streaming and reading all give the same, and the reader can be used again") {
  test::Rng rng{5};
  const Recording r = random_modern(rng, 10);
  io::RinexObservationReader reader;
  CHECK_FALSE(reader.open("/no/such/file"));
  REQUIRE(reader.open_text(r.text));
  std::vector<gnss::ObservationEpoch> streamed;
  while (const auto epoch = reader.next()) streamed.push_back(*epoch);
  CHECK(streamed.size() == r.epochs.size());
  CHECK(same_epochs(streamed, r.epochs, streamed.size()));
  CHECK_FALSE(reader.next().has_value());
  CHECK_FALSE(reader.error().has_value());
  CHECK(reader.summary().epochs == 10);
}
