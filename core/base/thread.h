// What the kernel knows of a thread: its name, and how readily it is put aside for others.
#pragma once

namespace rig::base {

/// Names the calling thread, as `top -H` and debuggers show it; the kernel keeps 15 characters.
void name_thread(const char* name);

/// From now on the calling thread, and those that it starts, give way to the process's other threads where
/// the processors do not suffice for all: for bulk work, beside which a question has to be answered promptly.
/// Cannot be taken back. Where the system does not allow it nothing changes.
void give_way_to_others();

}  // namespace rig::base
