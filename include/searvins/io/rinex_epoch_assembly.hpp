// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From the satellites that a RINEX epoch listed, in any order and number, to a gnss::ObservationEpoch: sorted, each satellite once, no
/// more than fit. A loss of lock in an epoch that had to be skipped is not lost with it: the next epoch that has the signal carries it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <searvins/gnss/observation.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/rinex_satellite_line.hpp>

namespace searvins::io {

/// Gathers the satellites of one epoch after another.
class EpochAssembler {
 public:
  /// Forgets everything, skipped epochs included.
  void reset() {
    satellites_.clear();
    lost_locks_.clear();
    lost_power_ = false;
  }

  /// Starts an epoch.
  void begin(bool power_failure) {
    satellites_.clear();
    lost_power_ = lost_power_ || power_failure;
  }

  /// Adds a satellite; one without any signal is left out.
  void add(const gnss::SatelliteObservation& satellite) {
    if (!satellite.signals.empty()) satellites_.push_back(satellite);
  }

  /// Gives the epoch up and keeps in mind which signals lost lock in it.
  void skip() {
    for (const gnss::SatelliteObservation& satellite : satellites_)
      for (const gnss::SignalObservation& s : satellite.signals)
        if (s.loss_of_lock && lost_locks_.size() < kMaxLostLocks) lost_locks_.emplace_back(satellite.satellite, s.signal);
    satellites_.clear();
  }

  /// Writes the epoch. `line` is for the log. Of a satellite listed twice the first counts; where there are more than fit, the least
  /// informative go.
  void finish(GpsTime tag, long line, SkipLog& log, gnss::ObservationEpoch& out) {
    std::stable_sort(satellites_.begin(), satellites_.end(), [](const auto& a, const auto& b) { return a.satellite < b.satellite; });
    const auto again =
        std::unique(satellites_.begin(), satellites_.end(), [](const auto& a, const auto& b) { return a.satellite == b.satellite; });
    for (auto it = again; it != satellites_.end(); ++it) log.add("satellite stands twice in an epoch", line);
    satellites_.erase(again, satellites_.end());
    while (satellites_.size() > gnss::kMaxSatellitesPerEpoch) {
      const auto tells_less = [](const auto& a, const auto& b) { return information(a) < information(b); };
      satellites_.erase(std::min_element(satellites_.begin(), satellites_.end(), tells_less));
      log.add("more satellites than an epoch holds: the least informative is dropped", line);
    }
    out.tag = tag;
    out.power_failure = std::exchange(lost_power_, false);
    out.satellites.clear();
    for (const gnss::SatelliteObservation& satellite : satellites_) (void)out.satellites.push_back(satellite);
    pass_on_lost_locks(out);
  }

 private:
  static constexpr std::size_t kMaxLostLocks = 1024;

  void pass_on_lost_locks(gnss::ObservationEpoch& out) {
    for (const auto& [id, signal] : lost_locks_)
      for (gnss::SatelliteObservation& satellite : out.satellites)
        for (gnss::SignalObservation& s : satellite.signals)
          if (satellite.satellite == id && s.signal == signal) s.loss_of_lock = true;
    lost_locks_.clear();
  }

  std::vector<gnss::SatelliteObservation> satellites_;
  std::vector<std::pair<gnss::SatelliteId, gnss::SignalCode>> lost_locks_;
  bool lost_power_{false};
};

}  // namespace searvins::io
