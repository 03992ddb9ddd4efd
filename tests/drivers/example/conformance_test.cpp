#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/example/bench.h"

RIG_CONFORMANCE_TESTS(ExampleDriver, rig::drivers::turner::make_bench)
