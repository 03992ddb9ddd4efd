# rigd starts under systemd as installed, says that it is ready, and obeys those who may command it.
# suite: service
# limit: 90
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/service.sh"

install_rigd
setpriv --reuid=rigd --regid=rigd --init-groups rigd --check
start_rigd
expect_property ActiveState active
expect_property User rigd
expect_property NotifyAccess main
expect_property NRestarts 0
expect_property StatusText 'no job'
expect_equal "who owns observe.sock" "$(stat -c %U:%G:%a /run/rigd/observe.sock)" rigd:rig-observe:660
expect_equal "who owns operate.sock" "$(stat -c %U:%G:%a /run/rigd/operate.sock)" rigd:rig-operate:660
expect_equal "who owns the state folder" "$(stat -c %U:%G:%a /var/lib/rigd)" rigd:rigd:750

as alice rig status | contains 'virtual rig .*: idle'
as bob rig status --endpoint ipc:///run/rigd/observe.sock | contains 'virtual rig .*: idle'
expect_refused as bob rig status --wait 2
expect_refused as mallory rig status --wait 2
expect_refused as mallory rig status --wait 2 --endpoint ipc:///run/rigd/observe.sock

submit_job 4
await_scan
expect_property StatusText 'no job'
