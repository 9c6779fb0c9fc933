// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Tracks from files: the format with its variants, every way to get it wrong, label images, and the simulated drive of the shared data.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "examples/precomputed_frontend/label_folder.hpp"
#include "examples/precomputed_frontend/precomputed_frontend.hpp"
#include "examples/support/png_writer.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using precomputed::TrackReader;
using Frame = vision::StereoFrame<64>;

namespace {

const std::string kHeader = "t_gps_sow,track_id,u_left,u_right,v,score,semantic_class\n";

struct ReadFile {
  std::vector<Frame> frames;
  std::string error;
  TrackReader reader;
};

ReadFile read(const std::string& text, std::int64_t week = 2300) {
  ReadFile out;
  if (const auto error = out.reader.open_text(text, "tracks.csv", week)) {
    out.error = io::to_string(*error);
    return out;
  }
  for (Frame frame;;) {
    const auto more = out.reader.next(frame);
    if (!more) out.error = io::to_string(more.error());
    if (!more || !*more) return out;
    out.frames.push_back(frame);
  }
}

}  // namespace

TEST_CASE("Rows of one time are a frame") {
  const ReadFile f =
      read(kHeader + "10.0,1,532.0,516.1,451.7,0.96,1\n10.0,2,1206.1,1136.5,607.3,0.80,4\r\n\n# a remark\n10.1,2,1200,1130,600,1,-1\n");
  CHECK(f.error.empty());
  REQUIRE(f.frames.size() == 2);
  REQUIRE(f.frames[0].observations.size() == 2);
  CHECK(f.frames[0].time == GpsTime::from_week_sow(2300, 10.0));
  const vision::StereoObservation& o = f.frames[0].observations[1];
  CHECK(o.track == 2);
  CHECK(o.pixel_px == Eigen::Vector3d{1206.1, 1136.5, 607.3});
  CHECK(o.score == 0.80);
  CHECK(o.semantic_class == 4);
  CHECK(std::isnan(o.v_difference_px));
  CHECK(f.frames[1].observations[0].semantic_class == vision::kUnlabelled);
}

TEST_CASE("Columns may stand in any order, some may be missing, others may be there") {
  const ReadFile f = read("track_id,v,v_right,u_right,u_left,t_gps_sow,descriptor\n7,100.5,100.25,40,50,3.5,xyz\n");
  CHECK(f.error.empty());
  REQUIRE(f.frames.size() == 1);
  const vision::StereoObservation& o = f.frames[0].observations[0];
  CHECK(o.disparity_px() == 10);
  CHECK(o.score == 1);
  CHECK(o.semantic_class == vision::kUnlabelled);
  CHECK(o.v_difference_px == 0.25);
}

TEST_CASE("A row that cannot be read names the file and the line; the frames before it are there") {
  const std::string good = kHeader + "10.0,1,532.0,516.1,451.7,0.96,1\n10.1,1,532.0,516.1,451.7,0.96,1\n";
  struct Wrong {
    std::string row, part;
  };
  for (const Wrong& wrong : std::vector<Wrong>{{"10.2,1,5,4,3,0.9", "6 fields"},
                                               {"10.2,1,5,4,3,0.9,1,9", "8 fields"},
                                               {"10.2,x,5,4,3,0.9,1", "track_id"},
                                               {"10.2,-1,5,4,3,0.9,1", "track_id"},
                                               {"10.2,1,nan,4,3,0.9,1", "u_left"},
                                               {"10.2,1,5,1e9,3,0.9,1", "u_right"},
                                               {"10.2,1,5,4,,0.9,1", "v is"},
                                               {"10.2,1,5,4,3,1.01,1", "score"},
                                               {"10.2,1,5,4,3,0.9,256", "semantic_class"},
                                               {"604800,1,5,4,3,0.9,1", "t_gps_sow"},
                                               {"9.9,1,5,4,3,0.9,1", "before that of the row above"}}) {
    CAPTURE(wrong.row);
    const ReadFile f = read(good + wrong.row + "\n10.3,1,5,4,3,0.9,1\n");
    CHECK(f.error.find("tracks.csv:4: ") == 0);
    CHECK(f.error.find(wrong.part) != std::string::npos);
    CHECK(f.frames.size() == 1);  // the second is not known to be whole
  }
}

TEST_CASE("Files without header, columns or rows") {
  CHECK(read("10.0,1,532.0,516.1,451.7,0.96,1\n").error.find("tracks.csv:1: the header has no column t_gps_sow") == 0);
  CHECK(read("t_gps_sow,track_id,u_left,u_right\n").error.find("no column v") != std::string::npos);
  CHECK(read("").error.find("the file is empty") != std::string::npos);
  CHECK(read(kHeader).frames.empty());
  CHECK(read(kHeader).error.empty());
  TrackReader reader;
  CHECK(reader.open("/nowhere/tracks.csv", 2300)->message == "no such file");
}

TEST_CASE("A cut last line and a track that stands twice are left out and counted; negative disparity is for admission to judge") {
  const ReadFile f = read(kHeader + "10.0,1,5,4,3,0.9,1\n10.0,1,50,40,30,0.9,1\n10.0,2,5,9,3,0.9,1\n10.1,1,5,4,3,0.");
  CHECK(f.error.empty());
  REQUIRE(f.frames.size() == 1);
  REQUIRE(f.frames[0].observations.size() == 2);
  CHECK(f.frames[0].observations[0].pixel_px[0] == 5);
  CHECK(f.frames[0].observations[1].disparity_px() == -4);
  CHECK(f.reader.skipped().count("track twice") == 1);
  CHECK(f.reader.skipped().count("cut off") == 1);
}

