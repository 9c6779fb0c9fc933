// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The satellites of the simulator: broadcast orbits and clocks, evaluated anew from the interface documents.
///
/// Nothing of searvins/gnss is used, and where there is a choice the other form is taken, so that one mistake cannot sit in both:
/// Kepler's equation by fixed-point iteration, the true anomaly by the half-angle formula, the frames by composed rotations
///
///     tan(nu / 2) = sqrt((1 + e) / (1 - e)) tan(E / 2)           p_e = Rot_z(node) Rot_x(inclination) r [cos u, sin u, 0]'
///
/// Times are seconds of GPS time since the start of the recording: a double then holds 1e-13 s.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <searvins/core/time.hpp>

#include "random.hpp"

namespace searvins::simulator {

inline constexpr double kLightMps = 299'792'458.0;

/// One broadcast record: angles rad, lengths m, times s.
struct Orbit {
  char system{'G'};  ///< G, E or C
  int number{0};
  GpsTime toe{};  ///< of orbit and clock
  double toe_since_start_s{0};
  double toe_of_week_s{0};  ///< in the system's own week: BDT for C
  double sqrt_a{0}, eccentricity{0}, i0{0}, omega0{0}, omega{0}, m0{0};
  double delta_n{0}, i_dot{0}, omega_dot{0};
  double cuc{0}, cus{0}, crc{0}, crs{0}, cic{0}, cis{0};
  double af0{0}, af1{0};
  double delay_s{0};        ///< TGD; BGD E5b/E1; TGD1
  double other_delay_s{0};  ///< BGD E5a/E1; TGD2
  int issue_shift{0};       ///< records of one satellite differ by it
};

/// Gravity constant of the interface document, m^3/s^2.
[[nodiscard]] inline double gravity_constant(char system) { return system == 'G' ? 3.986005e14 : 3.986004418e14; }
/// Rotation rate of the Earth of the interface document, rad/s.
[[nodiscard]] inline double earth_rate(char system) { return system == 'C' ? 7.292115e-5 : 7.2921151467e-5; }

/// Eccentric anomaly at t.
[[nodiscard]] inline double eccentric_anomaly_at(const Orbit& o, double t_s) {
  const double mean_motion = std::sqrt(gravity_constant(o.system)) / (o.sqrt_a * o.sqrt_a * o.sqrt_a) + o.delta_n;
  const double mean = o.m0 + mean_motion * (t_s - o.toe_since_start_s);
  double anomaly = mean;
  for (int i = 0; i < 20; ++i) anomaly = mean + o.eccentricity * std::sin(anomaly);  // contracts by e < 0.02 a step
  return anomaly;
}

/// Position at t in the ECEF axes of t, metres.
[[nodiscard]] inline Eigen::Vector3d satellite_position_e_m(const Orbit& o, double t_s) {
  const double tk = t_s - o.toe_since_start_s, e = o.eccentricity, E = eccentric_anomaly_at(o, t_s);
  const double nu = 2 * std::atan(std::sqrt((1 + e) / (1 - e)) * std::tan(E / 2));
  const double phi = nu + o.omega, c2 = std::cos(2 * phi), s2 = std::sin(2 * phi);
  const double u = phi + o.cuc * c2 + o.cus * s2;
  const double r = o.sqrt_a * o.sqrt_a * (1 - e * std::cos(E)) + o.crc * c2 + o.crs * s2;
  const double inclination = o.i0 + o.i_dot * tk + o.cic * c2 + o.cis * s2;
  const double rate = earth_rate(o.system);
  const double node = o.omega0 + o.omega_dot * tk - rate * (o.toe_of_week_s + tk);
  const Eigen::Vector3d in_plane{r * std::cos(u), r * std::sin(u), 0};
  return Eigen::AngleAxisd(node, Eigen::Vector3d::UnitZ()) * (Eigen::AngleAxisd(inclination, Eigen::Vector3d::UnitX()) * in_plane);
}

/// Satellite clock ahead of GPS time at t, with the periodic relativistic term -2 r'v / c^2 = -2 sqrt(mu a) e sin E / c^2; group delay not.
[[nodiscard]] inline double satellite_clock_s(const Orbit& o, double t_s) {
  const double relativity = -2 * std::sqrt(gravity_constant(o.system)) * o.sqrt_a * o.eccentricity *
                            std::sin(eccentric_anomaly_at(o, t_s)) / (kLightMps * kLightMps);
  return o.af0 + o.af1 * (t_s - o.toe_since_start_s) + relativity;
}

/// A number with the thirteen digits of a RINEX navigation file: the simulated satellites fly exactly what is written.
[[nodiscard]] inline double as_written(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12E", value);
  return std::strtod(text, nullptr);
}

/// The same orbit and clock with a reference time that lies `later_s` seconds later.
[[nodiscard]] inline Orbit later_record(const Orbit& orbit, double later_s) {
  const auto angle = [](double a) { return as_written(std::remainder(a, 2 * std::numbers::pi)); };
  Orbit o = orbit;
  const double motion = std::sqrt(gravity_constant(o.system)) / (o.sqrt_a * o.sqrt_a * o.sqrt_a) + o.delta_n;
  o.toe = o.toe.plus_seconds(later_s), o.toe_since_start_s += later_s;
  o.toe_of_week_s = std::fmod(o.toe_of_week_s + later_s, 604'800.0);
  o.m0 = angle(o.m0 + motion * later_s);
  o.omega0 = angle(o.omega0 + o.omega_dot * later_s - earth_rate(o.system) * (orbit.toe_of_week_s + later_s - o.toe_of_week_s));
  o.i0 = as_written(o.i0 + o.i_dot * later_s);
  o.af0 = as_written(o.af0 + o.af1 * later_s);
  ++o.issue_shift;
  return o;
}

/// Planes, slots and size of a constellation.
struct ConstellationPlan {
  char system;
  int first_number, planes, slots;
  double sqrt_a, inclination_deg, largest_eccentricity, phasing_deg, toe_after_start_s;
};

/// 30 GPS, 24 Galileo and 18 BeiDou MEO satellites; the phasing is between neighbouring planes.
inline constexpr ConstellationPlan kConstellationPlans[] = {{'G', 1, 6, 5, 5153.65, 55.4, 0.015, 35, -1200},
                                                            {'E', 1, 3, 8, 5440.60, 56.2, 0.0004, 15, -600},
                                                            {'C', 19, 3, 6, 5282.62, 55.0, 0.001, 20, -1186}};

/// Satellites in evenly filled planes, each a little off its slot, with the small perturbations and clocks that are usual.
[[nodiscard]] inline std::vector<Orbit> make_satellites(GpsTime start, Random& random) {
  constexpr double deg = std::numbers::pi / 180, pi = std::numbers::pi;
  std::vector<Orbit> all;
  for (const ConstellationPlan& plan : kConstellationPlans) {
    const double first_node = random.uniform(-pi, pi);
    for (int k = 0; k < plan.planes * plan.slots; ++k) {
      const int plane = k % plan.planes, slot = k / plan.planes;
      const auto around = [&random](double size) { return as_written(random.uniform(-size, size)); };
      const auto angle = [](double a) { return as_written(std::remainder(a, 2 * std::numbers::pi)); };
      Orbit o;
      o.system = plan.system, o.number = plan.first_number + k;
      o.toe_since_start_s = plan.toe_after_start_s;
      o.toe = start.plus_seconds(plan.toe_after_start_s);
      o.toe_of_week_s = GpsTime{o.toe.ns - (o.system == 'C' ? kBeidouLagSeconds * kNanosecondsPerSecond : 0)}.sow();
      o.sqrt_a = as_written(plan.sqrt_a + random.uniform(-0.05, 0.05));
      o.eccentricity = as_written(random.uniform(0.1, 1) * plan.largest_eccentricity);
      o.i0 = as_written((plan.inclination_deg + random.uniform(-0.8, 0.8)) * deg);
      o.omega0 = angle(first_node + plane * 2 * pi / plan.planes + random.uniform(-2, 2) * deg);
      o.omega = angle(random.uniform(-pi, pi));
      o.m0 = angle(slot * 2 * pi / plan.slots + plane * plan.phasing_deg * deg + random.uniform(-6, 6) * deg - o.omega);
      o.delta_n = as_written(random.uniform(3e-9, 5e-9));
      o.omega_dot = as_written(random.uniform(-8.5e-9, -5.5e-9));
      o.i_dot = around(3e-10);
      o.cuc = around(6e-6), o.cus = around(9e-6), o.cic = around(2e-7), o.cis = around(2e-7);
      o.crc = around(300), o.crs = around(120);
      o.af0 = around(5e-4), o.af1 = around(8e-12);
      o.delay_s = around(1e-8), o.other_delay_s = o.system == 'G' ? 0.0 : around(1e-8);
      all.push_back(o);
    }
  }
  return all;
}

}  // namespace searvins::simulator
