// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A receiver in a city: what reaches it, what it keeps lock on, what it measures, and the truth about every signal.
///
/// Each satellite comes by its direct ray (clear, bent over a roof, thinned by leaves) and by its best reflection. The stronger of the two
/// is tracked, the weaker disturbs it. With the amplitude ratio a < 1 and the relative delay D of the weaker one,
/// phi = 2 pi D / lambda + phi_0:
///
///     code error    g_c a d cos(phi) / (1 + a cos(phi))          d: D limited by the correlator's spacing, 0 beyond a chip
///     phase error   g_p lambda / (2 pi) atan2(a sin(phi), 1 + a cos(phi))          signal strength   |1 + a exp(i phi)|
///
/// A moving antenna sees phi turn at f = |dD/dt| / lambda; loops of bandwidth B average that away: g = 1 / sqrt(1 + (f / B)^2). To this
/// comes diffuse multipath, a first-order Gauss-Markov process in way (4 m) and time (30 s), and noise by strength.
///
/// Lock is followed five times a second: it is lost below a threshold and found again after a random time; a jump between rays breaks the
/// phase mostly, else it slips; slips and half cycles happen by chance, flagged or not. The measurements themselves are made as in
/// receiver.hpp, the way of the tracked ray being longer than the direct one by its extra path.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>

#include "city.hpp"
#include "orbit.hpp"
#include "propagation.hpp"
#include "random.hpp"
#include "receiver.hpp"
#include "world.hpp"

namespace searvins::simulator {

/// What a signal is in truth.
enum class SignalState : std::uint8_t { los, diffracted, nlos, blocked };
inline constexpr std::array<const char*, 4> kSignalStateNames{"los", "diffracted", "nlos", "blocked"};

/// What happened to the phase at an epoch.
enum class PhaseHappening : std::uint8_t { none, new_lock, silent_lock, slip, silent_slip, half_cycle, silent_half_cycle };
inline constexpr std::array<const char*, 7> kPhaseHappeningNames{"", "lock", "silent_lock", "slip", "silent_slip", "half", "silent_half"};

/// The truth about one signal at one epoch.
struct SignalLabel {
  double tag_s{0};
  char system{'G'};
  int number{0};
  const char* code{""};
  SignalState state{SignalState::blocked};
  double extra_m{0}, loss_db{0};                     ///< of the tracked ray
  double code_multipath_m{0}, phase_multipath_m{0};  ///< of the weaker ray and the diffuse part
  double azimuth_rad{0}, elevation_rad{0}, cn0_dbhz{0};
  bool has_code{false}, has_phase{false};
  int lli{0};
  PhaseHappening happening{PhaseHappening::none};
};

/// Where a receiver is.
struct CityReceiverPlan {
  std::function<Eigen::Vector3d(double)> antenna_w_m;  ///< at seconds since the start
  geodesy::LocalFrame frame{};
  const City* city{nullptr};  ///< none: open sky
  std::function<District(double)> district = [](double) { return District::open; };
  Clock clock{};
  double mask_rad{10 * std::numbers::pi / 180};
  bool slips_by_chance{true};
};

/// Makes the measurements of a receiver, one epoch after the other.
class CityReceiver {
 public:
  CityReceiver(CityReceiverPlan plan, const std::vector<Orbit>& orbits, std::uint64_t seed)
      : plan_(std::move(plan)), orbits_(orbits), random_(seed), channels_(orbits.size()) {
    for (double& bias : phase_bias_cycles_) bias = random_.uniform(-0.5, 0.5);
    for (double& bias : code_bias_m_) bias = random_.uniform(-0.8, 0.8);
    for (Channel& channel : channels_) channel.strength_db = random_.normal();
  }

