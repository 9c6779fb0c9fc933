// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The header of a RINEX observation file, and the header records that event flags splice into the middle of one.
///
/// The records are independent lines except the lists of observation types, which continue over several. Lists are gathered line by
/// line and turned into column layouts by finish(), which is called after END OF HEADER and after each spliced group.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/rinex_common.hpp>
#include <searvins/io/rinex_observation_types.hpp>

namespace searvins::io {

/// Phase shift that the header declares (already applied or to be ignored by differencing equal signals; never applied here).
struct PhaseShift {
  gnss::SignalCode signal{};
  double cycles{0};
};

/// What the header says.
struct RinexObservationHeader {
  RinexFirstLine first_line{};
  std::string marker_name, receiver, antenna;                    ///< as written, blanks trimmed
  std::optional<Eigen::Vector3d> approx_position_e_m;            ///< nothing when missing, zero or not on Earth (norm below 1000 km)
  Eigen::Vector3d antenna_delta_hen_m{Eigen::Vector3d::Zero()};  ///< antenna reference point above the marker: height, east, north
  std::optional<double> interval_s;                              ///< as declared; the true one may differ
  TimeSystem time_system{TimeSystem::gps};                       ///< scale of the tags in the file; what is read is GPS time
  std::optional<GpsTime> first_observation;                      ///< TIME OF FIRST OBS
  std::optional<int> leap_seconds;
  bool clock_offset_applied{false};            ///< tags and ranges were corrected for the receiver clock already
  std::array<int, 2> wavelength_factor{1, 1};  ///< RINEX 2, bands 1 and 2: 2 means half-cycle ambiguities
  std::vector<PhaseShift> phase_shifts;
  std::array<ObservationLayout, gnss::kConstellations> layouts{};  ///< by constellation; no columns: none announced
};

/// Reads header records into a header.
class ObservationHeaderParser {
 public:
  /// Forgets everything; `first_line` gives version and default time system.
  void begin(const RinexFirstLine& first_line) {
    header_ = {};
    header_.first_line = first_line;
    header_.time_system = first_line.system == 'R' ? TimeSystem::utc : first_line.system == 'C' ? TimeSystem::beidou : TimeSystem::gps;
    lists_.clear();
    scales_.clear();
    current_ = kNoList;
    changed_ = true;
  }

  [[nodiscard]] const RinexObservationHeader& header() const { return header_; }

  /// Takes one record. A Diagnostic when the columns of the file cannot be known any more; lesser flaws go to the log.
  [[nodiscard]] std::optional<Diagnostic> take(const TextReader& text, std::string_view line, SkipLog& log) {
    if (auto tab = refuse_tab_in_header(text, line)) return tab;
    const std::string_view label = header_label(line);
    if (label == "# / TYPES OF OBSERV" && header_.first_line.major() == 2)
      return take_types(text, line, ' ', field(line, 0, 6), 10, 6, 2, 9);
    if (label == "SYS / # / OBS TYPES" && header_.first_line.major() > 2)
      return take_types(text, line, column(line, 0), field(line, 3, 3), 7, 4, 3, 13);
    if (label == "TIME OF FIRST OBS") return take_first_time(text, line);
    if (label == "SYS / SCALE FACTOR")
      take_scale(line);
    else if (label == "APPROX POSITION XYZ")
      take_position(text, line, log);
    else if (label == "ANTENNA: DELTA H/E/N")
      (void)take_vector(line, header_.antenna_delta_hen_m);
    else if (label == "MARKER NAME")
      header_.marker_name = without_blanks(field(line, 0, 60));
    else if (label == "REC # / TYPE / VERS")
      header_.receiver = without_blanks(field(line, 20, 20));
    else if (label == "ANT # / TYPE")
      header_.antenna = without_blanks(field(line, 20, 20));
    else if (label == "INTERVAL")
      take_interval(line);
    else if (label == "LEAP SECONDS")
      take_leap_seconds(line);
    else if (label == "SYS / PHASE SHIFT" || label == "SYS / PHASE SHIFTS")
      take_phase_shift(line);
    else if (label == "WAVELENGTH FACT L1/2")
      take_wavelength_factor(line);
    else if (label == "RCV CLOCK OFFS APPL")
      header_.clock_offset_applied = without_blanks(field(line, 0, 6)) == "1";
    return std::nullopt;
  }

