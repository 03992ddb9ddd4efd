// gpiod_lines against the conformance suite, with a board behind a socket in the place of the kernel.
#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/gpiod_lines/bench.h"

namespace {

std::unique_ptr<rig::drivers::conformance::Bench> make_lines_bench() {
  return std::make_unique<rig::drivers::gpiod_lines::LinesBench>();
}

}  // namespace

RIG_CONFORMANCE_TESTS(GpiodLinesModule, make_lines_bench);
