// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The best few of many points, spread over the picture: a crowd of corners on one facade says little more than some of them.
///
/// The picture is divided into 8 x 4 cells. Points are chosen one by one: preferred ones (landmarks that live on) before others, then
/// from the cell with the fewest chosen so far, then the highest score, then the first. So every cell gets its share while it has points
/// to offer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include <searvins/core/static_vector.hpp>

namespace searvins::vision {

/// A point that asks to be chosen.
struct SpreadCandidate {
  double u_px{0}, v_px{0};
  double score{0};
  bool preferred{false};
  bool chosen{false};  ///< the answer
};

namespace detail {

/// Number of the cell of a point; points off the picture belong to the cell at the edge.
[[nodiscard]] inline std::size_t spread_cell(const SpreadCandidate& c, int width_px, int height_px) {
  constexpr int kColumns = 8, kRows = 4;
  const auto part = [](double x_px, int size_px, int parts) {
    const double share = std::clamp(x_px / std::max(size_px, 1), 0.0, 1.0);
    return static_cast<std::size_t>(std::min(parts - 1, static_cast<int>(share * parts)));
  };
  return part(c.v_px, height_px, kRows) * kColumns + part(c.u_px, width_px, kColumns);
}

}  // namespace detail

/// Sets `chosen` for at most `most` candidates, for all of them when they are no more. Coordinates and scores must be finite.
template <std::size_t N>
void choose_spread(StaticVector<SpreadCandidate, N>& candidates, std::size_t most, int width_px, int height_px) {
  const bool room_for_all = candidates.size() <= most;
  for (SpreadCandidate& c : candidates) c.chosen = room_for_all;
  if (room_for_all) return;
  std::array<std::size_t, 32> crowd{};
  for (std::size_t k = 0; k < most; ++k) {
    SpreadCandidate* best = nullptr;
    for (SpreadCandidate& c : candidates) {
      if (c.chosen) continue;
      if (!best) {
        best = &c;
        continue;
      }
      const std::size_t here = crowd[detail::spread_cell(c, width_px, height_px)],
                        there = crowd[detail::spread_cell(*best, width_px, height_px)];
      const bool better = c.preferred != best->preferred ? c.preferred : here != there ? here < there : c.score > best->score;
      if (better) best = &c;
    }
    best->chosen = true;
    ++crowd[detail::spread_cell(*best, width_px, height_px)];
  }
}

}  // namespace searvins::vision
