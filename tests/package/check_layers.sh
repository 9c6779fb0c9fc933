#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Includes point down the layers of docs/architecture.md, and outside io/ nothing is included that allocates, prints or reads a clock.
#   check_layers.sh INCLUDE_DIR/searvins
set -euo pipefail

floor_of() {
  case $1 in
    version.hpp | core | math) echo 1 ;;
    geodesy | robust) echo 2 ;;
    smoother | imu | gnss | ambiguity | vision | stationary) echo 3 ;;
    estimator) echo 4 ;;
    searvins.hpp) echo 5 ;;
    io) echo 6 ;;
    *) echo "" ;;
  esac
}

cd "$1"
status=0
complain() {
  echo "$1" >&2
  status=1
}

while IFS=: read -r file _ text; do
  [[ $text =~ include\ *[\<\"]([^\>\"]+) ]]
  included=${BASH_REMATCH[1]}
  from=$(floor_of "${file%%/*}")
  [ -n "$from" ] || complain "$file: folder ${file%%/*} has no floor; docs/architecture.md and this script name all folders"
  case $included in
    searvins/*)
      inner=${included#searvins/}
      to=$(floor_of "${inner%%/*}")
      [ "${to:-9}" -le "${from:-0}" ] || complain "$file includes <$included>: that points up the layers"
      ;;
    Eigen/Core | Eigen/Geometry | Eigen/Cholesky) ;;
    Eigen/*) complain "$file includes <$included>: only Eigen/Core, Eigen/Geometry and Eigen/Cholesky (fixed sizes)" ;;
    iostream | fstream | sstream | istream | ostream | cstdio | string | vector | map | unordered_map | set | unordered_set | list | deque | functional | memory | \
      memory_resource | any | regex | thread | mutex | future | random | chrono | ctime | stdexcept | typeinfo | filesystem | format)
      [ "$from" = 6 ] || complain "$file includes <$included>: outside io/ there is no heap, stream, clock, thread or hidden randomness"
      ;;
    *.h | *.hpp) complain "$file includes <$included>: neither the standard library, nor Eigen, nor searvins/..." ;;
  esac
done < <(grep -rnE '^ *# *include' --include='*.hpp' . | sed 's#^\./##')
[ "$status" -ne 0 ] || echo "All includes point down."
exit "$status"
