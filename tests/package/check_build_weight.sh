#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# P28, build weight: two include folders are the whole build, and what the umbrella costs a compiler stays within a bound.
#   check_build_weight.sh COMPILER INCLUDE EIGEN
# The bound is on processor time as a multiple of that for <Eigen/Core> in the same run, so that it holds on any machine; docs/performance.md has seconds.
set -euo pipefail

compiler=$1 include=$2 eigen=$3
most=4  # times <Eigen/Core>, which is 3 s where that takes 0.75; measured: 2 (docs/performance.md)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# seconds NAME: processor time to compile NAME.cpp without optimisation, as a user without a build system does.
seconds() {
  local TIMEFORMAT=%U
  { time "$compiler" -std=c++20 -I "$include" -I "$eigen" "$work/$1.cpp" -o "$work/$1" 2>"$work/$1.log"; } 2>&1 || { cat "$work/$1.log" >&2; return 1; }
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
of_eigen=$(seconds eigen)
of_all=$(seconds all)
answer=$("$work/all")
if [ "$answer" != "0.800000 0.200000 500.000" ]; then
  echo "The program built from two include folders says '$answer'." >&2
  exit 1
fi
awk -v a="$of_all" -v e="$of_eigen" -v most="$most" 'BEGIN {
  printf "searvins/searvins.hpp: %.1f s of processor time, <Eigen/Core>: %.1f s, ratio %.1f (at most %d)\n", a, e, a / e, most
  exit a / e > most
}'
