// SPDX-License-Identifier: BSD-3-Clause
// `searvins evaluate`: scores trajectories against a truth; the paper's tables, integrity, wrong fixes.
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <searvins/io/centreline_file.hpp>

#include "examples/searvins/commands.hpp"
#include "examples/support/assessment.hpp"
#include "examples/support/compare_report.hpp"
#include "examples/support/evaluation.hpp"
#include "examples/support/load_trajectory.hpp"
#include "examples/support/option_parser.hpp"
#include "examples/support/paper_table.hpp"
#include "examples/support/run_details.hpp"
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
  parser.flag("paper", "the paper's own rows beside the runs, marked as such");
  parser.value("digits", "N", "decimals of the metres in the paper's tables").fallback("2");
  parser.value("integrity-risk", "P", "probability per epoch that an error may exceed its bound").fallback("1e-5");
  parser.value("alert-limit", "M", "largest horizontal error that the application bears, metres").fallback("1.5");
  parser.value("report", "FILE",
               "a page that lays the runs over one another: tables, tracks, errors over time, distributions, Stanford diagrams");
  parser.value("streets", "FILE", "lines to draw below the tracks of the --report: rows line,lat_deg,lon_deg,height_m");
  parser.value("tables", "FILE", "the paper's tables as FILE.csv or FILE.md").repeated();
  parser.value("json", "FILE", "all figures, the wrong fixes one by one");
  parser.positionals("RUN", "folder of a run, trajectory.csv, or RTKLIB .pos file; NAME=RUN names it", 1);
  parser.epilogue(
      "Rules: truth rows on multiples of the step are the epochs; the nearest row within half a step is scored at its own time\n"
      "against interpolated truth; shares below a limit are of all epochs. A fix is wrong from 0.5 m horizontal error on.\n"
      "docs/evaluation.md defines every figure.");
  return parser;
}

/// "a, b and c".
std::string title_of(const std::vector<AssessedRun>& runs) {
  std::string text;
  for (std::size_t i = 0; i < runs.size(); ++i) text += (i == 0 ? "" : i + 1 == runs.size() ? " and " : ", ") + runs[i].name;
  return text;
}

/// What the user asked for.
struct Request {
  EvaluationOptions rules{};
  IntegrityOptions integrity{};
  std::vector<double> point{};  ///< truth of an antenna that does not move; empty: the file
  std::string truth{};
};

/// A run as given: NAME=RUN, or RUN alone. A path that exists is taken as it stands.
std::pair<std::string, std::string> name_and_path(const std::string& given) {
  std::error_code code;
  const std::size_t equals = given.find('=');
  if (equals == std::string::npos || equals == 0 || std::filesystem::exists(given, code)) return {{}, given};
  return {given.substr(0, equals), given.substr(equals + 1)};
}

io::FileResult<AssessedRun> assess_file(const std::string& given, const Request& request) {
  const auto [name, path] = name_and_path(given);
  io::FileResult<LoadedTrajectory> loaded = load_trajectory(path);
  if (!loaded) return loaded.error();
  const std::vector<double>& p = request.point;
  io::FileResult<TruthTrack> truth = p.empty() ? read_truth(request.truth, loaded->rows.front().time) : static_truth({p[0], p[1], p[2]});
  if (!truth) return truth.error();
  io::FileResult<Evaluation> evaluation = evaluate(*truth, loaded->rows, request.rules);
  if (!evaluation) {
    io::Diagnostic error = evaluation.error();
    error.file = p.empty() ? request.truth : given;
    return error;
  }
  const RunDetails details = find_run_details(path, loaded->rows.size());
  AssessedRun run =
      assess(name.empty() ? loaded->name : name, std::move(loaded->rows), std::move(evaluation).value(), request.integrity, details.ratios);
  run.sensors = details.configuration;
  return run;
}