  /// The epoch of a tag; tags rise.
  [[nodiscard]] Epoch measure(double tag_s) {
    Epoch epoch{tag_s, {}};
    labels_.clear();
    const double t_s = plan_.clock.gps_time_s(tag_s);
    find_satellites(t_s);
    const double from_s = first_ ? t_s : last_s_;
    const int steps = first_ ? 1 : static_cast<int>(std::ceil((t_s - from_s) / kStepS - 1e-3));
    for (int i = 1; i <= steps; ++i) follow(from_s + (t_s - from_s) * i / steps, (t_s - from_s) / steps);
    first_ = false, last_s_ = t_s;
    for (std::size_t s = 0; s < orbits_.size(); ++s) {
      if (!channels_[s].is_up) continue;
      SatelliteMeasurements satellite{orbits_[s].system, orbits_[s].number, {}};
      bool tracked = false;
      const std::array<Geometry, 3> geometry{geometry_at(orbits_[s], tag_s - kHalfStepS), geometry_at(orbits_[s], tag_s),
                                             geometry_at(orbits_[s], tag_s + kHalfStepS)};
      for (std::size_t i = 0; i < std::size(kSignals); ++i) {
        if (kSignals[i].system != orbits_[s].system) continue;
        satellite.signals.push_back(measure_signal(s, i, tag_s, geometry));
        tracked = tracked || satellite.signals.back().has_code;
      }
      if (tracked) epoch.satellites.push_back(std::move(satellite));
    }
    return epoch;
  }

  /// The truth about every signal above the mask at the last epoch.
  [[nodiscard]] const std::vector<SignalLabel>& labels() const { return labels_; }

 private:
  static constexpr double kStepS = 0.2, kHalfStepS = 0.005;
  static constexpr double kCodeDbhz = 23, kPhaseDbhz = 28.5, kHysteresisDb = 1, kL1ForL2wDbhz = 33;
  static constexpr double kCodeLoopHz = 0.5, kPhaseLoopHz = 15, kSpacingM = 12;

  struct Track {
    bool has_code{false}, has_phase{false}, is_flagged{false};
    double code_at_s{-1}, phase_at_s{-1};  // when lock is found again
    double ambiguity_cycles{0};
    double half_cycle_until_s{-1}, half_cycles{0};
    bool half_is_silent{false};
    double code_diffuse{0}, phase_diffuse{0};
    double cn0_dbhz{0}, code_multipath_m{0}, phase_multipath_m{0}, loss_db{0};
    PhaseHappening happening{PhaseHappening::none};
  };
  struct Channel {
    bool is_up{false};
    double strength_db{0};
    geodesy::AzimuthElevation line{};
    Eigen::Vector3d u{Eigen::Vector3d::Zero()};
    long ray{-1};  // wall of the tracked reflection, -1: direct
    SignalState state{SignalState::blocked};
    double extra_m{0}, extra_rate_mps{0};
    std::array<Track, std::size(kSignals)> tracks{};
  };
  /// What all signals of a satellite share at an instant.
  struct Geometry {
    double common_m{0}, ionosphere_l1_m{0};
  };

  void find_satellites(double t_s) {
    const Eigen::Vector3d p_e_m = plan_.frame.to_ecef(plan_.antenna_w_m(t_s));
    for (std::size_t s = 0; s < orbits_.size(); ++s) {
      Channel& channel = channels_[s];
      const Flight flight = flight_of(orbits_[s], p_e_m, t_s);
      channel.line = flight.line;
      const bool up = flight.line.elevation_rad >= plan_.mask_rad;
      if (!up) channel.tracks = {}, channel.ray = -1;
      channel.is_up = up;
      const double tau_s = flight.length_m / kLightMps;
      const Eigen::Vector3d seen_e_m =
          Eigen::AngleAxisd(-kEarthRateRadps * tau_s, Eigen::Vector3d::UnitZ()) * satellite_position_e_m(orbits_[s], t_s - tau_s);
      channel.u = plan_.frame.R_ew.transpose() * (seen_e_m - p_e_m).normalized();
    }
  }

