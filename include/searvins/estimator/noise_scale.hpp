// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// How much noisier (or quieter) than assumed a pair of receivers is, learned from the residuals of each epoch.
///
/// Whitened residuals e of n rows, of which an adjustment with p parameters has used up p, satisfy  E sum e^2 = n - p  when the assumed variances
/// are right, so one row has a variance of (n - p) / n on average. The median of e^2 is then 0.4549 (n - p) / n (chi-square, one degree of
/// freedom), and reflected signals, as long as they are fewer than half, do not move it. With variances that are wrong by a factor s^2,
///
///     s^2 = s_used^2  median(e^2) / 0.4549  n / (n - p)
///
/// averaged over epochs: the n-th counts 1 / n, but none less than 1 / memory.
#pragma once

#include <algorithm>
#include <cstddef>

#include <searvins/core/static_vector.hpp>

namespace searvins::estimator {

/// Settings of the adaptation of one observable's noise.
struct NoiseAdaptation {
  bool on{true};
  double min_scale{1}, max_scale{2};  ///< bounds of s, the factor on sigma
  int memory_epochs{30};              ///< over which s^2 is averaged
};

/// See the file comment. MaxRows: residuals of one epoch; more are left out.
template <std::size_t MaxRows>
class NoiseScale {
 public:
  /// s^2: what the assumed variances are to be multiplied by.
  [[nodiscard]] double variance_factor() const { return factor_; }

  /// Starts the residuals of an epoch, which were whitened with variance_factor() included.
  void begin() {
    squares_.clear();
    parameters_ = 0;
  }
  /// A whitened residual.
  void add(double e) { (void)squares_.push_back(e * e); }
  /// Parameters that this epoch's residuals had to determine.
  void add_parameters(int count) { parameters_ += count; }

  /// Takes the epoch in. With a redundancy n - p below kMinRedundancy it says too little and is passed over.
  void finish(const NoiseAdaptation& options) {
    const int n = static_cast<int>(squares_.size()), redundancy = n - parameters_;
    if (!options.on || redundancy < kMinRedundancy) return;
    const auto middle = squares_.begin() + (n - 1) / 2;
    std::nth_element(squares_.begin(), middle, squares_.end());
    const double seen = factor_ * *middle / kMedianOfChiSquare1 * n / redundancy;
    const double low = options.min_scale * options.min_scale, high = options.max_scale * options.max_scale;
    epochs_ = std::min(epochs_ + 1, std::max(1, options.memory_epochs));
    factor_ += (std::clamp(seen, low, high) - factor_) / epochs_;
  }

 private:
  static constexpr int kMinRedundancy = 4;
  static constexpr double kMedianOfChiSquare1 = 0.454936423119572;

  StaticVector<double, MaxRows> squares_{};
  int parameters_{0}, epochs_{0};
  double factor_{1};
};

}  // namespace searvins::estimator
