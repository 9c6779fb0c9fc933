// SPDX-License-Identifier: BSD-3-Clause
// Recordings in the EuRoC layout: calibration, pairs, truth; what is refused and what is counted.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "examples/datasets/euroc.hpp"
#include "examples/support/png_writer.hpp"
#include "tests/support/property.hpp"
#include "tests/support/shared_data.hpp"

using namespace searvins;
using namespace searvins::examples;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kStartNs = 1'403'715'273'000'000'000, kPeriodNs = 50'000'000;

std::string camera_text(double baseline_m, const char* resolution = "[64, 48]") {
  return "%YAML:1.0\n# a comment\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, " + std::to_string(baseline_m) +
         ",\n         0.0, 1.0, 0.0, 0.0,\n         0.0, 0.0, 1.0, 0.0,   # translation last\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: "
         "20\nresolution: " +
         resolution +
         "\ncamera_model: pinhole\nintrinsics: [60, 60, 31.5, 23.5] #fu, fv, cu, cv\ndistortion_model: radial-tangential\n"
         "distortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n";
}

/// A small recording in a folder of its own, which goes with it.
class SmallRecording {
 public:
  explicit SmallRecording(const char* name, int frames = 10, std::int64_t right_late_ns = 0)
      : root_(fs::temp_directory_path() / (std::string{"searvins_euroc_"} + name)) {
    fs::remove_all(root_);
    for (const char* camera : {"cam0", "cam1"}) {
      fs::create_directories(root_ / "mav0" / camera / "data");
      const bool is_right = camera[3] == '1';
      write(std::string{camera} + "/sensor.yaml", camera_text(is_right ? 0.11 : 0));
      std::string list = "#timestamp [ns],filename\n";
      for (int k = 0; k < frames; ++k) {
        const std::string stamp = std::to_string(kStartNs + k * kPeriodNs + (is_right ? right_late_ns : 0));
        list += stamp + ',' + stamp + ".png\r\n";
        REQUIRE(write_png((root_ / "mav0" / camera / "data" / (stamp + ".png")).string(), GrayImage(64, 48, static_cast<std::uint8_t>(k)))
                    .empty());
      }
      write(std::string{camera} + "/data.csv", list);
    }
  }
  ~SmallRecording() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  SmallRecording(const SmallRecording&) = delete;
  SmallRecording& operator=(const SmallRecording&) = delete;

  [[nodiscard]] const fs::path& root() const { return root_; }
  [[nodiscard]] fs::path file(const std::string& name) const { return root_ / "mav0" / name; }
  [[nodiscard]] fs::path image(const char* camera, int k) const {
    return file(std::string{camera} + "/data/" + std::to_string(kStartNs + k * kPeriodNs) + ".png");
  }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories(file(name).parent_path());
    std::ofstream{file(name), std::ios::binary} << text;
  }

 private:
  fs::path root_;
};

/// Reading must fail with a message that says all this.
void check_refused(const io::Parsed<EurocRecording>& read, const std::vector<const char*>& parts) {
  REQUIRE_FALSE(read.ok());
  const std::string text = io::to_string(*read.error);
  for (const char* part : parts) CHECK_MESSAGE(text.find(part) != std::string::npos, text);
  CHECK_FALSE(read.error->hint.empty());
}

}  // namespace

