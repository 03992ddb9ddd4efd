#include "core/maps/parameter_map.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVersion.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>

#include "core/base/files.h"
#include "core/maps/exr_stream.h"

namespace rig::maps {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr int kFormat = 1;
constexpr const char* kKind = "rigd parameter map";
constexpr const char* kKindKey = "rigd.kind";
constexpr const char* kFormatKey = "rigd.format";
constexpr const char* kWidthKey = "rigd.width_m";
constexpr const char* kHeightKey = "rigd.height_m";
constexpr const char* kModelKey = "rigd.model";
constexpr const char* kAttributePrefix = "rigd.attribute.";

// OpenEXR cuts longer names without a word.
constexpr std::size_t kLongestName = 255;

bool is_size(double width_m, double height_m) {
  return width_m > 0 && height_m > 0 && std::isfinite(width_m) && std::isfinite(height_m);
}

// The bottom row of the map is the last scan line, so the stride is negative. OpenEXR has one type of slice
// for reading and writing and computes addresses modulo 2^64.
Imf::Slice slice_of(const std::vector<float>& values, int columns, int rows) {
  const float* last_line = values.data() + static_cast<std::ptrdiff_t>(rows - 1) * columns;
  const auto stride = static_cast<std::ptrdiff_t>(sizeof(float)) * columns;
  return {Imf::FLOAT, const_cast<char*>(reinterpret_cast<const char*>(last_line)), sizeof(float),
          static_cast<std::size_t>(-stride)};
}

Result<void> check(const ParameterMap& map, const std::string& where) {
  if (map.columns <= 0 || map.rows <= 0 || map.channels.empty() || !is_size(map.width_m, map.height_m)) {
    return fail(ErrorCode::bad_input, "a parameter map needs texels, a size and channels", where);
  }
  const std::size_t n = static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows);
  std::set<std::string> names;
  for (const Channel& c : map.channels) {
    if (c.values.size() != n) {
      return fail(ErrorCode::bad_input,
                  fmt::format("channel '{}' has {} values, not {}", c.name, c.values.size(), n), where);
    }
    if (c.name.empty() || c.name.size() > kLongestName || !names.insert(c.name).second) {
      return fail(ErrorCode::bad_input,
                  fmt::format("the channel name '{}' is empty, too long or twice there", c.name), where);
    }
  }
  for (const auto& [key, value] : map.attributes) {
    if (key.size() + std::string_view(kAttributePrefix).size() > kLongestName) {
      return fail(ErrorCode::bad_input, fmt::format("the attribute name '{}' is too long", key), where);
    }
  }
  return {};
}

// May throw what OpenEXR throws.
std::string encode(const ParameterMap& map) {
  Imf::Header header(map.columns, map.rows);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.insert(kKindKey, Imf::StringAttribute(kKind));
  header.insert(kFormatKey, Imf::IntAttribute(kFormat));
  header.insert(kWidthKey, Imf::DoubleAttribute(map.width_m));
  header.insert(kHeightKey, Imf::DoubleAttribute(map.height_m));
  header.insert(kModelKey, Imf::StringAttribute(map.model));
  for (const auto& [key, value] : map.attributes) {
    header.insert(kAttributePrefix + key, Imf::StringAttribute(value));
  }
  Imf::FrameBuffer buffer;
  for (const Channel& c : map.channels) {
    header.channels().insert(c.name, Imf::Channel(Imf::FLOAT));
    buffer.insert(c.name, slice_of(c.values, map.columns, map.rows));
  }
  MemoryOut stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(buffer);
    file.writePixels(map.rows);
  }
  return stream.bytes();
}

