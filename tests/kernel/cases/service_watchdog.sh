# A rigd that hangs is killed within WatchdogSec=, the rig is made safe without it, it starts again, and its job goes on.
# suite: service
# limit: 180
. "$KERNEL_TESTS/guest/lib.sh"
. "$KERNEL_TESTS/guest/service.sh"

install_rigd
grep -qx WatchdogSec=30 "$(property FragmentPath)"
change_unit WatchdogSec=10
start_rigd
pid=$(property MainPID)
submit_job 60
await poses_done 3
kill -STOP "$pid"
begin=$SECONDS
poses_done 60 && fail "the job was done before rigd hung"

gone() { [ "$(property MainPID)" != "$pid" ]; }
await gone
[ $((SECONDS - begin)) -le 20 ] || fail "rigd was killed only after $((SECONDS - begin)) s"
expect_logged 'Watchdog timeout \(limit 10s\)!'

restarted() { [ "$(property NRestarts)" = 1 ] && [ "$(property ActiveState)" = active ]; }
await restarted
expect_made_safe
await_scan
expect_property NRestarts 1
