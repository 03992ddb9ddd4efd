# A scan with the light arm on a CANopen drive and the camera on the kernel's virtual video device, both through the kernel's
# own interfaces. In the middle of the job the camera is disconnected, and is there again once nobody has it open.
# suite: devices
# limit: 150
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/scan.sh"
. "$KERNEL_TESTS/guest/canopen.sh"
. "$KERNEL_TESTS/guest/vivid.sh"

start_vivid
modprobe -a vcan can-raw
ip link add dev vcan_arm type vcan
on_exit ip link del vcan_arm
ip link set vcan_arm up
start_drive vcan_arm
canopen_rig vcan_arm | camera_on_vivid >"$scratch/rig.toml"
start_scan 12
await poses_done 2
press disconnect
await suspended 'it is gone'
await_scan
grep 'it is back' "$scratch/rigd.log"
expect_frames 12
expect_drive_moved
