// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// IMU logs: LORD, CSV and EuRoC files (imu_columns.hpp) as samples in GPS time, with what was left out and why.
///
/// A row whose stamp repeats or falls back is left out. A stamp far ahead of its predecessor is believed only when the next row agrees with it: one wrong
/// stamp then costs one row, while a log that really pauses for an hour goes on after it. Seconds of week without a
/// week are of the week nearest the row before, so a log may run over the end of a week.
///
/// The interval is the median step; a gap is a step of more than 1.5 intervals. Units, saturation and the direction of gravity are judged by
/// imu_check.hpp, which read_imu_log applies: what it finds is in `findings`.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_kind.hpp>
#include <searvins/io/imu_check.hpp>
#include <searvins/io/imu_columns.hpp>
#include <searvins/io/text_reader.hpp>

namespace searvins::io {

/// How a log is to be read.
struct ImuLogOptions {
  std::optional<GpsTime> reference;  ///< gives the week to a log that has none: the week nearest this time
  NanosecondScale nanoseconds{NanosecondScale::unix_utc};
  double max_jump_s{60};     ///< a stamp further ahead than this must be confirmed by the next row
  bool convert_units{true};  ///< g and deg/s that are recognised by magnitude are converted; either way they are said
};

/// Two neighbouring samples that are too far apart.
struct ImuGap {
  GpsTime from{}, to{};
};

/// A whole log.
struct ImuLog {
  static constexpr std::size_t kMaxGaps = 100;
  std::vector<imu::ImuSample> samples;  ///< rising in time, raw axes until turn_axes()
  bool has_week{false};                 ///< false: the times are seconds of an unknown week
  double interval_s{0};                 ///< median step; 0 for fewer than two samples
  std::vector<ImuGap> gaps;             ///< the first kMaxGaps
  long gap_count{0};
  std::vector<ImuFinding> findings;  ///< what looks wrong with the numbers, see imu_check.hpp
};

namespace detail {

/// Puts rows in order of time as the file comment says.
class ImuLogBuilder {
 public:
  ImuLogBuilder(const ImuLogOptions& options, const ImuColumns& columns, Parsed<ImuLog>& out)
      : options_(options), weekless_(columns.week == ImuColumns::kNone && columns.nanoseconds == ImuColumns::kNone), out_(out) {
    out_.value.has_week = !weekless_ || options.reference;
  }

  void add(imu::ImuSample sample, long line) {
    if (weekless_) place_week(sample.time);
    if (pending_) {
      if (sample.time == pending_->time) return skip("repeated time stamp", line);
      const double ahead_s = seconds_between(pending_->time, sample.time);
      if (ahead_s > 0 && ahead_s <= options_.max_jump_s)
        accept(*std::exchange(pending_, std::nullopt));
      else
        drop_pending();
    }
    std::vector<imu::ImuSample>& samples = out_.value.samples;
    if (samples.empty() || seconds_between(samples.back().time, sample.time) > options_.max_jump_s) {
      pending_ = sample;
      pending_line_ = line;
      return;
    }
    if (sample.time == samples.back().time) return skip("repeated time stamp", line);
    if (sample.time < samples.back().time)
      return out_.skipped.add("time stamp before that of the row above", line, "sort the rows; where the clock was set back, cut the log there");
    accept(sample);
  }

  void finish() {
    if (pending_ && out_.value.samples.empty()) accept(*pending_);
    else if (pending_) drop_pending();
  }

 private:
  void accept(const imu::ImuSample& sample) { out_.value.samples.push_back(sample); }
  void skip(const char* reason, long line) { out_.skipped.add(reason, line, "each sample must stand once"); }
  void drop_pending() {
    out_.skipped.add("time stamp far ahead of its neighbours", pending_line_, "the row is left out; check how the log was stamped");
    pending_.reset();
  }

  /// Gives a week to seconds of week: the one nearest the sample before, for the first the one nearest the reference (week 0 without one).
  void place_week(GpsTime& time) {
    if (time.ns >= 2 * kNanosecondsPerWeek) {  // seconds since the GPS epoch
      out_.value.has_week = true;
      return;
    }
    std::optional<GpsTime> near = options_.reference;
    if (!out_.value.samples.empty())
      near = out_.value.samples.back().time;
    else if (pending_)
      near = pending_->time;
    if (!near) return;
    time.ns += near->week() * kNanosecondsPerWeek;
    if (time.ns - near->ns > kNanosecondsPerWeek / 2) time.ns -= kNanosecondsPerWeek;
    if (near->ns - time.ns > kNanosecondsPerWeek / 2) time.ns += kNanosecondsPerWeek;
  }

