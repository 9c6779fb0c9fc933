// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Recordings in the EuRoC layout: two cameras, an IMU and, where there is one, the ground truth.
///
///     cam0/data.csv, cam1/data.csv      #timestamp [ns],filename        stamps as they are stored; files in cam*/data/
///     cam0/sensor.yaml, cam1/...        calibration                     euroc_calibration.hpp
///     imu0/data.csv, imu0/sensor.yaml   rad/s, m/s^2                    optional
///     state_groundtruth_estimate0/data.csv (or gt0/data.csv)            optional
///
/// directly in the folder or in its `mav0`. An image belongs to a pair with the nearest stamp of the other camera if they are at most a
/// tenth of a frame period apart. A single image without partner is left out and counted; cameras that are out of step as a whole are
/// refused.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/imu_log.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/datasets/euroc_calibration.hpp"
#include "examples/support/gray_image.hpp"
#include "examples/support/image_reader.hpp"

namespace searvins::examples {

/// How a recording is to be read.
struct EurocOptions {
  io::NanosecondScale nanoseconds{io::NanosecondScale::unix_utc};
  double pair_tolerance_share{0.1};  ///< of the frame period: how far apart the stamps of a pair may be
};

/// A row of a camera's list.
struct EurocImage {
  std::int64_t ns{0};
  std::string path;
};

/// Two images of one moment. `ns` is the left one's stamp as stored.
struct EurocPair {
  std::int64_t ns{0};
  GpsTime time{};
  std::string left_path, right_path;
};

/// Both images, of the size that the calibration says.
struct EurocImages {
  GrayImage left, right;
};

/// A row of the ground truth: the body in the room's axes.
struct EurocPose {
  GpsTime time{};
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
  Eigen::Quaterniond q_wb{Eigen::Quaterniond::Identity()};
  Eigen::Vector3d v_w_mps{Eigen::Vector3d::Zero()};  ///< zero where the file has none
};

/// A recording. Images are read one pair at a time by read_euroc_pair().
struct EurocRecording {
  std::string folder;  ///< the one that holds cam0
  EurocCamera left{}, right{};
  std::vector<EurocPair> pairs;  ///< rising in time
  double period_s{0};            ///< median of the left camera
  std::optional<EurocImu> imu_noise{};
  io::ImuLog imu{};  ///< without samples where the recording has none
  std::vector<EurocPose> truth;
};

namespace euroc_detail {

/// The stamp that begins a row.
[[nodiscard]] inline bool read_stamp(std::string_view field, std::int64_t& ns) {
  return io::parse_integer(field, ns) && ns > 0 && ns < 6'000'000'000'000'000'000;
}

/// A camera's list in order of time; rows that cannot be used are counted with their line.
[[nodiscard]] inline io::FileResult<std::vector<EurocImage>> read_camera_list(const std::filesystem::path& camera, const std::string& name,
                                                                              io::SkipLog& skipped) {
  const std::string path = (camera / "data.csv").string();
  const auto text = io::read_text_file(path);
  if (!text) return text.error();
  std::vector<EurocImage> images;
  io::LineReader lines{*text};
  std::string_view line;
  while (lines.next(line)) {
    if (io::trimmed(line).empty() || line.front() == '#') continue;
    const std::vector<std::string_view> fields = io::split(line, ',');
    EurocImage image;
    if (fields.size() != 2 || !read_stamp(fields[0], image.ns) || fields[1].empty()) {
      skipped.add(name + "/data.csv: row that is no 'nanoseconds,filename'", lines.number());
      continue;
    }
    if (!images.empty() && image.ns <= images.back().ns) {
      skipped.add(name + "/data.csv: stamp that is not later than the one before", lines.number());
      continue;
    }
    image.path = (camera / "data" / std::filesystem::path{fields[1]}.filename()).string();
    std::error_code failed;
    if (!std::filesystem::exists(image.path, failed)) {
      skipped.add(name + "/data.csv: the image file is not there", lines.number(), "copy the whole data folder");
      continue;
    }
    images.push_back(std::move(image));
  }
  if (images.empty())
    return io::Diagnostic{path, 0, "no row names an image that is there", "copy the images into " + (camera / "data").string()};
  return images;
}

[[nodiscard]] inline std::int64_t median(std::vector<std::int64_t> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

[[nodiscard]] inline std::int64_t median_period_ns(const std::vector<EurocImage>& images) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < images.size(); ++i) steps.push_back(images[i].ns - images[i - 1].ns);
  return median(std::move(steps));
}

/// How far from each left image the nearest right one is, and which.
struct Nearest {
  std::size_t right{0};
  std::int64_t late_ns{0};  ///< right after left
};

[[nodiscard]] inline std::vector<Nearest> nearest_right(const std::vector<EurocImage>& left, const std::vector<EurocImage>& right) {
  std::vector<Nearest> all;
  for (const EurocImage& image : left) {
    const auto after =
        std::lower_bound(right.begin(), right.end(), image.ns, [](const EurocImage& r, std::int64_t ns) { return r.ns < ns; });
    auto best = after == right.end() ? after - 1 : after;
    if (best != right.begin() && image.ns - (best - 1)->ns < std::abs(best->ns - image.ns)) --best;
    all.push_back({static_cast<std::size_t>(best - right.begin()), best->ns - image.ns});
  }
  return all;
}

/// Puts left and right together. Refused: cameras out of step.
[[nodiscard]] inline std::optional<io::Diagnostic> make_pairs(const std::vector<EurocImage>& left, const std::vector<EurocImage>& right,
                                                              const EurocOptions& options, EurocRecording& out, io::SkipLog& skipped) {
  const std::int64_t period_ns = median_period_ns(left);
  out.period_s = static_cast<double>(period_ns) * 1e-9;
  // A list of one image has no period: then the camera's nominal one counts.
  const double known_period_ns = period_ns > 0 ? static_cast<double>(period_ns) : 1e9 / std::max(out.left.rate_hz, 1.0);
  const double tolerance_ns = options.pair_tolerance_share * known_period_ns;
  std::vector<bool> is_used(right.size(), false);
  std::vector<std::int64_t> offsets_ns;
  for (std::size_t i = 0; const Nearest& nearest : nearest_right(left, right)) {
    const EurocImage& image = left[i++];
    offsets_ns.push_back(nearest.late_ns);
    if (std::abs(static_cast<double>(nearest.late_ns)) > tolerance_ns || is_used[nearest.right]) {
      skipped.add("left image without a right one of the same moment", static_cast<long>(i), "the stereo pair is left out");
      continue;
    }
    is_used[nearest.right] = true;
    const GpsTime time = options.nanoseconds == io::NanosecondScale::gps ? GpsTime{image.ns} : to_gps(UtcTime{image.ns});
    out.pairs.push_back({image.ns, time, image.path, right[nearest.right].path});
  }
  for (std::size_t i = 0; i < right.size(); ++i)
    if (!is_used[i]) skipped.add("right image without a left one of the same moment", static_cast<long>(i) + 1);
  if (2 * out.pairs.size() >= left.size()) return std::nullopt;
  const double apart_ms = std::abs(static_cast<double>(median(offsets_ns))) * 1e-6;
  return io::Diagnostic{out.folder, 0,
                        "only " + std::to_string(out.pairs.size()) + " of " + std::to_string(left.size()) +
                            " left images have a right one of the same moment: cam1 is " + io::fixed_text(apart_ms, 1) +
                            " ms away from cam0, the frame period is " + io::fixed_text(known_period_ns * 1e-6, 1) + " ms",
                        "the cameras must be triggered together: correct the stamps of cam1/data.csv or record anew"};
}

}  // namespace euroc_detail

