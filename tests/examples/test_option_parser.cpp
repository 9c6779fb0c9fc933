// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "examples/support/option_parser.hpp"
#include "examples/support/progress.hpp"
#include "examples/support/table.hpp"

using namespace searvins::examples;

namespace {

OptionParser make_parser() {
  OptionParser parser{"tool", "does things"};
  parser.value("rover", "FILE", "rover file").required();
  parser.value("nav", "FILE", "navigation file").repeated();
  parser.value("lag", "S", "window length, seconds").fallback("6");
  parser.value("robust", "MODE", "formulation").one_of({"batch", "scalar", "latent"}).fallback("latent");
  parser.value("base-ecef", "X,Y,Z", "base position");
  parser.value("signals", "LIST", "signals");
  parser.flag("quiet", "no progress");
  parser.positionals("FILE", "more files", 0, 2);
  return parser;
}

Options parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "solve");
  return make_parser().parse(static_cast<int>(arguments.size()), arguments.data());
}

}  // namespace

TEST_CASE("options: values, repeats, flags, fallbacks, lists, positionals") {
  Options o =
      parse({"--rover", "r.obs", "--nav", "a", "--nav=b", "--quiet", "--base-ecef", "-1,2,-3.5", "--signals", "G1C,G2W", "x", "--", "-y"});
  CHECK(o.error().empty());
  CHECK(o.text("rover") == "r.obs");
  CHECK(o.texts("nav") == std::vector<std::string>{"a", "b"});
  CHECK(o.flag("quiet"));
  CHECK_FALSE(o.given("lag"));
  CHECK(o.number("lag", 0.1, 100) == 6);
  CHECK(o.text("robust") == "latent");
  CHECK(o.numbers("base-ecef", 3) == std::vector<double>{-1, 2, -3.5});
  CHECK(o.list("signals") == std::vector<std::string>{"G1C", "G2W"});
  CHECK(o.positionals() == std::vector<std::string>{"x", "-y"});
  CHECK_FALSE(o.finished());
}

TEST_CASE("options: usage errors name the option, suggest the nearest, exit with 2") {
  const auto error = [](std::vector<const char*> arguments) {
    arguments.insert(arguments.end(), {"--rover", "r"});
    return parse(arguments).error();
  };
  CHECK(error({"--robsut", "batch"}) == "unknown option --robsut: did you mean --robust?");
  CHECK(error({"--sig", "G1C"}) == "unknown option --sig: did you mean --signals?");
  CHECK(error({"--completely-else"}) == "unknown option --completely-else");
  CHECK(error({"-q"}) == "unknown option -q");
  CHECK(error({"--robust", "latnet"}).find("did you mean latent?") != std::string::npos);
  CHECK(error({"--lag", "1", "--lag", "2"}) == "--lag is given twice");
  CHECK(error({"--quiet=1"}) == "--quiet takes no value");
  CHECK(error({"--lag"}) == "--lag needs a value: --lag S");
  CHECK(error({"--lag="}) == "--lag needs a value: --lag S");
  CHECK(error({"a", "b", "c"}) == "unexpected argument 'c'");
  CHECK(parse({"--quiet"}).error() == "--rover FILE is missing");
  CHECK(*parse({"--quiet"}).finished() == kExitUsage);
}

TEST_CASE("options: getters check type and range") {
  Options o = parse({"--rover", "r", "--lag", "abc", "--base-ecef", "1,2"});
  (void)o.number("lag", 0, 1);
  CHECK(o.error() == "--lag: 'abc' is not a number");
  Options range = parse({"--rover", "r", "--lag", "7"});
  (void)range.number("lag", 0.5, 6);
  CHECK(range.error() == "--lag: 7 lies outside 0.5 .. 6");
  Options whole = parse({"--rover", "r", "--lag", "2.5"});
  (void)whole.integer("lag", 0, 9);
  CHECK(whole.error() == "--lag: '2.5' is not a whole number");
  Options three = parse({"--rover", "r", "--base-ecef", "1,2"});
  CHECK(three.numbers("base-ecef", 3).empty());
  CHECK(three.error() == "--base-ecef takes 3 numbers separated by commas");
  Options missing = parse({"--rover", "r"});
  CHECK_FALSE(missing.optional_number("base-ecef", 0, 1));
  CHECK(missing.error().empty());
}

TEST_CASE("options: help and version win over missing options") {
  const Options help = parse({"--help"});
  for (const char* part : {"usage: tool --rover FILE [options] [FILE...]", "--robust MODE", "batch, scalar, latent (default latent)",
                           "(may be repeated)", "--version"})
    CHECK_MESSAGE(help.notice().find(part) != std::string::npos, part);
  std::size_t begin = 0;
  for (std::size_t end; (end = help.notice().find('\n', begin)) != std::string::npos; begin = end + 1) CHECK(end - begin <= 100);
  CHECK(parse({"--version"}).notice() == std::string{"searvins "} + searvins::kVersionString + "\n");
}

TEST_CASE("edit distance: identity, symmetry, single edits, a swap is one") {
  CHECK(edit_distance("same", "same") == 0);
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("robust", "robsut") == 1);
  CHECK(edit_distance("lag", "flag") == edit_distance("flag", "lag"));
  CHECK(edit_distance("kitten", "sitting") == 3);
}

TEST_CASE("table: columns line up, numbers to the right, unknown as a dash") {
  Table table{{"run", "m", "long header"}};
  table.row({"a", cell(1.25, 1), cell(std::nan(""), 2)});
  table.row({"longer name", "10"});
  CHECK(table.text() ==
        "run            m  long header\n"
        "-----------  ---  -----------\n"
        "a            1.2            -\n"
        "longer name   10\n");
}

TEST_CASE("progress: without a terminal a line every tenth, never more than eleven") {
  std::FILE* stream = std::tmpfile();
  REQUIRE(stream);
  Progress progress{"solving", 1234, false, stream};
  for (std::size_t i = 0; i <= 1234; ++i) progress.update(i);
  progress.finish();
  std::rewind(stream);
  int lines = 0;
  for (int c; (c = std::fgetc(stream)) != EOF;) lines += c == '\n';
  std::fclose(stream);
  CHECK(lines == 11);
}
