// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The command line: options declared once give parsing, checks and the --help text.
///
///     OptionParser parser{"searvins evaluate", "scores trajectories against a truth"};
///     parser.value("truth", "FILE", "truth file").required();
///     parser.value("step", "S", "evaluation interval, seconds").fallback("1");
///     parser.positionals("RUN", "run folder or trajectory file", 1);
///     Options options = parser.parse(argc, argv);
///     const double step_s = options.number("step", 1e-3, 3600);
///     if (const auto code = options.finished()) return *code;
///
/// Accepted are `--name value`, `--name=value`, `--flag`, and `--` before positionals that begin with a dash. A getter that meets an
/// unusable value remembers the first error; finished() prints it (or the help, or the version) and gives the exit code.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/version.hpp>

namespace searvins::examples {

/// Exit codes of the command.
inline constexpr int kExitDone = 0;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitUnusableInput = 3;
inline constexpr int kExitDegraded = 4;

/// Number of single-letter edits (insert, delete, replace, swap neighbours) between two words.
[[nodiscard]] inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

/// The word of a list that is nearest to a mistyped one; empty when none is near enough to be what was meant.
[[nodiscard]] inline std::string nearest_word(std::string_view word, const std::vector<std::string>& words) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : words) {
    std::size_t distance = edit_distance(word, candidate);
    if (candidate.starts_with(word) && word.size() >= 2) distance = std::min<std::size_t>(distance, 1);
    if (distance < best_distance) best = candidate, best_distance = distance;
  }
  return best;
}

/// The words of a list for a message: "a, b, c".
template <class Words>
[[nodiscard]] std::string joined(const Words& words) {
  std::string text;
  for (const auto& word : words) (text += text.empty() ? "" : ", ") += word;
  return text;
}

/// One declared option.
struct OptionSpec {
  std::string name{};        ///< without the dashes
  std::string value_name{};  ///< empty: a flag
  std::string help{};
  std::string default_text{};
  std::vector<std::string> choices{};  ///< when not empty, the only values allowed
  bool is_repeated{false}, is_required{false};

  OptionSpec& required() { return is_required = true, *this; }
  OptionSpec& repeated() { return is_repeated = true, *this; }
  OptionSpec& fallback(std::string text) { return default_text = std::move(text), *this; }
  OptionSpec& one_of(std::vector<std::string> words) { return choices = std::move(words), *this; }
};

/// What the user gave. Getters return the fallback of the option when it was not given.
class Options {
 public:
  /// True when the option stands on the command line.
  [[nodiscard]] bool given(const std::string& name) const { return values_.contains(name); }
  /// A flag.
  [[nodiscard]] bool flag(const std::string& name) const { return given(name); }
  /// A text, empty when neither given nor with a fallback.
  [[nodiscard]] std::string text(const std::string& name) const {
    const auto found = values_.find(name);
    if (found != values_.end()) return found->second.back();
    const auto fallback = fallbacks_.find(name);
    return fallback != fallbacks_.end() ? fallback->second : std::string{};
  }
  /// All values of a repeated option, in order.
  [[nodiscard]] std::vector<std::string> texts(const std::string& name) const {
    const auto found = values_.find(name);
    return found != values_.end() ? found->second : std::vector<std::string>{};
  }
  /// A number inside [low, high].
  [[nodiscard]] double number(const std::string& name, double low, double high) {
    double value = low;
    const std::string given_text = text(name);
    if (!io::parse_number(given_text, value))
      fail("--" + name + ": '" + given_text + "' is not a number");
    else if (value < low || value > high)
      fail("--" + name + ": " + given_text + " lies outside " + short_text(low) + " .. " + short_text(high)), value = low;
    return value;
  }
  /// A number inside [low, high], or nothing when the option was not given.
  [[nodiscard]] std::optional<double> optional_number(const std::string& name, double low, double high) {
    if (!given(name) && text(name).empty()) return std::nullopt;
    return number(name, low, high);
  }
  /// A whole number inside [low, high].
  [[nodiscard]] std::int64_t integer(const std::string& name, std::int64_t low, std::int64_t high) {
    std::int64_t value = low;
    const std::string given_text = text(name);
    if (!io::parse_integer(given_text, value))
      fail("--" + name + ": '" + given_text + "' is not a whole number");
    else if (value < low || value > high)
      fail("--" + name + ": " + given_text + " lies outside " + std::to_string(low) + " .. " + std::to_string(high)), value = low;
    return value;
  }
  /// Exactly `count` numbers separated by commas; empty when the option was not given.
  [[nodiscard]] std::vector<double> numbers(const std::string& name, std::size_t count) {
    if (!given(name)) return {};
    std::vector<double> values;
    const std::string joined = text(name);
    for (const std::string_view field : io::split(joined, ',')) {
      double value = 0;
      if (!io::parse_number(field, value))
        return fail("--" + name + ": '" + std::string{field} + "' is not a number"), std::vector<double>{};
      values.push_back(value);
    }
    if (values.size() != count)
      return fail("--" + name + " takes " + std::to_string(count) + " numbers separated by commas"), std::vector<double>{};
    return values;
  }
  /// Words separated by commas; empty when the option was not given.
  [[nodiscard]] std::vector<std::string> list(const std::string& name) const {
    std::vector<std::string> words;
    if (text(name).empty()) return words;
    const std::string joined = text(name);
    for (const std::string_view word : io::split(joined, ',')) words.emplace_back(word);
    return words;
  }
  /// Arguments that are no options.
  [[nodiscard]] const std::vector<std::string>& positionals() const { return positionals_; }

