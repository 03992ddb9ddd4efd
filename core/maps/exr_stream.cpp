#include "core/maps/exr_stream.h"

#include <algorithm>
#include <stdexcept>

namespace rig::maps {

void MemoryOut::write(const char bytes[], int n) {
  const std::size_t end = position_ + static_cast<std::size_t>(n);
  if (bytes_.size() < end) bytes_.resize(end);
  std::copy_n(bytes, n, bytes_.data() + position_);
  position_ = end;
}

bool MemoryIn::read(char bytes[], int n) {
  const std::size_t left = position_ < bytes_.size() ? bytes_.size() - position_ : 0;
  if (n < 0 || static_cast<std::size_t>(n) > left) throw std::runtime_error("the file is cut short");
  std::copy_n(bytes_.data() + position_, n, bytes);
  position_ += static_cast<uint64_t>(n);
  return position_ < bytes_.size();
}

}  // namespace rig::maps
