// SPDX-License-Identifier: BSD-3-Clause
// A program on an estimator that is compiled elsewhere: asks it to solve an epoch without anything and prints the library's version.
#include <rtk_estimator.hpp>
#include <searvins/version.hpp>

#include <cstdio>
#include <memory>

int main() {
  using namespace searvins;
  const auto rtk = std::make_unique<estimator::RtkEstimator<estimator::RtkConfig<robust::LatentPivotSymmetric>>>();
  if (rtk->update(gnss::ObservationEpoch{}).ok()) return 1;
  std::puts(kVersionString);
}
