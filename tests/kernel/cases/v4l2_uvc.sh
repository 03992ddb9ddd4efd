# The driver of V4L2 cameras on the kernel's uvcvideo and a simulated USB video camera: the conformance suite's checks of
# a camera, and what exposure and gain do to the light.
# suite: devices
# limit: 300
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/gtest.sh"

start_usb
modprobe uvcvideo
run_tests test_drivers_v4l2_camera 'UvcCameraInKernel.*:*/UvcConformance.*'
