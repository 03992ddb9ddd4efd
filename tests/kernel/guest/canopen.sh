# For cases with the light arm on a CANopen drive: rigd on one CAN interface, the simulated drive on the same or another.
# shellcheck shell=bash

start_drive() { # interface
  mkfifo "$scratch/orders"
  "$RIG_BUILD/bin/rig-sim-canopen" --interface "$1" --node 3 --low -3000 --high 13000 --control "$scratch/orders" >"$scratch/said" &
  on_exit kill $!
  await grep -q ready "$scratch/said"
}

# rig.toml
canopen_rig() { # interface
  real_time_rig | part_of axis.arm can arm | arm_from_45
  cat <<TOML
[[module]]
name = "can"
file = "cia402_axis"
[module.settings]
interface = "$1"
answer_ms = 2000
call_ms = 20000
heartbeat_ms = 500
heartbeat_timeout_ms = 10000
[module.settings.axis.arm]
node = 3
counts_per_deg = 100
zero_deg = 45
max_velocity_deg_s = 100
max_acceleration_deg_s2 = 200
homing_method = 17
homing_speed_deg_s = 10
homing_creep_deg_s = 5
TOML
}

order() { echo "$*" >"$scratch/orders"; }

# What the drive itself says in the end.
expect_drive_moved() {
  order show 3
  await grep -q '^node 3' "$scratch/said"
  cat "$scratch/said"
  contains '^node 3 position [0-9.]+ standing' <"$scratch/said"
}
