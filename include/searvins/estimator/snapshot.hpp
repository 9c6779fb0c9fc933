// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Where a new epoch probably is: a robust position from its own differences, the start of the window's Gauss-Newton.
///
/// DCS is redescending: a phase that is predicted 20 cm off with a sigma of 1 cm has weight zero, and a solver that starts there leaves it at zero. The
/// start is therefore found by graduated non-convexity [Blake & Zisserman; Yang et al. 2020]: every row keeps one robust weight
///
///     w(z^2) = (s / (s + z^2))^2            Geman-McClure, s shrinking from the largest z^2 of the epoch to 4
///
/// and per group the common part (clocks, pivot error) is a free unknown, so that no satellite is special. With u_i = d h_i / d p, information
/// k_i = w_i / sigma_i^2 and k-weighted group means (bar), one step solves
///
///     (P^-1 + sum k_i (u_i - u_bar)(u_i - u_bar)') dp = P^-1 (p0 - p) + sum k_i (u_i - u_bar)(r_i - r_bar),     r_i = z_i - h_i(p) - lambda N_i
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::estimator {

/// One undifferenced row: z = range + common part of its group + noise.
struct SnapshotRow {
  Eigen::Vector3d satellite_e_m{Eigen::Vector3d::Zero()};
  double z_m{0};          ///< corrected code, or phase minus wavelength times ambiguity
  double variance_m2{1};
  std::uint16_t group{0};  ///< rows of a group are consecutive
};

/// Rows of one epoch and the prediction they start from.
template <std::size_t MaxRows>
struct Snapshot {
  using Scalar = math::DeferredFor<double, MaxRows>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  StaticVector<SnapshotRow, MaxRows> rows{};
  Vector3 predicted_e_m{Vector3::Zero()};
  double predicted_sigma_m{100};

  /// The robust position, ECEF; the prediction when the rows do not determine one.
  [[nodiscard]] Vector3 solve() const {
    Vector3 p = predicted_e_m;
    double s = largest_square(p);
    while (true) {
      for (int i = 0; i < 2; ++i)
        if (!step(p, s)) return predicted_e_m;
      if (s <= 4) break;
      s = std::max(4.0, s / 3);
    }
    return (void)step(p, s), p;
  }

 private:
  struct GroupMeans {
    Vector3 u{Vector3::Zero()};
    double r{0}, k{0};
  };

  /// fn(first, last) over the groups.
  template <class Fn>
  void for_each_group(Fn fn) const {
    for (std::size_t first = 0; first < rows.size();) {
      std::size_t last = first;
      while (last < rows.size() && rows[last].group == rows[first].group) ++last;
      fn(first, last);
      first = last;
    }
  }

  /// The middle residual of a group: its common part, whatever up to half of the rows say.
  [[nodiscard]] double median_residual(const Vector3& p, std::size_t first, std::size_t last) const {
    StaticVector<double, MaxRows> r;
    for (std::size_t i = first; i < last; ++i) (void)r.push_back(rows[i].z_m - gnss::range_m(p, rows[i].satellite_e_m));
    std::nth_element(r.begin(), r.begin() + static_cast<std::ptrdiff_t>(r.size() / 2), r.end());
    return r[r.size() / 2];
  }

  [[nodiscard]] double largest_square(const Vector3& p) const {
    double largest = 4;
    for_each_group([&](std::size_t first, std::size_t last) {
      const double common = median_residual(p, first, last);
      for (std::size_t i = first; i < last; ++i) {
        const double r = rows[i].z_m - gnss::range_m(p, rows[i].satellite_e_m) - common;
        largest = std::max(largest, r * r / rows[i].variance_m2);
      }
    });
    return largest;
  }

  [[nodiscard]] bool step(Vector3& p, double s) const {
    const double information = 1 / (predicted_sigma_m * predicted_sigma_m);
    Matrix3 A = Matrix3::Identity() * information;
    Vector3 b = information * (predicted_e_m - p);
    for_each_group([&](std::size_t first, std::size_t last) {
      double common = median_residual(p, first, last);
      GroupMeans mean;
      for (int pass = 0; pass < 2; ++pass) {  // weights around the median, then around the weighted mean
        mean = {};
        for (std::size_t i = first; i < last; ++i) accumulate(rows[i], p, s, common, mean);
        if (mean.k <= 0) return;
        mean.u /= mean.k, mean.r /= mean.k;
        if (pass == 0) common = mean.r;
      }
      for (std::size_t i = first; i < last; ++i) {
        Vector3 u;
        const double r = rows[i].z_m - gnss::range_m(p, rows[i].satellite_e_m, &u);
        const double k = weight(rows[i], r - common, s);
        A += k * (u - mean.u) * (u - mean.u).transpose();
        b += k * (r - mean.r) * (u - mean.u);
      }
    });
    const Vector3 reference = A.diagonal();
    if (!math::partial_cholesky(A.data(), 3, 3, 3, reference.data()).ok()) return false;
    math::solve_lower(A.data(), 3, 3, b.data());
    math::solve_lower_transposed(A.data(), 3, 3, b.data());
    p += b;
    return p.allFinite();
  }

  [[nodiscard]] static double weight(const SnapshotRow& row, double r, double s) {
    const double shape = s / (s + r * r / row.variance_m2);
    return shape * shape / row.variance_m2;
  }
  static void accumulate(const SnapshotRow& row, const Vector3& p, double s, double common, GroupMeans& mean) {
    Vector3 u;
    const double r = row.z_m - gnss::range_m(p, row.satellite_e_m, &u);
    const double k = weight(row, r - common, s);
    mean.u += k * u, mean.r += k * r, mean.k += k;
  }
};

}  // namespace searvins::estimator
