// The conformance suite on the driver.
#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/v4l2_camera/bench.h"

RIG_CONFORMANCE_TESTS(V4l2Camera, rig::drivers::v4l2::make_bench);
