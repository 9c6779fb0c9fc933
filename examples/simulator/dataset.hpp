// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A simulated drive as the text of its files, and in figures.
///
///     plain      rover.obs base.obs nav.rnx imu.csv truth.csv streets.csv rig.json stereo_tracks.csv labels.csv
///     texcup     the names and forms of TEX-CUP: asterx4_rover.obs, asterx4_base_1hz.obs, brdmDDD0.YYp, lord_imu.log (raw axes left,
///                forward, down), ground_truth.log (UTC, 1 Hz)
///     ppc        those of the PPC-Dataset: rover.obs, base.obs, base.nav, imu.csv (forward, left, up; deg/s), reference.csv (5 Hz)
///     urbannav   those of UrbanNav Hong Kong: UrbanNav-SIM.ublox.f9p.obs, hksc_base.obs, brdmDDD0.YYp, xsense_imu_sim.csv (ROS columns,
///                UTC stamps), UrbanNav_SIM_GT_raw.txt (a point 0.14 m above the IMU, degrees, minutes, seconds)
///
/// The last three have truth.csv, rig.json, stereo_tracks.csv and labels.csv beside them, as above.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/geodesy/local_frame.hpp>

#include "rinex_writer.hpp"
#include "simulation.hpp"

namespace searvins::simulator {

/// A file of the data set.
struct DatasetFile {
  std::string name, text;
};

/// Which names and forms the files have.
enum class Layout { plain, texcup, ppc, urbannav };

/// What the rover met in one kind of neighbourhood: satellites are counted by their first signal.
struct DistrictSummary {
  int epochs{0};
  double length_s{0};
  std::array<int, 4> satellites{};  ///< by SignalState, all above the mask
  int tracked{0};                   ///< satellites with a code
  int signals{0}, bad_signals{0};   ///< tracked signals; of these diffracted or reflected
  int locks{0}, slips{0};           ///< phases that were found again, that slipped
};

/// The whole data set.
struct Dataset {
  std::vector<DatasetFile> files;
  std::array<DistrictSummary, 3> districts{};
  double distance_m{0};
};

/// Called now and then with the share of the work that is done.
using ProgressCall = std::function<void(double)>;

namespace detail {

[[nodiscard]] inline double sow(const Simulation& s, double t_s) { return s.options().start.plus_seconds(t_s).sow(); }
[[nodiscard]] inline long week(const Simulation& s, double t_s) { return static_cast<long>(s.options().start.plus_seconds(t_s).week()); }

/// Antenna and IMU as the truth files have them: in the East-North-Up axes at the antenna.
struct TruthRow {
  Eigen::Vector3d antenna_e_m, imu_e_m, imu_velocity_mps, antenna_velocity_mps;
  Eigen::Matrix3d R_enu_b;
};

[[nodiscard]] inline TruthRow truth_row(const Simulation& s, double t_s) {
  const Vehicle& vehicle = s.vehicle();
  const VehicleState state = vehicle.state(t_s);
  const geodesy::LocalFrame& frame = vehicle.frame();
  TruthRow row;
  row.imu_e_m = frame.to_ecef(state.p_w_m);
  row.antenna_e_m = vehicle.antenna_e_m(t_s);
  const Eigen::Matrix3d R_enu_w = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(row.antenna_e_m)).transpose() * frame.R_ew;
  row.R_enu_b = R_enu_w * state.R_wb;
  row.imu_velocity_mps = R_enu_w * state.v_w_mps;
  row.antenna_velocity_mps = row.imu_velocity_mps + row.R_enu_b * state.w_wb_b_radps.cross(vehicle.lever_arm_b_m());
  return row;
}

/// The unit quaternion of a rotation with w >= 0: w, x, y, z.
[[nodiscard]] inline Eigen::Vector4d quaternion(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  const double sign = q.w() < 0 ? -1 : 1;
  return sign * Eigen::Vector4d{q.w(), q.x(), q.y(), q.z()};
}

}  // namespace detail

