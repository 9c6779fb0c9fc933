// SPDX-License-Identifier: BSD-3-Clause
// Files as they should not be: each gets its own message with line and hint, or costs just what is spoilt and is counted.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <searvins/io/rinex_info.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;
using test::header_line;
using test::value_cell;

namespace {

const std::string kTypes = test::types_3('G', {"C1C", "L1C"});
const std::string kHeader = test::observation_header(3.04, kTypes);  // 3 lines
const std::string kHeader2 = test::observation_header(2.11, test::types_2({"C1", "L1"}));

/// RINEX 3 epoch of one satellite at a second of 08:20.
std::string epoch_3(const std::string& second, const std::string& line = "G07" + value_cell(2e7) + value_cell(1e8),
                    const std::string& count = "  1") {
  return "> 2024 06 24 08 20 " + second + ".0000000  0" + count + '\n' + line + '\n';
}

std::string epoch_2(const std::string& second, const std::string& line = value_cell(2e7) + value_cell(1e8),
                    const std::string& count = "  1") {
  return " 24  6 24  8 20 " + second + ".0000000  0" + count + "G 7\n" + line + '\n';
}

auto read(const std::string& text) { return io::read_rinex_observation_text(text, "rover.obs"); }

/// The error of a text that must have one.
io::Diagnostic error_of(const std::string& text) {
  const auto parsed = read(text);
  REQUIRE(parsed.error.has_value());
  CHECK(parsed.error->file == "rover.obs");
  CHECK_FALSE(parsed.error->hint.empty());
  return *parsed.error;
}

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Checks that `text` gives `epochs` epochs and one skip for `reason` at `line`.
void check_skipped(const std::string& text, std::size_t epochs, const std::string& reason, long line) {
  const auto parsed = read(text);
  CAPTURE(reason);
  CHECK_FALSE(parsed.error.has_value());
  CHECK(parsed.value.epochs.size() == epochs);
  const io::SkippedItem* item = parsed.skipped.find(reason);
  REQUIRE(item != nullptr);
  CHECK(item->count == 1);
  CHECK(item->first_line == line);
}

}  // namespace

TEST_CASE("bad input: missing file") {
  const auto parsed = io::read_rinex_observation("/no/such/rover.obs");
  REQUIRE(parsed.error);
  CHECK(io::to_string(*parsed.error) == "/no/such/rover.obs: no such file. check the path");
  CHECK(io::to_string(*io::read_rinex_navigation("/no/such/base.nav").error) == "/no/such/base.nav: no such file. check the path");
}

TEST_CASE("bad input: empty file, blank file, folder") {
  CHECK(error_of("").message == "the file is empty");
  const auto blank = error_of("   \n\n");
  CHECK(blank.line == 1);
  CHECK(says(blank.message, "no RINEX file"));
  CHECK(says(blank.hint, "convbin"));
  const auto folder = io::read_rinex_observation(std::filesystem::temp_directory_path());
  REQUIRE(folder.error);
  CHECK(folder.error->message == "is a folder, not a file");
}

TEST_CASE("bad input: no RINEX file at all names what it looks like") {
  CHECK(says(error_of("t,gx,gy,gz,ax,ay,az\n0,0,0,0,0,0,9.8\n").message, "IMU CSV"));
  CHECK(says(error_of("2323, 553950, 0.00, 0.1, 0.2, -9.8, -0.003, -0.001, -0.0001\n").message, "LORD IMU log"));
  CHECK(says(error_of("% RTKLIB\n").message, "RTKLIB solution"));
}

TEST_CASE("bad input: gzip, compress, zip and Hatanaka name the tool") {
  CHECK(says(error_of("\x1f\x8b\x08rest").hint, "gunzip rover.obs"));
  CHECK(says(error_of("\x1f\x9d\x90rest").hint, "gunzip rover.obs"));
  CHECK(says(error_of("PK\x03\x04rest").hint, "unzip rover.obs"));
  const auto hatanaka = error_of(header_line("3.0                 COMPACT RINEX FORMAT", "CRINEX VERS   / TYPE") + kHeader);
  CHECK(says(hatanaka.hint, "CRX2RNX rover.obs"));
  CHECK(hatanaka.line == 1);
  const auto nav = io::read_rinex_navigation_text("\x1f\x8b\x08rest", "base.nav");
  REQUIRE(nav.error);
  CHECK(says(nav.error->hint, "gunzip base.nav"));
}

