// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From one rover epoch and the base buffer to screened, base-corrected single differences, grouped with pivots.
///
///     corrected  =  reduced_rover - (reduced_base - range_base)                    [paper section III-D; facts 4.3]
///
/// with the reductions of reduction.hpp. Troposphere (Saastamoinen) and ionosphere (Klobuchar, when broadcast) act through their difference
/// between the receivers, which tends to zero with the baseline; so neither needs a distance below which it is off.
///
/// All satellites of an epoch use the same base epochs with the same weights: the base clock drifts by metres a second, and is common only
/// at one instant. A satellite that lacks one of two interpolated epochs is left out rather than served from the other.
///
/// Doppler is of the rover alone: -wavelength D + c dt_s' - rate(v = 0) = unit_e' v + c (rover drift)   [facts 4.4].
///
/// The Differencer keeps the previous epoch for the continuity tests and the previous pivots; a new epoch is compared with them first and
/// replaces them last, as a whole, and not at all when it is refused.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/gnss/base_buffer.hpp>
#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/phase_continuity.hpp>
#include <searvins/gnss/pivot.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/reduction.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/signal_pairing.hpp>
#include <searvins/gnss/weighting.hpp>

namespace searvins::gnss {

/// Settings of differencing.
struct DifferencingOptions {
  SignalSelection selection{};
  Screening screening{};
  EphemerisPolicy ephemeris{};
  SigmaModel sigmas{urban_profile()};
  bool cn0_weighting{false};  ///< code variances times cn0_variance_factor
  BaseOptions base{};
  CycleSlipOptions slips{};
  PivotOptions pivot{};
  bool troposphere{true};
  bool ionosphere{true};  ///< Klobuchar, when the store has coefficients
  int min_group_size{2};  ///< signals in a group, pivot included
};

/// Differencing with memory of one epoch. `sizeof` is all it ever uses. Scalar: double, for ECEF metres.
template <class Scalar>
class BasicDifferencer {
 public:
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

  /// Differences one rover epoch. `predicted_rover_e_m`: antenna position, good to some ten metres. The outcome does not depend on the
  /// order of satellites and signals in the epochs.
  ///
  /// `moved`: the antenna's displacement since the last epoch that had base data, whose phases this one's are compared with; none where nothing predicts it.
  ///
  /// Without usable base data the call succeeds, `out.base_status` says why there are no single differences, and the memory stays (the same
  /// epoch may be offered again). Errors, with `out` empty and the memory as it was: non_finite or invalid_argument (position), duplicate
  /// or out_of_order (tag not after the previous one).
  template <std::size_t B, std::size_t E>
  Status difference(const ObservationEpoch& rover, const BaseBuffer<B>& base, const EphemerisStore<E>& store,
                    const Vector3& predicted_rover_e_m, const DifferencingOptions& options, DifferencedEpoch& out,
                    const std::optional<PredictedDisplacement>& moved = {}) {
    out.clear();
    out.rover_tag = rover.tag;
    if (const Status s = check(rover, predicted_rover_e_m); !s) return s;

    const Result<BaseMatch> match = base.match(rover.tag, options.base);
    out.base_status = match.status();
    next_pairing_ = pairing_;
    signals_.clear(), samples_.clear(), pair_of_.clear();
    Context c{rover,
              options,
              {options.troposphere, options.ionosphere ? store.ionosphere : KlobucharCoefficients{}},
              ReceiverPlace::at(rover.tag, predicted_rover_e_m),
              {},
              {},
              {},
              out};
    if (match) begin_base(c, *match, base.position_e_m());

    for_each_satellite(c, [&](const SatelliteObservation& satellite) {
      const SignalObservation* timing = timing_signal(satellite);
      if (!timing) return reject_signals(c, satellite, Rejection::no_code);
      const Result<Transmission> sent = transmission_from_code(store, satellite.satellite, rover.tag, timing->code_m, options.ephemeris);
      if (!sent)
        return reject_signals(c, satellite, sent.status().code == StatusCode::no_data ? Rejection::no_ephemeris : Rejection::bad_code);
      add_satellite(c, satellite, *sent);
    });
    pick_doppler_pivot(out);
    if (!match) return ok_status();

    const PhaseEpoch epoch{rover.tag, rover.power_failure, match->age_s, base.position_revision(), predicted_rover_e_m, moved};
    out.motion = continuity_.compare(epoch, samples_, options.slips, verdicts_);
    for (std::size_t i = 0; i < signals_.size(); ++i)
      signals_[i].continuity = verdicts_[i].continuity, signals_[i].cause = verdicts_[i].cause;
    form_groups(c);
    continuity_.remember(epoch, samples_);
    pairing_ = next_pairing_, pivots_ = next_pivots_;
    return ok_status();
  }

