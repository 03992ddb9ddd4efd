#include "sim/wire/gv_genicam.h"

#include <fmt/format.h>
#include <string_view>
#include <utility>

#include "sim/wire/pfnc.h"

namespace rig::sim::wire {

namespace {

std::string integer_register(std::string_view name, std::uint32_t address, int length,
                             std::string_view access) {
  return fmt::format(
      "<IntReg Name=\"{}\" NameSpace=\"Custom\"><Address>0x{:x}</Address><Length>{}</Length>"
      "<AccessMode>{}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Signed</Sign>"
      "<Endianess>BigEndian</Endianess></IntReg>\n",
      name, address, length, access);
}

std::string added_nodes() {
  std::string nodes =
      "<Float Name=\"DeviceTemperature\" "
      "NameSpace=\"Standard\"><pValue>DeviceTemperatureConverter</pValue></Float>\n"
      "<Converter Name=\"DeviceTemperatureConverter\" NameSpace=\"Custom\"><FormulaTo>(FROM * "
      "100)</FormulaTo>"
      "<FormulaFrom>(TO / 100.0)</FormulaFrom><pValue>DeviceTemperatureRegister</pValue></Converter>\n"
      "<Enumeration Name=\"AcquisitionStatusSelector\" NameSpace=\"Standard\">"
      "<EnumEntry Name=\"FrameTriggerWait\"><Value>0</Value></EnumEntry>"
      "<pValue>AcquisitionStatusSelectorRegister</pValue></Enumeration>\n"
      "<Boolean Name=\"AcquisitionStatus\" NameSpace=\"Standard\"><pValue>AcquisitionStatusRegister</pValue>"
      "<OnValue>1</OnValue><OffValue>0</OffValue></Boolean>\n"
      "<Command Name=\"TimestampLatch\" NameSpace=\"Standard\"><pValue>TimestampLatchRegister</pValue>"
      "<CommandValue>1</CommandValue></Command>\n"
      "<Integer Name=\"TimestampLatchValue\" "
      "NameSpace=\"Standard\"><pValue>TimestampLatchValueRegister</pValue>"
      "</Integer>\n";
  nodes += integer_register("DeviceTemperatureRegister", kTemperatureRegister, 4, "RO");
  nodes += integer_register("AcquisitionStatusRegister", kReadyRegister, 4, "RO");
  nodes += integer_register("AcquisitionStatusSelectorRegister", kStatusSelectorRegister, 4, "RW");
  nodes += integer_register("TimestampLatchRegister", kLatchRegister, 4, "WO");
  nodes += integer_register("TimestampLatchValueRegister", kClockRegister, 8, "RO");
  return nodes;
}

std::string chunk_nodes() {
  std::string nodes =
      "<Boolean Name=\"ChunkModeActive\" NameSpace=\"Standard\"><pValue>ChunkModeRegister</pValue>"
      "<OnValue>1</OnValue><OffValue>0</OffValue></Boolean>\n"
      "<Enumeration Name=\"ChunkSelector\" NameSpace=\"Standard\">"
      "<EnumEntry Name=\"ExposureTime\"><Value>0</Value></EnumEntry>"
      "<EnumEntry Name=\"Timestamp\"><Value>1</Value></EnumEntry>"
      "<pValue>ChunkSelectorRegister</pValue></Enumeration>\n"
      "<Boolean Name=\"ChunkEnable\" NameSpace=\"Standard\"><pValue>ChunkEnableRegister</pValue>"
      "<OnValue>1</OnValue><OffValue>0</OffValue></Boolean>\n"
      "<Float Name=\"ChunkExposureTime\" "
      "NameSpace=\"Standard\"><pValue>ChunkExposureTimeRegister</pValue></Float>\n"
      "<Integer Name=\"ChunkTimestamp\" "
      "NameSpace=\"Standard\"><pValue>ChunkTimestampRegister</pValue></Integer>\n"
      "<FloatReg Name=\"ChunkExposureTimeRegister\" "
      "NameSpace=\"Custom\"><Address>0</Address><Length>8</Length>"
      "<AccessMode>RO</AccessMode><pPort>ChunkExposureTimePort</pPort><Endianess>BigEndian</Endianess></"
      "FloatReg>\n"
      "<IntReg Name=\"ChunkTimestampRegister\" NameSpace=\"Custom\"><Address>0</Address><Length>8</Length>"
      "<AccessMode>RO</AccessMode><pPort>ChunkTimestampPort</pPort><Sign>Unsigned</Sign>"
      "<Endianess>BigEndian</Endianess></IntReg>\n";
  for (const auto& [name, id] : {std::pair{"ChunkExposureTimePort", kExposureChunk},
                                 std::pair{"ChunkTimestampPort", kTimestampChunk}}) {
    nodes += fmt::format("<Port Name=\"{}\" NameSpace=\"Custom\"><ChunkID>{:x}</ChunkID></Port>\n", name, id);
  }
  nodes += integer_register("ChunkModeRegister", kChunkModeRegister, 4, "RW");
  nodes += integer_register("ChunkSelectorRegister", kChunkSelectorRegister, 4, "RW");
  nodes += integer_register("ChunkEnableRegister", kChunkEnableRegister, 4, "RW");
  return nodes;
}

void insert_before(std::string& xml, std::string_view mark, const std::string& text) {
  const auto at = xml.find(mark);
  if (at != std::string::npos) xml.insert(at, text);
}

}  // namespace

std::string extended_genicam(std::string xml, bool with_chunks) {
  std::string entries;
  for (const PfncFormat& format : pfnc_formats()) {
    if (xml.find(fmt::format("\"{}\"", format.name)) != std::string::npos) continue;
    entries += fmt::format("<EnumEntry Name=\"{}\" NameSpace=\"Standard\"><Value>{}</Value></EnumEntry>\n",
                           format.name, format.code);
  }
  insert_before(xml, "<pValue>PixelFormatRegister</pValue>", entries);
  insert_before(xml, "</RegisterDescription>", added_nodes());
  if (!with_chunks) return xml;
  insert_before(xml, "</RegisterDescription>", chunk_nodes());
  insert_before(xml, "<Formula>WIDTH * HEIGHT", "<pVariable Name=\"CHUNKS\">ChunkModeRegister</pVariable>\n");
  const std::string size = "&amp;0xFF) / 8";
  const auto at = xml.find(size);
  if (at != std::string::npos) xml.insert(at + size.size(), fmt::format(" + CHUNKS * {}", kChunkBytes));
  return xml;
}

}  // namespace rig::sim::wire
