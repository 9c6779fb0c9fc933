// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Which signal of the rover is differenced against which signal of the base.
///
/// Receivers track one carrier in different modes: 2W against 2X, 1C against 1X. A difference of two modes carries a code bias that is a
/// property of the satellite, and a phase that RINEX aligns to a common reference. Two rules follow:
///
///   * identical codes go first, then codes of one family (components of one modulation), then any two codes of the carrier;
///   * within a group (one rover signal) every satellite uses the *same* base code, or the biases would differ inside a double difference.
///   A
///     satellite that lacks the group's base code is left out of the group.
///
/// The choice is stable: a pair stays until another pair of the same carrier has offered over twice the satellites for `patience` epochs.
///
///     family        GPS, QZSS L1   C | S L X (L1C) | P W Y M N D      L2   C | S L X (L2C) | P W Y M N D
///                   BeiDou B2      I Q X (B2I) | D P Z (B2b)          every other carrier is one family
#pragma once

#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/signal.hpp>

namespace searvins::gnss {

inline constexpr std::size_t kMaxSignalGroups = 16;  ///< pairs of rover and base signals in one epoch

/// One group of double differences: a rover signal and the base signal that it is differenced against.
struct SignalPair {
  SignalCode rover{}, base{};
  friend constexpr bool operator==(const SignalPair&, const SignalPair&) = default;
};

/// Which signals to use.
struct SignalSelection {
  StaticVector<SignalCode, kMaxSignalGroups> wanted{};  ///< rover signals in this order; empty: the best one of every common carrier
  std::uint16_t patience{10};  ///< epochs for which another pair must offer over twice the satellites before it takes over
};

/// Modulation that a tracking mode belongs to: equal letters mean components of one signal.
[[nodiscard]] constexpr char tracking_family(const SignalCode& s) {
  const auto one_of = [&](const char* letters) {
    for (; *letters; ++letters)
      if (s.attribute == *letters) return true;
    return false;
  };
  const bool gps_like = s.constellation == Constellation::gps || s.constellation == Constellation::qzss;
  if (gps_like && (s.band == '1' || s.band == '2')) return one_of("PWYMND") ? 'P' : one_of("SLX") ? 'L' : one_of("Z") ? 'Z' : 'C';
  if (s.constellation == Constellation::beidou && s.band == '7') return one_of("DPZ") ? 'P' : 'I';
  return 'A';
}

/// How much a pair of codes differs: 0 identical, 1 one family, 2 a code that RINEX 2 does not name, 3 another family of the same carrier,
/// -1 another or no carrier (not a pair).
[[nodiscard]] constexpr int pairing_penalty(const SignalCode& rover, const SignalCode& base) {
  if (!same_carrier(rover, base) || frequency_hz(rover) == 0) return -1;
  if (rover.attribute == base.attribute) return 0;
  if (rover.attribute == ' ' || base.attribute == ' ') return 2;
  return tracking_family(rover) == tracking_family(base) ? 1 : 3;
}

/// Order of tracking modes where nothing else decides, best first: civil and pilot components before data and semi-codeless ones.
[[nodiscard]] constexpr int tracking_preference(char attribute) {
  constexpr const char* order = "CQLXZPWDSIBAYMN";
  int i = 0;
  while (order[i] && order[i] != attribute) ++i;
  return i;
}

/// The pairs in use, chosen from the observations themselves. Copyable: stage a copy, commit it when the epoch is accepted.
class SignalPairing {
 public:
  /// Looks at the signals that both receivers have this epoch and revises the choice.
  void update(const ObservationEpoch& rover, const ObservationEpoch& base, const SignalSelection& selection) {
    const Tallies tallies = count(rover, base);
    drop_unwanted(selection);
    if (selection.wanted.empty()) {
      for (std::size_t i = 0; i < tallies.size(); ++i)
        if (first_of_carrier(tallies, i)) revise({tallies[i].pair.rover.constellation, tallies[i].pair.rover.band, 0}, tallies, selection);
    } else {
      for (const SignalCode& w : selection.wanted) revise(w, tallies, selection);
    }
    pairs_.clear();
    for (const Slot& s : slots_)
      if (!pairs_.push_back(s.pair)) break;
  }

  /// The pairs in use; automatic ones in the order of constellation and band, wanted ones in the order asked for.
  [[nodiscard]] const StaticVector<SignalPair, kMaxSignalGroups>& pairs() const { return pairs_; }

  /// Choices that did not fit kMaxSignalGroups so far.
  [[nodiscard]] std::size_t overflow() const { return overflow_; }