/// truth.csv: 10 Hz from a second before the first epoch to a second after the last.
[[nodiscard]] inline std::string truth_text(const Simulation& s) {
  std::string text = "t,ant_x,ant_y,ant_z,imu_x,imu_y,imu_z,qw,qx,qy,qz,ve,vn,vu,ant_ve,ant_vn,ant_vu\n";
  const int last = static_cast<int>(std::llround(s.options().duration_s * 10)) + 10;
  for (int k = -10; k <= last; ++k) {
    const detail::TruthRow r = detail::truth_row(s, 0.1 * k);
    const Eigen::Vector4d q = detail::quaternion(r.R_enu_b);
    text += formatted("%.1f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f", detail::sow(s, 0.1 * k), r.antenna_e_m.x(), r.antenna_e_m.y(),
                      r.antenna_e_m.z(), r.imu_e_m.x(), r.imu_e_m.y(), r.imu_e_m.z());
    text += formatted(",%.7f,%.7f,%.7f,%.7f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f\n", q[0], q[1], q[2], q[3], r.imu_velocity_mps.x(),
                      r.imu_velocity_mps.y(), r.imu_velocity_mps.z(), r.antenna_velocity_mps.x(), r.antenna_velocity_mps.y(),
                      r.antenna_velocity_mps.z());
  }
  return text;
}

/// streets.csv: the way of the antenna as the middle of the street, a point every ten metres; a map to draw, or to play lanes with.
[[nodiscard]] inline std::string streets_text(const Simulation& s) {
  std::string text = "line,lat_deg,lon_deg,height_m\n";
  Eigen::Vector3d last_e_m = Eigen::Vector3d::Zero();
  for (int k = 0; k <= static_cast<int>(s.options().duration_s * 10); ++k) {
    const Eigen::Vector3d p_e_m = detail::truth_row(s, 0.1 * k).antenna_e_m;
    if ((p_e_m - last_e_m).norm() < 10) continue;
    last_e_m = p_e_m;
    const geodesy::Geodetic g = geodesy::geodetic_from_ecef(p_e_m);
    text += formatted("1,%.8f,%.8f,%.2f\n", g.lat_rad * 180 / std::numbers::pi, g.lon_rad * 180 / std::numbers::pi, g.height_m);
  }
  return text;
}

/// ground_truth.log: the antenna at 1 Hz in UTC, tab-separated.
[[nodiscard]] inline std::string ground_truth_text(const Simulation& s) {
  constexpr double deg = 180 / std::numbers::pi;
  std::string text =
      "# date\ttime\tquality\tlatitude\tlongitude\tellipsoidHeight\torthometricHeight\tstdNorth\tstdEast\tstdUp\tecefX\tecefY\tecefZ\t"
      "heading\tpitch\troll\tspeed\tspeedNorth\tspeedEast\tspeedVertical\n";
  for (int k = -1; k <= static_cast<int>(s.options().duration_s) + 1; ++k) {
    const detail::TruthRow r = detail::truth_row(s, k);
    const CivilTime c = civil_from_gps(s.options().start.plus_seconds(k - 18));
    const geodesy::Geodetic g = geodesy::geodetic_from_ecef(r.antenna_e_m);
    const Eigen::Matrix3d& R = r.R_enu_b;
    const Eigen::Vector3d& v = r.antenna_velocity_mps;
    const double heading = std::fmod(std::atan2(R(0, 1), R(1, 1)) * deg + 360, 360);
    text += formatted("%04d/%02d/%02d\t%02d:%02d:%06.3f\t1\t%.9f\t%.9f\t%.4f\t%.4f\t0.010\t0.010\t0.015", c.year, c.month, c.day, c.hour,
                      c.minute, c.second, g.lat_rad * deg, g.lon_rad * deg, g.height_m, g.height_m - 46);
    text +=
        formatted("\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\n", r.antenna_e_m.x(), r.antenna_e_m.y(), r.antenna_e_m.z(),
                  heading, std::asin(R(2, 1)) * deg, std::atan2(-R(2, 0), R(2, 2)) * deg, v.norm(), v.y(), v.x(), -v.z());
  }
  return text;
}