/// Writes the paper's tables in the form that the file's name ends with; an empty string on success.
std::string write_tables(const std::string& path, const std::vector<PaperTableRow>& rows) {
  const std::string ending = std::filesystem::path{path}.extension().string();
  return io::write_text_file(path, ending == ".csv" ? paper_table_csv(rows) : paper_table_markdown(rows));
}

/// Writes what was asked for; an empty diagnostic message on success.
io::Diagnostic write_files(const Options& options, const std::vector<PaperTableRow>& table, std::vector<AssessedRun>&& runs,
                           const std::string& command) {
  for (const std::string& path : options.texts("tables")) {
    if (std::string wrong = write_tables(path, table); !wrong.empty())
      return {path, 0, std::move(wrong), "choose another file with --tables"};
    std::printf("\ntables: %s\n", path.c_str());
  }
  if (const std::string path = options.text("json"); !path.empty()) {
    if (std::string wrong = io::write_text_file(path, assessment_json(runs, command)); !wrong.empty())
      return {path, 0, std::move(wrong), "choose another file with --json"};
    std::printf("\nfigures: %s\n", path.c_str());
  }
  if (const std::string path = options.text("report"); !path.empty()) {
    Comparison comparison;
    if (const std::string streets = options.text("streets"); !streets.empty()) {
      io::FileResult<std::vector<imu::CentrelinePoint>> points = io::read_centrelines(streets);
      if (!points) return points.error();
      comparison.streets = std::move(points).value();
    }
    comparison.title = title_of(runs), comparison.command = command, comparison.table = table, comparison.runs = std::move(runs);
    if (std::string wrong = io::write_text_file(path, compare_html(comparison)); !wrong.empty())
      return {path, 0, std::move(wrong), "choose another file with --report"};
    std::printf("\nreport: %s\n", path.c_str());
  }
  return {};
}

}  // namespace

int run_evaluate(int argc, const char* const* argv) {
  Options options = evaluate_parser().parse(argc, argv);
  Request request;
  request.rules.step_s = options.number("step", 1e-3, 3600);
  request.rules.start_sow = options.optional_number("start", 0, 604800);
  request.rules.end_sow = options.optional_number("end", 0, 604800);
  request.integrity.risk = options.number("integrity-risk", 1e-12, 0.5);
  request.integrity.alert_limit_m = options.number("alert-limit", 1e-3, 1e6);
  request.point = options.numbers("truth-ecef", 3), request.truth = options.text("truth");
  const int digits = static_cast<int>(options.integer("digits", 0, 9));
  if (options.given("truth") == options.given("truth-ecef")) options.fail("give either --truth FILE or --truth-ecef X,Y,Z");
  if (request.rules.start_sow && request.rules.end_sow && *request.rules.end_sow < *request.rules.start_sow)
    options.fail("--end lies before --start");
  for (const std::string& path : options.texts("tables"))
    if (!path.ends_with(".csv") && !path.ends_with(".md")) options.fail("--tables: " + path + " ends neither with .csv nor with .md");
  if (options.given("streets") && !options.given("report")) options.fail("--streets are drawn into the page of --report FILE");
  if (const auto code = options.finished()) return *code;

  std::vector<AssessedRun> runs;
  std::vector<PaperTableRow> table;
  if (options.flag("paper")) table = paper_rows();
  for (const std::string& given : options.positionals()) {
    io::FileResult<AssessedRun> run = assess_file(given, request);
    if (!run) return unusable_input("evaluate", run.error());
    table.push_back(paper_table_row(run->name, run->sensors, run->evaluation, digits));
    runs.push_back(std::move(run).value());
  }
  std::fputs((paper_table_text(table) + '\n' + assessment_text(runs)).c_str(), stdout);
  std::string command = "searvins evaluate";
  for (int i = 1; i < argc; ++i) (command += ' ') += argv[i];
  if (const io::Diagnostic wrong = write_files(options, table, std::move(runs), command); !wrong.message.empty())
    return unusable_input("evaluate", wrong);
  return kExitDone;
}

}  // namespace searvins::examples
