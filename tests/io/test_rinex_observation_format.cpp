// SPDX-License-Identifier: BSD-3-Clause
// What each part of a RINEX observation file means.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <searvins/io/rinex_observation.hpp>

#include "support/rinex_text.hpp"

using namespace searvins;
using test::header_line;
using test::value_cell;

namespace {

const GpsTime kFileStart = gps_from_civil({2024, 6, 24, 8, 20, 0.0});

/// One RINEX 3 file from types and a body.
std::string file_3(const std::string& types, const std::string& body, double version = 3.04, const std::string& records = "") {
  return test::observation_header(version, types + records) + body;
}

std::string epoch_line(const std::string& second, int n, int flag = 0) {
  char count[16];
  std::snprintf(count, sizeof count, "%3d%3d", flag, n);
  return "> 2024 06 24 08 20 " + second + ".0000000" + count + '\n';
}

std::vector<gnss::ObservationEpoch> epochs_of(const std::string& text) { return io::read_rinex_observation_text(text).value.epochs; }

const std::string kTypesG = test::types_3('G', {"C1C", "L1C", "S1C"});

}  // namespace

TEST_CASE("header: marker, position, antenna, interval, leap seconds, phase shifts, receiver") {
  const std::string records =
      header_line("ROVER 1", "MARKER NAME") + header_line("3605054             SEPT MOSAIC-X5      4.14.4", "REC # / TYPE / VERS") +
      header_line("                    JAVRINGANT_DM   JVDM", "ANT # / TYPE") +
      header_line(" -3817680.7270  3562839.5216  3650159.2407", "APPROX POSITION XYZ") +
      header_line("        1.2345        0.1000       -0.2000", "ANTENNA: DELTA H/E/N") + header_line("     1.000", "INTERVAL") +
      header_line("    18    18  2185     7", "LEAP SECONDS") + header_line("G L2X -0.25000", "SYS / PHASE SHIFT") +
      header_line("G L1C", "SYS / PHASE SHIFT") + header_line("     1", "RCV CLOCK OFFS APPL") +
      header_line("  2024     6    24     8    20    0.0000000     GPS", "TIME OF FIRST OBS");
  io::RinexObservationReader reader;
  REQUIRE(reader.open_text(file_3(kTypesG, "", 3.04, records)));
  const io::RinexObservationHeader& h = reader.header();
  CHECK(h.first_line.version == 3.04);
  CHECK(h.first_line.type == 'O');
  CHECK(h.marker_name == "ROVER 1");
  CHECK(h.receiver == "SEPT MOSAIC-X5");
  CHECK(h.antenna == "JAVRINGANT_DM   JVDM");
  REQUIRE(h.approx_position_e_m);
  CHECK(*h.approx_position_e_m == Eigen::Vector3d{-3817680.7270, 3562839.5216, 3650159.2407});
  CHECK(h.antenna_delta_hen_m == Eigen::Vector3d{1.2345, 0.1, -0.2});
  CHECK(h.interval_s == 1.0);
  CHECK(h.leap_seconds == 18);
  REQUIRE(h.phase_shifts.size() == 2);
  CHECK(h.phase_shifts[0].signal == test::signal("G2X"));
  CHECK(h.phase_shifts[0].cycles == -0.25);
  CHECK(h.clock_offset_applied);
  CHECK(h.first_observation == kFileStart);
  REQUIRE(h.layouts[0].signals.size() == 1);
  CHECK(h.layouts[0].signals[0] == test::signal("G1C"));
  CHECK(h.layouts[0].columns.size() == 3);
  CHECK(h.layouts[1].columns.empty());
}

TEST_CASE("satellite names with a blank for a zero, and in RINEX 2 a blank for GPS") {
  const auto modern = epochs_of(file_3(kTypesG, epoch_line("00", 1) + "G 7" + value_cell(2e7) + '\n'));
  REQUIRE(modern.size() == 1);
  CHECK(modern[0].find({gnss::Constellation::gps, 7}) != nullptr);
  const auto legacy = epochs_of(test::observation_header(2.11, test::types_2({"C1"})) + " 24  6 24  8 20  0.0000000  0  2  7G 9\n" +
                                value_cell(2e7) + '\n' + value_cell(2.1e7) + '\n');
  REQUIRE(legacy.size() == 1);
  CHECK(legacy[0].find({gnss::Constellation::gps, 7}) != nullptr);
  CHECK(legacy[0].find({gnss::Constellation::gps, 9}) != nullptr);
}

