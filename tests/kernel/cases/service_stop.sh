# systemctl stop ends rigd in order, also in the middle of a job, which goes on at the next start.
# suite: service
# limit: 90
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/service.sh"

install_rigd
start_rigd
submit_job 60
await poses_done 3
systemctl stop rigd
expect_property ActiveState inactive
expect_logged '^rigd.service: Deactivated successfully'
expect_made_safe
[ ! -e /run/rigd ] || fail "the sockets' folder is left"
expect_refused as alice rig status --wait 1

start_rigd
await_scan
expect_property NRestarts 0
