// SPDX-License-Identifier: BSD-3-Clause
// The estimator with latent pivot errors under the loss of the candidates.
#include <memory>

#include "examples/searvins/rtk_run.hpp"

namespace searvins::examples {

std::unique_ptr<SolverRun> make_symmetric_run(const estimator::RtkOptions& options) {
  return std::make_unique<RtkRun<robust::LatentPivotSymmetric>>(options);
}

}  // namespace searvins::examples
