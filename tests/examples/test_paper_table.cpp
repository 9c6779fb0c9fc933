// SPDX-License-Identifier: BSD-3-Clause
// The paper's tables: our constants against its source, our runs in its columns, every output form.
#include <doctest/doctest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "examples/support/paper_table.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::examples;

namespace {

/// A cell of the paper's source without its markup.
std::string plain(std::string cell) {
  const std::pair<const char*, const char*> words[] = {{"\\ensuremath{\\times}", "no"},
                                                       {"\\ensuremath{\\checkmark}", "yes"},
                                                       {"\\textbf{", ""},
                                                       {"\\mathrm{", ""},
                                                       {"\\midrule", ""},
                                                       {"\\!", ""}};
  for (const auto& [from, to] : words)
    for (std::size_t at; (at = cell.find(from)) != std::string::npos;) cell.replace(at, std::string{from}.size(), to);
  if (const std::size_t cite = cell.find("~\\cite{"); cite != std::string::npos) cell.erase(cite, cell.find('}', cite) - cite + 1);
  std::erase_if(cell, [](char c) { return c == '$' || c == '\\' || c == '%' || c == '{' || c == '}'; });
  return std::string{io::trimmed(cell)};
}

/// The rows of a table of the paper with `columns` cells, the headings left out.
std::vector<std::vector<std::string>> rows_of(const std::string& source, const std::string& label, std::size_t columns) {
  const std::size_t from = source.find("\\midrule", source.find("\\label{" + label + "}")), to = source.find("\\bottomrule", from);
  REQUIRE(to != std::string::npos);
  std::string body = source.substr(from, to - from);
  std::replace(body.begin(), body.end(), '\n', ' ');
  std::vector<std::vector<std::string>> rows;
  for (std::size_t at; (at = body.find("\\\\")) != std::string::npos; body.erase(0, at + 2)) {
    std::vector<std::string> cells;
    std::istringstream line{body.substr(0, at)};
    for (std::string cell; std::getline(line, cell, '&');) cells.push_back(plain(cell));
    if (cells.size() == columns) rows.push_back(cells);
  }
  return rows;
}

Evaluation some_evaluation() {
  Evaluation e;
  e.epochs.resize(200);
  e.available = e.with_error = 199;
  e.availability_pct = 99.5, e.below_1p0_pct = 97.123, e.below_1p5_pct = 99;
  e.horizontal = {0.384, 1.604, 0.3, 0.901}, e.spatial = {1.406, 4.036, 1, 3.007};
  e.fixed = 90, e.wrong_fixes = 3, e.fix_rate_pct = 45, e.fixed_below_0p5_pct = 100.0 * 87 / 90;
  e.fixed_horizontal = {0.154, 0.56, 0.1, 0.4};
  return e;
}

std::size_t count(const std::string& text, char c) { return static_cast<std::size_t>(std::count(text.begin(), text.end(), c)); }

}  // namespace

TEST_CASE("the paper's rows are the paper's, digit by digit") {
  const auto shared = test::shared_data();
  const auto source =
      shared ? io::read_text_file((*shared / "reference" / "paper.tex").string()) : io::FileResult<std::string>{io::Diagnostic{}};
  if (!source) {
    MESSAGE("SKIPPED: the paper's source is not there");
    return;
  }
  const std::vector<PaperTableRow> ours = paper_rows();
  const auto positions = rows_of(*source, "tab:full_route_results", 13), fixed = rows_of(*source, "tab:rtk_fix_results", 7);
  REQUIRE(positions.size() == ours.size());
  REQUIRE(fixed.size() == kPaperFixes.size());
  std::size_t k = 0;
  for (std::size_t r = 0; r < ours.size(); ++r) {
    const PaperTableRow& row = ours[r];
    CAPTURE(row.method);
    std::vector<std::string> cells{row.method, row.gnss, row.vision, row.imu};
    cells.insert(cells.end(), row.position.begin(), row.position.end());
    CHECK(cells == positions[r]);
    if (!row.has_fixed) continue;
    REQUIRE(k < fixed.size());
    cells = {row.method};
    cells.insert(cells.end(), row.fixed.begin(), row.fixed.end());
    CHECK(cells == fixed[k++]);
  }
  CHECK(k == fixed.size());
}

TEST_CASE("a run in the paper's columns, order and digits") {
  const PaperTableRow row = paper_table_row("mine", {true, "TC, r+b", "S", true}, some_evaluation());
  CHECK(row.position == std::array<std::string, 9>{"0.38", "1.60", "97.12", "99.00", "0.90", "1.41", "4.04", "3.01", "99.5"});
  CHECK(row.fixed == std::array<std::string, 6>{"90", "45.00", "96.67", "3", "0.15", "0.56"});
  CHECK(paper_table_row("mine", {}, some_evaluation(), 3).position[0] == "0.384");
  CHECK(paper_table_row("mine", {}, some_evaluation()).gnss.empty());
  const PaperTableRow alone = paper_table_row("mine", {true, "r", "", false}, some_evaluation());
  CHECK(alone.vision == "no");
  CHECK(alone.imu == "no");
  Evaluation without = some_evaluation();
  without.fixed = 0, without.fixed_below_0p5_pct = io::kUnknown, without.fixed_horizontal = {};
  CHECK(paper_table_row("mine", {}, without).fixed[2].empty());
}

