// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "examples/support/json.hpp"
#include "examples/support/report.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::io::SolutionStatus;
using searvins::io::TrajectoryRow;
using searvins::test::chance;
using searvins::test::for_all_seeds;
using searvins::test::integer;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

RunReport random_report(Rng& rng, int n) {
  RunReport report;
  report.rejection_reasons = {"low C/N0", "slip"};
  report.fix_outcomes = {"fixed", "success rate"};
  const Eigen::Vector3d p0{-3810234.401, 3567867.762, 3652897.917};
  const bool diagnostics = chance(rng, 0.5);
  for (int i = 0; i < n; ++i) {
    TrajectoryRow row;
    row.time = GpsTime::from_week_sow(2323, 553980 + i);
    row.p_e_m = p0 + test::random_vector<3>(rng, 30);
    row.status = static_cast<SolutionStatus>(integer(rng, 0, 4));
    if (chance(rng, 0.6)) row.set_covariance_enu_m2(test::random_spd(rng, 3));
    if (chance(rng, 0.6)) row.success_rate = uniform(rng, 0, 1);
    report.rows.push_back(row);
    ReportEpoch epoch;
    if (chance(rng, 0.6)) epoch.satellites_used = integer(rng, 0, 20);
    if (chance(rng, 0.6)) epoch.rejected = {integer(rng, 0, 3)};
    if (chance(rng, 0.6)) epoch.weight_code = uniform(rng, 0, 1), epoch.fix_outcome = integer(rng, 0, 1);
    if (diagnostics) report.epochs.push_back(epoch);
  }
  if (chance(rng, 0.5)) {
    report.truth = static_truth(p0);
    const auto evaluation = evaluate(*report.truth, report.rows);
    REQUIRE(evaluation.ok());
    report.evaluation = *evaluation;
  }
  if (chance(rng, 0.5)) report.satellites.push_back({"G05", {{10, 20, 40, 0}, {11, 21, io::kUnknown, 1}}});
  return report;
}

/// The embedded data, read with our own strict reader.
Json data_of(const std::string& html) {
  const std::string begin = "id=\"run-data\">";
  const std::size_t at = html.find(begin);
  REQUIRE(at != std::string::npos);
  const std::size_t end = html.find("</script>", at);
  const auto json = parse_json(std::string_view{html}.substr(at + begin.size(), end - at - begin.size()), "run-data");
  REQUIRE_MESSAGE(json.ok(), io::to_string(json.error()));
  return *json;
}

}  // namespace

TEST_CASE("report: the embedded data are strict JSON, every column as long as the rows") {
  for_all_seeds(40, [](Rng& rng) {
    const int n = integer(rng, 1, 60);
    const RunReport report = random_report(rng, n);
    const Json data = data_of(report_html(report));
    for (const char* name : {"t", "s", "e", "n", "u"}) REQUIRE(data.find(name));
    for (std::size_t i = 0; i < data.keys.size(); ++i) {
      const std::string& key = data.keys[i];
      if (!data.elements[i].is(Json::Kind::array) || key == "sky" || key == "reasons" || key == "outcomes" || key == "rejected") continue;
      CHECK_MESSAGE(data.elements[i].elements.size() == static_cast<std::size_t>(n), key);
    }
    if (const Json* rejected = data.find("rejected")) {
      REQUIRE(rejected->elements.size() == 2);
      for (const Json& list : rejected->elements) CHECK(list.elements.size() == static_cast<std::size_t>(n));
    }
    CHECK((data.find("ee") != nullptr) == report.truth.has_value());
    CHECK(data.find("ms") == nullptr);  // a column without any value is left out
    if (report.evaluation) {
      CHECK(data.find("scored")->find("h")->elements.size() == report.evaluation->with_error);
      CHECK(data.find("scored")->find("b")->elements.size() == report.evaluation->with_error);
    }
  });
}

TEST_CASE("report: positions and errors in the data are those of the rows") {
  Rng rng{7};
  RunReport report = random_report(rng, 10);
  const Eigen::Vector3d truth_e_m{-3810234.401, 3567867.762, 3652897.917};
  report.truth = static_truth(truth_e_m);
  const Json data = data_of(report_html(report));
  const geodesy::LocalFrame w = geodesy::LocalFrame::at(truth_e_m);
  for (std::size_t i = 0; i < report.rows.size(); ++i) {
    const Eigen::Vector3d p_w_m = w.to_local(report.rows[i].p_e_m);
    CHECK(data.find("e")->elements[i].number == doctest::Approx(p_w_m.x()).epsilon(1e-3));
    CHECK(data.find("en")->elements[i].number == doctest::Approx(p_w_m.y()).epsilon(1e-3));
    CHECK(data.find("h")->elements[i].number == doctest::Approx(p_w_m.head<2>().norm()).epsilon(1e-3));
    CHECK(data.find("t")->elements[i].number == doctest::Approx(static_cast<double>(i)));
  }
}

TEST_CASE("report: long runs are thinned, but no change of status is lost") {
  Rng rng{8};
  RunReport report;
  for (std::size_t i = 0; i < 3 * kMaxReportRows; ++i) {
    TrajectoryRow row;
    row.time = GpsTime::from_week_sow(2323, static_cast<double>(i) * 0.1);
    row.p_e_m = {-3810234.401, 3567867.762, 3652897.917};
    row.status = i == 31'234 ? SolutionStatus::dr : SolutionStatus::fix;
    report.rows.push_back(row);
  }
  const Json data = data_of(report_html(report));
  const std::vector<Json>& status = data.find("s")->elements;
  CHECK(status.size() <= kMaxReportRows + 10);
  CHECK(std::count_if(status.begin(), status.end(), [](const Json& s) { return s.number == 4; }) == 1);
  CHECK(data.find("t")->elements.back().number == doctest::Approx(0.1 * (3.0 * kMaxReportRows - 1)));
}

