// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What is in a RINEX file, at a glance: span, interval, gaps, satellites and signals per constellation, events, skipped lines with
/// reasons. For `searvins info`, and for a run that has to say why two files do not fit together.
///
/// The interval is the median of the differences of neighbouring tags; a gap is a difference of more than 1.5 intervals.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_kind.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>

namespace searvins::io {

/// How often a signal was seen, and with what.
struct SignalCount {
  gnss::SignalCode signal{};
  long observations{0};  ///< satellite-epochs
  long code{0}, phase{0}, doppler{0}, cn0{0};
  long loss_of_lock{0};
  double mean_cn0_dbhz{0};  ///< of those with C/N0; 0 when there is none
};

/// What a file holds of one constellation.
struct ConstellationCount {
  std::bitset<64> satellites{};      ///< numbers that were seen
  long observations{0};              ///< satellite-epochs
  std::vector<SignalCount> signals;  ///< in order of signal
};

/// A place where tags are further apart than the interval.
struct ObservationGap {
  GpsTime from{}, to{};  ///< last tag before, first tag after
};

/// What an observation file holds.
struct ObservationFileInfo {
  RinexObservationHeader header;
  ObservationReadSummary summary;
  double interval_s{0};       ///< 0 for fewer than two epochs
  double mean_satellites{0};  ///< per epoch, of the constellations that are modelled
  std::size_t least_satellites{0}, most_satellites{0};
  std::array<ConstellationCount, gnss::kConstellations> constellations{};
  std::vector<ObservationGap> gaps;  ///< the first kMaxGaps
  long gap_count{0};
  static constexpr std::size_t kMaxGaps = 100;
};

/// What a navigation file holds.
struct NavigationFileInfo {
  RinexFirstLine first_line;
  long records{0}, unhealthy{0};
  std::optional<GpsTime> first_toe, last_toe;
  std::array<std::bitset<64>, gnss::kConstellations> satellites{};  ///< numbers with at least one record
  std::array<long, 6> messages{};                                   ///< records by gnss::NavigationMessage
  gnss::KlobucharCoefficients ionosphere;
  std::optional<int> leap_seconds;
};

/// Any RINEX file: its sort, and the part that belongs to the sort.
struct RinexFileInfo {
  SniffedFile sniffed;
  std::optional<ObservationFileInfo> observation;
  std::optional<NavigationFileInfo> navigation;
};

namespace detail {

inline void count_signal(ConstellationCount& counts, const gnss::SignalObservation& s) {
  auto at = std::lower_bound(counts.signals.begin(), counts.signals.end(), s.signal,
                             [](const SignalCount& c, const gnss::SignalCode& code) { return c.signal < code; });
  if (at == counts.signals.end() || at->signal != s.signal) {
    at = counts.signals.insert(at, SignalCount{});
    at->signal = s.signal;
  }
  ++at->observations;
  at->code += s.has_code() ? 1 : 0;
  at->phase += s.has_phase() ? 1 : 0;
  at->doppler += s.has_doppler() ? 1 : 0;
  at->loss_of_lock += s.loss_of_lock ? 1 : 0;
  if (!s.has_cn0()) return;
  ++at->cn0;
  at->mean_cn0_dbhz += (s.cn0_dbhz - at->mean_cn0_dbhz) / static_cast<double>(at->cn0);
}

inline void count_epoch(ObservationFileInfo& info, const gnss::ObservationEpoch& epoch) {
  const std::size_t n = epoch.satellites.size();
  const bool first = info.most_satellites == 0 && info.mean_satellites == 0;
  info.least_satellites = first ? n : std::min(info.least_satellites, n);
  info.most_satellites = std::max(info.most_satellites, n);
  info.mean_satellites += static_cast<double>(n);  // the sum until the end of the scan
  for (const gnss::SatelliteObservation& satellite : epoch.satellites) {
    ConstellationCount& counts = info.constellations[static_cast<std::size_t>(satellite.satellite.constellation)];
    counts.satellites.set(satellite.satellite.number % 64U);
    ++counts.observations;
    for (const gnss::SignalObservation& s : satellite.signals) count_signal(counts, s);
  }
}

/// Interval and gaps from all tags.
inline void find_gaps(ObservationFileInfo& info, const std::vector<GpsTime>& tags) {
  if (tags.size() < 2) return;
  std::vector<double> steps;
  for (std::size_t i = 1; i < tags.size(); ++i) steps.push_back(seconds_between(tags[i - 1], tags[i]));
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  info.interval_s = *middle;
  for (std::size_t i = 1; i < tags.size(); ++i) {
    if (seconds_between(tags[i - 1], tags[i]) <= 1.5 * info.interval_s) continue;
    ++info.gap_count;
    if (info.gaps.size() < ObservationFileInfo::kMaxGaps) info.gaps.push_back({tags[i - 1], tags[i]});
  }
}

}  // namespace detail

/// Scans an observation file that is open in the reader.
[[nodiscard]] inline ObservationFileInfo scan_observations(RinexObservationReader& reader) {
  ObservationFileInfo info;
  std::vector<GpsTime> tags;
  gnss::ObservationEpoch epoch;
  info.header = reader.header();
  while (reader.next(epoch)) {
    tags.push_back(epoch.tag);
    detail::count_epoch(info, epoch);
  }
  info.summary = reader.summary();
  if (!tags.empty()) info.mean_satellites /= static_cast<double>(tags.size());
  detail::find_gaps(info, tags);
  return info;
}

/// Counts what a navigation file holds.
[[nodiscard]] inline NavigationFileInfo summarise_navigation(const RinexNavigationFile& file) {
  NavigationFileInfo info{file.first_line, 0, 0, {}, {}, {}, {}, file.ionosphere, file.leap_seconds};
  for (const gnss::Ephemeris& e : file.ephemerides) {
    ++info.records;
    info.unhealthy += e.health != 0 ? 1 : 0;
    ++info.messages[static_cast<std::size_t>(e.message)];
    info.satellites[static_cast<std::size_t>(e.satellite.constellation)].set(e.satellite.number % 64U);
    if (!info.first_toe || e.toe < *info.first_toe) info.first_toe = e.toe;
    if (!info.last_toe || e.toe > *info.last_toe) info.last_toe = e.toe;
  }
  return info;
}

/// What a RINEX file holds. For another sort of file `value.sniffed` tells which it is; compressed and unreadable files are errors.
[[nodiscard]] inline Parsed<RinexFileInfo> rinex_info(const std::filesystem::path& path) {
  Parsed<RinexFileInfo> info;
  info.value.sniffed = sniff(path);
  if (info.value.sniffed.kind == FileKind::rinex_observation) {
    RinexObservationReader reader;
    if (reader.open(path)) info.value.observation = scan_observations(reader);
    info.error = reader.error();
    info.skipped = reader.summary().skipped;
  } else if (info.value.sniffed.kind == FileKind::rinex_navigation) {
    Parsed<RinexNavigationFile> file = read_rinex_navigation(path);
    info.value.navigation = summarise_navigation(file.value);
    info.error = std::move(file.error);
    info.skipped = std::move(file.skipped);
  } else {
    TextReader reader;
    info.error = reader.open(path);
    if (!info.error) info.error = refuse_compressed(info.value.sniffed.kind, path.string());
  }
  return info;
}

}  // namespace searvins::io
