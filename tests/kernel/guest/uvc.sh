# For cases with the simulated USB video camera (sim/wire/uvc_camera.h).
# shellcheck shell=bash

# A camera in the kernel's USB, told what to do by `order`.
start_camera() { # further arguments
  modprobe uvcvideo
  mkfifo "$scratch/orders"
  "$RIG_BUILD/bin/rig-sim-uvc" "$@" <"$scratch/orders" >"$scratch/said" 2>"$scratch/complaints" &
  # The next case may want the first node for another device.
  on_exit await camera_is_gone
  on_exit kill $!
  exec {orders}>"$scratch/orders"
  await grep -q ready "$scratch/said"
}

# Waits for the answer, which is the order's line in what the camera said.
order() {
  local before
  before=$(wc -l <"$scratch/said")
  echo "$*" >&"$orders"
  await later_than "$before"
  tail -n1 "$scratch/said"
}
later_than() { [ "$(wc -l <"$scratch/said")" -gt "$1" ]; }

# The node that the frames come from; the driver makes a second one for what it knows of them.
video_node() {
  local each
  for each in /sys/class/video4linux/video*; do
    if [ -e "$each" ] && grep -q 'Simulated UVC camera' "$each/name" && [ "$(cat "$each/index")" = 0 ]; then
      echo "/dev/$(basename "$each")"
      return
    fi
  done
  return 1
}
camera_is_there() { [ -c "$(video_node)" ]; }
camera_is_gone() { ! video_node >/dev/null; }

state_of() { order state | sed "s/.* $1 \([0-9]*\).*/\1/"; } # word
streaming() { order state | grep -q 'streaming 1'; }

# What frames are made of, a line each: frame number, exposure in 100 us, gain, brightness, light.
read_frames() { # file, width, height, format
  python3 -S -E "$KERNEL_TESTS/guest/uvc_frames.py" "$@"
}
