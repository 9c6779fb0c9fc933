// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// RINEX 2, 3 and 4 observation files, read epoch by epoch as gnss::ObservationEpoch with tags in GPS time.
///
/// What the file calls a value and what becomes of it:
///
///     blank or 0        missing
///     no number         missing, counted (NaN, inf, ****, text, a shifted column)
///     LLI bit 0, 1      of the phase: loss_of_lock, half_cycle (RINEX 2: bit 1 inverts the header's wavelength factor)
///     SSI 1..9          only where the signal has no C/N0 of its own: 6 SSI + 3 dB-Hz, the middle of its class of 6 dB
///     clock offset      of the epoch line: kept aside (receiver_clock_offset_s), never applied
///
/// A flaw costs the smallest thing that holds it: a value, a satellite, an epoch; it is counted with its first line and never ends the
/// run. An epoch is delivered whole or not at all, tags rise strictly, and a last line without line end counts as cut off; so any
/// beginning of a file gives a beginning of its epochs. A loss of lock that stood in a skipped epoch is passed on to the next one.
/// Only what makes every later column unreadable ends the reading with a Diagnostic: see error().
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/fixed_field.hpp>
#include <searvins/io/rinex_common.hpp>
#include <searvins/io/rinex_epoch_assembly.hpp>
#include <searvins/io/rinex_epoch_line.hpp>
#include <searvins/io/rinex_observation_header.hpp>
#include <searvins/io/rinex_satellite_line.hpp>
#include <searvins/io/text_reader.hpp>

namespace searvins::io {

/// What a reader has seen so far.
struct ObservationReadSummary {
  long epochs{0};          ///< delivered
  long epochs_skipped{0};  ///< left out, each with a reason in the log
  std::array<long, 7>
      flags{};  ///< epoch lines by flag: [2] moving antenna, [3] new site, [4] header records, [5] external event, [6] cycle slips
  long spliced_headers{0};  ///< whole headers in mid-file (files that were concatenated)
  std::optional<GpsTime> first, last;
  SkipLog skipped;
};

/// Streams a RINEX observation file.
class RinexObservationReader {
 public:
  static constexpr int kMaxAnnounced = 400;                ///< satellites of an epoch; more is taken for a damaged count
  static constexpr double kMaxJumpSeconds = 30 * 86400.0;  ///< a tag that jumps further is believed when the next one agrees

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

  /// The header, with the changes that were spliced in up to the epoch delivered last.
  [[nodiscard]] const RinexObservationHeader& header() const { return parser_.header(); }
  /// Why the reading ended early, or why there was no epoch at all.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return error_; }
  [[nodiscard]] const ObservationReadSummary& summary() const { return summary_; }
  /// Receiver clock offset that the file gave for the epoch delivered last, seconds.
  [[nodiscard]] std::optional<double> receiver_clock_offset_s() const { return clock_offset_s_; }

  /// The next usable epoch; false at the end of the file or on an error.
  [[nodiscard]] bool next(gnss::ObservationEpoch& out) {
    std::string_view line;
    while (!error_ && text_.next(line)) {
      if (line.empty() || header_label(line) == "COMMENT") continue;
      if (header_label(line) == "RINEX VERSION / TYPE") {
        text_.unread();
        ++summary_.spliced_headers;
        if (!read_header()) return false;
        continue;
      }
      const std::optional<EpochLine> epoch = read_epoch_line(line);
      if (!epoch || line.find('\t') != std::string_view::npos) {
        skip_strange_line(line);
        continue;
      }
      ++summary_.flags[static_cast<std::size_t>(epoch->flag)];
      if (epoch->flag == 6)
        resynchronise();
      else if (epoch->is_event())
        take_event(*epoch);
      else if (take_epoch(*epoch, line, out))
        return true;
    }
    if (!error_ && summary_.epochs == 0) error_ = no_epochs();
    return false;
  }

  /// The next usable epoch by value.
  [[nodiscard]] std::optional<gnss::ObservationEpoch> next() {
    std::optional<gnss::ObservationEpoch> epoch{std::in_place};
    if (!next(*epoch)) epoch.reset();
    return epoch;
  }