  /// The signal pairs in use.
  [[nodiscard]] const StaticVector<SignalPair, kMaxSignalGroups>& pairs() const { return pairing_.pairs(); }

 private:
  struct PivotRecord {
    SignalPair pair{};
    SatelliteId satellite{};
  };
  /// What an epoch is made from.
  struct Context {
    const ObservationEpoch& rover;
    const DifferencingOptions& options;
    DelayModels models;
    ReceiverPlace place;
    BaseMatch match;
    std::array<const BaseEpoch*, 2> base_epoch;  // both nullptr: no base
    std::array<ReceiverPlace, 2> base_place;
    DifferencedEpoch& out;
  };
  /// A satellite as rover and base see it.
  struct View {
    SatelliteId id{};
    ReceiverLine rover{};
    std::array<const SatelliteObservation*, 2> base_satellite{};
    std::array<ReceiverLine, 2> base{};
    double predicted_range_m{0};
    Vector3 direction_e{Vector3::Zero()};
  };
  /// The base side of a signal.
  struct BaseSignal {
    ReducedSignal reduced{};
    BaseArc arc{};
  };

  [[nodiscard]] Status check(const ObservationEpoch& rover, const Vector3& p_e_m) const {
    if (!p_e_m.allFinite()) return failure(StatusCode::non_finite, "predicted rover position is not finite");
    const double r_m = p_e_m.norm();
    if (r_m < 6.25e6 || r_m > 7e6)
      return failure(StatusCode::invalid_argument, "predicted rover position is not near the Earth", -1, -1, r_m);
    if (!continuity_.started()) return ok_status();
    const GpsTime last = continuity_.last_tag();
    if (rover.tag == last) return failure(StatusCode::duplicate, "rover epoch given twice");
    if (rover.tag < last)
      return failure(StatusCode::out_of_order, "rover epoch before the last one", -1, -1, seconds_between(rover.tag, last));
    return ok_status();
  }

  void begin_base(Context& c, const BaseMatch& match, const Vector3& base_e_m) {
    c.match = match;
    c.base_epoch = {match.first, match.second};
    for (std::size_t k = 0; k < 2; ++k)
      if (c.base_epoch[k]) c.base_place[k] = ReceiverPlace::at(c.base_epoch[k]->observation.tag, base_e_m);
    c.out.base_age_s = match.age_s;
    c.out.base_interpolated = match.second != nullptr;
    next_pairing_.update(c.rover, match.first->observation, c.options.selection);
  }

  /// Visits the satellites by their number, whatever their order; satellites that stand twice are rejected.
  template <class Visit>
  static void for_each_satellite(const Context& c, Visit visit) {
    const auto& satellites = c.rover.satellites;
    StaticVector<std::uint8_t, kMaxSatellitesPerEpoch> order;
    for (std::size_t i = 0; i < satellites.size(); ++i) {
      std::size_t at = order.size();
      while (at > 0 && satellites[i].satellite < satellites[order[at - 1]].satellite) --at;
      order.insert(at, static_cast<std::uint8_t>(i));
    }
    for (std::size_t i = 0; i < order.size(); ++i) {
      const SatelliteObservation& satellite = satellites[order[i]];
      const bool twice = (i > 0 && satellites[order[i - 1]].satellite == satellite.satellite) ||
                         (i + 1 < order.size() && satellites[order[i + 1]].satellite == satellite.satellite);
      if (twice)
        c.out.reject(satellite.satellite, {}, Rejection::duplicate);
      else
        visit(satellite);
    }
  }

