# A scan with the light arm on a CANopen drive, over the kernel's SocketCAN. In the middle of the job the controller says
# that it has left the bus after too many errors, and nothing passes until it says that it was restarted.
# suite: devices
# limit: 120
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/scan.sh"
. "$KERNEL_TESTS/guest/canopen.sh"

modprobe -a vcan can-raw
ip link add dev vcan_arm type vcan
on_exit ip link del vcan_arm
ip link set vcan_arm up
start_drive vcan_arm
canopen_rig vcan_arm >"$scratch/rig.toml"
start_scan 12
await poses_done 2
bus_off=20000040
restarted=20000100
order unplug on
cansend vcan_arm $bus_off#0000000000000000
await suspended bus-off
order unplug off
cansend vcan_arm $restarted#0000000000000000
await_scan
grep 'the controller was restarted' "$scratch/rigd.log"
expect_drive_moved
