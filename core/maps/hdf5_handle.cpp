#include "core/maps/hdf5_handle.h"

#include <algorithm>
#include <functional>
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

tl::unexpected<base::Error> unwritten(const std::string& what, const std::string& name) {
  return fail(ErrorCode::io, fmt::format("cannot write {} '{}': {}", what, name, last_error()));
}

hid_t file_type(Kept kept) {
  return kept == Kept::integer ? H5T_STD_I64LE : H5T_IEEE_F64LE;
}

Handle text_type(std::size_t size) {
  Handle type(H5Tcopy(H5T_C_S1), &H5Tclose);
  H5Tset_size(type.get(), size);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

bool is_scalar(hid_t attribute) {
  const Handle space(H5Aget_space(attribute), &H5Sclose);
  return H5Sget_simple_extent_npoints(space.get()) == 1;
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
  const Handle type = text_type(H5T_VARIABLE);
  const Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  Handle attribute(H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                   &H5Aclose);
  const char* text = value.c_str();
  if (!attribute.valid() || H5Awrite(attribute.get(), type.get(), &text) < 0 || !attribute.close()) {
    return unwritten("attribute", name);
  }
  return {};
}

Result<std::string> read_text(hid_t object, const std::string& name) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), &H5Aclose);
  if (!attribute.valid() || !is_scalar(attribute.get())) return missing("attribute", name);
  const Handle type(H5Aget_type(attribute.get()), &H5Tclose);
  if (H5Tget_class(type.get()) != H5T_STRING) return missing("attribute", name);
  if (H5Tis_variable_str(type.get()) > 0) {
    // The character set of the file, since the library does not convert; nothing else of a type that may be
    // damaged.
    const Handle in_memory = text_type(H5T_VARIABLE);
    char* text = nullptr;
    if (H5Tset_cset(in_memory.get(), H5Tget_cset(type.get())) < 0 ||
        H5Aread(attribute.get(), in_memory.get(), &text) < 0 || text == nullptr) {
      return missing("attribute", name);
    }
    std::string value(text);
    H5free_memory(text);
    return value;
  }
  std::string value(H5Tget_size(type.get()), '\0');
  if (H5Aread(attribute.get(), type.get(), value.data()) < 0) return missing("attribute", name);
  value.resize(std::min(value.size(), value.find('\0')));
  return value;
}

Result<void> write_number(hid_t object, const std::string& name, double value, Kept kept) {
  const Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
  Handle attribute(H5Acreate2(object, name.c_str(), file_type(kept), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                   &H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0 || !attribute.close()) {
    return unwritten("attribute", name);
  }
  return {};
}

Result<double> read_number(hid_t object, const std::string& name) {
  const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), &H5Aclose);
  double value = 0;
  if (!attribute.valid() || !is_scalar(attribute.get()) ||
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

std::vector<hsize_t> shape_of(hid_t dataset) {
  const Handle space(H5Dget_space(dataset), &H5Sclose);
  std::vector<hsize_t> shape(static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space.get()), 0)));
  if (!shape.empty()) H5Sget_simple_extent_dims(space.get(), shape.data(), nullptr);
  return shape;
}

Result<void> write_table(hid_t file, const std::string& path, const std::vector<hsize_t>& shape,
                         const std::vector<double>& values, const std::string& units, Kept kept) {
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), &H5Sclose);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), &H5Pclose);
  H5Pset_create_intermediate_group(links.get(), 1);
  const Handle plan(H5Pcreate(H5P_DATASET_CREATE), &H5Pclose);
  // Without times the same map is the same bytes.
  H5Pset_obj_track_times(plan.get(), false);
  Handle dataset(
      H5Dcreate2(file, path.c_str(), file_type(kept), space.get(), links.get(), plan.get(), H5P_DEFAULT),
      &H5Dclose);
  if (!dataset.valid() ||
      H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return unwritten("dataset", path);
  }
  if (auto done = write_text(dataset.get(), "units", units); !done) return done;
  if (!dataset.close()) return unwritten("dataset", path);
  return {};
}

Result<std::vector<double>> read_table(hid_t file, const std::string& path,
                                       const std::vector<hsize_t>& shape) {
  const Handle dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), &H5Dclose);
  if (!dataset.valid()) return missing("dataset", path);
  const std::vector<hsize_t> found = shape_of(dataset.get());
  if (found != shape) {
    return fail(ErrorCode::damaged, fmt::format("dataset '{}' has shape [{}], not [{}]", path,
                                                fmt::join(found, ", "), fmt::join(shape, ", ")));
  }
  const hsize_t count = std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>());
  std::vector<double> values(count);
  if (H5Dread(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return fail(ErrorCode::damaged, fmt::format("cannot read dataset '{}': {}", path, last_error()));
  }
  return values;
}

}  // namespace rig::maps::h5
