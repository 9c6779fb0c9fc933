// SPDX-License-Identifier: BSD-3-Clause
// The estimator with latent pivot errors under a Gaussian prior.
#include <memory>

#include "examples/searvins/rtk_run.hpp"

namespace searvins::examples {

std::unique_ptr<SolverRun> make_latent_run(const RunOptions& options) { return make_run_of<robust::LatentPivot>(options); }

}  // namespace searvins::examples
