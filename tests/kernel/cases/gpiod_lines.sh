# Digital lines on a gpiochip of the kernel's: the chip is a CP2112 at the other end of the kernel's USB.
# suite: devices
# limit: 180
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/gtest.sh"

start_usb
modprobe -a usbhid hid-cp2112
run_tests test_drivers_gpiod_lines 'KernelLines.*:*/KernelConformance.*'
