// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The part of YAML that sensor.yaml files use: mappings by indentation, plain or quoted values, lists in brackets over several lines.
///
///     %YAML:1.0                                     left out, as are --- and comments
///     T_BS:
///       cols: 4                                     entry "T_BS.cols"
///       data: [1.0, 0.0,                            entry "T_BS.data": a list of numbers
///              0.0, 1.0]
///     camera_model: pinhole                         entry "camera_model"
///
/// Whatever else YAML can do (anchors, block lists, several documents) is refused with the line.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::examples {

/// One value of the file.
struct YamlEntry {
  std::string key;                   ///< with the keys of the mappings around it: "T_BS.data"
  std::vector<std::string> items{};  ///< one, or those of a list
  bool is_list{false};
  long line{0};
};

/// All values of a file; getters say what is missing or wrong, and where.
class SensorYaml {
 public:
  static constexpr std::size_t kMostEntries = 1000;

  SensorYaml() = default;
  SensorYaml(std::string file, std::vector<YamlEntry> entries) : file_(std::move(file)), entries_(std::move(entries)) {}

  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] const std::vector<YamlEntry>& entries() const { return entries_; }
  [[nodiscard]] const YamlEntry* find(std::string_view key) const {
    for (const YamlEntry& e : entries_)
      if (e.key == key) return &e;
    return nullptr;
  }

  /// The single value of a key.
  [[nodiscard]] io::FileResult<std::string> text(std::string_view key) const {
    const YamlEntry* e = find(key);
    if (e == nullptr) return missing(key);
    if (e->is_list) return io::Diagnostic{file_, e->line, e->key + " is a list where one value is expected", kHint};
    return e->items.front();
  }
  [[nodiscard]] io::FileResult<double> number(std::string_view key) const {
    const auto word = text(key);
    if (!word) return word.error();
    double value = 0;
    if (!io::parse_number(*word, value))
      return io::Diagnostic{file_, find(key)->line, std::string{key} + " is not a number: " + *word, kHint};
    return value;
  }
  /// The numbers of a list that must have so many.
  [[nodiscard]] io::FileResult<std::vector<double>> numbers(std::string_view key, std::size_t least, std::size_t most) const {
    const YamlEntry* e = find(key);
    if (e == nullptr) return missing(key);
    const std::string wanted = least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most);
    if (!e->is_list || e->items.size() < least || e->items.size() > most)
      return io::Diagnostic{file_, e->line, e->key + " must be a list of " + wanted + " numbers, it has " + std::to_string(e->items.size()),
                            kHint};
    std::vector<double> values(e->items.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!io::parse_number(e->items[i], values[i]))
        return io::Diagnostic{file_, e->line, e->key + " has an item that is not a number: '" + e->items[i] + "'", kHint};
    return values;
  }

 private:
  static constexpr const char* kHint = "compare with the sensor.yaml of a EuRoC recording";
  [[nodiscard]] io::Diagnostic missing(std::string_view key) const { return {file_, 0, "there is no " + std::string{key}, kHint}; }

  std::string file_;
  std::vector<YamlEntry> entries_;
};

namespace yaml_detail {

/// The line without its comment; # begins one at the start or after a blank, outside quotes.
[[nodiscard]] inline std::string_view without_comment(std::string_view line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote != 0)
      quote = line[i] == quote ? char{0} : quote;
    else if (line[i] == '"' || line[i] == '\'')
      quote = line[i];
    else if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t'))
      return line.substr(0, i);
  }
  return line;
}

[[nodiscard]] inline std::string unquoted(std::string_view text) {
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front())
    text = text.substr(1, text.size() - 2);
  return std::string{text};
}

/// Reads lines one by one.
class YamlReader {
 public:
  YamlReader(std::string_view text, std::string file) : lines_(text), file_(std::move(file)) {}

  [[nodiscard]] io::FileResult<SensorYaml> read() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view content = io::trimmed(without_comment(line));
      if (content.empty() || content.front() == '%' || content == "---" || content == "...") continue;
      if (entries_.size() >= SensorYaml::kMostEntries) return problem("the file has more than 1000 values");
      if (line.find('\t') < line.find_first_not_of(" \t")) return problem("the line is indented with a tab");
      if (const char* wrong = take(line.find_first_not_of(' '), content)) return problem(wrong);
    }
    if (entries_.empty()) return problem("there is no 'key: value' in the file");
    return SensorYaml{file_, std::move(entries_)};
  }

 private:
  [[nodiscard]] io::Diagnostic problem(const char* what) const {
    return {file_, lines_.number(), what, "write 'key: value' or 'key: [number, ...]', indented with blanks"};
  }

  /// One line that begins a value or a mapping; what is wrong with it, nullptr when all is well.
  [[nodiscard]] const char* take(std::size_t indent, std::string_view content) {
    const std::size_t colon = content.find(':');
    if (colon == std::string_view::npos) return "the line is no 'key: value'";
    while (!open_.empty() && open_.back().first >= indent) open_.pop_back();
    std::string key;
    for (const auto& [at, name] : open_) key += name + '.';
    const std::string name{io::trimmed(content.substr(0, colon))};
    if (name.empty() || name.front() == '-') return "the line is no 'key: value'";
    std::string_view value = io::trimmed(content.substr(colon + 1));
    if (value.substr(0, 2) == "!!") value = io::trimmed(value.substr(std::min(value.size(), value.find(' '))));  // a type, as OpenCV writes
    if (value.empty()) {
      open_.emplace_back(indent, name);
      return nullptr;
    }
    YamlEntry entry{key + name, {}, false, lines_.number()};
    for (const YamlEntry& e : entries_)
      if (e.key == entry.key) return "the key was already given";
    if (value.front() == '[') return take_list(value, entry);
    if (value.front() == '&' || value.front() == '*' || value.front() == '{' || value.front() == '|' || value.front() == '>')
      return "this sort of value is not understood";
    entry.items.push_back(unquoted(value));
    entries_.push_back(std::move(entry));
    return nullptr;
  }

  [[nodiscard]] const char* take_list(std::string_view value, YamlEntry& entry) {
    std::string all{value};
    std::string_view line;
    while (all.find(']') == std::string::npos) {
      if (!lines_.next(line)) return "a list has no closing bracket";
      all += ' ';
      all += io::trimmed(without_comment(line));
    }
    if (all.back() != ']') return "there is something behind the closing bracket of a list";
    entry.is_list = true;
    const std::string_view inside = io::trimmed(std::string_view{all}.substr(1, all.size() - 2));
    if (!inside.empty())
      for (const std::string_view item : io::split(inside, ',')) entry.items.push_back(unquoted(item));
    entries_.push_back(std::move(entry));
    return nullptr;
  }

  io::LineReader lines_;
  std::string file_;
  std::vector<YamlEntry> entries_;
  std::vector<std::pair<std::size_t, std::string>> open_;  // mappings that the next line may belong to, with their indentation
};

}  // namespace yaml_detail

/// Reads the text of a file; `name` stands for the file in messages.
[[nodiscard]] inline io::FileResult<SensorYaml> parse_sensor_yaml(std::string_view text, const std::string& name) {
  return yaml_detail::YamlReader{text, name}.read();
}
[[nodiscard]] inline io::FileResult<SensorYaml> read_sensor_yaml(const std::string& path) {
  const auto text = io::read_text_file(path, 1U << 20U);
  return text ? parse_sensor_yaml(*text, path) : io::FileResult<SensorYaml>{text.error()};
}

}  // namespace searvins::examples
