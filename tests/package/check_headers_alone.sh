#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every header compiles as the only include of a file, outside io/ also without exceptions and RTTI, all warnings being errors.
#   check_headers_alone.sh COMPILER INCLUDE_DIR EIGEN_DIR
set -euo pipefail

export compiler=$1 include_dir=$2 eigen_dir=$3

check() {
  local header=$1 embedded=(-fno-exceptions -fno-rtti)
  [[ $header != searvins/io/* ]] || embedded=()
  "$compiler" -std=c++20 -fsyntax-only -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wpedantic -Wdouble-promotion -Werror \
    "${embedded[@]}" -I "$include_dir" -isystem "$eigen_dir" -include "$header" -x c++ /dev/null || { echo "FAILED alone: $header"; return 1; }
}
export -f check

cd "$include_dir"
headers=$(find searvins -name '*.hpp' | sort)
printf '%s\n' "$headers" | xargs -P 2 -I {} bash -c 'check {}'
echo "$(printf '%s\n' "$headers" | wc -l) headers compile alone."
