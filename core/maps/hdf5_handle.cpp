#include "core/maps/hdf5_handle.h"

#include <numeric>

namespace rig::maps::h5 {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

herr_t keep_innermost(unsigned /*depth*/, const H5E_error2_t* error, void* out) {
  auto& text = *static_cast<std::string*>(out);
  if (text.empty() && error->desc != nullptr) text = error->desc;
  return 0;
}

herr_t collect_name(hid_t /*object*/, const char* name, const H5A_info_t* /*info*/, void* out) {
  static_cast<std::vector<std::string>*>(out)->emplace_back(name);
  return 0;
}

tl::unexpected<base::Error> missing(const std::string& what, const std::string& name) {
  return fail(ErrorCode::damaged, fmt::format("{} '{}' is missing or has the wrong type", what, name));
}

}  // namespace

void keep_quiet() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

std::string last_error() {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, &keep_innermost, &text);
  return text.empty() ? "HDF5 gives no reason" : text;
}

Result<void> write_text(hid_t object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), &H5Tclose);
  H5Tset_size(type.get(), std::max<std::size_t>(value.size(), 1));
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  const Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Handle attribute(H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                         &H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.get(), type.get(), value.c_str()) < 0) {
    return fail(ErrorCode::io, fmt::format("cannot write attribute '{}': {}", name, last_error()));
  }
  return {};
}

Result<std::string> read_text(hid_t object, const std::string& name) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), &H5Aclose);
  if (!attribute.valid()) return missing("attribute", name);
  const Handle type(H5Aget_type(attribute.get()), &H5Tclose);
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) > 0)
    return missing("attribute", name);
  std::string value(H5Tget_size(type.get()), '\0');
  if (H5Aread(attribute.get(), type.get(), value.data()) < 0) return missing("attribute", name);
  value.resize(std::min(value.size(), value.find('\0')));
  return value;
}

Result<void> write_number(hid_t object, const std::string& name, double value) {
  const Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  const Handle attribute(
      H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT), &H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    return fail(ErrorCode::io, fmt::format("cannot write attribute '{}': {}", name, last_error()));
  }
  return {};
}

Result<double> read_number(hid_t object, const std::string& name) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), &H5Aclose);
  const Handle space(attribute.valid() ? H5Aget_space(attribute.get()) : -1, &H5Sclose);
  double value = 0;
  if (!attribute.valid() || H5Sget_simple_extent_npoints(space.get()) != 1 ||
      H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    return missing("attribute", name);
  }
  return value;
}

std::vector<std::string> attribute_names(hid_t object) {
  std::vector<std::string> names;
  hsize_t position = 0;
  H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, &position, &collect_name, &names);
  return names;
}

Result<void> write_doubles(hid_t file, const std::string& path, const std::vector<hsize_t>& shape,
                           const std::vector<double>& values, const std::string& units) {
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), &H5Sclose);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), &H5Pclose);
  H5Pset_create_intermediate_group(links.get(), 1);
  const Handle dataset(
      H5Dcreate2(file, path.c_str(), H5T_IEEE_F64LE, space.get(), links.get(), H5P_DEFAULT, H5P_DEFAULT),
      &H5Dclose);
  if (!dataset.valid() ||
      H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return fail(ErrorCode::io, fmt::format("cannot write '{}': {}", path, last_error()));
  }
  return write_text(dataset.get(), "units", units);
}

Result<std::vector<double>> read_doubles(hid_t file, const std::string& path,
                                         const std::vector<hsize_t>& shape) {
  const Handle dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), &H5Dclose);
  if (!dataset.valid()) return missing("dataset", path);
  const Handle space(H5Dget_space(dataset.get()), &H5Sclose);
  std::vector<hsize_t> found(static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space.get()), 0)));
  H5Sget_simple_extent_dims(space.get(), found.data(), nullptr);
  if (found != shape) {
    return fail(ErrorCode::damaged, fmt::format("dataset '{}' has shape [{}], not [{}]", path,
                                                fmt::join(found, ", "), fmt::join(shape, ", ")));
  }
  const hsize_t count = std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>());
  std::vector<double> values(count);
  if (H5Dread(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return fail(ErrorCode::damaged, fmt::format("cannot read '{}': {}", path, last_error()));
  }
  return values;
}

}  // namespace rig::maps::h5
