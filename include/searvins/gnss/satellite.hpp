// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Position, velocity and clock of a satellite from its broadcast ephemeris [IS-GPS-200, IS-QZSS-PNT, Galileo OS SIS ICD, BDS-SIS-ICD-B1I].
///
/// With t_k the time since toe, Kepler's equation M = E - e sin E gives the eccentric anomaly; its rate and everything below is
/// differentiated along, so that the velocity is analytic:
///
///     phi = atan2(sqrt(1-e^2) sin E, cos E - e) + omega          argument of latitude, phi' = sqrt(1-e^2) E' / (1 - e cos E)
///     u   = phi + cus sin 2phi + cuc cos 2phi
///     r   = a (1 - e cos E) + crs sin 2phi + crc cos 2phi
///     i   = i0 + i' t_k + cis sin 2phi + cic cos 2phi
///     L   = omega0 + (omega0' - omega_e) t_k - omega_e toe        longitude of the ascending node in ECEF axes at t
///     p   = [x cos L - y cos i sin L, x sin L + y cos i cos L, y sin i],   x = r cos u, y = r sin u
///
/// BeiDou's geostationary satellites (D2) describe the orbit in a frame that does not turn with the Earth during t_k (the term
/// omega_e t_k is absent from L) and is tilted by 5 degrees: p = Rz(omega_e t_k) Rx(-5 deg) p_tilted.
///
/// Clock: af0 + af1 dt + af2 dt^2 + F e sqrt(a) sin E, F = -2 sqrt(mu) / c^2, in seconds ahead of GPS time.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <numbers>

#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/math/deferred.hpp>

