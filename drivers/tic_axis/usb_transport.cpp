#include "drivers/tic_axis/usb_transport.h"

#include <algorithm>
#include <array>
#include <libusb-1.0/libusb.h>

#include "drivers/tic_axis/products.h"

namespace rig::drivers::tic {

using base::ErrorCode;
using base::fail;
using base::Result;
using std::chrono::milliseconds;

namespace {

constexpr int kInterface = 0;

struct CloseContext {
  void operator()(libusb_context* context) const { libusb_exit(context); }
};
struct CloseHandle {
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
struct FreeList {
  void operator()(libusb_device** list) const { libusb_free_device_list(list, 1); }
};
using Context = std::unique_ptr<libusb_context, CloseContext>;
using Handle = std::unique_ptr<libusb_device_handle, CloseHandle>;
using List = std::unique_ptr<libusb_device*, FreeList>;

// "1-1.4": the bus and the ports on the way, as the kernel names the device.
std::string path_of(libusb_device* device) {
  std::array<std::uint8_t, 7> ports{};
  const int n = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string path = std::to_string(libusb_get_bus_number(device));
  for (int i = 0; i < n; ++i)
    path += fmt::format("{}{}", i == 0 ? "-" : ".", ports[static_cast<std::size_t>(i)]);
  return path;
}

// libusb's own function for this waits up to two seconds.
std::string serial_of(libusb_device_handle* handle, const libusb_device_descriptor& descriptor,
                      milliseconds within) {
  constexpr std::uint16_t kEnglish = 0x0409;
  std::array<unsigned char, 255> text{};
  const int n = libusb_control_transfer(
      handle, LIBUSB_ENDPOINT_IN, LIBUSB_REQUEST_GET_DESCRIPTOR,
      static_cast<std::uint16_t>((LIBUSB_DT_STRING << 8) | descriptor.iSerialNumber), kEnglish, text.data(),
      static_cast<std::uint16_t>(text.size()), static_cast<unsigned>(within.count()));
  std::string serial;  // UTF-16 behind two bytes; digits in fact
  for (std::size_t i = 2; i + 1 < static_cast<std::size_t>(std::max(n, 0)); i += 2) {
    serial += static_cast<char>(text[i]);
  }
  return serial;
}

class UsbTransport final : public Transport {
 public:
  UsbTransport(Context context, Handle handle, Identity identity)
      : context_(std::move(context)), handle_(std::move(handle)), identity_(std::move(identity)) {}
  ~UsbTransport() override { (void)libusb_release_interface(handle_.get(), kInterface); }
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  [[nodiscard]] Result<void> control_out(const ControlRequest& request, milliseconds within) override {
    const int n = transfer(request, nullptr, 0, within);
    if (n < 0) return failed(n, within);
    return {};
  }

  [[nodiscard]] Result<std::vector<std::uint8_t>> control_in(const ControlRequest& request,
                                                             std::uint16_t length,
                                                             milliseconds within) override {
    std::vector<std::uint8_t> data(length);
    const int n = transfer(request, data.data(), length, within);
    if (n < 0) return failed(n, within);
    data.resize(static_cast<std::size_t>(n));
    return data;
  }

  [[nodiscard]] const Identity& identity() const override { return identity_; }

 private:
  int transfer(const ControlRequest& r, std::uint8_t* data, std::uint16_t length, milliseconds within) {
    // No time at all would be for ever.
    const auto timeout = static_cast<unsigned>(std::max<milliseconds::rep>(within.count(), 1));
    return libusb_control_transfer(handle_.get(), r.type, r.request, r.value, r.index, data, length, timeout);
  }

  [[nodiscard]] tl::unexpected<base::Error> failed(int error, milliseconds within) const {
    switch (error) {
      case LIBUSB_ERROR_TIMEOUT:
        return fail(ErrorCode::timeout, fmt::format("no answer within {} ms", within.count()),
                    identity_.where);
      case LIBUSB_ERROR_PIPE:
        return fail(ErrorCode::device, "the Tic refuses the request", identity_.where);
      case LIBUSB_ERROR_OVERFLOW:
        return fail(ErrorCode::damaged, "more bytes than were asked for", identity_.where);
      default:
        return fail(ErrorCode::lost, fmt::format("the Tic is gone: {}", libusb_strerror(error)),
                    identity_.where, "is it plugged in?");
    }
  }

