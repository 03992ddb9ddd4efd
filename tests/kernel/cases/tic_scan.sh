# A scan with the light arm on a Pololu Tic, which is a program at the other end of the kernel's USB: homed on its switch,
# moved, pulled out in the middle of the job and plugged in again.
# suite: devices
# limit: 150
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/scan.sh"
. "$KERNEL_TESTS/guest/tic.sh"

start_tic
tic_rig >"$scratch/rig.toml"
start_scan 12
await poses_done 2
order unplug
await suspended 'is gone'
order plug
await_scan
expect_tic_moved
