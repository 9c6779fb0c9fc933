// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Which of the candidates for a match is believed: the nearest descriptor, if it is near enough, clearly nearer than the next one
/// elsewhere (ratio), and if what it belongs to has no better partner itself (mutual).
///
/// "Elsewhere" matters: the same corner found again on the next level, or a pixel beside, is no rival.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace searvins::orb {

/// Why a feature or track found no partner, or that it did.
enum class MatchFate : std::uint8_t {
  matched,
  no_candidate,   ///< nothing there where it should be
  too_different,  ///< the nearest descriptor differs in too many bits
  ambiguous,      ///< a second candidate elsewhere is nearly as near
  not_mutual,     ///< the candidate has a better partner
  not_aligned,    ///< stereo: the patches have no common minimum, or do not show the same
  bad_disparity,  ///< stereo: zero or negative, or nearer than anything may be
};
inline constexpr std::size_t kMatchFates = 7;

/// Name of a fate, for tables and legends.
[[nodiscard]] constexpr const char* name_of(MatchFate fate) {
  constexpr const char* kNames[kMatchFates] = {"matched",    "no candidate", "too different", "ambiguous",
                                               "not mutual", "not aligned",  "bad disparity"};
  return kNames[static_cast<std::size_t>(fate)];
}

/// Bounds of a choice.
struct MatchLimits {
  int max_distance{72};   ///< bits of 256; unrelated descriptors differ in about 128
  float ratio{0.85F};     ///< nearest over next elsewhere, at most
  float elsewhere_px{4};  ///< of the full image, times the scale of the level
};

/// One possible partner.
struct Candidate {
  std::size_t index{0};
  int distance{0};
  float u_px{0}, v_px{0};
};

/// The choice among candidates (of equals, the first): its place in the list, or why there is none.
struct Choice {
  MatchFate fate{MatchFate::no_candidate};
  std::size_t place{0};
};

[[nodiscard]] inline Choice choose(const std::vector<Candidate>& candidates, const MatchLimits& limits, float scale) {
  if (candidates.empty()) return {};
  std::size_t best = 0;
  for (std::size_t i = 1; i < candidates.size(); ++i)
    if (candidates[i].distance < candidates[best].distance) best = i;
  const Candidate& chosen = candidates[best];
  if (chosen.distance > limits.max_distance) return {MatchFate::too_different, best};
  const float elsewhere_px = limits.elsewhere_px * scale;
  for (const Candidate& c : candidates) {
    const bool is_elsewhere = std::abs(c.u_px - chosen.u_px) > elsewhere_px || std::abs(c.v_px - chosen.v_px) > elsewhere_px;
    if (is_elsewhere && static_cast<float>(chosen.distance) > limits.ratio * static_cast<float>(c.distance))
      return {MatchFate::ambiguous, best};
  }
  return {MatchFate::matched, best};
}

/// The best partner of everything on the other side: the mutual check.
class PartnerTable {
 public:
  void reset(std::size_t size) { entries_.assign(size, {}); }
  /// Offers `from` as a partner of `to`; of equals the first stays.
  void offer(std::size_t to, std::size_t from, int distance) {
    Entry& entry = entries_[to];
    if (distance < entry.distance) entry = {from, distance};
  }
  [[nodiscard]] bool is_best(std::size_t to, std::size_t from) const { return entries_[to].from == from; }

 private:
  struct Entry {
    std::size_t from{0};
    int distance{std::numeric_limits<int>::max()};
  };
  std::vector<Entry> entries_;
};

}  // namespace searvins::orb