TEST_CASE("sensor.yaml: mappings, lists over lines, comments, quotes") {
  const auto yaml = parse_sensor_yaml(
      "%YAML:1.0\n---\n\na: 1.5 # one\nname: \"x # y\"\nouter:\n  inner:\n    deep: [1, -2e3,  # why\n       3]\n  b: two words\nempty: "
      "[]\n"
      "T: !!opencv-matrix\n   rows: 4\n",
      "s.yaml");
  REQUIRE(yaml.ok());
  CHECK(*yaml->number("a") == 1.5);
  CHECK(*yaml->text("name") == "x # y");
  CHECK(*yaml->text("outer.b") == "two words");
  CHECK(*yaml->numbers("outer.inner.deep", 3, 3) == std::vector<double>{1, -2000, 3});
  CHECK(yaml->find("outer.inner.deep")->line == 8);
  CHECK(yaml->find("empty")->items.empty());
  CHECK(*yaml->number("T.rows") == 4);
  CHECK(yaml->text("nothing").error().message.find("nothing") != std::string::npos);
  CHECK(yaml->number("name").error().line == 5);
  CHECK(yaml->numbers("outer.inner.deep", 4, 5).error().message.find("4 to 5 numbers, it has 3") != std::string::npos);
  CHECK(yaml->text("outer.inner.deep").error().message.find("is a list") != std::string::npos);
}

TEST_CASE("sensor.yaml: what is no such file is refused with its line") {
  struct Case {
    const char *text, *what;
    long line;
  };
  for (const Case& c : {Case{"a: 1\njust words\n", "no 'key: value'", 2},
                        {"a: [1, 2\nb: 3\n", "no closing bracket", 2},
                        {"a: [1] x\n", "behind the closing", 1},
                        {"a:\n\tb: 1\n", "tab", 2},
                        {"a: 1\na: 2\n", "already given", 2},
                        {"a: &x 1\n", "not understood", 1},
                        {"- a: 1\n", "no 'key: value'", 1},
                        {"# nothing\n", "there is no", 1}}) {
    const auto yaml = parse_sensor_yaml(c.text, "s.yaml");
    REQUIRE_FALSE(yaml.ok());
    CHECK_MESSAGE(yaml.error().message.find(c.what) != std::string::npos, yaml.error().message);
    CHECK_MESSAGE(yaml.error().line == c.line, c.text);
  }
}

TEST_CASE("sensor.yaml: no text makes it fail otherwise than by value") {
  test::for_all_seeds(300, [](test::Rng& rng) {
    std::string text = camera_text(0.1);
    for (int i = test::integer(rng, 1, 12); i > 0; --i) {
      const auto at = static_cast<std::size_t>(test::integer(rng, 0, static_cast<int>(text.size()) - 1));
      constexpr std::string_view kBytes = "[]:#\n\t -,\"'&0123456789abc";
      if (test::chance(rng, 0.5))
        text[at] = kBytes[static_cast<std::size_t>(test::integer(rng, 0, static_cast<int>(kBytes.size()) - 1))];
      else
        text.erase(at, static_cast<std::size_t>(test::integer(rng, 1, 9)));
    }
    const auto yaml = parse_sensor_yaml(text, "s.yaml");
    const auto camera = yaml.ok() ? read_euroc_camera(*yaml) : io::FileResult<EurocCamera>{yaml.error()};
    if (!camera.ok()) {
      CHECK_FALSE(camera.error().message.empty());
      return;
    }
    CHECK((camera->pose.R_bs.transpose() * camera->pose.R_bs - Eigen::Matrix3d::Identity()).norm() < 1e-12);
    CHECK(camera->model.width_px >= 16);
  });
}

TEST_CASE("calibration: two poses in the body give the pose of one camera in the other") {
  test::for_all_seeds(100, [](test::Rng& rng) {
    EurocCamera left, right;
    for (EurocCamera* c : {&left, &right}) {
      c->pose.R_bs = Eigen::AngleAxisd(test::uniform(rng, -3, 3), test::random_vector(rng).normalized()).toRotationMatrix();
      c->pose.t_bs_m = test::random_vector(rng);
    }
    const auto stereo = stereo_calibration(left, right);
    const Eigen::Vector3d p_c0 = test::random_vector(rng, 10);
    const Eigen::Vector3d p_b = left.pose.R_bs * p_c0 + left.pose.t_bs_m;
    CHECK(test::close(stereo.R_c1_c0 * p_c0 + stereo.t_c1_c0_m, right.pose.R_bs.transpose() * (p_b - right.pose.t_bs_m), 1e-12));
    CHECK(test::close(stereo.R_b_c0 * p_c0 + stereo.p_b_c0_m, p_b, 1e-12));
  });
}

