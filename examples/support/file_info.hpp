// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What is in an input file, as facts and tables that can be printed for people or as JSON: the content of `searvins info`.
///
/// The sort of a file is told from its content. RINEX files and IMU logs go through the library's own readers, so what is reported as
/// skipped is what a run would skip; stereo tracks are scanned line by line.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <searvins/io/imu_log.hpp>
#include <searvins/io/rinex_info.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/load_trajectory.hpp"
#include "examples/support/rig.hpp"
#include "examples/support/table.hpp"
#include "examples/support/truth.hpp"

namespace searvins::examples {

/// A value and how many decimals people see of it.
struct InfoValue {
  std::variant<std::string, double, long> value{};
  int decimals{3};

  [[nodiscard]] std::string text() const {
    if (const auto* number = std::get_if<double>(&value)) return cell(*number, decimals);
    if (const auto* count = std::get_if<long>(&value)) return std::to_string(*count);
    return std::get<std::string>(value);
  }
};

/// A named value: `key` in JSON; people see it with blanks for underscores.
struct InfoFact {
  std::string key;
  InfoValue value;
};

/// A titled table.
struct InfoTable {
  std::string key;
  std::vector<std::string> columns;
  std::vector<std::vector<InfoValue>> rows;
};

/// Everything known of one file.
struct FileInfo {
  std::string file, kind;
  std::optional<io::Diagnostic> error;
  std::vector<InfoFact> facts;
  std::vector<InfoTable> tables;
  std::vector<io::SkippedItem> skipped;
};

namespace detail {

/// "2021-09-22 06:30:00.000 GPST (week 2176, sow 282600.000)".
[[nodiscard]] inline std::string time_text(GpsTime t) {
  const CivilTime c = civil_from_gps({t.ns + 500'000});  // to the nearest millisecond
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "%04d-%02d-%02d %02d:%02d:%02d.%03d GPST (week %lld, sow ", c.year, c.month, c.day, c.hour, c.minute,
                static_cast<int>(c.second), static_cast<int>(std::floor((c.second - std::floor(c.second)) * 1e3)),
                static_cast<long long>(t.week()));
  return buffer + io::fixed_text(t.sow(), 3) + ")";
}

/// Satellite numbers as ranges: "1-3,7".
[[nodiscard]] inline std::string numbers_text(const std::bitset<64>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!numbers[i]) continue;
    std::size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1]) ++last;
    text += (text.empty() ? "" : ",") + std::to_string(i) + (last > i ? '-' + std::to_string(last) : "");
    i = last;
  }
  return text;
}

inline void add_span(FileInfo& info, const std::optional<GpsTime>& first, const std::optional<GpsTime>& last) {
  if (first) info.facts.push_back({"first", {time_text(*first)}});
  if (last) info.facts.push_back({"last", {time_text(*last)}});
  if (first && last) info.facts.push_back({"duration_s", {seconds_between(*first, *last)}});
}

inline void add_vector(FileInfo& info, const char* key, const Eigen::Vector3d& v) {
  info.facts.push_back({key, {io::fixed_text(v.x(), 4) + ' ' + io::fixed_text(v.y(), 4) + ' ' + io::fixed_text(v.z(), 4)}});
}

