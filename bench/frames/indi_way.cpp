#include <fmt/format.h>
#include <memory>
#include <openssl/evp.h>
#include <string>

#include "bench/frames/ways.h"

namespace rig::bench {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr std::chrono::seconds kPatience{60};

std::string change(const char* kind, const char* property, const char* members) {
  return fmt::format("<new{0}Vector device='CCD Simulator' name='{1}'>{2}</new{0}Vector>", kind, property,
                     members);
}

}  // namespace

Result<IndiWay> IndiWay::open(const std::filesystem::path& folder) {
  auto peer = IndiPeer::start("indi_simulator_ccd", folder);
  if (!peer) return base::pass(peer);
  const std::string size = fmt::format(
      "<oneNumber name='SIM_XRES'>{}</oneNumber><oneNumber name='SIM_YRES'>{}</oneNumber>", kWidth, kHeight);
  const std::string settings = change("Number", "SIMULATOR_SETTINGS", size.c_str());
  const std::string connect = change("Switch", "CONNECTION", "<oneSwitch name='CONNECT'>On</oneSwitch>");
  // Each step once the driver has told that it is ready for it.
  struct Turn {
    std::string xml;
    const char* until;
  };
  for (const Turn& turn :
       {Turn{"<getProperties version='1.7'/>", "name=\"CCD_SIMULATE_CRASH\""},
        Turn{settings, "name=\"SIMULATOR_SETTINGS\""}, Turn{connect, "name=\"CCD_FRAME_TYPE\""},
        Turn{"<enableBLOB device='CCD Simulator'>Also</enableBLOB>", ""}}) {
    if (auto ok = peer->send(turn.xml); !ok) return base::pass(ok);
    if (auto read = peer->read_to(turn.until, kPatience); !read) return base::pass(read);
  }
  return IndiWay(std::move(*peer));
}

Result<Steady::duration> IndiWay::pass() {
  const std::string expose =
      change("Number", "CCD_EXPOSURE", "<oneNumber name='CCD_EXPOSURE_VALUE'>0.01</oneNumber>");
  if (auto ok = peer_.send(expose); !ok) return base::pass(ok);
  if (auto read = peer_.read_to("<oneBLOB", kPatience); !read) return base::pass(read);
  if (auto read = peer_.read_to(">\n", kPatience); !read) return base::pass(read);
  const auto complete = Steady::now();
  constexpr std::string_view kEnd = "\n    </oneBLOB>";
  const auto blob = peer_.read_to(kEnd, kPatience);
  if (!blob) return base::pass(blob);
  const std::string_view letters = blob->substr(0, blob->size() - kEnd.size());
  const auto memory = std::make_unique_for_overwrite<unsigned char[]>(letters.size());
  const int bytes = EVP_DecodeBlock(memory.get(), reinterpret_cast<const unsigned char*>(letters.data()),
                                    static_cast<int>(letters.size()));
  const auto seen = Steady::now();
  constexpr int kFrameBytes = static_cast<int>(sizeof(std::uint16_t) * kWidth * kHeight);
  if (bytes < kFrameBytes || memory[0] != 'S')  // a FITS file begins with SIMPLE
    return fail(ErrorCode::damaged, fmt::format("INDI's frame came as {} bytes", bytes));
  // What is told once the BLOB is out, before the next exposure.
  if (auto read = peer_.read_to("</setBLOBVector>", kPatience); !read) return base::pass(read);
  if (auto read = peer_.read_to("name=\"CCD_EXPOSURE\" state=\"Ok\"", kPatience); !read)
    return base::pass(read);
  return seen - complete;
}

}  // namespace rig::bench
