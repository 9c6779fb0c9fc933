// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scores a trajectory against a truth by the paper's rules (formats.md, "Scoring"). No alignment of any kind.
///
///     evaluation epochs   truth rows whose second of week is a multiple of the step S within 0.1 ms, between start and end
///     estimate of one     the row nearest in time within S/2; of two equally near the later
///     its error           at the row's own time, against truth interpolated linearly in ECEF; east-north-up at that truth
///     horizontal, 3-D     norm of east and north; Euclidean norm
///     availability        share of evaluation epochs with an estimate
///     < 1.0 m, < 1.5 m    shares of *all* evaluation epochs: a missing estimate is a failure
///     RMSE, max, P95      over epochs with an error; P95 interpolates linearly between order statistics, rank 0.95 (n - 1)
///     fixed table         epochs whose status is `fix`; their rate is over all epochs, `< 0.5 m` over the fixed ones
///     NEES                e' P^-1 e with the row's ENU covariance, 3 degrees of freedom: 3 on average when P is honest
///
/// A static truth has no rows: its evaluation epochs are the multiples of S from the first to the last row of the trajectory (or from
/// start to end). An estimate whose time no truth neighbours enclose has no error: it counts as available, and as not below any limit.
///
/// Tools that score row by row (one score an estimate instead of one an evaluation epoch, nearest-rank percentiles, 0.10 m as the
/// limit of a wrong fix) agree on RMSE and maxima wherever every row has its evaluation epoch; their P95 is an order statistic
/// next to ours.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/io/trajectory.hpp>

#include "examples/support/truth.hpp"

namespace searvins::examples {

/// What is scored.
struct EvaluationOptions {
  double step_s{1};
  std::optional<double> start_sow, end_sow;  ///< inclusive; seconds of week of the truth's first row's week
  TruthLimits limits{};
};

/// One evaluation epoch.
struct ScoredEpoch {
  GpsTime time{};         ///< of the evaluation epoch
  bool available{false};  ///< a row lies within S/2
  std::size_t row{0};     ///< that row; meaningless when not available
  io::SolutionStatus status{io::SolutionStatus::dr};
  Eigen::Vector3d error_enu_m{Eigen::Vector3d::Constant(io::kUnknown)};  ///< estimate minus truth; NaN: no error
  double nees{io::kUnknown};                                             ///< NaN: no covariance, or no positive definite one

  [[nodiscard]] bool has_error() const { return error_enu_m.allFinite(); }
  [[nodiscard]] double horizontal_m() const { return std::hypot(error_enu_m.x(), error_enu_m.y()); }
  [[nodiscard]] double spatial_m() const { return error_enu_m.norm(); }
};

/// RMSE, maximum and 95th percentile of a set of errors, metres; NaN when the set is empty.
struct ErrorFigures {
  double rmse_m{io::kUnknown}, max_m{io::kUnknown}, p50_m{io::kUnknown}, p95_m{io::kUnknown};
};

/// The scores of one trajectory.
struct Evaluation {
  std::vector<ScoredEpoch> epochs;
  std::size_t available{0}, with_error{0};
  double availability_pct{0}, below_1p0_pct{0}, below_1p5_pct{0};
  ErrorFigures horizontal{}, spatial{}, vertical{};

  std::array<std::size_t, io::kSolutionStatuses> by_status{};  ///< available epochs of each status
  std::size_t fixed{0}, wrong_fixes{0};                        ///< wrong: horizontal error of 0.5 m or more, or no error known
  double fix_rate_pct{0}, fixed_below_0p5_pct{io::kUnknown};
  ErrorFigures fixed_horizontal{};

  std::size_t with_nees{0};
  double mean_nees{io::kUnknown}, nees_within_95_pct{io::kUnknown};  ///< share of NEES below 7.815 (chi-square, 3, 95 %)

