#include "drivers/aravis_camera/glib.h"

namespace rig::drivers::aravis {

base::Error Failed::as_error(const std::string& doing) const {
  using base::ErrorCode;
  ErrorCode code = ErrorCode::device;
  if (error_ != nullptr && error_->domain == ARV_DEVICE_ERROR) {
    switch (error_->code) {
      case ARV_DEVICE_ERROR_NOT_CONNECTED:
      case ARV_DEVICE_ERROR_TRANSFER_ERROR:
      case ARV_DEVICE_ERROR_TIMEOUT:
      case ARV_DEVICE_ERROR_NOT_FOUND:
      case ARV_DEVICE_ERROR_NOT_CONTROLLER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
        code = ErrorCode::lost;
        break;
      default:
        break;
    }
  } else if (error_ != nullptr && error_->domain == G_IO_ERROR) {
    code = ErrorCode::lost;
  }
  return {code, doing + ": " + (error_ == nullptr ? "no reason given" : error_->message), {}, {}};
}

base::Result<void> attempt(const std::string& doing, const std::function<void(GError**)>& call) {
  Failed failed;
  call(failed.slot());
  if (failed) return tl::unexpected<base::Error>(failed.as_error(doing));
  return {};
}

base::Result<double> ask_number(const std::string& doing, const std::function<double(GError**)>& call) {
  Failed failed;
  const double value = call(failed.slot());
  if (failed) return tl::unexpected<base::Error>(failed.as_error(doing));
  return value;
}

}  // namespace rig::drivers::aravis