TEST_CASE("calibration: what cannot be right is refused by name") {
  const auto refuse = [](const std::string& from, const std::string& to, const char* what) {
    std::string text = camera_text(0.1);
    const std::size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
    const auto yaml = parse_sensor_yaml(text, "cam0/sensor.yaml");
    REQUIRE(yaml.ok());
    const auto camera = read_euroc_camera(*yaml);
    REQUIRE_FALSE(camera.ok());
    CHECK_MESSAGE(io::to_string(camera.error()).find(what) != std::string::npos, io::to_string(camera.error()));
    CHECK_FALSE(camera.error().hint.empty());
  };
  refuse("[1.0, 0.0, 0.0,", "[1.1, 0.0, 0.0,", "sensor.yaml:7: T_BS is no rotation");
  refuse("[1.0, 0.0, 0.0,", "[-1.0, 0.0, 0.0,", "T_BS is no rotation");
  refuse("0.0, 0.0, 0.0, 1.0]", "0.0, 0.0, 1.0, 1.0]", "last row");
  refuse("pinhole", "omni", "the camera model is omni");
  refuse("radial-tangential", "equidistant", "the distortion model is equidistant");
  refuse("[60, 60, 31.5, 23.5]", "[60, 60, 31.5]", "list of 4 numbers, it has 3");
  refuse("[60, 60, 31.5, 23.5]", "[60, 60, 367, 248]", "principal point lies outside");
  refuse("[60, 60, 31.5, 23.5]", "[0, 60, 31.5, 23.5]", "focal length");
  refuse("[64, 48]", "[64, 48.5]", "no image size");
  refuse("rate_hz: 20", "rate: 20", "there is no rate_hz");
}

TEST_CASE("EuRoC layout: a whole recording, named by its folder or by mav0") {
  const SmallRecording small("whole");
  for (const fs::path& folder : {small.root(), small.root() / "mav0"}) {
    const auto read = read_euroc(folder);
    REQUIRE_MESSAGE(read.ok(), (read.error ? io::to_string(*read.error) : std::string{}));
    const EurocRecording& r = read.value;
    REQUIRE(r.pairs.size() == 10);
    CHECK(r.period_s == doctest::Approx(0.05));
    CHECK(read.skipped.total() == 0);
    CHECK(r.imu.samples.empty());
    CHECK(r.truth.empty());
    CHECK(r.pairs[3].ns == kStartNs + 3 * kPeriodNs);
    CHECK(r.pairs[3].time == to_gps(UtcTime{r.pairs[3].ns}));
    const auto images = read_euroc_pair(r, r.pairs[3]);
    REQUIRE(images.ok());
    CHECK(images->left(5, 5) == 3);
    CHECK(images->right(5, 5) == 3);
    EurocOptions gps;
    gps.nanoseconds = io::NanosecondScale::gps;
    CHECK(read_euroc(folder, gps).value.pairs[3].time.ns == kStartNs + 3 * kPeriodNs);
  }
}

TEST_CASE("EuRoC layout: single images that are missing cost their pair and are counted") {
  const SmallRecording small("missing");
  fs::remove(small.image("cam1", 4));
  fs::remove(small.image("cam0", 7));
  small.write("cam1/data.csv", [&] {
    std::string list = "#timestamp [ns],filename\nnonsense\n";
    for (const int k : {0, 1, 2, 4, 3, 5, 6, 7, 8, 9})
      list += std::to_string(kStartNs + k * kPeriodNs) + ',' + std::to_string(kStartNs + k * kPeriodNs) + ".png\n";
    return list;
  }());
  const auto read = read_euroc(small.root());
  REQUIRE(read.ok());
  // Missing: right 4 and left 7. Row 3 of the right list stands behind the (absent) row 4, so it is still in order.
  CHECK(read.value.pairs.size() == 8);
  CHECK(read.skipped.count("cam1/data.csv: the image file is not there") == 1);
  CHECK(read.skipped.count("cam0/data.csv: the image file is not there") == 1);
  CHECK(read.skipped.count("cam1/data.csv: row that is no") == 1);
  CHECK(read.skipped.count("left image without a right one") == 1);
  CHECK(read.skipped.count("right image without a left one") == 1);
  for (const EurocPair& pair : read.value.pairs) CHECK(read_euroc_pair(read.value, pair).ok());
}

