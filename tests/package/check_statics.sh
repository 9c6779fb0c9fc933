#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# No hidden state: no object of the library lies in a writable section.
#   check_statics.sh NM CONTROL_OBJECT FILE...
# FILEs are the umbrella's object and the test executables (which instantiate the templates). The tests' own objects and those of
# io/ and examples/ do not count. CONTROL_OBJECT holds three mutable statics that the search must find.
set -euo pipefail

nm=$1 control=$2
shift 2

# Names of the data objects of namespace searvins in .data, .bss, .tdata or .tbss (and their guard variables), demangled.
mutable_statics() {
  "$nm" --format=sysv --demangle "$@" | awk -F'|' '
    NF >= 7 && $7 ~ /\.(data|bss|tdata|tbss|sdata|sbss)/ && $7 !~ /\.data\.rel\.ro/ {
      name = $1; gsub(/^ +| +$/, "", name)
      sub(/^guard variable for /, "", name)
      scope = name  # without template and function arguments: a type of the tests as an argument does not make an object theirs
      gsub(/\(anonymous namespace\)/, "ANONYMOUS", scope)
      while (gsub(/<[^<>]*>/, "", scope) || gsub(/\([^()]*\)/, "", scope)) {}
      if (scope ~ /^searvins::/ && scope !~ /^searvins::(test|io|examples)::/ && scope !~ /DOCTEST_ANON|ANONYMOUS/) print name
    }' | sort -u
}

for name in mutable_variable 'mutable_local()::counter' 'Holder<int>::mutable_member'; do
  mutable_statics "$control" | grep -qF "$name" || { echo "The search does not see $name in the control object: it proves nothing." >&2; exit 1; }
done
if mutable_statics "$control" | grep -q kConstant; then
  echo "The search takes a constant for mutable." >&2
  exit 1
fi

status=0
for file in "$@"; do
  found=$(mutable_statics "$file")
  if [ -n "$found" ]; then
    printf 'Mutable statics in %s:\n%s\n' "$file" "$found" >&2
    status=1
  fi
done
[ "$status" -ne 0 ] || echo "No mutable static of the library in $# files."
exit "$status"
