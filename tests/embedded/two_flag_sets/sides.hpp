// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Both sides of the boundary: included by plain.cpp and avx2.cpp, which differ in their machine flags and the names that they give to
/// this.
#pragma once

#include <span>

#include <searvins/ambiguity/lambda.hpp>
#include <searvins/imu/preintegration.hpp>

#include "embedded/public_types.hpp"
#include "embedded/two_flag_sets/boundary.h"

namespace {

int layouts(BoundaryLayout* out) {
  int n = 0;
  searvins::test::for_each_public_type([&](const char* name, std::size_t size, std::size_t alignment) {
    if (n < kMaxBoundaryLayouts) out[n++] = {name, size, alignment};
  });
  return n;
}

Eigen::Vector3d vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

void motion(const BoundaryReading* readings, BoundaryMotion* out) {
  static searvins::imu::ImuSample list[kBoundarySamples];
  for (int k = 0; k < kBoundarySamples; ++k)
    list[k] = {searvins::GpsTime{readings[k].time_ns}, vector_of(readings[k].gyro_b_radps), vector_of(readings[k].accel_b_mps2)};
  const auto m = searvins::imu::preintegrate<double>(std::span<const searvins::imu::ImuSample>{list}, list[0].time,
                                                     list[kBoundarySamples - 1].time, {});
  out->ok = m.ok() ? 1 : 0;
  if (!m.ok()) return;
  const Eigen::Vector3d angle = searvins::so3::log(m->dR);
  for (int i = 0; i < 3; ++i) out->rotation_rad[i] = angle[i], out->dp_m[i] = m->dp_m[i], out->dv_mps[i] = m->dv_mps[i];
  for (int i = 0; i < 9; ++i) out->variances[i] = m->covariance(i, i);
}

void ambiguities(BoundaryAmbiguities* problem) {
  constexpr int n = kBoundaryAmbiguities;
  const auto found = searvins::ambiguity::integer_least_squares<double, n>(problem->Q, n, problem->a_hat, n);
  problem->ok = found.ok() ? 1 : 0;
  if (!found.ok()) return;
  for (int i = 0; i < n; ++i) problem->integers[i] = found->integers[0][static_cast<std::size_t>(i)];
  problem->squared_norm = found->squared_norm[0];
}

}  // namespace