inline void describe_observations(const io::ObservationFileInfo& o, FileInfo& info) {
  const auto text_fact = [&info](const char* key, const std::string& text) {
    if (!text.empty()) info.facts.push_back({key, {text}});
  };
  info.facts.push_back({"version", {o.header.first_line.version, 2}});
  text_fact("marker", o.header.marker_name), text_fact("receiver", o.header.receiver), text_fact("antenna", o.header.antenna);
  if (o.header.approx_position_e_m)
    add_vector(info, "approx_position_ecef_m", *o.header.approx_position_e_m);
  else
    text_fact("approx_position_ecef_m", "missing or zero");
  constexpr const char* scales[] = {"GPST", "BDT", "UTC"};
  text_fact("time_system", scales[static_cast<std::size_t>(o.header.time_system)]);
  add_span(info, o.summary.first, o.summary.last);
  info.facts.push_back({"epochs", {o.summary.epochs}});
  info.facts.push_back({"epochs_skipped", {o.summary.epochs_skipped}});
  info.facts.push_back({"interval_s", {o.interval_s}});
  info.facts.push_back({"gaps", {o.gap_count}});
  info.facts.push_back({"satellites_mean", {o.mean_satellites, 1}});
  info.facts.push_back({"satellites_least", {static_cast<long>(o.least_satellites)}});
  info.facts.push_back({"satellites_most", {static_cast<long>(o.most_satellites)}});

  InfoTable satellites{"constellations", {"constellation", "satellites", "observations", "numbers"}, {}};
  InfoTable signals{"signals", {"signal", "observations", "code", "phase", "doppler", "cn0", "mean_cn0_dbhz", "loss_of_lock"}, {}};
  for (std::size_t c = 0; c < o.constellations.size(); ++c) {
    const io::ConstellationCount& count = o.constellations[c];
    if (count.satellites.none()) continue;
    const std::string letter(1, gnss::letter_of(static_cast<gnss::Constellation>(c)));
    satellites.rows.push_back(
        {{letter}, {static_cast<long>(count.satellites.count())}, {count.observations}, {numbers_text(count.satellites)}});
    for (const io::SignalCount& s : count.signals)
      signals.rows.push_back({{letter + s.signal.band + s.signal.attribute},
                              {s.observations},
                              {s.code},
                              {s.phase},
                              {s.doppler},
                              {s.cn0},
                              {s.cn0 ? s.mean_cn0_dbhz : io::kUnknown, 1},
                              {s.loss_of_lock}});
  }
  info.tables.push_back(satellites), info.tables.push_back(signals);

  InfoTable gaps{"gap_list", {"from_sow", "to_sow", "length_s"}, {}};
  for (const io::ObservationGap& gap : o.gaps) gaps.rows.push_back({{gap.from.sow()}, {gap.to.sow()}, {seconds_between(gap.from, gap.to)}});
  if (!gaps.rows.empty()) info.tables.push_back(gaps);

  constexpr const char* events[] = {
      "", "power failure", "moving antenna", "new site", "header records", "external event", "cycle slip records"};
  InfoTable event_table{"events", {"event", "count"}, {}};
  for (std::size_t f = 1; f < o.summary.flags.size(); ++f)
    if (o.summary.flags[f]) event_table.rows.push_back({{std::string{events[f]}}, {o.summary.flags[f]}});
  if (o.summary.spliced_headers) event_table.rows.push_back({{std::string{"whole header in mid-file"}}, {o.summary.spliced_headers}});
  if (!event_table.rows.empty()) info.tables.push_back(event_table);
}

inline void describe_navigation(const io::NavigationFileInfo& n, FileInfo& info) {
  info.facts.push_back({"version", {n.first_line.version, 2}});
  info.facts.push_back({"records", {n.records}});
  info.facts.push_back({"unhealthy", {n.unhealthy}});
  add_span(info, n.first_toe, n.last_toe);
  if (n.leap_seconds) info.facts.push_back({"leap_seconds", {static_cast<long>(*n.leap_seconds)}});
  InfoTable satellites{"constellations", {"constellation", "satellites", "numbers"}, {}};
  for (std::size_t c = 0; c < n.satellites.size(); ++c)
    if (n.satellites[c].any())
      satellites.rows.push_back({{std::string(1, gnss::letter_of(static_cast<gnss::Constellation>(c)))},
                                 {static_cast<long>(n.satellites[c].count())},
                                 {numbers_text(n.satellites[c])}});
  info.tables.push_back(satellites);
  constexpr const char* names[] = {"GPS LNAV", "QZSS LNAV", "Galileo I/NAV", "Galileo F/NAV", "BeiDou D1", "BeiDou D2"};
  InfoTable messages{"messages", {"message", "records"}, {}};
  for (std::size_t m = 0; m < n.messages.size(); ++m)
    if (n.messages[m]) messages.rows.push_back({{std::string{names[m]}}, {n.messages[m]}});
  info.tables.push_back(messages);
}

