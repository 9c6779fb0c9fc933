// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How far a trajectory's own covariance may be trusted: bounds on the error at a stated risk, what the errors do against them, and for how
/// long an error stays above a limit.
///
/// Bounds. With the row's ENU covariance P and its horizontal block P_h,
///
///     horizontal  B_h = k_h sqrt(lambda_max(P_h))     k_h = sqrt(-2 ln r)          5.68 at r = 1e-7
///     vertical    B_v = k_v sigma_up                  k_v = Phi^-1(1 - r/2)        5.33 at r = 1e-7
///
/// For a Gaussian error of covariance P_h, |e_h|^2 <= lambda_max e_h' P_h^-1 e_h, whose last factor is chi-square with 2 degrees of freedom
/// and exceeds -2 ln r with probability r. So |e_h| exceeds B_h with probability r where P_h is round, and less often where it is long. k_v
/// is the two-sided normal quantile, so the vertical risk is r exactly. r is per epoch: successive errors are alike, and the risk per hour
/// is another figure.
///
/// Three sigma. Per axis |e_i| > 3 sigma_i; horizontal and in space the ellipse and the ellipsoid that hold as much probability as three
/// sigmas of one axis: e' P^-1 e above the chi-square threshold of 0.27 %, 11.83 with 2 and 14.16 with 3 degrees of freedom. 0.27 % is
/// expected of each.
///
/// Stanford diagram. The plane of error e and bound B, with an alert limit A (the largest error that the application bears):
///
///     nominal                  e <= B <= A          the system may be used, and rightly
///     unavailable              e <= B, B > A        it says itself that it may not
///     misleading               B < e <= A           the bound was wrong, without harm
///     misleading, unavailable  e > B > A            the bound was wrong, and nobody relied on it
///     hazardous                B <= A < e           it said yes and was beyond the limit
///
/// Stretches. Successive evaluation epochs of one property; a hole in the truth (more than one and a half steps) ends one. "Above 1.0 m" is
/// where the share below 1.0 m does not count an epoch: an error of 1.0 m or more, or no estimate. So the epochs of all stretches above a
/// limit and the epochs below it are all epochs.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/trajectory.hpp>
#include <searvins/math/quantiles.hpp>

#include "examples/support/evaluation.hpp"

namespace searvins::examples {

/// What the bounds are to hold for.
struct IntegrityOptions {
  double risk{1e-5};          ///< probability per epoch that the error exceeds the bound; 1e-100 .. 0.5
  double alert_limit_m{1.5};  ///< largest horizontal error that the application bears
};

/// The risks at which covariances are checked, beside the stated one.
inline constexpr std::array kRiskLadder{0.05, 0.01, 1e-3, 1e-5, 1e-7};

/// A probability (or its percentage) as a word of at most six digits: 1e-5, 0.05.
[[nodiscard]] inline std::string risk_text(double risk) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.6g", risk);
  std::string text = buffer;
  if (const std::size_t zero = text.find("e-0"); zero != std::string::npos) text.erase(zero + 2, 1);
  return text;
}

/// k_h of a risk: the bound is k_h times the larger semi-axis of the horizontal 1-sigma ellipse. Risk 0..1.
[[nodiscard]] inline double horizontal_bound_factor(double risk) { return std::sqrt(-2 * std::log(risk)); }

/// k_v of a risk: the bound is k_v times the sigma of the vertical. NaN for a risk outside 2e-100 .. 1.
[[nodiscard]] inline double vertical_bound_factor(double risk) {
  const Result<double> x = math::normal_quantile(risk / 2);
  return x ? -*x : io::kUnknown;
}

/// Larger semi-axis of the horizontal 1-sigma ellipse, metres; NaN without a covariance.
[[nodiscard]] inline double horizontal_semi_axis_m(const io::TrajectoryRow& row) {
  const double a = row.sd_enu_m.x() * row.sd_enu_m.x(), c = row.sd_enu_m.y() * row.sd_enu_m.y();
  return std::sqrt((a + c) / 2 + std::hypot((a - c) / 2, row.cov_en_m2));
}

/// e_h' P_h^-1 e_h: chi-square with 2 degrees of freedom under an honest covariance; NaN without one, or without a positive definite one.
[[nodiscard]] inline double horizontal_nees(const io::TrajectoryRow& row, const Eigen::Vector3d& error_enu_m) {
  const double a = row.sd_enu_m.x() * row.sd_enu_m.x(), b = row.cov_en_m2, c = row.sd_enu_m.y() * row.sd_enu_m.y();
  const double determinant = a * c - b * b, e = error_enu_m.x(), n = error_enu_m.y();
  return determinant > 0 ? (c * e * e - 2 * b * e * n + a * n * n) / determinant : io::kUnknown;
}

/// How many epochs exceed something, of those that could.
struct Exceedance {
  std::size_t epochs{0}, over{0};
  double expected_pct{0};  ///< of an honest covariance; for the horizontal bound: at most

  [[nodiscard]] double share_pct() const { return detail::share_pct(over, epochs); }
  void add(bool is_over) { ++epochs, over += is_over; }
};

