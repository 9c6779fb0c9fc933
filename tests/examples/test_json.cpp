// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "examples/support/json.hpp"
#include "examples/support/json_writer.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::test::for_all_seeds;
using searvins::test::integer;
using searvins::test::Rng;

namespace {

std::string random_text(Rng& rng) {
  std::string text;
  for (int i = integer(rng, 0, 8); i > 0; --i) {
    std::uint32_t code = static_cast<std::uint32_t>(integer(rng, 0, 3) == 0 ? integer(rng, 0, 0x10FFFF) : integer(rng, 0, 0x7F));
    if (code >= 0xD800 && code < 0xE000) code = '?';
    examples::detail::append_utf8(text, code);
  }
  return text;
}

Json random_value(Rng& rng, int depth) {
  Json value;
  value.kind = static_cast<Json::Kind>(integer(rng, 0, depth > 0 ? 5 : 3));
  if (value.is(Json::Kind::boolean)) value.boolean = test::chance(rng, 0.5);
  if (value.is(Json::Kind::number)) value.number = test::normal(rng) * std::pow(10.0, integer(rng, -300, 300));
  if (value.is(Json::Kind::string)) value.string = random_text(rng);
  if (value.is(Json::Kind::array) || value.is(Json::Kind::object))
    for (int i = integer(rng, 0, 4); i > 0; --i) {
      value.elements.push_back(random_value(rng, depth - 1));
      if (value.is(Json::Kind::object)) value.keys.push_back(std::to_string(i) + random_text(rng));
    }
  return value;
}

void write(JsonWriter& json, const Json& value, const std::string& key) {
  switch (value.kind) {
    case Json::Kind::null: json.member(key, std::nan("")); break;
    case Json::Kind::boolean: json.member(key, value.boolean); break;
    case Json::Kind::number: json.member(key, value.number); break;
    case Json::Kind::string: json.member(key, value.string); break;
    case Json::Kind::array:
      json.begin_array(key);
      for (const Json& element : value.elements) write(json, element, {});
      json.end_array();
      break;
    case Json::Kind::object:
      json.begin_object(key);
      for (std::size_t i = 0; i < value.keys.size(); ++i) write(json, value.elements[i], value.keys[i]);
      json.end_object();
      break;
  }
}

bool equal(const Json& a, const Json& b) {
  if (a.kind != b.kind || a.boolean != b.boolean || a.number != b.number || a.string != b.string || a.keys != b.keys) return false;
  if (a.elements.size() != b.elements.size()) return false;
  for (std::size_t i = 0; i < a.elements.size(); ++i)
    if (!equal(a.elements[i], b.elements[i])) return false;
  return true;
}

std::string error_of(const std::string& text, const JsonLimits& limits = {}) {
  const auto result = parse_json(text, "f.json", limits);
  return result.ok() ? "accepted" : to_string(result.error());
}

}  // namespace

TEST_CASE("JSON: what the writer writes the reader reads, values to the bit") {
  for_all_seeds(200, [](Rng& rng) {
    const Json value = random_value(rng, 4);
    JsonWriter json{integer(rng, 0, 4)};
    write(json, value, {});
    const auto back = parse_json(json.text(), "f.json");
    REQUIRE_MESSAGE(back.ok(), to_string(back.error()));
    CHECK(equal(value, *back));
  });
}

TEST_CASE("JSON: any cut or changed byte is read or refused, never more") {
  for_all_seeds(200, [](Rng& rng) {
    JsonWriter json{1};
    write(json, random_value(rng, 4), {});
    std::string text = json.text();
    if (text.size() > 1)
      text[static_cast<std::size_t>(integer(rng, 0, static_cast<int>(text.size()) - 1))] = static_cast<char>(integer(rng, 0, 255));
    text.resize(static_cast<std::size_t>(integer(rng, 0, static_cast<int>(text.size()))));
    const auto result = parse_json(text, "f.json");
    CHECK((result.ok() || !result.error().message.empty()));
    CHECK(result.error().line <= 1 + std::count(text.begin(), text.end(), '\n'));
  });
}

TEST_CASE("JSON: strictness, each refusal with line and column") {
  CHECK(error_of("{\"a\": 1,\n \"a\": 2}") == "f.json:2: column 5: the key \"a\" stands twice");
  CHECK(error_of("[1,\n 2,]").find("f.json:2: column 4: not a value") == 0);
  CHECK(error_of("[1 2]").find("expected , or ]") != std::string::npos);
  CHECK(error_of("{a: 1}").find("key in quotes") != std::string::npos);
  CHECK(error_of("{} x").find("after the end") != std::string::npos);
  CHECK(error_of("// note\n{}").find("comments") != std::string::npos);
  for (const char* bad : {"",         "  ",  "01",  "-", "1.", ".5",  "1e",      "+1",       "nan",   "NaN",
                          "Infinity", "tru", "'a'", "[", "{",  "\"a", "{\"a\"}", "{\"a\":}", "1e999", "-1e999"})
    CHECK_MESSAGE(error_of(bad) != "accepted", bad);
  for (const char* good : {"0", "-0", "1e5", "1E-400", "0.5", "[]", "{}", " [1 , 2] \n", "\"\"", "null", "-12.5e+3"})
    CHECK_MESSAGE(error_of(good) == "accepted", good);
}

TEST_CASE("JSON: escapes and UTF-8") {
  const auto text_of = [](const std::string& literal) {
    const auto result = parse_json(literal, "f.json");
    return result.ok() ? result->string : "refused";
  };
  CHECK(text_of("\"a\\n\\t\\\"\\\\\\/\\u0041\\u00e9\"") == "a\n\t\"\\/A\xC3\xA9");
  CHECK(text_of("\"\\ud83d\\ude80\"") == "\xF0\x9F\x9A\x80");
  for (const char* bad : {"\"\\ud83d\"", "\"\\ude80\"", "\"\\ud83d\\u0041\"", "\"\\u12\"", "\"\\x41\"", "\"\xC3\"", "\"\xC0\x80\"",
                          "\"\xED\xA0\x80\"", "\"\xF4\x90\x80\x80\"", "\"\xFF\"", "\"\n\""})
    CHECK(text_of(bad) == "refused");
  CHECK(json_literal(std::string_view{"</script>\x01\xFF"}) == "\"\\u003c/script>\\u0001\xEF\xBF\xBD\"");
}

TEST_CASE("JSON: depth and size are bounded") {
  const auto nested = [](int n) { return std::string(static_cast<std::size_t>(n), '[') + std::string(static_cast<std::size_t>(n), ']'); };
  CHECK(error_of(nested(64)) == "accepted");
  CHECK(error_of(nested(65)).find("deeper than 64") != std::string::npos);
  CHECK(error_of(std::string(1'000'000, '[')).find("deeper") != std::string::npos);
  CHECK(error_of("[1,2,3,4]", {64, 8}).find("longer than 8 bytes") != std::string::npos);
}
