#include "core/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#endif

namespace rig::base {

#ifdef __SANITIZE_THREAD__
// oneTBB is not built for the thread sanitizer, which does not see that the body runs after the call began
// and before it returns. These tell it, and nothing else.
void parallel_for(std::size_t n, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
  std::atomic<int> order{0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      order.load(std::memory_order_acquire);
                      body(range.begin(), range.end());
                      order.fetch_add(1, std::memory_order_acq_rel);
                    });
  order.load(std::memory_order_acquire);
}
#else
void parallel_for(std::size_t n, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, n, grain),
      [&body](const tbb::blocked_range<std::size_t>& range) { body(range.begin(), range.end()); });
}
#endif

}  // namespace rig::base
