# What the unit shuts is shut: as systemd has it, and as a process in rigd's place finds it.
# suite: service
# limit: 60
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/service.sh"

install_rigd
start_rigd
pid=$(property MainPID)

expect_property NoNewPrivileges yes
expect_property ProtectSystem strict
expect_property ProtectHome yes
expect_property PrivateTmp yes
expect_property PrivateNetwork yes
expect_property DevicePolicy closed
expect_property RestrictAddressFamilies 'AF_NETLINK AF_UNIX'
expect_property RestrictRealtime yes
expect_property RestrictSUIDSGID yes
expect_property MemoryDenyWriteExecute yes
expect_property ProtectKernelModules yes
expect_property ProtectKernelTunables yes
expect_property ProtectProc invisible
expect_property CapabilityBoundingSet ''
for devices in char-ttyS char-ttyUSB char-ttyACM char-usb_device char-video4linux char-gpiochip; do
  property DeviceAllow | contains "$devices rw" || fail "DeviceAllow has no $devices"
done

# The kernel's own account of the process.
status() { sed -n "s/^$1:[[:space:]]*//p" "/proc/$pid/status"; }
expect_equal NoNewPrivs "$(status NoNewPrivs)" 1
expect_equal Seccomp "$(status Seccomp)" 2
expect_equal CapEff "$(status CapEff)" 0000000000000000
expect_equal CapBnd "$(status CapBnd)" 0000000000000000

# Its files: a read-only system, no homes, a /tmp of its own, and its own folders to write to.
touch /tmp/of-the-host
inside() { nsenter --mount --net --target "$pid" -- setpriv --reuid=rigd --regid=rigd --init-groups -- "$@"; }
nsenter --mount --target "$pid" -- sh -c '! touch /usr/by-root 2>/dev/null' || fail "even root could write to /usr"
inside touch /var/lib/rigd/probe /srv/rigd/probe
expect_refused inside touch /etc/rigd/probe
inside test -d /root && expect_refused inside ls /root
expect_refused inside test -e /tmp/of-the-host
expect_equal "the network interfaces" "$(inside cat /proc/self/net/dev | tail -n +3 | cut -d: -f1 | xargs)" lo

# Its devices: a shell that joins its control group may open what DeviceAllow= names, root or not.
opens() { # device
  test -c "$1"
  sh -c "echo \$\$ >/sys/fs/cgroup$(property ControlGroup)/cgroup.procs && exec 3<>$1" 2>"$scratch/refusal"
}
opens /dev/null
opens /dev/ttyS0
expect_refused opens /dev/mem
grep -q 'Operation not permitted' "$scratch/refusal"
expect_refused opens /dev/kmsg
