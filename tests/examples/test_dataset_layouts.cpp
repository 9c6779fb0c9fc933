// SPDX-License-Identifier: BSD-3-Clause
// Folders of published recordings: simulated drives in their files are read back as the drives they are; spoilt ones are refused with the
// file, the line and what to do.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/math/so3.hpp>
#include <searvins/vision/rectification.hpp>

#include "command_runner.hpp"
#include "examples/datasets/dataset_inputs.hpp"
#include "examples/datasets/sensor_yaml.hpp"
#include "examples/support/angle_units.hpp"
#include "simulated_files.hpp"
#include "support/temporary_folder.hpp"

using namespace searvins;
using namespace searvins::examples;
namespace fs = std::filesystem;
namespace sim = searvins::simulator;

namespace {

using searvins::examples::kDegPerRad;

/// The files of a recording, to be read and spoilt.
class LayoutFolder : public test::TemporaryFolder {
 public:
  explicit LayoutFolder(const std::string& name) : TemporaryFolder("layout_" + name) {}
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((path() / name).parent_path());
    REQUIRE(io::write_text_file((path() / name).string(), text).empty());
  }
  [[nodiscard]] std::string read(const std::string& name) const { return *io::read_text_file((path() / name).string()); }
  /// Applies a change to a file's text.
  void change(const std::string& name, const std::function<std::string(std::string)>& how) const { write(name, how(read(name))); }
};

constexpr double kDrive_s = 24;

/// The drive of the tests, of today or of another time.
sim::SimulationOptions drive_options() { return test::options_of("light", kDrive_s, 7); }
sim::SimulationOptions published_options() {
  sim::SimulationOptions options = drive_options();
  options.start = texcup::kWindow.first;
  options.origin_e_m = texcup::kBase_e_m;
  return options;
}

/// Its files, made once each.
const sim::Dataset& files(sim::Layout layout) {
  static const sim::Simulation drive(drive_options());
  static std::array<std::optional<sim::Dataset>, 4> made;
  auto& set = made[static_cast<std::size_t>(layout)];
  if (!set) set = sim::make_dataset(drive, layout);
  return *set;
}
const sim::Dataset& published_files() {
  static const sim::Simulation drive(published_options());
  static const sim::Dataset set = sim::make_dataset(drive, sim::Layout::texcup);
  return set;
}

void fill(const LayoutFolder& folder, const sim::Dataset& set, bool with_rig = true) {
  for (const sim::DatasetFile& file : set.files)
    if (with_rig || file.name != "rig.json") folder.write(file.name, file.text);
}

/// Every `from` of a text replaced; there must be one.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size(), ++n) text.replace(at, from.size(), to);
  REQUIRE_MESSAGE(n > 0, from);
  return text;
}

/// The rows of a separated text with their fields exchanged by `how`; the first `header` rows stay.
std::string rows_changed(const std::string& text, char separator, int header, const std::function<void(std::vector<std::string>&)>& how) {
  std::string out;
  io::LineReader lines{text};
  std::string_view line;
  while (lines.next(line)) {
    if (lines.number() <= header) {
      (out += line) += '\n';
      continue;
    }
    std::vector<std::string> fields;
    for (const std::string_view f : io::split(line, separator)) fields.emplace_back(f);
    how(fields);
    for (std::size_t i = 0; i < fields.size(); ++i) (out += i ? std::string{separator} : std::string{}) += fields[i];
    out += '\n';
  }
  return out;
}

bool has_note(const DatasetRecording& r, const std::string& part) {
  return std::any_of(r.notes.begin(), r.notes.end(), [&](const std::string& n) { return n.find(part) != n.npos; });
}
std::string all_notes(const DatasetRecording& r) {
  std::string text;
  for (const std::string& n : r.notes) text += n + '\n';
  return text;
}

/// A folder that must be refused: the message, file and hint in one text.
std::string refusal(const std::string& layout, const LayoutFolder& folder, const DatasetChoice& choice = {}) {
  const auto read = read_dataset(layout, folder.path(), choice);
  REQUIRE_FALSE(read.ok());
  CHECK_MESSAGE(!read.error().hint.empty(), read.error().message);
  return io::to_string(read.error());
}
void check_has(const std::string& text, std::initializer_list<const char*> parts) {
  for (const std::string part : parts) CHECK_MESSAGE(text.find(part) != text.npos, "'" << part << "' in: " << text);
}

