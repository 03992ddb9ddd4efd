# For cases with the light arm on a Pololu Tic, which is a program at the other end of the kernel's USB.
# shellcheck shell=bash

start_tic() {
  start_usb
  mkfifo "$scratch/orders"
  rig-sim-tic --serial 00123456 --set 0x41=3 --set 0x40=46 --set 0x0A=0x27 --set 0x5F=8 --set 0x60=4 --set 0x4F=0x80 --set 0x50=0x1A \
    --set 0x51=0x06 <"$scratch/orders" >"$scratch/said" &
  on_exit kill $!
  exec {orders}>"$scratch/orders"
  await grep -q ready "$scratch/said"
}

order() { echo "$*" >&"$orders"; }

# rig.toml
tic_rig() {
  real_time_rig | part_of axis.arm tic arm | arm_from_45
  cat <<'TOML'
[[module]]
name = "tic"
file = "tic_axis"
[module.settings]
answer_ms = 2000
call_ms = 7000
silence_ms = 30000
[module.settings.axis.arm]
serial = "00123456"
counts_per_deg = 20.0
zero_deg = 45.0
max_velocity_deg_s = 100.0
max_acceleration_deg_s2 = 200.0
step_mode = 8
current_limit_ma = 1472
homing = "reverse"
TOML
}

# What the controller itself says in the end.
expect_tic_moved() {
  order state
  await grep -q '^position' "$scratch/said"
  cat "$scratch/said"
}
