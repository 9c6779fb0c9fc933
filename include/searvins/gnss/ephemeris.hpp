// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Broadcast ephemerides and the Klobuchar coefficients, as transmitted (SI units, radians), and a fixed-capacity store of them.
///
/// GPS LNAV, QZSS LNAV, Galileo I/NAV and F/NAV and BeiDou D1/D2 share the Keplerian form [IS-GPS-200, Galileo OS SIS ICD, BDS-SIS-ICD-B1I];
/// what differs (time system, gravity constant, geostationary frame) is named by `message`. All times here are GPS time.
#pragma once

#include <cstddef>
#include <cstdint>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/time.hpp>
#include <searvins/gnss/signal.hpp>

namespace searvins::gnss {

/// Navigation message that an ephemeris came from.
enum class NavigationMessage : std::uint8_t { gps_lnav, qzss_lnav, galileo_inav, galileo_fnav, beidou_d1, beidou_d2 };

/// One broadcast record. Angles in radians, distances in metres, times in GPS time (BDT + 14 s for BeiDou).
struct Ephemeris {
  SatelliteId satellite{};
  NavigationMessage message{NavigationMessage::gps_lnav};
  GpsTime toe{};           ///< reference time of the orbit
  GpsTime toc{};           ///< reference time of the clock
  GpsTime transmitted{};   ///< time of transmission of the message, toe when the file does not tell
  std::uint32_t issue{0};  ///< IODE (GPS, QZSS), IODnav (Galileo), AODE (BeiDou)
  std::uint16_t health{0};  ///< 0: healthy for the signals that are used
  double accuracy_m{0};     ///< URA or SISA, metres; 0 when unknown

  double sqrt_a{0};        ///< square root of the semi-major axis, sqrt(m)
  double eccentricity{0};
  double i0{0};            ///< inclination at toe
  double omega0{0};        ///< longitude of the ascending node at the start of the week
  double omega{0};         ///< argument of perigee
  double m0{0};            ///< mean anomaly at toe
  double delta_n{0};       ///< mean motion difference, rad/s
  double i_dot{0};         ///< rad/s
  double omega_dot{0};     ///< rad/s
  double cuc{0}, cus{0};   ///< argument of latitude harmonics, rad
  double crc{0}, crs{0};   ///< radius harmonics, m
  double cic{0}, cis{0};   ///< inclination harmonics, rad

  double af0{0}, af1{0}, af2{0};  ///< clock polynomial at toc: s, s/s, s/s^2
  /// Group delays, seconds: GPS/QZSS {TGD, 0}; Galileo {BGD E5a/E1, BGD E5b/E1}; BeiDou {TGD1 (B1I), TGD2 (B2I)}.
  double group_delay_s[2]{0, 0};
};

/// Klobuchar coefficients of the broadcast ionosphere model: s, s/semicircle, ...; all zero when not broadcast.
struct KlobucharCoefficients {
  double alpha[4]{0, 0, 0, 0};
  double beta[4]{0, 0, 0, 0};
  [[nodiscard]] constexpr bool present() const { return alpha[0] != 0 || alpha[1] != 0 || alpha[2] != 0 || alpha[3] != 0; }
};

/// Which record to use for a satellite at an instant.
struct EphemerisPolicy {
  double max_age_s{7200};       ///< |t - toe| limit for GPS, QZSS, BeiDou
  double max_age_galileo_s{14400};  ///< |t - toe| limit for Galileo (nominal validity 4 h)
  bool allow_future{true};      ///< a file holds records transmitted after t; false: only what the receiver could have had
};

/// Up to N broadcast records. Records are kept sorted by satellite and toe; the same record twice is stored once.
template <std::size_t N>
class EphemerisStore {
 public:
  /// Takes a record. False when full (the record is not taken). A repeated (satellite, message, toe, issue) replaces the earlier one.
  bool insert(const Ephemeris& e) {
    std::size_t at = 0;
    while (at < records_.size() && precedes(records_[at], e)) ++at;
    if (at < records_.size() && !precedes(e, records_[at])) {
      records_[at] = e;
      return true;
    }
    return records_.insert(at, e);
  }

  /// The healthy record of a satellite whose toe is nearest to t within the policy's age; I/NAV goes before F/NAV at equal distance.
  /// nullptr when there is none.
  [[nodiscard]] const Ephemeris* select(SatelliteId id, GpsTime t, const EphemerisPolicy& policy = {}) const {
    const Ephemeris* best = nullptr;
    double best_age = id.constellation == Constellation::galileo ? policy.max_age_galileo_s : policy.max_age_s;
    for (const Ephemeris& e : records_) {
      if (e.satellite != id || e.health != 0) continue;
      if (!policy.allow_future && e.transmitted > t) continue;
      const double dt = seconds_between(e.toe, t), age = dt < 0 ? -dt : dt;
      if (age < best_age || (!best && age <= best_age)) best = &e, best_age = age;
    }
    return best;
  }

  [[nodiscard]] const StaticVector<Ephemeris, N>& records() const { return records_; }
  void clear() { records_.clear(); }

  KlobucharCoefficients ionosphere{};  ///< of GPS (or QZSS, BeiDou when GPS has none)

 private:
  static bool precedes(const Ephemeris& a, const Ephemeris& b) {
    if (a.satellite != b.satellite) return a.satellite < b.satellite;
    if (a.toe != b.toe) return a.toe < b.toe;
    if (a.message != b.message) return a.message < b.message;
    return a.issue < b.issue;
  }
  StaticVector<Ephemeris, N> records_{};
};

}  // namespace searvins::gnss