/// Successive evaluation epochs that have something in common.
struct Stretch {
  GpsTime from{}, to{};              ///< its first and last epoch
  std::size_t first{0}, epochs{0};   ///< index of its first epoch; how many
  std::size_t without_error{0};      ///< of them without an estimate, or without truth for it
  double length_s{0};                ///< epochs times the step
  double max_error_m{io::kUnknown};  ///< horizontal; NaN: none is known
};

/// All stretches of epochs for which `holds(epoch)`, in the order of time.
template <class Predicate>
[[nodiscard]] std::vector<Stretch> stretches_where(const Evaluation& evaluation, const Predicate& holds) {
  std::vector<Stretch> stretches;
  const double longest_gap_s = 1.5 * evaluation.step_s;
  bool open = false;
  for (std::size_t i = 0; i < evaluation.epochs.size(); ++i) {
    const ScoredEpoch& epoch = evaluation.epochs[i];
    if (!holds(epoch)) {
      open = false;
      continue;
    }
    if (!open || seconds_between(stretches.back().to, epoch.time) > longest_gap_s) {
      stretches.emplace_back();
      stretches.back().from = epoch.time, stretches.back().first = i;
    }
    open = true;
    Stretch& last = stretches.back();
    last.to = epoch.time, ++last.epochs;
    last.length_s = static_cast<double>(last.epochs) * evaluation.step_s;
    if (epoch.has_error())
      last.max_error_m = std::fmax(last.max_error_m, epoch.horizontal_m());
    else
      ++last.without_error;
  }
  return stretches;
}

/// Stretches whose horizontal error is not known to be below a limit.
[[nodiscard]] inline std::vector<Stretch> stretches_above(const Evaluation& evaluation, double limit_m) {
  return stretches_where(evaluation, [limit_m](const ScoredEpoch& e) { return !(e.horizontal_m() < limit_m); });
}

/// The longest stretch; of equally long ones the first. An empty stretch when there is none.
[[nodiscard]] inline Stretch longest_of(const std::vector<Stretch>& stretches) {
  const auto longest =
      std::max_element(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) { return a.epochs < b.epochs; });
  return longest == stretches.end() ? Stretch{} : *longest;
}

/// The bounds of one risk against the errors.
struct BoundCheck {
  double risk{0}, k_horizontal{0}, k_vertical{0};
  Exceedance horizontal{}, vertical{};
  double median_horizontal_m{io::kUnknown}, p95_horizontal_m{io::kUnknown}, median_vertical_m{io::kUnknown};  ///< of the bounds
  double largest_ratio{io::kUnknown};  ///< of horizontal error and bound: what sigmas would have to be multiplied by for no exceedance
  GpsTime largest_ratio_time{};
};

/// Areas of the Stanford diagram.
enum class StanfordArea : std::uint8_t { nominal, unavailable, misleading, misleading_unavailable, hazardous };
inline constexpr std::size_t kStanfordAreas = 5;

/// Its name.
[[nodiscard]] constexpr const char* name_of(StanfordArea area) {
  constexpr const char* names[kStanfordAreas] = {"nominal", "unavailable", "misleading", "misleading, unavailable", "hazardous"};
  return names[static_cast<std::size_t>(area)];
}

/// Where a pair of error and bound lies. Both finite.
[[nodiscard]] constexpr StanfordArea stanford_area(double error_m, double bound_m, double alert_limit_m) {
  if (bound_m > alert_limit_m) return error_m > bound_m ? StanfordArea::misleading_unavailable : StanfordArea::unavailable;
  if (error_m > alert_limit_m) return StanfordArea::hazardous;
  return error_m > bound_m ? StanfordArea::misleading : StanfordArea::nominal;
}

/// What a covariance is worth.
struct Integrity {
  IntegrityOptions options{};
  std::size_t with_bound{0};  ///< epochs with an error and a horizontal covariance
  Exceedance east_3sigma{}, north_3sigma{}, up_3sigma{}, horizontal_3sigma{}, spatial_3sigma{};
  double mean_nees_horizontal{io::kUnknown};  ///< 2 is right
  double sigma_scale{io::kUnknown};           ///< sqrt(mean NEES / 3), in space: sigmas times this fit on average
  BoundCheck stated{};
  std::vector<BoundCheck> ladder{};                               ///< of kRiskLadder
  std::array<std::size_t, kStanfordAreas> areas{};                ///< epochs of each area; they add up to with_bound
  std::vector<Stretch> above_1p0{}, above_1p5{}, beyond_bound{};  ///< beyond: error above the stated horizontal bound

  [[nodiscard]] std::size_t count(StanfordArea area) const { return areas[static_cast<std::size_t>(area)]; }
};

