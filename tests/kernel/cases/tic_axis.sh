# The conformance suite's checks of an axis on a Pololu Tic at the kernel's USB, those that libusb and the kernel have a
# part in.
# suite: devices
# limit: 210
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/gtest.sh"

start_usb
checks=
for check in capabilities_are_true a_move_arrives_and_proves_it closed_in_a_move_and_opened_again \
  killed_in_a_move_and_opened_again abort_during_a_move homing \
  missing_answers garbled_answers lost_at_rest_and_back lost_in_a_move_and_back absent_at_opening; do
  checks+=":*/KernelConformance.Passes/axis_$check"
done
run_tests test_drivers_tic_axis "${checks#:}" 2
