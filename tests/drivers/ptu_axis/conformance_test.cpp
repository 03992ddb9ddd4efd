#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/ptu_axis/bench.h"

RIG_CONFORMANCE_TESTS(PtuAxis, rig::drivers::ptu::make_bench);
