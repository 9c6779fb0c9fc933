#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the benchmarks (installing what is missing by apt), runs them as one table, and closes with a table of ratios to peers: Eigen in
# the same process, and Ceres (libceres-dev, on the workload of the shared data) in the same minutes. Arguments go to every benchmark;
# with a filter Ceres is left out:
#   bash tests/bench/run.sh --benchmark_filter=lambda
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=cmake/install_packages.sh
source "$root/cmake/install_packages.sh"

programs=$root/build/bench/tests/bench
work=$root/build/bench/comparison  # what was measured, one file a program
peer=${SEARVINS_SHARED_DIR:-$root/../shared}/peers/fixed_lag

run_benchmarks() {
  local program header=""
  for program in "$programs"/bench_*; do
    if [ ! -f "$program" ] || [ ! -x "$program" ]; then continue; fi
    # Every program begins with the head of the table between two rules: printed once.
    "$program" --benchmark_color=false "$@" 2>/dev/null | awk -v seen="$header" '!(seen != "" && NR <= 3 && /^(-+$|Benchmark )/)'
    header=printed
  done
  [ -n "$header" ] || { echo "There is no tests/bench/bench_*.cpp." >&2; return 1; }
}

build_ceres_driver() {
  [ -f "$peer/ceres_fls.cpp" ] || { echo "Ceres is missing from the table below: no $peer/ceres_fls.cpp."; return 1; }
  have_include ceres/ceres.h || { echo "Ceres is missing from the table below: libceres-dev is not installed."; return 1; }
  "${CXX:-c++}" -O3 -std=c++17 -w -I/usr/include/eigen3 "$peer/ceres_fls.cpp" "$peer/alloc_count.cpp" -o "$work/ceres_fls" -lceres -lglog -lpthread
}

run_ceres() {
  mkdir -p "$work/$1"
  "$work/ceres_fls" "$peer/data" "$work/$1" maxit=2 >/dev/null 2>&1
}

# Ours between two runs of the peer, so that a machine that drifts shows in both.
run_fixed_lag() {
  local has_ceres=no
  [ -d "$peer/data" ] || { echo "The fixed-lag workload is missing from the table below: no $peer/data."; return 0; }
  if build_ceres_driver; then has_ceres=yes; fi
  [ "$has_ceres" = no ] || run_ceres before
  "$programs/fixed_lag_timing" "$peer/data" >"$work/fixed_lag.txt"
  [ "$has_ceres" = no ] || run_ceres after
}

# ceres COLUMN PERCENT: that percentile of a column of both runs of Ceres, the first 70 updates left out; nothing when there are none.
ceres() {
  [ -f "$work/after/ceres_sparse_latency.csv" ] || return 0
  awk -F, -v column="$1" 'FNR > 71 {print $column}' "$work"/{before,after}/ceres_sparse_latency.csv | sort -g |
    awk -v percent="$2" '{v[NR] = $1} END {printf "%.5g", v[int(NR * percent / 100) + 1]}'
}

# ours LINE WORD: the number after a word, on the line of fixed_lag_timing that begins so.
ours() {
  [ -f "$work/fixed_lag.txt" ] || return 0
  awk -v line="$1" -v word="$2" 'index($0, line) == 1 {for (i = 1; i < NF; ++i) if ($i == word) print $(i + 1) + 0}' "$work/fixed_lag.txt"
}

# processor_time NAME: of a benchmark, in its own unit.
processor_time() { awk -v name="$1" '$1 == name && !seen {print $4; seen = 1}' "$work/benchmarks.txt"; }

# nanoseconds_a_sample NAME: the counter of bench_preintegration.
nanoseconds_a_sample() {
  awk -v name="$1" '$1 == name && match($0, /per_sample=[0-9.]+n/) {print substr($0, RSTART + 11, RLENGTH - 12)}' "$work/benchmarks.txt"
}

# lambda SET COLUMN: a cell of the table of bench_lambda.
lambda() { awk -F'|' -v set="$1" -v column="$2" '{gsub(/ /, "")} $2 == set {print $column}' "$work/benchmarks.txt"; }

# row WHAT OURS PEER ASKED: an empty PEER beside figures of ours is missing; "none" says that there is no such peer.
row() {
  local ratio absent=missing
  [ -n "$2" ] || absent="not run"
  ratio=$(awk -v a="$2" -v b="$3" 'BEGIN {if (a + 0 > 0 && b + 0 > 0) printf "%.3g", a / b; else print "-"}')
  printf '| %-55s | %9s | %9s | %8s | %-14s |\n' "$1" "${2:-not run}" "${3:-$absent}" "$ratio" "$4"
}

print_comparison() {
  local form n
  printf '\n| %-55s | %9s | %9s | %8s | %-14s |\n' what ours peer ratio asked
  echo "|---|---|---|---|---|"
  row "fixed-lag update, median ms (peer: Ceres)" "$(ours processor median)" "$(ceres 4 50)" "ratio <= 0.125"
  row "fixed-lag update, p99 ms (Ceres)" "$(ours processor p99)" "$(ceres 4 99)" "ours <= 8"
  row "allocations an update, driver's lists (Ceres)" "$(ours allocations update:)" "$(ceres 5 50)" "-"
  for n in 20 40 60; do
    row "LAMBDA, n = $n, us (Eigen LDLT)" "$(lambda "n$n" 4)" "$(lambda "n$n" 7)" "ratio <= $(lambda "n$n" 10)"
  done
  row "preintegration, online, ns a sample" "$(nanoseconds_a_sample 'BM_Online<double>')" none "-"
  for form in batch scalar latent symmetric; do
    row "robust, $form, 16 candidates, ns (Eigen LLT, dense)" "$(processor_time "robust/$form/n:16")" "$(processor_time robust/dense/n:16)" "-"
  done
  row "double differences, 30 satellites, us an epoch" "$(processor_time double_differences/satellites_a_system:10)" none "-"
  row "ORB frontend, 752 x 480, ms a pair" "$(processor_time run_pair/orb_pair_752x480)" none "-"
}

main() {
  need_tools build eigen doctest benchmark
  cd "$root"
  cmake --preset bench -Wno-dev >/dev/null
  cmake --build --preset bench -j "$(build_jobs)"
  rm -rf "$work" && mkdir -p "$work"
  run_benchmarks "$@" | tee "$work/benchmarks.txt"
  case " $* " in
    *" --benchmark_filter="*) ;;
    *) run_fixed_lag ;;
  esac
  print_comparison
}

main "$@"