/// Readings of a log in right-forward-up axes of a rig.
std::vector<imu::ImuSample> body_readings(const std::string& path, const Rig& rig) {
  io::ImuLogOptions options;
  options.reference = drive_options().start;
  auto log = io::read_imu_log(path, options);
  REQUIRE_MESSAGE(log.ok(), io::to_string(*log.error));
  io::turn_axes(log.value.samples, rig.R_rfu_b * rig.imu->R_b_raw);
  return log.value.samples;
}

/// The readings and the antenna as the plain layout tells them.
struct PlainDrive {
  LayoutFolder folder{"plain"};
  std::vector<imu::ImuSample> readings;
  TruthTrack truth;
  Rig rig;
  PlainDrive() {
    fill(folder, files(sim::Layout::plain));
    rig = *read_rig((folder.path() / "rig.json").string());
    readings = body_readings((folder.path() / "imu.csv").string(), rig);
    truth = *read_truth((folder.path() / "truth.csv").string(), drive_options().start);
  }
};

void check_same_readings(const std::vector<imu::ImuSample>& a, const std::vector<imu::ImuSample>& b) {
  REQUIRE(a.size() == b.size());
  double time_ns = 0, accel = 0, gyro = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    time_ns = std::max(time_ns, std::abs(static_cast<double>(a[i].time.ns - b[i].time.ns)));
    accel = std::max(accel, (a[i].accel_b_mps2 - b[i].accel_b_mps2).norm());
    gyro = std::max(gyro, (a[i].gyro_b_radps - b[i].gyro_b_radps).norm());
  }
  CHECK(time_ns < 1000);
  CHECK(accel < 3e-6);  // what the decimals of the files leave
  CHECK(gyro < 3e-7);
}

void check_same_truth(const std::string& path, const TruthTrack& plain, double tolerance_m, std::size_t rows) {
  const auto truth = read_truth(path);
  REQUIRE_MESSAGE(truth.ok(), io::to_string(truth.error()));
  CHECK(truth->points.size() == rows);
  double worst_m = 0;
  for (const TruthPoint& p : truth->points) {
    const auto there = truth_at(plain, p.time);
    if (there) worst_m = std::max(worst_m, (*there - p.p_e_m).norm());
    CHECK(there.has_value());
  }
  CHECK(worst_m < tolerance_m);
}

void check_same_rig(const Rig& a, const Rig& b) {
  const Eigen::Matrix3d Ra = a.R_rfu_b * a.imu->R_b_raw, Rb = b.R_rfu_b * b.imu->R_b_raw;
  CHECK((Ra - Rb).norm() < 1e-12);
  CHECK(a.imu->rate_hz == b.imu->rate_hz);
  CHECK(a.imu->sample == b.imu->sample);
  CHECK(a.imu->accel_noise_mps2_sqrt_hz == b.imu->accel_noise_mps2_sqrt_hz);
  CHECK(a.imu->gyro_bias_sigma_radps == b.imu->gyro_bias_sigma_radps);
  CHECK((a.R_rfu_b * *a.lever_arm_b_m - b.R_rfu_b * *b.lever_arm_b_m).norm() < 1e-12);
  CHECK(a.base_position_e_m.has_value() == b.base_position_e_m.has_value());
  if (a.base_position_e_m) CHECK((*a.base_position_e_m - *b.base_position_e_m).norm() < 1e-9);
  REQUIRE(a.camera.has_value() == b.camera.has_value());
  if (a.camera) {
    CHECK((a.R_rfu_b * a.camera->R_b_c - b.R_rfu_b * b.camera->R_b_c).norm() < 1e-12);
    CHECK((a.R_rfu_b * a.camera->t_b_c_m - b.R_rfu_b * b.camera->t_b_c_m).norm() < 1e-12);
    CHECK(a.camera->sigma_px == b.camera->sigma_px);
    REQUIRE(a.camera->rectified.has_value() == b.camera->rectified.has_value());
    if (a.camera->rectified) CHECK(a.camera->rectified->baseline_m == b.camera->rectified->baseline_m);
    if (a.camera->unrectified) CHECK(a.camera->unrectified->T_c1_c0 == b.camera->unrectified->T_c1_c0);
  }
  REQUIRE(a.gnss.has_value() == b.gnss.has_value());
  if (a.gnss) {
    CHECK(a.gnss->signals == b.gnss->signals);
    CHECK(a.gnss->code_sigma_m == b.gnss->code_sigma_m);
    CHECK(a.gnss->phase_sigma_m == b.gnss->phase_sigma_m);
    CHECK(a.gnss->max_base_age_s == b.gnss->max_base_age_s);
  }
  CHECK(a.reject_classes == b.reject_classes);
}