TEST_CASE("bad input: wrong version") {
  for (const double version : {1.0, 0.0, 5.0, 304.0}) {
    CAPTURE(version);
    const auto e = error_of(test::observation_header(version, kTypes));
    CHECK(e.line == 1);
    CHECK(says(e.message, "RINEX version"));
    CHECK(says(e.message, "not supported"));
    CHECK(says(e.hint, "2.11, 3.0x or 4.0x"));
  }
  CHECK(says(error_of(header_line("     x.y            OBSERVATION DATA    M", "RINEX VERSION / TYPE")).message, "'x.y'"));
}

TEST_CASE("bad input: navigation file for observations and the other way round") {
  const auto as_observation = error_of(header_line("     3.04           N: GNSS NAV DATA    M: MIXED", "RINEX VERSION / TYPE"));
  CHECK(as_observation.line == 1);
  CHECK(says(as_observation.message, "navigation file, observations are expected"));
  CHECK(says(as_observation.hint, "--nav"));
  const auto as_navigation = io::read_rinex_navigation_text(kHeader, "base.nav");
  REQUIRE(as_navigation.error);
  CHECK(as_navigation.error->line == 1);
  CHECK(says(as_navigation.error->message, "observation file, broadcast ephemerides are expected"));
  CHECK(says(as_navigation.error->hint, "--rover or --base"));
  CHECK(
      says(error_of(header_line("     2.10           METEOROLOGICAL DATA", "RINEX VERSION / TYPE")).message, "type 'M' is not supported"));
  const auto glonass = io::read_rinex_navigation_text(header_line("     2.10           GLONASS NAV DATA", "RINEX VERSION / TYPE"), "r.nav");
  REQUIRE(glonass.error);
  CHECK(says(glonass.error->message, "GLONASS"));
}

TEST_CASE("bad input: header without END OF HEADER, cut or with observations following") {
  const std::string head = kHeader.substr(0, kHeader.find("END OF HEADER") - 60);
  const auto cut = error_of(head);
  CHECK(says(cut.message, "no END OF HEADER line: the file ends"));
  CHECK(cut.line == 2);
  const auto following = error_of(head + epoch_3("00"));
  CHECK(says(following.message, "no END OF HEADER line: observations begin"));
  CHECK(following.line == 3);
  CHECK(says(following.hint, "column 61"));
  const std::string head2 = kHeader2.substr(0, kHeader2.find("END OF HEADER") - 60);
  CHECK(says(error_of(head2 + epoch_2(" 0")).message, "observations begin"));
}

TEST_CASE("bad input: header without types, with a wrong number of types, or with foreign types only") {
  const auto none = error_of(test::observation_header(3.04, "") + epoch_3("00"));
  CHECK(none.message == "the header lists no observation types");
  CHECK(none.line == 2);
  CHECK(says(none.hint, "SYS / # / OBS TYPES"));
  CHECK(error_of(test::observation_header(2.11, "") + epoch_2(" 0")).message == "the header lists no observation types");
  const auto fewer = error_of(test::observation_header(3.04, header_line("G   12 C1C L1C", "SYS / # / OBS TYPES")));
  CHECK(fewer.message == "the header announces 12 observation types for G and lists 2");
  CHECK(fewer.line == 2);
  CHECK(says(fewer.hint, "columns"));
  CHECK(says(error_of(test::observation_header(3.04, header_line("G  -12 C1C L1C", "SYS / # / OBS TYPES"))).message, "'-12'"));
  CHECK(says(error_of(test::observation_header(3.04, header_line("G   xx C1C L1C", "SYS / # / OBS TYPES"))).message, "'xx'"));
  CHECK(says(error_of(test::observation_header(3.04, header_line("       C1C L1C", "SYS / # / OBS TYPES"))).message, "never began"));
  const auto foreign = error_of(test::observation_header(3.04, test::types_3('R', {"C1C"})));
  CHECK(says(foreign.message, "no observation types of GPS, Galileo, BeiDou or QZSS"));
}

TEST_CASE("bad input: header and nothing else, or nothing usable") {
  const auto bare = error_of(kHeader);
  CHECK(says(bare.message, "no usable epoch"));
  CHECK(says(bare.hint, "record again"));
  const auto unusable = error_of(kHeader + "> 2024 13 24 08 20 00.0000000  0  1\nG07\n");
  CHECK(says(unusable.message, "1 skipped, first: epoch line is not readable"));
  CHECK(unusable.line == 4);
}

