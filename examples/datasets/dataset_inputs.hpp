// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// From the folder of a published dataset to files that a run can be given: read_dataset() picks the reader of the layout, write_inputs()
/// writes beside the results what the recording lacks or holds in a form of its own:
///
///     inputs/rig.json             the published calibration, where no rig.json was given
///     inputs/imu.csv, truth.csv   converted readings and reference, where no reader knows the published form
///     inputs/camera/              sensor.yaml of both cameras beside links to the pictures, where they came without
///
/// With these files the run can be repeated, and its calibration changed, by the ordinary options.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include <searvins/io/file_result.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/datasets/ppc.hpp"
#include "examples/datasets/recording.hpp"
#include "examples/datasets/rig_text.hpp"
#include "examples/datasets/texcup.hpp"
#include "examples/datasets/urbannav.hpp"

namespace searvins::examples {

/// Files for a run; empty: there is none.
struct DatasetInputs {
  std::string rig, imu, truth, images;
};

/// Reads a folder in the layout "texcup", "ppc" or "urbannav". Errors: those of its reader; another layout.
[[nodiscard]] inline io::FileResult<DatasetRecording> read_dataset(std::string_view layout, const std::filesystem::path& folder,
                                                                   const DatasetChoice& choice = {}) {
  if (layout == "texcup") return read_texcup(folder, choice);
  if (layout == "ppc") return read_ppc(folder, choice);
  if (layout == "urbannav") return read_urbannav(folder, choice);
  return io::Diagnostic{folder.string(), 0, "'" + std::string{layout} + "' is no layout that is known",
                        "it is one of texcup, ppc, urbannav"};
}

namespace detail {

/// A folder that has the calibration of pictures and links to them.
[[nodiscard]] inline DatasetFailure write_picture_view(const PictureView& view, const std::filesystem::path& folder) {
  std::error_code failed;
  const std::filesystem::path from = std::filesystem::absolute(view.folder, failed);
  const auto link = [&](const char* name) {
    std::filesystem::remove(folder / name, failed);
    std::filesystem::create_directory_symlink(from / name, folder / name, failed);
  };
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    const std::string camera = i == 0 ? "cam0" : "cam1";
    std::filesystem::create_directories(folder / camera, failed);
    if (std::string wrong = io::write_text_file((folder / camera / "sensor.yaml").string(), view.sensor_yaml[i]); !wrong.empty())
      return io::Diagnostic{(folder / camera).string(), 0, wrong, "choose another folder with --out"};
    std::filesystem::copy_file(from / camera / "data.csv", folder / camera / "data.csv", std::filesystem::copy_options::overwrite_existing,
                               failed);
    if (!failed) link((camera + "/data").c_str());
    if (failed)
      return io::Diagnostic{view.folder, 0,
                            "has no sensor.yaml, and no link to it could be made in " + folder.string() + ": " + failed.message(),
                            "copy " + (folder / camera / "sensor.yaml").string() + " to " + (from / camera).string()};
  }
  if (dataset::is_folder(from / "labels0")) link("labels0");
  if (failed)
    return io::Diagnostic{folder.string(), 0, "no link to labels0 could be made: " + failed.message(), "choose another folder with --out"};
  return std::nullopt;
}

}  // namespace detail

/// Writes into `folder`, which is made if need be, what the recording does not hold as files. Errors: what cannot be written.
[[nodiscard]] inline io::FileResult<DatasetInputs> write_inputs(const DatasetRecording& recording, const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return io::Diagnostic{folder.string(), 0, "could not be made: " + failed.message(), "choose another folder with --out"};
  DatasetInputs inputs{recording.rig_file, recording.imu, recording.truth, recording.images};
  const auto write = [&](const std::string& name, std::string_view text, std::string& path) -> DatasetFailure {
    path = (folder / name).string();
    std::string wrong = io::write_text_file(path, text);
    return wrong.empty() ? DatasetFailure{} : io::Diagnostic{path, 0, std::move(wrong), "choose another folder with --out"};
  };
  if (inputs.rig.empty())
    if (auto f = write("rig.json", rig_text(recording.rig), inputs.rig)) return *f;
  if (recording.imu_text)
    if (auto f = write(recording.imu_text->name, recording.imu_text->text, inputs.imu)) return *f;
  if (recording.truth_text)
    if (auto f = write(recording.truth_text->name, recording.truth_text->text, inputs.truth)) return *f;
  if (recording.pictures) {
    if (auto f = detail::write_picture_view(*recording.pictures, folder / "camera")) return *f;
    inputs.images = (folder / "camera").string();
  }
  return inputs;
}

}  // namespace searvins::examples