TEST_CASE("RINEX 2 types: each constellation's signals, L2 with P2 before C2, L1 with C1 before P1") {
  const std::string header = test::observation_header(2.11, test::types_2({"C1", "P1", "L1", "P2", "C2", "L2", "S2"}));
  const auto satellite = [&](const std::string& name, const std::vector<double>& v) {
    const std::string body = " 24  6 24  8 20  0.0000000  0  1" + name + '\n' + value_cell(v[0]) + value_cell(v[1]) + value_cell(v[2]) +
                             value_cell(v[3]) + value_cell(v[4]) + '\n' + value_cell(v[5]) + value_cell(v[6]) + '\n';
    const auto epochs = epochs_of(header + body);
    return epochs.empty() || epochs[0].satellites.empty() ? gnss::SatelliteObservation{} : epochs[0].satellites[0];
  };
  const double no = gnss::kMissing;
  const auto both = satellite("G01", {2e7, 2.1e7, 1e8, 2.2e7, 2.3e7, 8e7, 40});
  REQUIRE(both.find(test::signal("G1C")));
  CHECK(both.find(test::signal("G1C"))->phase_cycles == 1e8);
  CHECK(both.find(test::signal("G1W"))->code_m == 2.1e7);
  CHECK_FALSE(both.find(test::signal("G1W"))->has_phase());
  CHECK(both.find(test::signal("G2W"))->phase_cycles == 8e7);
  CHECK(both.find(test::signal("G2W"))->cn0_dbhz == 40);
  CHECK(both.find(test::signal("G2X"))->code_m == 2.3e7);
  CHECK_FALSE(both.find(test::signal("G2X"))->has_phase());

  const auto only_c2 = satellite("G01", {no, 2.1e7, 1e8, no, 2.3e7, 8e7, no});
  CHECK(only_c2.find(test::signal("G1W"))->phase_cycles == 1e8);
  CHECK(only_c2.find(test::signal("G2X"))->phase_cycles == 8e7);
  CHECK(only_c2.find(test::signal("G2W")) == nullptr);
  const auto no_code = satellite("G01", {no, no, 1e8, no, no, 8e7, no});
  CHECK(no_code.find(test::signal("G1C"))->phase_cycles == 1e8);
  CHECK(no_code.find(test::signal("G2W"))->phase_cycles == 8e7);

  CHECK(satellite("E11", {2e7, no, 1e8, no, no, no, no}).find(test::signal("E1X"))->phase_cycles == 1e8);
  CHECK(satellite("C11", {no, no, no, no, 2e7, 1e8, no}).find(test::signal("C2I"))->phase_cycles == 1e8);
  CHECK(satellite("C11", {2e7, no, 1e8, no, no, no, no}).find(test::signal("C2I"))->code_m == 2e7);
  CHECK(satellite("J02", {2e7, no, 1e8, no, 2.1e7, 8e7, no}).find(test::signal("J2X"))->phase_cycles == 8e7);
}

TEST_CASE("RINEX 2 with L2 and neither P2 nor C2 listed means L2W") {
  const auto epochs = epochs_of(test::observation_header(2.10, test::types_2({"L1", "L2"})) + " 05  4  2  0  0  0.0000000  0  1G 3\n" +
                                value_cell(1e7) + value_cell(2e7) + '\n');
  REQUIRE(epochs.size() == 1);
  CHECK(epochs[0].satellites[0].find(test::signal("G1C"))->phase_cycles == 1e7);
  CHECK(epochs[0].satellites[0].find(test::signal("G2W"))->phase_cycles == 2e7);
}

TEST_CASE("BeiDou B1I is 2I in every version, B1C stays band 1 after 3.02") {
  const std::string body = epoch_line("00", 1) + "C05" + value_cell(3.8e7) + value_cell(3.9e7) + '\n';
  const std::string types = test::types_3('C', {"C1I", "C1X"});
  const auto old = epochs_of(file_3(types, body, 3.02));
  const auto modern = epochs_of(file_3(types, body, 3.04));
  REQUIRE(old.size() == 1);
  REQUIRE(modern.size() == 1);
  CHECK(old[0].satellites[0].find(test::signal("C2I"))->code_m == 3.8e7);
  CHECK(old[0].satellites[0].find(test::signal("C2X"))->code_m == 3.9e7);
  CHECK(modern[0].satellites[0].find(test::signal("C2I"))->code_m == 3.8e7);
  CHECK(modern[0].satellites[0].find(test::signal("C1X"))->code_m == 3.9e7);
}

