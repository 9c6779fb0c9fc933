#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the benchmarks (installing what is missing by apt) and prints one table. Arguments go to every benchmark:
#   bash tests/bench/run.sh --benchmark_filter=lambda
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=cmake/install_packages.sh
source "$root/cmake/install_packages.sh"

main() {
  local program header=""
  need_tools build eigen benchmark
  cd "$root"
  cmake --preset bench -Wno-dev >/dev/null
  cmake --build --preset bench -j "$(build_jobs)"
  for program in build/bench/tests/bench/bench_*; do
    if [ ! -f "$program" ] || [ ! -x "$program" ]; then continue; fi
    # Every program begins with the head of the table between two rules: printed once.
    "$program" --benchmark_color=false "$@" 2>/dev/null | awk -v seen="$header" '!(seen != "" && NR <= 3 && /^(-+$|Benchmark )/)'
    header=printed
  done
  [ -n "$header" ] || { echo "There is no tests/bench/bench_*.cpp." >&2; return 1; }
}

main "$@"
