# A rig and a job that are small enough for the machine.
# shellcheck shell=bash

# The shipped virtual rig with frames of 160 x 120 painted from a hash.
tiny_rig() { # file
  sed -e 's/width = 1600/width = 160/' -e 's/height = 1200/height = 120/' -e 's/\(f[xy]_px\) = 6000.0/\1 = 600.0/' \
    -e 's/cx_px = 803.2/cx_px = 80.3/' -e 's/cy_px = 596.4/cy_px = 59.6/' \
    -e 's/readout_ms = 500.0/readout_ms = 50.0\nrender = "hash"/' "$1"
}

# Hands a part of the rig to a device of another module.
part_of() { # part, module, device; rig.toml in and out
  sed "/^\\[$1\\]/,/^\\[/{s/^module = .*/module = \"$2\"/;s/^device = .*/device = \"$3\"/}"
}

# The tiny rig by the wall's time, for devices that know no other; all deadlines are long.
real_time_rig() {
  tiny_rig "$RIG_SOURCE/share/virtual/rig.toml" | sed -e '/^clock = /d' \
    -e 's/^warm_up_s = 900.0/warm_up_s = 0.0\nwarm_at_start = true/' -e 's/^settle_ms = .*/settle_ms = 20/'
  printf '%s\n' '[deadlines]' 'axis_ms = 30000' 'camera_ms = 30000' 'frame_ms = 60000' 'light_ms = 30000' 'lines_ms = 30000'
}

# The arm's travel and homing as the simulated drives of the cases have them: from a switch at 45 degrees upwards.
arm_from_45() {
  sed '/^.axis.arm/,/^.home/{s/^min_deg.*/min_deg = 45.0/;s/^approach_deg.*/approach_deg = 0.0/}'
}

# exposures_us: for a camera that has others.
write_job() { # poses
  local i
  printf '%s\n' 'format = 1' 'name = "night"' 'sample = "chart"' '[exposure]' 'strategy = "fixed"' \
    "exposures_us = [${exposures_us:-60000, 8000}]" '[poses]' 'angles_deg = ['
  for ((i = 0; i < $1; ++i)); do
    printf '  [%d, %d, %d, %d],\n' $((30 + i % 90)) $((i % 2 * 24 - 12)) $((40 - i % 80)) $((95 + i % 40))
  done
  printf ']\n'
}
