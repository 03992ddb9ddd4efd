# The camera driver on the kernel's virtual video device: formats, settings that show in their own frames and no others,
# and the faults that the device can be told to have.
# suite: devices
# limit: 240
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/gtest.sh"

modprobe vivid n_devs=1 node_types=0x1
[ -e /dev/video0 ] || fail "vivid made no /dev/video0"
export RIG_V4L2_DEVICE=/dev/video0
run_tests test_drivers_v4l2_camera 'KernelVivid.*'
