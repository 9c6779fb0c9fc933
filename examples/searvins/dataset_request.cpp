// SPDX-License-Identifier: BSD-3-Clause
// The folder of a published recording as the request of an ordinary run.
#include <string>
#include <utility>

#include "examples/datasets/dataset_inputs.hpp"
#include "examples/searvins/dataset_request.hpp"

namespace searvins::examples {
namespace {

/// `asked` unless it is empty.
const std::string& either(const std::string& asked, const std::string& found) { return asked.empty() ? found : asked; }

}  // namespace

io::FileResult<DatasetRequest> dataset_request(const DatasetWish& wish, const SolveRequest& asked) {
  DatasetChoice choice;
  choice.rover = asked.rover, choice.base = asked.base, choice.rig = asked.rig, choice.nav = asked.nav;
  choice.use_imu = wish.use_imu, choice.use_camera = wish.use_camera && !asked.has_camera();
  io::FileResult<DatasetRecording> recording = read_dataset(wish.layout, wish.folder, choice);
  if (!recording) return recording.error();
  const io::FileResult<DatasetInputs> inputs = write_inputs(*recording, wish.inputs);
  if (!inputs) return inputs.error();

  DatasetRequest out{asked, std::move(recording->notes)};
  SolveRequest& r = out.request;
  r.rover = recording->rover, r.base = recording->base, r.nav = recording->nav, r.rig = inputs->rig, r.imu = inputs->imu;
  if (!r.truth_point_e_m) r.truth = either(asked.truth, inputs->truth);
  if (wish.use_camera && !asked.has_camera()) r.tracks = recording->tracks, r.images = inputs->images;
  if (!r.start_sow && recording->start) r.start_sow = recording->start->sow();
  if (!r.end_sow && recording->end) r.end_sow = recording->end->sow();
  return out;
}

}  // namespace searvins::examples