  /// The code that times the transmission for all signals of a satellite: the first of the pairs, else the lowest code.
  [[nodiscard]] const SignalObservation* timing_signal(const SatelliteObservation& satellite) const {
    for (const SignalPair& p : next_pairing_.pairs())
      if (const SignalObservation* o = satellite.find(p.rover); o && plausible_code(*o)) return o;
    const SignalObservation* found = nullptr;
    for (const SignalObservation& o : satellite.signals)
      if (plausible_code(o) && (!found || o.signal < found->signal)) found = &o;
    return found;
  }

  void reject_signals(const Context& c, const SatelliteObservation& satellite, Rejection reason) const {
    for (const SignalPair& p : next_pairing_.pairs())
      if (satellite.find(p.rover)) c.out.reject(satellite.satellite, p.rover, reason);
  }

  void add_satellite(const Context& c, const SatelliteObservation& satellite, const Transmission& sent) {
    View v;
    v.id = satellite.satellite;
    v.rover = line_of(sent.state, c.place, c.models);
    if (!high_enough(v.rover.angles.elevation_rad, c.options.screening)) return reject_signals(c, satellite, Rejection::low_elevation);
    add_doppler(c, satellite, v.rover);
    if (!c.base_epoch[0]) return;
    for (std::size_t k = 0; k < 2 && c.base_epoch[k]; ++k)
      if (!view_from_base(c, k, *sent.ephemeris, v)) return reject_signals(c, satellite, Rejection::no_base);
    v.predicted_range_m = range_m(c.place.position_e_m, sent.state.position_e_m, &v.direction_e);

    const auto& pairs = next_pairing_.pairs();
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const SignalObservation* o = satellite.find(pairs[p].rover);
      if (!o) continue;
      if (!plausible_code(*o))
        c.out.reject(v.id, o->signal, Rejection::no_code);
      else if (!strong_enough(*o, c.options.screening))
        c.out.reject(v.id, o->signal, Rejection::low_cn0);
      else
        add_signal(c, *o, static_cast<std::uint8_t>(p), v);
    }
  }

  [[nodiscard]] bool view_from_base(const Context& c, std::size_t k, const Ephemeris& e, View& v) const {
    v.base_satellite[k] = c.base_epoch[k]->observation.find(v.id);
    if (!v.base_satellite[k]) return false;
    const SignalObservation* timing = nullptr;
    for (const SignalPair& p : next_pairing_.pairs())
      if (const SignalObservation* o = v.base_satellite[k]->find(p.base); !timing && o && plausible_code(*o)) timing = o;
    if (!timing) return false;
    const Result<ReceiverLine> line = base_line_of(e, c.base_place[k], timing->code_m, c.models);
    v.base[k] = line.value();
    return line.ok();
  }

  void add_signal(const Context& c, const SignalObservation& o, std::uint8_t pair, const View& v) {
    const SignalPair& codes = next_pairing_.pairs()[pair];
    const BaseSignal base = base_signal(c, codes.base, v);
    if (!std::isfinite(base.reduced.code_m)) return c.out.reject(v.id, o.signal, Rejection::no_base);
    const ReducedSignal rover = reduce(o, v.rover);

    CorrectedSignal s;
    s.satellite = v.id, s.rover_signal = codes.rover, s.base_signal = codes.base;
    s.wavelength_m = wavelength_m(codes.rover);
    s.code_m = rover.code_m - base.reduced.code_m;
    s.phase_m = rover.phase_m - base.reduced.phase_m;
    if (o.half_cycle && c.options.slips.half_cycle == HalfCyclePolicy::drop) {
      s.phase_m = kMissing;
      c.out.reject(v.id, o.signal, Rejection::half_cycle);
    } else if (!std::isfinite(s.phase_m)) {
      c.out.reject(v.id, o.signal, Rejection::no_phase);
    }
    s.elevation_rad = v.rover.angles.elevation_rad, s.azimuth_rad = v.rover.angles.azimuth_rad, s.cn0_dbhz = o.cn0_dbhz;
    s.code_variance_m2 = c.options.sigmas.code_variance_m2(codes.rover, s.elevation_rad, c.match.effective_age_s);
    if (c.options.cn0_weighting) s.code_variance_m2 *= cn0_variance_factor(o.cn0_dbhz);
    s.phase_variance_m2 = c.options.sigmas.phase_variance_m2(codes.rover, s.elevation_rad, c.match.effective_age_s);
    s.satellite_e_m = v.rover.state.position_e_m;

    PhaseSample sample;
    sample.satellite = v.id, sample.pair = codes, sample.wavelength_m = s.wavelength_m;
    sample.less_range_m = s.phase_m - v.predicted_range_m;
    sample.rover_phase_m = o.phase_cycles * s.wavelength_m, sample.doppler_hz = o.doppler_hz;
    sample.direction_e = v.direction_e, sample.base_arc = base.arc;
    sample.loss_of_lock = o.loss_of_lock, sample.half_cycle = o.half_cycle;
    push(c, s, sample, pair);
  }