  const Context context_;
  const Handle handle_;
  const Identity identity_;
};

bool is_tic(libusb_device* device, libusb_device_descriptor& descriptor) {
  return libusb_get_device_descriptor(device, &descriptor) == 0 && descriptor.idVendor == kPololu &&
         product_of(descriptor.idProduct).has_value();
}

struct Found {
  Handle handle;
  Identity identity;
};

// What was seen on the way, for the message where the one wanted is not among it.
struct Seen {
  std::vector<std::string> serials;
  bool forbidden = false;
};

std::optional<Found> try_device(libusb_device* device, const Place& place, milliseconds within, Seen& seen) {
  libusb_device_descriptor descriptor{};
  const std::string path = path_of(device);
  if (!place.usb_path.empty() && path != place.usb_path) return std::nullopt;
  if (!is_tic(device, descriptor)) return std::nullopt;
  libusb_device_handle* opened = nullptr;
  const int error = libusb_open(device, &opened);
  if (error != 0) {
    seen.forbidden = seen.forbidden || error == LIBUSB_ERROR_ACCESS;
    return std::nullopt;
  }
  Handle handle(opened);
  const std::string serial = serial_of(handle.get(), descriptor, within);
  seen.serials.push_back(serial);
  if (!place.serial.empty() && serial != place.serial) return std::nullopt;
  Identity identity{descriptor.idProduct, descriptor.bcdDevice, serial,
                    fmt::format("Tic {} at USB {}", serial, path)};
  return Found{std::move(handle), std::move(identity)};
}

tl::unexpected<base::Error> not_there(const Place& place, const Seen& seen) {
  const std::string wanted = place.serial.empty()
                                 ? fmt::format("there is no Tic at USB {}", place.usb_path)
                                 : fmt::format("there is no Tic with serial {}", place.serial);
  if (seen.forbidden) {
    return fail(ErrorCode::lost, wanted + " that may be opened", "USB",
                "its device node must belong to a group that rigd is in (plugdev)");
  }
  std::string there;
  for (const std::string& serial : seen.serials) there += (there.empty() ? "" : ", ") + serial;
  return fail(ErrorCode::lost, wanted, "USB",
              there.empty() ? "is it plugged in?" : fmt::format("there is {}", there));
}

}  // namespace

Result<std::unique_ptr<Transport>> open_usb(const Place& place, const RetryPolicy& policy,
                                            Deadline call_ends) {
  // A context of its own, which knows what is plugged in now; an older one learns that only where a device
  // manager (udev) runs.
  libusb_context* made = nullptr;
  if (const int error = libusb_init(&made); error != 0) {
    return fail(ErrorCode::lost, fmt::format("libusb does not start: {}", libusb_strerror(error)), "USB",
                "in a confined unit it needs RestrictAddressFamilies=AF_NETLINK");
  }
  Context context(made);
  libusb_device** devices = nullptr;
  const ssize_t n = libusb_get_device_list(context.get(), &devices);
  if (n < 0) {
    return fail(ErrorCode::lost,
                fmt::format("USB cannot be looked through: {}", libusb_strerror(static_cast<int>(n))), "USB");
  }
  const List list(devices);
  Seen seen;
  for (ssize_t i = 0; i < n; ++i) {
    const auto left = std::chrono::ceil<milliseconds>(call_ends - std::chrono::steady_clock::now());
    if (left.count() <= 0) {
      return tl::unexpected<base::Error>(call_is_over(nullptr, "USB"));
    }
    auto found = try_device(devices[i], place, std::min(policy.answer, left), seen);
    if (!found) continue;
    if (const int error = libusb_claim_interface(found->handle.get(), kInterface); error != 0) {
      return fail(ErrorCode::lost, fmt::format("the Tic cannot be claimed: {}", libusb_strerror(error)),
                  found->identity.where, "does another program have it?");
    }
    return std::make_unique<UsbTransport>(std::move(context), std::move(found->handle),
                                          std::move(found->identity));
  }
  return not_there(place, seen);
}

}  // namespace rig::drivers::tic