/// An APPROX POSITION XYZ line.
std::string position_record(const Eigen::Vector3d& p) {
  return sim::header_record(sim::formatted("%14.4f%14.4f%14.4f", p.x(), p.y(), p.z()), "APPROX POSITION XYZ");
}
std::string moved_header(const std::string& text, const Eigen::Vector3d& p_e_m) {
  const std::size_t label = text.find("APPROX POSITION XYZ");
  REQUIRE(label != text.npos);
  const std::size_t begin = text.rfind('\n', label) + 1, end = text.find('\n', label) + 1;
  return text.substr(0, begin) + position_record(p_e_m) + text.substr(end);
}

}  // namespace

TEST_CASE("dataset rigs: a rig and its text are the same vehicle, whatever axes it is in") {
  Rig flu = texcup::published_rig();
  flu.R_rfu_b << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  flu.reject_classes = std::vector<int>{3, 6};
  flu.gnss->code_sigma_m["G1C"] = {0.9, 1.95};
  Rig unrectified = texcup::published_rig();
  unrectified.camera->rectified.reset();
  unrectified.camera->unrectified = RigUnrectified{texcup::port_lens(), texcup::star_lens(), texcup::star_from_port()};
  for (const Rig& rig : {texcup::published_rig(), flu, unrectified, ppc::published_rig(ppc::kCities[0], true),
                         ppc::published_rig(ppc::kCities[1], false), urbannav::hong_kong_rig(true)}) {
    const auto read = parse_rig(rig_text(rig), "rig.json");
    REQUIRE_MESSAGE(read.ok(), io::to_string(read.error()));
    CHECK(read->R_rfu_b.isIdentity());
    check_same_rig(*read, rig);
  }
}

TEST_CASE("dataset rigs: TEX-CUP's two calibrations of the pair agree with each other and with its rectification") {
  const SensorPose port = texcup::port_pose(), star = texcup::star_pose();
  Eigen::Matrix3d R_b_c1;  // the published T_b_c1, which nothing above was made from
  R_b_c1 << 0.9998547791713, 3.922622620624e-05, -0.01704168505911, 0.01704148871, 0.003022233074425, 0.9998502156672, 9.072429496171e-05,
      -0.9999954322738, 0.003021125709942;
  CHECK((star.R_bs - R_b_c1).norm() < 1e-10);
  CHECK((star.t_bs_m - Eigen::Vector3d(0.1946601517749, 0.01397294941063, 0.03392408212856)).norm() < 1e-10);
  CHECK((star.t_bs_m - port.t_bs_m).norm() == doctest::Approx(0.49766988960617).epsilon(1e-9));

  vision::StereoCalibration<double> calibration;
  const auto lens = [](const RigCamera& c) {
    vision::PinholeCamera<double> model;
    model.fx_px = c.intrinsics_px[0], model.fy_px = c.intrinsics_px[1], model.cx_px = c.intrinsics_px[2], model.cy_px = c.intrinsics_px[3];
    model.lens.k1 = c.distortion_radtan[0], model.lens.k2 = c.distortion_radtan[1], model.lens.p1 = c.distortion_radtan[2],
    model.lens.p2 = c.distortion_radtan[3];
    model.width_px = 2048, model.height_px = 732;
    return model;
  };
  calibration.eyes = {lens(texcup::port_lens()), lens(texcup::star_lens())};
  calibration.R_c1_c0 = texcup::star_from_port().topLeftCorner<3, 3>(),
  calibration.t_c1_c0_m = texcup::star_from_port().topRightCorner<3, 1>();
  calibration.R_b_c0 = port.R_bs, calibration.p_b_c0_m = port.t_bs_m;
  const auto pair = vision::rectify(calibration);
  REQUIRE(pair.ok());
  const Rig rig = texcup::published_rig();
  CHECK(pair->camera().baseline_m == doctest::Approx(rig.camera->rectified->baseline_m).epsilon(1e-5));
  const Eigen::Matrix3d apart =
      rig.camera->R_b_c.transpose() * pair->camera().R_bc;  // both have x along the baseline; only the turn about it is a choice
  CHECK(std::abs(apart(0, 0) - 1) < 1e-8);
  CHECK(Eigen::AngleAxisd(apart).angle() * kDegPerRad < 0.1);
  CHECK((pair->camera().p_bc_m - rig.camera->t_b_c_m).norm() < 1e-12);
}

