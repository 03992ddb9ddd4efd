# For the cases of the suite "service": rigd as docs/operations.md has it installed, on the virtual rig. Each case gets a
# rigd without a past.
# shellcheck shell=bash
. "$KERNEL_TESTS/guest/job.sh"

shipped=$(dirname "$(systemctl show -P FragmentPath rigd)")/../../../share/rigd/virtual/rig.toml

install_rigd() {
  systemd-sysusers
  systemd-tmpfiles --create
  tiny_rig "$shipped" | describe_rig
  rm -rf /var/lib/rigd /srv/rigd/*
  person alice rig-operate
  person bob rig-observe
  person mallory users
  journalctl --sync
  before=$(journalctl -n 0 --show-cursor | sed -n 's/^-- cursor: //p')
  on_exit forget_rigd
}

# The rig.toml on standard input is the machine's, with the sockets' groups.
describe_rig() {
  {
    printf '%s\n' 'sockets.observe_group = "rig-observe"' 'sockets.operate_group = "rig-operate"'
    cat
  } >/etc/rigd/rig.toml
}

forget_rigd() {
  systemctl stop rigd
  rm -rf /run/systemd/system/rigd.service.d
  systemctl daemon-reload
  systemctl reset-failed rigd 2>/dev/null
}

person() { # name, group
  id "$1" >/dev/null 2>&1 || useradd --no-create-home --shell /bin/bash --groups "$2" "$1"
}

as() { # person, command
  setpriv --reuid="$1" --regid="$1" --init-groups --reset-env -- /usr/bin/env PATH="$PATH" "${@:2}"
}

# Lines for the unit's section [Service], until the case ends.
change_unit() {
  mkdir -p /run/systemd/system/rigd.service.d
  printf '%s\n' '[Service]' "$@" >/run/systemd/system/rigd.service.d/case.conf
  systemctl daemon-reload
}

# Starts rigd; systemctl comes back when rigd has said that it is ready.
start_rigd() {
  systemctl start rigd || { logged; fail "rigd did not start"; }
}

property() { systemctl show -P "$1" rigd; }

expect_property() { # name, value
  expect_equal "$1 of rigd.service" "$(property "$1")" "$2"
}

# What the journal got of rigd.service since the case began.
logged() {
  journalctl --sync
  journalctl -u rigd -o cat --after-cursor "$before" --no-pager
}

expect_logged() { # extended regular expression
  logged | contains "$1" || { logged; fail "the journal has no '$1'"; }
}

# rigd-safe has told of every part.
expect_made_safe() {
  for axis in roll tilt pan arm; do expect_logged "^axis $axis: stands at "; done
  expect_logged '^light: shutter closed$'
}

# An operator hands in a job of so many poses, and may read what comes of it.
submit_job() { # poses
  write_job "$1" >"$scratch/job.toml"
  chmod 755 "$scratch"
  as alice rig job submit "$scratch/job.toml" --scan /srv/rigd/night --wait 30
}

poses_done() { # at least
  local count
  count=$(property StatusText | sed -n "s/.*: \([0-9]*\) of [0-9]* poses done.*/\1/p")
  [ "${count:-0}" -ge "$1" ]
}

await_scan() { # poses
  as alice rig watch --until-idle --lines --wait 30 >"$scratch/watch"
  as alice rig scan verify /srv/rigd/night
  as alice rig job list | contains complete || { as alice rig job list; fail "the job is not complete"; }
}