/// Reads a ground truth: stamp, position, quaternion (w, x, y, z), then velocity and biases or nothing. Errors: no usable row.
[[nodiscard]] inline io::Parsed<std::vector<EurocPose>> parse_euroc_truth(std::string_view text, const std::string& name,
                                                                          io::NanosecondScale scale = io::NanosecondScale::unix_utc) {
  io::Parsed<std::vector<EurocPose>> out;
  io::LineReader lines{text};
  std::string_view line;
  while (lines.next(line)) {
    if (io::trimmed(line).empty() || line.front() == '#') continue;
    const std::vector<std::string_view> fields = io::split(line, ',');
    std::int64_t ns = 0;
    std::vector<double> x(fields.size() < 8 ? 0 : fields.size() - 1);
    bool good = !x.empty() && euroc_detail::read_stamp(fields[0], ns);
    for (std::size_t i = 0; i < x.size(); ++i) good = good && io::parse_number(fields[i + 1], x[i]);
    const double norm = good ? std::sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6]) : 0;
    if (!good || !(std::abs(norm - 1) < 1e-2)) {
      out.skipped.add(good ? "quaternion that has not the norm 1" : "row that is no stamp, position and quaternion", lines.number());
      continue;
    }
    EurocPose pose;
    pose.time = scale == io::NanosecondScale::gps ? GpsTime{ns} : to_gps(UtcTime{ns});
    if (!out.value.empty() && pose.time <= out.value.back().time) {
      out.skipped.add("stamp that is not later than the one before", lines.number());
      continue;
    }
    pose.p_w_m = {x[0], x[1], x[2]};
    pose.q_wb = Eigen::Quaterniond{x[3], x[4], x[5], x[6]}.normalized();
    if (x.size() >= 10) pose.v_w_mps = {x[7], x[8], x[9]};
    out.value.push_back(pose);
  }
  if (out.value.empty())
    out.error =
        io::Diagnostic{name, 0, "no row is a stamp with position and quaternion", "give a EuRoC state_groundtruth_estimate0/data.csv"};
  return out;
}
[[nodiscard]] inline io::Parsed<std::vector<EurocPose>> read_euroc_truth(const std::string& path,
                                                                         io::NanosecondScale scale = io::NanosecondScale::unix_utc) {
  const auto text = io::read_text_file(path);
  if (text) return parse_euroc_truth(*text, path, scale);
  io::Parsed<std::vector<EurocPose>> out;
  out.error = text.error();
  return out;
}