  /// Records a usage error; the first one wins.
  void fail(std::string what) {
    if (error_.empty()) error_ = std::move(what);
  }
  /// The first usage error, empty when there is none.
  [[nodiscard]] const std::string& error() const { return error_; }
  /// Text to print instead of working (--help, --version).
  [[nodiscard]] const std::string& notice() const { return notice_; }

  /// The exit code when there is nothing more to do: prints help, version or the usage error.
  [[nodiscard]] std::optional<int> finished() const {
    if (!notice_.empty()) return std::fputs(notice_.c_str(), stdout), kExitDone;
    if (error_.empty()) return std::nullopt;
    std::fprintf(stderr, "%s: %s\n%s --help says more.\n", program_.c_str(), error_.c_str(), program_.c_str());
    return kExitUsage;
  }

 private:
  friend class OptionParser;
  [[nodiscard]] static std::string short_text(double value) {
    char buffer[32];
    const auto [end, code] = std::to_chars(buffer, buffer + sizeof buffer, value);
    return {buffer, end};
  }

  std::string program_, error_, notice_;
  std::map<std::string, std::vector<std::string>> values_;
  std::map<std::string, std::string> fallbacks_;
  std::vector<std::string> positionals_;
};

/// Declares the options of one command and parses its arguments.
class OptionParser {
 public:
  OptionParser(std::string program, std::string summary) : program_(std::move(program)), summary_(std::move(summary)) {}

  /// Declares an option with a value. The reference holds until the next declaration.
  OptionSpec& value(std::string name, std::string value_name, std::string help) {
    OptionSpec spec;
    spec.name = std::move(name), spec.value_name = std::move(value_name), spec.help = std::move(help);
    return specs_.emplace_back(std::move(spec));
  }
  /// Declares a flag.
  OptionSpec& flag(std::string name, std::string help) { return value(std::move(name), {}, std::move(help)); }
  /// Declares the positionals: their name in the help, how few and how many.
  void positionals(std::string name, std::string help, std::size_t at_least, std::size_t at_most = 1000) {
    positional_name_ = std::move(name), positional_help_ = std::move(help), positional_min_ = at_least, positional_max_ = at_most;
  }
  /// A paragraph after the options.
  void epilogue(std::string text) { epilogue_ = std::move(text); }

  /// Parses what follows the command's name; argv[0] is that name.
  [[nodiscard]] Options parse(int argc, const char* const* argv) const {
    Options options;
    options.program_ = program_;
    for (const OptionSpec& spec : specs_)
      if (!spec.default_text.empty()) options.fallbacks_[spec.name] = spec.default_text;
    bool only_positionals = false;
    for (int i = 1; i < argc && options.error_.empty(); ++i) {
      const std::string_view argument{argv[i]};
      if (only_positionals || !argument.starts_with("-") || argument == "-")
        options.positionals_.emplace_back(argument);
      else if (argument == "--")
        only_positionals = true;
      else if (argument == "--help" || argument == "-h")
        return options.notice_ = help(), options;
      else if (argument == "--version")
        return options.notice_ = std::string{"searvins "} + kVersionString + "\n", options;
      else
        take_option(argument, argc, argv, i, options);
    }
    check_complete(options);
    return options;
  }

