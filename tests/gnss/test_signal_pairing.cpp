// SPDX-License-Identifier: BSD-3-Clause
// Which signals are paired: identical codes, families, wanted lists, stability.
#include <doctest/doctest.h>

#include <string>

#include <searvins/gnss/signal_pairing.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

SignalCode code(const std::string& text) {
  SignalCode c;
  if (!signal_from_text(text.c_str(), text.size(), c)) c = {Constellation::gps, text[1], ' '};
  return c;
}

/// `counts` satellites 1..n of a code, added to an epoch.
void add(ObservationEpoch& epoch, const std::string& text, int from, int to, bool phase = true) {
  const SignalCode c = code(text);
  for (int n = from; n <= to; ++n) {
    const SatelliteId id{c.constellation, static_cast<std::uint8_t>(n)};
    SatelliteObservation* satellite = nullptr;
    for (SatelliteObservation& s : epoch.satellites)
      if (s.satellite == id) satellite = &s;
    if (!satellite) {
      satellite = epoch.satellites.append();
      satellite->satellite = id;
    }
    SignalObservation o;
    o.signal = c, o.code_m = 2e7;
    if (phase) o.phase_cycles = 1e8;
    satellite->signals.push_back(o);
  }
}

std::string text(const SignalPairing& p) {
  std::string s;
  for (const SignalPair& pair : p.pairs()) {
    s += letter_of(pair.rover.constellation);
    s += {pair.rover.band, pair.rover.attribute, '-', pair.base.attribute, ' '};
  }
  return s;
}

}  // namespace

TEST_CASE("penalty: identical, family, unnamed, other family, other carrier") {
  CHECK(pairing_penalty(code("G2W"), code("G2W")) == 0);
  CHECK(pairing_penalty(code("G2L"), code("G2X")) == 1);
  CHECK(pairing_penalty(code("E1C"), code("E1X")) == 1);
  CHECK(pairing_penalty(code("C2I"), code("C2Q")) == 1);
  CHECK(pairing_penalty(code("G2 "), code("G2W")) == 2);
  CHECK(pairing_penalty(code("G2W"), code("G2X")) == 3);
  CHECK(pairing_penalty(code("G1C"), code("G1X")) == 3);  // L1 C/A against L1C
  CHECK(pairing_penalty(code("C7I"), code("C7D")) == 3);  // B2I against B2b
  CHECK(pairing_penalty(code("G1C"), code("E1C")) == -1);
  CHECK(pairing_penalty(code("G1C"), code("G2W")) == -1);
  CHECK(pairing_penalty({Constellation::gps, '9', 'C'}, {Constellation::gps, '9', 'C'}) == -1);
}

TEST_CASE("the signals of kamakura_drive: 2W goes to 2W, Galileo's 1C to 1X, one pair a carrier") {
  ObservationEpoch rover, base;
  for (const char* s : {"G1C", "G2W"}) add(rover, s, 1, 9);
  for (const char* s : {"G2L", "G5Q"}) add(rover, s, 1, 6);
  add(rover, "G1W", 1, 9, false);
  for (const char* s : {"E1C", "E5Q", "E7Q", "E8Q"}) add(rover, s, 1, 7);
  for (const char* s : {"G1C", "G2W"}) add(base, s, 1, 9);
  for (const char* s : {"G2X", "G5X"}) add(base, s, 1, 6);
  for (const char* s : {"E1X", "E5X", "E7X"}) add(base, s, 1, 7);
  SignalPairing p;
  p.update(rover, base, {});
  CHECK(text(p) == "G1C-C G2W-W G5Q-X E1C-X E5Q-X E7Q-X ");

  SignalSelection wanted;
  for (const char* s : {"E1C", "G2L", "G1C", "C2I"}) wanted.wanted.push_back(code(s));
  p.update(rover, base, wanted);
  CHECK(text(p) == "E1C-X G2L-X G1C-C ");
  p.update(rover, base, {});
  CHECK(text(p) == "G1C-C G2W-W G5Q-X E1C-X E5Q-X E7Q-X ");
}

TEST_CASE("a code that few satellites have does not win over one that most have; equal offers go to the better mode") {
  ObservationEpoch rover, base;
  add(rover, "G2L", 1, 4), add(rover, "G2W", 1, 10);
  add(base, "G2L", 1, 4), add(base, "G2X", 1, 10);
  SignalPairing p;
  p.update(rover, base, {});
  CHECK(text(p) == "G2W-X ");  // 10 satellites of another family before 4 of the same code

  ObservationEpoch both;
  add(both, "E1B", 1, 6), add(both, "E1C", 1, 6), add(both, "E5I", 1, 6), add(both, "E5Q", 1, 6);
  SignalPairing q;
  q.update(both, both, {});
  CHECK(text(q) == "E1C-C E5Q-Q ");
}

TEST_CASE("a pair is stable: it survives epochs without it, and yields only to twice the satellites for `patience` epochs") {
  ObservationEpoch w, l, nothing;
  add(w, "G2W", 1, 8);
  add(l, "G2W", 1, 3), add(l, "G2L", 1, 8);
  SignalSelection selection;
  selection.patience = 3;
  SignalPairing p;
  p.update(w, w, selection);
  CHECK(text(p) == "G2W-W ");
  p.update(nothing, nothing, selection);
  CHECK(text(p) == "G2W-W ");
  for (int k = 0; k < 2; ++k) p.update(l, l, selection);
  CHECK(text(p) == "G2W-W ");
  p.update(w, w, selection);  // the count begins anew
  for (int k = 0; k < 2; ++k) p.update(l, l, selection);
  CHECK(text(p) == "G2W-W ");
  p.update(l, l, selection);
  CHECK(text(p) == "G2L-L ");
}

TEST_CASE("RINEX 2 codes without a name pair with anything of their carrier") {
  ObservationEpoch rover, base;
  add(rover, "G2 ", 1, 5);
  add(base, "G2W", 1, 5);
  SignalPairing p;
  SignalSelection wanted;
  wanted.wanted.push_back(code("G2W"));
  p.update(rover, base, wanted);
  REQUIRE(p.pairs().size() == 1);
  CHECK(p.pairs()[0].rover.attribute == ' ');
  CHECK(p.pairs()[0].base.attribute == 'W');
}

TEST_CASE("every carrier of every constellation at once: what does not fit is counted, order is by constellation and band") {
  ObservationEpoch all;
  for (const char* s :
       {"G1C", "G2W", "G5Q", "E1C", "E5Q", "E6C", "E7Q", "E8Q", "C1P", "C2I", "C5P", "C6I", "C7I", "C8P", "J1C", "J2L", "J5Q"})
    add(all, s, 1, 2);
  SignalPairing p;
  p.update(all, all, {});
  CHECK(p.pairs().size() == 16);
  CHECK(p.overflow() == 1);
  for (std::size_t i = 1; i < p.pairs().size(); ++i) CHECK(p.pairs()[i - 1].rover < p.pairs()[i].rover);
}
