// HDF5's C library with its handles closed and its errors as values. Private to core/maps.
#pragma once

#include <hdf5.h>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"

namespace rig::maps::h5 {

/// One identifier of the library, closed by the function that belongs to its kind.
class Handle {
 public:
  using Closer = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Closer close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    reset();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }
  ~Handle() { reset(); }

  [[nodiscard]] hid_t get() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  void reset() {
    if (id_ >= 0) close_(id_);
    id_ = -1;
  }

 private:
  hid_t id_ = -1;
  Closer close_ = nullptr;
};

/// Switches the library's printing of its error stack off; errors are read with last_error instead.
void keep_quiet();

/// The innermost description on the library's error stack.
[[nodiscard]] std::string last_error();

[[nodiscard]] base::Result<void> write_text(hid_t object, const std::string& name, const std::string& value);
[[nodiscard]] base::Result<std::string> read_text(hid_t object, const std::string& name);
[[nodiscard]] base::Result<void> write_number(hid_t object, const std::string& name, double value);
[[nodiscard]] base::Result<double> read_number(hid_t object, const std::string& name);
[[nodiscard]] std::vector<std::string> attribute_names(hid_t object);

/// A whole dataset of doubles or 64-bit integers, row-major.
[[nodiscard]] base::Result<void> write_doubles(hid_t file, const std::string& path,
                                               const std::vector<hsize_t>& shape,
                                               const std::vector<double>& values, const std::string& units);
[[nodiscard]] base::Result<std::vector<double>> read_doubles(hid_t file, const std::string& path,
                                                             const std::vector<hsize_t>& shape);

}  // namespace rig::maps::h5
