// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/io/text_reader.hpp>

#include "support/property.hpp"

using namespace searvins;

namespace {

/// A file that is gone when the test ends.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& content) : path_(std::filesystem::temp_directory_path() / "searvins_test_text_reader.txt") {
    std::ofstream{path_, std::ios::binary} << content;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::vector<std::string> lines_of(io::TextReader& reader) {
  std::vector<std::string> lines;
  std::string_view line;
  while (reader.next(line)) lines.emplace_back(line);
  return lines;
}

}  // namespace

TEST_CASE("any text comes back line by line, from a file as from memory, whatever the line ends") {
  test::for_all_seeds(30, [](test::Rng& rng) {
    std::vector<std::string> lines;
    std::string text;
    const int n = test::integer(rng, 1, 40);
    const bool last_terminated = test::chance(rng, 0.5);
    for (int i = 0; i < n; ++i) {
      std::string line(static_cast<std::size_t>(test::chance(rng, 0.05) ? test::integer(rng, 100'000, 400'000) : test::integer(rng, 0, 90)),
                       ' ');
      for (char& c : line) c = static_cast<char>(test::integer(rng, '!', '~'));
      if (i + 1 == n && line.empty()) line = "x";
      lines.push_back(line);
      text += line + std::string(test::chance(rng, 0.3) ? 3 : 0, ' ');
      if (i + 1 < n || last_terminated) text += test::chance(rng, 0.5) ? "\r\n" : "\n";
    }
    const TemporaryFile file{text};
    io::TextReader from_file, from_text;
    REQUIRE_FALSE(from_file.open(file.path()));
    REQUIRE_FALSE(from_text.open_text(text, "text"));
    CHECK(lines_of(from_file) == lines);
    CHECK(lines_of(from_text) == lines);
    CHECK(from_file.line_number() == n);
    CHECK(from_text.line_is_terminated() == last_terminated);
    CHECK(from_file.line_is_terminated() == last_terminated);
  });
}

TEST_CASE("a line that is put back comes again with its number") {
  io::TextReader reader;
  REQUIRE_FALSE(reader.open_text("one\n\ntwo\nthree", "text"));
  std::string_view line;
  reader.unread();
  REQUIRE(reader.next(line));
  REQUIRE(reader.next(line));
  CHECK(line.empty());
  reader.unread();
  reader.unread();
  REQUIRE(reader.next(line));
  CHECK(line.empty());
  CHECK(reader.line_number() == 2);
  REQUIRE(reader.next(line));
  CHECK(line == "two");
  reader.unread();
  CHECK(reader.head() == "two\nthree");
  REQUIRE(reader.next(line));
  REQUIRE(reader.next(line));
  CHECK(line == "three");
  CHECK_FALSE(reader.line_is_terminated());
  CHECK_FALSE(reader.next(line));
}

TEST_CASE("a byte-order mark is dropped and a line without end is delivered in pieces") {
  io::TextReader reader;
  REQUIRE_FALSE(reader.open_text("\xEF\xBB\xBFtext\n", "text"));
  std::string_view line;
  REQUIRE(reader.next(line));
  CHECK(line == "text");

  const TemporaryFile file{std::string(3 * io::TextReader::kMaxLine, 'x')};
  REQUIRE_FALSE(reader.open(file.path()));
  std::size_t sum = 0;
  while (reader.next(line)) {
    CHECK(line.size() <= io::TextReader::kMaxLine + io::TextReader::kBlock);
    sum += line.size();
  }
  CHECK(sum == 3 * io::TextReader::kMaxLine);
}

TEST_CASE("missing file, folder and empty file are told apart, each with what to do") {
  io::TextReader reader;
  const auto missing = reader.open("/no/such/file.obs");
  REQUIRE(missing);
  CHECK(io::to_string(*missing) == "/no/such/file.obs: no such file. check the path");
  const auto folder = reader.open(std::filesystem::temp_directory_path());
  REQUIRE(folder);
  CHECK(folder->message == "is a folder, not a file");
  CHECK(folder->hint == "name one of the files in it");
  const TemporaryFile file{""};
  const auto empty = reader.open(file.path());
  REQUIRE(empty);
  CHECK(empty->message == "the file is empty");
  CHECK(empty->hint.find("again") != std::string::npos);
  CHECK(reader.open_text("", "text").has_value());
}
