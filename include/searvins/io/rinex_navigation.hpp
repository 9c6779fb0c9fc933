// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// RINEX 2, 3 and 4 navigation files: broadcast ephemerides of GPS and QZSS (LNAV), Galileo (I/NAV, F/NAV) and BeiDou (D1, D2), and
/// the Klobuchar coefficients.
///
///     RINEX 2      type N, GPS only; records of 1 + 7 lines, continuation lines begin with three blanks
///     RINEX 3      a satellite letter opens a record, continuation lines begin with four blanks
///     RINEX 4      "> EPH G01 LNAV" opens a record; of the ION records the Klobuchar ones are taken
///
/// Records of other systems and messages are skipped and counted; a bad record is skipped with its reason; neither ends the run.
/// Klobuchar coefficients are those of GPS, else QZSS, else BeiDou; of several sets of one system the first is kept.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/gnss/ephemeris.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/rinex_common.hpp>
#include <searvins/io/rinex_navigation_record.hpp>
#include <searvins/io/text_reader.hpp>

namespace searvins::io {

/// Streams a RINEX navigation file.
class RinexNavigationReader {
 public:
  /// Opens a file and reads its header; false, and error() says why, when it cannot be used.
  [[nodiscard]] bool open(const std::filesystem::path& path) {
    error_ = text_.open(path);
    return !error_ && begin();
  }

  /// The same from a text in memory.
  [[nodiscard]] bool open_text(std::string text, std::string name = "<text>") {
    error_ = text_.open_text(std::move(text), std::move(name));
    return !error_ && begin();
  }

  [[nodiscard]] const RinexFirstLine& first_line() const { return first_line_; }
  [[nodiscard]] std::optional<int> leap_seconds() const { return leap_seconds_; }
  /// Klobuchar coefficients met so far; complete after the last record.
  [[nodiscard]] gnss::KlobucharCoefficients ionosphere() const {
    for (const gnss::KlobucharCoefficients& k : klobuchar_)
      if (k.present()) return k;
    return {};
  }
  /// Why the file cannot be used, or why there was no record at all.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return error_; }
  [[nodiscard]] const SkipLog& skipped() const { return skipped_; }
  /// Records delivered.
  [[nodiscard]] long records() const { return records_; }

  /// The next usable record; false at the end of the file.
  [[nodiscard]] bool next(gnss::Ephemeris& out) {
    while (!error_ && gather())
      if (take(out)) {
        ++records_;
        return true;
      }
    if (!error_ && records_ == 0)
      error_ = Diagnostic{
          text_.name(), text_.line_number(), "the file holds no usable ephemeris of GPS, Galileo, BeiDou or QZSS",
          skipped_.items().empty() ? "check that the transfer was complete" : "first skipped: " + skipped_.items().front().reason};
    return false;
  }

 private:
  bool begin() {
    first_line_ = {};
    skipped_ = {};
    records_ = 0;
    klobuchar_ = {};
    leap_seconds_.reset();
    if ((error_ = read_first_line(text_, 'N', first_line_))) return false;
    std::string_view line;
    while (text_.next(line)) {
      const std::string_view label = header_label(line);
      if (label == "END OF HEADER") return true;
      if ((error_ = refuse_tab_in_header(text_, line))) return false;
      if (opens_record(line) && first_line_.major() == 4) return !(error_ = no_end_of_header("records begin"));
      if (label == "ION ALPHA")
        take_klobuchar(field(line, 2, 58), klobuchar_[0].alpha);
      else if (label == "ION BETA")
        take_klobuchar(field(line, 2, 58), klobuchar_[0].beta);
      else if (label == "IONOSPHERIC CORR")
        take_ionosphere(line);
      else if (label == "LEAP SECONDS")
        take_leap_seconds(line);
    }
    return !(error_ = no_end_of_header("the file ends"));
  }

  [[nodiscard]] Diagnostic no_end_of_header(const char* what_happens) const {
    return {text_.name(), text_.line_number(), std::string{"the header has no END OF HEADER line: "} + what_happens + " here",
            "the file was cut or edited: get it again, or add the line with its label in column 61"};
  }

  void take_klobuchar(std::string_view text, double (&out)[4]) {
    double values[4]{};
    for (std::size_t i = 0; i < 4; ++i)
      if (read_exponential(field(text, 12 * i, 12), values[i]) == FieldState::malformed)
        return skipped_.add("ionosphere coefficients are not readable", text_.line_number());
    for (std::size_t i = 0; i < 4; ++i) out[i] = values[i];
  }

  /// Place of a system's Klobuchar set, in order of preference; 3 for none.
  [[nodiscard]] static std::size_t klobuchar_rank(std::string_view system) {
    return system == "GPS" ? 0 : system == "QZS" ? 1 : system == "BDS" ? 2 : 3;
  }