namespace searvins::gnss {

/// A satellite at its time of transmission, in the ECEF axes of that time.
struct SatelliteState {
  Eigen::Vector3d position_e_m{Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity_e_mps{Eigen::Vector3d::Zero()};  ///< relative to the rotating axes
  double clock_s{0};                                        ///< satellite clock ahead of GPS time, relativity included, group delay not
  double clock_rate_sps{0};
  double variance_m2{0};  ///< of orbit and clock along the line of sight
};

/// The signal that a receiver timed: when it left, and from where.
struct Transmission {
  GpsTime time{};
  SatelliteState state{};
  const Ephemeris* ephemeris{nullptr};  ///< points into the store it was selected from
};

namespace detail {

/// Constants of the interface document of a constellation.
struct OrbitConstants {
  double mu_m3ps2, earth_rate_radps, relativity_s_per_sqrt_m;
};

[[nodiscard]] constexpr OrbitConstants orbit_constants(NavigationMessage m) {
  switch (m) {
    case NavigationMessage::galileo_inav:
    case NavigationMessage::galileo_fnav: return {3.986004418e14, 7.2921151467e-5, -4.442807309e-10};
    case NavigationMessage::beidou_d1:
    case NavigationMessage::beidou_d2: return {3.986004418e14, 7.2921150e-5, -4.442807309e-10};
    case NavigationMessage::gps_lnav:
    case NavigationMessage::qzss_lnav: break;
  }
  return {3.986005e14, 7.2921151467e-5, -4.442807633e-10};
}

/// Seconds of toe in the week that omega0 refers to: the constellation's own week.
[[nodiscard]] inline double toe_of_week_s(const Ephemeris& e) {
  const bool beidou = e.message == NavigationMessage::beidou_d1 || e.message == NavigationMessage::beidou_d2;
  return GpsTime{e.toe.ns - (beidou ? kBeidouLagSeconds * kNanosecondsPerSecond : 0)}.sow();
}

/// Eccentric anomaly by Newton's method; at most 12 steps (3 suffice for GNSS orbits).
[[nodiscard]] inline double eccentric_anomaly(double mean_anomaly_rad, double e) {
  const double m = std::remainder(mean_anomaly_rad, 2.0 * std::numbers::pi);
  double anomaly = m + e * std::sin(m);
  for (int i = 0; i < 12; ++i) {
    const double step = (anomaly - e * std::sin(anomaly) - m) / (1.0 - e * std::cos(anomaly));
    anomaly -= step;
    if (std::abs(step) < 1e-14) break;
  }
  return anomaly;
}

/// A point of the orbital plane with its rate, turned into the frame whose node is at longitude `node`.
struct OrbitalPoint {
  double x, y, x_rate, y_rate;  // in the plane, from the ascending node
  double inclination, inclination_rate;
  double node, node_rate;
};

template <class Scalar>
inline void to_node_frame(const OrbitalPoint& o, Eigen::Matrix<Scalar, 3, 1>& p, Eigen::Matrix<Scalar, 3, 1>& v) {
  const double cn = std::cos(o.node), sn = std::sin(o.node), ci = std::cos(o.inclination), si = std::sin(o.inclination);
  const double across = o.y * ci, across_rate = o.y_rate * ci - o.y * si * o.inclination_rate;
  p = {o.x * cn - across * sn, o.x * sn + across * cn, o.y * si};
  v = {o.x_rate * cn - across_rate * sn - o.node_rate * p.y(), o.x_rate * sn + across_rate * cn + o.node_rate * p.x(),
       o.y_rate * si + o.y * ci * o.inclination_rate};
}

/// From the tilted, non-rotating frame of BeiDou's geostationary orbits to ECEF at t = toe + tk.
template <class Scalar>
inline void geostationary_to_ecef(double turn_rad, double earth_rate_radps, Eigen::Matrix<Scalar, 3, 1>& p,
                                  Eigen::Matrix<Scalar, 3, 1>& v) {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  constexpr double tilt = -5.0 * std::numbers::pi / 180.0;
  const double ct = std::cos(tilt), st = std::sin(tilt), c = std::cos(turn_rad), s = std::sin(turn_rad);
  const auto turn = [&](const Vector3& a) {
    const double y = ct * a.y() + st * a.z(), z = ct * a.z() - st * a.y();
    return Vector3{c * a.x() + s * y, c * y - s * a.x(), z};
  };
  p = turn(p);
  v = turn(v) + earth_rate_radps * Vector3{p.y(), -p.x(), 0.0};
}

/// One-sigma range error of a broadcast record that states no accuracy, metres.
inline constexpr double kUnknownAccuracyM = 3.0;

}  // namespace detail

/// Where the satellite is at `t` (GPS time) according to one record; the age of the record is the caller's business (EphemerisPolicy).
/// Errors: invalid_argument (orbit outside sqrt(a) 4000..8000, eccentricity 0..0.5,
/// clock over 1 s off), non_finite (a field is not finite).
template <class Scalar = double>
[[nodiscard]] inline Result<SatelliteState> satellite_state(const Ephemeris& e, GpsTime t) {
  if (!(e.sqrt_a > 4000 && e.sqrt_a < 8000))
    return failure(StatusCode::invalid_argument, "ephemeris: sqrt(a) is not that of a navigation satellite", -1, -1, e.sqrt_a);
  if (!(e.eccentricity >= 0 && e.eccentricity < 0.5))
    return failure(StatusCode::invalid_argument, "ephemeris: eccentricity outside [0, 0.5)", -1, -1, e.eccentricity);
  const detail::OrbitConstants k = detail::orbit_constants(e.message);
  const bool geostationary = e.message == NavigationMessage::beidou_d2;
  const double tk = seconds_between(e.toe, t), a = e.sqrt_a * e.sqrt_a;

  const double n = std::sqrt(k.mu_m3ps2 / a) / a + e.delta_n;
  const double E = detail::eccentric_anomaly(e.m0 + n * tk, e.eccentricity), sE = std::sin(E), cE = std::cos(E);
  const double shape = 1.0 - e.eccentricity * cE, E_rate = n / shape, minor = std::sqrt(1.0 - e.eccentricity * e.eccentricity);

  const double phi = std::atan2(minor * sE, cE - e.eccentricity) + e.omega, phi_rate = minor * E_rate / shape;
  const double s2 = std::sin(2 * phi), c2 = std::cos(2 * phi);
  const double u = phi + e.cus * s2 + e.cuc * c2, u_rate = phi_rate * (1 + 2 * (e.cus * c2 - e.cuc * s2));
  const double r = a * shape + e.crs * s2 + e.crc * c2,
               r_rate = a * e.eccentricity * sE * E_rate + 2 * phi_rate * (e.crs * c2 - e.crc * s2);

  detail::OrbitalPoint o{};
  const double su = std::sin(u), cu = std::cos(u);
  o.x = r * cu, o.y = r * su, o.x_rate = r_rate * cu - o.y * u_rate, o.y_rate = r_rate * su + o.x * u_rate;
  o.inclination = e.i0 + e.i_dot * tk + e.cis * s2 + e.cic * c2;
  o.inclination_rate = e.i_dot + 2 * phi_rate * (e.cis * c2 - e.cic * s2);
  o.node_rate = e.omega_dot - (geostationary ? 0.0 : k.earth_rate_radps);
  o.node = e.omega0 + o.node_rate * tk - k.earth_rate_radps * detail::toe_of_week_s(e);

  SatelliteState s;
  math::Vector3<Scalar>&p_e_m = s.position_e_m, &v_e_mps = s.velocity_e_mps;
  detail::to_node_frame(o, p_e_m, v_e_mps);
  if (geostationary) detail::geostationary_to_ecef(k.earth_rate_radps * tk, k.earth_rate_radps, p_e_m, v_e_mps);

  const double dt = seconds_between(e.toc, t), relativity = k.relativity_s_per_sqrt_m * e.eccentricity * e.sqrt_a;
  s.clock_s = e.af0 + dt * (e.af1 + dt * e.af2) + relativity * sE;
  s.clock_rate_sps = e.af1 + 2 * e.af2 * dt + relativity * cE * E_rate;
  const double accuracy_m = e.accuracy_m > 0 ? e.accuracy_m : detail::kUnknownAccuracyM;
  s.variance_m2 = accuracy_m * accuracy_m;
  if (!(p_e_m.allFinite() && v_e_mps.allFinite() && std::isfinite(s.clock_s) && std::isfinite(s.clock_rate_sps)))
    return failure(StatusCode::non_finite, "ephemeris: a field is not finite");
  if (std::abs(s.clock_s) > 1)
    return failure(StatusCode::invalid_argument, "ephemeris: satellite clock over a second off", -1, -1, s.clock_s);
  return s;
}

/// Group delay of a signal against the reference of the broadcast clock, seconds: the clock of this signal is clock_s - group_delay_s.
///
///     GPS, QZSS      reference L1P/L2P:   L1: TGD;   L2: TGD (f1/f2)^2;   L5: TGD (its inter-signal correction
///                                         is not in LNAV; recordings show it to be nearer 0 than (f1/f5)^2 - 1 times TGD)
///     Galileo I/NAV  reference E1/E5b:    E1: Bb;   E5b: Bb (f1/f)^2;   E5a: Bb + Ba ((f1/f)^2 - 1)        Ba, Bb: BGD of E5a/E1, E5b/E1
///     Galileo F/NAV  the same with a and b exchanged; E5 (AltBOC) is the mean of E5a and E5b; E6 has no delay broadcast, E1's is taken
///     BeiDou         reference B3I:       B1I, B1C: TGD1;  B2I, B2b, B2a, B2: TGD2;  B3I: 0  (D1/D2 carry no delays of the newer signals)
[[nodiscard]] inline double group_delay_s(const Ephemeris& e, const SignalCode& signal) {
  const double f1 = frequency_hz(e.satellite.constellation, '1'), f = frequency_hz(e.satellite.constellation, signal.band);
  if (f == 0) return 0;
  const double gamma = (f1 / f) * (f1 / f);
  switch (e.satellite.constellation) {
    case Constellation::gps:
    case Constellation::qzss: return (signal.band == '2' ? gamma : 1.0) * e.group_delay_s[0];
    case Constellation::beidou:
      return signal.band == '6' ? 0.0 : signal.band == '1' || signal.band == '2' ? e.group_delay_s[0] : e.group_delay_s[1];
    case Constellation::galileo: break;
  }
  const double e1_s = e.message == NavigationMessage::galileo_fnav ? e.group_delay_s[0] : e.group_delay_s[1];
  switch (signal.band) {
    case '5': return e1_s + (gamma - 1) * e.group_delay_s[0];
    case '7': return e1_s + (gamma - 1) * e.group_delay_s[1];
    case '8': return 0.5 * (group_delay_s(e, {Constellation::galileo, '5', 'Q'}) + group_delay_s(e, {Constellation::galileo, '7', 'Q'}));
    default: return e1_s;
  }
}

/// The transmission that a pseudorange timed: t_tx = tag - code / c - satellite clock. Tag and code carry the same receiver clock error, so
/// the result does not depend on it. Errors: non_finite or invalid_argument (code not finite, or over 10 light seconds), no_data (no
/// healthy ephemeris within the policy's age), those of satellite_state.
template <std::size_t N>
[[nodiscard]] Result<Transmission> transmission_from_code(const EphemerisStore<N>& store, SatelliteId id, GpsTime receiver_tag,
                                                          double code_m, const EphemerisPolicy& policy = {}) {
  using Scalar = math::DeferredFor<double, N>;
  if (!std::isfinite(code_m)) return failure(StatusCode::non_finite, "pseudorange is not finite");
  if (std::abs(code_m) > 10 * kSpeedOfLightMps)
    return failure(StatusCode::invalid_argument, "pseudorange over ten light seconds", -1, -1, code_m);
  const GpsTime satellite_reading = receiver_tag.plus_seconds(-code_m / kSpeedOfLightMps);
  const Ephemeris* e = store.select(id, satellite_reading, policy);
  if (!e) return failure(StatusCode::no_data, "no healthy ephemeris of sufficient age for the satellite", id.number);
  // The clock moves by less than 1 ps during its own offset, so its value at the satellite's reading is that at transmission.
  Result<SatelliteState> state = satellite_state<Scalar>(*e, satellite_reading);
  if (!state) return state.status();
  const GpsTime t = satellite_reading.plus_seconds(-state->clock_s);
  state = satellite_state<Scalar>(*e, t);
  if (!state) return state.status();
  return Transmission{t, *state, e};
}

}  // namespace searvins::gnss
