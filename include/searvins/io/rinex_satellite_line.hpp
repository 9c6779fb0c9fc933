// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From the values of one satellite at one epoch of a RINEX observation file to its signals.
///
/// A value takes 16 columns: F14.3, loss-of-lock digit (LLI), signal strength digit (SSI). The values of a satellite are gathered in
/// the order of the header's types, over one line (RINEX 3) or several (RINEX 2), and turned into signals by finish(): codes first,
/// because in RINEX 2 the code that is there decides which signal the phase belongs to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <searvins/gnss/observation.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/rinex_observation_header.hpp>
#include <searvins/io/rinex_observation_types.hpp>

namespace searvins::io {

/// How much a signal can tell: code and phase before Doppler before C/N0. Decides what is dropped when a capacity is full.
[[nodiscard]] inline double information(const gnss::SignalObservation& s) {
  return (s.has_code() ? 1000.0 : 0.0) + (s.has_phase() ? 1000.0 : 0.0) + (s.has_doppler() ? 100.0 : 0.0) +
         (s.has_cn0() ? s.cn0_dbhz / 2 : 0.0);
}

/// The same for a satellite: the sum over its signals.
[[nodiscard]] inline double information(const gnss::SatelliteObservation& satellite) {
  double sum = 0;
  for (const gnss::SignalObservation& s : satellite.signals) sum += information(s);
  return sum;
}

/// Gathers the values of one satellite.
class SatelliteLineCollector {
 public:
  /// Starts a satellite whose columns mean `columns`; line: where its values begin, for the log.
  void begin(const std::vector<ObservationColumn>& columns, const RinexObservationHeader& header, long line) {
    columns_ = &columns;
    half_cycle_base_[0] = header.first_line.major() == 2 && header.wavelength_factor[0] == 2;
    half_cycle_base_[1] = header.first_line.major() == 2 && header.wavelength_factor[1] == 2;
    values_.clear();
    line_ = line;
  }

  /// Takes the next `count` values from a text that begins with them.
  void take(std::string_view text, std::size_t count, SkipLog& log) {
    if (text.size() > 16 * count) log.add("observation line is longer than its types: the rest is ignored", line_);
    for (std::size_t i = 0; i < count && values_.size() < columns_->size(); ++i) {
      const std::string_view cell = field(text, 16 * i, 16);
      Value& value = values_.emplace_back();
      if (cell.empty() || (*columns_)[values_.size() - 1].quantity == 0) continue;
      const FieldState state = read_fixed(cell.substr(0, 14), value.number);
      if (state == FieldState::malformed) log.add("value is not a number (NaN, inf, **** or text): taken as missing", line_);
      value.there = state == FieldState::number && value.number != 0;
      value.lli = column(cell, 14);
      value.ssi = column(cell, 15);
    }
  }

  /// Fills the signals of the satellite, in the order of the layout.
  void finish(const ObservationLayout& layout, gnss::SatelliteObservation& out, SkipLog& log) {
    signals_.assign(layout.signals.size(), {});
    strengths_.assign(layout.signals.size(), ' ');
    for (std::size_t i = 0; i < signals_.size(); ++i) signals_[i].signal = layout.signals[i];
    for (std::size_t i = 0; i < values_.size(); ++i)
      if (layout.columns[i].quantity == 'C') set_code(layout.columns[i], values_[i]);
    for (std::size_t i = 0; i < values_.size(); ++i)
      if (layout.columns[i].quantity != 'C' && layout.columns[i].quantity != 0) set_other(layout.columns[i], values_[i], log);
    std::size_t there = 0;
    for (std::size_t i = 0; i < signals_.size(); ++i) {
      if (!present(signals_[i])) continue;
      if (!signals_[i].has_cn0() && strengths_[i] >= '1' && strengths_[i] <= '9') signals_[i].cn0_dbhz = 6.0 * (strengths_[i] - '0') + 3.0;
      signals_[there++] = signals_[i];
    }
    signals_.resize(there);
    drop_surplus(log);
    for (const gnss::SignalObservation& s : signals_) (void)out.signals.push_back(s);
  }

 private:
  struct Value {
    double number{0};
    bool there{false};
    char lli{' '}, ssi{' '};
  };

  [[nodiscard]] static bool present(const gnss::SignalObservation& s) {
    return s.has_code() || s.has_phase() || s.has_doppler() || s.has_cn0();
  }

  void set_code(const ObservationColumn& c, const Value& value) {
    if (!value.there) return;
    signals_[c.slot].code_m = value.number / c.scale;
    strengths_[c.slot] = value.ssi;
  }

  void set_other(const ObservationColumn& c, const Value& value, SkipLog& log) {
    const bool other = c.if_absent != ObservationColumn::kNone && !signals_[c.slot].has_code() && signals_[c.if_absent].has_code();
    const std::uint8_t slot = other ? c.if_absent : c.slot;
    gnss::SignalObservation& s = signals_[slot];
    if (c.quantity == 'L') set_flags(s, value, log);
    if (!value.there) return;
    const double number = value.number / c.scale;
    if (c.quantity == 'L') {
      s.phase_cycles = number;
      if (value.ssi != ' ') strengths_[slot] = value.ssi;
    } else if (c.quantity == 'D') {
      s.doppler_hz = number;
    } else if (number > 0 && number <= 100) {
      s.cn0_dbhz = number;
    } else {
      log.add("C/N0 outside 0 .. 100 dB-Hz: taken as missing", line_);
    }
  }

  /// Loss-of-lock digit of a phase; it counts even where the phase itself is missing.
  void set_flags(gnss::SignalObservation& s, const Value& value, SkipLog& log) {
    const bool base = (s.signal.band == '1' && half_cycle_base_[0]) || (s.signal.band == '2' && half_cycle_base_[1]);
    const bool digit = value.lli >= '0' && value.lli <= '9';
    if (!digit && value.lli != ' ') log.add("loss-of-lock indicator is not a digit: ignored", line_);
    if (!digit && !value.there) return;  // another type of this signal may have set the flags
    const int bits = digit ? value.lli - '0' : 0;
    s.loss_of_lock = s.loss_of_lock || (bits & 1) != 0;
    s.half_cycle = ((bits & 2) != 0) != base;
  }

  /// Drops the least informative signals (of equals the later) until the rest fits.
  void drop_surplus(SkipLog& log) {
    while (signals_.size() > gnss::kMaxSignalsPerSatellite) {
      std::size_t least = 0;
      for (std::size_t i = 1; i < signals_.size(); ++i)
        if (information(signals_[i]) <= information(signals_[least])) least = i;
      signals_.erase(signals_.begin() + static_cast<std::ptrdiff_t>(least));
      log.add("more signals than a satellite holds: the least informative is dropped", line_);
    }
  }

  const std::vector<ObservationColumn>* columns_{nullptr};
  std::vector<Value> values_;
  std::vector<gnss::SignalObservation> signals_;
  std::vector<char> strengths_;
  bool half_cycle_base_[2]{false, false};
  long line_{0};
};

}  // namespace searvins::io