 private:
  struct Tally {
    SignalPair pair{};
    std::uint16_t weight{0};  // 2 a satellite with code and phase on both ends, 1 with code alone
  };
  using Tallies = StaticVector<Tally, 64>;
  struct Slot {
    SignalCode key{};  // attribute 0: any mode of the carrier
    SignalPair pair{};
    std::uint16_t contested{0};  // epochs in a row in which another pair offered over twice as much
  };

  [[nodiscard]] static Tallies count(const ObservationEpoch& rover, const ObservationEpoch& base) {
    Tallies tallies;
    for (const SatelliteObservation& satellite : rover.satellites) {
      const SatelliteObservation* other = base.find(satellite.satellite);
      if (!other) continue;
      for (const SignalObservation& r : satellite.signals)
        for (const SignalObservation& b : other->signals) {
          if (!r.has_code() || !b.has_code() || pairing_penalty(r.signal, b.signal) < 0) continue;
          if (Tally* t = entry(tallies, {r.signal, b.signal}))
            t->weight = static_cast<std::uint16_t>(t->weight + (r.has_phase() && b.has_phase() ? 2 : 1));
        }
    }
    return tallies;
  }

  [[nodiscard]] static Tally* entry(Tallies& tallies, const SignalPair& pair) {
    for (Tally& t : tallies)
      if (t.pair == pair) return &t;
    Tally* t = tallies.append();
    if (t) t->pair = pair;
    return t;
  }

  [[nodiscard]] static bool first_of_carrier(const Tallies& tallies, std::size_t at) {
    for (std::size_t i = 0; i < at; ++i)
      if (same_carrier(tallies[i].pair.rover, tallies[at].pair.rover)) return false;
    return true;
  }

  [[nodiscard]] static bool matches(const SignalCode& key, const SignalCode& rover) {
    return same_carrier(key, rover) && (key.attribute == 0 || rover.attribute == ' ' || key.attribute == rover.attribute);
  }

  /// a before b among pairs with enough satellites.
  [[nodiscard]] static bool better(const Tally& a, const Tally& b) {
    const int pa = pairing_penalty(a.pair.rover, a.pair.base), pb = pairing_penalty(b.pair.rover, b.pair.base);
    if (pa != pb) return pa < pb;
    if (a.weight != b.weight) return a.weight > b.weight;
    const int ra = tracking_preference(a.pair.rover.attribute), rb = tracking_preference(b.pair.rover.attribute);
    if (ra != rb) return ra < rb;
    return tracking_preference(a.pair.base.attribute) < tracking_preference(b.pair.base.attribute);
  }

  /// The best pair of a carrier: least penalty among those that offer at least half as much as the most frequent one.
  [[nodiscard]] static const Tally* best(const SignalCode& key, const Tallies& tallies) {
    int most = 0;
    for (const Tally& t : tallies)
      if (matches(key, t.pair.rover) && t.weight > most) most = t.weight;
    const Tally* found = nullptr;
    for (const Tally& t : tallies)
      if (matches(key, t.pair.rover) && 2 * t.weight >= most && (!found || better(t, *found))) found = &t;
    return found;
  }

  void revise(const SignalCode& key, const Tallies& tallies, const SignalSelection& selection) {
    const Tally* offer = best(key, tallies);
    if (!offer) return;
    for (Slot& s : slots_) {
      if (s.key != key) continue;
      int now = 0;
      for (const Tally& t : tallies)
        if (t.pair == s.pair) now = t.weight;
      if (offer->weight <= 2 * now)
        s.contested = 0;
      else if (++s.contested >= selection.patience)
        s.pair = offer->pair, s.contested = 0;
      return;
    }
    std::size_t at = 0;
    while (at < slots_.size() && rank(slots_[at].key, selection) < rank(key, selection)) ++at;
    if (!slots_.insert(at, {key, offer->pair, 0})) ++overflow_;
  }

  [[nodiscard]] static int rank(const SignalCode& key, const SignalSelection& selection) {
    for (std::size_t i = 0; i < selection.wanted.size(); ++i)
      if (selection.wanted[i] == key) return static_cast<int>(i);
    return 256 * static_cast<int>(key.constellation) + key.band;
  }

  void drop_unwanted(const SignalSelection& selection) {
    slots_.erase_if([&](const Slot& s) {
      if (selection.wanted.empty()) return s.key.attribute != 0;
      for (const SignalCode& w : selection.wanted)
        if (w == s.key) return false;
      return true;
    });
  }

  StaticVector<Slot, kMaxSignalGroups> slots_{};
  StaticVector<SignalPair, kMaxSignalGroups> pairs_{};
  std::size_t overflow_{0};
};

}  // namespace searvins::gnss