namespace detail {

/// Roll, pitch and heading (clockwise from north) of a body, degrees.
[[nodiscard]] inline Eigen::Vector3d attitude_deg(const Eigen::Matrix3d& R_enu_b) {
  constexpr double deg = 180 / std::numbers::pi;
  return {std::atan2(-R_enu_b(2, 0), R_enu_b(2, 2)) * deg, std::asin(R_enu_b(2, 1)) * deg,
          std::fmod(std::atan2(R_enu_b(0, 1), R_enu_b(1, 1)) * deg + 360, 360)};
}

/// "-12 34 56.78901" of an angle in degrees.
[[nodiscard]] inline std::string sexagesimal(double angle_deg) {
  const long long units = std::llround(std::abs(angle_deg) * 3600e5);  // of 1e-5 seconds of arc
  return formatted("%s%lld %02lld %02lld.%05lld", angle_deg < 0 ? "-" : "", units / 360'000'000, units / 6'000'000 % 60,
                   units / 100'000 % 60, units % 100'000);
}

}  // namespace detail

/// reference.csv of the PPC-Dataset: the antenna at 5 Hz.
[[nodiscard]] inline std::string reference_text(const Simulation& s) {
  constexpr double deg = 180 / std::numbers::pi;
  std::string text =
      "GPS TOW (s),GPS Week,Latitude (deg),Longitude (deg),Ellipsoid Height (m),ECEF X (m),ECEF Y (m),ECEF Z (m),Roll (deg),Pitch (deg),"
      "Heading (deg),East Velocity (m/s),North Velocity (m/s),Up Velocity (m/s)\n";
  for (int k = 0; k <= static_cast<int>(s.options().duration_s) * 5; ++k) {
    const detail::TruthRow r = detail::truth_row(s, 0.2 * k);
    const geodesy::Geodetic g = geodesy::geodetic_from_ecef(r.antenna_e_m);
    const Eigen::Vector3d a = detail::attitude_deg(r.R_enu_b), &v = r.antenna_velocity_mps;
    text += formatted("%.2f,%ld,%.9f,%.9f,%.4f,%.4f,%.4f,%.4f", detail::sow(s, 0.2 * k), detail::week(s, 0.2 * k), g.lat_rad * deg,
                      g.lon_rad * deg, g.height_m, r.antenna_e_m.x(), r.antenna_e_m.y(), r.antenna_e_m.z());
    text += formatted(",%.4f,%.4f,%.4f,%.4f,%.4f,%.4f\n", a[0], a[1], a[2], v.x(), v.y(), v.z());
  }
  return text;
}

