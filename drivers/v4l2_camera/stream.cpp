#include "drivers/v4l2_camera/stream.h"

#include <algorithm>
#include <cerrno>
#include <linux/videodev2.h>

#include "drivers/v4l2_camera/device_error.h"

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

v4l2_buffer buffer_of(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

int ask_for_buffers(VideoNode& node, v4l2_requestbuffers& asked, int buffers) {
  asked = {};
  asked.count = static_cast<std::uint32_t>(buffers);
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.memory = V4L2_MEMORY_MMAP;
  return node.request(VIDIOC_REQBUFS, &asked);
}

tl::unexpected<base::Error> broken(const std::string& what, int error) {
  auto failed = failed_to(what, error);
  failed.value().code = ErrorCode::lost;
  return failed;
}

FrameFacts facts_of(const v4l2_buffer& buffer, Stamp stamp, std::size_t room) {
  FrameFacts facts;
  facts.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  facts.bytes = std::min<std::size_t>(buffer.bytesused, room);
  facts.sequence = buffer.sequence;
  facts.monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool told_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  facts.stamp_is_start = stamp == Stamp::as_told ? told_start : stamp == Stamp::start;
  facts.stamp_ns = static_cast<std::int64_t>(buffer.timestamp.tv_sec) * 1'000'000'000 +
                   static_cast<std::int64_t>(buffer.timestamp.tv_usec) * 1000;
  return facts;
}

}  // namespace

Result<std::unique_ptr<Stream>> Stream::start(VideoNode& node, const Settings& settings, std::size_t bytes,
                                              int buffers) {
  std::unique_ptr<Stream> stream(new Stream(node, settings.stamp));
  if (auto done = stream->allocate(bytes, buffers); !done) return pass(done);
  for (std::size_t i = 0; i < stream->buffers_.size(); ++i) {
    if (auto done = stream->give_back(static_cast<std::uint32_t>(i)); !done) return pass(done);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = node.request(VIDIOC_STREAMON, &type); error != 0) {
    return failed_to("to start its stream", error);
  }
  stream->running_ = true;
  return stream;
}

Result<void> Stream::allocate(std::size_t bytes, int buffers) {
  v4l2_requestbuffers got{};
  if (const int error = ask_for_buffers(node_, got, buffers); error != 0) {
    return failed_to(fmt::format("to make {} buffers", buffers), error);
  }
  if (got.count < 2) return fail(ErrorCode::device, fmt::format("it has only {} buffers", got.count));
  for (std::uint32_t i = 0; i < got.count; ++i) {
    v4l2_buffer buffer = buffer_of(i);
    if (const int error = node_.request(VIDIOC_QUERYBUF, &buffer); error != 0) {
      return failed_to(fmt::format("to describe its buffer {}", i), error);
    }
    if (buffer.length < bytes) {
      return fail(ErrorCode::device,
                  fmt::format("its buffers have {} bytes, an image has {}", buffer.length, bytes));
    }
    auto mapping = node_.map(buffer.m.offset, buffer.length);
    if (!mapping) return failed_to(fmt::format("to map its buffer {}", i), mapping.error());
    buffers_.push_back(std::move(*mapping));
  }
  return {};
}

Stream::~Stream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (running_) (void)node_.request(VIDIOC_STREAMOFF, &type);
  buffers_.clear();
  v4l2_requestbuffers none{};
  (void)ask_for_buffers(node_, none, 0);
}

Result<std::optional<Filled>> Stream::take() {
  v4l2_buffer buffer = buffer_of(0);
  const int error = node_.request(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return std::optional<Filled>();
  if (error != 0) return broken("to hand out a frame", error);
  if (buffer.index >= buffers_.size()) {
    return fail(ErrorCode::lost, fmt::format("it hands out buffer {} of {}", buffer.index, buffers_.size()));
  }
  const Mapping& memory = buffers_[buffer.index];
  Filled filled;
  filled.index = buffer.index;
  filled.facts = facts_of(buffer, stamp_, memory.size());
  filled.bytes = {memory.data(), filled.facts.bytes};
  return std::optional<Filled>(filled);
}

Result<void> Stream::give_back(std::uint32_t index) {
  v4l2_buffer buffer = buffer_of(index);
  if (const int error = node_.request(VIDIOC_QBUF, &buffer); error != 0) {
    return broken("to take a buffer back", error);
  }
  return {};
}

}  // namespace rig::drivers::v4l2