TEST_CASE("EuRoC layout: small differences of the stamps are nothing, half a period is refused") {
  const SmallRecording near("near", 10, 4'000'000);
  const auto good = read_euroc(near.root());
  REQUIRE(good.ok());
  CHECK(good.value.pairs.size() == 10);
  const SmallRecording half("half", 10, kPeriodNs / 2);
  check_refused(read_euroc(half.root()), {"only 0 of 10 left images", "cam1 is 25.0 ms away from cam0", "period is 50.0 ms"});
  EurocOptions loose;
  loose.pair_tolerance_share = 0.51;
  CHECK(read_euroc(half.root(), loose).ok());
}

TEST_CASE("EuRoC layout: no right camera, no images, one place for both cameras, calibration of another size") {
  {
    const SmallRecording small("no_right");
    fs::remove_all(small.file("cam1"));
    check_refused(read_euroc(small.root()), {"there is no cam1", "stereo"});
    fs::remove_all(small.file("cam0"));
    check_refused(read_euroc(small.root()), {"there is no cam0"});
    check_refused(read_euroc(small.root() / "nowhere"), {"there is no cam0"});
  }
  {
    const SmallRecording small("no_images");
    fs::remove_all(small.file("cam1/data"));
    check_refused(read_euroc(small.root()), {"cam1/data.csv", "no row names an image that is there"});
  }
  {
    const SmallRecording small("no_baseline");
    small.write("cam1/sensor.yaml", camera_text(0));
    check_refused(read_euroc(small.root()), {"cam1/sensor.yaml", "no stereo baseline"});
  }
  {
    const SmallRecording small("other_size");
    small.write("cam1/sensor.yaml", camera_text(0.11, "[80, 60]"));
    check_refused(read_euroc(small.root()), {"the image is 64 x 48, the calibration is for 80 x 60", "cam1/sensor.yaml"});
  }
  {
    const SmallRecording small("one_size_changes");
    REQUIRE(write_png(small.image("cam0", 6).string(), GrayImage(32, 48)).empty());
    const auto read = read_euroc(small.root());
    REQUIRE(read.ok());
    CHECK(read_euroc_pair(read.value, read.value.pairs[5]).ok());
    CHECK(read_euroc_pair(read.value, read.value.pairs[6]).error().message.find("32 x 48") != std::string::npos);
  }
  {
    const SmallRecording small("bad_yaml");
    small.write("cam0/sensor.yaml", "T_BS: [1\n");
    check_refused(read_euroc(small.root()), {"cam0/sensor.yaml:1", "no closing bracket"});
  }
}

TEST_CASE("EuRoC truth: rows that cannot be used are counted; none at all is an error") {
  const std::string row = ",1,2,3,0.5,0.5,0.5,0.5,4,5,6,0,0,0,0,0,0\n";
  const auto truth =
      parse_euroc_truth("#timestamp\n" + std::to_string(kStartNs) + row + std::to_string(kStartNs) + row + "x" + row +
                            std::to_string(kStartNs + 1) + ",1,2,3,0.5,0.5,0.5,0.9\n" + std::to_string(kStartNs + 2) + ",1,2,3,1,0,0,0\n",
                        "gt.csv");
  REQUIRE(truth.ok());
  REQUIRE(truth.value.size() == 2);
  CHECK(truth.skipped.count("not later") == 1);
  CHECK(truth.skipped.count("norm 1") == 1);
  CHECK(truth.skipped.count("no stamp") == 1);
  CHECK(test::close(truth.value[0].p_w_m, Eigen::Vector3d{1, 2, 3}, 1e-15));
  CHECK(test::close(truth.value[0].v_w_mps, Eigen::Vector3d{4, 5, 6}, 1e-15));
  CHECK(truth.value[1].q_wb.w() == 1);
  CHECK(truth.value[1].v_w_mps.norm() == 0);
  CHECK_FALSE(parse_euroc_truth("#only a header\n", "gt.csv").ok());
}

