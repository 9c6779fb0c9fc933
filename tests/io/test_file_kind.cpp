// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <string_view>

#include <searvins/io/file_kind.hpp>

#include "support/rinex_text.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using io::FileKind;

TEST_CASE("the sort of a file is told from its first bytes") {
  const auto kind = [](std::string_view text) { return io::sniff_text(text).kind; };
  CHECK(kind("") == FileKind::unreadable);
  CHECK(kind("\x1f\x8b\x08\x08") == FileKind::gzip);
  CHECK(kind("\x1f\x9d\x90") == FileKind::unix_compress);
  CHECK(kind("PK\x03\x04") == FileKind::zip);
  CHECK(kind("BZh91AY") == FileKind::bzip2);
  CHECK(kind("\xfd"
             "7zXZ") == FileKind::xz);
  CHECK(kind(test::header_line("3.0                 COMPACT RINEX FORMAT", "CRINEX VERS   / TYPE")) == FileKind::hatanaka);
  CHECK(kind(test::header_line("     3.04           OBSERVATION DATA    M", "RINEX VERSION / TYPE")) == FileKind::rinex_observation);
  CHECK(kind(test::header_line("     2.10           N: GPS NAV DATA", "RINEX VERSION / TYPE")) == FileKind::rinex_navigation);
  CHECK(kind(test::header_line("     2.10           METEOROLOGICAL DATA", "RINEX VERSION / TYPE")) == FileKind::rinex_other);
  CHECK(kind("2323, 553950, 0.00, 0.1318, 0.2551, -9.8009, -0.00326, -0.00181, -0.00011\n") == FileKind::lord_log);
  CHECK(kind("# LORD\n2323, 553950, 0.00, 0.1, 0.2, -9.8, -0.003, -0.001, -0.0001\n") == FileKind::lord_log);
  CHECK(kind("t,gx,gy,gz,ax,ay,az\n") == FileKind::imu_csv);
  CHECK(kind("0.01,0,0,0,0,0,9.8\n") == FileKind::imu_csv);
  CHECK(kind("#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y\n") == FileKind::imu_csv);
  CHECK(kind("t_gps_sow,track_id,u_left,u_right,v,score,semantic_class\n") == FileKind::stereo_tracks);
  CHECK(kind("week,sow,ecef_x_m,ecef_y_m,ecef_z_m,status\n") == FileKind::trajectory);
  CHECK(kind("t,ant_x,ant_y,ant_z\n") == FileKind::truth);
  CHECK(kind("2176,282600.000,-3961953.0196,3381199.0462,3668915.4194\n") == FileKind::truth);
  CHECK(kind("% program   : RTKPOST\n") == FileKind::rtklib_pos);
  CHECK(kind("\n  { \"schema\": 1 }") == FileKind::json);
  CHECK(kind("hello world\n") == FileKind::unknown);
  CHECK(io::sniff("/no/such/file").kind == FileKind::unreadable);

  const io::SniffedFile rinex = io::sniff_text(test::header_line("     3.04           OBSERVATION DATA    M", "RINEX VERSION / TYPE"));
  CHECK(rinex.rinex_version == 3.04);
  CHECK(rinex.rinex_type == 'O');
}

TEST_CASE("bad input: a compressed file is refused with the tool that opens it") {
  const auto hint = [](FileKind kind) { return io::to_string(io::refuse_compressed(kind, "a.obs.gz").value_or(io::Diagnostic{})); };
  CHECK(hint(FileKind::gzip) == "a.obs.gz: the file is gzip compressed. run `gunzip a.obs.gz` first");
  CHECK(hint(FileKind::unix_compress) == "a.obs.gz: the file is Unix compress (.Z) compressed. run `gunzip a.obs.gz` first");
  CHECK(hint(FileKind::hatanaka) == "a.obs.gz:1: the file is Hatanaka (CRINEX) compressed. run `CRX2RNX a.obs.gz` first");
  CHECK(hint(FileKind::zip).find("unzip") != std::string::npos);
  CHECK(hint(FileKind::bzip2).find("bunzip2") != std::string::npos);
  CHECK(hint(FileKind::xz).find("unxz") != std::string::npos);
  CHECK_FALSE(io::refuse_compressed(FileKind::rinex_observation, "a").has_value());
  CHECK_FALSE(io::refuse_compressed(FileKind::unknown, "a").has_value());
}

TEST_CASE("every shared recording is recognised") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto kind = [&](const char* path) { return io::sniff(*shared / "data" / path).kind; };
  CHECK(kind("real/kamakura_drive_2021/rover.obs") == FileKind::rinex_observation);
  CHECK(kind("real/geonet_static_2005/07590920.05n") == FileKind::rinex_navigation);
  CHECK(kind("real/boulder_drive_2025/imu.csv") == FileKind::imu_csv);
  CHECK(kind("real/euroc_v102_imu/imu0/data.csv") == FileKind::imu_csv);
  CHECK(kind("real/boulder_drive_2025/onboard_rtk.pos") == FileKind::rtklib_pos);
  CHECK(kind("real/kamakura_drive_2021/reference.csv") == FileKind::truth);
  CHECK(kind("real/spirent_rose_iono-Klob/truth_pva_10hz.csv") == FileKind::truth);
  CHECK(kind("twin/a-clean/imu.log") == FileKind::lord_log);
  CHECK(kind("twin/a-clean/stereo_tracks.csv") == FileKind::stereo_tracks);
  CHECK(kind("twin/a-clean/truth.csv") == FileKind::truth);
  CHECK(kind("twin/a-clean/ground_truth.log") == FileKind::truth);
  CHECK(kind("twin/a-clean/rig.json") == FileKind::json);
}
