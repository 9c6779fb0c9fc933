// SPDX-License-Identifier: BSD-3-Clause
// `searvins solve`: recordings in, trajectory and report out.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "examples/searvins/commands.hpp"
#include "examples/searvins/dataset_request.hpp"
#include "examples/searvins/solve_job.hpp"
#include "examples/support/option_parser.hpp"

namespace searvins::examples {
namespace {

OptionParser solve_parser() {
  OptionParser parser{"searvins solve", "positions of a GNSS antenna, alone or with an inertial unit, from recordings"};
  parser.value("rover", "FILE", "RINEX observation file of the moving receiver");
  parser.value("base", "FILE", "RINEX observation file of the base station; without it single points, or with --imu codes and Doppler shifts of the rover alone");
  parser.value("nav", "FILE", "RINEX navigation file").repeated();
  parser.value("out", "DIR", "folder for the results, made when it is missing").required();
  parser.value("rig", "FILE", "rig.json: signals, sigmas, base position, inertial unit, lever arm");
  parser.value("imu", "FILE", "log of the inertial unit that --rig describes: tightly coupled, with or without a base, a solution through outages");
  parser.value("positions", "FILE", "another program's positions (.pos, or week,sow,x,y,z[,sd..]) instead of --rover, --base and --nav: loosely coupled");
  parser.value("tracks", "FILE", "stereo tracks of a frontend, pixels of the rectified pair that --rig describes; with --imu");
  parser.value("images", "DIR", "stereo pictures in the EuRoC layout (cam0, cam1, labels0) instead of --tracks: the reference frontend finds and follows points");
  parser.value("without", "LIST",
               "parts to switch off: semantic, geometric, motion, maturity of the screening of tracks; stereo, right pixels as measurements; robust, the "
               "weights of GNSS");
  parser.value("with", "LIST",
               "policies that are off by default: wheels (no sliding, with --imu), cn0 (codes of weak signals count less), code-gate (codes 5 sigmas off the "
               "prediction are left out), batch-size (batch weights by the mean square of a batch), predicted-motion (phases of few satellites "
               "verified by the inertial unit, with --imu)");
  parser.flag("calibrate-camera", "also estimate the time offset and the boresight of the camera (docs/vision.md); --robust symmetric");
  parser.value("map", "FILE", "centre lines of lanes (line,lat_deg,lon_deg,height_m), which hold the vehicle where no integers do; with --imu");
  parser.value("heading", "DEG[,SIGMA]", "heading at the start, clockwise from north, and its sigma; else found from the motion");
  parser.value("base-ecef", "X,Y,Z", "antenna of the base, ECEF metres; else the rig's, else that of the base file's header");
  parser.value("robust", "FORM", "robust formulation").fallback(kDefaultFormulation).one_of({"batch", "scalar", "latent", "symmetric"});
  parser.value("ambiguity", "MODE", "integer resolution").fallback("partial").one_of({"full", "partial", "float"});
  parser.value("continuity", "MODE", "how ambiguities go on between epochs")
      .fallback("hybrid")
      .one_of({"hybrid", "constant", "instantaneous"});
  parser.value("arc", "H", "epochs that share an ambiguity state (hybrid)").fallback("3");
  parser.value("lag", "S", "length of the window, seconds").fallback("6");
  parser.value("handover", "MODE", "ambiguities at a change of pivot").fallback("exact").one_of({"exact", "restart"});
  parser.value("signals", "LIST", "rover signals to use, as G1C,G2W,E1C; else the rig's, else the best of every common carrier");
  parser.value("sigma-profile", "NAME", "measurement sigmas where the rig names none")
      .fallback(kDefaultSigmaProfile)
      .one_of({"general", "urban", "geodetic"});
  parser.value("mask", "DEG", "elevation mask; else the rig's, else 15");
  parser.value("min-cn0", "DBHZ", "least C/N0; else the rig's, else 20");
  parser.value("start", "SOW", "first second of week to solve");
  parser.value("end", "SOW", "last second of week to solve");
  parser.value("truth", "FILE", "reference trajectory: errors are computed and shown");
  parser.value("truth-ecef", "X,Y,Z", "reference point of an antenna that does not move, ECEF metres");
  parser.value("rate", "WHAT", "rows to write: gnss (one a rover epoch), camera (also one a frame) or imu (also one a reading)").fallback("gnss");
  parser
      .value("dataset", "LAYOUT",
             "a published recording, all in one FOLDER: texcup, ppc, urbannav (docs/datasets.md); or euroc, stereo-inertial without GNSS: "
             "`searvins "
             "solve --dataset euroc --help` lists what goes with it")
      .one_of({"texcup", "ppc", "urbannav", "euroc"});
  parser.value("sensors", "WHAT", "sensors of the --dataset: gnss; imu, with GNSS; all, what there is")
      .fallback("all")
      .one_of({"gnss", "imu", "all"});
  parser.positionals("FOLDER", "recording of --dataset", 0, 1);
  parser.epilogue(
      "Written: trajectory.csv, trajectory_lagged.csv, solution.pos (RTKPLOT), trajectory.kml, trajectory_tum.txt (evo), summary.json, "
      "report.html.\nExit codes: 0 done, 2 usage, 3 unusable input, 4 the run ended without a solution.");
  return parser;
}

std::optional<Eigen::Vector3d> point(Options& options, const char* name) {
  const std::vector<double> p = options.numbers(name, 3);
  return p.empty() ? std::optional<Eigen::Vector3d>{} : Eigen::Vector3d{p[0], p[1], p[2]};
}

void take_signals(Options& options, SolveRequest& request) {
  for (const std::string& text : options.list("signals")) {
    gnss::SignalCode code;
    if (gnss::signal_from_text(text.data(), text.size(), code))
      request.signals.push_back(code);
    else
      options.fail("--signals: '" + text + "' is no signal (constellation G, E, C or J, band, tracking code, as in G2W)");
  }
}

void check_rate(Options& options) {
  const std::string rate = options.text("rate");
  if (rate == "camera" && !options.given("tracks") && !options.given("images") && !options.given("dataset")) options.fail("--rate camera needs --tracks FILE or --images DIR");
  if (rate != "gnss" && rate != "camera" && rate != "imu") options.fail("--rate: '" + rate + "' is none of gnss, camera, imu");
}

/// What is switched off and on.
void take_policies(Options& options, SolveRequest& request, bool is_dataset) {
  const auto is_one_of = [](const auto& known, const std::string& name) { return std::find(known.begin(), known.end(), name) != known.end(); };
  request.without = options.list("without"), request.with = options.list("with");
  for (const std::string& part : request.without) {
    if (part == kRobustPart) continue;
    if (!is_one_of(kScreeningParts, part)) options.fail("--without: '" + part + "' is none of " + joined(kScreeningParts) + ", " + kRobustPart);
    if (!request.has_camera() && !is_dataset) options.fail("--without " + part + " needs --tracks FILE or --images DIR");
  }
  for (const std::string& policy : request.with)
    if (!is_one_of(kPolicies, policy)) options.fail("--with: '" + policy + "' is none of " + joined(kPolicies));
  for (const char* policy : {"wheels", "predicted-motion"})
    if (request.is_with(policy) && request.imu.empty() && !is_dataset) options.fail(std::string{"--with "} + policy + " needs --imu FILE");
  if (request.is_with("batch-size") && options.text("robust") != "batch") options.fail("--with batch-size needs --robust batch");
}

/// Options of the inertial unit, and what each of them needs.
void take_imu(Options& options, SolveRequest& request) {
  request.imu = options.text("imu");
  const bool is_dataset = options.given("dataset");  // what is not named is in its folder
  request.at_imu_rate = options.text("rate") == "imu", request.at_camera_rate = options.text("rate") == "camera";
  request.tracks = options.text("tracks"), request.images = options.text("images");
  take_policies(options, request, is_dataset);
  if (!request.tracks.empty() && !request.images.empty()) options.fail("give either --tracks FILE or --images DIR");
  request.calibrate_camera = options.flag("calibrate-camera");
  if (request.calibrate_camera && !request.has_camera() && !is_dataset) options.fail("--calibrate-camera needs --tracks FILE or --images DIR");
  if (request.calibrate_camera && options.text("robust") != kCalibratingFormulation)
    options.fail(std::string{"--calibrate-camera needs --robust "} + kCalibratingFormulation);
  request.map = options.text("map");
  if (!request.map.empty() && request.imu.empty() && !is_dataset) options.fail("--map needs --imu FILE");
  if (options.given("heading")) {
    const std::vector<double> heading = options.numbers("heading", options.list("heading").size() == 2 ? 2 : 1);
    if (!heading.empty()) request.heading_deg = heading[0];
    if (heading.size() == 2) request.heading_sigma_deg = heading[1];
    if (!(request.heading_sigma_deg > 0 && request.heading_sigma_deg <= 90))
      options.fail("--heading: the sigma must lie in 0 .. 90 degrees");
  }
  if (is_dataset) return;
  if (request.imu.empty()) {
    for (const char* name : {"heading", "rate", "tracks", "images"})
      if (options.given(name) && options.text(name) != "gnss")
        options.fail(std::string{"--"} + name + ' ' + options.text(name) + " needs --imu FILE");
    return;
  }
  if (request.rig.empty()) options.fail("--imu needs --rig FILE: the axes and noise of the unit, and where the antenna is");
}

/// Where the measurements come from: a rover with its ephemerides, or positions of another program.
void take_sources(Options& options, SolveRequest& request) {
  request.rover = options.text("rover"), request.base = options.text("base"), request.nav = options.texts("nav");
  request.positions = options.text("positions");
  if (options.given("dataset")) return;
  if (request.positions.empty()) {
    if (request.rover.empty()) options.fail("--rover FILE is missing (or --positions FILE with --imu)");
    if (request.nav.empty()) options.fail("--nav FILE is missing");
    return;
  }
  for (const char* name : {"rover", "base", "nav", "base-ecef", "signals"})
    if (options.given(name)) options.fail(std::string{"--positions is given: leave --"} + name + " out");
  if (!options.given("imu")) options.fail("--positions needs --imu FILE: without readings there is nothing to couple the positions to");
}

/// Whether --dataset has its folder, and stands beside nothing that contradicts it.
void check_dataset(Options& options) {
  const std::vector<std::string>& folders = options.positionals();
  if (!options.given("dataset")) {
    if (!folders.empty()) options.fail("unexpected argument '" + folders.front() + "'");
    if (options.given("sensors"))
      options.fail("--sensors chooses among those of a --dataset: without it, name the files or leave them out");
    return;
  }
  if (folders.empty()) options.fail("FOLDER of the recording is missing");
  for (const char* name : {"imu", "positions"})
    if (options.given(name)) options.fail(std::string{"--dataset is given: leave --"} + name + " out");
  const std::string sensors = options.text("sensors");
  for (const char* name : {"tracks", "images", "without", "calibrate-camera"})
    if (options.given(name) && sensors != "all") options.fail(std::string{"--"} + name + " needs --sensors all");
  if (options.text("rate") == "camera" && sensors != "all") options.fail("--rate camera needs --sensors all");
  if ((options.text("rate") == "imu" || options.given("heading") || options.given("map")) && sensors == "gnss")
    options.fail("--rate imu, --heading and --map need --sensors imu or all");
}

SolveRequest request_of(Options& options) {
  SolveRequest request;
  check_dataset(options);
  take_sources(options, request);
  request.rig = options.text("rig"), request.truth = options.text("truth");
  request.truth_point_e_m = point(options, "truth-ecef"), request.base_position_e_m = point(options, "base-ecef");
  request.start_sow = options.optional_number("start", 0, 604800), request.end_sow = options.optional_number("end", 0, 604800);
  request.formulation = options.text("robust"), request.sigma_profile = options.text("sigma-profile");
  request.mask_deg = options.optional_number("mask", 0, 89), request.min_cn0_dbhz = options.optional_number("min-cn0", 0, 60);
  take_signals(options, request);
  take_imu(options, request);
  estimator::RtkOptions& o = request.options;
  const std::string ambiguity = options.text("ambiguity"), continuity = options.text("continuity");
  o.resolution.mode = ambiguity == "full"    ? ambiguity::ResolutionMode::full
                      : ambiguity == "float" ? ambiguity::ResolutionMode::off
                                             : ambiguity::ResolutionMode::partial;
  o.continuity = continuity == "constant"        ? ambiguity::ContinuityMode::constant
                 : continuity == "instantaneous" ? ambiguity::ContinuityMode::instantaneous
                                                 : ambiguity::ContinuityMode::hybrid;
  o.handover = options.text("handover") == "restart" ? estimator::PivotHandover::restart : estimator::PivotHandover::exact;
  o.arc_epochs = static_cast<int>(options.integer("arc", 1, 1000));
  o.lag_s = options.number("lag", 0, 600);
  if (!request.truth.empty() && request.truth_point_e_m) options.fail("give either --truth FILE or --truth-ecef X,Y,Z");
  if (request.base.empty() && request.base_position_e_m && !options.given("dataset")) options.fail("--base-ecef needs --base FILE");
  return request;
}

}  // namespace

int run_solve(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i)
    if (const std::string_view argument{argv[i]};
        argument == "--dataset=euroc" || (argument == "--dataset" && i + 1 < argc && std::string_view{argv[i + 1]} == "euroc"))
      return run_solve_euroc(argc, argv);
  Options options = solve_parser().parse(argc, argv);
  check_rate(options);
  SolveRequest request = request_of(options);
  if (const auto code = options.finished()) return *code;
  request.command = "searvins solve";
  for (int i = 1; i < argc; ++i) (request.command += ' ') += argv[i];