/// The truth of UrbanNav Hong Kong: 1 Hz, 0.14 m above the IMU, velocity and acceleration in body axes.
[[nodiscard]] inline std::string span_truth_text(const Simulation& s) {
  constexpr double deg = 180 / std::numbers::pi;
  std::string text =
      "      UTCTime       Week   GPSTime         Latitude        Longitude        H-Ell VelBdyX VelBdyY VelBdyZ AccBdyX AccBdyY AccBdyZ   "
      "        "
      "Roll          Pitch        Heading Q\n"
      "        (sec)    (weeks)     (sec)       (+/-D M S)       (+/-D M S)          (m)   (m/s)   (m/s)   (m/s) (m/s^2) (m/s^2) (m/s^2)   "
      "       "
      "(deg)          (deg)          (deg)  \n";
  for (int k = 0; k <= static_cast<int>(s.options().duration_s); ++k) {
    const detail::TruthRow r = detail::truth_row(s, k);
    const Eigen::Matrix3d R_e_enu = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(r.antenna_e_m));
    const geodesy::Geodetic g = geodesy::geodetic_from_ecef(r.imu_e_m + R_e_enu * r.R_enu_b * Eigen::Vector3d{0, 0, 0.14});
    const Eigen::Vector3d a = detail::attitude_deg(r.R_enu_b), v = r.R_enu_b.transpose() * r.imu_velocity_mps;
    const Eigen::Vector3d f =
        r.R_enu_b.transpose() * (detail::truth_row(s, k + 0.5).imu_velocity_mps - detail::truth_row(s, k - 0.5).imu_velocity_mps);
    const double utc_s = static_cast<double>(to_utc(s.options().start.plus_seconds(k)).unix_ns) * 1e-9;
    text += formatted("%13.2f %10.5f %9.2f  %16s %16s %12.3f", utc_s, static_cast<double>(detail::week(s, k)), detail::sow(s, k),
                      detail::sexagesimal(g.lat_rad * deg).c_str(), detail::sexagesimal(g.lon_rad * deg).c_str(), g.height_m);
    text += formatted(" %7.3f %7.3f %7.3f %7.3f %7.3f %7.3f %14.10f %14.10f %14.9f 1\n", v.x(), v.y(), v.z(), f.x(), f.y(), f.z(), a[0],
                      a[1], a[2] > 180 ? a[2] - 360 : a[2]);
  }
  return text;
}

/// rig.json of the layout, with the camera of the tracks or another.
[[nodiscard]] inline std::string rig_text(const Simulation& s, Layout layout, const StereoRig& c = {}) {
  const ImuNoise& n = s.options().imu_noise;
  const Eigen::Vector3d& lever = s.vehicle().lever_arm_b_m();
  std::string text = "{\n  \"schema\": 1,\n  \"imu\": {\n";
  text += formatted("    \"rate_hz\": %.10g,\n    \"sample\": \"%s\",\n    \"axes\": %s,\n", s.options().imu_rate_hz,
                    s.options().imu_sampling == ImuSampling::instantaneous ? "instantaneous" : "mean_to_stamp",
                    layout == Layout::texcup ? "[\"-x\", \"y\", \"-z\"]"
                    : layout == Layout::ppc  ? "[\"-y\", \"x\", \"z\"]"
                                             : "[\"x\", \"y\", \"z\"]");
  text += formatted("    \"accel_noise_mps2_sqrt_hz\": %.10g,\n    \"gyro_noise_radps_sqrt_hz\": %.10g,\n", n.accel_noise_mps2_sqrt_hz,
                    n.gyro_noise_radps_sqrt_hz);
  text += formatted("    \"accel_bias_walk_mps3_sqrt_hz\": %.10g,\n    \"gyro_bias_walk_radps2_sqrt_hz\": %.10g,\n",
                    n.accel_bias_walk_mps3_sqrt_hz, n.gyro_bias_walk_radps2_sqrt_hz);
  text += formatted("    \"accel_bias_sigma_mps2\": %.10g,\n    \"gyro_bias_sigma_radps\": %.10g\n  },\n", n.accel_bias_sigma_mps2,
                    n.gyro_bias_sigma_radps);
  text += "  \"body_axes\": \"right-forward-up\",\n";
  text += formatted("  \"antenna\": {\"lever_arm_b_m\": [%.10g, %.10g, %.10g]},\n", lever.x(), lever.y(), lever.z());
  text += formatted("  \"base\": {\"position_ecef_m\": [%.4f, %.4f, %.4f]},\n", s.base_e_m().x(), s.base_e_m().y(), s.base_e_m().z());
  text += "  \"camera\": {\n";
  text += formatted("    \"rectified\": {\"fx_px\": %.10g, \"fy_px\": %.10g, \"cx_px\": %.10g, \"cy_px\": %.10g, \"baseline_m\": %.10g},\n",
                    c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.baseline_m);
  text += formatted("    \"size_px\": [%.10g, %.10g],\n    \"R_b_c\": [\n", c.width_px, c.height_px);
  for (int i = 0; i < 3; ++i)
    text += formatted("      [%.16g, %.16g, %.16g]%s\n", c.R_bc(i, 0), c.R_bc(i, 1), c.R_bc(i, 2), i < 2 ? "," : "");
  text += formatted("    ],\n    \"t_b_c_m\": [%.10g, %.10g, %.10g],\n    \"sigma_px\": 0.7\n  },\n", c.t_bc_m.x(), c.t_bc_m.y(),
                    c.t_bc_m.z());
  text += "  \"gnss\": {\"signals\": [\"G1C\", \"G2W\", \"E1C\", \"E7Q\", \"C2I\"], \"elevation_mask_deg\": 15, \"min_cn0_dbhz\": 20},\n";
  return text + "  \"semantic\": {\"reject_classes\": [3, 4, 6]}\n}\n";
}

