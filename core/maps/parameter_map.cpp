#include "core/maps/parameter_map.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <algorithm>
#include <system_error>

#include "core/base/files.h"

namespace rig::maps {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr int kFormat = 1;
constexpr const char* kPrefix = "rigd.";

Result<void> flush_and_rename(const std::filesystem::path& part, const std::filesystem::path& path) {
  // Reopened to flush: OpenEXR has no call for it.
  auto bytes = base::read_file(part);
  if (!bytes) return base::pass(bytes);
  if (auto done = base::write_file_durably(path, *bytes); !done) return done;
  return {};
}

// The bottom row of the map is the last scan line.
Imf::Slice slice_of(std::vector<float>& values, int columns, int rows) {
  char* base = reinterpret_cast<char*>(values.data() + static_cast<std::ptrdiff_t>(rows - 1) * columns);
  return {Imf::FLOAT, base, sizeof(float),
          static_cast<std::size_t>(-static_cast<std::ptrdiff_t>(sizeof(float)) * columns)};
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
  std::filesystem::path part = path;
  part += ".exr.part";
  const std::size_t n = static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows);
  if (n == 0 || map.channels.empty()) {
    return fail(ErrorCode::bad_input, "a parameter map needs texels and channels", path.string());
  }
  for (const Channel& c : map.channels) {
    if (c.values.size() != n) {
      return fail(ErrorCode::bad_input, fmt::format("channel '{}' has the wrong size", c.name),
                  path.string());
    }
  }
  Result<void> outcome;
  try {
    Imf::Header header(map.columns, map.rows);
    header.compression() = Imf::ZIP_COMPRESSION;
    const auto text = [&header](const std::string& key, const std::string& value) {
      header.insert(kPrefix + key, Imf::StringAttribute(value));
    };
    header.insert("rigd.format", Imf::IntAttribute(kFormat));
    header.insert("rigd.width_m", Imf::DoubleAttribute(map.width_m));
    header.insert("rigd.height_m", Imf::DoubleAttribute(map.height_m));
    text("kind", "rigd parameter map");
    text("model", map.model);
    for (const auto& [key, value] : map.attributes) text("attribute." + key, value);
    Imf::FrameBuffer buffer;
    for (const Channel& c : map.channels) {
      header.channels().insert(c.name, Imf::Channel(Imf::FLOAT));
      // OpenEXR only reads through the frame buffer of an OutputFile.
      buffer.insert(c.name, slice_of(const_cast<std::vector<float>&>(c.values), map.columns, map.rows));
    }
    Imf::OutputFile file(part.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(map.rows);
  } catch (const std::exception& error) {
    outcome = fail(ErrorCode::io, fmt::format("OpenEXR cannot write: {}", error.what()), path.string());
  }
  if (outcome) outcome = flush_and_rename(part, path);
  std::error_code already_gone;
  std::filesystem::remove(part, already_gone);
  return outcome;
}

Result<ParameterMap> read_parameter_map(const std::filesystem::path& path) {
  if (std::error_code error; !std::filesystem::exists(path, error)) {
    return fail(ErrorCode::not_found, "there is no such file", path.string());
  }
  try {
    Imf::InputFile file(path.c_str());
    const Imf::Header& header = file.header();
    const auto* kind = header.findTypedAttribute<Imf::StringAttribute>("rigd.kind");
    const auto* format = header.findTypedAttribute<Imf::IntAttribute>("rigd.format");
    const auto* width = header.findTypedAttribute<Imf::DoubleAttribute>("rigd.width_m");
    const auto* height = header.findTypedAttribute<Imf::DoubleAttribute>("rigd.height_m");
    const auto* model = header.findTypedAttribute<Imf::StringAttribute>("rigd.model");
    if (kind == nullptr || kind->value() != "rigd parameter map" || format == nullptr || width == nullptr ||
        height == nullptr || model == nullptr) {
      return fail(ErrorCode::bad_input, "is an OpenEXR file, but no parameter map", path.string());
    }
    if (format->value() > kFormat) {
      return fail(ErrorCode::newer,
                  fmt::format("format {} is newer than this program reads ({})", format->value(), kFormat),
                  path.string(), "use a newer version");
    }
    const Imath::Box2i window = header.dataWindow();
    ParameterMap map;
    map.columns = window.max.x - window.min.x + 1;
    map.rows = window.max.y - window.min.y + 1;
    if (window.min.x != 0 || window.min.y != 0) {
      return fail(ErrorCode::bad_input, "its data window does not begin at 0, 0", path.string());
    }
    map.width_m = width->value();
    map.height_m = height->value();
    map.model = model->value();
    const std::string prefix = std::string(kPrefix) + "attribute.";
    for (auto a = header.begin(); a != header.end(); ++a) {
      const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute());
      const std::string name = a.name();
      if (text != nullptr && name.rfind(prefix, 0) == 0)
        map.attributes[name.substr(prefix.size())] = text->value();
    }
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c) map.add(c.name());
    Imf::FrameBuffer buffer;
    for (Channel& c : map.channels) buffer.insert(c.name, slice_of(c.values, map.columns, map.rows));
    file.setFrameBuffer(buffer);
    file.readPixels(0, map.rows - 1);
    return map;
  } catch (const std::exception& error) {
    return fail(ErrorCode::damaged, fmt::format("is no readable OpenEXR file: {}", error.what()),
                path.string());
  }
}

}  // namespace rig::maps
