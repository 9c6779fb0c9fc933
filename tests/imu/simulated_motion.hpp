// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Smooth random motions and what an ideal inertial unit reads on them. The readings are analytic (sums of waves, so that their means are
/// exact too); the motion follows from them by Runge-Kutta integration of the strapdown equations in ECEF, which share no code with the
/// library but gravity:
///
///     dR_eb/dt = R_eb [gyro]x - [omega_e]x R_eb        dv_e/dt = R_eb f + g_e(p_e) - 2 omega_e x v_e        dp_e/dt = v_e
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/navigation_state.hpp>

#include "support/property.hpp"

namespace searvins::test {

/// A constant and three waves.
struct WaveSignal {
  Eigen::Vector3d constant = Eigen::Vector3d::Zero();
  struct Wave {
    Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();
    double rate_radps{1}, phase_rad{0};
  };
  std::array<Wave, 3> waves{};

  [[nodiscard]] Eigen::Vector3d at(double t) const {
    Eigen::Vector3d x = constant;
    for (const Wave& w : waves) x += std::sin(w.rate_radps * t + w.phase_rad) * w.amplitude;
    return x;
  }
  [[nodiscard]] Eigen::Vector3d mean(double t0, double t1) const {
    Eigen::Vector3d x = constant;
    for (const Wave& w : waves)
      x += (std::cos(w.rate_radps * t0 + w.phase_rad) - std::cos(w.rate_radps * t1 + w.phase_rad)) / (w.rate_radps * (t1 - t0)) *
           w.amplitude;
    return x;
  }
  [[nodiscard]] static WaveSignal random(Rng& rng, const Eigen::Vector3d& constant, double size, double max_hz) {
    WaveSignal s;
    s.constant = constant;
    for (Wave& w : s.waves)
      w = {random_vector<3>(rng, size / 3), 2 * std::numbers::pi * uniform(rng, 0.1, 1) * max_hz, uniform(rng, 0, 2 * std::numbers::pi)};
    return s;
  }
};

/// Readings of an ideal unit over a motion; t in seconds since `epoch`.
struct SimulatedMotion {
  GpsTime epoch{1'300'000'000'000'000'000};
  geodesy::LocalFrame frame{};
  imu::NavigationState begin{};  ///< at t = 0
  WaveSignal gyro_b_radps{}, accel_b_mps2{};
  double earth_rate_radps{geodesy::kEarthRateRadps};

  [[nodiscard]] GpsTime time(double t) const { return epoch.plus_seconds(t); }
  [[nodiscard]] imu::ImuSample sample(double t) const { return {time(t), gyro_b_radps.at(t), accel_b_mps2.at(t)}; }
  [[nodiscard]] imu::ImuSample mean_sample(double before, double t) const {
    return {time(t), gyro_b_radps.mean(before, t), accel_b_mps2.mean(before, t)};
  }

  /// Samples at the given times. The mean of the first is over the millisecond before it.
  [[nodiscard]] std::vector<imu::ImuSample> samples(const std::vector<double>& times, imu::SampleKind kind) const {
    std::vector<imu::ImuSample> list;
    for (std::size_t k = 0; k < times.size(); ++k)
      list.push_back(kind == imu::SampleKind::instantaneous ? sample(times[k])
                                                            : mean_sample(k > 0 ? times[k - 1] : times[k] - 1e-3, times[k]));
    return list;
  }

  /// The state at t, by steps of at most half a millisecond.
  [[nodiscard]] imu::NavigationState truth(double t) const {
    const Eigen::Vector3d omega{0, 0, earth_rate_radps};
    struct Motion {
      Eigen::Matrix3d R;
      Eigen::Vector3d p, v;
      Motion plus(const Motion& d, double h) const { return {R + h * d.R, p + h * d.p, v + h * d.v}; }
    };
    const auto slope = [&](const Motion& x, double at) -> Motion {
      Eigen::Matrix3d R;
      const Eigen::Vector3d w = gyro_b_radps.at(at), f = x.R * accel_b_mps2.at(at);
      for (int c = 0; c < 3; ++c) R.col(c) = x.R * w.cross(Eigen::Vector3d::Unit(c)) - omega.cross(x.R.col(c));
      return {R, x.v, f + geodesy::gravity_e_mps2(x.p) - 2 * omega.cross(x.v)};
    };
    Motion x{frame.R_ew * begin.R_wb, frame.to_ecef(begin.p_wb_m), frame.R_ew * begin.v_wb_mps};
    const int steps = std::max(1, static_cast<int>(std::ceil(t / 5e-4)));
    const double h = t / steps;
    for (int i = 0; i < steps; ++i) {
      const double at = t * i / steps;
      const Motion a = slope(x, at), b = slope(x.plus(a, h / 2), at + h / 2), c = slope(x.plus(b, h / 2), at + h / 2),
                   d = slope(x.plus(c, h), at + h);
      x = x.plus(a, h / 6).plus(b, h / 3).plus(c, h / 3).plus(d, h / 6);
    }
    imu::NavigationState y = begin;
    y.R_wb = frame.R_ew.transpose() * x.R;
    y.p_wb_m = frame.to_local(x.p);
    y.v_wb_mps = frame.R_ew.transpose() * x.v;
    return y;
  }

  /// Anywhere on Earth, some way from the origin of w, level but for 0.1 rad, turning and accelerating like a hard-driven car.
  [[nodiscard]] static SimulatedMotion random(Rng& rng, double speed_mps = 30, double way_m = 2e4) {
    SimulatedMotion m;
    const geodesy::Geodetic place{uniform(rng, -1.5, 1.5), uniform(rng, -3.1, 3.1), uniform(rng, -100, 3000)};
    m.frame = geodesy::LocalFrame::at(geodesy::ecef_from_geodetic(place));
    m.begin.p_wb_m = random_vector<3>(rng, way_m).cwiseProduct(Eigen::Vector3d{1, 1, 0.02});
    m.begin.v_wb_mps = random_vector<3>(rng, speed_mps).cwiseProduct(Eigen::Vector3d{1, 1, 0.05});
    m.begin.R_wb = so3::exp(Eigen::Vector3d{0, 0, uniform(rng, -3.1, 3.1)}) * so3::exp(random_vector<3>(rng, 0.1));
    m.gyro_b_radps = WaveSignal::random(rng, random_vector<3>(rng, 0.2), 1.0, 1.0);
    m.accel_b_mps2 = WaveSignal::random(rng, Eigen::Vector3d{0, 0, 9.8}, 4.0, 1.0);
    return m;
  }
};

/// 0, 1/rate, ... up to `end` and one more.
inline std::vector<double> uniform_times(double end, double rate_hz) {
  std::vector<double> t;
  for (int k = 0; k <= static_cast<int>(std::ceil(end * rate_hz - 1e-9)); ++k) t.push_back(k / rate_hz);
  return t;
}

/// From 0 to at least `end` in steps that vary by a factor of nine around 1/rate.
inline std::vector<double> random_times(Rng& rng, double end, double rate_hz) {
  std::vector<double> t{0};
  while (t.back() < end) t.push_back(t.back() + std::pow(3.0, uniform(rng, -1, 1)) / rate_hz);
  return t;
}

}  // namespace searvins::test
