// The conformance suite on the driver.
#include "tests/drivers/aravis_camera/bench.h"
#include "tests/drivers/conformance_tests.h"

RIG_CONFORMANCE_TESTS(AravisCamera, rig::drivers::aravis::make_bench);
