#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every header compiles as the only include of a file, outside io/ also without exceptions and RTTI, all warnings being errors. Class templates of
# their scalar (`using Name = BasicName<double>`) are instantiated whole: their functions too must find what they need in the includes of their header.
#   check_headers_alone.sh COMPILER INCLUDE_DIR EIGEN_DIR
set -euo pipefail

export compiler=$1 include_dir=$2 eigen_dir=$3

# Explicit instantiations of the classes whose alias for double stands in a header.
instances_in() {
  awk '/^namespace searvins/ {space = $2}
       /^namespace detail / {inner = "::detail"}
       /^}  \/\/ namespace detail/ {inner = ""}
       /^(struct|class) Basic/ {kind[$2] = $1}
       match($0, /^using [A-Za-z0-9]+ = Basic[A-Za-z0-9]+<double>;/) {
         name = $4; sub(/<double>;.*/, "", name)
         if (name in kind) print "template " kind[name] " " space inner "::" name "<double>;"
       }' "$1"
}

check() {
  local header=$1 embedded=(-fno-exceptions -fno-rtti)
  [[ $header != searvins/io/* ]] || embedded=()
  "$compiler" -std=c++20 -fsyntax-only -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wpedantic -Wdouble-promotion -Werror \
    "${embedded[@]}" -I "$include_dir" -isystem "$eigen_dir" -include "$header" -x c++ - <<<"$(instances_in "$header")" || { echo "FAILED alone: $header"; return 1; }
}
export -f check instances_in

cd "$include_dir"
headers=$(find searvins -name '*.hpp' | sort)
printf '%s\n' "$headers" | xargs -P 2 -I {} bash -c 'check {}'
echo "$(printf '%s\n' "$headers" | wc -l) headers compile alone."
