# What the cases share; each sources it first.
# shellcheck shell=bash
set -Eeuo pipefail
trap 'echo "${BASH_SOURCE[0]}:$LINENO: status $?: $BASH_COMMAND" >&2' ERR
trap 'leave' EXIT

scratch=$(mktemp -d /run/case.XXXXXX)
undo=()

# A command to run when the case ends, the last one first.
on_exit() { undo+=("$(printf '%q ' "$@")"); }

leave() {
  local i
  trap - ERR
  set +e
  for ((i = ${#undo[@]} - 1; i >= 0; --i)); do eval "${undo[i]}"; done
  rm -rf "$scratch"
}

fail() {
  printf 'FAILED: %s\n' "$*" >&2
  exit 1
}

# Repeats a command until it succeeds, or until the case's time is almost over. No case counts on how fast the machine
# is.
await() { # command
  until "$@"; do
    [ $SECONDS -lt $((CASE_LIMIT - 5)) ] || fail "waited in vain for: $*"
    sleep 0.1
  done
}

expect_equal() { # what, found, wanted
  [ "$2" = "$3" ] || fail "$1 is '$2', not '$3'"
}

# Whether standard input has such a line; reads all of it, so that the writer's status is its own.
contains() { # extended regular expression
  grep -E -- "$1" >/dev/null
}

expect_refused() { # command
  if "$@"; then fail "was not refused: $*"; fi
}

# USB devices that are programs can be plugged in: those who wait for devices hear of it, and their nodes get their groups.
start_usb() {
  modprobe vhci-hcd
  /lib/systemd/systemd-udevd --daemon
  on_exit udevadm control --exit
}