/// Which column of a table has the time in seconds; SIZE_MAX: none.
[[nodiscard]] inline std::size_t time_column(const std::vector<std::string_view>& names) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = plain_name(names[i]);
    if (name == "t" || name == "sow" || name == "tow_s" || name == "t_gps_sow") return i;
  }
  return SIZE_MAX;
}

/// Scans stereo tracks: rows, bad rows, time span, interval, gaps, frames, tracks.
inline void describe_tracks(std::string_view text, FileInfo& info) {
  io::LineReader lines{text};
  std::string_view line;
  std::size_t time = 0;
  long rows = 0, columns = 0;
  io::SkipLog skipped;
  double first = io::kUnknown, last = io::kUnknown;
  std::vector<double> steps, values;
  std::set<long long> tracks;
  while (lines.next(line)) {
    std::string_view content = io::trimmed(line);
    if (content.empty()) continue;
    const bool comment = content.front() == '#';
    if (comment) content = io::trimmed(content.substr(1));
    const std::vector<std::string_view> fields = io::split(content, ',');
    values.assign(fields.size(), 0);
    bool numeric = !comment;
    for (std::size_t i = 0; numeric && i < fields.size(); ++i) numeric = io::parse_number(fields[i], values[i]);
    if (!numeric) {
      if (rows == 0 && fields.size() > 2)
        time = time_column(fields);
      else if (!comment)
        skipped.add("not a row of numbers", lines.number());
      continue;
    }
    if (columns == 0) columns = static_cast<long>(fields.size());
    if (static_cast<long>(fields.size()) != columns) {
      skipped.add("wrong number of fields", lines.number());
      continue;
    }
    const double t = time < values.size() ? values[time] : io::kUnknown;
    if (rows > 0 && t < last) skipped.add("time falls back", lines.number());
    if (rows == 0)
      first = t;
    else if (t > last)
      steps.push_back(t - last);
    last = t;
    ++rows;
    if (values.size() > 1) tracks.insert(static_cast<long long>(std::clamp(values[1], -9e15, 9e15)));
  }
  info.facts.push_back({"rows", {rows}});
  info.facts.push_back({"columns", {columns}});
  info.facts.push_back({"first_s", {first}});
  info.facts.push_back({"last_s", {last}});
  const double interval_s = percentile(steps, 0.5);
  info.facts.push_back({"interval_s", {interval_s, 4}});
  info.facts.push_back(
      {"gaps", {static_cast<long>(std::count_if(steps.begin(), steps.end(), [interval_s](double s) { return s > 1.5 * interval_s; }))}});
  info.facts.push_back({"frames", {static_cast<long>(steps.size()) + (rows > 0 ? 1 : 0)}});
  info.facts.push_back({"tracks", {static_cast<long>(tracks.size())}});
  info.skipped = skipped.items();
}

/// An IMU log: rate, span, gaps, what it measures on average, and what looks wrong with it.
inline void describe_imu_log(const std::string& path, FileInfo& info) {
  io::Parsed<io::ImuLog> log = io::read_imu_log(path);
  info.error = log.error;
  info.skipped = log.skipped.items();
  if (log.error) return;
  const std::vector<imu::ImuSample>& samples = log.value.samples;
  info.facts.push_back({"rows", {static_cast<long>(samples.size())}});
  if (log.value.has_week) {
    add_span(info, samples.front().time, samples.back().time);
  } else {
    info.facts.push_back({"first_sow", {samples.front().time.sow()}});
    info.facts.push_back({"last_sow", {samples.back().time.sow()}});
    info.facts.push_back({"duration_s", {seconds_between(samples.front().time, samples.back().time)}});
  }
  Eigen::Vector3d accel = Eigen::Vector3d::Zero(), gyro = Eigen::Vector3d::Zero();
  double accel_norm = 0;
  const double n = static_cast<double>(samples.size());
  for (const imu::ImuSample& s : samples) accel += s.accel_b_mps2 / n, gyro += s.gyro_b_radps / n, accel_norm += s.accel_b_mps2.norm() / n;
  info.facts.push_back({"interval_s", {log.value.interval_s, 4}});
  const double duration_s = seconds_between(samples.front().time, samples.back().time);
  info.facts.push_back({"rate_hz", {duration_s > 0 ? (n - 1) / duration_s : io::kUnknown, 2}});
  info.facts.push_back({"gaps", {log.value.gap_count}});
  info.facts.push_back({"mean_accel_norm_mps2", {accel_norm, 4}});
  add_vector(info, "mean_accel_mps2", accel);
  add_vector(info, "mean_gyro_radps", gyro);
  info.facts.push_back({"up_axis", {io::detail::axis_name(accel)}});
  InfoTable gaps{"gap_list", {"from_sow", "to_sow", "length_s"}, {}};
  for (const io::ImuGap& gap : log.value.gaps) gaps.rows.push_back({{gap.from.sow()}, {gap.to.sow()}, {seconds_between(gap.from, gap.to)}});
  if (!gaps.rows.empty()) info.tables.push_back(gaps);
  InfoTable findings{"findings", {"finding", "what_to_do"}, {}};
  for (const io::ImuFinding& f : log.value.findings) findings.rows.push_back({{f.text.message}, {f.text.hint}});
  if (!findings.rows.empty()) info.tables.push_back(findings);
}

