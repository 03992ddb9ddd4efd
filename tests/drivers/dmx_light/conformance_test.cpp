// dmx_light against the conformance suite.
#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/dmx_light/bench.h"

namespace {

std::unique_ptr<rig::drivers::conformance::Bench> make_dmx_bench() {
  return std::make_unique<rig::drivers::dmx_light::DmxBench>();
}

}  // namespace

RIG_CONFORMANCE_TESTS(DmxLightModule, make_dmx_bench);
