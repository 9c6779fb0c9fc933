// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The last epochs of the base station, its place, and the answer to: which of them belong to this rover epoch?
///
///     exact          the base epoch whose tag equals the rover's within a tolerance
///     carry forward  the latest base epoch not after the rover's: what a vehicle has
///     interpolate    the two around it, weights (1 - fraction, fraction); for post-processing, since it waits for the later one
///
/// Tags are each receiver's own clock, and need not be equal: the satellite positions of either epoch come from its own tag minus code, so
/// the two clocks never mix. What is interpolated is the observation minus range plus satellite clock (the caller forms it); that is
/// smooth.
///
/// Age. The error of a base observation used `age` seconds later grows as a random walk of the satellite clock, so its sigma is taken as
/// rate * age. Between two epochs tau0 and tau1 away the walk is tied at both ends (a bridge): the effective age is tau0 tau1 / (tau0 +
/// tau1).
///
/// Phase continuity of the base is kept as an arc number a signal: it changes at every loss of lock, gap or power failure, whether or not
/// the rover looked at that epoch. Equal numbers at two times mean: continuous in between.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/observation.hpp>

namespace searvins::gnss {

/// How base epochs are matched to rover epochs.
enum class BaseMode : std::uint8_t { exact, carry_forward, interpolate };

/// Settings of the matching.
struct BaseOptions {
  BaseMode mode{BaseMode::carry_forward};
  double max_age_s{30};
  double match_tolerance_s{0.05};  ///< tags this near count as the same epoch (receiver clocks are up to some 10 ms off)
  double latency_s{30};            ///< interpolate: the later base epoch may be this much after the rover's
};

/// A phase arc of one base signal.
struct BaseArc {
  std::uint32_t number{0};           ///< 0: no usable phase
  SlipCause cause{SlipCause::none};  ///< why the arc began: first_epoch, gap, lli_base, power_failure
};

/// A stored base epoch; `arcs` runs parallel to its satellites and signals.
struct BaseEpoch {
  ObservationEpoch observation{};
  std::array<std::array<BaseArc, kMaxSignalsPerSatellite>, kMaxSatellitesPerEpoch> arcs{};

  /// The arc of a signal of a satellite, both of this very epoch.
  [[nodiscard]] BaseArc arc_of(const SatelliteObservation& satellite, const SignalObservation& signal) const {
    const auto s = static_cast<std::size_t>(&satellite - observation.satellites.data());
    const auto k = static_cast<std::size_t>(&signal - satellite.signals.data());
    return arcs[s][k];
  }
  /// The arc of a signal by name, number 0 when it is not there.
  [[nodiscard]] BaseArc arc_of(SatelliteId id, const SignalCode& code) const {
    const SatelliteObservation* satellite = observation.find(id);
    const SignalObservation* signal = satellite ? satellite->find(code) : nullptr;
    return signal ? arc_of(*satellite, *signal) : BaseArc{};
  }
};

/// The base epochs that serve a rover epoch. Pointers into the buffer: valid until it is changed.
struct BaseMatch {
  const BaseEpoch* first{nullptr};
  const BaseEpoch* second{nullptr};  ///< nullptr: `first` alone
  double fraction{0};                ///< weight of `second`, [0, 1]
  double age_s{0};                   ///< rover tag minus tag of `first`; negative within the tolerance only
  double effective_age_s{0};         ///< for the variance, >= 0
};

/// Up to N base epochs in time order; a newer one pushes the oldest out.
template <std::size_t N = 4>
class BaseBuffer {
 public:
  static_assert(N >= 2, "interpolation needs two epochs");

  /// Antenna position of the base, ECEF metres. Another position than before forgets the epochs. Errors: non_finite, invalid_argument
  /// (farther than 100 km from the ellipsoid; a header that says 0,0,0 ends here).
  Status set_position(const Eigen::Vector3d& position_e_m) {
    if (!position_e_m.allFinite()) return failure(StatusCode::non_finite, "base position is not finite");
    const double r_m = position_e_m.norm();
    if (r_m < 6.25e6 || r_m > 6.48e6)
      return failure(StatusCode::invalid_argument, "base position is not near the surface of the Earth: give it in ECEF metres", -1, -1,
                     r_m);
    if (positioned_ && position_e_m == position_e_m_) return ok_status();
    if (positioned_) epochs_.clear();
    position_e_m_ = position_e_m, positioned_ = true, ++revision_;
    return ok_status();
  }

  [[nodiscard]] bool positioned() const { return positioned_; }
  [[nodiscard]] const Eigen::Vector3d& position_e_m() const { return position_e_m_; }
  [[nodiscard]] std::uint32_t position_revision() const { return revision_; }  ///< counts the positions set so far

