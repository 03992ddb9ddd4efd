# With the drop-in for CAN, rigd as a service reaches a CAN interface of the machine and scans with a drive on it; it still
# has no IP.
# suite: service
# limit: 120
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/service.sh"
. "$KERNEL_TESTS/guest/canopen.sh"

modprobe -a vcan can-raw
ip link add dev vcan_arm type vcan
on_exit ip link del vcan_arm
ip link set vcan_arm up
start_drive vcan_arm

install_rigd
canopen_rig vcan_arm | describe_rig
install -D -m 644 "$(dirname "$shipped")/../can.conf" /run/systemd/system/rigd.service.d/can.conf
systemctl daemon-reload
start_rigd
expect_property RestrictAddressFamilies 'AF_CAN AF_NETLINK AF_UNIX'
property IPAddressDeny | contains '0\.0\.0\.0/0'
submit_job 3
await_scan
expect_drive_moved
