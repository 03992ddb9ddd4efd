# For cases that scan with a real device in the place of one of the virtual rig's: rigd is run by hand.
# shellcheck shell=bash
. "$KERNEL_TESTS/guest/job.sh"

export RIG_RUNTIME_DIR=$scratch/run
mkdir -p "$RIG_RUNTIME_DIR"
export PATH=$RIG_BUILD/bin:$PATH

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
