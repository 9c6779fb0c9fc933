// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A simulated receiver: its clock, what it tracks and what it measures.
///
/// At the clock reading T (the tag) GPS time is t with t + d(t) = T, d the clock offset. A signal of carrier f then measures, in metres,
///
///     code      rho + extra + c d - c (satellite clock - group delay) + troposphere + ionosphere (f1 / f)^2 + noise
///     phase     rho + extra + c d - c (satellite clock - group delay) + troposphere - ionosphere (f1 / f)^2 + lambda (N + bias) + noise
///     Doppler   - d(phase) / d(T) / lambda
///
/// N is an integer, drawn anew whenever the signal is found again or its path changes between direct and reflected; the loss of lock is
/// flagged then. Weak reflections have no phase. An unresolved half cycle adds 1/2 and is flagged.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "orbit.hpp"
#include "random.hpp"
#include "world.hpp"

namespace searvins::simulator {

/// A signal by its RINEX code, with what distinguishes it.
struct Signal {
  char system;
  const char* code;  ///< "1C"
  double frequency_hz, cn0_offset_db;
};
inline constexpr Signal kSignals[] = {{'G', "1C", 1575.42e6, 0},
                                      {'G', "2W", 1227.60e6, -6},
                                      {'E', "1C", 1575.42e6, 0},
                                      {'E', "7Q", 1207.14e6, 1},
                                      {'C', "2I", 1561.098e6, -1}};

/// A reflection weaker than this is not locked in phase, dB-Hz.
inline constexpr double kPhaseLockDbhz = 38;

/// What a receiver says about a signal, in RINEX's units.
struct Measurement {
  const Signal* signal{nullptr};
  double code_m{0}, phase_cycles{0}, doppler_hz{0}, cn0_dbhz{0};
  bool has_code{true}, has_phase{true};  ///< without a code the signal is not tracked at all
  int lli{0};
};

/// All signals of one satellite.
struct SatelliteMeasurements {
  char system{'G'};
  int number{0};
  std::vector<Measurement> signals;
};

/// One epoch; the tag is in seconds since the start of the recording.
struct Epoch {
  double tag_s{0};
  std::vector<SatelliteMeasurements> satellites;
};

/// An offset of the receiver clock: constant, drift and a slow swing.
struct Clock {
  double offset_s{0}, drift_sps{0}, swing_s{0};
  [[nodiscard]] double at(double t_s) const { return offset_s + drift_sps * t_s + swing_s * std::sin(t_s / 9); }
  /// GPS time at which the clock shows `reading_s`.
  [[nodiscard]] double gps_time_s(double reading_s) const {
    double t = reading_s;
    for (int i = 0; i < 6; ++i) t = reading_s - at(t);
    return t;
  }
};

/// Something that goes wrong with the phase of one signal at a tag.
struct PhaseEvent {
  double from_s{0}, to_s{1e9};  ///< the step holds from ... until (not included)
  char system{'G'};
  int number{0};
  const char* code{""};
  double cycles{0};
  int lli{0};  ///< bits in the record: 1 at from_s only, 2 as long as it holds
};

/// Where a receiver is and how well it does.
struct ReceiverPlan {
  std::function<Eigen::Vector3d(double)> position_e_m;                 ///< antenna at GPS time
  std::function<std::optional<Street>(double)> street = {};            ///< the walls around it; none: open sky
  std::function<bool(double)> covered = [](double) { return false; };  ///< under a bridge: no satellite at all
  Clock clock{};
  double mask_rad{0};
  std::vector<PhaseEvent> events{};
};

/// Makes the measurements of a receiver, one epoch after the other.
class Receiver {
 public:
  Receiver(ReceiverPlan plan, const std::vector<Orbit>& orbits, std::uint64_t seed)
      : plan_(std::move(plan)), orbits_(orbits), random_(seed) {
    for (double& bias : bias_cycles_) bias = random_.uniform(-0.5, 0.5);
  }

  [[nodiscard]] Epoch measure(double tag_s) {
    Epoch epoch{tag_s, {}};
    const double t_s = plan_.clock.gps_time_s(tag_s);
    for (const Orbit& orbit : orbits_) {
      const Flight flight = flight_of(orbit, plan_.position_e_m(t_s), t_s);
      const std::optional<Street> street = plan_.street ? plan_.street(t_s) : std::nullopt;
      Path path = street ? street->path(flight.line) : Path::direct;
      if (path == Path::reflected && !facade_reflects(orbit, t_s)) path = Path::blocked;
      if (flight.line.elevation_rad < plan_.mask_rad || plan_.covered(t_s)) path = Path::blocked;
      SatelliteMeasurements satellite{orbit.system, orbit.number, {}};
      for (std::size_t i = 0; i < std::size(kSignals); ++i) {
        if (kSignals[i].system != orbit.system) continue;
        Track& track = tracks_[{&orbit, i}];
        if (path == Path::blocked)
          track.path = Path::blocked;
        else
          satellite.signals.push_back(measure(orbit, i, track, path, tag_s, flight.line.elevation_rad, street.has_value()));
      }
      if (!satellite.signals.empty()) epoch.satellites.push_back(std::move(satellite));
    }
    return epoch;
  }