/// Reads the images of a pair. Refused: what the readers refuse, and sizes that are not those of the calibration.
[[nodiscard]] inline io::FileResult<EurocImages> read_euroc_pair(const EurocRecording& recording, const EurocPair& pair) {
  EurocImages images;
  for (const bool is_right : {false, true}) {
    const std::string& path = is_right ? pair.right_path : pair.left_path;
    const vision::PinholeCamera<double>& model = (is_right ? recording.right : recording.left).model;
    auto image = read_image(path);
    if (!image) return image.error();
    if (image->width() != model.width_px || image->height() != model.height_px) {
      const auto size = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
      return io::Diagnostic{
          path, 0,
          "the image is " + size(image->width(), image->height()) + ", the calibration is for " + size(model.width_px, model.height_px),
          is_right ? "give the cam1/sensor.yaml of these images" : "give the cam0/sensor.yaml of these images"};
    }
    (is_right ? images.right : images.left) = std::move(*image);
  }
  return images;
}

/// Reads lists, calibration, IMU and truth, and one pair of images to see that the sizes agree.
[[nodiscard]] inline io::Parsed<EurocRecording> read_euroc(const std::filesystem::path& folder, const EurocOptions& options = {}) {
  io::Parsed<EurocRecording> out;
  EurocRecording& recording = out.value;
  const auto fail = [&out](io::Diagnostic error) {
    out.error = std::move(error);
    return std::move(out);
  };
  std::error_code failed;
  const std::filesystem::path root = std::filesystem::is_directory(folder / "cam0", failed) ? folder : folder / "mav0";
  recording.folder = root.string();
  for (const char* camera : {"cam0", "cam1"})
    if (!std::filesystem::is_directory(root / camera, failed))
      return fail({folder.string(), 0, std::string{"there is no "} + camera + " in it or in its mav0",
                   "a stereo pair needs cam0 and cam1: name the folder that holds both"});

  std::vector<EurocImage> lists[2];
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    const std::string name = i == 0 ? "cam0" : "cam1";
    const auto yaml = read_sensor_yaml((root / name / "sensor.yaml").string());
    if (!yaml) return fail(yaml.error());
    const auto camera = read_euroc_camera(*yaml);
    if (!camera) return fail(camera.error());
    (i == 0 ? recording.left : recording.right) = *camera;
    auto list = euroc_detail::read_camera_list(root / name, name, out.skipped);
    if (!list) return fail(list.error());
    lists[i] = std::move(*list);
  }
  const double baseline_m = (recording.right.pose.t_bs_m - recording.left.pose.t_bs_m).norm();
  if (!(baseline_m > 1e-3))
    return fail({(root / "cam1" / "sensor.yaml").string(), 0, "both cameras have the same place: there is no stereo baseline",
                 "give each camera's own T_BS"});
  if (auto wrong = euroc_detail::make_pairs(lists[0], lists[1], options, recording, out.skipped)) return fail(std::move(*wrong));
  if (const auto images = read_euroc_pair(recording, recording.pairs.front()); !images) return fail(images.error());

  if (std::filesystem::exists(root / "imu0" / "data.csv", failed)) {
    io::ImuLogOptions imu_options;
    imu_options.nanoseconds = options.nanoseconds;
    auto imu = io::read_imu_log(root / "imu0" / "data.csv", imu_options);
    if (!imu) return fail(*imu.error);
    recording.imu = std::move(imu.value);
    for (const io::SkippedItem& item : imu.skipped.items())
      for (long k = 0; k < item.count; ++k) out.skipped.add("imu0/data.csv: " + item.reason, item.first_line, item.hint);
  }
  if (std::filesystem::exists(root / "imu0" / "sensor.yaml", failed)) {
    const auto yaml = read_sensor_yaml((root / "imu0" / "sensor.yaml").string());
    if (!yaml) return fail(yaml.error());
    const auto noise = read_euroc_imu_noise(*yaml);
    if (!noise) return fail(noise.error());
    recording.imu_noise = *noise;
  }
  for (const char* name : {"state_groundtruth_estimate0", "gt0"}) {
    const std::filesystem::path path = root / name / "data.csv";
    if (!recording.truth.empty() || !std::filesystem::exists(path, failed)) continue;
    auto truth = read_euroc_truth(path.string(), options.nanoseconds);
    if (!truth) return fail(*truth.error);
    recording.truth = std::move(truth.value);
  }
  return out;
}

}  // namespace searvins::examples
