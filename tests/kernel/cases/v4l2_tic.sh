# A scan with the light arm on a Pololu Tic at the kernel's USB and the camera on the kernel's virtual video device. In the
# middle of the job the camera's stream breaks down, and later the arm is pulled out and plugged in again.
# suite: devices
# limit: 180
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/scan.sh"
. "$KERNEL_TESTS/guest/tic.sh"
. "$KERNEL_TESTS/guest/vivid.sh"

start_vivid
start_tic
tic_rig | camera_on_vivid >"$scratch/rig.toml"
start_scan 16
await poses_done 2
press inject_fatal_streaming_error
await suspended 'it does not answer'
await poses_done 5
order unplug
await suspended 'axis arm: .* is gone'
order plug
await_scan
grep 'it is back' "$scratch/rigd.log"
expect_frames 16
expect_tic_moved
