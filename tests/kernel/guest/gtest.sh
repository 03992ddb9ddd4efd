# For cases that run a test program of the build.
# shellcheck shell=bash

# All tests of the program that the filter names must run, none skipped. What each driver passed of the conformance suite
# goes to the host.
run_tests() { # program, filter
  local program=$RIG_BUILD/bin/$1 status=0
  touch "$scratch/begin"
  "$program" --gtest_color=no --gtest_filter="$2" >"$scratch/$1.log" 2>&1 || status=$?
  grep -vE '^\[ +(RUN|OK) +\]' "$scratch/$1.log" || true
  [ "$status" = 0 ] || fail "$1 ended with status $status"
  grep -E '^\[  PASSED  \] [1-9]' "$scratch/$1.log" >/dev/null || fail "no test of $1 ran"
  expect_refused grep -F '[  SKIPPED ]' "$scratch/$1.log"
  mkdir -p /run/results/conformance
  find "$RIG_BUILD/conformance" -type f -newer "$scratch/begin" -exec cp {} /run/results/conformance/ ';' 2>/dev/null || true
}
