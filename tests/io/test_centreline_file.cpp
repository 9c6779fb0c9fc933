// SPDX-License-Identifier: BSD-3-Clause
// Tables of centre lines: what is written comes back, and every bad row is refused with its number.
#include <searvins/io/centreline_file.hpp>

#include <doctest/doctest.h>

#include <string>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;

namespace {

const std::string kHead = "line,lat_deg,lon_deg,height_m\n";

}  // namespace

TEST_CASE("centre lines: points and lines come back as they were written") {
  for_all_seeds(20, [](Rng& rng) {
    std::string text = "# a map\n\n" + kHead;
    std::vector<imu::CentrelinePoint> written;
    for (std::uint32_t line = 1; line < 5; ++line)
      for (int k = integer(rng, 2, 6); k > 0; --k) {
        const geodesy::Geodetic g{uniform(rng, -1.5, 1.5), uniform(rng, -3.1, 3.1), uniform(rng, -100, 3000)};
        text += std::to_string(line) + ", " + io::fixed_text(g.lat_rad * 57.29577951308232, 10) + "," + io::fixed_text(g.lon_rad * 57.29577951308232, 10) + "," +
                io::fixed_text(g.height_m, 4) + (chance(rng, 0.5) ? "\r\n" : "\n");
        written.push_back({geodesy::ecef_from_geodetic(g), line});
      }
    const auto read = io::parse_centrelines(text, "map.csv");
    REQUIRE(read);
    REQUIRE(read->size() == written.size());
    for (std::size_t i = 0; i < written.size(); ++i) {
      CHECK((*read)[i].line == written[i].line);
      CHECK(((*read)[i].position_e_m - written[i].position_e_m).norm() < 1e-3);
    }
  });
}

TEST_CASE("bad input: centre lines without columns, with a bad row, or without a line are refused, the row's number said") {
  const std::string good = "3,35.1,137.2,40\n";
  for (const std::string bad : {"x,35,137,40\n", "3,35.1,137.2\n", "3,north,137,40\n", "3,95,137,40\n", "3,35,137,nan\n", "-1,35,137,40\n", "3.5,35,137,40\n"}) {
    CAPTURE(bad);
    const auto read = io::parse_centrelines(kHead + good + good + bad, "map.csv");
    REQUIRE(!read);
    CHECK(read.error().line == 4);
    CHECK(!read.error().hint.empty());
  }
  CHECK(io::parse_centrelines(good + good, "map.csv").error().line == 1);
  CHECK(!io::parse_centrelines("", "map.csv"));
  CHECK(!io::parse_centrelines(kHead + good + "4,35.1,137.2,40\n", "map.csv"));
  CHECK(!io::read_centrelines("/nonexistent/map.csv"));
}