TEST_CASE("dataset times: the scored window of TEX-CUP is 4040 seconds of 2019-05-09, 18:09:40 to 19:16:59 UTC") {
  CHECK(to_utc(texcup::kWindow.first).unix_ns == 1557425380LL * kNanosecondsPerSecond);
  CHECK(texcup::kWindow.last.ns - texcup::kWindow.first.ns == (texcup::kEpochs - 1) * kNanosecondsPerSecond);
  CHECK(to_utc(texcup::kWindow.last).unix_ns == (1557360000LL + 69419) * kNanosecondsPerSecond);
}

TEST_CASE("texcup: a simulated set is read as the drive it is: readings in body axes, antenna, base, tracks") {
  const PlainDrive plain;
  const LayoutFolder folder("texcup");
  fill(folder, files(sim::Layout::texcup));
  const auto read = read_texcup(folder.path());
  REQUIRE_MESSAGE(read.ok(), io::to_string(read.error()));
  CHECK(fs::path{read->rover}.filename() == "asterx4_rover.obs");
  CHECK(fs::path{read->base}.filename() == "asterx4_base_1hz.obs");
  REQUIRE(read->nav.size() == 1);
  CHECK(fs::path{read->nav[0]}.filename() == "brdm1620.25p");
  CHECK(fs::path{read->tracks}.filename() == "stereo_tracks.csv");
  CHECK(read->images.empty());
  CHECK_FALSE(read->start.has_value());  // not the published day
  CHECK_FALSE(has_note(*read, "as published"));
  CHECK_MESSAGE(has_note(*read, "rig.json"), all_notes(*read));

  const LayoutFolder out("texcup_out");
  const auto inputs = write_inputs(*read, out.path() / "inputs");
  REQUIRE(inputs.ok());
  CHECK(inputs->rig == (folder.path() / "rig.json").string());
  check_same_readings(body_readings(inputs->imu, read->rig), plain.readings);
  check_same_truth(inputs->truth, plain.truth, 2e-3, 27);
}

TEST_CASE("ppc, urbannav: a simulated set is read as the drive it is, through the files that the runner writes") {
  const PlainDrive plain;
  struct Case {
    sim::Layout layout;
    std::string name;
    std::size_t rows;
    double tolerance_m;
  };
  for (const Case& c : {Case{sim::Layout::ppc, "ppc", 121, 1e-3}, Case{sim::Layout::urbannav, "urbannav", 25, 2e-3}}) {
    const std::string& name = c.name;
    INFO(name);
    const LayoutFolder folder(name), out(name + "_out");
    fill(folder, files(c.layout));
    const auto read = read_dataset(name, folder.path());
    REQUIRE_MESSAGE(read.ok(), io::to_string(read.error()));
    CHECK(read->nav.size() == 1);
    CHECK(read->tracks.empty());  // neither is published with a camera of known place
    const auto inputs = write_inputs(*read, out.path() / "inputs");
    REQUIRE(inputs.ok());
    CHECK(inputs->imu == (out.path() / "inputs" / "imu.csv").string());
    check_same_readings(body_readings(inputs->imu, read->rig), plain.readings);
    check_same_truth(inputs->truth, plain.truth, c.tolerance_m, c.rows);

    DatasetChoice gnss_only;
    gnss_only.use_imu = false;
    const auto less = read_dataset(name, folder.path(), gnss_only);
    REQUIRE(less.ok());
    CHECK(less->imu.empty());
    CHECK_FALSE(less->imu_text.has_value());
  }
}

