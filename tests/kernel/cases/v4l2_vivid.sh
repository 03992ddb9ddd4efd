# The kernel's virtual video device: raw grey frames in buffers that are mapped, and the faults it can be told to have.
# suite: devices
# limit: 60
. "$KERNEL_TESTS/guest/lib.sh"

modprobe vivid n_devs=1 node_types=0x1
[ -e /dev/video0 ] || fail "vivid made no /dev/video0"
formats=$(v4l2-ctl -d /dev/video0 --list-formats)
for format in GREY 'Y10 ' 'Y12 ' 'Y16 ' RGGB RG12; do
  grep -q "'$format'" <<<"$formats" || fail "no format $format"
done
v4l2-ctl -d /dev/video0 --set-input=0 --set-fmt-video=width=640,height=360,pixelformat=GREY --stream-mmap=4 \
  --stream-count=5 --stream-to="$scratch/frames"
expect_equal "the size of five frames" "$(stat -c %s "$scratch/frames")" $((5 * 640 * 360))
v4l2-ctl -d /dev/video0 --list-ctrls | contains inject