TEST_CASE("A frame of 200 observations in room for 64: the best stay, the rest is counted") {
  std::string text = kHeader;
  for (int i = 0; i < 200; ++i) text += "10.0," + std::to_string(i) + ",5,4,3,0." + std::to_string(100 + i) + ",1\n";
  const ReadFile f = read(text);
  REQUIRE(f.frames.size() == 1);
  CHECK(f.frames[0].observations.size() == 64);
  CHECK(f.frames[0].dropped == 136);
  for (const auto& o : f.frames[0].observations) CHECK(o.track >= 136);
}

TEST_CASE("A drive over the end of a week") {
  const ReadFile f = read(kHeader + "604799.9,1,5,4,3,0.9,1\n0.0,1,5,4,3,0.9,1\n0.1,1,5,4,3,0.9,1\n");
  REQUIRE(f.frames.size() == 3);
  CHECK(seconds_between(f.frames[0].time, f.frames[2].time) == doctest::Approx(0.2));
}

TEST_CASE("Text of nonsense ends in a message or in rows, never worse") {
  const std::string letters = "0123456789.,-\n#e x";
  test::for_all_seeds(200, [&](test::Rng& rng) {
    std::string text = kHeader;
    for (int i = test::integer(rng, 1, 300); i > 0; --i)
      text += letters[static_cast<std::size_t>(test::integer(rng, 0, int(letters.size()) - 1))];
    const ReadFile f = read(text);
    for (const Frame& frame : f.frames)
      for (const auto& o : frame.observations) CHECK(o.finite());
  });
}

TEST_CASE("Behind the seam: frames by the time of the pair, gaps on either side are counted") {
  TrackReader reader;
  REQUIRE_FALSE(
      reader.open_text(kHeader + "10.0,1,5,4,3,0.9,1\n10.1,1,5,4,3,0.9,1\n10.3,3,5,4,3,0.9,1\n10.4,3,5,4,3,0.9,1\n10.5,x,\n", "t", 2300));
  precomputed::PrecomputedFrontend<64> frontend{reader};
  const auto ask = [&](double sow) {
    const GpsTime time = GpsTime::from_week_sow(2300, sow);
    Frame frame;
    frame.time = time;
    const Status status = frontend.process({{}, {}, time, time}, std::nullopt, frame);
    CHECK(frame.time == time);
    return status.ok() ? static_cast<int>(frame.observations.size()) : -1;
  };
  CHECK(ask(10.001) == 1);
  CHECK(ask(10.05) == 0);
  CHECK(ask(10.2) == 0);  // 10.1 is passed, 10.3 is not there yet
  CHECK(frontend.without_tracks() == 2);
  CHECK(frontend.without_images() == 1);
  CHECK(ask(10.3) == 1);
  CHECK(ask(10.4) == -1);  // whether the frame is whole is not known
  REQUIRE(frontend.error().has_value());
  CHECK(frontend.error()->line == 6);
}

TEST_CASE("Label images by time") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "searvins_label_folder_test";
  std::filesystem::create_directories(folder / "data");
  examples::GrayImage labels(4, 3, 11);
  labels(2, 1) = 13;
  REQUIRE(examples::write_png((folder / "data/a.png").string(), labels.pixels(), 4, 3, 1).empty());
  const auto list = [&](const std::string& text) { std::ofstream{folder / "data.csv"} << text; };
  list("#timestamp [ns],filename\n1000000000,a.png\n1100000000,b.png\n");
  precomputed::LabelFolder of;
  REQUIRE_FALSE(of.open(folder));
  CHECK(of.size() == 2);
  for (const std::int64_t ns : {1000000000, 1004000000, 996000000}) {
    const auto image = of.at(GpsTime{ns});
    REQUIRE(image.ok());
    REQUIRE(*image != nullptr);
    CHECK((**image)(2, 1) == 13);
    CHECK((**image)(0, 0) == 11);
  }
  CHECK(*of.at(GpsTime{1020000000}) == nullptr);
  CHECK_FALSE(of.at(GpsTime{1100000000}).ok());  // listed and not there
  list("#timestamp [ns],filename\n1000000000\n");
  CHECK(of.open(folder)->line == 2);
  list("#timestamp [ns],filename\n");
  CHECK(of.open(folder)->message == "lists no image");
  std::filesystem::remove_all(folder);
  CHECK(of.open(folder).has_value());
}

TEST_CASE("The simulated drive of the shared data is read whole") {
  const auto shared = test::shared_data();
  const std::filesystem::path path = shared ? *shared / "data/twin/a-urban/stereo_tracks.csv" : std::filesystem::path{};
  if (!shared || !std::filesystem::exists(path)) {
    MESSAGE("SKIPPED: shared data not found (data/twin/a-urban)");
    return;
  }
  TrackReader reader;
  REQUIRE_FALSE(reader.open(path, 2323));
  vision::StereoFrame<128> frame;
  std::size_t frames = 0, observations = 0;
  std::uint64_t last_track = 0;
  std::optional<GpsTime> last;
  while (true) {
    const auto more = reader.next(frame);
    REQUIRE(more.ok());
    if (!*more) break;
    if (last) CHECK(frame.time > *last);
    last = frame.time;
    ++frames, observations += frame.observations.size();
    CHECK(frame.dropped == 0);
    for (const auto& o : frame.observations) last_track = std::max(last_track, o.track);
  }
  MESSAGE(frames << " frames, " << observations << " observations, highest track " << last_track);
  CHECK(observations == 517322);
  CHECK(frames > 11000);
  CHECK(reader.skipped().total() == 0);
}
