// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// searvins_cortex_m_bake RECORDING OUT: writes OUT/baked_drive.hpp, a few epochs of the recording (rover.obs, base.obs, nav.rnx,
/// truth.csv), and
/// OUT/baked_ambiguities.hpp, integer least-squares problems with their answers. A program of the desktop; the images contain its output.
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <searvins/ambiguity/lambda.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>

#include "examples/support/truth.hpp"
#include "tests/support/ambiguity_problems.hpp"

namespace {

using namespace searvins;

constexpr int kFirstEpoch = 52, kEpochs = 16;  // of the bundled recording: eight seconds under open sky, eight between walls
constexpr int kSizes[] = {6, 8, 10, 12, 16, 20, 24};
constexpr unsigned kSeed = 20260214;
constexpr double kRoverClockS = 3e-4;

std::string number(double value) {
  if (std::isnan(value)) return "gnss::kMissing";
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};  // the shortest that reads back as the same bits
}
std::string number(std::int64_t value) { return std::to_string(value); }
std::string word(bool value) { return value ? "true" : "false"; }

/// Lines of at most 140 columns with the indent of five, broken behind a comma.
std::string wrapped(const std::string& text) {
  std::string out;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = text.find('\n', begin);
    if (end - begin > 135 && text.compare(begin, 3, "///") != 0) end = text.rfind(", ", begin + 133) + 1;
    out += text.substr(begin, end - begin) + "\n";
    begin = end + 1;
    if (text[end] != '\n') out += "     ";
  }
  return out;
}

std::string head(const char* what) {
  return std::string{"// SPDX-License-Identifier: BSD-3-Clause\n/// \\file\n/// "} + what +
         "\n/// Written by bake.cpp: do not edit.\n#pragma once\n\n";
}

std::string ephemeris_text(const gnss::Ephemeris& e) {
  std::string t = "    {.satellite = {gnss::Constellation::" +
                  std::string{std::array{"gps", "galileo", "beidou", "qzss"}[std::size_t(e.satellite.constellation)]} + ", " +
                  std::to_string(e.satellite.number) + "}, .message = gnss::NavigationMessage::" +
                  std::array{"gps_lnav", "qzss_lnav", "galileo_inav", "galileo_fnav", "beidou_d1", "beidou_d2"}[std::size_t(e.message)];
  const auto time = [&t](const char* name, GpsTime v) { t += std::string{", ."} + name + " = {" + number(v.ns) + "}"; };
  const auto real = [&t](const char* name, double v) { t += std::string{", ."} + name + " = " + number(v); };
  time("toe", e.toe), time("toc", e.toc), time("transmitted", e.transmitted);
  t += ", .issue = " + std::to_string(e.issue);
  real("accuracy_m", e.accuracy_m), real("sqrt_a", e.sqrt_a), real("eccentricity", e.eccentricity), real("i0", e.i0),
      real("omega0", e.omega0);
  real("omega", e.omega), real("m0", e.m0), real("delta_n", e.delta_n), real("i_dot", e.i_dot), real("omega_dot", e.omega_dot);
  real("cuc", e.cuc), real("cus", e.cus), real("crc", e.crc), real("crs", e.crs), real("cic", e.cic), real("cis", e.cis);
  real("af0", e.af0), real("af1", e.af1), real("af2", e.af2);
  return t + ", .group_delay_s = {" + number(e.group_delay_s[0]) + ", " + number(e.group_delay_s[1]) + "}},\n";
}

/// Rows of the epochs first ... first + count - 1 as table `name`, with their list.
std::string epochs_text(const std::string& name, const std::vector<gnss::ObservationEpoch>& epochs) {
  std::string rows, list;
  int row = 0;
  for (const gnss::ObservationEpoch& epoch : epochs) {
    const int first = row;
    for (const auto& satellite : epoch.satellites)
      for (const auto& s : satellite.signals) {
        rows += std::string{"    {'"} + gnss::letter_of(s.signal.constellation) + "', " + std::to_string(satellite.satellite.number) +
                ", '" + s.signal.band + "', '" + s.signal.attribute + "', " + word(s.loss_of_lock) + ", " + word(s.half_cycle) +
                ", static_cast<float>(" + number(s.cn0_dbhz) + "), " + number(s.code_m) + ", " + number(s.phase_cycles) + ", " +
                number(s.doppler_hz) + "},\n";
        ++row;
      }
    list += "    {" + number(epoch.tag.ns) + ", " + std::to_string(first) + ", " + std::to_string(row - first) + "},\n";
  }
  return "inline constexpr BakedSignal k" + name + "Signals[] = {\n" + rows + "};\ninline constexpr BakedEpoch k" + name +
         "Epochs[] = {\n" + list + "};\n\n";
}

std::string position_text(const char* name, const Eigen::Vector3d& p) {
  return std::string{"inline constexpr double "} + name + "[3] = {" + number(p.x()) + ", " + number(p.y()) + ", " + number(p.z()) + "};\n";
}

std::string fail(const std::string& what) {
  std::fprintf(stderr, "error: %s\n", what.c_str());
  return {};
}

