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
  Handle(hid_t id, Closer closer) : id_(id), close_(closer) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    if (this == &other) return *this;
    (void)close();
    id_ = std::exchange(other.id_, -1);
    close_ = other.close_;
    return *this;
  }
  ~Handle() { (void)close(); }

  [[nodiscard]] hid_t get() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  /// False where the library could not write what it still held: a caller that wrote has to ask.
  [[nodiscard]] bool close() {
    const hid_t id = std::exchange(id_, -1);
    return id < 0 || close_(id) >= 0;
  }

 private:
  hid_t id_ = -1;
  Closer close_ = nullptr;
};

/// Switches the library's printing of its error stack off; errors are read with last_error instead.
void keep_quiet();

/// The innermost description on the library's error stack.
[[nodiscard]] std::string last_error();

/// Text attributes are scalars of variable length in UTF-8, which h5py hands out as str; texts of fixed
/// length are read too.
[[nodiscard]] base::Result<void> write_text(hid_t object, const std::string& name, const std::string& value);
[[nodiscard]] base::Result<std::string> read_text(hid_t object, const std::string& name);

/// How a number is kept in the file; in memory it is a double.
enum class Kept { real, integer };

[[nodiscard]] base::Result<void> write_number(hid_t object, const std::string& name, double value, Kept kept);
[[nodiscard]] base::Result<double> read_number(hid_t object, const std::string& name);
[[nodiscard]] std::vector<std::string> attribute_names(hid_t object);

/// The extent of a dataset; empty for one without (a scalar, or none at all).
[[nodiscard]] std::vector<hsize_t> shape_of(hid_t dataset);

/// A whole dataset of numbers, row-major, with its units; the folders of its path are made as needed. The
/// reader refuses any other shape.
[[nodiscard]] base::Result<void> write_table(hid_t file, const std::string& path,
                                             const std::vector<hsize_t>& shape,
                                             const std::vector<double>& values, const std::string& units,
                                             Kept kept);
[[nodiscard]] base::Result<std::vector<double>> read_table(hid_t file, const std::string& path,
                                                           const std::vector<hsize_t>& shape);

}  // namespace rig::maps::h5