TEST_CASE("report: text from outside is escaped, nothing is fetched, an empty run is a page too") {
  Rng rng{9};
  RunReport report = random_report(rng, 5);
  report.epochs.assign(5, {});
  report.title = "<b>drive & \"co\"</b>";
  report.command = "searvins solve --rover '<x>'";
  report.notes = {"</script><script>alert(1)</script>"};
  report.rejection_reasons = {"</script>"};
  report.settings = {{"a<b", "c>d"}};
  const std::string html = report_html(report);
  CHECK(html.find("<b>drive") == std::string::npos);
  CHECK(html.find("&lt;b&gt;drive &amp; &quot;co&quot;&lt;/b&gt;") != std::string::npos);
  CHECK(html.find("alert(1)</script>") == std::string::npos);
  CHECK(data_of(html).find("reasons")->elements[0].string == "</script>");
  for (const char* outside : {"http://", "https://", "src=", "href=", "@import", "url("})
    CHECK_MESSAGE(html.find(outside) == std::string::npos, outside);
  CHECK(report_html(RunReport{}).find("The run has no row") != std::string::npos);
}

TEST_CASE("report: the tiles say what the evaluation says") {
  Rng rng{10};
  RunReport report = random_report(rng, 20);
  report.truth = static_truth(report.rows[0].p_e_m);
  report.evaluation = *evaluate(*report.truth, report.rows);
  report.evaluation->wrong_fixes = 3;
  const std::string html = report_html(report);
  CHECK(html.find("<div class=\"tile bad\"><b>3</b><span>wrong fixes (0.5 m or more)") != std::string::npos);
  CHECK(html.find("available of 20 epochs") != std::string::npos);
  report.evaluation.reset();
  CHECK(report_html(report).find("available of") == std::string::npos);
  CHECK(examples::detail::length_text(0.00542) == "5.4<small>mm</small>");
  CHECK(examples::detail::length_text(0.0542) == "5.42<small>cm</small>");
  CHECK(examples::detail::length_text(38.42) == "38.4<small>m</small>");
  CHECK(examples::detail::length_text(io::kUnknown) == "&ndash;");
}

TEST_CASE("report: the script is well-formed (where node is there to tell)") {
  if (std::system("node --version > /dev/null 2>&1") != 0) {
    MESSAGE("SKIPPED: no node");
    return;
  }
  Rng rng{11};
  const std::string html = report_html(random_report(rng, 5));
  const std::size_t begin = html.rfind("<script>") + 8, end = html.rfind("</script>");
  const std::string path = (std::filesystem::temp_directory_path() / "searvins_test_report.js").string();
  REQUIRE(io::write_text_file(path, html.substr(begin, end - begin)).empty());
  CHECK(std::system(("node --check '" + path + "'").c_str()) == 0);
  std::filesystem::remove(path);
}

TEST_CASE("report: integrity is shown where there is a truth, bounds where there are covariances, wrong fixes where there are some") {
  Rng rng{12};
  for (const bool covariances : {false, true}) {
    RunReport report = random_report(rng, 30);
    report.truth.reset(), report.evaluation.reset();
    CHECK(report_html(report).find("<h2>Integrity</h2>") == std::string::npos);
    for (TrajectoryRow& row : report.rows) {
      row.sd_enu_m.setConstant(io::kUnknown), row.status = SolutionStatus::fix;
      if (covariances) row.set_covariance_enu_m2(Eigen::Matrix3d::Identity());
    }
    report.truth = static_truth(report.rows[0].p_e_m);
    report.evaluation = *evaluate(*report.truth, report.rows);
    const std::string html = report_html(report);
    CHECK(html.find("<h2>Integrity</h2>") != std::string::npos);
    CHECK(html.find("<h2>Wrong fixes</h2>") != std::string::npos);
    const Json data = data_of(html);
    CHECK(data.find("integrity")->find("k")->number == doctest::Approx(horizontal_bound_factor(1e-5)));
    for (const Json& bound : data.find("scored")->find("b")->elements) {
      CHECK(bound.is(covariances ? Json::Kind::number : Json::Kind::null));
      if (covariances) CHECK(bound.number == doctest::Approx(horizontal_bound_factor(1e-5)).epsilon(1e-4));
    }
  }
}

TEST_CASE("report: names in the integrity tables are escaped") {
  Rng rng{13};
  RunReport report = random_report(rng, 10);
  report.truth = static_truth(report.rows[0].p_e_m + Eigen::Vector3d{9, 9, 9});
  for (TrajectoryRow& row : report.rows) row.status = SolutionStatus::fix;
  const Evaluation evaluation = *evaluate(*report.truth, report.rows);
  const Integrity integrity = assess_integrity(evaluation, report.rows);
  const std::vector<WrongFix> fixes = wrong_fixes_of(evaluation, report.rows);
  const std::string name = "<i>run</i>", html = integrity_html({{name, evaluation, integrity, fixes}});
  CHECK(html.find("<i>run") == std::string::npos);
  CHECK(html.find("&lt;i&gt;run&lt;/i&gt;") != std::string::npos);
}