  /// What arrives and what stays locked at an instant, dt after the one before.
  void follow(double t_s, double dt_s) {
    const Eigen::Vector3d p = plan_.antenna_w_m(t_s), v = (plan_.antenna_w_m(t_s + 0.02) - plan_.antenna_w_m(t_s - 0.02)) / 0.04;
    const City& city = plan_.city ? *plan_.city : nothing_;
    const Surroundings around(city, p);
    const District district = plan_.district(t_s);
    for (std::size_t s = 0; s < orbits_.size(); ++s) {
      Channel& channel = channels_[s];
      if (!channel.is_up) continue;
      const DirectRay direct = around.direct(channel.u);
      const std::optional<Reflection> mirror = around.reflection(channel.u);
      const double wave_m = kLightMps / 1575.42e6;
      const double mirror_db = mirror ? mirror->loss_db : 99;
      const bool by_mirror = mirror_db < direct_loss_db(direct, wave_m);
      const long ray = by_mirror ? static_cast<long>(mirror->wall) : -1;
      const bool jumps = ray != channel.ray && !first_;
      const double mirror_rate_mps =
          mirror ? 2 * channel.u.head<2>().dot(city.walls[mirror->wall].normal) * v.head<2>().dot(city.walls[mirror->wall].normal) : 0;
      const double extra_m = by_mirror ? mirror->extra_m : direct.is_clear ? 0 : direct.detour_m;
      const double jump_m = extra_m - channel.extra_m;
      channel.ray = ray, channel.extra_m = extra_m, channel.extra_rate_mps = by_mirror ? mirror_rate_mps : 0;
      channel.state = by_mirror ? SignalState::nlos : direct.is_clear ? SignalState::los : SignalState::diffracted;
      for (std::size_t i = 0; i < std::size(kSignals); ++i) {
        if (kSignals[i].system != orbits_[s].system) continue;
        Track& track = channel.tracks[i];
        receive(channel, track, i, direct, mirror, by_mirror, mirror_rate_mps);
        drift(track, district, channel.state, v.norm() * dt_s, dt_s);
        keep_lock(channel, track, i, t_s, dt_s, district, jumps, jump_m);
      }
    }
  }

  [[nodiscard]] static double direct_loss_db(const DirectRay& ray, double wavelength_m) {
    if (ray.is_dark) return 90;
    return ray.foliage_db + (ray.is_clear ? 0 : knife_edge_loss_db(ray.detour_m, wavelength_m));
  }

  /// Strength, and what the weaker ray does to the stronger one.
  void receive(const Channel& channel, Track& track, std::size_t index, const DirectRay& direct, const std::optional<Reflection>& mirror,
               bool by_mirror, double mirror_rate_mps) {
    const double wave_m = kLightMps / kSignals[index].frequency_hz;
    const double direct_db = direct_loss_db(direct, wave_m), mirror_db = mirror ? mirror->loss_db : 99;
    track.loss_db = by_mirror ? mirror_db : direct_db;
    const double ratio = std::min(std::pow(10, -std::abs(mirror_db - direct_db) / 20), 0.95);
    const double delay_m = mirror ? (mirror->extra_m - direct.detour_m) * (by_mirror ? -1 : 1) : 0;
    const double fade_hz = std::abs(mirror_rate_mps) / wave_m, size_m = std::abs(delay_m);
    const auto gain = [fade_hz](double loop_hz) { return 1 / std::sqrt(1 + fade_hz * fade_hz / (loop_hz * loop_hz)); };
    const double phi = 2 * std::numbers::pi * (delay_m / wave_m + (mirror ? 0.61803398875 * static_cast<double>(mirror->wall) : 0));
    const double in_phase = 1 + ratio * std::cos(phi), quadrature = ratio * std::sin(phi);
    const double seen_m = std::copysign(std::min(size_m, kSpacingM), delay_m) * std::clamp((250 - size_m) / 100, 0.0, 1.0);
    track.code_multipath_m = mirror ? std::clamp(gain(kCodeLoopHz) * ratio * seen_m * std::cos(phi) / in_phase, -kSpacingM, kSpacingM) : 0;
    track.phase_multipath_m = mirror ? gain(kPhaseLoopHz) * wave_m / (2 * std::numbers::pi) * std::atan2(quadrature, in_phase) : 0;
    const double fading_db = mirror ? gain(1.0) * 20 * std::log10(std::hypot(in_phase, quadrature)) : 0;
    // Semi-codeless tracking of 2W loses twice what the signal loses.
    const double twice = kSignals[index].cn0_offset_db < -3 ? 1.6 : 1;
    track.cn0_dbhz = 36 + 14 * std::pow(std::sin(channel.line.elevation_rad), 0.7) + channel.strength_db + kSignals[index].cn0_offset_db -
                     twice * track.loss_db + fading_db + 0.4 * random_.normal();
  }

