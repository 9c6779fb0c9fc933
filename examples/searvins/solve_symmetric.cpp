// SPDX-License-Identifier: BSD-3-Clause
// The estimator with latent pivot errors under the loss of the candidates.
#include <memory>

#include "examples/searvins/rtk_run.hpp"

namespace searvins::examples {

std::unique_ptr<SolverRun> make_symmetric_run(const RunOptions& options) { return make_run_of<robust::LatentPivotSymmetric>(options); }

}  // namespace searvins::examples
