// SPDX-License-Identifier: BSD-3-Clause
// Any bytes through the JSON reader and the rig reader: a value or a message, no crash, and what was read survives writing.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "examples/support/json.hpp"
#include "examples/support/json_writer.hpp"
#include "examples/support/rig.hpp"

namespace {

using searvins::examples::Json;
using searvins::examples::JsonWriter;

void write(JsonWriter& json, const Json& value, bool member, const std::string& key) {
  const std::string_view name = member ? std::string_view{key} : std::string_view{};
  switch (value.kind) {
    case Json::Kind::null: json.member(name, std::string_view{"null"}); break;
    case Json::Kind::boolean: json.member(name, value.boolean); break;
    case Json::Kind::number: json.member(name, value.number); break;
    case Json::Kind::string: json.member(name, value.string); break;
    case Json::Kind::array:
    case Json::Kind::object:
      value.is(Json::Kind::array) ? json.begin_array(name) : json.begin_object(name);
      for (std::size_t i = 0; i < value.elements.size(); ++i) {
        const std::string inner = value.is(Json::Kind::object) ? "k" + value.keys[i] : std::string{};
        write(json, value.elements[i], value.is(Json::Kind::object), inner);
      }
      value.is(Json::Kind::array) ? json.end_array() : json.end_object();
      break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto value = searvins::examples::parse_json(text, "fuzz");
  if (value.ok()) {
    JsonWriter json;
    write(json, *value, false, {});
    if (!searvins::examples::parse_json(json.text(), "written").ok()) std::abort();
  } else if (value.error().message.empty()) {
    std::abort();
  }
  const auto rig = searvins::examples::parse_rig(text, "fuzz");
  if (!rig.ok() && rig.error().message.empty()) std::abort();
  return 0;
}
