#include "clients/rig/frame_image.h"

#include <filesystem>
#include <span>
#include <vector>

#include "core/base/files.h"

// Last: it defines macros that hide the byte swaps of the system, which Protocol Buffers uses.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

// Encoded in memory, so that on disk it is there whole or not at all.
Result<void> write_image(const std::string& out, int width, int height, int channels,
                         const OIIO::TypeDesc& type, const void* data) {
  auto file = OIIO::ImageOutput::create(out);
  if (!file) return fail(ErrorCode::bad_input, "cannot write this kind of image", out, ".png or .tif");
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput sink(bytes);
  const OIIO::ImageSpec spec(width, height, channels, type);
  if (!file->set_ioproxy(&sink) || !file->open(out, spec) || !file->write_image(type, data) ||
      !file->close()) {
    return fail(ErrorCode::io, file->geterror(), out);
  }
  return base::write_file_durably(out, std::as_bytes(std::span(bytes)));
}

}  // namespace

Result<FrameContent> content_for(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".tif" || extension == ".tiff") return FrameContent::raw;
  if (extension == ".png") return FrameContent::preview;
  return fail(ErrorCode::bad_input, "is neither .png nor .tif", path);
}

Result<void> check_frame(const protocol::Frame& frame, FrameContent content) {
  const std::size_t raw = std::size_t{2} * frame.width() * frame.height();
  const std::size_t rgb = std::size_t{3} * frame.preview_width() * frame.preview_height();
  if ((content == FrameContent::raw && frame.raw().size() != raw) || frame.preview_rgb().size() != rgb)
    return fail(ErrorCode::damaged, "rigd's answer holds an image of another size than it says");
  if ((content == FrameContent::raw ? raw : rgb) == 0)
    return fail(ErrorCode::damaged, "rigd's answer holds no image");
  return {};
}

Result<void> write_frame(const protocol::Frame& frame, FrameContent content, const std::string& path) {
  if (auto ok = check_frame(frame, content); !ok) return ok;
  if (content == FrameContent::raw) {
    return write_image(path, static_cast<int>(frame.width()), static_cast<int>(frame.height()), 1,
                       OIIO::TypeDesc::UINT16, frame.raw().data());
  }
  return write_image(path, static_cast<int>(frame.preview_width()), static_cast<int>(frame.preview_height()),
                     3, OIIO::TypeDesc::UINT8, frame.preview_rgb().data());
}

}  // namespace rig::client