 private:
  static constexpr const char kTab[] = "tab character in a fixed-column line";
  static constexpr const char kTabHint[] = "run expand on the file";
  static constexpr const char kEnds[] = "the file ends inside an epoch: it may have been cut";

  bool begin() {
    summary_ = {};
    clock_offset_s_.reset();
    suspect_.reset();
    assembler_.reset();
    return read_header();
  }

  /// Reads a header from its first line to its end.
  bool read_header() {
    RinexFirstLine first;
    const long first_number = text_.line_number() + 1;
    if ((error_ = read_first_line(text_, 'O', first))) {
      if (error_->line > 0) error_->line = first_number;
      return false;
    }
    parser_.begin(first);
    std::string_view line;
    while (text_.next(line)) {
      if (header_label(line) == "END OF HEADER") return !(error_ = parser_.finish(text_, summary_.skipped));
      if (looks_like_epoch(line) && header_label(line) != "COMMENT") return !(error_ = no_end_of_header("observations begin"));
      if ((error_ = parser_.take(text_, line, summary_.skipped))) return false;
    }
    return !(error_ = no_end_of_header("the file ends"));
  }

  [[nodiscard]] Diagnostic no_end_of_header(const char* what_happens) const {
    return {text_.name(), text_.line_number(), std::string{"the header has no END OF HEADER line: "} + what_happens + " here",
            "the file was cut or edited: get it again, or add the line with its label in column 61"};
  }

  [[nodiscard]] Diagnostic no_epochs() const {
    Diagnostic d{text_.name(), text_.line_number(), "the file holds a header and no usable epoch",
                 "record again, or check that the transfer was complete"};
    if (!summary_.skipped.items().empty() && summary_.epochs_skipped > 0) {
      for (const SkippedItem& item : summary_.skipped.items())
        if (item.first_line >= first_skip_line_) {
          d.message += " (" + std::to_string(summary_.epochs_skipped) + " skipped, first: " + item.reason + ')';
          d.line = item.first_line;
          break;
        }
    }
    return d;
  }

  [[nodiscard]] bool modern() const { return header().first_line.major() > 2; }
  [[nodiscard]] std::optional<EpochLine> read_epoch_line(std::string_view line) const {
    return modern() ? read_epoch_line_3(line) : read_epoch_line_2(line);
  }
  [[nodiscard]] bool looks_like_epoch(std::string_view line) const {
    if (modern()) return column(line, 0) == '>';
    const auto epoch = read_epoch_line_2(line);
    return epoch && epoch->dated;
  }

  void skip_epoch(std::string_view reason, long line, std::string_view hint) {
    if (summary_.epochs_skipped++ == 0) first_skip_line_ = line;
    summary_.skipped.add(reason, line, hint);
  }

  /// A line where an epoch should begin. In RINEX 2 nothing tells a damaged epoch line from any other.
  void skip_strange_line(std::string_view line) {
    if (line.find('\t') != std::string_view::npos)
      skip_epoch(kTab, text_.line_number(), kTabHint);
    else if (!modern() || looks_like_epoch(line))
      skip_epoch("epoch line is not readable", text_.line_number(), "");
    else
      summary_.skipped.add("lines that belong to no epoch", text_.line_number());
    resynchronise();
  }

  /// Moves to before the next line that can open an epoch or a header.
  void resynchronise() {
    std::string_view line;
    while (text_.next(line))
      if (looks_like_epoch(line) || header_label(line) == "RINEX VERSION / TYPE") return text_.unread();
  }

  /// Flags 2 to 5: as many records as announced; those of 2, 3 and 4 are header records.
  void take_event(const EpochLine& event) {
    std::string_view line;
    for (int i = 0; i < event.count; ++i) {
      if (!text_.next(line)) return summary_.skipped.add("the file ends inside the records of an event", text_.line_number());
      if (looks_like_epoch(line)) {
        summary_.skipped.add("an event announces more records than follow", text_.line_number());
        text_.unread();
        break;
      }
      if (event.flag != 5 && (error_ = parser_.take(text_, line, summary_.skipped))) return;
    }
    if (event.flag != 5) error_ = parser_.finish(text_, summary_.skipped);
  }

