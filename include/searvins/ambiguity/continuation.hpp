// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Hybrid ambiguity continuation [paper sec. Hybrid Ambiguity Continuation and IAR]: which ambiguity state an observed phase belongs to.
///
/// One arc record a satellite and signal. At each epoch the phase is
///
///     continued   verified, and the arc has been used fewer than H times: the same state serves on
///     walked      verified, but the arc is H epochs long: a new state, tied to the old one by a random walk
///     fresh       continuity is broken or cannot be verified: a new state without past
///
/// "Verified" means: the phase carries a verified continuity since the previous epoch, the arc was used at that very epoch, and (for double-difference
/// states) its pivot is the same. H counts the first epoch: with H = 3 a state is used at k, k+1, k+2 and replaced at k+3.
///
///     mode           H          walk   verified continuity needed
///     hybrid         option     yes    yes
///     constant       infinite   no     yes
///     instantaneous  1          no     (never continued)
#pragma once

#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/gnss/signal.hpp>

namespace searvins::ambiguity {

/// See the file comment.
enum class ContinuityMode : std::uint8_t { hybrid, constant, instantaneous };

/// What to do with the phase of one satellite and signal.
enum class Transition : std::uint8_t { fresh, continued, walked };

/// Identity of an arc: one satellite on one pair of rover and base signals.
struct ArcId {
  gnss::SatelliteId satellite{};
  gnss::SignalCode rover_signal{}, base_signal{};
  friend constexpr bool operator==(const ArcId&, const ArcId&) = default;
};

/// The arcs of one estimator. `Handle` names an ambiguity state (a smoother key); `MaxArcs` bounds how many are remembered.
template <class Handle, std::size_t MaxArcs>
class Continuation {
 public:
  /// One arc: which state the phases of an identity share, and how long it has been in use.
  struct Arc {
    ArcId id{};
    gnss::SatelliteId pivot{};    ///< of double-difference states; number 0 otherwise
    Handle handle{};
    std::uint64_t last_epoch{0};  ///< counter of the epoch that used it last
    int used{0};                  ///< epochs that share the state
  };

  ContinuityMode mode{ContinuityMode::hybrid};
  int max_arc_epochs{3};  ///< H >= 1 of the hybrid mode

  /// A new epoch begins. Epochs that were skipped (too few satellites, no base) break every arc: call skip_epoch().
  void begin_epoch() { ++epoch_; }
  /// The epoch that began is not used: what follows cannot continue across it.
  void skip_epoch() { ++epoch_; }

  /// The arc of an identity, nullptr when there is none.
  [[nodiscard]] const Arc* find(const ArcId& id) const {
    for (const Arc& a : arcs_)
      if (a.id == id) return &a;
    return nullptr;
  }

  /// What becomes of a phase at the present epoch. `verified`: continuity since the previous epoch was checked and holds.
  [[nodiscard]] Transition decide(const ArcId& id, bool verified, gnss::SatelliteId pivot = {}) const {
    const Arc* arc = find(id);
    if (!arc || !verified || mode == ContinuityMode::instantaneous) return Transition::fresh;
    if (arc->last_epoch + 1 != epoch_ || arc->pivot != pivot) return Transition::fresh;
    if (mode == ContinuityMode::constant || arc->used < max_arc_epochs) return Transition::continued;
    return Transition::walked;
  }

  /// Records that the present epoch uses `handle` for `id`. False when the table is full of arcs in use (nothing is recorded: the next epoch
  /// starts afresh).
  bool record(const ArcId& id, Transition transition, const Handle& handle, gnss::SatelliteId pivot = {}) {
    Arc* arc = nullptr;
    for (Arc& a : arcs_)
      if (a.id == id) arc = &a;
    if (!arc) {
      arcs_.erase_if([this](const Arc& a) { return a.last_epoch + 1 < epoch_; });  // cannot be continued any more
      if (!(arc = arcs_.append())) return false;
    }
    const int used = transition == Transition::continued ? arc->used + 1 : 1;
    *arc = {id, pivot, handle, epoch_, used};
    return true;
  }

  /// Forgets an arc: its next phase is fresh (a contradicted integer, a state that left the window).
  void forget(const ArcId& id) {
    arcs_.erase_if([&](const Arc& a) { return a.id == id; });
  }
  void clear() { arcs_.clear(); }
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  [[nodiscard]] const StaticVector<Arc, MaxArcs>& arcs() const { return arcs_; }

 private:
  StaticVector<Arc, MaxArcs> arcs_{};
  std::uint64_t epoch_{1};
};

}  // namespace searvins::ambiguity