  /// Takes the next base epoch. Errors (nothing changes): duplicate, out_of_order.
  Status push(const ObservationEpoch& observation) {
    if (!epochs_.empty()) {
      const GpsTime last = epochs_.back().observation.tag;
      if (observation.tag == last) return failure(StatusCode::duplicate, "base epoch given twice");
      if (observation.tag < last)
        return failure(StatusCode::out_of_order, "base epoch before the last one", -1, -1, seconds_between(observation.tag, last));
      const double step_s = seconds_between(last, observation.tag);
      if (interval_s_ == 0 || step_s < interval_s_) interval_s_ = step_s;
    }
    BaseEpoch* previous = nullptr;
    if (epochs_.full()) epochs_.erase(0);
    BaseEpoch* epoch = epochs_.append();
    if (epochs_.size() > 1) previous = &epochs_[epochs_.size() - 2];
    epoch->observation = observation;
    continue_arcs(previous, *epoch);
    return ok_status();
  }

  /// The epochs for a rover tag. Errors: no_data (no position, or no base epoch at or before the tag), stale (`value`: the age in seconds).
  [[nodiscard]] Result<BaseMatch> match(GpsTime rover_tag, const BaseOptions& options) const {
    if (!positioned_) return failure(StatusCode::no_data, "the base has no position");
    const BaseEpoch *nearest = nullptr, *before = nullptr, *after = nullptr;
    for (const BaseEpoch& e : epochs_) {
      const double age_s = seconds_between(e.observation.tag, rover_tag);
      if (!nearest || std::abs(age_s) < std::abs(seconds_between(nearest->observation.tag, rover_tag))) nearest = &e;
      if (age_s >= 0) before = &e;
      if (age_s < 0 && !after) after = &e;
    }
    if (!nearest) return failure(StatusCode::no_data, "no base epoch yet");
    const double nearest_s = seconds_between(nearest->observation.tag, rover_tag);
    if (std::abs(nearest_s) <= options.match_tolerance_s) return BaseMatch{nearest, nullptr, 0, nearest_s, std::abs(nearest_s)};
    if (options.mode == BaseMode::exact) return failure(StatusCode::stale, "no base epoch of the same time", -1, -1, nearest_s);
    if (!before) return failure(StatusCode::no_data, "no base epoch at or before the rover epoch", -1, -1, nearest_s);
    const double age_s = seconds_between(before->observation.tag, rover_tag);
    if (options.mode == BaseMode::interpolate && after) {
      const double wait_s = seconds_between(rover_tag, after->observation.tag), bridge_s = age_s * wait_s / (age_s + wait_s);
      if (wait_s <= options.latency_s && bridge_s <= options.max_age_s)
        return BaseMatch{before, after, age_s / (age_s + wait_s), age_s, bridge_s};
    }
    if (age_s > options.max_age_s) return failure(StatusCode::stale, "base data too old", -1, -1, age_s);
    return BaseMatch{before, nullptr, 0, age_s, age_s};
  }

  [[nodiscard]] const StaticVector<BaseEpoch, N>& epochs() const { return epochs_; }
  void clear() { epochs_.clear(); }

 private:
  /// Gives every usable phase of `epoch` the arc number it had in `previous`, or a new one.
  void continue_arcs(const BaseEpoch* previous, BaseEpoch& epoch) {
    const bool gap = previous && seconds_between(previous->observation.tag, epoch.observation.tag) > 1.5 * interval_s_;
    for (std::size_t s = 0; s < epoch.observation.satellites.size(); ++s) {
      const SatelliteObservation& satellite = epoch.observation.satellites[s];
      for (std::size_t k = 0; k < satellite.signals.size(); ++k) {
        const SignalObservation& signal = satellite.signals[k];
        BaseArc& arc = epoch.arcs[s][k];
        arc = {};
        if (!signal.has_phase() || signal.half_cycle) continue;
        const BaseArc old = previous ? previous->arc_of(satellite.satellite, signal.signal) : BaseArc{};
        if (!previous)
          arc.cause = SlipCause::first_epoch;
        else if (epoch.observation.power_failure)
          arc.cause = SlipCause::power_failure;
        else if (gap || old.number == 0)
          arc.cause = SlipCause::gap;
        else if (signal.loss_of_lock)
          arc.cause = SlipCause::lli_base;
        else
          arc = old;
        if (arc.number == 0) arc.number = ++last_arc_;
      }
    }
  }

  StaticVector<BaseEpoch, N> epochs_{};
  Eigen::Vector3d position_e_m_{Eigen::Vector3d::Zero()};
  bool positioned_{false};
  std::uint32_t revision_{0}, last_arc_{0};
  double interval_s_{0};  // shortest step between epochs so far
};

}  // namespace searvins::gnss
