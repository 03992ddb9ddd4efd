#include "drivers/aravis_camera/finder.h"

#include <mutex>
#include <vector>

namespace rig::drivers::aravis {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// The list of devices is Aravis' own and one for the process.
std::mutex& list_mutex() {
  static std::mutex mutex;
  return mutex;
}

std::string text(const char* maybe) {
  return maybe == nullptr ? "" : maybe;
}

bool is_wanted(const Settings& settings, const std::string& protocol) {
  if (settings.transport == "gige") return protocol == "GigEVision";
  if (settings.transport == "usb") return protocol == "USB3Vision";
  if (settings.transport == "fake") return protocol == "Fake";
  return protocol != "Fake";
}

Result<std::string> find_id(const Settings& settings) {
  arv_update_device_list();
  std::vector<std::string> found, others;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const std::string id = text(arv_get_device_id(i)), serial = text(arv_get_device_serial_nbr(i));
    if (!is_wanted(settings, text(arv_get_device_protocol(i)))) continue;
    const bool is_it = settings.find_by == FindBy::id
                           ? settings.find == id || settings.find == text(arv_get_device_physical_id(i))
                           : settings.find == serial;
    if (is_it) {
      found.push_back(id);
    } else {
      others.push_back(fmt::format("{} (serial {})", id, serial));
    }
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    return fail(ErrorCode::lost, "not found", settings.called(),
                others.empty() ? "no camera answers" : fmt::format("there are: {}", fmt::join(others, ", ")));
  }
  return fail(ErrorCode::bad_input, fmt::format("{} cameras have that number", found.size()),
              settings.called(), "name it by id");
}

}  // namespace

Result<Owned<ArvCamera>> find_camera(const Settings& settings) {
  std::string id = settings.find;
  Failed failed;
  Owned<ArvDevice> device;
  {
    const std::lock_guard lock(list_mutex());
    if (settings.transport == "fake") arv_enable_interface("Fake");
    if (settings.find_by != FindBy::address) {
      auto found = find_id(settings);
      if (!found) return pass(found);
      id = *found;
    }
    device.reset(arv_open_device(id.c_str(), failed.slot()));
  }
  if (!device || failed) {
    base::Error error = failed.as_error("to open it");
    if (!failed) error.what = "not found";
    error.code = ErrorCode::lost;
    error.where = settings.called();
    return tl::unexpected<base::Error>(std::move(error));
  }
  if (ARV_IS_GV_DEVICE(device.get()) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device.get()))) {
    return fail(ErrorCode::lost, "another program controls it", settings.called(),
                "close that program; of one that died the camera lets go after its heartbeat timeout");
  }
  Owned<ArvCamera> camera(arv_camera_new_with_device(device.get(), failed.slot()));
  if (!camera || failed) {
    base::Error error = failed.as_error("to open it");
    error.where = settings.called();
    return tl::unexpected<base::Error>(std::move(error));
  }
  return camera;
}

}  // namespace rig::drivers::aravis
