// Loops on all cores, through oneTBB, with the heavy header kept out of sight.
#pragma once

#include <cstddef>
#include <functional>

namespace rig::base {

/// Calls body(begin, end) for pieces of [0, n) of at most about `grain` items, on all cores; returns when all
/// are done. An exception of a body is thrown here. Pieces must not depend on each other.
void parallel_for(std::size_t n, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body);

}  // namespace rig::base