TEST_CASE("text, Markdown, CSV and HTML hold the same rows; the paper's are marked") {
  std::vector<PaperTableRow> rows = paper_rows();
  rows.push_back(paper_table_row("mine, <\"best\"> | a", {true, "TC, r+b", "S", true}, some_evaluation()));
  const std::string text = paper_table_text(rows), markdown = paper_table_markdown(rows), csv = paper_table_csv(rows),
                    html = paper_table_html(rows);
  for (const char c : text) CHECK((c == '\n' || (c >= ' ' && c <= '~')));
  CHECK(text.find("GVINS [paper]") != std::string::npos);
  CHECK(text.find(">1e4") != std::string::npos);
  CHECK(text.find("fix rate %") != std::string::npos);

  std::istringstream lines{markdown};
  std::size_t first = 0, second = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('|')) (count(line, '|') - count(line, '\\') == 14 ? first : second) += 1;
    if (line.starts_with('|') && count(line, '|') - count(line, '\\') != 14) CHECK(count(line, '|') - count(line, '\\') == 8);
  }
  CHECK(first == 2 + rows.size());
  CHECK(second == 2 + kPaperFixes.size() + 1);
  CHECK(markdown.find("mine, <\"best\"> \\| a") != std::string::npos);

  CHECK(count(csv, '\n') == rows.size() + 1);
  CHECK(
      csv.find(
          "\nSeA-RVINS (latent),paper,\"TC, r+b\",S,yes,0.39,1.60,96.16,99.90,0.90,1.41,4.04,3.01,100.0,1842,45.59,99.35,12,0.15,0.55\n") !=
      std::string::npos);
  CHECK(csv.find("\nRTKLIB-EX,paper,r+b,no,no,4.95,58.56,46.14,59.23,8.41,10.31,66.99,21.52,100.0,,,,,,\n") != std::string::npos);
  CHECK(csv.find("\n\"mine, <\"\"best\"\"> | a\",run,\"TC, r+b\",S,yes,0.38,") != std::string::npos);

  CHECK(html.find("mine, &lt;&quot;best&quot;&gt; | a") != std::string::npos);
  CHECK(html.find("<small>paper</small>") != std::string::npos);
  std::size_t table_rows = 0;
  for (std::size_t at = 0; (at = html.find("<tr", at)) != std::string::npos; ++at) ++table_rows;
  CHECK(table_rows == 2 * 2 + rows.size() + kPaperFixes.size() + 1);
}

TEST_CASE("figures beyond a bound are printed as the paper prints them") {
  CHECK(paper_figure_text({1e4, true}, 2) == ">1e4");
  CHECK(paper_figure_text({2e5, true}, 2) == ">2e5");
  CHECK(paper_figure_text({1e3, true}, 2) == ">1e3");
  CHECK(paper_figure_text({96.7}, 1) == "96.7");
}

TEST_CASE("sensors of a run from its summary; ratios from its .pos file") {
  const auto of = [](const std::string& settings, const std::string& more = "") {
    return configuration_of("{\"settings\": {" + settings + "}" + more + "}");
  };
  const SensorConfiguration whole = of(R"("rover": "a", "base": "b", "inertial unit": "c")", R"(, "stereo": {"frames": 3})");
  CHECK(whole.is_known);
  CHECK(whole.gnss == "TC, r+b");
  CHECK(whole.vision == "S");
  CHECK(whole.has_imu);
  CHECK(of(R"("rover": "a", "base": "b")").gnss == "r+b");
  CHECK(of(R"("rover": "a")").gnss == "r");
  CHECK(of(R"("rover": "a", "inertial unit": "c")").gnss == "TC, r");
  CHECK(of(R"("positions": "a", "inertial unit": "c")").gnss == "LC");
  CHECK(of(R"("rover": "a")").vision.empty());
  CHECK_FALSE(configuration_of("no json").is_known);
  CHECK_FALSE(configuration_of("{}").is_known);

  CHECK(ratios_of("% program\n%  GPST  Q age(s)  ratio\n2323 1.0 1 0.0 2.5\n2323 2.0 1 0.0 12.5\n") == std::vector<double>{2.5, 12.5});
  CHECK(ratios_of("%  GPST  Q age(s)\n2323 1.0 1 0.0\n").empty());
  CHECK(ratios_of("%  GPST  Q  ratio\n2323 1.0 x\n").empty());
  CHECK(ratios_of("").empty());
}
