#include "sim/wire/v4l2_queue.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sys/mman.h>
#include <system_error>
#include <unistd.h>

namespace rig::sim::wire {

namespace {

constexpr std::uint32_t kOffset = 1U << 20U;  // from one buffer to the next, as the kernel tells it
constexpr std::uint32_t kMostBuffers = 32;

bool is_ours(std::uint32_t type) {
  return type == V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

}  // namespace

V4l2Queue::V4l2Queue(std::vector<Size> sizes, std::uint32_t padding)
    : sizes_(std::move(sizes)), padding_(padding), format_(&video_formats().front()) {
  image_.width = sizes_.front().width;
  image_.height = sizes_.front().height;
  image_.pixelformat = format_->fourcc;
  fit(image_);
}

V4l2Queue::~V4l2Queue() {
  free_buffers();
}

void V4l2Queue::free_buffers() {
  for (const Buffer& buffer : buffers_) {
    ::munmap(buffer.bytes, image_.sizeimage);
    ::close(buffer.memory);
  }
  buffers_.clear();
  queued_.clear();
  done_.clear();
}

// A device takes what is nearest to what was asked for.
void V4l2Queue::fit(v4l2_pix_format& image) const {
  const VideoFormat* format = find_video_format(image.pixelformat);
  if (format == nullptr) format = &video_formats().front();
  const auto distance = [&](const Size& size) {
    return std::labs(static_cast<long>(size.width) - static_cast<long>(image.width)) +
           std::labs(static_cast<long>(size.height) - static_cast<long>(image.height));
  };
  const Size size = *std::min_element(
      sizes_.begin(), sizes_.end(), [&](const Size& a, const Size& b) { return distance(a) < distance(b); });
  image.pixelformat = format->fourcc;
  image.width = size.width;
  image.height = size.height;
  image.field = V4L2_FIELD_NONE;
  image.bytesperline = format->compressed ? 0 : video_line_bytes(*format, size.width) + padding_;
  image.sizeimage = std::max(image.bytesperline, 1U) * size.height;
  image.colorspace = V4L2_COLORSPACE_RAW;
}

int V4l2Queue::list_format(v4l2_fmtdesc& about) {
  const auto& all = video_formats();
  if (!is_ours(about.type) || about.index >= all.size()) return EINVAL;
  const VideoFormat& format = all[about.index];
  about.flags = format.compressed ? V4L2_FMT_FLAG_COMPRESSED : 0;
  about.pixelformat = format.fourcc;
  std::memset(about.description, 0, sizeof about.description);
  std::memcpy(about.description, format.description,
              std::min(std::strlen(format.description), sizeof about.description - 1));
  return 0;
}

int V4l2Queue::get_format(v4l2_format& format) const {
  if (!is_ours(format.type)) return EINVAL;
  format.fmt.pix = image_;
  return 0;
}

int V4l2Queue::set_format(v4l2_format& format) {
  if (!is_ours(format.type)) return EINVAL;
  if (!buffers_.empty()) return EBUSY;
  fit(format.fmt.pix);
  image_ = format.fmt.pix;
  format_ = find_video_format(image_.pixelformat);
  return 0;
}

int V4l2Queue::make_buffers(v4l2_requestbuffers& request) {
  if (!is_ours(request.type) || request.memory != V4L2_MEMORY_MMAP) return EINVAL;
  if (streaming_) return EBUSY;
  free_buffers();
  request.count = request.count == 0 ? 0 : std::clamp(request.count, 2U, kMostBuffers);
  for (std::uint32_t i = 0; i < request.count; ++i) {
    Buffer buffer;
    buffer.memory = ::memfd_create("frame", MFD_CLOEXEC);
    if (buffer.memory < 0 || ::ftruncate(buffer.memory, image_.sizeimage) != 0) {
      throw std::system_error(errno, std::generic_category(), "memory of a frame");
    }
    void* at = ::mmap(nullptr, image_.sizeimage, PROT_READ | PROT_WRITE, MAP_SHARED, buffer.memory, 0);
    if (at == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "memory of a frame");
    buffer.bytes = static_cast<std::uint8_t*>(at);
    buffers_.push_back(buffer);
  }
  return 0;
}

v4l2_buffer V4l2Queue::described(std::uint32_t index) const {
  const Buffer& buffer = buffers_[index];
  v4l2_buffer said{};
  said.index = index;
  said.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  said.memory = V4L2_MEMORY_MMAP;
  said.length = image_.sizeimage;
  said.m.offset = index * kOffset;
  said.bytesused = buffer.frame.bytes;
  said.sequence = buffer.frame.sequence;
  said.field = V4L2_FIELD_NONE;
  said.timestamp.tv_sec = buffer.frame.stamp_ns / 1'000'000'000;
  said.timestamp.tv_usec = buffer.frame.stamp_ns % 1'000'000'000 / 1000;
  said.flags = buffer.frame.flags | V4L2_BUF_FLAG_MAPPED;
  if (buffer.at == At::queued) said.flags |= V4L2_BUF_FLAG_QUEUED;
  if (buffer.at == At::done) said.flags |= V4L2_BUF_FLAG_DONE;
  return said;
}

int V4l2Queue::describe(v4l2_buffer& buffer) const {
  if (!is_ours(buffer.type) || buffer.index >= buffers_.size()) return EINVAL;
  buffer = described(buffer.index);
  return 0;
}

int V4l2Queue::queue(v4l2_buffer& buffer) {
  if (!is_ours(buffer.type) || buffer.memory != V4L2_MEMORY_MMAP) return EINVAL;
  if (buffer.index >= buffers_.size() || buffers_[buffer.index].at != At::program) return EINVAL;
  buffers_[buffer.index].at = At::queued;
  queued_.push_back(buffer.index);
  buffer = described(buffer.index);
  return 0;
}

int V4l2Queue::dequeue(v4l2_buffer& buffer) {
  if (!is_ours(buffer.type) || buffer.memory != V4L2_MEMORY_MMAP || !streaming_) return EINVAL;
  if (done_.empty()) return EAGAIN;
  const std::uint32_t index = done_.front();
  done_.pop_front();
  buffers_[index].at = At::program;
  buffer = described(index);
  return 0;
}

int V4l2Queue::start(std::uint32_t type) {
  if (!is_ours(type) || buffers_.empty()) return EINVAL;
  streaming_ = true;
  return 0;
}

int V4l2Queue::stop(std::uint32_t type) {
  if (!is_ours(type)) return EINVAL;
  streaming_ = false;
  queued_.clear();
  done_.clear();
  for (Buffer& buffer : buffers_) buffer.at = At::program;
  return 0;
}

int V4l2Queue::memory_at(std::uint32_t offset) const {
  const std::uint32_t index = offset / kOffset;
  return offset % kOffset == 0 && index < buffers_.size() ? buffers_[index].memory : -1;
}

std::uint8_t* V4l2Queue::next_memory() {
  return queued_.empty() ? nullptr : buffers_[queued_.front()].bytes;
}

void V4l2Queue::fill(const Frame& frame) {
  Buffer& buffer = buffers_[queued_.front()];
  buffer.frame = frame;
  buffer.at = At::done;
  done_.push_back(queued_.front());
  queued_.pop_front();
}

}  // namespace rig::sim::wire