  /// Flags 0 and 1. True when the epoch is good and stands in `out`.
  [[nodiscard]] bool take_epoch(const EpochLine& epoch, std::string_view line, gnss::ObservationEpoch& out) {
    const long number = text_.line_number();
    if (epoch.count < 0 || epoch.count > kMaxAnnounced) {
      skip_epoch("absurd number of satellites", number, "the epoch line is damaged");
      resynchronise();
      return false;
    }
    assembler_.begin(epoch.flag == 1);
    const char* wrong = modern() ? read_satellites_3(epoch.count) : read_satellites_2(epoch.count, line);
    if (!wrong && !text_.line_is_terminated()) wrong = kEnds;
    const GpsTime tag = epoch.civil.to_gps(header().time_system);
    if (!wrong) wrong = judge_tag(tag);
    if (wrong) {
      skip_epoch(wrong, number, wrong == kTab ? kTabHint : "");
      assembler_.skip();
      return false;
    }
    assembler_.finish(tag, number, summary_.skipped, out);
    ++summary_.epochs;
    if (!summary_.first) summary_.first = tag;
    summary_.last = tag;
    clock_offset_s_ = epoch.clock_offset_s;
    return true;
  }

  /// Why a tag cannot follow the earlier ones; nullptr when it can. A jump of months is a damaged date, unless the next tag agrees.
  [[nodiscard]] const char* judge_tag(GpsTime tag) {
    if (summary_.last && tag == *summary_.last) return "epoch is a duplicate of the one before";
    if (summary_.last && tag < *summary_.last) return "epoch goes back in time";
    const std::optional<GpsTime> reference = summary_.last ? summary_.last : header().first_observation;
    const auto near = [tag](const std::optional<GpsTime>& t) { return t && std::abs(seconds_between(*t, tag)) <= kMaxJumpSeconds; };
    const bool believed = !reference || near(reference) || near(suspect_);
    suspect_ = believed ? std::nullopt : std::optional{tag};
    return believed ? nullptr : "date jumps by more than 30 days";
  }

  /// RINEX 3, 4: a line a satellite. What is wrong, or nullptr.
  [[nodiscard]] const char* read_satellites_3(int count) {
    std::string_view line;
    bool tab = false;
    for (int i = 0; i < count; ++i) {
      if (!text_.next(line)) return kEnds;
      if (column(line, 0) == '>') {
        text_.unread();
        return "epoch announces more satellites than follow";
      }
      tab = tab || line.find('\t') != std::string_view::npos;
      gnss::SatelliteId id;
      if (tab || !read_name(line, id)) continue;
      collector_.begin(columns(id), header(), text_.line_number());
      collector_.take(line.substr(std::min<std::size_t>(line.size(), 3)), columns(id).size(), summary_.skipped);
      keep(id);
    }
    return tab ? kTab : nullptr;
  }

  /// RINEX 2: names on the epoch line, twelve a line, then lines of five values. What is wrong, or nullptr.
  [[nodiscard]] const char* read_satellites_2(int count, std::string_view line) {
    bool tab = line.find('\t') != std::string_view::npos;
    names_.clear();
    for (int i = 0; i < count; ++i) {
      if (i > 0 && i % 12 == 0 && !next_line_2(line, tab)) return stopped_2();
      const std::string_view name = field(line, 32 + 3 * static_cast<std::size_t>(i % 12), 3);
      names_.push_back({column(name, 0), column(name, 1), column(name, 2)});
    }
    const std::size_t types = parser_.columns_of(' ');
    for (const std::array<char, 3>& name : names_) {
      gnss::SatelliteId id;
      const bool known = read_name({name.data(), 3}, id);
      if (known) collector_.begin(columns(id), header(), text_.line_number());
      for (std::size_t done = 0; done < types; done += 5) {
        if (!next_line_2(line, tab)) return stopped_2();
        if (known && !tab) collector_.take(line, std::min<std::size_t>(5, types - done), summary_.skipped);
      }
      if (known && !tab) keep(id);
    }
    return tab ? kTab : nullptr;
  }

