// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include <searvins/io/rinex_observation_types.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;
using gnss::Constellation;

TEST_CASE("every type keeps its column, whether it is used or not, and every slot names a carrier of the constellation") {
  test::for_all_seeds(200, [](test::Rng& rng) {
    const bool legacy = test::chance(rng, 0.3);
    std::vector<std::string> types;
    for (int i = test::integer(rng, 0, 40); i > 0; --i) {
      std::string type{"CLDSPXI"[test::integer(rng, 0, 6)], "0123456789A"[test::integer(rng, 0, 10)]};
      if (!legacy && test::chance(rng, 0.9)) type += "CWXIQ1 a"[test::integer(rng, 0, 7)];
      types.push_back(type);
    }
    const auto c = static_cast<Constellation>(test::integer(rng, 0, 3));
    const io::ObservationLayout layout = io::layout_from_types(c, types, legacy ? 2.11 : 3.04);
    REQUIRE(layout.columns.size() == types.size());
    for (const gnss::SignalCode& s : layout.signals) CHECK((s.constellation == c && gnss::frequency_hz(s) > 0));
    for (std::size_t i = 0; i < types.size(); ++i) {
      const io::ObservationColumn& column = layout.columns[i];
      if (column.quantity == 0) continue;
      CHECK(column.quantity == (types[i][0] == 'P' ? 'C' : types[i][0]));
      CHECK(column.slot < layout.signals.size());
      CHECK((column.if_absent == io::ObservationColumn::kNone || column.if_absent < layout.signals.size()));
    }
    for (std::size_t i = 0; i < layout.signals.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) CHECK(layout.signals[i] != layout.signals[k]);
  });
}

TEST_CASE("RINEX 3 types: the four quantities of a signal share a slot") {
  const auto layout = io::layout_from_types(Constellation::gps, {"C1C", "L1C", "X1", "D1C", "S1C", "L2W", "C9C", "L1"}, 3.04);
  CHECK(layout.signals == std::vector<gnss::SignalCode>{test::signal("G1C"), test::signal("G2W"), {Constellation::gps, '1', ' '}});
  for (const std::size_t i : {0U, 1U, 3U, 4U}) CHECK(layout.columns[i].slot == 0);
  CHECK(layout.columns[2].quantity == 0);
  CHECK(layout.columns[5].slot == 1);
  CHECK(layout.columns[6].quantity == 0);
  CHECK(layout.columns[7].slot == 2);
}

TEST_CASE("RINEX 2 types: what a phase belongs to when a band has two codes, one, or none") {
  const auto slot_signal = [](const std::vector<std::string>& types, std::size_t i, bool second) {
    const auto layout = io::layout_from_types(Constellation::gps, types, 2.11);
    const auto slot = second ? layout.columns[i].if_absent : layout.columns[i].slot;
    return slot == io::ObservationColumn::kNone ? gnss::SignalCode{} : layout.signals[slot];
  };
  CHECK(slot_signal({"L2", "C2", "P2"}, 0, false) == test::signal("G2W"));
  CHECK(slot_signal({"L2", "C2", "P2"}, 0, true) == test::signal("G2X"));
  CHECK(slot_signal({"L2", "C2"}, 0, false) == test::signal("G2X"));
  CHECK(slot_signal({"L2", "C2"}, 0, true) == gnss::SignalCode{});
  CHECK(slot_signal({"L2"}, 0, false) == test::signal("G2W"));
  CHECK(slot_signal({"L1", "P1"}, 0, false) == test::signal("G1W"));
  CHECK(slot_signal({"L1", "P1", "C1"}, 0, false) == test::signal("G1C"));
  CHECK(slot_signal({"D5"}, 0, false) == test::signal("G5X"));
  CHECK(slot_signal({"L7"}, 0, false) == gnss::SignalCode{});
}
