#include "drivers/v4l2_camera/image_setup.h"

#include <cmath>
#include <cstring>
#include <linux/videodev2.h>

#include "drivers/v4l2_camera/device_error.h"

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr std::uint32_t kMostFormats = 200;
// What an interval may be off by when it was set: a camera has only some.
constexpr double kIntervalShare = 0.02;

std::string offered_formats(VideoNode& node) {
  std::string text;
  for (std::uint32_t i = 0; i < kMostFormats; ++i) {
    v4l2_fmtdesc said{};
    said.index = i;
    said.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (node.request(VIDIOC_ENUM_FMT, &said) != 0) break;
    const PixelFormat* known = find_pixel_format(said.pixelformat);
    text += text.empty() ? "" : ", ";
    text += known != nullptr ? known->name : fourcc_text(said.pixelformat);
    if (known == nullptr) {
      text += (said.flags & V4L2_FMT_FLAG_COMPRESSED) != 0 ? " (compressed)" : " (not raw)";
    }
  }
  return text.empty() ? "none" : text;
}

bool offers(VideoNode& node, std::uint32_t fourcc) {
  for (std::uint32_t i = 0; i < kMostFormats; ++i) {
    v4l2_fmtdesc said{};
    said.index = i;
    said.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (node.request(VIDIOC_ENUM_FMT, &said) != 0) return false;
    if (said.pixelformat == fourcc) return true;
  }
  return false;
}

tl::unexpected<base::Error> no_such_format(VideoNode& node, const PixelFormat& format) {
  return fail(ErrorCode::bad_input,
              fmt::format("it has no pixel format {}; it has {}", format.name, offered_formats(node)), {},
              "rigd measures light: it takes raw samples, grey or Bayer, none that were compressed, mixed to "
              "colours or bent by a gamma");
}

}  // namespace

Result<Layout> set_format(VideoNode& node, const Settings& settings) {
  if (!offers(node, settings.format.fourcc)) return no_such_format(node, settings.format);
  v4l2_format wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = node.request(VIDIOC_G_FMT, &wanted); error != 0) {
    return failed_to("to tell its format", error);
  }
  v4l2_pix_format& image = wanted.fmt.pix;
  if (settings.width != 0) {
    image.width = static_cast<std::uint32_t>(settings.width);
    image.height = static_cast<std::uint32_t>(settings.height);
  }
  const std::uint32_t width = image.width, height = image.height;
  image.pixelformat = settings.format.fourcc;
  image.field = V4L2_FIELD_NONE;
  image.bytesperline = 0;
  image.sizeimage = 0;
  if (const int error = node.request(VIDIOC_S_FMT, &wanted); error != 0) {
    return failed_to(fmt::format("to set its format to {} of {} x {}", settings.format.name, width, height),
                     error);
  }
  if (image.pixelformat != settings.format.fourcc) return no_such_format(node, settings.format);
  if (image.width != width || image.height != height) {
    return fail(ErrorCode::bad_input,
                fmt::format("it has no {} of {} x {} pixels, the nearest is {} x {}", settings.format.name,
                            width, height, image.width, image.height));
  }
  if (image.field != V4L2_FIELD_NONE) {
    return fail(ErrorCode::bad_input, "its frames are interlaced: rigd takes whole ones");
  }
  Layout layout{image.width, image.height, image.bytesperline};
  const std::size_t tight = line_bytes(settings.format.packing, layout.width);
  if (layout.stride == 0) layout.stride = tight;
  if (image_bytes(settings.format.packing, layout) == 0) {
    return fail(ErrorCode::device,
                fmt::format("it says that {} samples lie in lines of {} bytes", layout.width, layout.stride));
  }
  return layout;
}

Result<double> set_interval(VideoNode& node, const Settings& settings) {
  v4l2_streamparm told{};
  told.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  const bool tells =
      node.request(VIDIOC_G_PARM, &told) == 0 && (told.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0;
  v4l2_fract& interval = told.parm.capture.timeperframe;
  if (tells && settings.frame_interval_s) {
    interval.numerator = static_cast<std::uint32_t>(std::lround(*settings.frame_interval_s * 1e6));
    interval.denominator = 1'000'000;
    if (const int error = node.request(VIDIOC_S_PARM, &told); error != 0) {
      return failed_to("to set its frame interval", error);
    }
  }
  const double told_s =
      tells && interval.denominator != 0 ? static_cast<double>(interval.numerator) / interval.denominator : 0;
  if (!settings.frame_interval_s) {
    if (told_s > 0) return told_s;
    return fail(ErrorCode::bad_input, "it does not tell the interval of its frames", {},
                "frame_interval_ms says it");
  }
  if (told_s > 0 && std::abs(told_s - *settings.frame_interval_s) > kIntervalShare * told_s) {
    return fail(ErrorCode::bad_input,
                fmt::format("it has no frame interval of {:.3f} ms, the nearest is {:.3f} ms",
                            *settings.frame_interval_s * 1e3, told_s * 1e3));
  }
  return *settings.frame_interval_s;
}

}  // namespace rig::drivers::v4l2
