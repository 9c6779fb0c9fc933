// SPDX-License-Identifier: BSD-3-Clause
// The estimator that calibrates its camera: latent pivot errors under the loss of the candidates.
#include <memory>

#include "examples/searvins/rtk_run.hpp"

namespace searvins::examples {

std::unique_ptr<SolverRun> make_calibrating_run(const RunOptions& options) {
  using Motion = estimator::StereoInertialMotion<imu::RotatingEarth, 256, 1024, estimator::CalibratedCamera>;
  if (!options.inertial) return nullptr;
  return std::make_unique<InertialRun<robust::LatentPivotSymmetric, Motion>>(options, policies_of<robust::LatentPivotSymmetric>(options));
}

}  // namespace searvins::examples
