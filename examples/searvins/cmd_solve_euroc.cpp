// SPDX-License-Identifier: BSD-3-Clause
// `searvins solve --dataset euroc`: options and exit codes of stereo-inertial recordings; the work is in euroc_job.cpp.
#include <cstdint>
#include <cstdio>
#include <string>

#include <searvins/io/text_fields.hpp>

#include "examples/searvins/commands.hpp"
#include "examples/searvins/euroc_job.hpp"
#include "examples/support/option_parser.hpp"

namespace searvins::examples {
namespace {

OptionParser euroc_parser() {
  OptionParser parser{"searvins solve --dataset euroc",
                      "solves a stereo-inertial recording without GNSS: trajectory, errors after alignment, report"};
  parser.value("dataset", "LAYOUT", "layout of the recording").one_of({"euroc"}).required();
  parser.value("out", "DIR", "folder for the results, made if need be").required();
  parser.value("truth", "FILE", "truth in the form of state_groundtruth_estimate0/data.csv; else the recording's own, if there is one");
  parser.flag("truth-is-left-camera", "the poses of --truth are those of the left camera, not of the body");
  parser.value("tracks", "FILE", "stereo tracks of another frontend in pixels of the rectified pair, instead of the pictures");
  parser.value("without", "LIST", "parts of the screening of tracks to switch off: semantic, geometric, motion, maturity");
  parser.value("reject", "LIST",
               "numbers of the classes in labels0 whose points are refused; else what moves or changes of Cityscapes' classes");
  parser.value("duration", "S", "solve this much from the first frame on");
  parser.value("lag", "S", "length of the window, seconds; at most 80 frames").fallback("6");
  parser.value("arc", "N", "frames that share a landmark").fallback("10");
  parser.positionals("FOLDER", "recording: cam0, cam1 and imu0 in it or in its mav0", 1, 1);
  parser.epilogue(
      "Stamps are taken and written as they stand. The world is level; its heading is that of the beginning.\n"
      "Written: trajectory.tum (body in the world), truth.tum, summary.txt, summary.json, report.html.\n"
      "Exit codes: 0 done, 2 usage, 3 unusable input, 4 the run ended without a pose.");
  return parser;
}

EurocRequest euroc_request_of(Options& options) {
  EurocRequest request;
  if (!options.positionals().empty()) request.folder = options.positionals().front();
  request.truth = options.text("truth"), request.truth_is_left_camera = options.given("truth-is-left-camera");
  request.tracks = options.text("tracks"), request.without = options.list("without");
  for (const std::string& part : request.without)
    if (part != "semantic" && part != "geometric" && part != "motion" && part != "maturity")
      options.fail("--without: '" + part + "' is none of semantic, geometric, motion, maturity");
  if (request.truth_is_left_camera && request.truth.empty()) options.fail("--truth-is-left-camera needs --truth FILE");
  for (const std::string& text : options.list("reject")) {
    std::int64_t number = -1;
    if (!io::parse_integer(text, number) || number < 0 || number > 255) options.fail("--reject: '" + text + "' is no class (0 to 255)");
    request.reject.push_back(static_cast<int>(number));
  }
  request.duration_s = options.optional_number("duration", 0.1, 1e6);
  request.lag_s = options.number("lag", 0.5, 60);
  request.max_arc = static_cast<int>(options.integer("arc", 3, 32));
  return request;
}

}  // namespace

int run_solve_euroc(int argc, const char* const* argv) {
  Options options = euroc_parser().parse(argc, argv);
  EurocRequest request = euroc_request_of(options);
  if (const auto code = options.finished()) return *code;
  request.command = "searvins solve";
  for (int i = 1; i < argc; ++i) (request.command += ' ') += argv[i];

  const io::FileResult<EurocOutcome> outcome = solve_euroc(request);
  if (!outcome) return unusable_input("solve", outcome.error());
  const std::string folder = options.text("out");
  if (const std::string wrong = write_outputs(folder, request, *outcome); !wrong.empty())
    return unusable_input("solve", {folder, 0, wrong, "choose another folder with --out"});
  std::fputs(summary_text(request, *outcome).c_str(), stdout);
  std::printf("\nresults in %s; open %s/report.html in a browser\n", folder.c_str(), folder.c_str());
  if (outcome->is_solved_at_end()) return kExitDone;
  std::fprintf(stderr, "searvins solve: the last frame has no pose: the reasons stand above\n");
  return kExitDegraded;
}

}  // namespace searvins::examples
