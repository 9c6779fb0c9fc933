// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Reads stereo tracks that a frontend made earlier, frame by frame: memory is that of one frame, however long the drive.
///
///     t_gps_sow,track_id,u_left,u_right,v,score,semantic_class        one row per observation, sorted by time
///
/// The header names the columns, in any order; other columns are passed over. `score` and `semantic_class` may be missing (1 and no class),
/// `v_right` may be there: then v - v_right is the difference of the rows that admission looks at. Rows of the same time are one frame.
/// Seconds of week that fall by more than half a week begin the next week.
///
/// A row that cannot be read ends the reading, with file and line: who wrote it is a program, and a program that wrote one row wrongly
/// wrote others. Left out and counted are a last line cut off in the middle and a second row of the same track in a frame.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/text_reader.hpp>
#include <searvins/vision/stereo_observation.hpp>

namespace searvins::precomputed {

/// See the file comment.
class TrackReader {
 public:
  /// Opens a file whose first row is of the given GPS week. Errors: those of TextReader::open; a header that lacks a column.
  [[nodiscard]] std::optional<io::Diagnostic> open(const std::filesystem::path& path, std::int64_t week) {
    if (auto error = reader_.open(path)) return error;
    return begin(week);
  }
  /// The same from text; `name` stands for the file in messages.
  [[nodiscard]] std::optional<io::Diagnostic> open_text(std::string text, std::string name, std::int64_t week) {
    if (auto error = reader_.open_text(std::move(text), std::move(name))) return error;
    return begin(week);
  }

  /// Reads the next frame; false at the end of the file. What a frame has no room for is counted in it, see StereoFrame. Errors: a row that
  /// cannot be read, a time before that of the row above.
  template <std::size_t N>
  [[nodiscard]] io::FileResult<bool> next(vision::StereoFrame<N>& frame) {
    frame = {};
    tracks_.clear();
    if (!pending_ && !read_row()) return ended();
    frame.time = pending_->time;
    while (pending_ && pending_->time == frame.time) {
      add(frame, pending_->observation);
      pending_.reset();
      if (!read_row() && error_) return *error_;
    }
    return true;
  }

  /// What was left out.
  [[nodiscard]] const io::SkipLog& skipped() const { return skipped_; }

 private:
  enum Column : std::size_t {
    column_time,
    column_track,
    column_u_left,
    column_u_right,
    column_v,
    column_score,
    column_class,
    column_v_right
  };
  static constexpr std::size_t kColumns = 8;
  static constexpr std::array<std::string_view, kColumns> kNames{"t_gps_sow", "track_id", "u_left",         "u_right",
                                                                 "v",         "score",    "semantic_class", "v_right"};
  static constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();
  static constexpr double kMaxPixel = 1e6;
  struct Row {
    GpsTime time{};
    vision::StereoObservation observation{};
  };

  [[nodiscard]] std::optional<io::Diagnostic> begin(std::int64_t week) {
    week_ = week;
    last_.reset();
    pending_.reset();
    error_.reset();
    skipped_ = {};
    std::string_view line;
    if (!reader_.next(line)) return problem("the file has no header", kHeaderHint);
    const std::vector<std::string_view> fields = io::split(line, ',');
    for (std::size_t c = 0; c < kColumns; ++c) {
      const auto at = std::find(fields.begin(), fields.end(), kNames[c]);
      place_[c] = at == fields.end() ? kAbsent : static_cast<std::size_t>(at - fields.begin());
      if (place_[c] == kAbsent && c <= column_v) return problem("the header has no column " + std::string{kNames[c]}, kHeaderHint);
    }
    fields_ = fields.size();
    return std::nullopt;
  }

  [[nodiscard]] io::Diagnostic problem(std::string message, std::string hint = {}) const {
    return {reader_.name(), reader_.line_number(), std::move(message), std::move(hint)};
  }

  [[nodiscard]] io::FileResult<bool> ended() const {
    if (error_) return *error_;
    return false;
  }

