# For cases that scan with a real device in the place of one of the virtual rig's: rigd is run by hand, by the wall's
# time, and all its deadlines are long.
# shellcheck shell=bash
. "$KERNEL_TESTS/guest/job.sh"

export RIG_RUNTIME_DIR=$scratch/run
mkdir -p "$RIG_RUNTIME_DIR"
export PATH=$RIG_BUILD/bin:$PATH

# The tiny rig, with the given part handed to a device of another module.
part_of() { # part, module, device; rig.toml in and out
  sed "/^\\[$1\\]/,/^\\[/{s/^module = .*/module = \"$2\"/;s/^device = .*/device = \"$3\"/}"
}

real_time_rig() {
  tiny_rig "$RIG_SOURCE/share/virtual/rig.toml" | sed -e '/^clock = /d' \
    -e 's/^warm_up_s = 900.0/warm_up_s = 0.0\nwarm_at_start = true/' -e 's/^settle_ms = .*/settle_ms = 20/'
  printf '%s\n' '[deadlines]' 'axis_ms = 30000' 'camera_ms = 30000' 'frame_ms = 60000' 'light_ms = 30000' 'lines_ms = 30000'
}

# The arm's travel and homing as the simulated drives of the cases have them: from a switch at 45 degrees upwards.
arm_from_45() {
  sed '/^.axis.arm/,/^.home/{s/^min_deg.*/min_deg = 45.0/;s/^approach_deg.*/approach_deg = 0.0/}'
}

# rigd on $scratch/rig.toml, with a job of so many poses. What it logged is the end of the case's output.
start_scan() { # poses
  rigd --config "$scratch/rig.toml" --state "$scratch/state" --runtime "$RIG_RUNTIME_DIR" 2>"$scratch/rigd.log" &
  rigd=$!
  on_exit cat "$scratch/rigd.log"
  on_exit end_rigd
  write_job "$1" >"$scratch/job.toml"
  rig job submit "$scratch/job.toml" --scan "$scratch/scan" --wait 60
}

end_rigd() {
  [ -n "$rigd" ] || return 0
  kill "$rigd"
  wait "$rigd"
  rigd=
}

# What follows is asked of files: a program of ours takes a second to begin in this machine, and the job goes on
# meanwhile. A rig that stopped for good ends the case.
rigd_says() { # extended regular expression
  if grep -E ' (stopped|error): ' "$scratch/rigd.log"; then fail "the rig has stopped"; fi
  grep -E -- "$1" "$scratch/rigd.log"
}

# At least so many poses are committed.
poses_done() {
  rigd_says . >"$scratch/so-far" || true
  [ "$(find "$scratch/scan/frames" -mindepth 1 -maxdepth 1 ! -name '*.part' 2>/dev/null | wc -l)" -ge "$1" ]
}

suspended() { # extended regular expression: why
  if grep 'is complete' "$scratch/rigd.log"; then fail "the job was not suspended"; fi
  rigd_says "job 1 is suspended, device lost: .*$1"
}

await_scan() {
  await rigd_says 'job 1 is complete'
  rig scan verify "$scratch/scan"
  end_rigd
}