TEST_CASE("bad input: a truncated file loses its last epoch, counted") {
  const std::string text = kHeader + epoch_3("00") + epoch_3("01") + epoch_3("02");
  check_skipped(text.substr(0, text.size() - 10), 2, "the file ends inside an epoch", 8);
  check_skipped(text.substr(0, text.size() - 1), 2, "the file ends inside an epoch", 8);
  const std::string old = kHeader2 + epoch_2(" 0") + epoch_2(" 1");
  check_skipped(old.substr(0, old.size() - 20), 1, "the file ends inside an epoch", 6);
}

TEST_CASE("bad input: absurd satellite counts are skipped with their line, in RINEX 3 and 2") {
  const std::string good = "G07" + value_cell(2e7);
  check_skipped(kHeader + epoch_3("00") + epoch_3("01", good, "999") + epoch_3("02"), 2, "absurd number of satellites", 6);
  check_skipped(kHeader + epoch_3("00") + epoch_3("01", good, " -1") + epoch_3("02"), 2, "absurd number of satellites", 6);
  check_skipped(kHeader + epoch_3("00") + epoch_3("01", good, " 40") + epoch_3("02"), 2, "epoch announces more satellites than follow", 6);
  check_skipped(kHeader + epoch_3("00") + epoch_3("01", good, " 40"), 1, "the file ends inside an epoch", 6);
  check_skipped(kHeader + epoch_3("00") + epoch_3("01", good, " xx") + epoch_3("02"), 2, "epoch line is not readable", 6);
  check_skipped(kHeader2 + epoch_2(" 0") + epoch_2(" 1", good, "999") + epoch_2(" 2"), 2, "absurd number of satellites", 6);
  check_skipped(kHeader2 + epoch_2(" 0") + epoch_2(" 1", good, " 40") + epoch_2(" 2"), 2, "epoch announces more satellites than follow", 6);
  check_skipped(kHeader2 + epoch_2(" 0") + epoch_2(" 1", good, " -1") + epoch_2(" 2"), 2, "absurd number of satellites", 6);
}

TEST_CASE("bad input: more satellite lines than announced") {
  check_skipped(kHeader + epoch_3("00", "G07" + value_cell(2e7) + "\nG08" + value_cell(2e7) + "\nG09" + value_cell(2e7)) + epoch_3("01"), 2,
                "lines that belong to no epoch", 6);
}

TEST_CASE("bad input: tabs are named, in the header with the line, in an epoch by skipping it") {
  const auto in_header = error_of(test::observation_header(3.04, header_line("G\t  2 C1C L1C", "SYS / # / OBS TYPES")));
  CHECK(in_header.line == 2);
  CHECK(says(in_header.message, "tab character"));
  CHECK(says(in_header.hint, "expand rover.obs"));
  CHECK(says(error_of("     3.04\tOBSERVATION DATA\tM\tRINEX VERSION / TYPE\n").message, "tab characters"));
  CHECK_FALSE(read(test::observation_header(3.04, header_line("a\tb", "COMMENT") + kTypes) + epoch_3("00")).error.has_value());
  check_skipped(kHeader + epoch_3("00") + epoch_3("01", "G07\t20000000.000") + epoch_3("02"), 2, "tab character", 6);
  check_skipped(kHeader + epoch_3("00") + ">\t2024 06 24 08 20 01.0000000  0  1\nG07\n" + epoch_3("02"), 2, "tab character", 6);
  check_skipped(kHeader2 + epoch_2(" 0") + epoch_2(" 1", "\t20000000.000") + epoch_2(" 2"), 2, "tab character", 6);
  const auto parsed = read(kHeader + epoch_3("00") + epoch_3("01", "G07\t20000000.000"));
  REQUIRE(parsed.skipped.find("tab character"));
  CHECK(parsed.skipped.find("tab character")->hint == "run expand on the file");
}

TEST_CASE("bad input: CR LF line ends change nothing") {
  std::string text = kHeader + epoch_3("00") + epoch_3("01"), crlf;
  for (const char c : text) crlf += c == '\n' ? "\r\n" : std::string(1, c);
  const auto a = read(text), b = read(crlf);
  REQUIRE(b.value.epochs.size() == 2);
  CHECK(test::same_epoch(a.value.epochs[1], b.value.epochs[1]));
  CHECK(b.skipped.total() == 0);
}

