#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Writes the reference by Doxygen and fails on its first warning, and on a type, or a name at the scope of a namespace, without a comment.
#   bash docs/make_reference.sh [FOLDER]      into FOLDER/html, build/docs/html by default
# Without Doxygen it says so, and succeeds: the reference is no part of the library.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=${1:-$root/build/docs}

if ! command -v doxygen >/dev/null 2>&1; then
  echo "SKIPPED: the reference, because there is no doxygen (Debian: apt-get install doxygen)"
  exit 0
fi
mkdir -p "$out"
out=$(cd "$out" && pwd)
cd "$root"

part() { sed -nE "s/^#define SEARVINS_VERSION_$1 +([0-9]+).*/\1/p" include/searvins/version.hpp; }

# settings LINE...: the Doxyfile with further lines, which win.
settings() {
  cat docs/Doxyfile
  printf '%s\n' "PROJECT_NUMBER = $(part MAJOR).$(part MINOR).$(part PATCH)" "OUTPUT_DIRECTORY = \"$out\"" "$@"
}

settings "WARN_LOGFILE = \"$out/warnings.txt\"" | doxygen - >/dev/null || {
  cat "$out/warnings.txt" >&2
  echo "Doxygen warns: see above." >&2
  exit 1
}

settings "EXTRACT_ALL = NO" "GENERATE_HTML = NO" "GENERATE_XML = NO" "WARN_AS_ERROR = NO" "WARN_LOGFILE = \"$out/undocumented.txt\"" | doxygen - >/dev/null 2>&1 || true
if grep -E 'Compound .* is not documented|\) of namespace .* is not documented' "$out/undocumented.txt" >&2; then
  echo "These need a comment." >&2
  exit 1
fi
echo "Reference: $out/html/index.html"
