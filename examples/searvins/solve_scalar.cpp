// SPDX-License-Identifier: BSD-3-Clause
// The estimator with one robust weight a row of the whitened batch.
#include <memory>

#include "examples/searvins/rtk_run.hpp"

namespace searvins::examples {

std::unique_ptr<SolverRun> make_scalar_run(const RunOptions& options) { return make_run_of<robust::ScalarRows>(options); }

}  // namespace searvins::examples