inline void describe_trajectory(const std::string& path, FileInfo& info) {
  const io::FileResult<LoadedTrajectory> loaded = load_trajectory(path);
  if (!loaded) {
    info.error = loaded.error();
    return;
  }
  std::array<long, io::kSolutionStatuses> counts{};
  for (const io::TrajectoryRow& row : loaded->rows) ++counts[static_cast<std::size_t>(row.status)];
  info.facts.push_back({"rows", {static_cast<long>(loaded->rows.size())}});
  add_span(info, loaded->rows.front().time, loaded->rows.back().time);
  for (std::size_t s = 0; s < counts.size(); ++s)
    if (counts[s]) info.facts.push_back({std::string{"status_"} + io::name_of(static_cast<io::SolutionStatus>(s)), {counts[s]}});
}

inline void describe_truth(const std::string& path, FileInfo& info) {
  const io::FileResult<TruthTrack> truth = read_truth(path, GpsTime{});
  if (!truth) {
    info.error = truth.error();
    return;
  }
  const std::vector<TruthPoint>& points = truth->points;
  double length_m = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length_m += (points[i].p_e_m - points[i - 1].p_e_m).norm();
  info.facts.push_back({"rows", {static_cast<long>(points.size())}});
  if (points.front().time.week() > 0)
    add_span(info, points.front().time, points.back().time);
  else
    info.facts.push_back({"first_sow", {points.front().time.sow()}}), info.facts.push_back({"last_sow", {points.back().time.sow()}});
  info.facts.push_back({"length_m", {length_m, 1}});
  add_vector(info, "start_ecef_m", points.front().p_e_m);
}

inline void describe_json(const std::string& path, FileInfo& info) {
  const io::FileResult<Json> json = read_json(path);
  if (!json) {
    info.error = json.error();
    return;
  }
  std::string keys;
  for (const std::string& key : json->keys) (keys += keys.empty() ? "" : ", ") += key;
  if (!keys.empty()) info.facts.push_back({"members", {keys}});
  if (!json->find("schema") ||
      !(json->find("imu") || json->find("gnss") || json->find("camera") || json->find("antenna") || json->find("base")))
    return;
  const io::FileResult<Rig> rig = read_rig(path);
  info.kind = "rig";
  if (!rig) info.error = rig.error();
  if (rig && rig->lever_arm_b_m) add_vector(info, "lever_arm_b_m", *rig->lever_arm_b_m);
  if (rig && rig->base_position_e_m) add_vector(info, "base_position_ecef_m", *rig->base_position_e_m);
}

}  // namespace detail