TEST_CASE("bad input: base position missing, zero, or no position at all") {
  const auto position = [](const std::string& records) {
    io::RinexObservationReader reader;
    REQUIRE(reader.open_text(test::observation_header(3.04, records + kTypes)));
    return std::pair{reader.header().approx_position_e_m.has_value(), reader.summary().skipped.total()};
  };
  CHECK(position("") == std::pair{false, 0L});
  CHECK(position(header_line("        0.0000        0.0000        0.0000", "APPROX POSITION XYZ")) == std::pair{false, 0L});
  CHECK(position(header_line("", "APPROX POSITION XYZ")) == std::pair{false, 0L});
  CHECK(position(header_line("        1.0000        1.0000        1.0000", "APPROX POSITION XYZ")) == std::pair{false, 0L});
  CHECK(position(header_line("   nan           nan           nan", "APPROX POSITION XYZ")) == std::pair{false, 1L});
  CHECK(position(header_line(" -3817680.7270  3562839.5216  3650159.2407", "APPROX POSITION XYZ")) == std::pair{true, 0L});
}

TEST_CASE("bad input: unsupported signals and satellites are skipped without losing the columns") {
  const std::string header = test::observation_header(3.04, test::types_3('G', {"X1", "C1C", "C9Z", "L1C"}) + test::types_3('R', {"C1C"}));
  const auto parsed = read(header + epoch_3("00",
                                            "G07" + value_cell(9) + value_cell(2e7) + value_cell(5) + value_cell(1e8) + "\nR05" +
                                                value_cell(2e7) + "\nS20" + value_cell(2e7) + "\nE05" + value_cell(2e7) + "\nGxx" +
                                                value_cell(2e7) + "\nG00" + value_cell(2e7) + "\nI03" + value_cell(2e7),
                                            "  7"));
  REQUIRE(parsed.value.epochs.size() == 1);
  REQUIRE(parsed.value.epochs[0].satellites.size() == 1);
  const gnss::SignalObservation& s = parsed.value.epochs[0].satellites[0].signals[0];
  CHECK(s.code_m == 2e7);
  CHECK(s.phase_cycles == 1e8);
  CHECK(parsed.skipped.count("observation type X1 for G is not used") == 1);
  CHECK(parsed.skipped.count("observation type C9Z for G is not used") == 1);
  CHECK(parsed.skipped.count("GLONASS satellite") == 1);
  CHECK(parsed.skipped.count("SBAS satellite") == 1);
  CHECK(parsed.skipped.count("NavIC satellite") == 1);
  CHECK(parsed.skipped.count("no observation types in the header for Galileo") == 1);
  CHECK(parsed.skipped.count("satellite name is not readable") == 2);
}

TEST_CASE("bad input: duplicated and backward epochs are skipped and counted") {
  check_skipped(kHeader + epoch_3("01") + epoch_3("01") + epoch_3("02"), 2, "duplicate", 6);
  check_skipped(kHeader + epoch_3("05") + epoch_3("03") + epoch_3("06"), 2, "goes back in time", 6);
  check_skipped(kHeader2 + epoch_2(" 5") + epoch_2(" 3") + epoch_2(" 6"), 2, "goes back in time", 6);
}

TEST_CASE("bad input: a damaged date is skipped, a real jump is believed at its second epoch") {
  const std::string far = "> 2027 06 24 08 20 01.0000000  0  1\nG07" + value_cell(2e7) + '\n',
                    farther = "> 2027 06 24 08 20 02.0000000  0  1\nG07" + value_cell(2e7) + '\n';
  check_skipped(kHeader + epoch_3("00") + far + epoch_3("02"), 2, "date jumps by more than 30 days", 6);
  check_skipped(kHeader + epoch_3("00") + far + farther, 2, "date jumps by more than 30 days", 6);
  const std::string first = header_line("  2024     6    24     8    20    0.0000000     GPS", "TIME OF FIRST OBS");
  check_skipped(test::observation_header(3.04, kTypes + first) + far + epoch_3("02"), 1, "date jumps by more than 30 days", 5);
}