  /// The base observation less its range, interpolated when there are two epochs. The phase needs one arc across both.
  [[nodiscard]] static BaseSignal base_signal(const Context& c, const SignalCode& code, const View& v) {
    std::array<BaseSignal, 2> r{};
    for (std::size_t k = 0; k < 2 && c.base_epoch[k]; ++k) {
      const SignalObservation* o = v.base_satellite[k]->find(code);
      if (!o) return {};
      r[k] = {reduce(*o, v.base[k]), c.base_epoch[k]->arc_of(*v.base_satellite[k], *o)};
      if (r[k].arc.number == 0) r[k].reduced.phase_m = kMissing;
    }
    if (!c.base_epoch[1]) return r[0];
    const double f = c.match.fraction;
    const double phase_m = r[0].arc.number == r[1].arc.number ? (1 - f) * r[0].reduced.phase_m + f * r[1].reduced.phase_m : kMissing;
    return {{(1 - f) * r[0].reduced.code_m + f * r[1].reduced.code_m, phase_m}, r[1].arc};
  }

  /// Takes a signal; when full, a signal of the lowest satellite goes.
  void push(const Context& c, const CorrectedSignal& s, const PhaseSample& sample, std::uint8_t pair) {
    if (signals_.full()) {
      std::size_t lowest = 0;
      for (std::size_t i = 1; i < signals_.size(); ++i)
        if (signals_[i].elevation_rad <= signals_[lowest].elevation_rad) lowest = i;
      const bool replace = signals_[lowest].elevation_rad < s.elevation_rad;
      const CorrectedSignal& gone = replace ? signals_[lowest] : s;
      c.out.reject(gone.satellite, gone.rover_signal, Rejection::capacity);
      if (!replace) return;
      signals_.erase(lowest), samples_.erase(lowest), pair_of_.erase(lowest);
    }
    signals_.push_back(s), samples_.push_back(sample), pair_of_.push_back(pair);
  }

  /// Doppler of the satellite's strongest signal, restricted to the wanted ones when there is such a list.
  static void add_doppler(const Context& c, const SatelliteObservation& satellite, const ReceiverLine& line) {
    const auto& wanted = c.options.selection.wanted;
    const auto selected = [&](const SignalCode& s) {
      for (const SignalCode& w : wanted)
        if (w == s) return true;
      return wanted.empty();
    };
    const SignalObservation* best = nullptr;
    for (const SignalObservation& o : satellite.signals) {
      if (!o.has_doppler() || !plausible_code(o) || !strong_enough(o, c.options.screening) || !selected(o.signal)) continue;
      const double strength = o.has_cn0() ? o.cn0_dbhz : 0, most = best && best->has_cn0() ? best->cn0_dbhz : 0;
      if (!best || strength > most || (strength == most && o.signal < best->signal)) best = &o;
    }
    if (!best) return;
    DopplerMeasurement m;
    m.satellite = satellite.satellite, m.signal = best->signal;
    const double satellite_part_mps =
        range_rate_mps(c.place.position_e_m, Eigen::Vector3d::Zero(), line.state.position_e_m, line.state.velocity_e_mps, &m.unit_e);
    m.rate_mps = -wavelength_m(best->signal) * best->doppler_hz + kSpeedOfLightMps * line.state.clock_rate_sps - satellite_part_mps;
    m.variance_m2ps2 = c.options.sigmas.doppler_variance_m2ps2();
    m.elevation_rad = line.angles.elevation_rad, m.cn0_dbhz = best->cn0_dbhz;
    c.out.doppler.push_back(m);
  }