std::string drive_text(const std::filesystem::path& folder) {
  const auto rover = io::read_rinex_observation(folder / "rover.obs"), base = io::read_rinex_observation(folder / "base.obs");
  const auto records = io::read_rinex_navigation(folder / "nav.rnx");
  const auto truth = examples::read_truth((folder / "truth.csv").string());
  if (rover.error || base.error || records.error || !truth)
    return fail("cannot read rover.obs, base.obs, nav.rnx and truth.csv in " + folder.string());
  if (rover.value.epochs.size() < kFirstEpoch + kEpochs) return fail("the recording is too short");
  const auto first = rover.value.epochs.begin() + kFirstEpoch;
  const std::vector<gnss::ObservationEpoch> chosen(first, first + kEpochs);
  std::vector<gnss::ObservationEpoch> reference;
  for (const auto& epoch : base.value.epochs)
    if (std::abs(seconds_between(epoch.tag, chosen.front().tag)) < kEpochs && epoch.tag >= chosen.front().tag &&
        epoch.tag <= chosen.back().tag)
      reference.push_back(epoch);

  std::string text =
      head("A few epochs of a simulated drive: broadcast records, observations of base and rover, and where the rover's antenna was.");
  text +=
      "#include <searvins/gnss/ephemeris.hpp>\n#include <searvins/gnss/observation.hpp>\n\n#include \"examples/cortex_m/baked.hpp\"\n\n";
  text += "namespace searvins::cortex_m {\n\ninline constexpr gnss::Ephemeris kEphemerides[] = {\n";
  for (const auto& e : records.value.ephemerides) text += ephemeris_text(e);
  const gnss::KlobucharCoefficients& k = records.value.ionosphere;
  text += "};\ninline constexpr gnss::KlobucharCoefficients kIonosphere = {";
  for (const auto* part : {k.alpha, k.beta}) {
    text += part == k.beta ? "}, {" : "{";
    for (int i = 0; i < 4; ++i) text += (i > 0 ? ", " : "") + number(part[i]);
  }
  const auto& place = base.value.header.approx_position_e_m;
  text += "}};\n" + position_text("kBasePosition", Eigen::Vector3d{place->x(), place->y(), place->z()}) + "\n";
  text += epochs_text("Rover", chosen) + epochs_text("Base", reference);
  text += "/// Of the rover's antenna, ECEF, metres, epoch by epoch.\ninline constexpr double kTruth[][3] = {\n";
  for (const auto& epoch : chosen) {
    const auto p = examples::truth_at(*truth, epoch.tag.plus_seconds(-kRoverClockS));
    if (!p) return fail("the truth does not cover the epochs");
    text += "    {" + number(p->x()) + ", " + number(p->y()) + ", " + number(p->z()) + "},\n";
  }
  return text + "};\n\n}  // namespace searvins::cortex_m\n";
}

std::string ambiguities_text() {
  std::mt19937_64 rng{kSeed};
  std::string values, covariances, answers, list;
  int value = 0, covariance = 0;
  for (const int n : kSizes) {
    const test::AmbiguityProblem p = test::double_difference_problem(rng, n, n < 10 ? 1 : 2);
    const auto found = ambiguity::integer_least_squares<double, 24>(p.Q.data(), n, p.a_hat.data(), n);
    if (!found.ok()) return fail("a problem was not solved");
    list += "    {" + std::to_string(n) + ", " + std::to_string(value) + ", " + std::to_string(covariance) + "},\n";
    for (int i = 0; i < n; ++i) {
      values += (i == 0 ? "    " : " ") + number(p.a_hat[std::size_t(i)]) + ",",
          answers += (i == 0 ? "    " : " ") + number(found->integers[0][std::size_t(i)]) + ",";
      covariances += "   ";
      for (int j = 0; j <= i; ++j) covariances += " " + number(p.Q(i, j)) + ",";
      covariances += "\n";
    }
    values += "\n", answers += "\n", value += n, covariance += n * (n + 1) / 2;
  }
  return head("Double-difference ambiguities of one and two epochs, and the integer vectors nearest to them.") +
         "#include <cstdint>\n\n#include \"examples/cortex_m/baked.hpp\"\n\nnamespace searvins::cortex_m {\n\ninline constexpr "
         "BakedAmbiguities kProblems[] = {\n" +
         list + "};\ninline constexpr double kFloats[] = {\n" + values + "};\ninline constexpr double kCovariances[] = {\n" + covariances +
         "};\ninline constexpr std::int64_t kIntegers[] = {\n" + answers + "};\n\n}  // namespace searvins::cortex_m\n";
}

bool write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << wrapped(text);
  file.close();
  return !text.empty() && file;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: searvins_cortex_m_bake RECORDING OUT\n");
    return 2;
  }
  const std::filesystem::path out = argv[2];
  return write_file(out / "baked_drive.hpp", drive_text(argv[1])) && write_file(out / "baked_ambiguities.hpp", ambiguities_text()) ? 0 : 1;
}