 private:
  struct Track {
    Path path{Path::blocked};
    bool lost{false};  // lock was lost since the last phase
    double ambiguity_cycles{0};
    double code_multipath{0}, phase_multipath{0};  // unit variance, correlated over some seconds
  };
  struct Metres {
    double code, phase;
  };

  /// Whether the place of the facade where a reflection lies reflects at all: stretches of some seconds, another for each satellite.
  [[nodiscard]] static bool facade_reflects(const Orbit& orbit, double t_s) { return std::sin(0.4 * t_s + 2.4 * orbit.number) > 0.2; }

  /// Code and phase without noise and ambiguity, metres.
  [[nodiscard]] Metres model(const Orbit& orbit, const Signal& signal, bool reflected, double tag_s) const {
    const double t_s = plan_.clock.gps_time_s(tag_s);
    const Eigen::Vector3d p_e_m = plan_.position_e_m(t_s);
    const geodesy::Geodetic place = geodesy::geodetic_from_ecef(p_e_m);
    const Flight flight = flight_of(orbit, p_e_m, t_s);
    const std::optional<Street> street = reflected ? plan_.street(t_s) : std::nullopt;
    const double extra_m = street ? street->extra_m(flight.line) : 0;
    const double ratio = 1575.42e6 / signal.frequency_hz, gamma = ratio * ratio;
    const double delay_s = (orbit.system == 'C' ? 1.0 : gamma) * orbit.delay_s;
    const double common_m = flight.length_m + extra_m + troposphere_m(place.height_m, flight.line.elevation_rad) +
                            kLightMps * (tag_s - t_s - satellite_clock_s(orbit, flight.transmitted_s) + delay_s);
    const double ionosphere_m = gamma * ionosphere_l1_m(place, flight.line);
    return {common_m + ionosphere_m, common_m - ionosphere_m};
  }

  [[nodiscard]] Measurement measure(const Orbit& orbit, std::size_t index, Track& track, Path path, double tag_s, double elevation_rad,
                                    bool in_street) {
    const Signal& signal = kSignals[index];
    const bool reflected = path == Path::reflected;
    Measurement m;
    m.signal = &signal;
    if (track.path != path) {
      track.path = path;
      track.ambiguity_cycles = static_cast<double>(random_.integer(-1'000'000, 1'000'000));
      track.lost = tag_s > 0;
    }
    m.cn0_dbhz = 36 + 13 * std::sqrt(std::sin(elevation_rad)) + signal.cn0_offset_db + 0.5 * random_.normal() - (reflected ? 10 : 0);
    const double weakness = std::pow(10, (45 - m.cn0_dbhz) / 20), correlation = 0.8, fresh = 0.6;
    track.code_multipath = correlation * track.code_multipath + fresh * random_.normal();
    track.phase_multipath = correlation * track.phase_multipath + fresh * random_.normal();
    const double code_noise_m = 0.2 * weakness * random_.normal() + (in_street ? 1.5 : 0.2) * track.code_multipath;
    const double phase_noise_m = 0.0012 * std::sqrt(weakness) * random_.normal() + (reflected   ? 0.03
                                                                                    : in_street ? 0.006
                                                                                                : 0.001) *
                                                                                       track.phase_multipath;

    const double wavelength_m = kLightMps / signal.frequency_hz, half_step_s = 0.005;
    const Metres now = model(orbit, signal, reflected, tag_s);
    const double ahead = model(orbit, signal, reflected, tag_s + half_step_s).phase;
    const double behind = model(orbit, signal, reflected, tag_s - half_step_s).phase;
    m.code_m = now.code + code_noise_m;
    m.has_phase = !reflected || m.cn0_dbhz > kPhaseLockDbhz;
    if (m.has_phase) m.lli = std::exchange(track.lost, false) ? 1 : 0;
    m.phase_cycles = (now.phase + phase_noise_m) / wavelength_m + track.ambiguity_cycles + bias_cycles_[index] +
                     event_cycles(orbit, signal, tag_s, m.lli);
    m.doppler_hz = -(ahead - behind) / (2 * half_step_s) / wavelength_m + (in_street ? 0.3 : 0.1) * random_.normal();
    return m;
  }

  [[nodiscard]] double event_cycles(const Orbit& orbit, const Signal& signal, double tag_s, int& lli) const {
    double cycles = 0;
    for (const PhaseEvent& e : plan_.events) {
      if (e.system != orbit.system || e.number != orbit.number || std::string{e.code} != signal.code) continue;
      if (tag_s < e.from_s || tag_s >= e.to_s) continue;
      cycles += e.cycles;
      lli |= (e.lli & 2) | (tag_s < e.from_s + 0.5 ? e.lli & 1 : 0);
    }
    return cycles;
  }

  ReceiverPlan plan_;
  const std::vector<Orbit>& orbits_;
  Random random_;
  std::array<double, std::size(kSignals)> bias_cycles_{};
  std::map<std::pair<const Orbit*, std::size_t>, Track> tracks_;
};

}  // namespace searvins::simulator