  static void pick_doppler_pivot(DifferencedEpoch& out) {
    for (std::size_t i = 0; i < out.doppler.size(); ++i)
      if (out.doppler_pivot < 0 || out.doppler[i].elevation_rad > out.doppler[static_cast<std::size_t>(out.doppler_pivot)].elevation_rad)
        out.doppler_pivot = static_cast<int>(i);
  }

  using Used = std::array<bool, kMaxCorrectedSignals>;

  /// Forms the groups, then hands on the signals that stand in one.
  void form_groups(const Context& c) {
    next_pivots_.clear();
    Used used{};
    for (std::size_t p = 0; p < next_pairing_.pairs().size(); ++p) form_group(c, p, used);

    std::array<std::uint16_t, kMaxCorrectedSignals> place{};  // of a signal among those that are handed on
    for (std::size_t i = 0; i < signals_.size(); ++i) {
      if (!used[i]) continue;
      place[i] = static_cast<std::uint16_t>(c.out.signals.size());
      if (c.out.signals.empty() || c.out.signals.back().satellite != signals_[i].satellite) ++c.out.satellites;
      c.out.signals.push_back(signals_[i]);
    }
    for (SignalGroup& g : c.out.groups) {
      g.pivot = place[static_cast<std::size_t>(g.pivot)];
      for (std::uint16_t& i : g.candidates) i = place[i];
    }
  }

  void form_group(const Context& c, std::size_t pair, Used& used) {
    const SignalPair& codes = next_pairing_.pairs()[pair];
    StaticVector<PivotCandidate, kMaxSatellitesPerEpoch> candidates;
    SignalGroup g;
    for (std::size_t i = 0; i < signals_.size(); ++i) {
      const CorrectedSignal& s = signals_[i];
      if (pair_of_[i] != pair || !g.candidates.push_back(static_cast<std::uint16_t>(i))) continue;
      candidates.push_back({s.satellite, s.elevation_rad, s.cn0_dbhz, std::isfinite(s.phase_m), s.continuity == Continuity::broken});
    }
    const auto drop = [&](Rejection reason) {
      for (const std::uint16_t i : g.candidates) c.out.reject(signals_[i].satellite, signals_[i].rover_signal, reason);
    };
    if (g.candidates.empty()) return;
    if (static_cast<int>(g.candidates.size()) < c.options.min_group_size) return drop(Rejection::group_too_small);

    SatelliteId previous{};
    for (const PivotRecord& r : pivots_)
      if (r.pair == codes) previous = r.satellite;
    const PivotChoice choice = choose_pivot({candidates.data(), candidates.size()}, previous, c.options.pivot);
    if (choice.index < 0) return drop(Rejection::no_pivot);

    for (const std::uint16_t i : g.candidates) used[i] = true;
    const auto at = static_cast<std::size_t>(choice.index);
    g.rover_signal = codes.rover, g.base_signal = codes.base, g.wavelength_m = wavelength_m(codes.rover);
    g.pivot = g.candidates[at], g.pivot_fallback = choice.fallback, g.pivot_changed = candidates[at].satellite != previous;
    g.candidates.erase(at);
    next_pivots_.push_back({codes, candidates[at].satellite});
    c.out.groups.push_back(g);
  }

  SignalPairing pairing_{}, next_pairing_{};
  StaticVector<PivotRecord, kMaxSignalGroups> pivots_{}, next_pivots_{};
  PhaseContinuity<kMaxCorrectedSignals> continuity_{};

  StaticVector<CorrectedSignal, kMaxCorrectedSignals> signals_{};  // of the epoch at hand, like everything below
  StaticVector<PhaseSample, kMaxCorrectedSignals> samples_{};
  StaticVector<std::uint8_t, kMaxCorrectedSignals> pair_of_{};
  StaticVector<ContinuityVerdict, kMaxCorrectedSignals> verdicts_{};
};
using Differencer = BasicDifferencer<double>;  ///< in double precision

}  // namespace searvins::gnss
