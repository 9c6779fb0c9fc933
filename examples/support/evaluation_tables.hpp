// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The two tables of the paper and the list of wrong fixes, for a terminal; several runs side by side.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "examples/support/evaluation.hpp"
#include "examples/support/table.hpp"

namespace searvins::examples {

/// A scored run and its name.
struct NamedEvaluation {
  std::string name;
  Evaluation evaluation;
};

/// Table I: horizontal and 3-D errors and availability.
[[nodiscard]] inline std::string position_table(const std::vector<NamedEvaluation>& runs) {
  Table table{{"run", "epochs", "H RMSE m", "H max m", "<1.0 m %", "<1.5 m %", "H P95 m", "3D RMSE m", "3D max m", "3D P95 m", "avail %"}};
  for (const auto& [name, e] : runs)
    table.row({name, std::to_string(e.epochs.size()), cell(e.horizontal.rmse_m, 3), cell(e.horizontal.max_m, 3), cell(e.below_1p0_pct, 2),
               cell(e.below_1p5_pct, 2), cell(e.horizontal.p95_m, 3), cell(e.spatial.rmse_m, 3), cell(e.spatial.max_m, 3),
               cell(e.spatial.p95_m, 3), cell(e.availability_pct, 2)});
  return table.text();
}

/// Table II: what the epochs with status `fix` are worth.
[[nodiscard]] inline std::string fixed_table(const std::vector<NamedEvaluation>& runs) {
  Table table{{"run", "fixed epochs", "fix rate %", "<0.5 m %", ">=0.5 m epochs", "H RMSE m", "H max m"}};
  for (const auto& [name, e] : runs)
    table.row({name, std::to_string(e.fixed), cell(e.fix_rate_pct, 2), cell(e.fixed_below_0p5_pct, 2), std::to_string(e.wrong_fixes),
               cell(e.fixed_horizontal.rmse_m, 4), cell(e.fixed_horizontal.max_m, 4)});
  return table.text();
}

/// Status counts and the consistency of the reported covariance.
[[nodiscard]] inline std::string status_table(const std::vector<NamedEvaluation>& runs) {
  Table table{{"run", "fix", "float", "dgnss", "spp", "dr", "none", "mean NEES (3)", "NEES < 7.81 %"}};
  for (const auto& [name, e] : runs) {
    std::vector<std::string> cells{name};
    for (const std::size_t count : e.by_status) cells.push_back(std::to_string(count));
    cells.push_back(std::to_string(e.epochs.size() - e.available));
    cells.push_back(cell(e.mean_nees, 2)), cells.push_back(cell(e.nees_within_95_pct, 1));
    table.row(cells);
  }
  return table.text();
}

/// Wrong fixes of one run, at most `limit` lines; empty when there is none.
[[nodiscard]] inline std::string wrong_fix_list(const NamedEvaluation& run, std::size_t limit = 20) {
  std::string text;
  std::size_t listed = 0;
  for (const ScoredEpoch& epoch : run.evaluation.epochs) {
    if (!epoch.available || epoch.status != io::SolutionStatus::fix || epoch.horizontal_m() < kWrongFixM) continue;
    if (listed++ >= limit) continue;
    text += "  sow " + io::fixed_text(epoch.time.sow(), 3, 10) + "  east " + io::fixed_text(epoch.error_enu_m.x(), 3, 8) + "  north " +
            io::fixed_text(epoch.error_enu_m.y(), 3, 8) + "  up " + io::fixed_text(epoch.error_enu_m.z(), 3, 8) + " m\n";
  }
  if (listed > limit) text += "  ... and " + std::to_string(listed - limit) + " more\n";
  return listed ? run.name + ": " + std::to_string(listed) + " wrong fixes (horizontal error of 0.5 m or more)\n" + text : text;
}

/// Everything that `searvins evaluate` prints.
[[nodiscard]] inline std::string evaluation_text(const std::vector<NamedEvaluation>& runs) {
  std::string text =
      "Position\n" + position_table(runs) + "\nFixed epochs\n" + fixed_table(runs) + "\nStatus and covariance\n" + status_table(runs);
  for (const NamedEvaluation& run : runs) {
    const std::size_t without = run.evaluation.available - run.evaluation.with_error;
    if (without)
      text += '\n' + run.name + ": " + std::to_string(without) +
              " estimates lie at times that the truth does not cover; they count as failures\n";
    if (const std::string wrong = wrong_fix_list(run); !wrong.empty()) text += '\n' + wrong;
  }
  return text;
}

}  // namespace searvins::examples