  std::vector<std::string> notes;
  if (options.given("dataset")) {
    const std::string sensors = options.text("sensors");
    const DatasetWish wish{options.text("dataset"), options.positionals().front(),
                           (std::filesystem::path{options.text("out")} / "inputs").string(), sensors != "gnss", sensors == "all"};
    io::FileResult<DatasetRequest> made = dataset_request(wish, request);
    if (!made) return unusable_input("solve", made.error());
    request = std::move(made->request), notes = std::move(made->notes);
  }
  io::FileResult<SolveInputs> inputs = prepare(request);
  if (!inputs) return unusable_input("solve", inputs.error());
  inputs->notes.insert(inputs->notes.begin(), notes.begin(), notes.end());
  const io::FileResult<SolveOutcome> outcome = solve(request, *inputs);
  if (!outcome) return unusable_input("solve", outcome.error());
  const std::string folder = options.text("out");
  if (const std::string wrong = write_outputs(folder, request, *inputs, *outcome); !wrong.empty())
    return unusable_input("solve", {folder, 0, wrong, "choose another folder with --out"});
  std::fputs(summary_text(request, *inputs, *outcome).c_str(), stdout);
  std::printf("\nresults in %s; open %s/report.html in a browser\n", folder.c_str(), folder.c_str());
  if (outcome->solved_at_end) return kExitDone;
  std::fprintf(stderr, "searvins solve: %s\n",
               outcome->rows.empty() ? "no epoch could be solved: the reasons stand above"
                                     : "there is no solution at the end of the recording: the reasons stand above");
  return kExitDegraded;
}

}  // namespace searvins::examples
