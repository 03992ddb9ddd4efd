# A rig and a job that are small enough for the machine.
# shellcheck shell=bash

# The shipped virtual rig with frames of 160 x 120 painted from a hash.
tiny_rig() { # file
  sed -e 's/width = 1600/width = 160/' -e 's/height = 1200/height = 120/' -e 's/\(f[xy]_px\) = 6000.0/\1 = 600.0/' \
    -e 's/cx_px = 803.2/cx_px = 80.3/' -e 's/cy_px = 596.4/cy_px = 59.6/' \
    -e 's/readout_ms = 500.0/readout_ms = 50.0\nrender = "hash"/' "$1"
}

write_job() { # poses
  local i
  printf '%s\n' 'format = 1' 'name = "night"' 'sample = "chart"' '[exposure]' 'strategy = "fixed"' \
    'exposures_us = [60000, 8000]' '[poses]' 'angles_deg = ['
  for ((i = 0; i < $1; ++i)); do
    printf '  [%d, %d, %d, %d],\n' $((30 + i % 90)) $((i % 2 * 24 - 12)) $((40 - i % 80)) $((95 + i % 40))
  done
  printf ']\n'
}
