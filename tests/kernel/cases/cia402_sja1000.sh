# A scan with the light arm on a CANopen drive at the other end of a wire between two sja1000 controllers. In the middle of
# the job the interface is taken down, and brought up again.
# suite: devices
# limit: 120
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/scan.sh"
. "$KERNEL_TESTS/guest/canopen.sh"

modprobe -a kvaser_pci can-raw
for interface in can0 can1; do
  await test -e /sys/class/net/$interface
  ip link set $interface type can bitrate 500000 restart-ms 100
  ip link set $interface up
  on_exit ip link set $interface down
done
start_drive can1
canopen_rig can0 >"$scratch/rig.toml"
start_scan 12
await poses_done 2
ip link set can0 down
await suspended can0
ip link set can0 up
await_scan
expect_drive_moved
