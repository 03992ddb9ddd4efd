#include "share/examples/driver/link.h"

#include "share/examples/driver/protocol.h"

namespace rig::drivers::turner {

using base::pass;
using base::Result;

Link::Link(const SerialSettings& serial, const RetryPolicy& policy, base::Clock& clock)
    : policy_(policy), line_([serial] { return SerialLine::open(serial); }, clock) {}

Result<std::string> Link::attempt(SerialLine& line, std::string_view text) {
  // What came late for the request before is not for this one. A tag of its own for each attempt tells what
  // comes later still; a device that repeats none needs quiet on the line before it is asked again.
  line.discard_input();
  tag_ = (tag_ + 1) % 10;
  if (auto sent = line.write(request(tag_, text), policy_.answer); !sent) return pass(sent);
  constexpr std::size_t kLongest = 64;
  const auto come = line.read_until('\n', policy_.answer, kLongest);
  if (!come) return pass(come);
  return answer(tag_, *come);
}

}  // namespace rig::drivers::turner
