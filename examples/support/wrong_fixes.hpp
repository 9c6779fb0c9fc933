// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The wrong fixes of a scored run: when, how far, with what behind them, and what the rows tell about the cause.
///
/// A wrong fix is an evaluation epoch with status `fix` whose horizontal error is 0.5 m or more, or not known (evaluation.hpp). Its cause
/// is read from the estimate of the epoch before, whose horizontal error vector is f when that of the wrong fix is e:
///
///     no truth        e is not known
///     first estimate  there is none before, or none of that time (an outage ends)
///     continued       the epoch before was a wrong fix too, and |e - f| < 0.25 m: the same integers go on
///     off before      |e - f| < |e|/2: the position was off already; the integers agree with a biased float (multipath, blocked signals)
///     jump            else: the integers themselves moved the position away
///
/// Beside the cause stand hints: few satellites, a low success rate, a low ratio, and whether the covariance admits the error (inside the
/// horizontal three-sigma ellipse: the fix is imprecise rather than wrong). They are what a user can look at, not a proof.
///
/// Wrong fixes of successive evaluation epochs are one event.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/io/trajectory.hpp>
#include <searvins/math/quantiles.hpp>

#include "examples/support/evaluation.hpp"
#include "examples/support/integrity.hpp"

namespace searvins::examples {

/// Where a wrong fix came from.
enum class WrongFixCause : std::uint8_t { no_truth, first_estimate, continued, off_before, jump };
inline constexpr std::size_t kWrongFixCauses = 5;

/// The word in tables and files.
[[nodiscard]] constexpr const char* name_of(WrongFixCause cause) {
  constexpr const char* names[kWrongFixCauses] = {"no truth", "first estimate", "continued", "off before", "jump"};
  return names[static_cast<std::size_t>(cause)];
}

inline constexpr double kSameIntegersM = 0.25;                  ///< errors of successive epochs that differ by less have the same integers
inline constexpr int kFewSatellites = 8;                        ///< fewer are a hint
inline constexpr double kLowSuccessRate = 0.99, kLowRatio = 3;  ///< below is a hint

/// One wrong fix.
struct WrongFix {
  GpsTime time{};                                                        ///< of the evaluation epoch
  std::size_t epoch{0}, row{0};                                          ///< indices of the evaluation epoch and of its row
  std::size_t event{0};                                                  ///< wrong fixes of one number follow one another
  Eigen::Vector3d error_enu_m{Eigen::Vector3d::Constant(io::kUnknown)};  ///< estimate minus truth; NaN: not known
  double horizontal_m{io::kUnknown};
  double sigma_m{io::kUnknown};  ///< larger semi-axis of the horizontal 1-sigma ellipse
  int n_sat{-1}, n_dd{-1};       ///< -1: the row does not say
  double success_rate{io::kUnknown}, ratio{io::kUnknown};
  WrongFixCause cause{WrongFixCause::no_truth};
  double before_m{io::kUnknown}, step_m{io::kUnknown};  ///< |f| and |e - f|
  bool is_admitted{false};                              ///< inside the horizontal three-sigma ellipse
};

/// The hints and distances behind a cause, as a phrase.
[[nodiscard]] inline std::string explanation_of(const WrongFix& fix) {
  std::string text;
  const auto add = [&text](const std::string& part) { (text += text.empty() ? "" : ", ") += part; };
  if (fix.cause == WrongFixCause::jump || fix.cause == WrongFixCause::off_before)
    add("moved " + io::fixed_text(fix.step_m, 2) + " m, error before " + io::fixed_text(fix.before_m, 2) + " m");
  if (fix.n_sat >= 0 && fix.n_sat < kFewSatellites) add("few satellites");
  if (fix.success_rate < kLowSuccessRate) add("low success rate");
  if (fix.ratio > 0 && fix.ratio < kLowRatio) add("low ratio");
  if (fix.is_admitted) add("within 3 sigma");
  return text;
}

namespace detail {

/// Cause and distances from the epoch before.
inline void find_cause(const Evaluation& evaluation, WrongFix& fix) {
  const ScoredEpoch& at = evaluation.epochs[fix.epoch];
  if (!at.has_error()) return;
  fix.cause = WrongFixCause::first_estimate;
  if (fix.epoch == 0) return;
  const ScoredEpoch& before = evaluation.epochs[fix.epoch - 1];
  if (!before.has_error() || seconds_between(before.time, at.time) > 1.5 * evaluation.step_s) return;
  fix.before_m = before.horizontal_m();
  fix.step_m = (at.error_enu_m - before.error_enu_m).head<2>().norm();
  const bool was_wrong_fix = before.status == io::SolutionStatus::fix && !(fix.before_m < kWrongFixM);
  fix.cause = was_wrong_fix && fix.step_m < kSameIntegersM ? WrongFixCause::continued
              : fix.step_m < fix.horizontal_m / 2          ? WrongFixCause::off_before
                                                           : WrongFixCause::jump;
}

}  // namespace detail

/// All wrong fixes of a run, rising in time: as many as Evaluation::wrong_fixes. `rows` are those that were scored; `ratios` as many, or
/// none.
[[nodiscard]] inline std::vector<WrongFix> wrong_fixes_of(const Evaluation& evaluation, const std::vector<io::TrajectoryRow>& rows,
                                                          const std::vector<double>& ratios = {}) {
  const double limit = math::chi_square_threshold(math::two_sided_exceedance(3), 2).value();
  std::vector<WrongFix> list;
  for (std::size_t i = 0; i < evaluation.epochs.size(); ++i) {
    const ScoredEpoch& epoch = evaluation.epochs[i];
    if (!epoch.available || epoch.status != io::SolutionStatus::fix || epoch.horizontal_m() < kWrongFixM) continue;
    WrongFix fix;
    fix.time = epoch.time, fix.epoch = i, fix.row = epoch.row;
    fix.error_enu_m = epoch.error_enu_m, fix.horizontal_m = epoch.horizontal_m();
    if (const io::TrajectoryRow* row = detail::row_of(epoch, rows)) {
      fix.sigma_m = horizontal_semi_axis_m(*row), fix.n_sat = row->n_sat, fix.n_dd = row->n_dd, fix.success_rate = row->success_rate;
      fix.is_admitted = horizontal_nees(*row, epoch.error_enu_m) <= limit;
      if (ratios.size() == rows.size()) fix.ratio = ratios[epoch.row];
    }
    const bool follows =
        !list.empty() && list.back().epoch + 1 == i && seconds_between(list.back().time, fix.time) <= 1.5 * evaluation.step_s;
    if (!list.empty()) fix.event = list.back().event + (follows ? 0 : 1);
    detail::find_cause(evaluation, fix);
    list.push_back(fix);
  }
  return list;
}

/// Number of events.
[[nodiscard]] inline std::size_t events_of(const std::vector<WrongFix>& fixes) { return fixes.empty() ? 0 : fixes.back().event + 1; }

/// How many of each cause.
[[nodiscard]] inline std::array<std::size_t, kWrongFixCauses> causes_of(const std::vector<WrongFix>& fixes) {
  std::array<std::size_t, kWrongFixCauses> counts{};
  for (const WrongFix& fix : fixes) ++counts[static_cast<std::size_t>(fix.cause)];
  return counts;
}

}  // namespace searvins::examples
