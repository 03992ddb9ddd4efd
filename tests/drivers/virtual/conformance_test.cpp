#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/virtual/bench.h"

RIG_CONFORMANCE_TESTS(VirtualRig, rig::sim::make_bench)
