#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The RTK tables of docs/benchmarks.md, from recordings of real receivers and two simulated drives: every formulation, continuous and instantaneous.
#
#   bash examples/recordings.sh DATA OUT
#
# DATA holds real/ and twin/ (../shared/data beside this project). A cell is "fix rate over all scored epochs in % / horizontal RMS of fixed epochs in m /
# wrong fixes"; with the inertial unit "; horizontal RMSE, maximum of all epochs in m; mean NEES of position over its expectation" follows. Environment:
# SEARVINS (the command; else build/release/searvins), JOBS (runs at a time, 2). Writes OUT/recordings.md and prints it.
# shellcheck disable=SC2054  # commas are parts of arguments
set -euo pipefail

if [ $# -ne 2 ]; then
  sed -n '3,11p' "$0" | cut -c3-
  exit 2
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
searvins=${SEARVINS:-$root/build/release/searvins}
data=$1 out=$2
mkdir -p "$out"

# choose NAME: the arguments of a recording go to `recording`.
choose() {
  local real=$data/real twin=$data/twin d
  case $1 in
    kamakura)
      d=$real/kamakura_drive_2021
      recording=(--rover "$d/rover.obs" --base "$d/base.obs" --nav "$d/nav.rnx" --base-ecef=-3959400.631,3385704.533,3667523.111 --truth "$d/reference.csv")
      ;;
    nagoya)
      d=$real/nagoya_static_2024
      recording=(--rover "$d/rover.obs" --base "$d/base.obs" --nav "$d/base.nav" --base-ecef=-3817681.1213,3562839.4311,3650159.1593
        --truth-ecef=-3817681.3807,3562839.9785,3650158.3760)
      ;;
    geonet)
      d=$real/geonet_static_2005
      recording=(--rover "$d/07590920.05o" --base "$d/30400920.05o" --nav "$d/07590920.05n" --base-ecef=-3978241.958,3382840.234,3649900.853
        --truth-ecef=-3976219.1878,3382371.6057,3652511.1424)
      ;;
    sf)
      d=$real/sf_static_2017
      recording=(--rover "$d/rover.obs" --base "$d/base.obs" --nav "$d/rover.nav" --base-ecef=-2706105.2018,-4261210.8062,3885598.6411
        --truth-ecef=-2706111.3408,-4261210.5240,3885594.5989)
      ;;
    spirent)
      d=$real/spirent_rose_iono-Klob
      recording=(--rover "$d/rover.obs" --base "$d/base.obs" --nav "$d/nav_gps.rnx" --nav "$d/nav_gal.rnx"
        --base-ecef=4157177.06580187,671230.476590636,4774767.03105544 --truth "$d/reference.csv")
      ;;
    a-clean | a-urban)
      d=$twin/$1
      recording=(--rover "$d/rover.obs" --base "$d/base.obs" --nav "$d/base.nav" --rig "$d/rig.json" --truth "$d/truth.csv" --start 553980 --end 555089)
      ;;
  esac
}

# start NAME RECORDING ARGUMENTS...: solves in the background once a job is free.
start() {
  local name=$1 recording
  choose "$2"
  shift 2
  while [ "$(jobs -rp | wc -l)" -ge "${JOBS:-2}" ]; do wait -n; done
  # 4: no solution at the end, which is scored all the same.
  { "$searvins" solve "${recording[@]}" "$@" --out "$out/$name" >"$out/$name.txt" 2>"$out/$name.progress" || [ $? -eq 4 ]; } &
}

# value NAME KEY [OBJECT]: of summary.json, within the object of that name.
value() {
  local text
  text=$(tr -d '\n ' <"$out/$1/summary.json")
  [ $# -lt 3 ] || text=$(grep -oE "\"$3\":\{[^}]*" <<<"$text")
  grep -oE "\"$2\":[-0-9.eE+]+" <<<"$text" | head -1 | cut -d: -f2
}
cell() { # NAME
  awk -v rate="$(value "$1" fix_rate_pct)" -v rms="$(value "$1" rmse fixed_horizontal)" -v wrong="$(value "$1" wrong_fixes)" \
    'BEGIN {printf "%.1f / %.4f / %d", rate, rms, wrong}'
}
errors() { # NAME
  awk -v rms="$(value "$1" rmse horizontal)" -v most="$(value "$1" max horizontal)" 'BEGIN {printf "%.3f, %.2f", rms, most}'
}

nees() { # NAME
  awk -v nees="$(value "$1" mean_nees)" 'BEGIN {printf "%.1f", nees / 3}'
}

# recording, signals of "L1+L2" ("rig": those of its rig.json)
continuous=(kamakura:G1C,G2W,E1C,E5Q nagoya:G1C,G2W,E1C,E7Q,C2I,C7I geonet:G1C,G2W sf:G1C,G2S spirent:G1C,G2X,E1C,E5Q a-clean:rig a-urban:rig)
# recording, signals, continuity
others=(kamakura:G1C,G2W,E1C,E5Q:instantaneous kamakura:G1C,E1C:instantaneous kamakura:G1C,E1C:constant nagoya:G1C:instantaneous
  nagoya:G1C,E1C,C2I:instantaneous geonet:G1C,G2W:instantaneous geonet:G1C:instantaneous geonet:G1C:constant sf:G1C,G2S:instantaneous sf:G1C:constant
  spirent:G1C,E1C:instantaneous)

solve_all() {
  local row name signals mode form
  for row in "${continuous[@]}"; do
    IFS=: read -r name signals <<<"$row"
    local chosen=(--signals "$signals")
    [ "$signals" != rig ] || chosen=()
    for form in batch scalar latent symmetric; do start "${name}_$form" "$name" "${chosen[@]}" --robust "$form"; done
    start "${name}_full" "$name" "${chosen[@]}" --ambiguity full
  done
  for row in "${others[@]}"; do
    IFS=: read -r name signals mode <<<"$row"
    start "${name}_${signals}_$mode" "$name" --signals "$signals" --continuity "$mode"
  done
  for name in a-clean a-urban; do
    for form in batch scalar latent symmetric; do start "${name}_unit_$form" "$name" --imu "$data/twin/$name/imu.log" --robust "$form"; done
  done
  wait
}

print_tables() {
  local row name signals mode form
  echo "| recording | batch, partial | scalar, partial | latent, partial | symmetric, partial | symmetric, full |"
  echo "|---|---|---|---|---|---|"
  for row in "${continuous[@]}"; do
    name=${row%%:*}
    printf '| %s' "$name"
    for form in batch scalar latent symmetric full; do printf ' | %s' "$(cell "${name}_$form")"; done
    echo " |"
  done
  printf '| a-urban, all epochs: RMSE, maximum'
  for form in batch scalar latent symmetric full; do printf ' | %s' "$(errors "a-urban_$form")"; done
  printf ' |\n\n| recording, signals | mode | symmetric, partial |\n|---|---|---|\n'
  for row in "${others[@]}"; do
    IFS=: read -r name signals mode <<<"$row"
    echo "| $name $signals | $mode | $(cell "${name}_${signals}_$mode") |"
  done
  printf '\n| with the unit | batch | scalar | latent | symmetric |\n|---|---|---|---|---|\n'
  for name in a-clean a-urban; do
    printf '| %s' "$name"
    for form in batch scalar latent symmetric; do
      printf ' | %s; %s; %s' "$(cell "${name}_unit_$form")" "$(errors "${name}_unit_$form")" "$(nees "${name}_unit_$form")"
    done
    echo " |"
  done
}

solve_all
print_tables | tee "$out/recordings.md"