TEST_CASE("bad input: NaN, inf, stars and zero observations are missing values") {
  const auto value = [](const std::string& cell, long counted) {
    const auto parsed = read(kHeader + epoch_3("00", "G07" + cell + value_cell(1e8)));
    REQUIRE(parsed.value.epochs.size() == 1);
    REQUIRE(parsed.value.epochs[0].satellites.size() == 1);
    const gnss::SignalObservation& s = parsed.value.epochs[0].satellites[0].signals[0];
    CHECK_FALSE(s.has_code());
    CHECK(s.phase_cycles == 1e8);
    CHECK(parsed.skipped.count("value is not a number") == counted);
  };
  value("           NaN  ", 1);
  value("           inf  ", 1);
  value("**************  ", 1);
  value("      1 234.567 ", 1);
  value("         0.000  ", 0);
  value("                ", 0);
  const auto gone = read(kHeader + epoch_3("00", "G07" + value_cell(0.0)) + epoch_3("01"));
  REQUIRE(gone.value.epochs.size() == 2);
  CHECK(gone.value.epochs[0].satellites.empty());
}

TEST_CASE("bad input: C/N0 and loss-of-lock digits out of range, lines longer than their types") {
  const std::string header = test::observation_header(3.04, test::types_3('G', {"C1C", "L1C", "S1C"}));
  const auto parsed = read(header + epoch_3("00", "G07" + value_cell(2e7) + value_cell(1e8, 'x') + value_cell(-5) + value_cell(7)));
  REQUIRE(parsed.value.epochs.size() == 1);
  const gnss::SignalObservation& s = parsed.value.epochs[0].satellites[0].signals[0];
  CHECK_FALSE(s.has_cn0());
  CHECK_FALSE(s.loss_of_lock);
  CHECK(parsed.skipped.count("C/N0 outside") == 1);
  CHECK(parsed.skipped.count("loss-of-lock indicator") == 1);
  CHECK(parsed.skipped.count("longer than its types") == 1);
}

TEST_CASE("bad input: a satellite twice in an epoch counts once") {
  const auto parsed = read(kHeader + epoch_3("00", "G07" + value_cell(2e7) + "\nG07" + value_cell(3e7), "  2"));
  REQUIRE(parsed.value.epochs.size() == 1);
  REQUIRE(parsed.value.epochs[0].satellites.size() == 1);
  CHECK(parsed.value.epochs[0].satellites[0].signals[0].code_m == 2e7);
  CHECK(parsed.skipped.count("stands twice") == 1);
}

TEST_CASE("bad input: damaged header records in mid-file end the reading with their line, epochs before it stay") {
  const auto parsed = read(kHeader + epoch_3("00") + ">                              4  1\n" +
                           header_line("G   12 C1C", "SYS / # / OBS TYPES") + epoch_3("01"));
  CHECK(parsed.value.epochs.size() == 1);
  REQUIRE(parsed.error);
  CHECK(parsed.error->line == 7);
  CHECK(says(parsed.error->message, "announces 12 observation types"));
  check_skipped(kHeader + epoch_3("00") + ">                              4 50\n" + header_line("x", "COMMENT") + epoch_3("01"), 2,
                "event announces more records than follow", 8);
  check_skipped(kHeader + epoch_3("00") + ">                              4 50\n" + header_line("x", "COMMENT"), 1,
                "the file ends inside the records of an event", 7);
}

TEST_CASE("bad input: unknown time system") {
  const auto e = error_of(
      test::observation_header(3.04, kTypes + header_line("  2024     6    24     8    20    0.0000000     XYZ", "TIME OF FIRST OBS")));
  CHECK(e.message == "the time system 'XYZ' is not known");
  CHECK(e.line == 3);
  CHECK(says(e.hint, "columns 49-51"));
}

TEST_CASE("bad input: dates and epoch flags that do not exist cost their epoch only") {
  for (const char* date : {"2024 13 24 08 20 01.0000000  0", "2024 02 30 08 20 01.0000000  0", "2024 06 24 25 20 01.0000000  0",
                           "2024 06 24 08 61 01.0000000  0", "1970 06 24 08 20 01.0000000  0", "2024 06 24 08 20 61.5000000  0",
                           "2024 06 24 08 20 -1.0000000  0", "2024 06 24 08 20 01.0000000  8", "2024 06 24 08 20 01.00x0000  0"}) {
    CAPTURE(date);
    check_skipped(kHeader + epoch_3("00") + "> " + date + "  1\nG07" + value_cell(2e7) + '\n' + epoch_3("02"), 2,
                  "epoch line is not readable", 6);
  }
}
