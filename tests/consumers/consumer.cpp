// SPDX-License-Identifier: BSD-3-Clause
// What a program that uses searvins looks like from outside: prints the library's version.
#include <searvins/geodesy/local_frame.hpp>
#include <searvins/version.hpp>

#include <cstdio>

int main() {
  const auto frame = searvins::geodesy::LocalFrame::at({-3961953.0, 3381199.0, 3668915.4});
  const Eigen::Vector3d p_w_m = frame.to_local(frame.to_ecef({1.0, 2.0, 3.0}));
  std::puts(searvins::kVersionString);
  return (p_w_m - Eigen::Vector3d{1.0, 2.0, 3.0}).norm() < 1e-6 ? 0 : 1;
}
