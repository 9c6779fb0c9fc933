// SPDX-License-Identifier: BSD-3-Clause
// `searvins demo`: the bundled synthetic recording, solved by three formulations, scored against its truth.
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "examples/searvins/commands.hpp"
#include "examples/searvins/solve_job.hpp"
#include "examples/support/evaluation_tables.hpp"
#include "examples/support/option_parser.hpp"

namespace searvins::examples {
namespace {

namespace fs = std::filesystem;

/// Where the recording is: --data, else the source tree that the command was built from, else the present folder.
fs::path data_folder(const std::string& given) {
  if (!given.empty()) return given;
  const fs::path name{"synthetic_drive"};
#ifdef SEARVINS_EXAMPLES_DATA_DIR
  if (fs::exists(fs::path{SEARVINS_EXAMPLES_DATA_DIR} / name)) return fs::path{SEARVINS_EXAMPLES_DATA_DIR} / name;
#endif
  return fs::path{"examples/data"} / name;
}

/// Fewer wrong fixes, then the smaller error.
bool is_better(const Evaluation& a, const Evaluation& b) {
  if (a.wrong_fixes != b.wrong_fixes) return a.wrong_fixes < b.wrong_fixes;
  return a.horizontal.rmse_m < b.horizontal.rmse_m;
}

}  // namespace

int run_demo(int argc, const char* const* argv) {
  OptionParser parser{"searvins demo", "solves the bundled synthetic recording and scores it"};
  parser.value("out", "DIR", "folder for the results").fallback("searvins_demo");
  parser.value("data", "DIR", "folder with rover.obs, base.obs, nav.rnx and truth.csv; else the bundled one");
  parser.epilogue("GNSS only: the inertial sensor and the cameras come with later versions.");
  Options options = parser.parse(argc, argv);
  if (const auto code = options.finished()) return *code;

  const fs::path data = data_folder(options.text("data")), out{options.text("out")};
  SolveRequest request;
  request.rover = (data / "rover.obs").string(), request.base = (data / "base.obs").string();
  request.nav = {(data / "nav.rnx").string()}, request.truth = (data / "truth.csv").string();
  if (fs::exists(data / "rig.json")) request.rig = (data / "rig.json").string();
  const io::FileResult<SolveInputs> inputs = prepare(request);
  if (!inputs) return unusable_input("demo", inputs.error());

  std::vector<NamedEvaluation> runs;
  std::string best;
  bool all_solved = true;
  for (const char* formulation : {"scalar", "latent", "symmetric"}) {
    request.formulation = formulation, request.label = formulation;
    const std::string folder = (out / formulation).string();
    request.command = "searvins solve --rover " + request.rover + " --base " + request.base + " --nav " + request.nav.front() +
                      (request.rig.empty() ? "" : " --rig " + request.rig) + " --truth " + request.truth + " --robust " + formulation +
                      " --out " + folder;
    const io::FileResult<SolveOutcome> outcome = solve(request, *inputs);
    if (!outcome) return unusable_input("demo", outcome.error());
    if (const std::string wrong = write_outputs(folder, request, *inputs, *outcome); !wrong.empty())
      return unusable_input("demo", {folder, 0, wrong, "choose another folder with --out"});
    all_solved = all_solved && outcome->solved_at_end;
    if (!outcome->evaluation) continue;
    if (best.empty() || is_better(*outcome->evaluation, runs.front().evaluation))
      best = formulation, runs.insert(runs.begin(), {formulation, *outcome->evaluation});
    else
      runs.push_back({formulation, *outcome->evaluation});
  }
  if (runs.empty())
    return unusable_input("demo",
                          {request.truth, 0, "no epoch of the recording can be scored against it", "check that both are of the same day"});
  std::fputs(evaluation_text(runs).c_str(), stdout);

  std::error_code failed;
  fs::copy_file(out / best / "report.html", out / "report.html", fs::copy_options::overwrite_existing, failed);
  if (failed)
    return unusable_input(
        "demo", {(out / "report.html").string(), 0, "could not be written: " + failed.message(), "choose another folder with --out"});
  std::printf("\nThe recording is synthetic and GNSS only. Report of the best run (%s): %s\n", best.c_str(),
              (out / "report.html").string().c_str());
  return all_solved ? kExitDone : kExitDegraded;
}

}  // namespace searvins::examples