  /// The diffuse multipath, unit variance each.
  void drift(Track& track, District district, SignalState state, double way_m, double dt_s) {
    const double correlation = first_ ? 0 : std::exp(-way_m / 4 - dt_s / 30), fresh = std::sqrt(1 - correlation * correlation);
    track.code_diffuse = correlation * track.code_diffuse + fresh * random_.normal();
    track.phase_diffuse = correlation * track.phase_diffuse + fresh * random_.normal();
    constexpr std::array<double, 3> kCodeM{0.12, 0.35, 0.7}, kPhaseM{0.001, 0.0018, 0.003};
    const auto at = static_cast<std::size_t>(district);
    const double more = state == SignalState::los ? 1 : 2;
    track.code_multipath_m += more * kCodeM[at] * track.code_diffuse;
    track.phase_multipath_m += more * kPhaseM[at] * track.phase_diffuse;
  }

  void keep_lock(const Channel& channel, Track& track, std::size_t index, double t_s, double dt_s, District district, bool jumps,
                 double jump_m) {
    const bool needs_l1 = kSignals[index].cn0_offset_db < -3;
    const bool is_starved = needs_l1 && channel.tracks[0].cn0_dbhz < kL1ForL2wDbhz;
    const bool starts = first_;
    if (track.cn0_dbhz < kCodeDbhz || is_starved) track.has_code = false, track.code_at_s = -1;
    if (!track.has_code && !is_starved && track.cn0_dbhz > kCodeDbhz + kHysteresisDb) {
      if (track.code_at_s < 0) track.code_at_s = starts ? t_s : t_s + random_.uniform(0.3, 1.5);
      track.has_code = t_s >= track.code_at_s;
    }
    if (!track.has_code || track.cn0_dbhz < kPhaseDbhz) lose_phase(track);
    if (jumps && track.has_phase) jump(track, index, jump_m, t_s);
    if (track.has_code && !track.has_phase && track.cn0_dbhz > kPhaseDbhz + kHysteresisDb) {
      if (track.phase_at_s < 0) track.phase_at_s = starts ? t_s : t_s + random_.uniform(0.6, 2.8);
      if (t_s >= track.phase_at_s) find_phase(track, t_s, starts);
    }
    if (track.has_phase && !starts && plan_.slips_by_chance) slip_by_chance(track, dt_s, district);
    if (track.half_cycle_until_s >= 0 && t_s >= track.half_cycle_until_s) {
      if (track.half_is_silent) track.happening = PhaseHappening::silent_half_cycle;
      track.half_cycle_until_s = -1, track.half_cycles = 0;
    }
  }

  static void lose_phase(Track& track) { track.has_phase = false, track.phase_at_s = -1; }

  /// The tracked ray is another one now: mostly the phase is lost; else the loop slides over, whole cycles wrong.
  void jump(Track& track, std::size_t index, double jump_m, double t_s) {
    const double draw = random_.uniform(0, 1);
    if (draw < 0.8) {
      lose_phase(track);
      track.phase_at_s = t_s + random_.uniform(0.6, 2.8);
      return;
    }
    track.ambiguity_cycles -= std::round(jump_m * kSignals[index].frequency_hz / kLightMps);
    track.is_flagged = track.is_flagged || draw < 0.9;
    track.happening = draw < 0.9 ? PhaseHappening::slip : PhaseHappening::silent_slip;
  }

  void find_phase(Track& track, double t_s, bool starts) {
    track.has_phase = true;
    track.ambiguity_cycles = static_cast<double>(random_.integer(-1'000'000, 1'000'000));
    const double draw = random_.uniform(0, 1);
    track.is_flagged = starts || draw < 0.97;
    track.happening = track.is_flagged ? PhaseHappening::new_lock : PhaseHappening::silent_lock;
    track.half_cycle_until_s = -1, track.half_cycles = 0;
    const double half = random_.uniform(0, 1);
    if (starts || half > 0.043) return;
    track.half_is_silent = half > 0.04;
    track.half_cycle_until_s = t_s + random_.uniform(3, 12);
    track.half_cycles = track.half_is_silent || half < 0.02 ? 0.5 : 0;
    if (track.half_is_silent) track.happening = PhaseHappening::silent_half_cycle;
  }

  void slip_by_chance(Track& track, double dt_s, District district) {
    constexpr std::array<double, 3> kPerSecond{4e-6, 8e-5, 2.5e-4};
    const double weak = track.cn0_dbhz < 33 ? 4 : 1;
    if (random_.uniform(0, 1) > kPerSecond[static_cast<std::size_t>(district)] * weak * dt_s) return;
    const double sign = random_.uniform(0, 1) < 0.5 ? -1 : 1;
    track.ambiguity_cycles += sign * static_cast<double>(random_.integer(1, 6));
    const bool flagged = random_.uniform(0, 1) < 0.6;
    track.is_flagged = track.is_flagged || flagged;
    track.happening = flagged ? PhaseHappening::slip : PhaseHappening::silent_slip;
  }