  /// The next line of a RINEX 2 epoch; false at the end and where the next epoch begins too early (that line is put back).
  [[nodiscard]] bool next_line_2(std::string_view& line, bool& tab) {
    too_few_lines_ = false;
    if (!text_.next(line)) return false;
    tab = tab || line.find('\t') != std::string_view::npos;
    if (!looks_like_epoch(line)) return true;
    text_.unread();
    too_few_lines_ = true;
    return false;
  }
  [[nodiscard]] const char* stopped_2() const { return too_few_lines_ ? "epoch announces more satellites than follow" : kEnds; }

  /// A satellite of ours from "G01", "G 1" or (RINEX 2) "  1"; others are counted.
  [[nodiscard]] bool read_name(std::string_view text, gnss::SatelliteId& id) {
    char letter = column(text, 0);
    if (letter == ' ' && !modern()) letter = 'G';
    int number = 0;
    const bool numbered = read_integer(field(text, 1, 2), number) == FieldState::number && number >= 1 && number <= 99;
    const char* const foreign = letter == 'R'   ? "GLONASS satellite is not used"
                                : letter == 'S' ? "SBAS satellite is not used"
                                : letter == 'I' ? "NavIC satellite is not used"
                                                : nullptr;
    if (foreign && numbered) return summary_.skipped.add(foreign, text_.line_number()), false;
    if (!numbered || number > 63 || !gnss::constellation_from_letter(letter, id.constellation))
      return summary_.skipped.add("satellite name is not readable", text_.line_number()), false;
    id.number = static_cast<std::uint8_t>(number);
    if (columns(id).empty()) {
      summary_.skipped.add(std::string{"no observation types in the header for "} + gnss::name_of(id.constellation), text_.line_number());
      return false;
    }
    return true;
  }

  [[nodiscard]] const std::vector<ObservationColumn>& columns(gnss::SatelliteId id) const { return layout(id).columns; }
  [[nodiscard]] const ObservationLayout& layout(gnss::SatelliteId id) const {
    return header().layouts[static_cast<std::size_t>(id.constellation)];
  }

  void keep(gnss::SatelliteId id) {
    gnss::SatelliteObservation satellite{id, {}};
    collector_.finish(layout(id), satellite, summary_.skipped);
    assembler_.add(satellite);
  }

  TextReader text_;
  ObservationHeaderParser parser_;
  std::optional<Diagnostic> error_;
  ObservationReadSummary summary_;
  std::optional<double> clock_offset_s_;
  std::optional<GpsTime> suspect_;  ///< tag that was skipped because it jumped
  long first_skip_line_{0};
  bool too_few_lines_{false};
  std::vector<std::array<char, 3>> names_;  ///< RINEX 2: the satellites of the epoch at hand
  SatelliteLineCollector collector_;
  EpochAssembler assembler_;
};

/// A whole observation file.
struct RinexObservationFile {
  RinexObservationHeader header;
  ObservationReadSummary summary;
  std::vector<gnss::ObservationEpoch> epochs;
};

namespace detail {

[[nodiscard]] inline Parsed<RinexObservationFile> read_all_epochs(RinexObservationReader& reader, bool opened) {
  Parsed<RinexObservationFile> parsed;
  if (opened) {
    gnss::ObservationEpoch epoch;
    while (reader.next(epoch)) parsed.value.epochs.push_back(epoch);
  }
  parsed.value.header = reader.header();
  parsed.value.summary = reader.summary();
  parsed.skipped = reader.summary().skipped;
  parsed.error = reader.error();
  return parsed;
}

}  // namespace detail

/// Reads a whole file. With an error the epochs before it are there.
[[nodiscard]] inline Parsed<RinexObservationFile> read_rinex_observation(const std::filesystem::path& path) {
  RinexObservationReader reader;
  const bool opened = reader.open(path);
  return detail::read_all_epochs(reader, opened);
}

/// The same from a text in memory.
[[nodiscard]] inline Parsed<RinexObservationFile> read_rinex_observation_text(std::string text, std::string name = "<text>") {
  RinexObservationReader reader;
  const bool opened = reader.open_text(std::move(text), std::move(name));
  return detail::read_all_epochs(reader, opened);
}

}  // namespace searvins::io
