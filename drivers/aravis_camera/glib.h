// Owning pointers and errors of GLib as the rest of the house knows them.
#pragma once

#include <arv.h>
#include <functional>
#include <memory>
#include <string>

#include "core/base/result.h"

namespace rig::drivers::aravis {

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <typename T>
using Owned = std::unique_ptr<T, Unref>;

/// Where a call of Aravis puts its error: pass slot() and ask.
class Failed {
 public:
  Failed() = default;
  Failed(const Failed&) = delete;
  Failed& operator=(const Failed&) = delete;
  ~Failed() { g_clear_error(&error_); }

  [[nodiscard]] GError** slot() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  void clear() { g_clear_error(&error_); }

  /// `doing`: "to set its exposure time". Silence, a camera that went and one that obeys somebody else now
  /// are `lost`; what it refuses is a `device` error.
  [[nodiscard]] base::Error as_error(const std::string& doing) const;

 private:
  GError* error_ = nullptr;
};

/// Sets, asks or executes one thing: `call` gets the GError**.
[[nodiscard]] base::Result<void> attempt(const std::string& doing, const std::function<void(GError**)>& call);
[[nodiscard]] base::Result<double> ask_number(const std::string& doing,
                                              const std::function<double(GError**)>& call);

}  // namespace rig::drivers::aravis
