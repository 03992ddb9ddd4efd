// A network of this process' own, with nothing but its loopback interface in it.
#pragma once

namespace rig::sim::wire {

/// GigE Vision has one port for all cameras of an address: programs that run a simulated one beside each
/// other need a network each. Children of the process live in it too. To be called before there are threads.
/// False where the kernel allows it to nobody but root: then everything stays as it was.
bool enter_own_network();

}  // namespace rig::sim::wire