TEST_CASE("texcup: the published day without a rig.json: the published vehicle and window, and every count that differs") {
  const LayoutFolder folder("published");
  fill(folder, published_files(), false);
  fs::remove(folder.path() / "stereo_tracks.csv");
  for (const char* camera : {"camera_data/cam0", "camera_data/cam1"}) {
    const std::int64_t late_ns = std::string_view{camera}.ends_with('1') ? 2'000'000 : 0;  // the published pairs are within 1.6 ms
    std::string list = "#timestamp [ns],filename\n";
    for (int k = 0; k < 200; ++k) {
      const std::string ns = std::to_string(1557425380'047'799'300LL + 100'045'000LL * k + late_ns);
      list += ns + ',' + ns + ".png\n";
    }
    folder.write(std::string{camera} + "/data.csv", list);
    folder.write(std::string{camera} + "/data/one.png", "picture");
  }
  const auto read = read_texcup(folder.path());
  REQUIRE_MESSAGE(read.ok(), io::to_string(read.error()));
  CHECK(read->start == texcup::kWindow.first);
  CHECK(read->end == texcup::kWindow.last);
  CHECK(read->rig_file.empty());
  for (const char* part :
       {"asterx4_rover.obs: 25 epochs in the scored time, 4040 as published", "asterx4_base_1hz.obs: 25 epochs in the scored time, 4040",
        "lord_imu.log: 2501 readings in the scored time, 403995", "ground_truth.log: 26 rows in the scored time, 4040",
        "pictures: 200 pairs in the scored time, 40372", "2.00 ms apart", "from the published one"})
    CHECK_MESSAGE(has_note(*read, part), part << " in\n" << all_notes(*read));

  const LayoutFolder out("published_out");
  for (int again = 0; again < 2; ++again) {  // a second run writes over the first
    const auto inputs = write_inputs(*read, out.path() / "inputs");
    REQUIRE_MESSAGE(inputs.ok(), io::to_string(inputs.error()));
    const auto rig = read_rig(inputs->rig);
    REQUIRE_MESSAGE(rig.ok(), io::to_string(rig.error()));
    check_same_rig(*rig, texcup::published_rig());
    for (const bool is_star : {false, true}) {
      const fs::path camera = fs::path{inputs->images} / (is_star ? "cam1" : "cam0");
      CHECK(fs::exists(camera / "data" / "one.png"));
      CHECK(fs::exists(camera / "data.csv"));
      const auto yaml = read_sensor_yaml((camera / "sensor.yaml").string());
      REQUIRE_MESSAGE(yaml.ok(), io::to_string(yaml.error()));
      const auto eye = read_euroc_camera(*yaml);
      REQUIRE_MESSAGE(eye.ok(), io::to_string(eye.error()));
      const SensorPose pose = is_star ? texcup::star_pose() : texcup::port_pose();
      CHECK((eye->pose.R_bs - pose.R_bs).norm() < 1e-9);
      CHECK((eye->pose.t_bs_m - pose.t_bs_m).norm() < 1e-12);
      CHECK(eye->model.lens.p2 == (is_star ? texcup::star_lens() : texcup::port_lens()).distortion_radtan[3]);
    }
  }
  CHECK(fs::exists(folder.path() / "camera_data" / "cam0" / "data" / "one.png"));  // links were removed, not what they name
}

TEST_CASE("texcup: what cannot be used is refused with its file, its line and what to do") {
  const LayoutFolder folder("texcup_spoilt");
  const auto fresh = [&] { fill(folder, files(sim::Layout::texcup)); };
  const std::string imu = "lord_imu.log", truth = "ground_truth.log";

  check_has(io::to_string(read_texcup(folder.path() / "nowhere").error()), {"nowhere", "no such folder", "asterx4_rover.obs"});
  check_has(refusal("texcup", folder), {"there is no asterx4_rover.obs", "asterx4.sbf"});

  fresh();
  fs::remove(folder.path() / "brdm1620.25p");
  check_has(refusal("texcup", folder), {"no broadcast navigation file (brdm1290.19p)", "day 129 of 2019"});

  fresh();
  fs::remove(folder.path() / imu);
  check_has(refusal("texcup", folder), {"there is no lord_imu.log", "--sensors gnss"});

  fresh();  // angular rates first: the order of other logs
  folder.change(imu, [](const std::string& t) {
    return rows_changed(t, ',', 0, [](std::vector<std::string>& f) { std::swap_ranges(f.begin() + 3, f.begin() + 6, f.begin() + 6); });
  });
  check_has(refusal("texcup", folder), {"lord_imu.log:1", "the gyroscope columns hold the acceleration"});

  fresh();  // x and z exchanged
  folder.change(imu, [](const std::string& t) {
    return rows_changed(t, ',', 0, [](std::vector<std::string>& f) { std::swap(f[3], f[5]), std::swap(f[6], f[8]); });
  });
  check_has(refusal("texcup", folder), {"lord_imu.log:1", "gravity points the wrong way", "not in the published order"});

  fresh();  // a week is missing
  folder.change(imu, [](const std::string& t) {
    return "# Week, wholesec, fracsec, accel1, accel2, accel3, gyro1, gyro2, gyro3\n" +
           rows_changed(t, ',', 0, [](std::vector<std::string>& f) { f[0] = std::to_string(std::stoi(f[0]) - 1); });
  });
  check_has(refusal("texcup", folder), {"lord_imu.log:2", "is of another week than the rover", "GPS week 2369", "GPS week 2370"});

  fresh();
  folder.change(truth, [](const std::string& t) { return replaced(t, "2025/06/11", "2025/06/13"); });
  check_has(refusal("texcup", folder), {"ground_truth.log:2", "is of another time than the rover", "2025-06-13"});

  fresh();
  folder.change(truth, [](const std::string& t) { return replaced(t, "2025/06/11\t04:20:", "2025/06/11\t04-20:"); });
  check_has(io::to_string(read_texcup(folder.path()).error()), {"ground_truth.log:21", "is not a UTC date and time"});

  fresh();
  fs::remove(folder.path() / "rig.json");
  check_has(refusal("texcup", folder), {"asterx4_rover.obs", "is not of the published drive", "2019-05-09", "rig.json"});

  fresh();
  folder.change("rig.json", [](const std::string& t) { return replaced(t, "\"antenna\"", "\"antena\""); });
  check_has(io::to_string(read_texcup(folder.path()).error()), {"rig.json:", "antena"});

  fill(folder, published_files(), false);  // GPS time where UTC is meant
  fs::remove(folder.path() / "stereo_tracks.csv"), fs::remove(folder.path() / "rig.json"), fs::remove(folder.path() / "brdm1620.25p");
  for (const char* camera : {"cam0", "cam1"})
    folder.write(std::string{camera} + "/data.csv", "#timestamp [ns],filename\n1241460598047799300,a.png\n");
  check_has(refusal("texcup", folder), {"cam0/data.csv:2", "the pictures are of another time", "UTC nanoseconds"});
}

TEST_CASE("ppc: the city and the direction of z are found; what cannot be used is refused") {
  const LayoutFolder folder("ppc_spoilt");
  const auto fresh = [&] {
    fill(folder, files(sim::Layout::ppc), false);
    const ppc::City& nagoya = ppc::kCities[0];
    folder.change("base.obs", [&](const std::string& t) {
      return moved_header(t, dataset::ecef(nagoya.base_lat_deg, nagoya.base_lon_deg, nagoya.base_height_m) + Eigen::Vector3d{1, 2, 3});
    });
  };
  fresh();
  const auto up = read_ppc(folder.path());
  REQUIRE_MESSAGE(up.ok(), io::to_string(up.error()));
  CHECK_MESSAGE(has_note(*up, "z is up"), all_notes(*up));
  CHECK_MESSAGE(has_note(*up, "none of the six published runs"), all_notes(*up));
  check_same_rig(up->rig, ppc::published_rig(ppc::kCities[0], true));
  CHECK((*up->rig.lever_arm_b_m - Eigen::Vector3d(-0.670, 0.593, 1.216)).norm() < 1e-12);  // right, forward, up

  folder.change("imu.csv", [](const std::string& t) {  // forward, right, down
    return rows_changed(t, ',', 1, [](std::vector<std::string>& f) {
      for (const std::size_t i : {3U, 4U, 6U, 7U}) f[i] = f[i].starts_with('-') ? f[i].substr(1) : '-' + f[i];
    });
  });
  const auto down = read_ppc(folder.path());
  REQUIRE_MESSAGE(down.ok(), io::to_string(down.error()));
  CHECK_MESSAGE(has_note(*down, "z is down"), all_notes(*down));
  const LayoutFolder out("ppc_axes");
  out.write("up.csv", up->imu_text->text), out.write("down.csv", down->imu_text->text);
  check_same_readings(body_readings((out.path() / "up.csv").string(), up->rig),
                      body_readings((out.path() / "down.csv").string(), down->rig));

  fs::remove(folder.path() / "base.nav");
  check_has(refusal("ppc", folder), {"there is no base.nav", "nagoya/run1"});

  fresh();
  folder.change("imu.csv", [](const std::string& t) { return replaced(t, "Ang Rate Y", "Rate Y"); });
  check_has(refusal("ppc", folder), {"imu.csv:1", "angular rate Y"});

  fresh();
  folder.change("imu.csv",
                [](const std::string& t) { return rows_changed(t, ',', 1, [](std::vector<std::string>& f) { f[1] = "2371"; }); });
  check_has(refusal("ppc", folder), {"imu.csv:2", "is of another week than the rover", "GPS week 2371"});

  fresh();
  folder.change("reference.csv", [](const std::string& t) { return replaced(t, ",2370,", ",2369,"); });
  check_has(refusal("ppc", folder), {"reference.csv:2", "is of another week than the rover", "GPS week 2369"});

  fresh();
  folder.change("base.obs", [](const std::string& t) { return moved_header(t, texcup::kBase_e_m); });
  check_has(refusal("ppc", folder), {"base.obs", "neither that of Nagoya nor that of Tokyo", "rig.json"});
}

TEST_CASE("urbannav: files are told apart by what they hold; what cannot be used is refused") {
  const LayoutFolder folder("urbannav_spoilt");
  const auto fresh = [&] { fill(folder, files(sim::Layout::urbannav), false); };
  const std::string imu = "xsense_imu_sim.csv", truth = "UrbanNav_SIM_GT_raw.txt";
  fresh();
  const auto read = read_urbannav(folder.path());
  REQUIRE_MESSAGE(read.ok(), io::to_string(read.error()));
  check_same_rig(read->rig, urbannav::hong_kong_rig(false));
  CHECK_MESSAGE(has_note(*read, "samples a second, the rig says 400"), all_notes(*read));

  folder.write("old_base.obs", folder.read("hksc_base.obs"));
  check_has(refusal("urbannav", folder),
            {"more than one observation file of a base station", "hksc_base.obs, old_base.obs", "--base FILE"});
  DatasetChoice choice;
  choice.base = (folder.path() / "hksc_base.obs").string();
  CHECK(read_urbannav(folder.path(), choice).ok());
  fs::remove(folder.path() / "old_base.obs");

  folder.write("phone_imu_sim.csv", folder.read(imu));  // the telephone's is not the car's
  CHECK(read_urbannav(folder.path()).ok());
  fs::remove(folder.path() / "phone_imu_sim.csv");

  fs::rename(folder.path() / "brdm1620.25p", folder.path() / "ephemerides");
  DatasetChoice elsewhere;
  elsewhere.nav = {(folder.path() / "ephemerides").string()};
  CHECK(read_urbannav(folder.path(), elsewhere)->nav == elsewhere.nav);
  fs::remove(folder.path() / "ephemerides");
  check_has(refusal("urbannav", folder), {"no broadcast navigation file", "SatRef"});

  fresh();  // the week is one too few, UTCTime is not
  folder.change(truth, [](const std::string& t) { return replaced(t, "2370.00000", "2369.00000"); });
  check_has(refusal("urbannav", folder), {"UrbanNav_SIM_GT_raw.txt:3", "UTCTime and GPSTime disagree by 604800.0 s"});

  fresh();
  folder.change(truth, [](const std::string& t) { return t.substr(0, t.size() - 60); });
  check_has(refusal("urbannav", folder), {"UrbanNav_SIM_GT_raw.txt:27", "cut short"});

  fresh();
  folder.change(imu, [](const std::string& t) { return replaced(t, "field.angular_velocity.z,", "omega,"); });
  check_has(refusal("urbannav", folder), {"xsense_imu_sim.csv:1", "angular rate Z"});

  fresh();  // stamps of another day
  folder.change(imu, [](const std::string& t) { return replaced(t, ",174961", ",174951"); });
  check_has(refusal("urbannav", folder), {"xsense_imu_sim.csv:2", "is of another time than the rover"});

  fresh();  // Tokyo: no lever arm, no inertial unit
  fs::rename(folder.path() / "UrbanNav-SIM.ublox.f9p.obs", folder.path() / "rover_ublox.obs");
  fs::rename(folder.path() / "hksc_base.obs", folder.path() / "base_trimble.obs");
  fs::rename(folder.path() / "brdm1620.25p", folder.path() / "base.nav");
  const auto tokyo = read_urbannav(folder.path());
  REQUIRE_MESSAGE(tokyo.ok(), io::to_string(tokyo.error()));
  CHECK_FALSE(tokyo->imu_text.has_value());
  CHECK_MESSAGE(has_note(*tokyo, "no lever arm is published"), all_notes(*tokyo));
  CHECK_MESSAGE(has_note(*tokyo, "nothing is scored"), all_notes(*tokyo));
}

TEST_CASE("urbannav: the attitude of the truth turns forward to the heading and right to the right") {
  const Eigen::Vector3d forward = urbannav::enu_from_rfu(0, 0, 90) * Eigen::Vector3d::UnitY(),
                        right = urbannav::enu_from_rfu(0, 0, 90) * Eigen::Vector3d::UnitX();
  CHECK((forward - Eigen::Vector3d::UnitX()).norm() < 1e-12);                        // east
  CHECK((right + Eigen::Vector3d::UnitY()).norm() < 1e-12);                          // south
  CHECK((urbannav::enu_from_rfu(0, 10, 0) * Eigen::Vector3d::UnitY()).z() > 0.17);   // nose up
  CHECK((urbannav::enu_from_rfu(10, 0, 0) * Eigen::Vector3d::UnitX()).z() < -0.17);  // right side down
}

#ifdef SEARVINS_COMMAND
TEST_CASE("solve --dataset: a folder is solved and scored; what is missing is said with the exit code") {
  const LayoutFolder out("run_out");
  for (const auto& [layout, name] :
       {std::pair{sim::Layout::texcup, "texcup"}, std::pair{sim::Layout::ppc, "ppc"}, std::pair{sim::Layout::urbannav, "urbannav"}}) {
    const LayoutFolder folder(std::string{"run_"} + name);
    fill(folder, files(layout));
    const std::string place = " '" + folder.path().string() + "' --out '" + out.path().string() + "'";
    for (const char* sensors : {"gnss", "imu"}) {
      const test::Outcome run = test::run("solve --dataset " + std::string{name} + place + " --sensors " + sensors);
      INFO(run.output);
      CHECK(run.exit_code == 0);
      CHECK(test::has(run, "rig.json, not the published one"));
      CHECK(test::has(run, "H RMSE"));
      CHECK(fs::exists(out.path() / "report.html"));
    }
    fs::remove(folder.path() / (layout == sim::Layout::ppc ? "base.nav" : "brdm1620.25p"));
    const test::Outcome missing = test::run("solve --dataset " + std::string{name} + place);
    CHECK(missing.exit_code == 3);
    CHECK(test::has(missing, layout == sim::Layout::ppc ? "there is no base.nav" : "no broadcast navigation file"));
  }
  CHECK(test::run("solve --dataset texcup --out /tmp/x").exit_code == 2);
  CHECK(test::run("solve somewhere --out /tmp/x").exit_code == 2);
  CHECK(test::run("solve --sensors gnss --rover a --nav b --out /tmp/x").exit_code == 2);
  CHECK(test::run("solve --dataset ppc somewhere --imu a --out /tmp/x").exit_code == 2);
  const test::Outcome nowhere = test::run("solve --dataset ppc nowhere --out /tmp/x");
  CHECK(nowhere.exit_code == 3);
  CHECK(test::has(nowhere, "no such folder"));
}
#endif  // SEARVINS_COMMAND
