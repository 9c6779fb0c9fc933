// SPDX-License-Identifier: BSD-3-Clause
// `searvins simulate`: a drive with GNSS, IMU and stereo tracks that nobody recorded, and the truth about it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/io/rinex_navigation.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/searvins/commands.hpp"
#include "examples/simulator/dataset.hpp"
#include "examples/simulator/image_set.hpp"
#include "examples/support/option_parser.hpp"
#include "examples/support/progress.hpp"
#include "examples/support/table.hpp"
#include "examples/support/truth.hpp"

namespace searvins::examples {
namespace {

namespace sim = searvins::simulator;

/// A broadcast record as the simulator flies it: without the quadratic term of the clock, which is referred to toe.
sim::Orbit orbit_from(const gnss::Ephemeris& e, GpsTime start) {
  sim::Orbit o;
  o.system = gnss::letter_of(e.satellite.constellation), o.number = e.satellite.number;
  o.toe = e.toe, o.toe_since_start_s = seconds_between(start, e.toe);
  o.toe_of_week_s = GpsTime{e.toe.ns - (o.system == 'C' ? kBeidouLagSeconds * kNanosecondsPerSecond : 0)}.sow();
  o.sqrt_a = e.sqrt_a, o.eccentricity = e.eccentricity, o.i0 = e.i0, o.omega0 = e.omega0, o.omega = e.omega, o.m0 = e.m0;
  o.delta_n = e.delta_n, o.i_dot = e.i_dot, o.omega_dot = e.omega_dot;
  o.cuc = e.cuc, o.cus = e.cus, o.crc = e.crc, o.crs = e.crs, o.cic = e.cic, o.cis = e.cis;
  o.af0 = sim::as_written(e.af0 + e.af1 * seconds_between(e.toc, e.toe)), o.af1 = e.af1;
  const bool galileo = o.system == 'E';
  o.delay_s = galileo ? e.group_delay_s[1] : e.group_delay_s[0], o.other_delay_s = galileo ? e.group_delay_s[0] : e.group_delay_s[1];
  return o;
}

/// Whether the simulator can fly the record: healthy GPS, Galileo I/NAV and BeiDou that is not geostationary.
bool flies(const gnss::Ephemeris& e) {
  using enum gnss::NavigationMessage;
  return e.health == 0 && e.eccentricity < 0.05 && (e.message == gps_lnav || e.message == galileo_inav || e.message == beidou_d1);
}

/// The records of a file that the simulator can fly, in order of time.
io::FileResult<std::vector<gnss::Ephemeris>> read_records(const std::string& path) {
  const auto file = io::read_rinex_navigation(path);
  if (!file.ok()) return *file.error;
  std::vector<gnss::Ephemeris> records;
  for (const gnss::Ephemeris& e : file.value.ephemerides)
    if (flies(e)) records.push_back(e);
  if (records.empty()) return io::Diagnostic{path, 0, "no healthy record of GPS, Galileo I/NAV or BeiDou", "give a mixed navigation file"};
  std::stable_sort(records.begin(), records.end(), [](const auto& a, const auto& b) { return a.toe < b.toe; });
  return records;
}

/// Of each satellite the record nearest to the middle of the drive, at most two hours from it.
std::vector<sim::Orbit> orbits_of(const std::vector<gnss::Ephemeris>& records, const sim::SimulationOptions& options) {
  const GpsTime middle = options.start.plus_seconds(options.duration_s / 2);
  const auto age = [middle](const gnss::Ephemeris& e) { return std::abs(seconds_between(middle, e.toe)); };
  std::map<std::pair<char, int>, const gnss::Ephemeris*> nearest;
  for (const gnss::Ephemeris& e : records) {
    if (age(e) > 7200) continue;
    const auto [at, fresh] = nearest.try_emplace({gnss::letter_of(e.satellite.constellation), e.satellite.number}, &e);
    if (!fresh && age(e) < age(*at->second)) at->second = &e;
  }
  std::vector<sim::Orbit> orbits;
  for (const auto& [id, e] : nearest) orbits.push_back(orbit_from(*e, options.start));
  return orbits;
}

/// A given truth becomes the route: its first position the origin, its first time the start, its length the duration unless a shorter
/// one is given. A truth without a week is of the week of `options.start`. The message of the result is empty when all is well.
io::Diagnostic take_route(const std::string& path, bool has_duration, sim::SimulationOptions& options) {
  const auto truth = read_truth(path, options.start);
  if (!truth) return truth.error();
  const auto wrong = [&path](const char* what) { return io::Diagnostic{path, 0, what, "give another truth file"}; };
  if (truth->is_static || truth->points.size() < 3) return wrong("a route needs at least three positions");
  const TruthPoint& first = truth->points.front();
  options.start = GpsTime{first.time.ns / kNanosecondsPerSecond * kNanosecondsPerSecond};
  options.origin_e_m = first.p_e_m;
  const geodesy::LocalFrame frame = geodesy::LocalFrame::at(first.p_e_m);
  double farthest_m = 0;
  for (const TruthPoint& p : truth->points) {
    options.route.push_back({seconds_between(options.start, p.time), frame.to_local(p.p_e_m)});
    farthest_m = std::max(farthest_m, options.route.back().p_w_m.norm());
  }
  if (farthest_m > 30'000) return wrong("the route leads more than 30 km away from its start");
  const double length_s = std::floor(options.route.back().t_s);
  options.duration_s = has_duration ? std::min(options.duration_s, length_s) : length_s;
  if (options.duration_s < 10) return wrong("the route is shorter than ten seconds");
  return {};
}

/// The size of the pictures, "640x240"; nothing (and a usage error) for what is none.
std::optional<sim::RenderOptions> image_size(Options& options) {
  const std::string given = options.text("images");
  const std::size_t cross = given.find('x');
  std::int64_t width = 0, height = 0;
  const bool numbers = cross != std::string::npos && io::parse_integer(std::string_view{given}.substr(0, cross), width) &&
                       io::parse_integer(std::string_view{given}.substr(cross + 1), height);
  if (!numbers || width < 64 || height < 32 || width > 4096 || height > 4096) {
    options.fail("--images: '" + given + "' is no size such as 640x240 (64x32 to 4096x4096)");
    return std::nullopt;
  }
  sim::RenderOptions size;
  size.width_px = static_cast<int>(width), size.height_px = static_cast<int>(height);
  return size;
}

/// Renders the drive into the folder, beside the other files; the message of the result is empty when all is well.
io::Diagnostic write_pictures(const sim::Simulation& simulation, sim::Layout layout, const sim::RenderOptions& size,
                              const std::filesystem::path& folder) {
  Progress progress("render", 100);
  const io::Diagnostic wrong =
      sim::write_images(simulation, size, folder, [&progress](double share) { progress.update(static_cast<std::size_t>(100 * share)); },
                        layout == sim::Layout::texcup ? sim::StampScale::unix_utc : sim::StampScale::gps);
  progress.finish();
  if (!wrong.message.empty()) return wrong;
  const sim::StereoRig rig = sim::scaled_rig(sim::StereoRig{}, size.width_px, size.height_px);
  const std::string path = (folder / "rig_images.json").string();
  if (const std::string failed = io::write_text_file(path, sim::rig_text(simulation, layout, rig)); !failed.empty())
    return {path, 0, failed, "choose another folder with --out"};
  std::printf("Pictures: %d pairs of %d x %d in cam0 and cam1, classes of the left ones in labels0; their camera is in rig_images.json.\n",
              sim::image_count(simulation.options()), size.width_px, size.height_px);
  return {};
}

void print_summary(const sim::Simulation& simulation, const sim::Dataset& set, const std::string& folder) {
  Table table(
      {"District", "Time s", "Satellites", "Clear", "Diffracted", "Reflected", "Blocked", "Tracked", "Bad signals %", "Locks", "Slips"});
  for (std::size_t d = 0; d < set.districts.size(); ++d) {
    const sim::DistrictSummary& s = set.districts[d];
    if (s.epochs == 0) continue;
    const auto mean = [&s](int n) { return cell(static_cast<double>(n) / s.epochs, 1); };
    int all = 0;
    for (const int n : s.satellites) all += n;
    table.row({sim::kDistrictNames[d], cell(s.length_s, 0), mean(all), mean(s.satellites[0]), mean(s.satellites[1]), mean(s.satellites[2]),
               mean(s.satellites[3]), mean(s.tracked), cell(s.signals > 0 ? 100.0 * s.bad_signals / s.signals : 0, 1),
               std::to_string(s.locks), std::to_string(s.slips)});
  }
  const sim::SimulationOptions& o = simulation.options();
  std::printf("Simulated: profile %s, seed %llu, %.0f s, %.2f km, %d buildings, %zu bridges, %zu trees; GPS week %ld, %.0f to %.0f s.\n",
              o.profile.c_str(), static_cast<unsigned long long>(o.seed), o.duration_s, set.distance_m / 1000, simulation.city().buildings,
              simulation.city().bridges.size(), simulation.city().trees.size(), static_cast<long>(o.start.week()), o.start.sow(),
              o.start.sow() + o.duration_s);
  std::printf(
      "Mean satellites above 10 degrees by what their first signal is; signals that are diffracted or reflected as a share of the "
      "tracked.\n\n%s\nFiles in %s:",
      table.text().c_str(), folder.c_str());
  for (const sim::DatasetFile& file : set.files) std::printf(" %s", file.name.c_str());
  std::printf("\n");
}

}  // namespace

int run_simulate(int argc, const char* const* argv) {
  OptionParser parser{"searvins simulate", "makes a drive with GNSS, IMU and stereo tracks, and the truth about it"};
  parser.value("out", "DIR", "folder for the files").required();
  parser.value("profile", "NAME", "neighbourhood").one_of({"open", "light", "urban", "texcup"}).fallback("texcup");
  parser.value("duration", "S", "length of the drive, seconds (default 600; with --route that of the route)");
  parser.value("seed", "N", "another seed is another drive").fallback("1");
  parser.value("route", "FILE", "truth file whose positions the vehicle follows; else streets are made up");
  parser.value("nav", "FILE", "RINEX navigation file with the satellites; else constellations are made up");
  parser.value("layout", "NAME", "names and forms of the files").one_of({"plain", "texcup", "ppc", "urbannav"}).fallback("plain");
  parser.value("rover-rate", "HZ", "rate of the rover's receiver").one_of({"1", "2", "5", "10"}).fallback("1");
  parser.value("imu-sample", "KIND", "what an IMU row stands for").one_of({"instantaneous", "mean_to_stamp"}).fallback("instantaneous");
  parser.value("images", "WxH", "also render pictures of this size, EuRoC layout, for example 640x240 (about 15 a second)");
  parser.value("camera-offset-ms", "MS", "frames are exposed so many milliseconds later than stamped").fallback("0");
  parser.value("camera-boresight-deg", "X,Y,Z", "the camera is turned against rig.json, degrees about its axes right, down, forward");
  parser.epilogue("Nothing in the files was recorded. labels.csv holds the truth about every signal; do not use it to solve.");
  Options options = parser.parse(argc, argv);
  sim::SimulationOptions wanted;
  if (options.given("duration")) wanted.duration_s = options.number("duration", 10, 21600);
  const double seed = options.number("seed", 0, 1e9), rate = options.number("rover-rate", 1, 10);
  const double offset_ms = options.number("camera-offset-ms", -100, 100);
  const std::vector<double> boresight_deg = options.numbers("camera-boresight-deg", 3);
  const auto images = options.given("images") ? image_size(options) : std::nullopt;
  if (const auto code = options.finished()) return *code;

  wanted.profile = options.text("profile"), wanted.seed = static_cast<std::uint64_t>(seed), wanted.rover_rate_hz = rate;
  wanted.imu_sampling = options.text("imu-sample") == "mean_to_stamp" ? sim::ImuSampling::mean_to_stamp : sim::ImuSampling::instantaneous;
  wanted.camera_offset_s = offset_ms / 1000;
  for (std::size_t i = 0; i < boresight_deg.size(); ++i)
    wanted.camera_boresight_rad[static_cast<Eigen::Index>(i)] = boresight_deg[i] * std::numbers::pi / 180;
  std::vector<gnss::Ephemeris> records;
  if (options.given("nav")) {
    auto read = read_records(options.text("nav"));
    if (!read) return unusable_input("simulate", read.error());
    records = std::move(*read);
    wanted.start = GpsTime{records[records.size() / 2].toe.ns / kNanosecondsPerSecond * kNanosecondsPerSecond};
  }
  if (options.given("route"))
    if (const io::Diagnostic wrong = take_route(options.text("route"), options.given("duration"), wanted); !wrong.message.empty())
      return unusable_input("simulate", wrong);
  if (options.given("nav")) {
    wanted.orbits = orbits_of(records, wanted);
    if (wanted.orbits.size() < 8)
      return unusable_input(
          "simulate", {options.text("nav"), 0, "fewer than eight satellites have a record within two hours of the drive", "give the day's file"});
  }

  const std::filesystem::path folder{options.text("out")};
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return unusable_input("simulate", {folder.string(), 0, "could not be made: " + failed.message(), "choose another folder with --out"});
  Progress progress("simulate", 100);
  const sim::Simulation simulation(wanted);
  const std::string form = options.text("layout");
  const sim::Layout layout = form == "texcup"     ? sim::Layout::texcup
                             : form == "ppc"      ? sim::Layout::ppc
                             : form == "urbannav" ? sim::Layout::urbannav
                                                  : sim::Layout::plain;
  const sim::Dataset set = sim::make_dataset(
      simulation, layout, [&progress](double share) { progress.update(static_cast<std::size_t>(std::max(0.0, 100 * share))); });
  for (const sim::DatasetFile& file : set.files)
    if (const std::string wrong = io::write_text_file((folder / file.name).string(), file.text); !wrong.empty())
      return unusable_input("simulate", {(folder / file.name).string(), 0, wrong, "choose another folder with --out"});
  progress.finish();
  print_summary(simulation, set, folder.string());
  if (images)
    if (const io::Diagnostic wrong = write_pictures(simulation, layout, *images, folder); !wrong.message.empty()) return unusable_input("simulate", wrong);
  return kExitDone;
}

}  // namespace searvins::examples