  double step_s{1};  ///< between evaluation epochs, as asked for
};

inline constexpr double kWrongFixM = 0.5;
inline constexpr double kChiSquare3At95 = 7.814727903251179;

/// Percentile, linear between order statistics at rank p (n - 1); NaN for an empty set. p in 0..1.
[[nodiscard]] inline double percentile(std::vector<double> values, double p) {
  if (values.empty()) return io::kUnknown;
  std::sort(values.begin(), values.end());
  const double rank = p * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(rank);
  const double u = rank - static_cast<double>(low);
  return low + 1 < values.size() ? (1 - u) * values[low] + u * values[low + 1] : values[low];
}

/// RMSE, maximum and percentiles of errors.
[[nodiscard]] inline ErrorFigures figures_of(const std::vector<double>& errors_m) {
  if (errors_m.empty()) return {};
  double sum = 0;
  for (const double e : errors_m) sum += e * e;
  return {std::sqrt(sum / static_cast<double>(errors_m.size())), *std::max_element(errors_m.begin(), errors_m.end()),
          percentile(errors_m, 0.5), percentile(errors_m, 0.95)};
}

namespace detail {

inline constexpr std::int64_t kGridToleranceNs = 100'000;

/// The multiple of the step nearest to a time, in its week.
[[nodiscard]] inline GpsTime nearest_multiple(GpsTime t, double step_s) {
  return GpsTime{t.week() * kNanosecondsPerWeek + nanoseconds_from_seconds(std::round(t.sow() / step_s) * step_s)};
}

/// Evaluation epochs of a moving truth: its own rows. Those of a static one: the multiples of the step along the trajectory.
[[nodiscard]] inline std::vector<GpsTime> evaluation_epochs(const TruthTrack& truth, const std::vector<io::TrajectoryRow>& rows,
                                                            const EvaluationOptions& options) {
  const GpsTime first = truth.is_static ? rows.front().time : truth.points.front().time;
  const auto bound = [&first](const std::optional<double>& sow, GpsTime otherwise) {
    return sow ? GpsTime::from_week_sow(first.week(), *sow) : otherwise;
  };
  const GpsTime last = truth.is_static ? rows.back().time : truth.points.back().time;
  std::vector<GpsTime> epochs;
  if (truth.is_static) {
    const std::int64_t step_ns = nanoseconds_from_seconds(options.step_s);
    const GpsTime start = nearest_multiple(bound(options.start_sow, first), options.step_s),
                  end = nearest_multiple(bound(options.end_sow, last), options.step_s);
    for (GpsTime t = start; t <= end; t.ns += step_ns) epochs.push_back(t);
    return epochs;
  }
  const GpsTime start = bound(options.start_sow, first), end = bound(options.end_sow, last);
  for (const TruthPoint& point : truth.points) {
    if (point.time.ns < start.ns - kGridToleranceNs || point.time.ns > end.ns + kGridToleranceNs) continue;
    if (std::abs(point.time.ns - nearest_multiple(point.time, options.step_s).ns) <= kGridToleranceNs) epochs.push_back(point.time);
  }
  return epochs;
}

/// Index of the row nearest to a time within half a step; the later of two equally near ones.
[[nodiscard]] inline std::optional<std::size_t> nearest_row(const std::vector<io::TrajectoryRow>& rows, GpsTime t,
                                                            std::int64_t half_step_ns) {
  const auto after =
      std::lower_bound(rows.begin(), rows.end(), t, [](const io::TrajectoryRow& row, GpsTime time) { return row.time < time; });
  std::optional<std::size_t> best;
  std::int64_t best_ns = half_step_ns;
  if (after != rows.begin() && t.ns - std::prev(after)->time.ns <= best_ns) {
    best = static_cast<std::size_t>(std::prev(after) - rows.begin());
    best_ns = t.ns - std::prev(after)->time.ns;
  }
  if (after != rows.end() && after->time.ns - t.ns <= best_ns) best = static_cast<std::size_t>(after - rows.begin());
  return best;
}

inline void score_row(const io::TrajectoryRow& row, const TruthTrack& truth, const TruthLimits& limits, ScoredEpoch& epoch) {
  const std::optional<Eigen::Vector3d> truth_e_m = truth_at(truth, row.time, limits);
  if (!truth_e_m) return;
  const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(*truth_e_m));
  epoch.error_enu_m = R_ew.transpose() * (row.p_e_m - *truth_e_m);
  const Eigen::Matrix3d P = row.covariance_enu_m2();
  if (!P.allFinite()) return;
  const Eigen::LLT<Eigen::Matrix3d> factor{P};
  if (factor.info() == Eigen::Success) epoch.nees = epoch.error_enu_m.dot(factor.solve(epoch.error_enu_m));
}

/// 100 part / whole.
[[nodiscard]] inline double share_pct(std::size_t part, std::size_t whole) {
  return whole ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : io::kUnknown;
}

inline void summarize(Evaluation& evaluation) {
  std::vector<double> horizontal, spatial, vertical, fixed_horizontal;
  std::size_t below_1p0 = 0, below_1p5 = 0, nees_within = 0;
  double nees_sum = 0;
  for (const ScoredEpoch& epoch : evaluation.epochs) {
    if (!epoch.available) continue;
    ++evaluation.available;
    ++evaluation.by_status[static_cast<std::size_t>(epoch.status)];
    const bool is_fix = epoch.status == io::SolutionStatus::fix;
    const double h = epoch.horizontal_m();
    if (is_fix) ++evaluation.fixed, evaluation.wrong_fixes += !(h < kWrongFixM);
    if (!epoch.has_error()) continue;
    ++evaluation.with_error;
    horizontal.push_back(h), spatial.push_back(epoch.spatial_m()), vertical.push_back(std::abs(epoch.error_enu_m.z()));
    below_1p0 += h < 1.0, below_1p5 += h < 1.5;
    if (is_fix) fixed_horizontal.push_back(h);
    if (std::isfinite(epoch.nees)) ++evaluation.with_nees, nees_sum += epoch.nees, nees_within += epoch.nees < kChiSquare3At95;
  }
  const std::size_t n = evaluation.epochs.size();
  evaluation.availability_pct = share_pct(evaluation.available, n);
  evaluation.below_1p0_pct = share_pct(below_1p0, n), evaluation.below_1p5_pct = share_pct(below_1p5, n);
  evaluation.horizontal = figures_of(horizontal), evaluation.spatial = figures_of(spatial), evaluation.vertical = figures_of(vertical);
  evaluation.fix_rate_pct = share_pct(evaluation.fixed, n);
  evaluation.fixed_below_0p5_pct = share_pct(evaluation.fixed - evaluation.wrong_fixes, evaluation.fixed);
  evaluation.fixed_horizontal = figures_of(fixed_horizontal);
  if (evaluation.with_nees) evaluation.mean_nees = nees_sum / static_cast<double>(evaluation.with_nees);
  evaluation.nees_within_95_pct = share_pct(nees_within, evaluation.with_nees);
}

}  // namespace detail

