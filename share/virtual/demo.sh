#!/usr/bin/env bash
# From nothing to a fitted material: a job on the virtual rig, registration, observation map, parameter maps, report.
# Usage: share/virtual/demo.sh [folder]; the folder (build/demo) is made anew. Needs a release build.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

folder=$(realpath -m "${1:-build/demo}")
bin=$PWD/build/release/bin
rig_toml=${RIG_DEMO_RIG:-$PWD/share/virtual/rig.toml}
angle=${RIG_DEMO_ANGLE_DEG:-15.5}
texels=${RIG_DEMO_TEXELS:-512}

if [ -e "$folder" ] && [ ! -e "$folder/made-by-demo" ]; then
  echo "demo: $folder exists and is no earlier demo; name another folder" >&2
  exit 1
fi
rm -rf "$folder"
mkdir -p "$folder"
touch "$folder/made-by-demo"
export RIG_RUNTIME_DIR=$folder/run
mkdir -p "$RIG_RUNTIME_DIR"
cd "$folder"

begin=$SECONDS
stage_begin=$SECONDS
stage() {
  local now=$SECONDS
  [ -z "${stage_name:-}" ] || printf '   %s took %d s\n' "$stage_name" $((now - stage_begin))
  stage_name=$1
  stage_begin=$now
  [ -z "$1" ] || printf '\n== %s\n' "$2"
}

rigd_pid=
end() {
  [ -z "$rigd_pid" ] || kill "$rigd_pid" 2>/dev/null || true
}
trap end EXIT

stage plan "plan: poses $angle degrees apart"
"$bin/rig" plan --rig "$rig_toml" --angle-deg "$angle" --exposures-us 160000,20000,2500 --name demo \
  --sample "chart of the virtual rig" --out job.toml

stage scan "scan: rigd on the virtual rig takes the job (rigd's log: $folder/rigd.log)"
"$bin/rigd" --config "$rig_toml" --state state --runtime run 2>rigd.log &
rigd_pid=$!
"$bin/rig" job submit job.toml --scan "$folder/scan" --wait 30
"$bin/rig" watch --until-idle
kill "$rigd_pid"
wait "$rigd_pid" || { echo "demo: rigd ended with status $?; see $folder/rigd.log" >&2; exit 1; }
rigd_pid=
"$bin/rig" scan verify scan

stage registration "registration: the carrier's pose in every frame, from its fiducials"
"$bin/rig" calibrate scan

stage assembly "assembly: observation map of $texels x $texels texels"
"$bin/rig" assemble scan --texels "$texels" --out observation.h5

stage truth "truth: what the virtual rig knows, for the report alone"
"$bin/rig-virtual-truth" --rig scan/rig.toml --like observation.h5 --out truth.h5 --every 4

stage fit "fit: diffuse with one Lafortune lobe, and diffuse alone to compare; every tenth pose is held out"
"$bin/rig" fit observation.h5 --model lafortune --leave-out 10 --out lafortune.exr
"$bin/rig" fit observation.h5 --model diffuse --leave-out 10 --out diffuse.exr

stage report "report"
"$bin/rig" report observation.h5 --map lafortune.exr --map diffuse.exr --truth truth.h5 --out report.html
stage "" ""

printf '\nAll stages: %d s. Results in %s:\n' $((SECONDS - begin)) "$folder"
printf '  %-18s %s\n' report.html "open it in a browser" scan/ "frames, journal, registration" \
  observation.h5 "what every texel looked like in every pose" lafortune.exr "the fitted material"