namespace detail {

/// What stands above the readings.
[[nodiscard]] inline std::string imu_header(Layout layout) {
  if (layout == Layout::plain) return "week,sow,gx,gy,gz,ax,ay,az\n";
  if (layout == Layout::ppc)
    return "GPS TOW (s), GPS Week, Acc X (m/s^2), Acc Y (m/s^2), Acc Z (m/s^2), Ang Rate X (deg/s),  Ang Rate Y (deg/s),  Ang Rate Z "
           "(deg/s)\n";
  if (layout == Layout::texcup) return {};
  const auto covariance = [](const std::string& name) {
    std::string columns;
    for (int i = 0; i < 9; ++i) columns += ",field." + name + "_covariance" + std::to_string(i);
    return columns;
  };
  return "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.orientation.x,field.orientation.y,field.orientation.z,"
         "field.orientation.w" +
         covariance("orientation") + ",field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z" +
         covariance("angular_velocity") + ",field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z" +
         covariance("linear_acceleration") + '\n';
}

/// A reading of UrbanNav: `k` counts them.
[[nodiscard]] inline std::string ros_reading(int k, GpsTime stamp, const Eigen::Vector3d& f, const Eigen::Vector3d& w) {
  const long long ns = static_cast<long long>(to_utc(stamp).unix_ns);
  std::string zeros;
  for (int i = 0; i < 9; ++i) zeros += ",0.0";
  return formatted("%lld,%d,%lld,imu,0.0,0.0,0.0,1.0", ns, k, ns) + zeros + formatted(",%.9f,%.9f,%.9f", w.x(), w.y(), w.z()) + zeros +
         formatted(",%.8f,%.8f,%.8f", f.x(), f.y(), f.z()) + zeros + '\n';
}

}  // namespace detail

/// The IMU log: CSV in body axes, the LORD log in its raw axes (left, forward, down), or another of the layouts.
[[nodiscard]] inline std::string imu_text(const Simulation& s, Layout layout, const ProgressCall& progress) {
  constexpr double deg = 180 / std::numbers::pi;
  std::string text = detail::imu_header(layout);
  ImuSensor sensor = s.imu();
  const int rate = static_cast<int>(std::llround(s.options().imu_rate_hz));
  const int last = static_cast<int>(std::llround(s.options().duration_s * rate)) + rate;
  for (int k = -rate; k <= last; ++k) {
    if (k % (20 * rate) == 0) progress(static_cast<double>(k) / last);
    const double t = static_cast<double>(k) / rate;
    const ImuTruth m = sensor.measure(s.vehicle(), t);
    const Eigen::Vector3d &f = m.f_b_mps2, &w = m.w_ib_b_radps;
    const GpsTime stamp = s.options().start.plus_seconds(t);
    if (layout == Layout::plain) {
      text += formatted("%ld,%.4f,%.7f,%.7f,%.7f,%.6f,%.6f,%.6f\n", static_cast<long>(stamp.week()), stamp.sow(), w.x(), w.y(), w.z(),
                        f.x(), f.y(), f.z());
      continue;
    }
    if (layout == Layout::ppc) {
      text += formatted("%.2f,%ld,%.6f,%.6f,%.6f,%.7f,%.7f,%.7f\n", stamp.sow(), static_cast<long>(stamp.week()), f.y(), -f.x(), f.z(),
                        w.y() * deg, -w.x() * deg, w.z() * deg);
      continue;
    }
    if (layout == Layout::urbannav) {
      text += detail::ros_reading(k + rate, stamp, f, w);
      continue;
    }
    const double whole = std::floor(stamp.sow() + 1e-6);
    text += formatted("%ld, %.0f, %.4f, %.6f, %.6f, %.6f, %.7f, %.7f, %.7f\n", static_cast<long>(stamp.week()), whole,
                      std::abs(stamp.sow() - whole), -f.x(), f.y(), -f.z(), -w.x(), w.y(), -w.z());
  }
  return text;
}