  /// Reads a row into pending_; false at the end or with an error.
  [[nodiscard]] bool read_row() {
    std::string_view line;
    while (!error_ && reader_.next(line)) {
      if (line.empty() || line.front() == '#') continue;
      Row row;
      std::string wrong = parse(line, row);
      if (wrong.empty() && last_ && row.time < *last_) wrong = "the time is before that of the row above; sort the rows by time";
      if (wrong.empty()) {
        last_ = row.time;
        pending_ = row;
        return true;
      }
      if (!reader_.line_is_terminated()) {
        skipped_.add("last line cut off in the middle", reader_.line_number(), "the file or its copy ended early");
        continue;
      }
      error_ = problem(std::move(wrong));
    }
    return false;
  }

  /// An empty text, or what is wrong with the row.
  [[nodiscard]] std::string parse(std::string_view line, Row& row) {
    const std::vector<std::string_view> fields = io::split(line, ',');
    if (fields.size() != fields_)
      return "the row has " + std::to_string(fields.size()) + " fields, the header has " + std::to_string(fields_);
    const auto text = [&](Column c) { return place_[c] == kAbsent ? std::string_view{} : fields[place_[c]]; };
    const auto is_no_number = [&](Column c) {
      return std::string{kNames[c]} + " is no number in its range: \"" + std::string{text(c)} + '"';
    };
    vision::StereoObservation& o = row.observation;
    std::int64_t whole = 0;
    if (!io::parse_integer(text(column_track), whole) || whole < 0) return is_no_number(column_track);
    o.track = static_cast<std::uint64_t>(whole);
    double sow = 0, right_v = 0;
    if (!io::parse_number(text(column_time), sow) || sow < 0 || sow >= static_cast<double>(kSecondsPerWeek))
      return is_no_number(column_time);
    row.time = time_of(sow);
    constexpr std::array<std::pair<Column, int>, 3> kPixels{{{column_u_left, 0}, {column_u_right, 1}, {column_v, 2}}};
    for (const auto& [column, axis] : kPixels)
      if (!io::parse_number(text(column), o.pixel_px[axis]) || std::abs(o.pixel_px[axis]) > kMaxPixel) return is_no_number(column);
    if (place_[column_score] != kAbsent && (!io::parse_number(text(column_score), o.score) || o.score < 0 || o.score > 1))
      return is_no_number(column_score);
    if (!text(column_class).empty()) {
      if (!io::parse_integer(text(column_class), whole) || whole < -1 || whole > 255) return is_no_number(column_class);
      o.semantic_class = whole < 0 ? vision::kUnlabelled : static_cast<vision::SemanticClass>(whole);
    }
    if (!text(column_v_right).empty()) {
      if (!io::parse_number(text(column_v_right), right_v)) return is_no_number(column_v_right);
      o.v_difference_px = o.pixel_px[2] - right_v;
    }
    return {};
  }

  [[nodiscard]] GpsTime time_of(double sow) const {
    GpsTime time = GpsTime::from_week_sow(week_, sow);
    while (last_ && last_->ns - time.ns > kNanosecondsPerWeek / 2) time.ns += kNanosecondsPerWeek;
    return time;
  }

  template <std::size_t N>
  void add(vision::StereoFrame<N>& frame, const vision::StereoObservation& observation) {
    if (std::find(tracks_.begin(), tracks_.end(), observation.track) != tracks_.end())
      return skipped_.add("track twice in one frame", reader_.line_number(),
                          "each track must stand once in a frame; its first row is kept");
    tracks_.push_back(observation.track);
    frame.add(observation);
  }

  static constexpr const char* kHeaderHint = "the first line must be t_gps_sow,track_id,u_left,u_right,v,score,semantic_class";

  io::TextReader reader_;
  std::array<std::size_t, kColumns> place_{};
  std::size_t fields_{0};
  std::int64_t week_{0};
  std::optional<GpsTime> last_;
  std::optional<Row> pending_;
  std::optional<io::Diagnostic> error_;
  std::vector<std::uint64_t> tracks_;  // of the frame being read
  io::SkipLog skipped_;
};

}  // namespace searvins::precomputed
