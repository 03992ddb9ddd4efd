#include "core/scan/frame_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <tiffio.h>

#include "core/base/files.h"
#include "core/base/units.h"

namespace rig::scan {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr int kFrameFormat = 1;
// Fixed, so that the same capture is the same bytes.
constexpr const char* kDateTime = "1970:01:01 00:00:00";
constexpr int kMostEdge = 65535;

// A file in memory for libtiff.
struct Memory {
  std::vector<std::byte> bytes;
  std::size_t position = 0;
};

Memory& memory_of(thandle_t handle) {
  return *static_cast<Memory*>(handle);
}

tmsize_t read_memory(thandle_t handle, void* data, tmsize_t size) {
  Memory& m = memory_of(handle);
  const std::size_t n =
      std::min(static_cast<std::size_t>(size), m.bytes.size() - std::min(m.position, m.bytes.size()));
  std::memcpy(data, m.bytes.data() + m.position, n);
  m.position += n;
  return static_cast<tmsize_t>(n);
}

tmsize_t write_memory(thandle_t handle, void* data, tmsize_t size) {
  Memory& m = memory_of(handle);
  const std::size_t end = m.position + static_cast<std::size_t>(size);
  if (m.bytes.size() < end) m.bytes.resize(end);
  std::memcpy(m.bytes.data() + m.position, data, static_cast<std::size_t>(size));
  m.position = end;
  return size;
}

toff_t seek_memory(thandle_t handle, toff_t offset, int whence) {
  Memory& m = memory_of(handle);
  const toff_t from = whence == SEEK_CUR ? m.position : whence == SEEK_END ? m.bytes.size() : 0;
  m.position = static_cast<std::size_t>(from + offset);
  return m.position;
}

int close_memory(thandle_t /*handle*/) {
  return 0;
}
toff_t size_of_memory(thandle_t handle) {
  return memory_of(handle).bytes.size();
}

struct TiffCloser {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffPointer = std::unique_ptr<TIFF, TiffCloser>;

TiffPointer open_memory(Memory& memory, const char* mode) {
  // libtiff prints to standard error by itself; its callers say here what failed.
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  return TiffPointer(TIFFClientOpen("frame", mode, &memory, &read_memory, &write_memory, &seek_memory,
                                    &close_memory, &size_of_memory, nullptr, nullptr));
}

// JSON has no other numbers.
bool all_finite(const FrameFacts& facts) {
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(facts.target_rad.begin(), facts.target_rad.end(), finite) &&
         std::all_of(facts.readback_rad.begin(), facts.readback_rad.end(), finite) &&
         finite(facts.exposure_s) && finite(facts.gain);
}

std::string to_json(const FrameFacts& facts) {
  nlohmann::ordered_json json;
  const auto in_degrees = [](const machine::JointAngles& angles) {
    nlohmann::ordered_json out;
    for (std::size_t i = 0; i < machine::kAxisCount; ++i) {
      out[std::string(machine::kAxisNames[i])] = base::degrees(angles[i]);
    }
    return out;
  };
  json["format"] = kFrameFormat;
  json["row"] = facts.row;
  json["index"] = facts.index;
  json["target_deg"] = in_degrees(facts.target_rad);
  json["readback_deg"] = in_degrees(facts.readback_rad);
  json["exposure_us"] = facts.exposure_s * 1e6;
  json["gain"] = facts.gain;
  json["bayer"] = facts.bayer;
  json["bits"] = facts.bits;
  // A driver may name a pattern that is no UTF-8, which would otherwise be an exception.
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

Result<FrameFacts> from_json(const std::string& text, const std::string& where) {
  try {
    const auto json = nlohmann::json::parse(text);
    if (const int format = json.at("format").get<int>(); format > kFrameFormat) {
      return fail(ErrorCode::newer,
                  fmt::format("frame format {} is newer than this program reads ({})", format, kFrameFormat),
                  where, "use a newer version");
    }
    FrameFacts facts;
    for (std::size_t i = 0; i < machine::kAxisCount; ++i) {
      const std::string axis(machine::kAxisNames[i]);
      facts.target_rad[i] = base::radians(json.at("target_deg").at(axis).get<double>());
      facts.readback_rad[i] = base::radians(json.at("readback_deg").at(axis).get<double>());
    }
    facts.row = json.at("row").get<std::int64_t>();
    facts.index = json.at("index").get<int>();
    facts.exposure_s = json.at("exposure_us").get<double>() * 1e-6;
    facts.gain = json.at("gain").get<double>();
    facts.bayer = json.at("bayer").get<std::string>();
    facts.bits = json.at("bits").get<int>();
    return facts;
  } catch (const nlohmann::json::exception& error) {
    return fail(ErrorCode::damaged,
                fmt::format("its ImageDescription is not that of a frame: {}", error.what()), where);
  }
}

}  // namespace

Result<std::vector<std::byte>> encode_frame(const FrameFacts& facts, int width, int height,
                                            const std::uint16_t* pixels) {
  if (width <= 0 || height <= 0 || width > kMostEdge || height > kMostEdge) {
    return fail(ErrorCode::bad_input,
                fmt::format("a frame of {} x {} pixels cannot be stored", width, height));
  }
  if (!all_finite(facts)) {
    return fail(ErrorCode::bad_input, "a frame whose angles, exposure or gain are no numbers is not stored");
  }
  Memory memory;
  memory.bytes.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 2 + 4096);
  auto tiff = open_memory(memory, "wl");
  if (!tiff) return fail(ErrorCode::io, "libtiff cannot write to memory");
  const auto w = static_cast<std::uint32_t>(width);
  const auto h = static_cast<std::uint32_t>(height);
  const std::string description = to_json(facts);
  bool ok = TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, w) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, h) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 16) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, h) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_SOFTWARE, "rigd") == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_DATETIME, kDateTime) == 1 &&
            TIFFSetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, description.c_str()) == 1;
  const auto size = static_cast<tmsize_t>(w) * static_cast<tmsize_t>(h) * 2;
  // libtiff does not write through the pointer; its signature only lacks the const.
  ok = ok && TIFFWriteEncodedStrip(tiff.get(), 0, const_cast<std::uint16_t*>(pixels), size) == size;
  ok = ok && TIFFWriteDirectory(tiff.get()) == 1;
  tiff.reset();
  if (!ok) return fail(ErrorCode::io, "libtiff cannot encode the frame");
  return std::move(memory.bytes);
}

