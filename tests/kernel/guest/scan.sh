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

# rigd on $scratch/rig.toml; what it logs ends the case's output if that fails.
start_rigd() {
  rigd --check --config "$scratch/rig.toml"
  rigd --config "$scratch/rig.toml" --state "$scratch/state" --runtime "$RIG_RUNTIME_DIR" 2>"$scratch/rigd.log" &
  rigd=$!
  on_exit cat "$scratch/rigd.log"
  on_exit end_rigd
  rig status --wait 60
}

end_rigd() {
  [ -n "$rigd" ] || return 0
  kill "$rigd"
  wait "$rigd"
  rigd=
}

submit_job() { # poses
  write_job "$1" >"$scratch/job.toml"
  rig job submit "$scratch/job.toml" --scan "$scratch/scan" --wait 60
}

# At least so many poses are in the journal. A rig that has stopped for good ends the case.
poses_done() {
  rig status --wait 60 >"$scratch/status"
  if grep -E ': stopped' "$scratch/status"; then fail "the rig has stopped"; fi
  rig job list | sed -n 's/.* \([0-9]*\)\/[0-9]* poses.*/\1/p' >"$scratch/count"
  [ "$(cat "$scratch/count")" -ge "$1" ]
}

# The job waits for a device.
suspended() { rig status --wait 60 | contains 'suspended, .*; device lost: '; }

await_scan() {
  rig watch --until-idle --lines --wait 60
  rig scan verify "$scratch/scan"
  rig job list | contains complete
  end_rigd
}
