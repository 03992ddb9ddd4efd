#include <array>

#include "drivers/cia402_axis/sdo.h"

namespace rig::drivers::cia402 {

namespace {

struct Named {
  std::uint32_t code;
  const char* text;
};

constexpr std::array kNames{
    Named{0x05030000, "toggle bit not alternated"},
    Named{0x05040000, "SDO protocol timed out"},
    Named{0x05040001, "client command not valid"},
    Named{0x05040002, "invalid block size"},
    Named{0x05040003, "invalid sequence number"},
    Named{0x05040004, "CRC error"},
    Named{0x05040005, "out of memory"},
    Named{0x06010000, "unsupported access"},
    Named{0x06010001, "the object can only be written"},
    Named{0x06010002, "the object can only be read"},
    Named{0x06020000, "the object does not exist"},
    Named{0x06040041, "the object cannot be mapped to a PDO"},
    Named{0x06040042, "the mapped objects exceed the length of a PDO"},
    Named{0x06040043, "parameters are incompatible"},
    Named{0x06040047, "incompatibility inside the device"},
    Named{0x06060000, "hardware error"},
    Named{0x06070010, "the length of the value does not match"},
    Named{0x06070012, "the value is too long"},
    Named{0x06070013, "the value is too short"},
    Named{0x06090011, "the sub-index does not exist"},
    Named{0x06090030, "the value is out of range"},
    Named{0x06090031, "the value is too high"},
    Named{0x06090032, "the value is too low"},
    Named{0x06090036, "the maximum is less than the minimum"},
    Named{0x060A0023, "resource not available"},
    Named{0x08000000, "general error"},
    Named{0x08000020, "the value cannot be transferred or stored"},
    Named{0x08000021, "the value cannot be transferred: local control"},
    Named{0x08000022, "the value cannot be transferred in this state of the device"},
    Named{0x08000023, "there is no object dictionary"},
    Named{0x08000024, "no data available"},
};

}  // namespace

std::string text_of_abort(std::uint32_t code) {
  for (const Named& named : kNames) {
    if (named.code == code) return named.text;
  }
  return fmt::format("abort code 0x{:08X}", code);
}

}  // namespace rig::drivers::cia402
