// tic_axis on the kernel's own USB, through libusb. Skipped where there is no virtual USB host controller.
#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/tic_axis/usb_bench.h"

namespace rig::drivers::tic::test {
namespace {

std::vector<std::size_t> checks_of_axes() {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < conformance::checks().size(); ++i) {
    if (conformance::checks()[i].name.starts_with("axis")) numbers.push_back(i);
  }
  return numbers;
}

class KernelConformance : public conformance::ConformanceTest {};

TEST_P(KernelConformance, Passes) {
  if (!has_virtual_usb()) GTEST_SKIP() << "no virtual USB host controller (vhci-hcd); tests/kernel has one";
  run(make_usb_bench(), conformance::checks()[GetParam()]);
}

INSTANTIATE_TEST_SUITE_P(TicAxis, KernelConformance, testing::ValuesIn(checks_of_axes()),
                         conformance::test_name_of);

}  // namespace
}  // namespace rig::drivers::tic::test