namespace detail {

/// An epoch's row, or nullptr: not available, or rows of another run.
[[nodiscard]] inline const io::TrajectoryRow* row_of(const ScoredEpoch& epoch, const std::vector<io::TrajectoryRow>& rows) {
  return epoch.available && epoch.row < rows.size() ? &rows[epoch.row] : nullptr;
}

[[nodiscard]] inline BoundCheck check_bound(const Evaluation& evaluation, const std::vector<io::TrajectoryRow>& rows, double risk) {
  BoundCheck check;
  check.risk = risk, check.k_horizontal = horizontal_bound_factor(risk), check.k_vertical = vertical_bound_factor(risk);
  check.horizontal.expected_pct = check.vertical.expected_pct = 100 * risk;
  std::vector<double> horizontal_m, vertical_m;
  for (const ScoredEpoch& epoch : evaluation.epochs) {
    const io::TrajectoryRow* row = row_of(epoch, rows);
    if (!row || !epoch.has_error()) continue;
    if (const double bound_m = check.k_horizontal * horizontal_semi_axis_m(*row); std::isfinite(bound_m)) {
      horizontal_m.push_back(bound_m), check.horizontal.add(epoch.horizontal_m() > bound_m);
      const double ratio = epoch.horizontal_m() / bound_m;
      if (!(ratio <= check.largest_ratio)) check.largest_ratio = ratio, check.largest_ratio_time = epoch.time;
    }
    if (const double bound_m = check.k_vertical * row->sd_enu_m.z(); std::isfinite(bound_m))
      vertical_m.push_back(bound_m), check.vertical.add(std::abs(epoch.error_enu_m.z()) > bound_m);
  }
  check.median_horizontal_m = percentile(horizontal_m, 0.5), check.p95_horizontal_m = percentile(horizontal_m, 0.95);
  check.median_vertical_m = percentile(vertical_m, 0.5);
  return check;
}

inline void count_three_sigma(const Evaluation& evaluation, const std::vector<io::TrajectoryRow>& rows, Integrity& integrity) {
  const double tail = math::two_sided_exceedance(3);
  const double limit_2 = math::chi_square_threshold(tail, 2).value(), limit_3 = math::chi_square_threshold(tail, 3).value();
  Exceedance* const axes[3] = {&integrity.east_3sigma, &integrity.north_3sigma, &integrity.up_3sigma};
  for (Exceedance* e : {axes[0], axes[1], axes[2], &integrity.horizontal_3sigma, &integrity.spatial_3sigma}) e->expected_pct = 100 * tail;
  double sum = 0;
  for (const ScoredEpoch& epoch : evaluation.epochs) {
    const io::TrajectoryRow* row = row_of(epoch, rows);
    if (!row || !epoch.has_error()) continue;
    for (int i = 0; i < 3; ++i)
      if (std::isfinite(row->sd_enu_m[i])) axes[i]->add(std::abs(epoch.error_enu_m[i]) > 3 * row->sd_enu_m[i]);
    if (const double nees = horizontal_nees(*row, epoch.error_enu_m); std::isfinite(nees))
      integrity.horizontal_3sigma.add(nees > limit_2), sum += nees;
    if (std::isfinite(epoch.nees)) integrity.spatial_3sigma.add(epoch.nees > limit_3);
  }
  if (integrity.horizontal_3sigma.epochs) integrity.mean_nees_horizontal = sum / static_cast<double>(integrity.horizontal_3sigma.epochs);
  integrity.sigma_scale = std::sqrt(evaluation.mean_nees / 3);
}

}  // namespace detail

/// Horizontal bound of an epoch, metres; NaN where the epoch has no error or no covariance.
[[nodiscard]] inline double horizontal_bound_m(const ScoredEpoch& epoch, const std::vector<io::TrajectoryRow>& rows, double risk) {
  const io::TrajectoryRow* row = detail::row_of(epoch, rows);
  return row && epoch.has_error() ? horizontal_bound_factor(risk) * horizontal_semi_axis_m(*row) : io::kUnknown;
}

/// Assesses a scored run. `rows` are those that were scored.
[[nodiscard]] inline Integrity assess_integrity(const Evaluation& evaluation, const std::vector<io::TrajectoryRow>& rows,
                                                const IntegrityOptions& options = {}) {
  Integrity integrity;
  integrity.options = options;
  detail::count_three_sigma(evaluation, rows, integrity);
  integrity.stated = detail::check_bound(evaluation, rows, options.risk);
  for (const double risk : kRiskLadder) integrity.ladder.push_back(detail::check_bound(evaluation, rows, risk));
  for (const ScoredEpoch& epoch : evaluation.epochs) {
    const double bound_m = horizontal_bound_m(epoch, rows, options.risk);
    if (!std::isfinite(bound_m)) continue;
    ++integrity.with_bound;
    ++integrity.areas[static_cast<std::size_t>(stanford_area(epoch.horizontal_m(), bound_m, options.alert_limit_m))];
  }
  integrity.above_1p0 = stretches_above(evaluation, 1.0), integrity.above_1p5 = stretches_above(evaluation, 1.5);
  integrity.beyond_bound =
      stretches_where(evaluation, [&](const ScoredEpoch& e) { return e.horizontal_m() > horizontal_bound_m(e, rows, options.risk); });
  return integrity;
}

}  // namespace searvins::examples
