// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The shared recordings as rover epochs, base epochs, ephemerides and truth, and a run of the Differencer over them that scores every
/// single difference against the truth positions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <searvins/gnss/double_difference.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>

namespace searvins::test {

/// One recording. `truth` maps a rover tag to the antenna position; absent where the truth is.
struct Recording {
  std::vector<gnss::ObservationEpoch> rover, base;
  std::unique_ptr<gnss::EphemerisStore<1024>> store{std::make_unique<gnss::EphemerisStore<1024>>()};
  Eigen::Vector3d base_e_m{Eigen::Vector3d::Zero()};
  std::optional<Eigen::Vector3d> fixed_e_m;
  std::vector<std::pair<GpsTime, Eigen::Vector3d>> track;
  double clock_s{0};  ///< rover tag minus GPS time, good to what the speed asks for

  [[nodiscard]] std::optional<Eigen::Vector3d> truth(GpsTime tag) const {
    if (fixed_e_m) return fixed_e_m;
    const GpsTime t = tag.plus_seconds(-clock_s);
    const auto after = std::lower_bound(track.begin(), track.end(), t, [](const auto& row, GpsTime at) { return row.first < at; });
    if (after != track.end() && std::abs(seconds_between(t, after->first)) < 1e-6) return after->second;
    if (after == track.end() || after == track.begin()) return std::nullopt;
    const auto before = std::prev(after);
    const double step_s = seconds_between(before->first, after->first), f = seconds_between(before->first, t) / step_s;
    if (step_s > 0.15 && std::min(f, 1 - f) * step_s > 1e-3) return std::nullopt;  // 1 Hz rows are not for interpolation
    return Eigen::Vector3d{before->second + f * (after->second - before->second)};
  }
};

inline std::vector<gnss::ObservationEpoch> read_epochs(const std::filesystem::path& path) {
  return io::read_rinex_observation(path).value.epochs;
}

inline void read_navigation(Recording& r, const std::filesystem::path& path) {
  const auto file = io::read_rinex_navigation(path);
  for (const gnss::Ephemeris& e : file.value.ephemerides) r.store->insert(e);
  if (!r.store->ionosphere.present()) r.store->ionosphere = file.value.ionosphere;
}

/// Rows of numbers, separated by commas; the columns of time and position are named by the caller. Lines that do not begin with a number
/// are left.
inline void read_track(Recording& r, const std::filesystem::path& path, std::int64_t week, std::size_t time_column,
                       std::size_t position_column) {
  std::ifstream file{path};
  for (std::string line; std::getline(file, line);) {
    std::vector<double> v;
    std::stringstream cells{line};
    for (std::string cell; std::getline(cells, cell, ',');) v.push_back(std::atof(cell.c_str()));
    if (line.empty() || (line[0] != '-' && (line[0] < '0' || line[0] > '9')) || v.size() < position_column + 3) continue;
    r.track.push_back({GpsTime::from_week_sow(week, v[time_column]), {v[position_column], v[position_column + 1], v[position_column + 2]}});
  }
}

inline Recording nagoya_static(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/nagoya_static_2024";
  Recording r;
  r.rover = read_epochs(d / "rover.obs"), r.base = read_epochs(d / "base.obs");
  read_navigation(r, d / "base.nav");
  r.base_e_m = {-3817681.1213, 3562839.4311, 3650159.1593};
  r.fixed_e_m = Eigen::Vector3d{-3817681.3807, 3562839.9785, 3650158.3760};
  return r;
}

inline Recording sf_static(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/sf_static_2017";
  Recording r;
  r.rover = read_epochs(d / "rover.obs"), r.base = read_epochs(d / "base.obs");
  read_navigation(r, d / "rover.nav");
  r.base_e_m = {-2706105.2018, -4261210.8062, 3885598.6411};
  r.fixed_e_m = Eigen::Vector3d{-2706111.3408, -4261210.5240, 3885594.5989};
  return r;
}

inline Recording geonet_static(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/geonet_static_2005";
  Recording r;
  r.rover = read_epochs(d / "07590920.05o"), r.base = read_epochs(d / "30400920.05o");
  read_navigation(r, d / "07590920.05n");
  r.base_e_m = {-3978241.958, 3382840.234, 3649900.853};
  r.fixed_e_m = Eigen::Vector3d{-3976219.1878, 3382371.6057, 3652511.1424};
  return r;
}

inline Recording kamakura_drive(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/kamakura_drive_2021";
  Recording r;
  r.rover = read_epochs(d / "rover.obs"), r.base = read_epochs(d / "base.obs");
  read_navigation(r, d / "nav.rnx");
  r.base_e_m = {-3959400.631, 3385704.533, 3667523.111};
  read_track(r, d / "reference.csv", 2176, 1, 2);
  return r;
}

inline Recording spirent_rose(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/spirent_rose_iono-Klob";
  Recording r;
  r.rover = read_epochs(d / "rover.obs"), r.base = read_epochs(d / "base.obs");
  read_navigation(r, d / "nav_gps.rnx");
  read_navigation(r, d / "nav_gal.rnx");
  r.base_e_m = {4157177.06580187, 671230.476590636, 4774767.03105544};
  read_track(r, d / "reference.csv", 2244, 1, 2);
  return r;
}

inline Recording twin(const std::filesystem::path& shared, const std::string& name) {
  const auto d = shared / "data/twin" / name;
  Recording r;
  r.rover = read_epochs(d / "rover.obs"), r.base = read_epochs(d / "base.obs");
  read_navigation(r, d / "base.nav");
  r.base_e_m = {-3817680.7301, 3562839.5234, 3650159.2418};
  r.clock_s = 1.4e-4;
  read_track(r, d / "truth.csv", 2323, 0, 1);
  return r;
}

/// What a run over a recording came to.
struct Score {
  int epochs{0}, groups{0}, fallback_pivots{0}, pivot_changes{0};
  long phases{0}, codes{0};
  double phase_rms_m{0}, phase_max_m{0};  ///< of double differences less the nearest integer
  double code_rms_m{0}, code_median_m{0};
  double doppler_rms_mps{0};  ///< between satellites, of a rover that stands still
  long comparable{0};         ///< phases with a usable phase at the previous epoch and nothing reported
  long verified{0}, unverified{0}, false_alarms{0}, true_slips{0}, missed{0};
  long labelled{0}, labelled_slips{0},
      labelled_missed{0};  ///< of the events given: compared at all, with a jump of the phase, verified all the same
  std::array<long, gnss::kSlipCauses> causes{};
  std::array<long, gnss::kRejections> rejected{};
};

/// A true event of the twin's phases: time of week in milliseconds, satellite "G10", signal "1C".
struct PhaseEvent {
  long long sow_ms;
  std::string satellite, signal;
  friend auto operator<=>(const PhaseEvent&, const PhaseEvent&) = default;
};

/// All events of one kind ("uslip", "slip", "half", "hidden_half") in gnss_labels.json.
inline std::set<PhaseEvent> phase_events(const std::filesystem::path& labels, const std::string& kind) {
  std::ifstream file{labels};
  const std::string text{std::istreambuf_iterator<char>{file}, {}};
  const std::string quoted = '"' + kind + '"';
  std::set<PhaseEvent> events;
  for (std::size_t at = text.find(quoted); at != std::string::npos; at = text.find(quoted, at + 1)) {
    const std::size_t epoch = text.rfind("\"t\":", at);
    if (epoch == std::string::npos) continue;  // a legend
    const std::size_t signal = text.rfind("\":[", at) - 2, object = text.rfind('{', at), satellite = text.rfind("\":[", object) - 3;
    events.insert({std::llround(std::atof(text.c_str() + epoch + 4) * 1000), text.substr(satellite, 3), text.substr(signal, 2)});
  }
  return events;
}

/// The event that a signal would be labelled with.
inline PhaseEvent event_of(GpsTime tag, const gnss::CorrectedSignal& s) {
  const int number = s.satellite.number;
  return {std::llround(tag.sow() * 1000),
          {gnss::letter_of(s.satellite.constellation), static_cast<char>('0' + number / 10), static_cast<char>('0' + number % 10)},
          {s.rover_signal.band, s.rover_signal.attribute}};
}

/// Runs the Differencer over a recording, predicting the rover at `offset_e_m` from the truth, and scores it; `events`: labelled slips to
/// look at.
inline Score run(const Recording& r, const gnss::DifferencingOptions& options,
                 const Eigen::Vector3d& offset_e_m = Eigen::Vector3d{3, -4, 2}, const std::set<PhaseEvent>& events = {}) {
  using namespace gnss;
  auto differencer = std::make_unique<Differencer>();
  auto out = std::make_unique<DifferencedEpoch>();
  auto base = std::make_unique<BaseBuffer<>>();
  (void)base->set_position(r.base_e_m);
  Score score;
  std::vector<double> code_errors;
  double phase_sum = 0, code_sum = 0, doppler_sum = 0, doppler_count = 0;
  std::map<std::pair<SatelliteId, SignalCode>, double> before, now;  // phase less true range
  std::size_t next_base = 0;
  for (const ObservationEpoch& epoch : r.rover) {
    const double ahead_s = options.base.mode == BaseMode::interpolate ? options.base.latency_s : options.base.match_tolerance_s;
    while (next_base < r.base.size() && seconds_between(epoch.tag, r.base[next_base].tag) <= ahead_s) {
      (void)base->push(r.base[next_base++]);
      if (options.base.mode == BaseMode::interpolate && r.base[next_base - 1].tag > epoch.tag) break;
    }
    const auto truth = r.truth(epoch.tag);
    if (!truth || !differencer->difference(epoch, *base, *r.store, *truth + offset_e_m, options, *out) || !out->base_status.ok()) continue;
    ++score.epochs;
    now.clear();
    const auto less_range = [&](const CorrectedSignal& s, double value_m) { return value_m - range_m(*truth, s.satellite_e_m); };
    for (const SignalGroup& g : out->groups) {
      ++score.groups;
      score.fallback_pivots += g.pivot_fallback ? 1 : 0;
      score.pivot_changes += g.pivot_changed ? 1 : 0;
      const CorrectedSignal& p = out->signals[static_cast<std::size_t>(g.pivot)];
      for (const std::uint16_t i : g.candidates) {
        const CorrectedSignal& s = out->signals[i];
        const double code_m = less_range(s, s.code_m) - less_range(p, p.code_m),
                     phase_m = less_range(s, s.phase_m) - less_range(p, p.phase_m);
        code_sum += code_m * code_m, ++score.codes;
        code_errors.push_back(std::abs(code_m));
        if (!std::isfinite(phase_m)) continue;
        const double rest_m = std::remainder(phase_m, s.wavelength_m);
        phase_sum += rest_m * rest_m, ++score.phases;
        score.phase_max_m = std::max(score.phase_max_m, std::abs(rest_m));
      }
    }
    for (const DopplerMeasurement& m : out->doppler) {
      const double rate_mps = m.rate_mps - out->doppler[static_cast<std::size_t>(out->doppler_pivot)].rate_mps;
      doppler_sum += rate_mps * rate_mps, ++doppler_count;
    }
    std::vector<double> changes;
    for (const CorrectedSignal& s : out->signals) {
      if (!std::isfinite(s.phase_m)) continue;
      now[{s.satellite, s.rover_signal}] = less_range(s, s.phase_m);
      if (const auto old = before.find({s.satellite, s.rover_signal}); old != before.end())
        changes.push_back(less_range(s, s.phase_m) - old->second);
    }
    if (!changes.empty()) {
      std::nth_element(changes.begin(), changes.begin() + static_cast<long>(changes.size() / 2), changes.end());
      const double clock_m = changes[changes.size() / 2];
      for (const CorrectedSignal& s : out->signals) {
        const auto old = before.find({s.satellite, s.rover_signal});
        ++score.causes[static_cast<std::size_t>(s.cause)];
        if (!std::isfinite(s.phase_m) || old == before.end()) continue;
        const bool tested = s.cause == SlipCause::none || s.cause == SlipCause::geometry_free || s.cause == SlipCause::triple_difference ||
                            s.cause == SlipCause::doppler || s.cause == SlipCause::single_frequency;
        if (!tested) continue;
        ++score.comparable;
        const double jump_m = std::abs(now[{s.satellite, s.rover_signal}] - old->second - clock_m);
        const bool slipped = jump_m > 0.4 * s.wavelength_m;
        score.verified += s.continuity == Continuity::verified ? 1 : 0;
        score.unverified += s.continuity == Continuity::unverified ? 1 : 0;
        score.true_slips += slipped ? 1 : 0;
        score.missed += slipped && s.continuity == Continuity::verified ? 1 : 0;
        score.false_alarms += !slipped && s.continuity == Continuity::broken ? 1 : 0;
        const bool labelled = !events.empty() && events.count(event_of(epoch.tag, s)) > 0;
        score.labelled += labelled ? 1 : 0;
        score.labelled_slips += labelled && slipped ? 1 : 0;
        score.labelled_missed += labelled && slipped && s.continuity == Continuity::verified ? 1 : 0;
      }
    }
    before = now;
    for (std::size_t i = 0; i < kRejections; ++i) score.rejected[i] += out->rejected[i];
  }
  score.phase_rms_m = std::sqrt(phase_sum / static_cast<double>(std::max(score.phases, 1L)));
  score.code_rms_m = std::sqrt(code_sum / static_cast<double>(std::max(score.codes, 1L)));
  if (doppler_count > 0) score.doppler_rms_mps = std::sqrt(doppler_sum / doppler_count);
  if (!code_errors.empty()) {
    std::nth_element(code_errors.begin(), code_errors.begin() + static_cast<long>(code_errors.size() / 2), code_errors.end());
    score.code_median_m = code_errors[code_errors.size() / 2];
  }
  return score;
}

}  // namespace searvins::test