  void take_ionosphere(std::string_view line) {
    const std::size_t rank = klobuchar_rank(field(line, 0, 3));
    if (rank == 3) return;
    gnss::KlobucharCoefficients& k = klobuchar_[rank];
    if (column(line, 3) == 'A' && !k.present()) take_klobuchar(field(line, 5, 55), k.alpha);
    if (column(line, 3) == 'B' && k.beta[0] == 0 && k.beta[1] == 0) take_klobuchar(field(line, 5, 55), k.beta);
  }

  void take_leap_seconds(std::string_view line) {
    int leap = 0;
    if (read_integer(field(line, 0, 6), leap) == FieldState::number) leap_seconds_ = leap;
  }

  /// The first line of a record: something stands where continuation lines are blank.
  [[nodiscard]] bool opens_record(std::string_view line) const {
    if (first_line_.major() == 4) return column(line, 0) == '>';
    return !without_blanks(field(line, 0, first_line_.major() == 2 ? 3 : 4)).empty();
  }

  /// Collects the lines of the next record; false at the end of the file. Lines beyond the tenth are read and left.
  [[nodiscard]] bool gather() {
    std::string_view line;
    count_ = 0;
    cut_ = tab_ = false;
    while (text_.next(line)) {
      if (line.empty()) continue;
      if (opens_record(line) && count_ > 0) {
        text_.unread();
        return true;
      }
      if (!opens_record(line) && count_ == 0) {
        skipped_.add("lines that belong to no record", text_.line_number());
        continue;
      }
      if (count_ == 0) line_ = text_.line_number();
      tab_ = tab_ || line.find('\t') != std::string_view::npos;
      cut_ = !text_.line_is_terminated();
      if (count_ < lines_.size()) lines_[count_].assign(line.substr(0, 120));
      ++count_;
    }
    return count_ > 0;
  }

  bool skip(std::string_view reason, std::string_view hint = {}) {
    skipped_.add(reason, line_, hint);
    return false;
  }

  /// Reads the collected record; true when it gave an ephemeris.
  [[nodiscard]] bool take(gnss::Ephemeris& out) {
    if (tab_) return skip("tab character in a fixed-column line", "run expand on the file");
    if (cut_) return skip("the file ends inside a record: it may have been cut");
    if (first_line_.major() == 4) return take_modern(out);
    return take_ephemeris(0, nullptr, out);
  }

  /// RINEX 4: what the record is stands in its first line.
  [[nodiscard]] bool take_modern(gnss::Ephemeris& out) {
    const std::string_view head = lines_[0];
    const std::string_view kind = without_blanks(field(head, 2, 3)), name = without_blanks(field(head, 10, 4));
    if (kind == "ION" && (name == "LNAV" || name == "D1D2" || name == "KLOB")) return take_modern_ionosphere(column(head, 6)), false;
    if (kind == "ION" || kind == "STO" || kind == "EOP") return skip(std::string{kind} + " record is not used");
    if (kind != "EPH") return skip("record of an unknown kind");
    constexpr std::pair<std::string_view, gnss::NavigationMessage> messages[] = {
        {"LNAV", gnss::NavigationMessage::gps_lnav},     {"INAV", gnss::NavigationMessage::galileo_inav},
        {"FNAV", gnss::NavigationMessage::galileo_fnav}, {"D1", gnss::NavigationMessage::beidou_d1},
        {"D2", gnss::NavigationMessage::beidou_d2},
    };
    for (const auto& [text, message] : messages) {
      if (name != text) continue;
      const bool qzss = column(head, 6) == 'J';
      const gnss::NavigationMessage named = qzss ? gnss::NavigationMessage::qzss_lnav : message;
      constexpr std::string_view letters = "GJEECC";  // by NavigationMessage
      if (letters[static_cast<std::size_t>(named)] != column(head, 6)) return skip("message does not belong to the satellite's system");
      return take_ephemeris(1, &named, out);
    }
    return skip(std::string{column(head, 6)} + " message " + std::string{name} + " is not used");
  }

  /// RINEX 4 Klobuchar: a date and alpha 0-2; alpha 3, beta 0-2; beta 3.
  void take_modern_ionosphere(char letter) {
    const std::size_t rank = letter == 'G' ? 0U : letter == 'J' ? 1U : letter == 'C' ? 2U : 3U;
    if (rank == 3 || klobuchar_[rank].present()) return;
    double values[8]{};
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t at = i + 1, line = 1 + at / 4;  // the date takes the place of one number
      if (line >= count_ || read_exponential(field(lines_[line], 4 + 19 * (at % 4), 19), values[i]) != FieldState::number)
        return skipped_.add("ionosphere coefficients are not readable", line_);
    }
    for (std::size_t i = 0; i < 4; ++i) klobuchar_[rank].alpha[i] = values[i], klobuchar_[rank].beta[i] = values[4 + i];
  }