/// stereo_tracks.csv from the first epoch to the last.
[[nodiscard]] inline std::string tracks_text(const Simulation& s, const ProgressCall& progress) {
  std::string text = "t_gps_sow,track_id,u_left,u_right,v,score,semantic_class\n";
  StereoCamera camera = s.camera();
  const double rate = s.options().camera_rate_hz;
  const int last = static_cast<int>(std::llround(s.options().duration_s * rate));
  for (int k = 0; k <= last; ++k) {
    if (k % 100 == 0) progress(static_cast<double>(k) / (last + 1));
    const double t = k / rate;
    for (const TrackObservation& o : camera.frame(s.at_exposure(t)))
      text += formatted("%.3f,%d,%.2f,%.2f,%.2f,%.2f,%d\n", detail::sow(s, t), o.track, o.u_left_px, o.u_right_px, o.v_px, o.score,
                        o.semantic_class);
  }
  return text;
}

[[nodiscard]] inline std::string label_line(const Simulation& s, const SignalLabel& l, District district) {
  constexpr double deg = 180 / std::numbers::pi;
  return formatted("%ld,%.1f,%c%02d,%s,%s,%.3f,%.1f,%.3f,%.4f,%.2f,%.2f,%.1f,%d,%d,%d,%s,%s\n", detail::week(s, l.tag_s),
                   detail::sow(s, l.tag_s), l.system, l.number, l.code, kSignalStateNames[static_cast<std::size_t>(l.state)], l.extra_m,
                   l.loss_db, l.code_multipath_m, l.phase_multipath_m, std::fmod(l.azimuth_rad * deg + 360, 360), l.elevation_rad * deg,
                   l.cn0_dbhz, l.has_code ? 1 : 0, l.has_phase ? 1 : 0, l.lli, kPhaseHappeningNames[static_cast<std::size_t>(l.happening)],
                   kDistrictNames[static_cast<std::size_t>(district)]);
}

namespace detail {

inline void count(DistrictSummary& summary, const SignalLabel& l) {
  const bool first = std::string_view{l.code} == "1C" || std::string_view{l.code} == "2I";
  if (first) ++summary.satellites[static_cast<std::size_t>(l.state)], summary.tracked += l.has_code ? 1 : 0;
  if (!l.has_code) return;
  ++summary.signals;
  if (l.state == SignalState::diffracted || l.state == SignalState::nlos) ++summary.bad_signals;
  if (l.tag_s > 0 && (l.happening == PhaseHappening::new_lock || l.happening == PhaseHappening::silent_lock)) ++summary.locks;
  if (l.happening == PhaseHappening::slip || l.happening == PhaseHappening::silent_slip) ++summary.slips;
}

}  // namespace detail

