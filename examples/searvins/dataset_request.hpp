// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// `searvins solve --dataset texcup|ppc|urbannav FOLDER`: the folder of a published recording as the request of an ordinary run.
///
/// What the command line names (--rig, --rover, --base, --nav, --truth, --tracks, --images, --start, --end) goes before what the folder
/// holds. The published scoring window is the time to solve unless another is named.
#pragma once

#include <string>
#include <vector>

#include <searvins/io/file_result.hpp>

#include "examples/searvins/solve_job.hpp"

namespace searvins::examples {

/// Which recording.
struct DatasetWish {
  std::string layout, folder;  ///< "texcup", "ppc" or "urbannav", and where it lies
  std::string inputs;          ///< folder for what has to be written for the run, beside its results
  bool use_imu{true}, use_camera{true};
};

/// A request that is complete, and what a user should know of the recording.
struct DatasetRequest {
  SolveRequest request;
  std::vector<std::string> notes;
};

/// Fills a request from a folder. Errors: what cannot be read, with file and line, and what cannot be written.
[[nodiscard]] io::FileResult<DatasetRequest> dataset_request(const DatasetWish& wish, const SolveRequest& asked);

}  // namespace searvins::examples
