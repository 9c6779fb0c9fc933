#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# P28, build weight: two include folders are the whole build, and what the umbrella, and an estimator that is compiled elsewhere, cost a compiler
# stays within a bound.
#   check_build_weight.sh COMPILER INCLUDE EIGEN
# The bound is on processor time as a multiple of that for <Eigen/Core> in the same run, so that it holds on any machine; docs/performance.md has seconds.
set -euo pipefail

compiler=$1 include=$2 eigen=$3
most=4  # times <Eigen/Core>, which is 3 s where that takes 0.75; measured: 2 (docs/performance.md)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# seconds NAME OPTION...: processor time to compile NAME.cpp without optimisation, as a user without a build system does.
seconds() {
  local TIMEFORMAT=%U name=$1
  shift
  { time "$compiler" -std=c++20 -I "$include" -I "$eigen" "$work/$name.cpp" -o "$work/$name" "$@" 2>"$work/$name.log"; } 2>&1 ||
    { cat "$work/$name.log" >&2; return 1; }
}

printf '#include <Eigen/Core>\nint main() {}\n' >"$work/eigen.cpp"
cat >"$work/all.cpp" <<'CPP'
#include <cstdio>
#include <searvins/searvins.hpp>
int main() {
  const auto x = searvins::geodesy::ecef_from_geodetic({0.8, 0.2, 500});
  const auto g = searvins::geodesy::geodetic_from_ecef(x);
  return std::printf("%.6f %.6f %.3f\n", g.lat_rad, g.lon_rad, g.height_m) > 0 ? 0 : 1;
}
CPP
# What a file of a program does whose estimator is compiled once, by searvins_add_instances(): the interface that it may call, but add_stereo(), a template.
cat >"$work/instance.cpp" <<'CPP'
#include <searvins/estimator/estimator.hpp>
using Drive = searvins::estimator::Estimator<searvins::robust::LatentPivotSymmetric>;
using Rtk = searvins::estimator::RtkEstimator<searvins::estimator::RtkConfig<searvins::robust::LatentPivotSymmetric>>;
extern template class searvins::estimator::Estimator<searvins::robust::LatentPivotSymmetric>;
extern template class searvins::estimator::RtkEstimator<searvins::estimator::RtkConfig<searvins::robust::LatentPivotSymmetric>>;
Drive drive;
Rtk rtk;
bool run(const searvins::gnss::ObservationEpoch& epoch, const searvins::imu::ImuSample& sample, const searvins::gnss::Ephemeris& ephemeris) {
  drive.set_ionosphere({}), drive.set_centrelines({}), drive.finish(), rtk.set_ionosphere({});
  const bool fed = drive.add_ephemeris(ephemeris).ok() && drive.set_base_position({}).ok() && drive.set_heading(0, 1).ok() && drive.add_imu(sample).ok() &&
                   drive.add_base(epoch).ok() && drive.add_rover(epoch).ok() && drive.add_position({}).ok();
  const bool given = rtk.add_ephemeris(ephemeris).ok() && rtk.set_base_position({}).ok() && rtk.add_base(epoch).ok();
  return fed && given && drive.next().ok() && drive.predict(sample.time).ok() && rtk.update(epoch).ok() && rtk.advance(epoch.tag).ok() && rtk.oldest().ok() &&
         drive.differenced().groups.size() > rtk.single_point().rows.size();
}
CPP
of_eigen=$(seconds eigen)
of_all=$(seconds all)
answer=$("$work/all")
if [ "$answer" != "0.800000 0.200000 500.000" ]; then
  echo "The program built from two include folders says '$answer'." >&2
  exit 1
fi
of_instance=$(seconds instance -c)
awk -v a="$of_all" -v i="$of_instance" -v e="$of_eigen" -v most="$most" 'BEGIN {
  printf "<Eigen/Core>: %.1f s of processor time; at most %d times that are allowed\n", e, most
  printf "searvins/searvins.hpp: %.1f s, ratio %.1f\n", a, a / e
  printf "two estimators that are compiled elsewhere: %.1f s, ratio %.1f\n", i, i / e
  exit a / e > most || i / e > most
}'