  /// The --help text.
  [[nodiscard]] std::string help() const {
    std::string text = program_ + ": " + summary_ + "\n\nusage: " + program_;
    for (const OptionSpec& spec : specs_)
      if (spec.is_required) text += " --" + spec.name + ' ' + spec.value_name;
    text += " [options]";
    if (positional_max_ > 0) text += positional_min_ > 0 ? ' ' + positional_name_ + "..." : " [" + positional_name_ + "...]";
    text += "\n\n";
    std::size_t width = std::max<std::size_t>(positional_max_ > 0 ? positional_name_.size() : 0, 9);
    for (const OptionSpec& spec : specs_) width = std::max(width, left_text(spec).size());
    width = std::min<std::size_t>(width, 30);
    if (positional_max_ > 0) append_entry(text, positional_name_, positional_help_, width);
    for (const OptionSpec& spec : specs_) append_entry(text, left_text(spec), right_text(spec), width);
    append_entry(text, "--help", "this text", width);
    append_entry(text, "--version", "the version", width);
    if (!epilogue_.empty()) text += '\n' + epilogue_ + '\n';
    return text;
  }

 private:
  [[nodiscard]] const OptionSpec* find(std::string_view name) const {
    for (const OptionSpec& spec : specs_)
      if (spec.name == name) return &spec;
    return nullptr;
  }

  void take_option(std::string_view argument, int argc, const char* const* argv, int& i, Options& options) const {
    const std::size_t equals = argument.find('=');
    const std::string name{argument.substr(0, equals).substr(argument.starts_with("--") ? 2 : 1)};
    const OptionSpec* spec = argument.starts_with("--") ? find(name) : nullptr;
    if (!spec) {
      std::vector<std::string> names{"help", "version"};
      for (const OptionSpec& known : specs_) names.push_back(known.name);
      const std::string nearest = nearest_word(name, names);
      return options.fail("unknown option " + std::string{argument.substr(0, equals)} +
                          (nearest.empty() ? "" : ": did you mean --" + nearest + '?'));
    }
    if (options.given(name) && !spec->is_repeated) return options.fail("--" + name + " is given twice");
    std::string text;
    if (spec->value_name.empty()) {
      if (equals != std::string_view::npos) return options.fail("--" + name + " takes no value");
    } else if (equals != std::string_view::npos) {
      text = argument.substr(equals + 1);
    } else if (i + 1 < argc && !std::string_view{argv[i + 1]}.starts_with("--")) {
      text = argv[++i];
    }
    if (!spec->value_name.empty() && text.empty()) return options.fail("--" + name + " needs a value: --" + name + ' ' + spec->value_name);
    if (!spec->choices.empty() && std::find(spec->choices.begin(), spec->choices.end(), text) == spec->choices.end()) {
      const std::string nearest = nearest_word(text, spec->choices);
      return options.fail("--" + name + ": '" + text + "' is not one of " + joined(spec->choices) +
                          (nearest.empty() ? "" : ": did you mean " + nearest + '?'));
    }
    options.values_[name].push_back(text);
  }

  void check_complete(Options& options) const {
    for (const OptionSpec& spec : specs_)
      if (spec.is_required && !options.given(spec.name)) options.fail("--" + spec.name + ' ' + spec.value_name + " is missing");
    if (options.positionals_.size() < positional_min_) options.fail(positional_name_ + " is missing");
    if (options.positionals_.size() > positional_max_) options.fail("unexpected argument '" + options.positionals_[positional_max_] + "'");
  }

  [[nodiscard]] static std::string left_text(const OptionSpec& spec) {
    return "--" + spec.name + (spec.value_name.empty() ? "" : ' ' + spec.value_name);
  }
  [[nodiscard]] static std::string right_text(const OptionSpec& spec) {
    std::string text = spec.help;
    if (!spec.choices.empty()) text += ": " + joined(spec.choices);
    if (!spec.default_text.empty()) text += " (default " + spec.default_text + ")";
    if (spec.is_required) text += " (required)";
    if (spec.is_repeated) text += " (may be repeated)";
    return text;
  }
  /// Two columns, the right one wrapped at 100 characters.
  static void append_entry(std::string& text, const std::string& left, const std::string& right, std::size_t width) {
    std::string line = "  " + left;
    const std::size_t indent = width + 4;
    if (line.size() + 2 > indent) text += line + '\n', line.clear();
    line.resize(indent, ' ');
    bool fresh = true;
    for (const std::string_view word : io::split_words(right)) {
      if (!fresh && line.size() + 1 + word.size() > 100) {
        text += line + '\n';
        line.assign(indent, ' '), fresh = true;
      }
      if (!fresh) line += ' ';
      line += word, fresh = false;
    }
    text += line + '\n';
  }

  std::string program_, summary_, positional_name_, positional_help_, epilogue_;
  std::size_t positional_min_{0}, positional_max_{0};
  std::vector<OptionSpec> specs_;
};

}  // namespace searvins::examples
