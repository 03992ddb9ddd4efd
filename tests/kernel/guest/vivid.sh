# For cases with the camera on the kernel's virtual video device, which exposes for 20 ms and for nothing else.
# shellcheck shell=bash

exposures_us=20000

start_vivid() {
  modprobe vivid n_devs=1 node_types=0x1
  [ -e /dev/video0 ] || fail "vivid made no /dev/video0"
}

# Hands the camera of rig.toml to it.
camera_on_vivid() { # rig.toml in and out
  part_of camera eye camera | sed -e '/^.camera\]/,/^.light/{s/^width = .*/width = 320/;s/^height = .*/height = 180/' \
    -e 's/^cx_px = .*/cx_px = 160.0/;s/^cy_px = .*/cy_px = 90.0/}'
  cat <<'TOML'
[[module]]
name = "eye"
file = "v4l2_camera"
[module.settings]
device = "/dev/video0"
pixel_format = "SRGGB12"
width = 320
height = 180
frame_interval_ms = 100
fixed_exposure_ms = 20
exclusive = false
measure_settling = false
settle_frames = 1
TOML
}

# One of the buttons by which it has faults.
press() { # name
  v4l2-ctl -d /dev/video0 --set-ctrl="$1=1"
}

# So many frames are of one size each and say how they were exposed.
expect_frames() { # poses
  local frames
  frames=$(find "$scratch/scan/frames" -type f -name '*.tif*' | wc -l)
  [ "$frames" -ge "$1" ] || fail "$frames frames of $1 poses"
}