TEST_CASE("loss-of-lock bits: slip, half cycle, and in RINEX 2 the inverse of the wavelength factor") {
  const auto flags = [](const std::string& text) {
    const auto epochs = epochs_of(text);
    REQUIRE(epochs.size() == 1);
    const gnss::SignalObservation& s = epochs[0].satellites[0].signals[0];
    return std::pair{s.loss_of_lock, s.half_cycle};
  };
  const auto modern = [&](char lli) {
    return flags(file_3(kTypesG, epoch_line("00", 1) + "G07" + value_cell(2e7) + value_cell(1e8, lli) + '\n'));
  };
  CHECK(modern(' ') == std::pair{false, false});
  CHECK(modern('0') == std::pair{false, false});
  CHECK(modern('1') == std::pair{true, false});
  CHECK(modern('2') == std::pair{false, true});
  CHECK(modern('3') == std::pair{true, true});
  CHECK(modern('4') == std::pair{false, false});
  CHECK(modern('7') == std::pair{true, true});
  const auto legacy = [&](const char* factors, char lli) {
    return flags(test::observation_header(2.11, header_line(factors, "WAVELENGTH FACT L1/2") + test::types_2({"L2"})) +
                 " 24  6 24  8 20  0.0000000  0  1G 7\n" + value_cell(1e8, lli) + '\n');
  };
  CHECK(legacy("     1     1", '4') == std::pair{false, false});
  CHECK(legacy("     1     2", ' ') == std::pair{false, true});
  CHECK(legacy("     1     2", '2') == std::pair{false, false});
  CHECK(legacy("     1     2", '3') == std::pair{true, false});
  CHECK(legacy("     1     2     1   G07", ' ') == std::pair{false, false});
}

TEST_CASE("a loss of lock counts even where the phase is missing, and one in a skipped epoch is passed on") {
  const std::string missing = epoch_line("00", 1) + "G07" + value_cell(2e7) + value_cell(gnss::kMissing, '1') + '\n';
  const auto alone = epochs_of(file_3(kTypesG, missing));
  REQUIRE(alone.size() == 1);
  CHECK(alone[0].satellites[0].signals[0].loss_of_lock);

  const auto good = [](const char* second) { return epoch_line(second, 1) + "G07" + value_cell(2e7) + value_cell(1e8) + '\n'; };
  const std::string bad = epoch_line("01", 3) + "G07" + value_cell(2e7) + value_cell(1e8, '1') + '\n';
  const auto epochs = epochs_of(file_3(kTypesG, good("00") + bad + good("02") + good("03")));
  REQUIRE(epochs.size() == 3);
  CHECK_FALSE(epochs[0].satellites[0].signals[0].loss_of_lock);
  CHECK(epochs[1].satellites[0].signals[0].loss_of_lock);
  CHECK_FALSE(epochs[2].satellites[0].signals[0].loss_of_lock);
}

TEST_CASE("the signal strength digit stands in for a missing C/N0 and never replaces one") {
  const auto cn0 = [](double s, char ssi) {
    const auto epochs =
        epochs_of(file_3(kTypesG, epoch_line("00", 1) + "G07" + value_cell(2e7) + value_cell(1e8, ' ', ssi) + value_cell(s) + '\n'));
    REQUIRE(epochs.size() == 1);
    return epochs[0].satellites[0].signals[0].cn0_dbhz;
  };
  CHECK(cn0(43.25, '5') == 43.25);
  CHECK(cn0(gnss::kMissing, '5') == 33);
  CHECK(cn0(gnss::kMissing, '9') == 57);
  CHECK(std::isnan(cn0(gnss::kMissing, ' ')));
  CHECK(std::isnan(cn0(gnss::kMissing, '0')));
}

TEST_CASE("tags in BeiDou time and UTC become GPS time") {
  const auto tag = [](const char* system, const char* file_system) {
    const std::string first =
        system ? header_line(std::string("  2024     6    24     8    20    0.0000000     ") + system, "TIME OF FIRST OBS") : std::string{};
    const auto epochs =
        epochs_of(test::observation_header(3.04, kTypesG + first, file_system) + epoch_line("00", 1) + "G07" + value_cell(2e7) + '\n');
    REQUIRE(epochs.size() == 1);
    return seconds_between(kFileStart, epochs[0].tag);
  };
  CHECK(tag("GPS", "M") == 0);
  CHECK(tag("GAL", "M") == 0);
  CHECK(tag("QZS", "M") == 0);
  CHECK(tag("BDT", "M") == 14);
  CHECK(tag("GLO", "M") == 18);
  CHECK(tag("UTC", "M") == 18);
  CHECK(tag(nullptr, "G") == 0);
  CHECK(tag(nullptr, "C") == 14);
  CHECK(tag(nullptr, "R") == 18);
}