Result<Frame> read_frame(const std::filesystem::path& path) {
  const auto content = base::read_file(path);
  if (!content) return base::pass(content);
  return decode_frame(std::as_bytes(std::span(*content)), path.string());
}

Result<Frame> decode_frame(std::span<const std::byte> bytes, const std::string& where) {
  if (bytes.empty()) return fail(ErrorCode::damaged, "is empty", where);
  Memory memory;
  memory.bytes.assign(bytes.begin(), bytes.end());
  const auto tiff = open_memory(memory, "r");
  if (!tiff) return fail(ErrorCode::damaged, "is no readable TIFF file", where);
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t bits = 0;
  std::uint16_t samples = 1;
  std::uint16_t compression = 0;
  const char* description = nullptr;
  if (TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width) != 1 ||
      TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height) != 1 ||
      TIFFGetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits) != 1 ||
      TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &samples) != 1 ||
      TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_COMPRESSION, &compression) != 1 ||
      TIFFGetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, &description) != 1) {
    return fail(ErrorCode::damaged, "lacks what every frame has (size, depth, ImageDescription)", where);
  }
  if (bits != 16 || samples != 1 || width == 0 || height == 0 || width > kMostEdge || height > kMostEdge ||
      compression != COMPRESSION_NONE) {
    return fail(ErrorCode::bad_input,
                "is a TIFF file, but no frame of a scan (16 bits, one channel, uncompressed)", where);
  }
  auto facts = from_json(description, where);
  if (!facts) return base::pass(facts);
  // The size the header claims must be there before it is believed.
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  if (pixels * 2 > memory.bytes.size()) return fail(ErrorCode::damaged, "is cut short", where);
  Frame frame{std::move(*facts), static_cast<int>(width), static_cast<int>(height),
              std::vector<std::uint16_t>(pixels)};
  auto* out = reinterpret_cast<std::byte*>(frame.pixels.data());
  std::size_t done = 0;
  for (std::uint32_t strip = 0; strip < TIFFNumberOfStrips(tiff.get()) && done < pixels * 2; ++strip) {
    const tmsize_t n =
        TIFFReadEncodedStrip(tiff.get(), strip, out + done, static_cast<tmsize_t>(pixels * 2 - done));
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  if (done != pixels * 2) return fail(ErrorCode::damaged, "its pixels cannot be read to the end", where);
  return frame;
}

}  // namespace rig::scan
