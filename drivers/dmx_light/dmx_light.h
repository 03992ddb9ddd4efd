// A light whose level, and perhaps shutter, are channels of DMX512, put out by an ENTTEC DMX USB Pro or one
// of the widgets that speak as it does.
//
// DMX has no answers: nobody knows what a fixture does. What state() tells is what the widget has taken, and
// that the widget is alive. The widget puts the last packet out by itself, also when its computer is gone.
// docs/drivers/dmx_light.md has wiring, settings and faults.
#pragma once

#include <memory>

#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/api/module.h"
#include "drivers/dmx_light/settings.h"

namespace rig::drivers::dmx_light {

/// Opens the widget and puts its level of start out, the shutter closed. An error where it is not there or
/// another than `serial`. A widget that vanishes is `lost` and opened again once a second, if it is the same;
/// it is then at its level of start, never at what was asked before.
[[nodiscard]] Result<std::unique_ptr<Light>> make_dmx_light(const DmxSettings& settings,
                                                            const OpenContext& context);

}  // namespace rig::drivers::dmx_light