TEST_CASE("the receiver clock offset of the epoch line is kept aside") {
  io::RinexObservationReader reader;
  const std::string line = "> 2024 06 24 08 20 00.0000000  0  1      -0.000123456789\n";
  REQUIRE(reader.open_text(file_3(kTypesG, line + "G07" + value_cell(2e7) + '\n' + epoch_line("01", 1) + "G07" + value_cell(2e7) + '\n')));
  auto epoch = reader.next();
  REQUIRE(epoch);
  CHECK(epoch->tag == kFileStart);
  CHECK(reader.receiver_clock_offset_s() == -0.000123456789);
  epoch = reader.next();
  REQUIRE(epoch);
  CHECK_FALSE(reader.receiver_clock_offset_s().has_value());
  REQUIRE(reader.open_text(test::observation_header(2.11, test::types_2({"C1"})) + " 24  6 24  8 20  0.0000000  0  1G 7" +
                           std::string(33, ' ') + " 0.000000123\n" + value_cell(2e7) + '\n'));
  REQUIRE(reader.next());
  CHECK(reader.receiver_clock_offset_s() == 0.000000123);
}

TEST_CASE("flag 1 marks a power failure; events 2, 3, 5 and cycle slip records are stepped over and counted") {
  const auto sat = [](double v) { return "G07" + value_cell(v) + '\n'; };
  const std::string body = epoch_line("00", 1, 1) + sat(2e7) + ">                              5  0\n" + epoch_line("00", 2, 2) +
                           header_line("moving", "COMMENT") + header_line("x", "MARKER NAME") + epoch_line("01", 1) + sat(2.1e7) +
                           epoch_line("01", 1, 6) + sat(3.0) + ">                              3  1\n" +
                           header_line("SITE 2", "MARKER NAME") + epoch_line("02", 1) + sat(2.2e7);
  io::RinexObservationReader reader;
  REQUIRE(reader.open_text(file_3(kTypesG, body)));
  std::vector<gnss::ObservationEpoch> epochs;
  while (const auto epoch = reader.next()) epochs.push_back(*epoch);
  REQUIRE(epochs.size() == 3);
  CHECK(epochs[0].power_failure);
  CHECK_FALSE(epochs[1].power_failure);
  CHECK(epochs[2].satellites[0].signals[0].code_m == 2.2e7);
  CHECK(reader.header().marker_name == "SITE 2");
  const auto& flags = reader.summary().flags;
  CHECK(flags == std::array<long, 7>{2, 1, 1, 1, 0, 1, 1});
  CHECK(reader.summary().skipped.total() == 0);
}

TEST_CASE("header records spliced in by event flag 4 change the columns from there on") {
  const std::string before = epoch_line("00", 1) + "G07" + value_cell(2e7) + value_cell(1e8) + value_cell(40) + '\n';
  const std::string splice = ">                              4  2\n" + test::types_3('G', {"L1C", "C1C"}) + header_line("x", "COMMENT");
  const std::string after = epoch_line("01", 1) + "G07" + value_cell(1.1e8) + value_cell(2.1e7) + '\n';
  const auto modern = epochs_of(file_3(kTypesG, before + splice + after));
  REQUIRE(modern.size() == 2);
  CHECK(modern[0].satellites[0].signals[0].code_m == 2e7);
  CHECK(modern[1].satellites[0].signals[0].code_m == 2.1e7);
  CHECK(modern[1].satellites[0].signals[0].phase_cycles == 1.1e8);

  const std::string legacy = test::observation_header(2.11, test::types_2({"C1", "L1"})) + " 24  6 24  8 20  0.0000000  0  1G 7\n" +
                             value_cell(2e7) + value_cell(1e8) + '\n' + "                            4  1\n" + test::types_2({"L1", "C1"}) +
                             " 24  6 24  8 20  1.0000000  0  1G 7\n" + value_cell(1.1e8) + value_cell(2.1e7) + '\n';
  const auto old = epochs_of(legacy);
  REQUIRE(old.size() == 2);
  CHECK(old[1].satellites[0].signals[0].code_m == 2.1e7);
}

