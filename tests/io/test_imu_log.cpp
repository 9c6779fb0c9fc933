// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include <searvins/io/imu_log.hpp>

#include "tests/support/property.hpp"
#include "tests/support/shared_data.hpp"

using namespace searvins;
using io::ImuFault;
using test::for_all_seeds;
using test::Rng;

namespace {

const io::ImuFinding* find(const io::ImuLog& log, ImuFault fault) {
  for (const io::ImuFinding& f : log.findings)
    if (f.fault == fault) return &f;
  return nullptr;
}

io::Parsed<io::ImuLog> parse(const std::string& text, const io::ImuLogOptions& options = {}) { return io::parse_imu_log(text, "imu.csv", options); }

/// "553950.010" from nanoseconds.
std::string seconds_text(std::int64_t ns) {
  const std::string fraction = std::to_string(ns % kNanosecondsPerSecond);
  return std::to_string(ns / kNanosecondsPerSecond) + '.' + std::string(9 - fraction.size(), '0') + fraction;
}

/// Rows of a CSV without header at 100 Hz, standing still; `row` may change each.
template <class Row>
std::string still_csv(int rows, Row row) {
  std::string text;
  for (int i = 0; i < rows; ++i) {
    std::array<double, 6> v{0.001, -0.002, 0.0005 * (i % 3), 0.1, 0.2, 9.79 + 0.01 * (i % 5)};
    row(i, v);
    text += seconds_text(553950'000'000'000 + i * 10'000'000LL);
    for (const double x : v) text += ',' + io::fixed_text(x, 6);
    text += '\n';
  }
  return text;
}
std::string still_csv(int rows) {
  return still_csv(rows, [](int, auto&) {});
}

}  // namespace

TEST_CASE("IMU log: the three formats and their column orders, nanoseconds exact") {
  const auto lord = parse("# LORD\n2323, 553950, 0.00, 0.1, 0.2, -9.8, -0.003, -0.001, -0.0001\n2323, 553950, 0.07, 0.1, 0.2, -9.8, -0.003, -0.001, -0.0001\n");
  REQUIRE(lord.ok());
  REQUIRE(lord.value.samples.size() == 2);
  CHECK(lord.value.has_week);
  CHECK(lord.value.samples[1].time == GpsTime{2323 * kNanosecondsPerWeek + 553950'070'000'000});
  CHECK(lord.value.samples[0].accel_b_mps2 == Eigen::Vector3d{0.1, 0.2, -9.8});
  CHECK(lord.value.samples[0].gyro_b_radps == Eigen::Vector3d{-0.003, -0.001, -0.0001});

  const auto bare = parse("0.1,1e-3,2e-3,3e-3,0.1,0.2,9.8\n0.3,1e-3,2e-3,3e-3,0.1,0.2,9.8\n");
  REQUIRE(bare.ok());
  CHECK_FALSE(bare.value.has_week);
  CHECK(bare.value.samples[1].time.ns == 300'000'000);
  CHECK(bare.value.samples[0].gyro_b_radps == Eigen::Vector3d{1e-3, 2e-3, 3e-3});
  CHECK(bare.value.interval_s == 0.2);

  const auto euroc = parse(
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
      "1403715273262142976,1e-3,2e-3,3e-3,9.1,0.1,-3.7\n");
  REQUIRE(euroc.ok());
  CHECK(to_utc(euroc.value.samples[0].time).unix_ns == 1403715273262142976);
  CHECK(euroc.value.samples[0].accel_b_mps2 == Eigen::Vector3d{9.1, 0.1, -3.7});
  io::ImuLogOptions gps;
  gps.nanoseconds = io::NanosecondScale::gps;
  CHECK(parse("#timestamp [ns],w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n1403715273262142976,0,0,0,0,0,9.8\n", gps).value.samples[0].time.ns ==
        1403715273262142976);

  const auto named = parse("gps_week,tow_s,accel_z,accel_y,accel_x,gyro_x,gyro_z,gyro_y,temperature\n2374,243261.8540,9.8,2,1,0.1,0.3,0.2,20\n");
  REQUIRE(named.ok());
  CHECK(named.value.samples[0].time == GpsTime{2374 * kNanosecondsPerWeek + 243261'854'000'000});
  CHECK(named.value.samples[0].accel_b_mps2 == Eigen::Vector3d{1, 2, 9.8});
  CHECK(named.value.samples[0].gyro_b_radps == Eigen::Vector3d{0.1, 0.2, 0.3});
  const auto units = parse("t,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n1,180,0,0,0,0,1\n");
  REQUIRE(units.ok());
  CHECK(units.value.samples[0].gyro_b_radps.x() == doctest::Approx(std::numbers::pi));
  CHECK(units.value.samples[0].accel_b_mps2.z() == 9.80665);
  CHECK(find(units.value, ImuFault::accel_in_g) == nullptr);  // the header said so
}

TEST_CASE("IMU log: property: what is written is read, to the nanosecond, over the end of the week and with noise in the order") {
  for_all_seeds(50, [](Rng& rng) {
    const std::int64_t start = test::chance(rng, 0.5) ? kNanosecondsPerWeek - 500'000'000 : test::integer(rng, 0, 600000) * kNanosecondsPerSecond;
    std::string text;
    std::vector<std::int64_t> times;
    std::int64_t t = start;
    long repeated = 0, backward = 0, nan = 0;
    const std::string tail = ",0.01,0.02,-0.01,0.3,-0.2,9.8\n";
    for (int i = 0; i < 200; ++i) {
      t += test::integer(rng, 1, 20'000'000);
      times.push_back(2300 * kNanosecondsPerWeek + t);
      text += seconds_text(t % kNanosecondsPerWeek) + tail;
      if (i < 2) continue;
      if (test::chance(rng, 0.05)) text += seconds_text(t % kNanosecondsPerWeek) + tail, ++repeated;
      if (test::chance(rng, 0.05)) text += seconds_text((t - 900'000'000 + kNanosecondsPerWeek) % kNanosecondsPerWeek) + tail, ++backward;
      if (test::chance(rng, 0.05)) text += seconds_text((t + 1) % kNanosecondsPerWeek) + ",nan,0,0,0,0,9.8\n", ++nan;
    }
    io::ImuLogOptions options;
    options.reference = GpsTime{2300 * kNanosecondsPerWeek + start};
    const auto log = parse(text, options);
    REQUIRE(log.ok());
    REQUIRE(log.value.samples.size() == times.size());
    for (std::size_t i = 0; i < times.size(); ++i) CHECK(log.value.samples[i].time.ns == times[i]);
    CHECK(log.skipped.count("repeated") == repeated);
    CHECK(log.skipped.count("before") == backward);
    CHECK(log.skipped.count("NaN") == nan);
  });
}

TEST_CASE("IMU log: one stamp in the far future costs one row, a true pause none") {
  std::string text = still_csv(100);
  const std::string wild = "9553950.0,0,0,0,0,0,9.8\n";
  const std::size_t middle = text.find("553950.5");
  const auto glitch = parse(text.substr(0, middle) + wild + text.substr(middle));
  REQUIRE(glitch.ok());
  CHECK(glitch.value.samples.size() == 100);
  CHECK(glitch.skipped.count("far ahead") == 1);
  CHECK(glitch.skipped.find("far ahead")->first_line == 51);

  const auto first = parse(wild + text);  // also as the first row
  REQUIRE(first.ok());
  CHECK(first.value.samples.size() == 100);
  CHECK(first.skipped.count("far ahead") == 1);
  const auto last = parse(text + wild);
  CHECK(last.value.samples.size() == 100);

  const auto pause = parse(text + "554950.00,0,0,0,0,0,9.8\n554950.01,0,0,0,0,0,9.8\n554950.02,0,0,0,0,0,9.8\n");
  REQUIRE(pause.ok());
  CHECK(pause.value.samples.size() == 103);
  CHECK(pause.skipped.total() == 0);
  REQUIRE(pause.value.gap_count == 1);
  CHECK(seconds_between(pause.value.gaps[0].from, pause.value.gaps[0].to) == doctest::Approx(999.01));
}

TEST_CASE("IMU log: bad lines are counted with line and reason, the run goes on") {
  std::string text = still_csv(20);
  text += "553950.30,0.1,0.1\n553950.31,0,0,0,0,0,9.8,77\n553950.32,x,0,0,0,0,9.8\n-5,0,0,0,0,0,9.8\n\n553950.33,0,0,0,0,0,inf\n553950.34,0,0,0,0,0,9.8\n553950.35,0,0,0,0";
  const auto log = parse(text);
  REQUIRE(log.ok());
  CHECK(log.value.samples.size() == 21);
  CHECK(log.skipped.find("too few")->first_line == 21);
  CHECK(log.skipped.find("too many")->first_line == 22);
  CHECK(log.skipped.find("not a number")->first_line == 23);
  CHECK(log.skipped.find("no GPS time")->first_line == 24);
  CHECK(log.skipped.find("NaN or infinity")->first_line == 26);
  CHECK(log.skipped.find("cut off")->first_line == 28);
  CHECK(log.skipped.total() == 6);
  CHECK(log.value.gap_count == 1);
  CHECK(parse(still_csv(3) + "\xEF\xBB\xBF").value.samples.size() == 3);
}

TEST_CASE("IMU log: files that cannot be used say what they are and what to do") {
  CHECK(io::read_imu_log("/no/such/imu.log").error->message == "no such file");
  CHECK(io::read_imu_log("/tmp").error->message.find("folder") != std::string::npos);
  CHECK(parse("").error->message == "the file is empty");
  CHECK(parse("\x1f\x8b\x08 packed").error->hint.find("gunzip") != std::string::npos);
  const auto rinex = parse("     3.04           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n");
  CHECK(rinex.error->message.find("RINEX observation") != std::string::npos);
  CHECK(rinex.error->hint.find("t,gx,gy,gz,ax,ay,az") != std::string::npos);
  const auto missing = parse("t,gx,gy,gz,ax,ay\n1,2,3,4,5,6\n");
  REQUIRE(missing.error);
  CHECK(missing.error->line == 1);
  CHECK(missing.error->message.find("no accelerometer column az") != std::string::npos);
  CHECK(parse("week,gx,gy,gz,ax,ay,az\n1,2,3,4,5,6,7\n").error->message.find("no time column") != std::string::npos);
  const auto hollow = parse("t,gx,gy,gz,ax,ay,az\n1,nan,0,0,0,0,9\n");
  CHECK(hollow.error->message == "has no usable row");
  CHECK(hollow.error->hint.find("NaN") != std::string::npos);
}

TEST_CASE("IMU log: wrong units are said, and converted on demand") {
  const std::string in_g = still_csv(200, [](int, auto& v) { v[3] /= 9.80665, v[4] /= 9.80665, v[5] /= 9.80665; });
  const auto g = parse(in_g);
  REQUIRE(find(g.value, ImuFault::accel_in_g));
  CHECK(find(g.value, ImuFault::accel_in_g)->text.message.find("the unit is g, converted") != std::string::npos);
  CHECK(g.value.samples[0].accel_b_mps2.z() == doctest::Approx(9.79).epsilon(1e-4));
  io::ImuLogOptions keep;
  keep.convert_units = false;
  const auto kept = parse(in_g, keep);
  CHECK(find(kept.value, ImuFault::accel_in_g));
  CHECK(kept.value.samples[0].accel_b_mps2.z() == doctest::Approx(0.9983).epsilon(1e-3));

  CHECK(find(parse(still_csv(200, [](int, auto& v) { v[5] = 998; })).value, ImuFault::accel_in_mg));
  const auto deg = parse(still_csv(200, [](int i, auto& v) { v[2] = i % 4 ? 1.0 : 15.0; }));
  REQUIRE(find(deg.value, ImuFault::gyro_in_degrees));
  CHECK(deg.value.samples[0].gyro_b_radps.z() == doctest::Approx(15 * std::numbers::pi / 180));
  CHECK(find(parse(still_csv(200, [](int, auto& v) { v[5] = 0.05, v[3] = 0.1, v[4] = 0; })).value, ImuFault::gravity_missing));
  CHECK(find(parse(still_csv(200, [](int, auto& v) { v[5] = 32.1; })).value, ImuFault::accel_magnitude));
  const auto exchanged = parse(still_csv(200, [](int, auto& v) { std::swap(v[0], v[3]), std::swap(v[1], v[4]), std::swap(v[2], v[5]); }));
  CHECK(find(exchanged.value, ImuFault::columns_exchanged));
  CHECK(parse(still_csv(200)).value.findings.empty());
}

TEST_CASE("IMU log: saturation is found, ordinary extremes and quantised rest are not") {
  const auto clipped = parse(still_csv(200, [](int i, auto& v) {
    if (i >= 50 && i < 58) v[3] = -39.2266;
    if (i >= 100 && i < 102) v[2] = 4.36;  // twice is no plateau
  }));
  REQUIRE(find(clipped.value, ImuFault::saturation));
  CHECK(find(clipped.value, ImuFault::saturation)->count == 8);
  CHECK(find(clipped.value, ImuFault::saturation)->text.message.find("channel ax") != std::string::npos);
  CHECK(clipped.value.findings.size() == 1);
  CHECK(parse(still_csv(200, [](int, auto& v) { v[5] = 9.8; })).value.findings.empty());
}

TEST_CASE("IMU log: axes: gravity on the wrong side is said with the axis that is up") {
  auto log = parse(still_csv(100, [](int, auto& v) { v[5] = -v[5]; }));
  REQUIRE(log.ok());
  const auto wrong = io::check_gravity_axis(log.value.samples, Eigen::Matrix3d::Identity(), "imu.csv");
  REQUIRE(wrong);
  CHECK(wrong->text.message.find("wrong way") != std::string::npos);
  CHECK(wrong->text.message.find("on -z") != std::string::npos);
  CHECK(wrong->text.hint.find("up is the log's axis -z") != std::string::npos);
  Eigen::Matrix3d R_b_raw;  // raw left-forward-down: the rig's ["-x", "y", "-z"]
  R_b_raw << -1, 0, 0, 0, 1, 0, 0, 0, -1;
  io::turn_axes(log.value.samples, R_b_raw);
  CHECK(log.value.samples[0].accel_b_mps2.isApprox(Eigen::Vector3d{-0.1, 0.2, 9.79}, 1e-9));
  CHECK_FALSE(io::check_gravity_axis(log.value.samples, R_b_raw, "imu.csv"));
  Eigen::Matrix3d sideways;
  sideways << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  io::turn_axes(log.value.samples, sideways);
  const auto tipped = io::check_gravity_axis(log.value.samples, sideways * R_b_raw, "imu.csv");
  REQUIRE(tipped);
  CHECK(tipped->text.message.find("on x") != std::string::npos);
  CHECK(tipped->text.hint.find("axis -z") != std::string::npos);
  CHECK(io::check_imu_rate(0.01, 200, "imu.csv")->text.message.find("100.0 samples a second") != std::string::npos);
  CHECK_FALSE(io::check_imu_rate(0.01, 100, "imu.csv"));
}

TEST_CASE("IMU log: the recordings") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  struct Expected {
    const char* file;
    std::size_t samples;
    double interval_s, gravity;
    long gaps;
  };
  for (const Expected& e : {Expected{"data/twin/a-clean/imu.log", 114001, 0.01, 9.80, 0}, Expected{"data/real/boulder_drive_2025/imu.csv", 54859, 0.01, 9.95, 0},
                            Expected{"data/real/boulder_walk_2025/imu.csv", 20455, 0.006, 9.96, 11},
                            Expected{"data/real/euroc_v101_static/mav0/imu0/data.csv", 4000, 0.005, 9.81, 0},
                            Expected{"data/real/euroc_v102_imu/imu0/data.csv", 7999, 0.005, 9.876, 0}}) {
    CAPTURE(e.file);
    const auto log = io::read_imu_log(*shared / e.file);
    REQUIRE(log.ok());
    CHECK(log.value.samples.size() == e.samples);
    CHECK(log.value.interval_s == doctest::Approx(e.interval_s).epsilon(0.1));
    CHECK(log.value.gap_count == e.gaps);
    CHECK(log.skipped.total() == 0);
    CHECK(log.value.has_week);
    double norm = 0;
    for (const imu::ImuSample& s : log.value.samples) norm += s.accel_b_mps2.norm() / static_cast<double>(e.samples);
    CHECK(norm == doctest::Approx(e.gravity).epsilon(0.01));
    for (const io::ImuFinding& f : log.value.findings) MESSAGE(to_string(f.text));
    CHECK(log.value.findings.empty());
  }
}