  [[nodiscard]] Geometry geometry_at(const Orbit& orbit, double tag_s) const {
    const double t_s = plan_.clock.gps_time_s(tag_s);
    const Eigen::Vector3d p_e_m = plan_.frame.to_ecef(plan_.antenna_w_m(t_s));
    const geodesy::Geodetic place = geodesy::geodetic_from_ecef(p_e_m);
    const Flight flight = flight_of(orbit, p_e_m, t_s);
    return {flight.length_m + troposphere_m(place.height_m, flight.line.elevation_rad) +
                kLightMps * (tag_s - t_s - satellite_clock_s(orbit, flight.transmitted_s)),
            ionosphere_l1_m(place, flight.line)};
  }

  [[nodiscard]] Measurement measure_signal(std::size_t satellite, std::size_t index, double tag_s,
                                           const std::array<Geometry, 3>& geometry) {
    const Orbit& orbit = orbits_[satellite];
    Channel& channel = channels_[satellite];
    Track& track = channel.tracks[index];
    const Signal& signal = kSignals[index];
    const double wave_m = kLightMps / signal.frequency_hz, ratio = 1575.42e6 / signal.frequency_hz, gamma = ratio * ratio;
    const double delay_m = kLightMps * (orbit.system == 'C' ? 1.0 : gamma) * orbit.delay_s + channel.extra_m;
    const auto phase_m = [&](std::size_t k) { return geometry[k].common_m - gamma * geometry[k].ionosphere_l1_m + delay_m; };

    Measurement m;
    m.signal = &signal;
    m.has_code = track.has_code, m.has_phase = track.has_code && track.has_phase;
    m.cn0_dbhz = track.cn0_dbhz;
    const double weakness = std::pow(10, (45 - m.cn0_dbhz) / 20);
    const double code_noise_m = std::min(0.2 * weakness, 3.0) * random_.normal();
    const double phase_noise_m = std::min(0.0012 * std::pow(weakness, 0.7), 0.015) * random_.normal();
    const double rate_noise_mps = std::min(0.03 * std::pow(weakness, 0.8), 0.6) * random_.normal();
    m.code_m =
        geometry[1].common_m + gamma * geometry[1].ionosphere_l1_m + delay_m + code_bias_m_[index] + track.code_multipath_m + code_noise_m;
    m.phase_cycles = (phase_m(1) + track.phase_multipath_m + phase_noise_m) / wave_m + track.ambiguity_cycles + track.half_cycles +
                     phase_bias_cycles_[index];
    m.doppler_hz = -((phase_m(2) - phase_m(0)) / (2 * kHalfStepS) + channel.extra_rate_mps + rate_noise_mps) / wave_m;
    if (m.has_phase) {
      m.lli = std::exchange(track.is_flagged, false) ? 1 : 0;
      if (track.half_cycle_until_s >= 0 && !track.half_is_silent) m.lli |= 2;
    }
    PhaseHappening happening = PhaseHappening::none;
    if (m.has_phase) happening = std::exchange(track.happening, PhaseHappening::none);
    if (happening == PhaseHappening::none && (m.lli & 2) != 0) happening = PhaseHappening::half_cycle;
    labels_.push_back({tag_s, orbit.system, orbit.number, signal.code, track.cn0_dbhz < kCodeDbhz ? SignalState::blocked : channel.state,
                       channel.extra_m, track.loss_db, track.code_multipath_m, track.phase_multipath_m, channel.line.azimuth_rad,
                       channel.line.elevation_rad, track.cn0_dbhz, m.has_code, m.has_phase, m.lli, happening});
    return m;
  }

  CityReceiverPlan plan_;
  City nothing_{};  ///< where the plan has no city
  const std::vector<Orbit>& orbits_;
  Random random_;
  std::vector<Channel> channels_;
  std::array<double, std::size(kSignals)> phase_bias_cycles_{}, code_bias_m_{};
  std::vector<SignalLabel> labels_;
  bool first_{true};
  double last_s_{0};
};

}  // namespace searvins::simulator
