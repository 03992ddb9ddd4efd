# Two sja1000 controllers on one wire, driven by the kernel's kvaser_pci: what one sends the other receives.
# suite: devices
# limit: 40
. "$KERNEL_TESTS/guest/lib.sh"

modprobe -a kvaser_pci can-raw
for interface in can0 can1; do
  await test -e /sys/class/net/$interface
  ip link set $interface type can bitrate 500000 restart-ms 100
  ip link set $interface up
  on_exit ip link set $interface down
done

carries() { # from, to
  local pid
  candump -n 1 -L "$2" >"$scratch/frame" &
  pid=$!
  await grep -q "$2" /proc/net/can/rcvlist_all
  cansend "$1" 321#0102030405060708
  wait "$pid"
  grep -q " $2 321#0102030405060708$" "$scratch/frame"
}
carries can0 can1
carries can1 can0
ip -details link show can0 | contains 'state ERROR-ACTIVE'
