// The fake driver's axis, right but for its flaw.
#pragma once

#include <memory>

#include "tests/drivers/conformance/fake_wire.h"

namespace rig::drivers::conformance {

/// What the fake module wrongly keeps between two openings.
struct FakeMemory {
  bool homed = false;
  bool line_kept = false;
};

[[nodiscard]] std::unique_ptr<Axis> make_fake_axis(FakeWire& wire, base::Clock& clock, FakeMemory& memory,
                                                   Flaw flaw);

}  // namespace rig::drivers::conformance