/// Looks into a file of any sort.
[[nodiscard]] inline FileInfo file_info(const std::string& path) {
  FileInfo info;
  info.file = path;
  const io::SniffedFile sniffed = io::sniff(path);
  info.kind = io::name_of(sniffed.kind);
  switch (sniffed.kind) {
    case io::FileKind::rinex_observation:
    case io::FileKind::rinex_navigation: {
      io::Parsed<io::RinexFileInfo> rinex = io::rinex_info(path);
      info.error = rinex.error;
      info.skipped = rinex.skipped.items();
      if (rinex.value.observation) detail::describe_observations(*rinex.value.observation, info);
      if (rinex.value.navigation) detail::describe_navigation(*rinex.value.navigation, info);
      return info;
    }
    case io::FileKind::trajectory:
    case io::FileKind::rtklib_pos: return detail::describe_trajectory(path, info), info;
    case io::FileKind::truth: return detail::describe_truth(path, info), info;
    case io::FileKind::json: return detail::describe_json(path, info), info;
    case io::FileKind::imu_csv:
    case io::FileKind::lord_log: return detail::describe_imu_log(path, info), info;
    default: break;
  }
  const io::FileResult<std::string> text = io::read_text_file(path);
  if (!text) {
    info.error = text.error();
    return info;
  }
  if (sniffed.kind == io::FileKind::unknown) {  // a TEX-CUP ground_truth.log begins with a comment like many a file
    if (parse_truth(*text, path).ok()) return info.kind = io::name_of(io::FileKind::truth), detail::describe_truth(path, info), info;
    info.error = io::Diagnostic{path, 0, "is no file that searvins knows", "see the list of formats in docs"};
  } else if (sniffed.kind == io::FileKind::rinex_other) {
    info.error = io::Diagnostic{path, 1, "RINEX of a type that is not used: only observations (O) and navigation (N) are", {}};
  } else {
    detail::describe_tracks(*text, info);
  }
  return info;
}

/// For people.
[[nodiscard]] inline std::string info_text(const FileInfo& info) {
  std::string text = info.file + ": " + info.kind + '\n';
  std::size_t width = 0;
  for (const InfoFact& fact : info.facts) width = std::max(width, fact.key.size());
  const auto plain = [](std::string key) { return std::replace(key.begin(), key.end(), '_', ' '), key; };
  for (const InfoFact& fact : info.facts)
    text += "  " + plain(fact.key) + std::string(width + 2 - fact.key.size(), ' ') + fact.value.text() + '\n';
  for (const InfoTable& table : info.tables) {
    std::vector<std::string> header;
    for (const std::string& column : table.columns) header.push_back(plain(column));
    Table out{header};
    for (const std::vector<InfoValue>& row : table.rows) {
      std::vector<std::string> cells;
      for (const InfoValue& value : row) cells.push_back(value.text());
      out.row(cells);
    }
    text += '\n' + plain(table.key) + '\n' + out.text();
  }
  if (!info.skipped.empty()) text += "\nskipped\n";
  for (const io::SkippedItem& item : info.skipped)
    text += "  " + std::to_string(item.count) + " x " + item.reason + " (first at line " + std::to_string(item.first_line) + ")" +
            (item.hint.empty() ? "" : ": " + item.hint) + '\n';
  if (info.error) text += "  error: " + io::to_string(*info.error) + '\n';
  return text;
}

/// For programs: one object.
inline void write_info(JsonWriter& json, const FileInfo& info) {
  const auto put = [&json](std::string_view key, const InfoValue& v) {
    std::visit([&](const auto& value) { json.member(key, value); }, v.value);
  };
  json.begin_object().member("file", info.file).member("kind", info.kind);
  for (const InfoFact& fact : info.facts) put(fact.key, fact.value);
  for (const InfoTable& table : info.tables) {
    json.begin_array(table.key);
    for (const std::vector<InfoValue>& row : table.rows) {
      json.begin_object();
      for (std::size_t i = 0; i < row.size() && i < table.columns.size(); ++i) put(table.columns[i], row[i]);
      json.end_object();
    }
    json.end_array();
  }
  json.begin_array("skipped");
  for (const io::SkippedItem& item : info.skipped)
    json.begin_object().member("reason", item.reason).member("count", item.count).member("first_line", item.first_line).end_object();
  json.end_array();
  if (info.error) json.member("error", io::to_string(*info.error));
  json.end_object();
}

}  // namespace searvins::examples
