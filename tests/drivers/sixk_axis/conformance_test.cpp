#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/sixk_axis/bench.h"

RIG_CONFORMANCE_TESTS(SixkAxis, rig::drivers::sixk::make_bench);
