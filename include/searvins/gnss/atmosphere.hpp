// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Delays of the atmosphere on a GNSS signal, in metres of code range (the ionosphere advances the phase by as much as it delays the code).
///
/// Ionosphere: the broadcast model of Klobuchar [IS-GPS-200, 20.3.3.5.2.5, fig. 20-4], a half cosine over the local day on a constant
/// night value, at the point where the signal pierces a shell of 350 km. It removes about half of the delay. Dispersive: on another
/// frequency the delay is (f_L1 / f)^2 times that on L1.
///
/// Troposphere: zenith delays of Saastamoinen from a standard atmosphere (1013.25 hPa, 15 C, -6.5 K/km at sea level),
///
///     hydrostatic  0.0022768 p / (1 - 0.00266 cos 2 lat - 0.00028 h_km)        p in hPa        [Saastamoinen 1972; Davis et al. 1985]
///     wet          0.002277 (1255 / T + 0.05) e                                e in hPa, T in K
///
/// mapped to elevation by 1.001 / sqrt(0.002001 + sin^2 el) [Black and Eisner 1984; RTCA DO-229], 1 at the zenith, within 0.1 % of ray
/// tracing at 10 degrees. Of the 2.4 m at the zenith about 0.3 mm change with every metre of height: inside a double difference
/// only the difference between rover and base height survives, and that is what troposphere_difference_m is for.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/signal.hpp>

namespace searvins::gnss {

/// Coefficients for a file that broadcasts none: those of GPS on 2005-04-02, between minimum and maximum of the solar cycle.
inline constexpr KlobucharCoefficients kTypicalIonosphere{{1.118e-8, 1.490e-8, -5.960e-8, -5.960e-8},
                                                          {8.806e4, 1.638e4, -1.966e5, -1.311e5}};

/// Ionospheric delay of a code, metres, on carrier `frequency_hz` (> 0), at GPS time `t`. Elevation in [0, pi/2] (clamped).
[[nodiscard]] inline double klobuchar_delay_m(const KlobucharCoefficients& k, const geodesy::Geodetic& receiver,
                                              const geodesy::AzimuthElevation& line, GpsTime t, double frequency_hz) {
  constexpr double pi = std::numbers::pi, l1_hz = 1575.42e6;
  const double elevation = std::clamp(line.elevation_rad, 0.0, pi / 2) / pi;  // semicircles, as the model is written
  const double central_angle = 0.0137 / (elevation + 0.11) - 0.022;
  const double latitude = std::clamp(receiver.lat_rad / pi + central_angle * std::cos(line.azimuth_rad), -0.416, 0.416);
  const double longitude = receiver.lon_rad / pi + central_angle * std::sin(line.azimuth_rad) / std::cos(latitude * pi);
  const double geomagnetic = latitude + 0.064 * std::cos((longitude - 1.617) * pi);

  double local_s = std::fmod(static_cast<double>(kSecondsPerDay) / 2 * longitude + t.sow(), static_cast<double>(kSecondsPerDay));
  if (local_s < 0) local_s += static_cast<double>(kSecondsPerDay);
  const double slant = 0.53 - elevation, obliquity = 1.0 + 16.0 * slant * slant * slant;
  const auto polynomial = [&](const double* c) { return c[0] + geomagnetic * (c[1] + geomagnetic * (c[2] + geomagnetic * c[3])); };
  const double period_s = std::max(polynomial(k.beta), 72000.0), amplitude_s = std::max(polynomial(k.alpha), 0.0);
  const double x = 2 * pi * (local_s - 50400.0) / period_s;
  const double day_s = std::abs(x) < 1.57 ? amplitude_s * (1.0 - x * x / 2 + x * x * x * x / 24) : 0.0;
  const double ratio = l1_hz / frequency_hz;
  return kSpeedOfLightMps * obliquity * (5e-9 + day_s) * ratio * ratio;
}

/// Zenith delays of the troposphere, metres.
struct ZenithDelay {
  double hydrostatic_m{0}, wet_m{0};
  [[nodiscard]] constexpr double total_m() const { return hydrostatic_m + wet_m; }
};

/// Saastamoinen's zenith delays at an ellipsoidal height, relative humidity in [0, 1]. Heights are clamped to [-1, 40] km; there is no
/// vapour above 11 km (a step of 0.2 mm).
[[nodiscard]] inline ZenithDelay saastamoinen_zenith(const geodesy::Geodetic& receiver, double relative_humidity = 0.7) {
  constexpr double tropopause_m = 11'000;
  const double h_m = std::clamp(receiver.height_m, -1000.0, 40'000.0);
  const double pressure_hpa = 1013.25 * std::pow(1.0 - 2.2557e-5 * h_m, 5.2568);
  const double temperature_k = 288.15 - 6.5e-3 * std::min(h_m, tropopause_m);
  const double vapour_hpa =
      h_m > tropopause_m ? 0.0 : 6.108 * relative_humidity * std::exp((17.15 * temperature_k - 4684.0) / (temperature_k - 38.45));
  ZenithDelay z;
  z.hydrostatic_m = 0.0022768 * pressure_hpa / (1.0 - 0.00266 * std::cos(2 * receiver.lat_rad) - 0.00028e-3 * h_m);
  z.wet_m = 0.002277 * (1255.0 / temperature_k + 0.05) * vapour_hpa;
  return z;
}

/// Slant over zenith delay of the troposphere. Elevations below 3 degrees are taken as 3 degrees: the model has no use there.
[[nodiscard]] inline double troposphere_mapping(double elevation_rad) {
  const double s = std::sin(std::max(elevation_rad, 0.05));
  return 1.001 / std::sqrt(0.002001 + s * s);
}

/// Tropospheric delay of a signal, metres.
[[nodiscard]] inline double troposphere_delay_m(const geodesy::Geodetic& receiver, double elevation_rad, double relative_humidity = 0.7) {
  return saastamoinen_zenith(receiver, relative_humidity).total_m() * troposphere_mapping(elevation_rad);
}

/// Tropospheric delay of one satellite at the rover minus that at the base, metres: subtract it from the rover-base single difference, and
/// by satellite from double differences. Negative where the rover is higher.
[[nodiscard]] inline double troposphere_difference_m(const geodesy::Geodetic& rover, double rover_elevation_rad,
                                                     const geodesy::Geodetic& base, double base_elevation_rad,
                                                     double relative_humidity = 0.7) {
  return troposphere_delay_m(rover, rover_elevation_rad, relative_humidity) -
         troposphere_delay_m(base, base_elevation_rad, relative_humidity);
}

}  // namespace searvins::gnss