TEST_CASE("EuRoC V1_01 at rest: twelve pairs, calibration, IMU") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const auto read = read_euroc(*shared / "data/real/euroc_v101_static");
  REQUIRE_MESSAGE(read.ok(), (read.error ? io::to_string(*read.error) : std::string{}));
  const EurocRecording& r = read.value;
  CHECK(r.pairs.size() == 12);
  CHECK(read.skipped.total() == 0);
  CHECK(r.period_s == doctest::Approx(0.05).epsilon(1e-4));
  CHECK(r.left.model.fx_px == 458.654);
  CHECK(r.right.model.lens.k2 == 0.07451284);
  CHECK(r.left.rate_hz == 20);
  REQUIRE(r.imu_noise.has_value());
  CHECK(r.imu_noise->gyro_noise_radps_sqrt_hz == 1.6968e-4);
  CHECK(r.imu_noise->accel_bias_walk_mps3_sqrt_hz == 3e-3);
  CHECK(r.imu.samples.size() == 4000);
  CHECK(r.imu.interval_s == doctest::Approx(0.005).epsilon(1e-3));
  CHECK(r.imu.samples.front().time == r.pairs.front().time);
  // The pair: 11 cm apart along x of the left camera, axes within two degrees of each other.
  const auto stereo = stereo_calibration(r.left, r.right);
  CHECK(stereo.t_c1_c0_m.norm() == doctest::Approx(0.11007).epsilon(1e-3));
  CHECK(-stereo.t_c1_c0_m.x() / stereo.t_c1_c0_m.norm() > 0.9999);
  CHECK(Eigen::AngleAxisd(stereo.R_c1_c0).angle() < 0.035);
  for (const EurocPair& pair : r.pairs) {
    const auto images = read_euroc_pair(r, pair);
    REQUIRE(images.ok());
    CHECK(images->left.width() == 752);
    CHECK(images->right.height() == 480);
  }
}

TEST_CASE("EuRoC V1_02: IMU and ground truth agree in time and in rotation") {
  const auto shared = test::shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const fs::path folder = *shared / "data/real/euroc_v102_imu";
  const auto imu = io::read_imu_log(folder / "imu0/data.csv");
  const auto truth = read_euroc_truth((folder / "gt0/data.csv").string());
  REQUIRE(imu.ok());
  REQUIRE(truth.ok());
  CHECK(truth.skipped.total() == 0);
  CHECK(seconds_between(truth.value.front().time, truth.value.back().time) == doctest::Approx(83.475).epsilon(1e-4));
  // Mean rate between rows of the truth against the mean of the gyro there, where the vehicle turns: within its bias (0.08 rad/s).
  int compared = 0;
  double worst_radps = 0;
  for (std::size_t i = 0; i + 40 < truth.value.size(); i += 40) {
    const EurocPose &a = truth.value[i], &b = truth.value[i + 40];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (const imu::ImuSample& m : imu.value.samples)
      if (m.time > a.time && m.time <= b.time) sum += m.gyro_b_radps, ++count;
    if (count < 150) continue;
    const Eigen::AngleAxisd turn(a.q_wb.conjugate() * b.q_wb);
    if (turn.angle() > 1.0) continue;  // the mean rate says little about a long turn
    const Eigen::Vector3d rate = turn.angle() * turn.axis() / seconds_between(a.time, b.time);
    worst_radps = std::max(worst_radps, (rate - sum / count).norm());
    ++compared;
  }
  CHECK(compared > 15);
  CHECK(worst_radps < 0.2);
}
