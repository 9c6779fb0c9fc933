#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs all tests, after installing what is missing (apt).
#   bash tests/run.sh                release flavour, build/test
#   bash tests/run.sh --sanitize     assertions, ASan, UBSan and warnings as errors, build/dev
#   bash tests/run.sh --clang        the same by clang++, build/dev-clang
# Further arguments go to ctest (-R smoother, -LE package ...). SEARVINS_WERROR=ON makes warnings errors in the release flavour too,
# SEARVINS_PROPERTY_RUNS scales every property test (percent), SEARVINS_PROPERTY_SEED repeats one seed.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/install_packages.sh
source "$root/cmake/install_packages.sh"

configure_build() {
  local preset=$1 werror=()
  [ -z "${SEARVINS_WERROR:-}" ] || werror=("-DSEARVINS_WERROR=$SEARVINS_WERROR")
  cmake --preset "$preset" -Wno-dev "${werror[@]}" >/dev/null
  cmake --build --preset "$preset" -j "$(build_jobs)" -- -k 0  # all errors at once, not just the first
}

# ctest shows the output of failures only; what a test left out must be seen too.
say_what_was_skipped() {
  local log=$root/build/$1/Testing/Temporary/LastTest.log
  if [ -e "$log" ] && grep -q 'SKIPPED' "$log"; then
    echo
    echo "Left out:"
    grep -oE 'SKIPPED.*' "$log" | sort | uniq -c
  fi
}

main() {
  local preset=test status=0
  case ${1:-} in
    --sanitize) preset=dev && shift ;;
    --clang) preset=dev-clang && shift ;;
  esac
  need_tools build eigen doctest pkg-config
  [ "$preset" != dev-clang ] || need_tools clang
  cd "$root"
  configure_build "$preset"
  ctest --preset "$preset" -j "$(build_jobs)" --output-junit junit.xml "$@" || status=$?
  say_what_was_skipped "$preset"
  return "$status"
}

main "$@"