  /// Checks the lists of types and builds the layouts, unless nothing about them changed. Types that are not used are logged.
  [[nodiscard]] std::optional<Diagnostic> finish(const TextReader& text, SkipLog& log) {
    current_ = kNoList;
    if (!std::exchange(changed_, false)) return std::nullopt;
    bool any = false;
    for (TypeList& list : lists_) {
      if (list.announced != static_cast<int>(list.types.size()))
        return Diagnostic{text.name(), list.line,
                          "the header announces " + std::to_string(list.announced) + " observation types" + of_system(list.letter) +
                              " and lists " + std::to_string(list.types.size()),
                          "repair the record or convert the raw data again: the columns cannot be told apart"};
      for (std::size_t i = 0; i < gnss::kConstellations; ++i) {
        const auto c = static_cast<gnss::Constellation>(i);
        if (list.letter != ' ' && list.letter != gnss::letter_of(c)) continue;
        any = any || !list.types.empty();
        header_.layouts[i] = layout_from_types(c, list.types, header_.first_line.version);
        apply_scales(list, header_.layouts[i]);
      }
      if (list.fresh) log_unused(list, log);
      list.fresh = false;
    }
    if (any) return std::nullopt;
    return Diagnostic{
        text.name(), text.line_number(),
        lists_.empty() ? "the header lists no observation types" : "the header lists no observation types of GPS, Galileo, BeiDou or QZSS",
        "the record 'SYS / # / OBS TYPES' (RINEX 2: '# / TYPES OF OBSERV') is needed: convert the raw data again"};
  }

  /// Number of columns of a system letter (blank: RINEX 2, all systems), also of systems that are not used.
  [[nodiscard]] std::size_t columns_of(char letter) const {
    for (const TypeList& list : lists_)
      if (list.letter == letter) return list.types.size();
    return 0;
  }

 private:
  static constexpr std::size_t kNoList = static_cast<std::size_t>(-1);
  struct TypeList {
    char letter{' '};
    int announced{0};
    std::vector<std::string> types;
    long line{0};
    bool fresh{true};
  };
  struct Scale {
    char letter{' '};
    double factor{1};
    std::vector<std::string> types;  ///< empty: all
  };

  [[nodiscard]] static std::string of_system(char letter) { return letter == ' ' ? std::string{} : std::string{" for "} + letter; }

  /// A first or following line of a list: `count` is blank on following ones.
  [[nodiscard]] std::optional<Diagnostic> take_types(const TextReader& text, std::string_view line, char letter, std::string_view count,
                                                     std::size_t at, std::size_t step, std::size_t width, std::size_t most) {
    changed_ = true;
    int announced = 0;
    const FieldState state = read_integer(count, announced);
    const auto problem = [&](std::string message) {
      return Diagnostic{text.name(), text.line_number(), std::move(message),
                        "repair the record or convert the raw data again: the columns cannot be told apart"};
    };
    if (state == FieldState::malformed || announced < 0 || announced > 999)
      return problem("the number of observation types, '" + std::string{without_blanks(count)} + "', is not one of 0 .. 999");
    if (state == FieldState::number) {
      current_ = list_of(letter);
      lists_[current_] = {letter, announced, {}, text.line_number(), true};
    } else if (current_ == kNoList) {
      return problem("a list of observation types continues that never began");
    }
    TypeList& list = lists_[current_];
    for (std::size_t i = 0; i < most && static_cast<int>(list.types.size()) < list.announced; ++i) {
      const std::string_view type = without_blanks(field(line.substr(0, 60), at + i * step, width));
      if (type.empty()) break;
      list.types.emplace_back(type);
    }
    return std::nullopt;
  }

  [[nodiscard]] std::size_t list_of(char letter) {
    for (std::size_t i = 0; i < lists_.size(); ++i)
      if (lists_[i].letter == letter) return i;
    lists_.push_back({letter, 0, {}, 0, true});
    return lists_.size() - 1;
  }

  [[nodiscard]] std::optional<Diagnostic> take_first_time(const TextReader& text, std::string_view line) {
    const std::string_view name = without_blanks(field(line, 48, 3));
    if (!name.empty()) {
      const std::optional<TimeSystem> system = time_system_from_text(name);
      if (!system)
        return Diagnostic{text.name(), text.line_number(), "the time system '" + std::string{name} + "' is not known",
                          "write GPS, GAL, QZS, BDT, GLO or UTC into columns 49-51 of TIME OF FIRST OBS"};
      header_.time_system = *system;
    }
    CivilEpoch t;
    int* const parts[] = {&t.year, &t.month, &t.day, &t.hour, &t.minute};
    bool good = read_nanoseconds(field(line, 30, 13), t.second_ns) == FieldState::number;
    for (std::size_t i = 0; i < 5; ++i) good = read_integer(field(line, 6 * i, 6), *parts[i]) == FieldState::number && good;
    header_.first_observation = good && t.valid() ? std::optional{t.to_gps(header_.time_system)} : std::nullopt;
    return std::nullopt;
  }

