# The kernel's uvcvideo on a USB video camera that is a program: V4L2's controls reach the exposure of real frames, and
# what a USB camera does wrong looks to a program as it does on a real one.
# suite: devices
# limit: 240
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/uvc.sh"

width=320
height=240
start_usb
start_camera --delay 2
await camera_is_there
node=$(video_node)
v4l2() { v4l2-ctl -d "$node" "$@"; }
control() { v4l2 --get-ctrl "$1" | sed 's/.*: //'; }
capture() { # format for V4L2, for the reader, frames
  v4l2 --set-fmt-video=width=$width,height=$height,pixelformat="$1" --stream-mmap=4 --stream-count="$3" \
    --stream-to="$scratch/frames" >/dev/null 2>&1
  read_frames "$scratch/frames" $width $height "$2" >"$scratch/facts"
}
expect_settings() { # exposure, gain, brightness: of all frames that were captured
  expect_equal "what the frames were taken with" "$(cut -d' ' -f2-4 "$scratch/facts" | sort -u)" "$1 $2 $3"
}

formats=$(v4l2 --list-formats-ext)
echo "$formats"
for format in GREY 'Y12 ' 'Y16 ' RGGB; do
  contains "'$format'" <<<"$formats" || fail "no format $format"
done
contains 640x480 <<<"$formats"
controls=$(v4l2 --list-ctrls)
echo "$controls"
contains 'exposure_time_absolute.*min=1 max=20000 step=1 default=156.*inactive' <<<"$controls"
contains 'gain.*min=16 max=255 step=1 default=16' <<<"$controls"
contains 'brightness.*min=0 max=255 step=1 default=64' <<<"$controls"

# The camera exposes by itself until it is told not to, at first for no longer than 30 frames a second leave it.
for each in '0 333' '1 384'; do
  v4l2 --set-ctrl exposure_dynamic_framerate="${each% *}"
  capture GREY GREY 4
  expect_equal "the automatic exposure" "$(control exposure_time_absolute)" "${each#* }"
  expect_equal "the exposure of the last frame" "$(tail -n1 "$scratch/facts" | cut -d' ' -f2-4)" "${each#* } 16 64"
done
expect_refused v4l2 --set-ctrl exposure_time_absolute=100

v4l2 --set-ctrl auto_exposure=1
for each in '40 16 64' '2000 16 0' '100 48 255'; do
  read -r exposure gain brightness <<<"$each"
  v4l2 --set-ctrl "exposure_time_absolute=$exposure,gain=$gain,brightness=$brightness"
  expect_equal exposure "$(control exposure_time_absolute)" "$exposure"
  for format in 'GREY GREY' 'Y16  Y16'; do
    capture "${format% *}" "${format##* }" 2
    expect_settings "$exposure" "$gain" "$brightness"
  done
done
capture 'Y12 ' Y12 1
expect_settings 100 48 255
capture RGGB RGGB 1
expect_settings 100 48 255
# V4L2 itself keeps a value within the bounds that the camera told.
v4l2 --set-ctrl exposure_time_absolute=20001
expect_equal "an exposure beyond the longest" "$(control exposure_time_absolute)" 20000
v4l2 --set-ctrl exposure_time_absolute=100

# A setting in the middle of a stream is in the frames after those that are on their way; an exposure of 300 ms makes the
# frames that slow.
v4l2 --set-ctrl exposure_time_absolute=3000
capture GREY GREY 16 &
capturing=$!
await streaming
v4l2 --set-ctrl exposure_time_absolute=1000
wait $capturing
cut -d' ' -f2 "$scratch/facts" | uniq -c | tee "$scratch/runs"
expect_equal "exposures one after the other" "$(awk '{print $2}' "$scratch/runs" | xargs)" '3000 1000'
[ "$(awk 'NR == 1 {print $1}' "$scratch/runs")" -gt 2 ] || fail "the setting was in a frame too early"
v4l2 --set-ctrl exposure_time_absolute=100

# A frame with its error bit, and one that is cut, never reach a program; a request that stalls does.
order damage 1
order cut 2 50  # the first is both
before=$(state_of frame)
capture GREY GREY 2
[ "$(head -n1 "$scratch/facts" | cut -d' ' -f1)" -ge $((before + 3)) ] || fail "the kernel gave a bad frame"
order stall 1 4
expect_refused v4l2 --set-ctrl brightness=100
v4l2 --set-ctrl brightness=100

# The plug is pulled out of a stream. From then on the kernel gives bad frames, too, and marks them.
v4l2 --stream-mmap=4 --stream-count=0 >"$scratch/stream" 2>&1 &
capturing=$!
await streaming
order unplug
await camera_is_gone
wait $capturing || true  # v4l2-ctl calls that success
on_exit sh -c 'echo 0 >/sys/module/uvcvideo/parameters/nodrop'
echo 1 >/sys/module/uvcvideo/parameters/nodrop
order plug
await camera_is_there
node=$(video_node)
expect_equal "mode after power-up" "$(control auto_exposure)" '3 (Aperture Priority Mode)'
v4l2 --set-ctrl auto_exposure=1
capture GREY GREY 1
expect_settings 156 16 64
order damage 1
v4l2 --stream-mmap=4 --stream-count=2 --verbose >"$scratch/stream" 2>&1
grep dqbuf "$scratch/stream"
expect_equal "frames that are marked as bad" "$(grep -c 'dqbuf.*error' "$scratch/stream")" 1
order state