// May throw what OpenEXR throws.
Result<ParameterMap> decode(const std::string& bytes, const std::string& where) {
  MemoryIn stream(bytes);
  Imf::InputFile file(stream);
  const Imf::Header& header = file.header();
  const auto* kind = header.findTypedAttribute<Imf::StringAttribute>(kKindKey);
  const auto* format = header.findTypedAttribute<Imf::IntAttribute>(kFormatKey);
  if (kind == nullptr || kind->value() != kKind || format == nullptr) {
    return fail(ErrorCode::bad_input, "is an OpenEXR file, but no parameter map", where,
                "rig fit writes parameter maps");
  }
  if (format->value() > kFormat) {
    return fail(ErrorCode::newer,
                fmt::format("format {} is newer than this program reads ({})", format->value(), kFormat),
                where, "use a newer version of rigd");
  }
  const auto* width = header.findTypedAttribute<Imf::DoubleAttribute>(kWidthKey);
  const auto* height = header.findTypedAttribute<Imf::DoubleAttribute>(kHeightKey);
  const auto* model = header.findTypedAttribute<Imf::StringAttribute>(kModelKey);
  if (width == nullptr || height == nullptr || model == nullptr ||
      !is_size(width->value(), height->value())) {
    return fail(ErrorCode::damaged,
                fmt::format("one of the attributes {}, {} and {} is missing or wrong", kWidthKey, kHeightKey,
                            kModelKey),
                where);
  }
  const Imath::Box2i window = header.dataWindow();
  if (window.min.x != 0 || window.min.y != 0) {
    return fail(ErrorCode::bad_input, "its data window does not begin at 0, 0", where);
  }
  ParameterMap map;
  map.columns = window.max.x + 1;
  map.rows = window.max.y + 1;
  map.width_m = width->value();
  map.height_m = height->value();
  map.model = model->value();
  const std::string prefix = kAttributePrefix;
  for (auto a = header.begin(); a != header.end(); ++a) {
    const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute());
    const std::string name = a.name();
    if (text != nullptr && name.rfind(prefix, 0) == 0) {
      map.attributes[name.substr(prefix.size())] = text->value();
    }
  }
  std::vector<std::string> names;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) names.emplace_back(c.name());
  // The size the header claims must be possible before memory for it is taken: deflate makes at most 1032
  // bytes of one (zlib's technical notes).
  constexpr double kMostDeflated = 1032;
  const double claimed = 4.0 * map.columns * map.rows * static_cast<double>(names.size());
  if (claimed > kMostDeflated * static_cast<double>(bytes.size())) {
    return fail(ErrorCode::damaged, "its header claims more texels than the file can hold", where);
  }
  for (std::string& name : names) map.add(std::move(name));
  Imf::FrameBuffer buffer;
  for (const Channel& c : map.channels) buffer.insert(c.name, slice_of(c.values, map.columns, map.rows));
  file.setFrameBuffer(buffer);
  file.readPixels(0, map.rows - 1);
  return map;
}

}  // namespace

const Channel* ParameterMap::find(const std::string& name) const {
  const auto found =
      std::find_if(channels.begin(), channels.end(), [&](const Channel& c) { return c.name == name; });
  return found == channels.end() ? nullptr : &*found;
}

Channel& ParameterMap::add(std::string name) {
  const std::size_t n = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  channels.push_back({std::move(name), std::vector<float>(n, 0.0F)});
  return channels.back();
}

Result<void> write_parameter_map(const std::filesystem::path& path, const ParameterMap& map) {
  if (auto good = check(map, path.string()); !good) return good;
  std::string bytes;
  try {
    bytes = encode(map);
  } catch (const std::exception& error) {
    return fail(ErrorCode::bad_input, fmt::format("OpenEXR cannot encode: {}", error.what()), path.string());
  }
  return base::write_file_durably(path, bytes);
}

Result<ParameterMap> read_parameter_map(const std::filesystem::path& path) {
  const auto bytes = base::read_file(path);
  if (!bytes) return base::pass(bytes);
  if (bytes->size() < 4 || !Imf::isImfMagic(bytes->data())) {
    return fail(ErrorCode::bad_input, "is no OpenEXR file", path.string());
  }
  try {
    return decode(*bytes, path.string());
  } catch (const std::exception& error) {
    return fail(ErrorCode::damaged, fmt::format("OpenEXR cannot read it: {}", error.what()), path.string(),
                "make the map again");
  }
}

}  // namespace rig::maps