  /// An ephemeris from lines_[first] on.
  [[nodiscard]] bool take_ephemeris(std::size_t first, const gnss::NavigationMessage* message, gnss::Ephemeris& out) {
    const bool old = first_line_.major() == 2;
    const std::string_view head = first < count_ ? std::string_view{lines_[first]} : std::string_view{};
    const char letter = old ? 'G' : column(head, 0);
    int number = 0;
    if (read_integer(old ? field(head, 0, 2) : field(head, 1, 2), number) != FieldState::number || number < 1 || number > 99)
      return skip("satellite name is not readable");
    if (letter == 'R') return skip("GLONASS record is not used");
    if (letter == 'S') return skip("SBAS record is not used");
    if (letter == 'I') return skip("NavIC record is not used");
    NavigationRecord r;
    if (number > 63 || !gnss::constellation_from_letter(letter, r.satellite.constellation)) return skip("satellite name is not readable");
    r.satellite.number = static_cast<std::uint8_t>(number);
    if (!read_clock_date(head, old, r.toc)) return skip("date of the record is not readable");
    if (count_ < first + 7) return skip("record has too few lines");
    if (!read_numbers(first, old, r)) return skip("number of the record is missing or not readable");
    const ConvertedRecord converted = to_ephemeris(r, message);
    if (converted.wrong) return skip(converted.wrong);
    if (converted.week_differs) skipped_.add("week number contradicts the date (the date is believed, the record used)", line_);
    out = converted.ephemeris;
    return true;
  }

  [[nodiscard]] static bool read_clock_date(std::string_view head, bool old, CivilEpoch& t) {
    int* const parts[] = {&t.year, &t.month, &t.day, &t.hour, &t.minute};
    std::size_t at = old ? 3 : 4;
    for (std::size_t i = 0; i < 5; ++i) {
      const std::size_t width = i == 0 && !old ? 4 : 2;
      if (read_integer(field(head, at, width), *parts[i]) != FieldState::number) return false;
      at += width + 1;
    }
    if (old) t.year = t.year < 0 || t.year > 99 ? 0 : full_year(t.year);
    return read_nanoseconds(old ? field(head, 17, 5) : field(head, 21, 2), t.second_ns) == FieldState::number && t.valid();
  }

  /// All numbers; those of clock and orbit (rows 0 to 3) must be there, blanks elsewhere are zero.
  [[nodiscard]] bool read_numbers(std::size_t first, bool old, NavigationRecord& r) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (read_exponential(field(lines_[first], (old ? 22U : 23U) + 19 * i, 19), r.clock[i]) != FieldState::number) return false;
    for (std::size_t row = 0; row < 7 && first + 1 + row < count_; ++row)
      for (std::size_t i = 0; i < 4; ++i) {
        const FieldState state = read_exponential(field(lines_[first + 1 + row], (old ? 3U : 4U) + 19 * i, 19), r.orbit[row][i]);
        const bool needed = row < 4 || (row == 6 && i == 0);
        if (state == FieldState::malformed && (needed || row < 6)) return false;
        if (state == FieldState::blank && row < 4) return false;
      }
    return true;
  }

  TextReader text_;
  RinexFirstLine first_line_;
  std::optional<Diagnostic> error_;
  SkipLog skipped_;
  std::optional<int> leap_seconds_;
  std::array<gnss::KlobucharCoefficients, 3> klobuchar_{};  ///< GPS, QZSS, BeiDou
  long records_{0};
  std::array<std::string, 10> lines_;  ///< the record at hand
  std::size_t count_{0};               ///< its lines, which may be more
  long line_{0};                       ///< where it begins
  bool cut_{false}, tab_{false};
};

/// A whole navigation file.
struct RinexNavigationFile {
  RinexFirstLine first_line;
  std::vector<gnss::Ephemeris> ephemerides;  ///< in the order of the file
  gnss::KlobucharCoefficients ionosphere;
  std::optional<int> leap_seconds;
};

namespace detail {

[[nodiscard]] inline Parsed<RinexNavigationFile> read_all_records(RinexNavigationReader& reader, bool opened) {
  Parsed<RinexNavigationFile> parsed;
  gnss::Ephemeris e;
  while (opened && reader.next(e)) parsed.value.ephemerides.push_back(e);
  parsed.value.first_line = reader.first_line();
  parsed.value.ionosphere = reader.ionosphere();
  parsed.value.leap_seconds = reader.leap_seconds();
  parsed.skipped = reader.skipped();
  parsed.error = reader.error();
  return parsed;
}

}  // namespace detail

/// Reads a whole file. With an error the records before it are there.
[[nodiscard]] inline Parsed<RinexNavigationFile> read_rinex_navigation(const std::filesystem::path& path) {
  RinexNavigationReader reader;
  const bool opened = reader.open(path);
  return detail::read_all_records(reader, opened);
}

/// The same from a text in memory.
[[nodiscard]] inline Parsed<RinexNavigationFile> read_rinex_navigation_text(std::string text, std::string name = "<text>") {
  RinexNavigationReader reader;
  const bool opened = reader.open_text(std::move(text), std::move(name));
  return detail::read_all_records(reader, opened);
}

}  // namespace searvins::io
