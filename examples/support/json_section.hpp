// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Reads the members of a JSON object with names, types and ranges checked: a missing required member and a member nobody asked for
/// are errors that name it, so that a mistyped field cannot be lost in silence.
#pragma once

#include <Eigen/Core>

#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "examples/support/json.hpp"
#include "examples/support/option_parser.hpp"

namespace searvins::examples {

/// One object of a JSON file while it is being read. The first error wins and is shared by all sections of the file.
class JsonSection {
 public:
  /// `path` is the object's own place ("camera.left"), empty for the whole file. `error` outlives the section, empty while all is well.
  JsonSection(const Json& object, std::string path, std::string file, io::Diagnostic& error)
      : object_(&object), path_(std::move(path)), file_(std::move(file)), error_(&error) {
    if (!object.is(Json::Kind::object))
      fail(object, (path_.empty() ? std::string{"the file"} : path_) + " must be an object, not " + name_of(object.kind));
  }

  /// True while neither this nor another section met an error.
  [[nodiscard]] bool ok() const { return error_->message.empty(); }

  /// A member, noted as known; nullptr when absent.
  const Json* optional(std::string_view name) {
    known_.emplace_back(name);
    return object_->find(name);
  }
  /// A member, noted as known; an error when absent.
  const Json* required(std::string_view name) {
    const Json* member = optional(name);
    if (!member) fail(*object_, full(name) + " is missing");
    return member;
  }

  /// The object inside a member.
  [[nodiscard]] JsonSection section(std::string_view name, const Json& member) { return {member, full(name), file_, *error_}; }

  /// A number inside [low, high].
  void number(std::string_view name, double& out, double low = -std::numeric_limits<double>::max(),
              double high = std::numeric_limits<double>::max()) {
    if (const Json* member = required(name)) take_number(*member, full(name), out, low, high);
  }
  /// The same, keeping what `out` holds when the member is absent.
  void optional_number(std::string_view name, double& out, double low, double high) {
    if (const Json* member = optional(name)) take_number(*member, full(name), out, low, high);
  }
  /// Exactly N numbers inside [low, high].
  template <int N>
  void vector(std::string_view name, Eigen::Matrix<double, N, 1>& out, double low = -std::numeric_limits<double>::max(),
              double high = std::numeric_limits<double>::max()) {
    if (const Json* member = required(name)) take_vector(*member, full(name), out, low, high);
  }
  template <int N>
  void optional_vector(std::string_view name, Eigen::Matrix<double, N, 1>& out, double low, double high) {
    if (const Json* member = optional(name)) take_vector(*member, full(name), out, low, high);
  }
  /// Exactly `Rows` arrays of `Cols` numbers.
  template <int Rows, int Cols>
  void matrix(std::string_view name, Eigen::Matrix<double, Rows, Cols>& out) {
    const Json* member = required(name);
    if (!member || !expect_array(*member, full(name), Rows)) return;
    for (int r = 0; r < Rows; ++r) {
      Eigen::Matrix<double, Cols, 1> row;
      take_vector(member->elements[static_cast<std::size_t>(r)], full(name) + '[' + std::to_string(r) + ']', row, -1e12, 1e12);
      out.row(r) = row.transpose();
    }
  }
  /// One of the given words; its index, 0 on error.
  std::size_t word(std::string_view name, const std::vector<std::string>& words) {
    const Json* member = required(name);
    if (!member || !expect(*member, full(name), Json::Kind::string)) return 0;
    for (std::size_t i = 0; i < words.size(); ++i)
      if (member->string == words[i]) return i;
    std::string list;
    for (const std::string& known : words) (list += list.empty() ? "" : ", ") += known;
    fail(*member, full(name) + ": \"" + member->string + "\" is not one of " + list);
    return 0;
  }
  /// An array of strings.
  std::vector<std::string> strings(std::string_view name) {
    std::vector<std::string> out;
    const Json* member = required(name);
    if (!member || !expect(*member, full(name), Json::Kind::array)) return out;
    for (const Json& element : member->elements)
      if (expect(element, full(name), Json::Kind::string)) out.push_back(element.string);
    return out;
  }
  /// An array of whole numbers inside [low, high].
  std::vector<int> integers(std::string_view name, int low, int high) {
    std::vector<int> out;
    const Json* member = required(name);
    if (!member || !expect(*member, full(name), Json::Kind::array)) return out;
    for (const Json& element : member->elements) {
      double value = 0;
      take_number(element, full(name), value, low, high);
      if (value != std::floor(value)) fail(element, full(name) + ": " + json_number(value) + " is not a whole number");
      out.push_back(static_cast<int>(value));
    }
    return out;
  }

  /// Call last: a member that was never asked for is an error.
  void finish() {
    if (!object_->is(Json::Kind::object)) return;
    for (std::size_t i = 0; i < object_->keys.size(); ++i) {
      const std::string& key = object_->keys[i];
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      const std::string nearest = nearest_word(key, known_);
      fail(object_->elements[i], "unknown field " + full(key) + (nearest.empty() ? "" : ": did you mean " + nearest + '?'));
    }
  }

  /// Records an error at a value; the first one wins.
  void fail(const Json& at, std::string what) {
    if (ok()) *error_ = {file_, static_cast<long>(at.line), std::move(what), {}};
  }
  /// "section.name".
  [[nodiscard]] std::string full(std::string_view name) const {
    return path_.empty() ? std::string{name} : path_ + '.' + std::string{name};
  }

  bool expect(const Json& value, const std::string& name, Json::Kind kind) {
    if (value.is(kind)) return true;
    fail(value, name + " must be " + name_of(kind) + ", not " + name_of(value.kind));
    return false;
  }

 private:
  bool expect_array(const Json& value, const std::string& name, int size) {
    if (!expect(value, name, Json::Kind::array)) return false;
    if (value.elements.size() == static_cast<std::size_t>(size)) return true;
    fail(value, name + " has " + std::to_string(value.elements.size()) + " elements, not " + std::to_string(size));
    return false;
  }
  void take_number(const Json& value, const std::string& name, double& out, double low, double high) {
    if (!expect(value, name, Json::Kind::number)) return;
    if (value.number < low || value.number > high)
      return fail(value, name + ": " + json_number(value.number) + " lies outside " + json_number(low) + " .. " + json_number(high));
    out = value.number;
  }
  template <int N>
  void take_vector(const Json& value, const std::string& name, Eigen::Matrix<double, N, 1>& out, double low, double high) {
    if (!expect_array(value, name, N)) return;
    for (int i = 0; i < N; ++i)
      take_number(value.elements[static_cast<std::size_t>(i)], name + '[' + std::to_string(i) + ']', out[i], low, high);
  }
  [[nodiscard]] static std::string json_number(double value) {
    char buffer[32];
    const auto [end, code] = std::to_chars(buffer, buffer + sizeof buffer, value);
    return {buffer, end};
  }

  const Json* object_;
  std::string path_, file_;
  io::Diagnostic* error_;
  std::vector<std::string> known_;
};

}  // namespace searvins::examples
