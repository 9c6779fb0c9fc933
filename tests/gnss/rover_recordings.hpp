// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The shared recordings as one receiver sees them: its epochs, the ephemerides, the truth; and the statistics that single-point tests
/// assert.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/rinex_observation.hpp>

#include "support/shared_data.hpp"

namespace searvins::test {

/// Epochs, ephemerides and truth of one receiver.
struct RoverRecording {
  std::vector<gnss::ObservationEpoch> epochs;
  std::unique_ptr<gnss::EphemerisStore<1024>> store{std::make_unique<gnss::EphemerisStore<1024>>()};
  std::optional<Eigen::Vector3d> fixed_e_m;
  std::vector<std::pair<GpsTime, Eigen::Vector3d>> track;

  /// Position at a true GPS time, linear between rows at most 1.2 s apart.
  [[nodiscard]] std::optional<Eigen::Vector3d> truth(GpsTime t) const {
    if (fixed_e_m) return fixed_e_m;
    const auto after = std::lower_bound(track.begin(), track.end(), t, [](const auto& row, GpsTime at) { return row.first < at; });
    if (after != track.end() && after->first == t) return after->second;
    if (after == track.end() || after == track.begin()) return std::nullopt;
    const auto before = std::prev(after);
    const double step_s = seconds_between(before->first, after->first);
    if (step_s > 1.2) return std::nullopt;
    const double f = seconds_between(before->first, t) / step_s;
    return Eigen::Vector3d{before->second + f * (after->second - before->second)};
  }
};

/// Reads one observation file and navigation files.
inline RoverRecording read_rover(const std::filesystem::path& observations, std::initializer_list<std::filesystem::path> navigation) {
  RoverRecording r;
  r.epochs = io::read_rinex_observation(observations).value.epochs;
  for (const std::filesystem::path& path : navigation) {
    const auto file = io::read_rinex_navigation(path);
    for (const gnss::Ephemeris& e : file.value.ephemerides) r.store->insert(e);
    if (!r.store->ionosphere.present()) r.store->ionosphere = file.value.ionosphere;
  }
  return r;
}

/// Truth rows `week,sow,x,y,z,...`; with `week` given, `sow,x,y,z,...`. Other lines are left.
inline void read_reference(RoverRecording& r, const std::filesystem::path& path, std::optional<std::int64_t> week = std::nullopt) {
  std::ifstream file{path};
  for (std::string line; std::getline(file, line);) {
    double a = 0, b = 0, c = 0, d = 0, e = 0;
    if (week && std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &a, &b, &c, &d) == 4)
      r.track.emplace_back(GpsTime::from_week_sow(*week, a), Eigen::Vector3d{b, c, d});
    else if (!week && std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf", &a, &b, &c, &d, &e) == 5)
      r.track.emplace_back(GpsTime::from_week_sow(static_cast<std::int64_t>(a), b), Eigen::Vector3d{c, d, e});
  }
}

inline RoverRecording kamakura_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/kamakura_drive_2021";
  RoverRecording r = read_rover(d / "rover.obs", {d / "nav.rnx"});
  read_reference(r, d / "reference.csv");
  return r;
}

inline RoverRecording nagoya_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/nagoya_static_2024";
  RoverRecording r = read_rover(d / "rover.obs", {d / "base.nav"});
  r.fixed_e_m = Eigen::Vector3d{-3817681.3807, 3562839.9785, 3650158.3760};
  return r;
}

inline RoverRecording geonet_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/geonet_static_2005";
  RoverRecording r = read_rover(d / "07590920.05o", {d / "07590920.05n"});
  r.fixed_e_m = Eigen::Vector3d{-3976219.1878, 3382371.6057, 3652511.1424};
  return r;
}

inline RoverRecording sf_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/sf_static_2017";
  RoverRecording r = read_rover(d / "rover.obs", {d / "rover.nav"});
  r.fixed_e_m = Eigen::Vector3d{-2706111.3408, -4261210.5240, 3885594.5989};
  return r;
}

inline RoverRecording spirent_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/spirent_rose_iono-Klob";
  RoverRecording r = read_rover(d / "rover.obs", {d / "nav_gps.rnx", d / "nav_gal.rnx"});
  read_reference(r, d / "reference.csv");
  return r;
}

inline RoverRecording boulder_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/boulder_walk_2025";
  RoverRecording r = read_rover(d / "rover.obs", {d / "rover.nav"});
  read_reference(r, d / "reference.csv");
  return r;
}

inline RoverRecording tokyo_rover(const std::filesystem::path& shared) {
  const auto d = shared / "data/real/tokyo_urban_2023";
  RoverRecording r = read_rover(d / "rover.obs", {d / "rover.nav"});
  read_reference(r, d / "reference.csv");
  return r;
}

inline RoverRecording twin_rover(const std::filesystem::path& shared, const std::string& name) {
  const auto d = shared / "data/twin" / name;
  RoverRecording r = read_rover(d / "rover.obs", {d / "base.nav"});
  read_reference(r, d / "truth.csv", 2323);
  return r;
}

/// Errors in the local east-north-up axes of the truth.
struct Errors {
  std::vector<Eigen::Vector3d> enu_m;

  void add(const Eigen::Vector3d& estimate_e_m, const Eigen::Vector3d& truth_e_m) {
    enu_m.push_back(geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(truth_e_m)).transpose() * (estimate_e_m - truth_e_m));
  }
  [[nodiscard]] Eigen::Vector3d mean_m() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& e : enu_m) sum += e;
    return sum / static_cast<double>(std::max<std::size_t>(enu_m.size(), 1));
  }
  /// Root mean square of the horizontal error, of the vertical one.
  [[nodiscard]] double horizontal_rms_m() const {
    double sum = 0;
    for (const auto& e : enu_m) sum += e.head<2>().squaredNorm();
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(enu_m.size(), 1)));
  }
  [[nodiscard]] double vertical_rms_m() const {
    double sum = 0;
    for (const auto& e : enu_m) sum += e.z() * e.z();
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(enu_m.size(), 1)));
  }
  /// Horizontal error that a share `p` of the epochs stays below.
  [[nodiscard]] double horizontal_quantile_m(double p) const {
    std::vector<double> h;
    for (const auto& e : enu_m) h.push_back(e.head<2>().norm());
    std::sort(h.begin(), h.end());
    return h.empty() ? 0 : h[std::min(h.size() - 1, static_cast<std::size_t>(p * static_cast<double>(h.size())))];
  }
  /// These errors less their mean: the scatter about a constant offset of the reference frame.
  [[nodiscard]] Errors centred() const {
    Errors c = *this;
    const Eigen::Vector3d m = mean_m();
    for (auto& e : c.enu_m) e -= m;
    return c;
  }
};

}  // namespace searvins::test
