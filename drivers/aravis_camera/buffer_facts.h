// What a received buffer says of itself.
#pragma once

#include "drivers/aravis_camera/frame_judge.h"
#include "drivers/aravis_camera/glib.h"

namespace rig::drivers::aravis {

/// `chunks` reads what the camera appends to its frames; nullptr: it appends nothing.
[[nodiscard]] BufferFacts facts_of(ArvBuffer* buffer, ArvChunkParser* chunks);

}  // namespace rig::drivers::aravis
