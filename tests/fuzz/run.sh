#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the fuzz targets (installing what is missing by apt) and runs each for a while; a finding ends the run with its input file.
#   bash tests/fuzz/run.sh [SECONDS each, default 60] [TARGET...]
# Of target fuzz_rinex_observation the seeds are in tests/fuzz/corpus/rinex_observation/ and the dictionary is tests/fuzz/rinex.dict, where they
# exist. What the runs find interesting is kept in build/fuzz/corpus, findings go to build/fuzz/findings.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=cmake/install_packages.sh
source "$root/cmake/install_packages.sh"

fuzz_one() {
  local target=$1 seconds=$2 subject=${1#fuzz_} dictionary options=() folders
  folders=("build/fuzz/corpus/$subject")
  mkdir -p "${folders[0]}" build/fuzz/findings
  [ ! -d "tests/fuzz/corpus/$subject" ] || folders+=("tests/fuzz/corpus/$subject")
  for dictionary in tests/fuzz/*.dict; do
    [[ $subject != $(basename "$dictionary" .dict)* ]] || options+=(-dict="$dictionary")
  done
  echo "== $target, $seconds s"
  "build/fuzz/tests/fuzz/$target" -max_total_time="$seconds" -max_len=8192 -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/findings/$subject-" "${options[@]}" "${folders[@]}" 2>"build/fuzz/$target.log" || {
    tail -n 40 "build/fuzz/$target.log" >&2
    return 1
  }
  grep -E '^stat::(number_of_executed_units|average_exec_per_sec|new_units_added)' "build/fuzz/$target.log"
}

main() {
  local seconds=${1:-60} source targets=()
  shift $(( $# > 0 ? 1 : 0 ))
  need_tools build eigen clang
  cd "$root"
  cmake --preset fuzz -Wno-dev >/dev/null
  cmake --build --preset fuzz -j "$(build_jobs)"
  targets=("$@")
  if [ "${#targets[@]}" -eq 0 ]; then
    for source in tests/fuzz/fuzz_*.cpp; do
      [ ! -e "$source" ] || targets+=("$(basename "$source" .cpp)")
    done
  fi
  [ "${#targets[@]}" -gt 0 ] || { echo "There is no tests/fuzz/fuzz_*.cpp." >&2; return 1; }
  for source in "${targets[@]}"; do fuzz_one "$source" "$seconds"; done
  echo "No finding in ${#targets[@]} targets."
}

main "$@"
