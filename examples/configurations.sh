#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every configuration of the paper's table on one drive, and what each idea of it is worth: which sensor and which coupling earn what.
#
#   bash examples/configurations.sh DRIVE OUT [POS]
#
# DRIVE holds rover.obs, base.obs, *.nav or nav.rnx, imu.csv or imu.log, rig.json, truth.csv and stereo_tracks.csv (`searvins simulate` writes such a
# folder). POS is a .pos file of another program: it is scored, and its positions are what is loosely coupled; without it those of a GNSS-only run
# are. Environment: SEARVINS (the command; else build/release/searvins), START and END (seconds of week to score; all is solved), ONLY (a pattern of the
# configurations to run again; the rest is taken from an earlier call), JOBS (runs at a time, 1). Writes OUT/table.md, table.csv, figures.json,
# compare.html.
set -euo pipefail

if [ $# -lt 2 ]; then
  sed -n '3,11p' "$0" | cut -c3-
  exit 2
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
searvins=${SEARVINS:-$root/build/release/searvins}
drive=$1 out=$2 pos=${3:-}
mkdir -p "$out"

first_of() {
  for file in "$@"; do
    if [ -f "$file" ]; then
      echo "$file"
      return
    fi
  done
  echo "$drive: none of ${*##*/} is there" >&2
  exit 1
}
nav=$(first_of "$drive"/nav.rnx "$drive"/*.nav)
imu=$(first_of "$drive"/imu.csv "$drive"/imu.log)
score=()
[ -z "${START:-}" ] || score+=(--start "$START")
[ -z "${END:-}" ] || score+=(--end "$END")
rover=(--rover "$drive/rover.obs" --nav "$nav" --rig "$drive/rig.json" --truth "$drive/truth.csv")
both=("${rover[@]}" --base "$drive/base.obs")
unit=(--imu "$imu")
eyes=(--imu "$imu" --tracks "$drive/stereo_tracks.csv")

names=()
# run NAME ARGUMENTS...: one configuration; its processor time goes to NAME.time.
run() {
  local name=$1
  shift
  names+=("$name=$out/$name")
  if [ -f "$out/$name/summary.json" ] && [[ ! $name =~ ${ONLY:-.} ]]; then return; fi
  while [ "$(jobs -rp | wc -l)" -ge "${JOBS:-1}" ]; do wait -n; done
  echo "== $name"
  (
    TIMEFORMAT=%U
    time ("$searvins" solve "$@" --out "$out/$name" >"$out/$name.txt" 2>"$out/$name.progress" || [ $? -eq 4 ]) # 4: no solution at the end, still scored
  ) 2>"$out/$name.time" &
}

run rover "${rover[@]}"
run rover_imu "${rover[@]}" "${unit[@]}"
run rover_imu_stereo "${rover[@]}" "${eyes[@]}"
for form in batch scalar latent symmetric; do
  run "rtk_$form" "${both[@]}" --robust "$form"
  run "rtk_imu_$form" "${both[@]}" "${unit[@]}" --robust "$form"
  run "rtk_imu_stereo_$form" "${both[@]}" "${eyes[@]}" --robust "$form"
done
wait
positions=${pos:-$out/rtk_symmetric/solution.pos}
loose=(--positions "$positions" --rig "$drive/rig.json" --truth "$drive/truth.csv")
run loose_imu "${loose[@]}" "${unit[@]}"
run loose_imu_stereo "${loose[@]}" "${eyes[@]}"
run no_robust_weights "${both[@]}" "${eyes[@]}" --without robust
run ambiguities_instantaneous "${both[@]}" "${eyes[@]}" --continuity instantaneous
run ambiguities_constant "${both[@]}" "${eyes[@]}" --continuity constant
run no_screening_of_tracks "${both[@]}" "${eyes[@]}" --without semantic,geometric,motion,maturity
run with_wheels "${both[@]}" "${eyes[@]}" --with wheels
run with_cn0 "${both[@]}" "${eyes[@]}" --with cn0
run with_code_gate "${both[@]}" "${eyes[@]}" --with code-gate
run batch_by_size "${both[@]}" "${unit[@]}" --robust batch --with batch-size
wait
[ -z "$pos" ] || names+=("other_program=$pos")
streets=()
[ ! -f "$drive/streets.csv" ] || streets=(--streets "$drive/streets.csv")
"$searvins" evaluate --truth "$drive/truth.csv" "${score[@]}" "${streets[@]}" --paper --tables "$out/table.md" --tables "$out/table.csv" --json "$out/figures.json" \
  --report "$out/compare.html" "${names[@]}"
