// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From the observation types that a RINEX header lists to what each column of an observation line means.
///
/// RINEX 3 and 4 name quantity, band and tracking mode: `L2W`. Two things are normalised:
///
///   - BeiDou B1I is band 2 (C2I). RINEX 3.02 called it band 1: C1I, C1Q and, in 3.02 only, C1X become 2I, 2Q, 2X.
///   - a type that is no code, phase, Doppler or C/N0 of a known carrier (X1, I1, ...) keeps its column and is not used.
///
/// RINEX 2 names quantity and band only. It is read as what nearly every receiver of its time meant:
///
///     GPS      C1 -> 1C   P1 -> 1W   P2 -> 2W   C2 -> 2X   C5 -> 5X
///     QZSS     C1 -> 1C   C2 -> 2X   C5 -> 5X   C6 -> 6X
///     Galileo  C1 -> 1X   C5 -> 5X   C7 -> 7X   C8 -> 8X   C6 -> 6X
///     BeiDou   C1, C2 -> 2I   C7 -> 7I   C6 -> 6I
///
/// and L, D and S of a band belong to the code of that band which the satellite has at the epoch: on band 1 C1 before P1, on band 2
/// P2 before C2 (a satellite without P2, tracked on L2C, gives 2X). Where neither is there, the first of the header's codes is meant.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/gnss/signal.hpp>
#include <searvins/io/fixed_field.hpp>

namespace searvins::io {

/// What one column of an observation line means.
struct ObservationColumn {
  static constexpr std::uint8_t kNone = 255;
  char quantity{0};               ///< 'C' code, 'L' phase, 'D' Doppler, 'S' C/N0; 0: the column is not used
  std::uint8_t slot{kNone};       ///< index of the signal
  std::uint8_t if_absent{kNone};  ///< RINEX 2: signal to take when `slot` has no code at this epoch
  double scale{1};                ///< what the file holds is the value times this
};

/// The columns of one constellation and the distinct signals they fill, in order of appearance.
struct ObservationLayout {
  std::vector<ObservationColumn> columns;
  std::vector<gnss::SignalCode> signals;

  /// Index of a signal, added when new; kNone when there is no room or the constellation has no such carrier.
  std::uint8_t slot_of(const gnss::SignalCode& signal) {
    if (gnss::frequency_hz(signal) == 0) return ObservationColumn::kNone;
    for (std::size_t i = 0; i < signals.size(); ++i)
      if (signals[i] == signal) return static_cast<std::uint8_t>(i);
    if (signals.size() >= ObservationColumn::kNone) return ObservationColumn::kNone;
    signals.push_back(signal);
    return static_cast<std::uint8_t>(signals.size() - 1);
  }
};

namespace detail {

[[nodiscard]] constexpr bool is_quantity(char c) { return c == 'C' || c == 'L' || c == 'D' || c == 'S'; }

/// What a RINEX 2 code type means.
struct LegacyCode {
  char letter;  ///< C or P
  char digit;
  char band, attribute;
};

/// The code types of a constellation in RINEX 2; of one digit the preferred one first.
[[nodiscard]] constexpr std::array<LegacyCode, 5> legacy_codes(gnss::Constellation c) {
  switch (c) {
    case gnss::Constellation::galileo:
      return {{{'C', '1', '1', 'X'}, {'C', '5', '5', 'X'}, {'C', '7', '7', 'X'}, {'C', '8', '8', 'X'}, {'C', '6', '6', 'X'}}};
    case gnss::Constellation::beidou:
      return {{{'C', '2', '2', 'I'}, {'C', '1', '2', 'I'}, {'C', '7', '7', 'I'}, {'C', '6', '6', 'I'}, {0, 0, 0, 0}}};
    case gnss::Constellation::qzss:
      return {{{'C', '1', '1', 'C'}, {'C', '2', '2', 'X'}, {'C', '5', '5', 'X'}, {'C', '6', '6', 'X'}, {0, 0, 0, 0}}};
    default: return {{{'C', '1', '1', 'C'}, {'P', '1', '1', 'W'}, {'P', '2', '2', 'W'}, {'C', '2', '2', 'X'}, {'C', '5', '5', 'X'}}};
  }
}

/// One RINEX 2 type. Codes have their slot at once; L, D, S look for the codes of their digit among all types of the header.
[[nodiscard]] inline ObservationColumn legacy_column(gnss::Constellation c, std::string_view type, const std::vector<std::string>& all,
                                                     ObservationLayout& layout) {
  ObservationColumn column;
  std::uint8_t fallback = ObservationColumn::kNone;
  for (const LegacyCode& code : legacy_codes(c)) {
    if (type[1] != code.digit || code.letter == 0) continue;
    const gnss::SignalCode signal{c, code.band, code.attribute};
    if (type[0] == code.letter) return {'C', layout.slot_of(signal)};
    if (type[0] == 'C' || !is_quantity(type[0])) continue;
    bool listed = false;
    for (const std::string& other : all) listed = listed || (other.size() == 2 && other[0] == code.letter && other[1] == code.digit);
    if (!listed) {
      if (fallback == ObservationColumn::kNone) fallback = layout.slot_of(signal);
    } else if (column.slot == ObservationColumn::kNone) {
      column = {type[0], layout.slot_of(signal)};
    } else {
      column.if_absent = layout.slot_of(signal);
    }
  }
  if (column.slot == ObservationColumn::kNone && fallback != ObservationColumn::kNone) column = {type[0], fallback};
  return column;
}

/// One RINEX 3 or 4 type.
[[nodiscard]] inline ObservationColumn modern_column(gnss::Constellation c, std::string_view type, double version,
                                                     ObservationLayout& layout) {
  if (type.size() < 2 || !is_quantity(type[0])) return {};
  gnss::SignalCode signal{c, type[1], type.size() > 2 ? type[2] : ' '};
  if (signal.attribute != ' ' && (signal.attribute < 'A' || signal.attribute > 'Z')) return {};
  if (c == gnss::Constellation::beidou && signal.band == '1') {
    const bool version_3_02 = version > 3.015 && version < 3.025;
    if (signal.attribute == 'I' || signal.attribute == 'Q' || (version_3_02 && signal.attribute == 'X')) signal.band = '2';
  }
  const std::uint8_t slot = layout.slot_of(signal);
  return slot == ObservationColumn::kNone ? ObservationColumn{} : ObservationColumn{type[0], slot};
}

}  // namespace detail

/// The layout of a constellation from the types in the order of the header (each without blanks at its ends).
[[nodiscard]] inline ObservationLayout layout_from_types(gnss::Constellation c, const std::vector<std::string>& types, double version) {
  ObservationLayout layout;
  for (const std::string& type : types) {
    const bool legacy = version < 3;
    if (legacy && type.size() != 2)
      layout.columns.emplace_back();
    else
      layout.columns.push_back(legacy ? detail::legacy_column(c, type, types, layout) : detail::modern_column(c, type, version, layout));
  }
  return layout;
}

}  // namespace searvins::io
