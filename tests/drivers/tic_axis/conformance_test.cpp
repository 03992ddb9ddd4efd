// The conformance suite on the module as rigd loads it.
#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/tic_axis/bench.h"

RIG_CONFORMANCE_TESTS(TicAxis, rig::drivers::tic::test::make_bench);
