// SPDX-License-Identifier: BSD-3-Clause
// `searvins evaluate`: loads trajectories and a truth, prints the paper's tables.
#include <cstdio>
#include <string>
#include <vector>

#include "examples/searvins/commands.hpp"
#include "examples/support/compare_report.hpp"
#include "examples/support/evaluation.hpp"
#include "examples/support/evaluation_tables.hpp"
#include "examples/support/load_trajectory.hpp"
#include "examples/support/option_parser.hpp"
#include "examples/support/truth.hpp"

namespace searvins::examples {
namespace {

OptionParser evaluate_parser() {
  OptionParser parser{"searvins evaluate", "scores trajectories against a truth"};
  parser.value("truth", "FILE", "reference trajectory: CSV with named columns, week,sow,x,y,z rows, or a TEX-CUP ground_truth.log");
  parser.value("truth-ecef", "X,Y,Z", "reference point of an antenna that does not move, ECEF metres");
  parser.value("start", "SOW", "first second of week to score");
  parser.value("end", "SOW", "last second of week to score");
  parser.value("step", "S", "interval of the evaluation epochs, seconds").fallback("1");
  parser.value("report", "FILE", "a page that lays the runs over one another: tracks, errors over time, distributions");
  parser.positionals("RUN", "folder of a run, trajectory.csv, or RTKLIB .pos file", 1);
  parser.epilogue(
      "Rules: truth rows on multiples of the step are the epochs; the nearest row within half a step is scored at its own time\n"
      "against interpolated truth; shares below a limit are of all epochs. A fix is wrong from 0.5 m horizontal error on.");
  return parser;
}

int unusable(const io::Diagnostic& error) {
  std::fprintf(stderr, "searvins evaluate: %s\n", io::to_string(error).c_str());
  return kExitUnusableInput;
}

/// "a, b and c".
std::string title_of(const std::vector<NamedEvaluation>& runs) {
  std::string text;
  for (std::size_t i = 0; i < runs.size(); ++i) text += (i == 0 ? "" : i + 1 == runs.size() ? " and " : ", ") + runs[i].name;
  return text;
}

}  // namespace

int run_evaluate(int argc, const char* const* argv) {
  Options options = evaluate_parser().parse(argc, argv);
  EvaluationOptions rules;
  rules.step_s = options.number("step", 1e-3, 3600);
  rules.start_sow = options.optional_number("start", 0, 604800);
  rules.end_sow = options.optional_number("end", 0, 604800);
  const std::vector<double> point = options.numbers("truth-ecef", 3);
  if (options.given("truth") == options.given("truth-ecef")) options.fail("give either --truth FILE or --truth-ecef X,Y,Z");
  if (rules.start_sow && rules.end_sow && *rules.end_sow < *rules.start_sow) options.fail("--end lies before --start");
  if (const auto code = options.finished()) return *code;

  std::vector<NamedEvaluation> runs;
  Comparison comparison;
  for (const std::string& given : options.positionals()) {
    const io::FileResult<LoadedTrajectory> loaded = load_trajectory(given);
    if (!loaded) return unusable(loaded.error());
    io::FileResult<TruthTrack> truth =
        point.empty() ? read_truth(options.text("truth"), loaded->rows.front().time) : static_truth({point[0], point[1], point[2]});
    if (!truth) return unusable(truth.error());
    io::FileResult<Evaluation> evaluation = evaluate(*truth, loaded->rows, rules);
    if (!evaluation) {
      io::Diagnostic error = evaluation.error();
      error.file = point.empty() ? options.text("truth") : given;
      return unusable(error);
    }
    if (options.given("report")) comparison.runs.push_back({loaded->name, loaded->rows, *evaluation});
    runs.push_back({loaded->name, std::move(evaluation).value()});
  }
  std::fputs(evaluation_text(runs).c_str(), stdout);
  if (options.given("report")) {
    const std::string path = options.text("report");
    comparison.title = title_of(runs);
    comparison.command = "searvins evaluate";
    for (int i = 1; i < argc; ++i) (comparison.command += ' ') += argv[i];
    if (const std::string wrong = io::write_text_file(path, compare_html(comparison)); !wrong.empty())
      return unusable({path, 0, wrong, "choose another file with --report"});
    std::printf("\nreport: %s\n", path.c_str());
  }
  return kExitDone;
}

}  // namespace searvins::examples