/// Scores rows (rising in time) against a truth. No evaluation epoch at all is an error.
[[nodiscard]] inline io::FileResult<Evaluation> evaluate(const TruthTrack& truth, const std::vector<io::TrajectoryRow>& rows,
                                                         const EvaluationOptions& options = {}) {
  if (truth.points.empty() || rows.empty()) return io::Diagnostic{{}, 0, "nothing to score: the truth or the trajectory is empty", {}};
  Evaluation evaluation;
  evaluation.step_s = options.step_s;
  const std::int64_t half_step_ns = nanoseconds_from_seconds(options.step_s) / 2;
  for (const GpsTime t : detail::evaluation_epochs(truth, rows, options)) {
    ScoredEpoch& epoch = evaluation.epochs.emplace_back();
    epoch.time = t;
    const std::optional<std::size_t> row = detail::nearest_row(rows, t, half_step_ns);
    if (!row) continue;
    epoch.available = true, epoch.row = *row, epoch.status = rows[*row].status;
    detail::score_row(rows[*row], truth, options.limits, epoch);
  }
  if (evaluation.epochs.empty())
    return io::Diagnostic{{},
                          0,
                          "no truth row lies on a multiple of " + io::fixed_text(options.step_s, 3) + " s between start and end",
                          "change --step, --start or --end"};
  detail::summarize(evaluation);
  return evaluation;
}

}  // namespace searvins::examples