TEST_CASE("a whole header in mid-file, as concatenation leaves it, is read as one") {
  const std::string first = file_3(kTypesG, epoch_line("00", 1) + "G07" + value_cell(2e7) + '\n');
  const std::string second = file_3(test::types_3('E', {"C1C"}), epoch_line("01", 1) + "E07" + value_cell(2.1e7) + '\n');
  const auto parsed = io::read_rinex_observation_text(first + second);
  REQUIRE(parsed.value.epochs.size() == 2);
  CHECK(parsed.value.epochs[1].find({gnss::Constellation::galileo, 7}) != nullptr);
  CHECK(parsed.value.summary.spliced_headers == 1);
}

TEST_CASE("comments in mid-file, `>>` markers, shifted epoch lines and more than 99 satellites on the line are understood") {
  const std::string sat = "G07" + value_cell(2e7) + '\n';
  const std::string body = ">> 2024 06 24 08 20 00.0000000  0  1\n" + sat + header_line("a remark", "COMMENT") +
                           ">2024 6 24 8 20 1.0 0 1 0.001\n" + sat + "> 2024 06 24 08 20 02.0000000  0  1\n" + sat;
  CHECK(epochs_of(file_3(kTypesG, body)).size() == 3);
  std::string many = epoch_line("00", 101);
  for (int i = 0; i < 101; ++i)
    many +=
        test::satellite_text({static_cast<gnss::Constellation>(i % 2), static_cast<std::uint8_t>(i / 2 + 1)}) + value_cell(2e7 + i) + '\n';
  const auto parsed = io::read_rinex_observation_text(file_3(kTypesG + test::types_3('E', {"C1C"}), many));
  REQUIRE(parsed.value.epochs.size() == 1);
  CHECK(parsed.value.epochs[0].satellites.size() == gnss::kMaxSatellitesPerEpoch);
}

TEST_CASE("more signals and satellites than fit: the least informative go and are counted") {
  std::vector<std::string> types;
  for (const char attribute : {'C', 'S', 'L', 'X', 'P', 'W', 'Y', 'M', 'D', 'E'})
    types.insert(types.end(), {{'C', '2', attribute}, {'L', '2', attribute}});
  std::string line = "G07";
  for (int i = 0; i < 10; ++i) line += value_cell(2e7 + i) + value_cell(i == 1 || i == 4 ? gnss::kMissing : 1e8 + i);
  const auto parsed = io::read_rinex_observation_text(file_3(test::types_3('G', types), epoch_line("00", 1) + line + '\n'));
  REQUIRE(parsed.value.epochs.size() == 1);
  const auto& signals = parsed.value.epochs[0].satellites[0].signals;
  CHECK(signals.size() == gnss::kMaxSignalsPerSatellite);
  for (const auto& s : signals) CHECK(s.has_phase());
  CHECK(parsed.skipped.count("more signals than a satellite holds") == 2);

  std::string epoch = epoch_line("00", 70);
  for (int i = 0; i < 70; ++i) {
    const gnss::SatelliteId id{static_cast<gnss::Constellation>(i % 2), static_cast<std::uint8_t>(i / 2 + 1)};
    epoch += test::satellite_text(id) + value_cell(2e7) + (i % 10 == 0 ? "" : value_cell(1e8)) + '\n';
  }
  const auto crowded = io::read_rinex_observation_text(file_3(kTypesG + test::types_3('E', {"C1C", "L1C"}), epoch));
  REQUIRE(crowded.value.epochs.size() == 1);
  CHECK(crowded.skipped.count("more satellites than an epoch holds") == 6);
  long without_phase = 0;
  for (const auto& s : crowded.value.epochs[0].satellites) without_phase += s.signals[0].has_phase() ? 0 : 1;
  CHECK(without_phase == 1);
}

TEST_CASE("scale factors are taken out, of all types or of those named") {
  const std::string scale = header_line("G  100   1 L1C", "SYS / SCALE FACTOR");
  const auto named = epochs_of(file_3(kTypesG, epoch_line("00", 1) + "G07" + value_cell(2e7) + value_cell(1e8) + '\n', 3.04, scale));
  REQUIRE(named.size() == 1);
  CHECK(named[0].satellites[0].signals[0].code_m == 2e7);
  CHECK(named[0].satellites[0].signals[0].phase_cycles == 1e6);
  const auto all = epochs_of(file_3(kTypesG, epoch_line("00", 1) + "G07" + value_cell(2e7) + value_cell(1e8) + '\n', 3.04,
                                    header_line("G   10", "SYS / SCALE FACTOR")));
  REQUIRE(all.size() == 1);
  CHECK(all[0].satellites[0].signals[0].code_m == 2e6);
}
