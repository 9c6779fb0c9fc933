// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the numbers of an IMU log say about their units, their range and their axes. Nothing on Earth reads otherwise:
///
///     median |accel|    9.8: m/s^2    1.0: g    1000: mg    near 0: gravity was taken out    else: no unit that is known
///     |gyro|            a vehicle that turns faster than 6 rad/s (344 deg/s) for a twentieth of the time is one whose log is in deg/s
///     both exchanged    median |gyro| 9.8 and median |accel| below 5: the columns stand in the other order
///
/// g, mg and deg/s are converted on demand and said in any case; what cannot be repaired is said with what to do.
///
/// Saturation: the largest value of a channel, beyond every reading of a vehicle at rest, three times in a row or more.
///
/// Axes: specific force at rest points up. turn_axes() brings samples into the body; check_gravity_axis() then looks where up is.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <searvins/imu/imu_sample.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/imu_columns.hpp>

namespace searvins::io {

/// What can be wrong with the numbers of a log.
enum class ImuFault : std::uint8_t {
  accel_in_g,
  accel_in_mg,
  gyro_in_degrees,
  columns_exchanged,
  gravity_missing,
  accel_magnitude,  ///< none of the units that are known
  saturation,
  gravity_axis,
  rate,
};

/// One thing that looks wrong, in words, and how many samples it concerns.
struct ImuFinding {
  ImuFault fault{};
  Diagnostic text;
  long count{0};
};

namespace detail {

/// The value below which the share `p` of the norms lies; NaN for none.
template <class Norm>
[[nodiscard]] double norm_quantile(const std::vector<imu::ImuSample>& samples, double p, Norm norm) {
  std::vector<double> norms;
  norms.reserve(samples.size());
  for (const imu::ImuSample& s : samples) norms.push_back(norm(s));
  if (norms.empty()) return std::nan("");
  const auto at = norms.begin() + static_cast<std::ptrdiff_t>(p * static_cast<double>(norms.size() - 1));
  std::nth_element(norms.begin(), at, norms.end());
  return *at;
}
[[nodiscard]] inline double accel_norm(const imu::ImuSample& s) { return s.accel_b_mps2.norm(); }
[[nodiscard]] inline double gyro_norm(const imu::ImuSample& s) { return s.gyro_b_radps.norm(); }

/// The name of the axis on which a vector mostly lies: "x", "-z" ...
[[nodiscard]] inline std::string axis_name(const Eigen::Vector3d& v) {
  Eigen::Index i = 0;
  v.cwiseAbs().maxCoeff(&i);
  return std::string{v[i] < 0 ? "-" : ""} + "xyz"[i];
}

}  // namespace detail

/// Looks at the units; with `convert` turns g, mg and deg/s into SI units in place. `name` is the file's name in messages.
[[nodiscard]] inline std::vector<ImuFinding> check_imu_units(std::vector<imu::ImuSample>& samples, const std::string& name, bool convert) {
  std::vector<ImuFinding> findings;
  if (samples.empty()) return findings;
  const double accel = detail::norm_quantile(samples, 0.5, detail::accel_norm), gyro = detail::norm_quantile(samples, 0.5, detail::gyro_norm);
  const std::string reads = "the accelerometer reads " + fixed_text(accel, 3) + " where gravity must read 9.8 m/s^2";
  const char* done = convert ? ", converted" : "";
  const auto find = [&](ImuFault fault, std::string message, std::string hint) {
    findings.push_back({fault, Diagnostic{name, 0, std::move(message), std::move(hint)}, static_cast<long>(samples.size())});
  };
  const auto scale_accel = [&](double factor) {
    if (convert)
      for (imu::ImuSample& s : samples) s.accel_b_mps2 *= factor;
  };
  if (std::abs(gyro - kStandardGravityMps2) < 1.5 && accel < 5) {
    find(ImuFault::columns_exchanged, "the gyroscope columns hold the acceleration (" + fixed_text(gyro, 3) + ") and the other way round",
         "exchange them: CSV without a header is t,gx,gy,gz,ax,ay,az, a LORD log has the acceleration first");
    return findings;
  }
  if (accel >= 0.9 && accel <= 1.1) {
    find(ImuFault::accel_in_g, reads + ": the unit is g" + done, "write m/s^2, or name the columns ax_g, ay_g, az_g");
    scale_accel(kStandardGravityMps2);
  } else if (accel >= 900 && accel <= 1100) {
    find(ImuFault::accel_in_mg, reads + ": the unit is mg" + done, "write m/s^2, or name the columns ax_mg, ay_mg, az_mg");
    scale_accel(kStandardGravityMps2 / 1000);
  } else if (accel < 0.9) {
    find(ImuFault::gravity_missing, reads + ": gravity was taken out of it", "log the raw specific force, not linear acceleration");
  } else if (accel < 8.5 || accel > 11.5) {
    find(ImuFault::accel_magnitude, reads, "log m/s^2 or g; check the scale of the log");
  }
  if (const double fast = detail::norm_quantile(samples, 0.95, detail::gyro_norm); fast > 6) {
    find(ImuFault::gyro_in_degrees, "the gyroscope reads " + fixed_text(fast, 1) + " or more for a twentieth of the time: the unit is deg/s" + done,
         "write rad/s, or name the columns gx_dps, gy_dps, gz_dps");
    if (convert)
      for (imu::ImuSample& s : samples) s.gyro_b_radps *= std::numbers::pi / 180;
  }
  return findings;
}

/// Looks for channels that ran into their end. The samples stay as they are.
[[nodiscard]] inline std::vector<ImuFinding> check_imu_saturation(const std::vector<imu::ImuSample>& samples, const std::string& name) {
  constexpr std::array<const char*, 6> channel_names{"ax", "ay", "az", "gx", "gy", "gz"};
  std::vector<ImuFinding> findings;
  for (std::size_t c = 0; c < 6; ++c) {
    const auto value = [c](const imu::ImuSample& s) {
      return std::abs(c < 3 ? s.accel_b_mps2[static_cast<Eigen::Index>(c)] : s.gyro_b_radps[static_cast<Eigen::Index>(c - 3)]);
    };
    double largest = 0;
    for (const imu::ImuSample& s : samples) largest = std::max(largest, value(s));
    if (largest < (c < 3 ? 18.0 : 2.1)) continue;  // the smallest ranges on sale are 2 g and 125 deg/s
    long at_the_end = 0, run = 0;
    GpsTime first{};
    for (const imu::ImuSample& s : samples) {
      run = value(s) >= largest * (1 - 1e-9) ? run + 1 : 0;
      if (run == 3 && at_the_end == 0) first = s.time;
      at_the_end += run == 3 ? 3 : run > 3 ? 1 : 0;
    }
    if (at_the_end == 0) continue;
    findings.push_back({ImuFault::saturation,
                        {name, 0,
                         std::string{"channel "} + channel_names[c] + " stands at its largest value, " + fixed_text(largest, 3) + ", for " +
                             std::to_string(at_the_end) + " samples, first at sow " + fixed_text(first.sow(), 3),
                         "the sensor was saturated: choose a larger range; the motion there is not known"},
                        at_the_end});
  }
  return findings;
}

/// Turns samples from raw axes into the body: v_b = R_b_raw v_raw. For a rig: R_rfu_b * R_b_raw.
inline void turn_axes(std::vector<imu::ImuSample>& samples, const Eigen::Matrix3d& R_b_raw) {
  for (imu::ImuSample& s : samples) {
    s.gyro_b_radps = R_b_raw * s.gyro_b_radps;
    s.accel_b_mps2 = R_b_raw * s.accel_b_mps2;
  }
}

/// Looks where up is in the body (right, forward, up), after turn_axes() with R_b_raw. Nothing when it is z to within 45 degrees.
[[nodiscard]] inline std::optional<ImuFinding> check_gravity_axis(const std::vector<imu::ImuSample>& samples, const Eigen::Matrix3d& R_b_raw,
                                                                  const std::string& name) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const imu::ImuSample& s : samples) mean += s.accel_b_mps2;
  if (samples.empty()) return std::nullopt;
  mean /= static_cast<double>(samples.size());
  if (!(mean.norm() > 5) || mean.z() > 0.7 * mean.norm()) return std::nullopt;
  const std::string in_body = detail::axis_name(mean), in_log = detail::axis_name(R_b_raw.transpose() * mean);
  return ImuFinding{ImuFault::gravity_axis,
                    {name, 0,
                     "gravity points the wrong way: at rest the accelerometer must read +9.8 m/s^2 on the body's up axis z, it reads " +
                         fixed_text(mean.norm(), 2) + " on " + in_body,
                     "correct imu.axes or body_axes of the rig: up is the log's axis " + in_log + (in_log == "z" ? "" : ", so the body's up entry is \"" + in_log + "\"")},
                    static_cast<long>(samples.size())};
}

/// Compares the interval of a log with the rate of a rig: nothing when they agree within a tenth.
[[nodiscard]] inline std::optional<ImuFinding> check_imu_rate(double interval_s, double rate_hz, const std::string& name) {
  if (!(interval_s > 0) || std::abs(interval_s * rate_hz - 1) <= 0.1) return std::nullopt;
  return ImuFinding{ImuFault::rate,
                    {name, 0, "the log has " + fixed_text(1 / interval_s, 1) + " samples a second, the rig says " + fixed_text(rate_hz, 1),
                     "correct imu.rate_hz, or give the log that belongs to the rig"},
                    0};
}

}  // namespace searvins::io