  [[nodiscard]] static bool take_vector(std::string_view line, Eigen::Vector3d& out) {
    Eigen::Vector3d v;
    for (int i = 0; i < 3; ++i)
      if (read_fixed(field(line, static_cast<std::size_t>(14 * i), 14), v[i]) != FieldState::number) return false;
    out = v;
    return true;
  }

  void take_position(const TextReader& text, std::string_view line, SkipLog& log) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    header_.approx_position_e_m.reset();
    const bool blank = without_blanks(field(line, 0, 42)).empty();
    if (!blank && !take_vector(line, p))
      log.add("APPROX POSITION XYZ is not readable", text.line_number(), "give the position on the command line or in the rig file");
    else if (p.norm() >= 1e6)
      header_.approx_position_e_m = p;
  }

  void take_interval(std::string_view line) {
    double interval = 0;
    if (read_fixed(field(line, 0, 10), interval) == FieldState::number && interval > 0) header_.interval_s = interval;
  }

  void take_leap_seconds(std::string_view line) {
    int leap = 0;
    if (read_integer(field(line, 0, 6), leap) == FieldState::number) header_.leap_seconds = leap;
  }

  void take_phase_shift(std::string_view line) {
    const char text[] = {column(line, 0), column(line, 3), column(line, 4)};
    PhaseShift shift;
    if (!gnss::signal_from_text(text, 3, shift.signal)) return;
    if (read_fixed(field(line, 6, 8), shift.cycles) == FieldState::malformed) return;
    for (PhaseShift& known : header_.phase_shifts)
      if (known.signal == shift.signal) return void(known = shift);
    header_.phase_shifts.push_back(shift);
  }

  void take_wavelength_factor(std::string_view line) {
    if (!without_blanks(field(line, 12, 6)).empty()) return;  // of single satellites: the LLI tells those
    for (std::size_t i = 0; i < 2; ++i) {
      int factor = 1;
      if (read_integer(field(line, 6 * i, 6), factor) == FieldState::number) header_.wavelength_factor[i] = factor;
    }
  }

  void take_scale(std::string_view line) {
    int factor = 0;
    if (column(line, 0) != ' ' && read_integer(field(line, 2, 4), factor) == FieldState::number && factor > 0)
      scales_.push_back({column(line, 0), static_cast<double>(factor), {}});
    if (scales_.empty()) return;
    changed_ = true;
    for (std::size_t i = 0; i < 12; ++i)
      if (const auto type = without_blanks(field(line.substr(0, 60), 11 + 4 * i, 3)); !type.empty())
        scales_.back().types.emplace_back(type);
  }

  void apply_scales(const TypeList& list, ObservationLayout& layout) const {
    for (const Scale& scale : scales_) {
      if (scale.letter != list.letter) continue;
      for (std::size_t i = 0; i < list.types.size(); ++i) {
        bool meant = scale.types.empty();
        for (const std::string& type : scale.types) meant = meant || type == list.types[i];
        if (meant) layout.columns[i].scale = scale.factor;
      }
    }
  }

  /// Logs the types that no constellation of the list uses (all of them for a system that is not modelled: one entry).
  void log_unused(const TypeList& list, SkipLog& log) const {
    gnss::Constellation c{};
    if (list.letter != ' ' && !gnss::constellation_from_letter(list.letter, c)) return;
    for (std::size_t i = 0; i < list.types.size(); ++i) {
      bool used = false;
      for (std::size_t k = 0; k < gnss::kConstellations; ++k)
        if (list.letter == ' ' || list.letter == gnss::letter_of(static_cast<gnss::Constellation>(k)))
          used = used || header_.layouts[k].columns[i].quantity != 0;
      if (!used) log.add("observation type " + list.types[i] + of_system(list.letter) + " is not used", list.line);
    }
  }

  RinexObservationHeader header_;
  std::vector<TypeList> lists_;
  std::vector<Scale> scales_;
  std::size_t current_{kNoList};
  bool changed_{true};  ///< since the layouts were built
};

}  // namespace searvins::io
