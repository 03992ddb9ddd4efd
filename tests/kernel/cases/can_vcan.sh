# A virtual CAN interface carries a frame from one socket to another, and an error frame to those who ask for such.
# suite: devices
# limit: 30
. "$KERNEL_TESTS/guest/lib.sh"

modprobe -a vcan can-raw
ip link add dev vcan_probe type vcan
on_exit ip link del vcan_probe
ip link set vcan_probe up

listening() { grep -q vcan_probe "/proc/net/can/$1"; }

candump -n 1 -L vcan_probe,123:7FF >"$scratch/frame" &
frame=$!
candump -n 1 -L vcan_probe,7FF:7FF,#40 >"$scratch/error" &
error=$!
await listening rcvlist_fil
await listening rcvlist_err
cansend vcan_probe 123#DEADBEEF
cansend vcan_probe 20000040#0000000000000000
wait "$frame"
wait "$error"
grep -q ' vcan_probe 123#DEADBEEF$' "$scratch/frame"
grep -q ' vcan_probe 20000040#' "$scratch/error"
