# The virtual USB host controller is there, with its ports free: programs become devices through it.
# suite: devices
# limit: 30
. "$KERNEL_TESTS/guest/lib.sh"

modprobe -a vhci-hcd
status=/sys/devices/platform/vhci_hcd.0/status
[ -e $status ] || fail "no $status"
free=$(awk '$1 == "hs" && $3 == "004"' $status | wc -l)
[ "$free" -ge 4 ] || fail "only $free free high-speed ports"
