# A device whose driver is loaded only after rigd has started can be opened by rigd: DeviceAllow= knows its kind.
# suite: service
# limit: 60
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/service.sh"

install_rigd
start_rigd
modprobe vivid n_devs=1 node_types=0x1
on_exit modprobe -r vivid
await test -c /dev/video0
sh -c "echo \$\$ >/sys/fs/cgroup$(property ControlGroup)/cgroup.procs && exec 3<>/dev/video0"
