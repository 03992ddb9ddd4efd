#include "drivers/v4l2_camera/device_error.h"

#include <cerrno>
#include <cstring>

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;

namespace {

tl::unexpected<base::Error> said(ErrorCode code, const std::string& why, const std::string& what) {
  return fail(code, fmt::format("{}: it failed {}", why, what));
}

}  // namespace

tl::unexpected<base::Error> failed_to(const std::string& what, int error) {
  switch (error) {
    case ENODEV:
    case ENXIO:
    case ESHUTDOWN:
    case ENOENT:
      return said(ErrorCode::lost, "it is gone", what);
    case EIO:
    case EPIPE:
    case EPROTO:
    case EILSEQ:
    case ETIMEDOUT:
      return fail(ErrorCode::lost,
                  fmt::format("it does not answer: it failed {}: {}", what, std::strerror(error)));
    case EBUSY:
      return said(ErrorCode::busy, "another program uses it", what);
    case ENOSPC:
      return fail(ErrorCode::device,
                  fmt::format("its bus has not room enough for its frames: it failed {}", what), {},
                  "smaller or fewer frames, or a USB controller of its own");
    default:
      return fail(ErrorCode::device, fmt::format("it failed {}: {}", what, std::strerror(error)));
  }
}

// uvcvideo asks a camera that stalls a request for its reason (UVC 1.5, 4.2.1.2), and gives each a number of
// its own: 1 not ready, EBUSY; 2 wrong state, EILSEQ or, in newer kernels, EACCES; 3 power, EREMOTE; 4
// out of range, ERANGE; 5 to 8, no such control or value, EINVAL or EIO; none, EPIPE. The bus itself has
// EILSEQ, EPROTO and ETIMEDOUT for a camera that is silent.
tl::unexpected<base::Error> control_failed_to(VideoNode& node, const std::string& what, int error) {
  switch (error) {
    case EBUSY:
      return node.is_claimed_by_another() ? said(ErrorCode::busy, "another program has claimed it", what)
                                          : said(ErrorCode::busy, "the camera is not ready", what);
    case EACCES:
      return said(ErrorCode::device, "the camera refuses it in its present state", what);
    case EREMOTE:
      return said(ErrorCode::device, "the camera has not the power for it", what);
    case ERANGE:
      return said(ErrorCode::device, "the camera says that it is out of range", what);
    case EINVAL:
      return said(ErrorCode::device, "the camera knows no such control or value", what);
    case EIO:
      return said(ErrorCode::lost, "the camera does not answer, or knows no such control", what);
    case EPIPE:
      return said(ErrorCode::lost, "the camera refuses it, and says no reason", what);
    case EILSEQ:
      return said(ErrorCode::lost, "the camera does not answer, or refuses it in its present state", what);
    default:
      return failed_to(what, error);
  }
}

}  // namespace rig::drivers::v4l2
