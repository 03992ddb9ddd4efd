# For cases that run a test program of the build.
# shellcheck shell=bash

# All tests of the program that the filter names must run, none skipped; in so many processes side by side (1). What the
# driver passed of the conformance suite goes to the host.
run_tests() { # program, filter, processes
  local processes=${3:-1} i log status=0 pids=()
  touch "$scratch/begin"
  for ((i = 0; i < processes; ++i)); do
    GTEST_TOTAL_SHARDS=$processes GTEST_SHARD_INDEX=$i "$RIG_BUILD/bin/$1" --gtest_color=no --gtest_filter="$2" \
      >"$scratch/tests.$i" 2>&1 &
    pids+=($!)
  done
  for ((i = 0; i < processes; ++i)); do
    log=$scratch/tests.$i
    wait "${pids[i]}" || status=$?
    grep -vE '^(\[ +RUN +\]|\[-+\]|Note: )|^$' "$log" || true
    grep -E '^\[  PASSED  \] [1-9]' "$log" >/dev/null || fail "no test of $1 passed"
    expect_refused grep -F '[  SKIPPED ]' "$log"
  done
  [ "$status" = 0 ] || fail "$1 ended with status $status"
  mkdir -p /run/results/conformance
  find "$RIG_BUILD/conformance" -type f -newer "$scratch/begin" -exec cp {} /run/results/conformance/ ';' 2>/dev/null || true
}
