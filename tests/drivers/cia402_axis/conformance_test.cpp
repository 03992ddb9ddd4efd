// Every check of the conformance suite, on the simulated drive.
#include "tests/drivers/cia402_axis/bench.h"
#include "tests/drivers/conformance_tests.h"

RIG_CONFORMANCE_TESTS(Cia402Axis, rig::drivers::cia402::make_bench);