namespace detail {

/// What the files of a layout are called.
struct FileNames {
  std::string rover, base, nav, imu;
};
[[nodiscard]] inline FileNames file_names(Layout layout, GpsTime start) {
  const CivilTime day = civil_from_gps(start);
  const int day_of_year = static_cast<int>(days_from_civil(day.year, day.month, day.day) - days_from_civil(day.year, 1, 1)) + 1;
  const std::string brdm = formatted("brdm%03d0.%02dp", day_of_year, day.year % 100);
  if (layout == Layout::texcup) return {"asterx4_rover.obs", "asterx4_base_1hz.obs", brdm, "lord_imu.log"};
  if (layout == Layout::ppc) return {"rover.obs", "base.obs", "base.nav", "imu.csv"};
  if (layout == Layout::urbannav) return {"UrbanNav-SIM.ublox.f9p.obs", "hksc_base.obs", brdm, "xsense_imu_sim.csv"};
  return {"rover.obs", "base.obs", "nav.rnx", "imu.csv"};
}

}  // namespace detail

/// Makes all files. `progress` gets the share that is done.
[[nodiscard]] inline Dataset make_dataset(
    const Simulation& s, Layout layout, const ProgressCall& progress = [](double) {}) {
  const GpsTime start = s.options().start;
  const double rate = s.options().rover_rate_hz;
  const auto part = [&progress](double from, double to) {
    return [&progress, from, to](double share) { progress(from + share * (to - from)); };
  };
  Dataset set;
  for (double t = 0; t < s.options().duration_s; t += 0.1)
    set.distance_m += (s.vehicle().path(t + 0.1).p_m - s.vehicle().path(t).p_m).norm();

  std::string rover_text = observation_header("ROVER", s.vehicle().antenna_e_m(0), start, 1 / rate);
  std::string labels =
      "week,sow,satellite,signal,state,extra_m,loss_db,code_multipath_m,phase_multipath_m,azimuth_deg,elevation_deg,cn0_dbhz,"
      "code,phase,lli,event,district\n";
  CityReceiver rover = s.rover(), base = s.base();
  const int epochs = static_cast<int>(std::llround(s.options().duration_s * rate));
  for (int k = 0; k <= epochs; ++k) {
    if (k % 20 == 0) progress(0.4 * k / (epochs + 1));
    const double tag_s = k / rate;
    const Epoch epoch = rover.measure(tag_s);
    if (!epoch.satellites.empty()) rover_text += observation_epoch(epoch, start);
    const District district = district_on(s.way(), tag_s);
    DistrictSummary& summary = set.districts[static_cast<std::size_t>(district)];
    ++summary.epochs, summary.length_s += 1 / rate;
    for (const SignalLabel& l : rover.labels()) labels += label_line(s, l, district), detail::count(summary, l);
  }
  std::string base_text = observation_header("BASE", s.base_e_m(), start);
  for (int k = 0; k <= static_cast<int>(s.options().duration_s); ++k) base_text += observation_epoch(base.measure(k), start);

  const detail::FileNames names = detail::file_names(layout, start);
  set.files.push_back({names.rover, std::move(rover_text)});
  set.files.push_back({names.base, std::move(base_text)});
  set.files.push_back({names.nav, navigation_file(s.records())});
  set.files.push_back({names.imu, imu_text(s, layout, part(0.45, 0.8))});
  set.files.push_back({"truth.csv", truth_text(s)});
  if (layout == Layout::texcup) set.files.push_back({"ground_truth.log", ground_truth_text(s)});
  if (layout == Layout::ppc) set.files.push_back({"reference.csv", reference_text(s)});
  if (layout == Layout::urbannav) set.files.push_back({"UrbanNav_SIM_GT_raw.txt", span_truth_text(s)});
  if (layout == Layout::plain) set.files.push_back({"streets.csv", streets_text(s)});
  set.files.push_back({"rig.json", rig_text(s, layout)});
  set.files.push_back({"stereo_tracks.csv", tracks_text(s, part(0.82, 1))});
  set.files.push_back({"labels.csv", std::move(labels)});
  progress(1);
  return set;
}

}  // namespace searvins::simulator
