// What a drive's registers say at one moment: which are read together, and what is made of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/modbus_axis/profile.h"

namespace rig::drivers::modbus {

/// Words that one request reads. A number of two words is never split between two.
struct Block {
  Table table = Table::holding;
  std::uint16_t address = 0;
  std::uint16_t count = 1;
};

struct ReadPlan {
  /// In the order to be asked; the one with the position comes last, so that a status that says "at rest" is
  /// never newer than the position.
  std::vector<Block> blocks;
  struct Place {
    std::size_t of_register, block, offset;
  };
  std::vector<Place> places;
};

/// Every register that the state needs; neighbours are read together, words between them are left alone.
[[nodiscard]] ReadPlan plan_reads(const Profile& profile, const OptionValues& options);

struct Reading {
  double position_counts = 0;
  bool fault = false, enabled = false;
  bool homed = false;  ///< as the drive tells; false where it does not
  std::optional<bool> moving, complete;
  bool low_limit = false, high_limit = false;  ///< of the drive's own counting
  std::optional<double> temperature_c;
};

/// Of the words of each block of the plan, as long as it says.
[[nodiscard]] Reading decode_reading(const Profile& profile, const OptionValues& options,
                                     const ReadPlan& plan,
                                     const std::vector<std::vector<std::uint16_t>>& words);

/// "alarm 0x30: overload"; without a text for it, or a number, it says so.
[[nodiscard]] std::string alarm_text(const Profile& profile, std::optional<std::int64_t> code);

}  // namespace rig::drivers::modbus
