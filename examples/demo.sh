#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Shows what searvins does: installs what is missing (apt), builds the command, solves the bundled synthetic recording, makes a drive with
# pictures and solves it with one sensor more at a time, and, where ../shared/data lies beside the project, solves real recordings.
# Everything it writes is under build/.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
searvins=$root/build/release/searvins
out=$root/build/demo
real=${SEARVINS_SHARED_DIR:-$root/../shared}/data/real
# shellcheck source=cmake/install_packages.sh
source "$root/cmake/install_packages.sh"

build() {
  need_tools build eigen
  (cd "$root" && cmake --preset release -Wno-dev >/dev/null && cmake --build --preset release --target searvins_command -j "$(build_jobs)")
}

solve_synthetic() {
  echo
  echo "== The bundled synthetic recording"
  "$searvins" demo --out "$out"
}

# A minute of an urban drive: satellites alone, with the inertial unit, with a stereo camera. One table, one page.
solve_drive() {
  local drive=$out/drive runs=$out/drive_runs run
  echo
  echo "== A simulated urban drive of 60 s with stereo pictures"
  "$searvins" simulate --profile urban --duration 60 --seed 5 --images 640x240 --out "$drive"
  local common=(--rover "$drive/rover.obs" --base "$drive/base.obs" --nav "$drive/nav.rnx" --truth "$drive/truth.csv")
  local unit=(--imu "$drive/imu.csv" --rig "$drive/rig.json")
  # solve_one NAME ARGUMENTS...
  solve_one() {
    local name=$1
    shift
    "$searvins" solve "${common[@]}" --out "$runs/$name" "$@" >"$runs/$name.txt" || [ $? -eq 4 ]  # 4: no solution at the end, still scored
  }
  mkdir -p "$runs"
  # The longest one beside the others; its progress is kept aside.
  solve_one stereo_from_pictures --imu "$drive/imu.csv" --rig "$drive/rig_images.json" --images "$drive" 2>"$runs/stereo_from_pictures.progress" &
  local from_pictures=$!
  solve_one GNSS --rig "$drive/rig.json"
  solve_one GNSS+IMU "${unit[@]}"
  for run in scalar latent symmetric; do
    solve_one "stereo_$run" "${unit[@]}" --tracks "$drive/stereo_tracks.csv" --robust "$run"
  done
  echo "solve: waiting for the run from pictures"
  wait "$from_pictures" || { cat "$runs/stereo_from_pictures.progress" >&2; return 1; }
  echo "The rows of the paper in the tables are of its own drive, 20 km of downtown streets: for scale, not for comparison."
  "$searvins" evaluate --truth "$drive/truth.csv" --start 274800 --end 274860 --paper --streets "$drive/streets.csv" --report "$out/drive.html" \
    "GNSS=$runs/GNSS" "GNSS+IMU=$runs/GNSS+IMU" "stereo scalar=$runs/stereo_scalar" "stereo latent=$runs/stereo_latent" \
    "stereo symmetric=$runs/stereo_symmetric" "stereo from pictures=$runs/stereo_from_pictures"
}

# solve_real FOLDER TRUTH_OPTIONS... : the recording FOLDER with its rover.obs and base.obs; the rest goes to the command.
solve_real() {
  local folder=$1
  shift
  echo
  echo "== $folder"
  "$searvins" solve --out "$out/$folder" "$@"
}

solve_recordings() {
  local kamakura=$real/kamakura_drive_2021 nagoya=$real/nagoya_static_2024
  solve_real kamakura_drive_2021 --rover "$kamakura/rover.obs" --base "$kamakura/base.obs" --nav "$kamakura/nav.rnx" \
    --base-ecef -3959400.631,3385704.533,3667523.111 --truth "$kamakura/reference.csv"
  solve_real nagoya_static_2024 --rover "$nagoya/rover.obs" --base "$nagoya/base.obs" --nav "$nagoya/base.nav" \
    --base-ecef -3817681.1213,3562839.4311,3650159.1593
}

say_where_the_reports_are() {
  echo
  echo "Open in a browser:"
  echo "  $out/drive.html"
  find "$out" -name report.html | sort | sed 's/^/  /'
}

main() {
  build
  solve_synthetic
  solve_drive
  if [ -d "$real" ]; then
    solve_recordings
  else
    echo
    echo "No recordings at $real: only the synthetic one was solved."
  fi
  say_where_the_reports_are
}

main "$@"