  const ImuLogOptions& options_;
  bool weekless_;
  Parsed<ImuLog>& out_;
  std::optional<imu::ImuSample> pending_;
  long pending_line_{0};
};

/// Interval and gaps.
inline void find_imu_gaps(ImuLog& log) {
  if (log.samples.size() < 2) return;
  std::vector<std::int64_t> steps;
  steps.reserve(log.samples.size());
  for (std::size_t i = 1; i < log.samples.size(); ++i) steps.push_back(log.samples[i].time.ns - log.samples[i - 1].time.ns);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  const std::int64_t interval_ns = *middle;
  log.interval_s = static_cast<double>(interval_ns) * 1e-9;
  for (std::size_t i = 1; i < log.samples.size(); ++i) {
    if (2 * (log.samples[i].time.ns - log.samples[i - 1].time.ns) <= 3 * interval_ns) continue;
    ++log.gap_count;
    if (log.gaps.size() < ImuLog::kMaxGaps) log.gaps.push_back({log.samples[i - 1].time, log.samples[i].time});
  }
}

/// Reads rows from an open reader.
inline void read_imu_rows(TextReader& reader, FileKind kind, const ImuLogOptions& options, Parsed<ImuLog>& out) {
  ImuColumns columns = kind == FileKind::lord_log ? ImuColumns::lord() : ImuColumns::seven();
  std::optional<ImuLogBuilder> builder;
  std::string_view line;
  while (reader.next(line)) {
    line = trimmed(line);
    if (line.empty()) continue;
    if (!builder && kind == FileKind::imu_csv) {  // comments and the header stand before the first row
      double first_field = 0;
      const bool is_row = parse_number(RowFields{line}[0], first_field);
      if (!is_row && read_imu_header(line, columns).empty()) continue;
      if (!is_row && line.front() != '#' && line.find(',') != line.npos) {
        ImuColumns unused;
        const std::string missing = read_imu_header(line, unused);
        out.error = Diagnostic{reader.name(), reader.line_number(), "the header names " + missing, "name the columns as in t,gx,gy,gz,ax,ay,az"};
        return;
      }
    }
    if (line.front() == '#') continue;
    if (!builder) builder.emplace(options, columns, out);
    imu::ImuSample sample;
    const char* wrong = read_imu_row(line, columns, options.nanoseconds, sample);
    if (!*wrong)
      builder->add(sample, reader.line_number());
    else if (!reader.line_is_terminated())
      out.skipped.add("last line cut off in the middle", reader.line_number(), "the recording or its copy ended early");
    else
      out.skipped.add(wrong, reader.line_number());
  }
  if (builder) builder->finish();
}

[[nodiscard]] inline Parsed<ImuLog> parse_imu_log(TextReader& reader, const ImuLogOptions& options) {
  Parsed<ImuLog> out;
  const FileKind kind = sniff_text(reader.head()).kind;
  out.error = refuse_compressed(kind, reader.name());
  if (out.error) return out;
  if (kind != FileKind::lord_log && kind != FileKind::imu_csv) {
    out.error = Diagnostic{reader.name(), 0, std::string{"is no IMU log ("} + name_of(kind) + ')',
                           "give a LORD log, a CSV with the columns t,gx,gy,gz,ax,ay,az or EuRoC's imu0/data.csv"};
    return out;
  }
  read_imu_rows(reader, kind, options, out);
  if (out.error) return out;
  if (out.value.samples.empty()) {
    out.error = Diagnostic{reader.name(), 0, "has no usable row", {}};
    if (!out.skipped.items().empty())
      out.error->hint = "most were left out for this: " + out.skipped.items().front().reason + ", first at line " +
                        std::to_string(out.skipped.items().front().first_line);
    return out;
  }
  find_imu_gaps(out.value);
  out.value.findings = check_imu_units(out.value.samples, reader.name(), options.convert_units);
  for (ImuFinding& finding : check_imu_saturation(out.value.samples, reader.name())) out.value.findings.push_back(std::move(finding));
  return out;
}

}  // namespace detail

/// Reads a log from text; `name` is the file's name in messages. Errors: another sort of file, a header without the needed columns, no usable row.
[[nodiscard]] inline Parsed<ImuLog> parse_imu_log(std::string text, std::string name, const ImuLogOptions& options = {}) {
  TextReader reader;
  if (auto error = reader.open_text(std::move(text), std::move(name))) {
    Parsed<ImuLog> out;
    out.error = std::move(error);
    return out;
  }
  return detail::parse_imu_log(reader, options);
}

/// Reads a log file. Errors: those of parse_imu_log; missing, empty, unreadable or compressed file, folder.
[[nodiscard]] inline Parsed<ImuLog> read_imu_log(const std::filesystem::path& path, const ImuLogOptions& options = {}) {
  TextReader reader;
  if (auto error = reader.open(path)) {
    Parsed<ImuLog> out;
    out.error = std::move(error);
    return out;
  }
  return detail::parse_imu_log(reader, options);
}

}  // namespace searvins::io
