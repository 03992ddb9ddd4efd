#include "drivers/cia402_axis/drive.h"

#include <bit>
#include <poll.h>

namespace rig::drivers::cia402 {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::pass;
using base::Result;
using std::chrono::milliseconds;

static_assert(std::endian::native == std::endian::little, "CANopen is little-endian, and so is this code");

namespace {

constexpr std::uint32_t kProfile = 402;
constexpr std::uint32_t kPdoOff = 1U << 31U;
constexpr std::uint32_t kControlwordMapping = 0x60400010;  // object 6040:0, 16 bits
constexpr std::uint8_t kAtOnce = 255;                      // a PDO takes effect when it arrives
constexpr canid_t kFirstPdo = 0x200;
constexpr milliseconds kTryEvery{1000};  // to find a drive that is gone
constexpr milliseconds kModeWithin{200};

// The answer of a drive that does not have an object, where it need not.
bool is_absent(const base::Error& error) {
  return error.code == ErrorCode::not_found;
}

std::uint32_t bit_of_mode(std::int8_t mode) {
  return 1U << (static_cast<unsigned>(mode) - 1);
}

}  // namespace

Drive::Drive(std::shared_ptr<Network> network, const DriveSettings& settings, Network::Log log)
    : network_(std::move(network)), settings_(settings), log_(std::move(log)) {}

Result<std::string> Drive::read_bytes(Object object, Steady::time_point deadline, std::size_t at_least) {
  auto bytes = noting_loss(network_->upload(settings_.node, object, deadline));
  if (bytes && bytes->size() < at_least) {
    return fail(ErrorCode::device,
                fmt::format("{}: the drive answers {} bytes, {} were expected", text_of(object),
                            bytes->size(), at_least),
                where());
  }
  return bytes;
}

void Drive::lose(const base::Error& error) {
  if (is_met_) log_(LogLevel::warning, error.text());
  is_met_ = false;
  steps_done_ = 0;
  lost_ = error;
  lost_at_ = Steady::now();
  is_mute_ = is_mute_ || monitor().is_overdue(lost_at_);
  monitor().expect_nothing();
}

Result<void> Drive::reach(Steady::time_point deadline) {
  if (auto heard = network_->listen(); !heard) {
    lose(heard.error());
    return heard;
  }
  if (is_met_) {
    if (auto still = stay_acquainted(deadline); !still) {
      lose(still.error());
      return still;
    }
    if (is_met_) return {};
  } else if (lost_ && Steady::now() < lost_at_ + kTryEvery) {
    // A sign of life from one that gave none makes the next try due.
    const auto sign = monitor().last_heartbeat();
    if (!is_mute_ || !sign || *sign <= lost_at_) return tl::unexpected<base::Error>(*lost_);
  }
  return meet(deadline);
}

Result<void> Drive::stay_acquainted(Steady::time_point deadline) {
  if (network_->generation() != generation_) {
    log_(LogLevel::warning, where() + ": the bus was away; the drive is asked anew what it is");
    is_met_ = false;
    return {};
  }
  if (monitor().boots() != boots_) {
    log_(LogLevel::warning, where() + ": the drive has booted: its power was gone, or somebody reset it");
    is_met_ = false;
    return {};
  }
  if (auto alive = network_->alive(settings_.node); !alive) return alive;
  const auto nmt = monitor().nmt();
  if (nmt && *nmt != NmtState::operational) {
    // It takes no PDO, and many let no motor run; that it did not boot says that its settings are still
    // there.
    return network_->command(NmtCommand::start, settings_.node, deadline);
  }
  return {};
}

Result<void> Drive::meet(Steady::time_point deadline) {
  constexpr Result<void> (Drive::*kSteps[])(Steady::time_point) = {
      &Drive::check_kind,          &Drive::find_pdo,
      &Drive::set_up_quick_stop,   &Drive::set_up_heartbeat,
      &Drive::start_and_read_mode, &Drive::require_heartbeat,
  };
  if (steps_done_ == 0 || network_->generation() != generation_ || monitor().boots() != boots_) {
    steps_done_ = 0;
    generation_ = network_->generation();
    boots_ = monitor().boots();
    meeting_since_ = Steady::now();
    monitor().expect_nothing();
  }
  while (steps_done_ < std::size(kSteps)) {
    const auto step = kSteps[steps_done_];
    if (auto done = (this->*step)(deadline); !done) return done;
    ++steps_done_;
  }
  steps_done_ = 0;
  is_met_ = true;
  lost_.reset();
  ++acquaintance_;
  const NetworkSettings& network = network_->settings();
  if (network.heartbeat.count() != 0) {
    monitor().expect_heartbeats(Steady::now(), network.heartbeat_timeout);
  }
  return {};
}

Result<void> Drive::start_and_read_mode(Steady::time_point deadline) {
  auto started = noting_loss(network_->command(NmtCommand::start, settings_.node, deadline));
  if (!started) return started;
  const auto mode = read<std::int8_t>(object::kModeShown, deadline);
  if (!mode) return pass(mode);
  mode_ = *mode;
  return {};
}

// A drive whose heartbeat was missed is back with its heartbeat, not because its server answers.
Result<void> Drive::require_heartbeat(Steady::time_point /*deadline*/) {
  const auto heard = monitor().last_heartbeat();
  if (!is_mute_ || (heard && *heard > meeting_since_)) {
    is_mute_ = false;
    return {};
  }
  // It may have lost its settings: it is told again.
  if (Steady::now() > meeting_since_ + kTryEvery) steps_done_ = 0;
  return fail(ErrorCode::lost, "its server answers, but it sends no heartbeat", where());
}

Result<void> Drive::check_kind(Steady::time_point deadline) {
  // A node that was told to stop answers no SDO, and who has only now come cannot know whether it was.
  const auto nmt = monitor().nmt();
  if (nmt ? *nmt == NmtState::stopped : lost_.has_value()) {
    auto started = noting_loss(network_->command(NmtCommand::start, settings_.node, deadline));
    if (!started) return started;
  }
  const auto type = read<std::uint32_t>(object::kDeviceType, deadline);
  if (!type) return pass(type);
  if ((*type & 0xFFFFU) != kProfile) {
    return fail(ErrorCode::device,
                fmt::format("this is no drive of CiA 402: its device type is 0x{:08X}", *type), where(),
                "is `node` the right one?");
  }
  const auto modes = read<std::uint32_t>(object::kSupportedModes, deadline);
  if (modes) {
    if ((*modes & bit_of_mode(kProfilePosition)) == 0) {
      return fail(ErrorCode::device, "the drive has no profile position mode", where());
    }
    if (settings_.homing && (*modes & bit_of_mode(kHoming)) == 0) {
      return fail(ErrorCode::device, "the drive has no homing mode", where());
    }
  } else if (!is_absent(modes.error())) {
    return pass(modes);
  }
  if (acquaintance_ != 0) return {};
  const auto name = noting_loss(network_->upload(settings_.node, object::kName, deadline));
  if (name) {
    log_(LogLevel::info, fmt::format("{}: found '{}'", where(), *name));
  } else if (name.error().code == ErrorCode::lost) {
    return pass(name);
  }
  return {};
}

Result<void> Drive::set_up_quick_stop(Steady::time_point deadline) {
  const auto& scale = settings_.axis.scale;
  auto counts = scale;
  counts.counts_per_rad *= settings_.acceleration_unit;
  const auto rate = counts.rate(settings_.quick_stop_rad_s2);
  if (!rate) return pass(rate);
  auto written = write(object::kQuickStopDeceleration, static_cast<std::uint32_t>(*rate), deadline);
  if (!written && !is_absent(written.error())) return written;
  if (settings_.quick_stop_option != kLeaveOption) {
    written = write(object::kQuickStopOption, settings_.quick_stop_option, deadline);
    if (!written && written.error().code != ErrorCode::lost) {
      written.error().hint = "set quick_stop_option to one that the drive has, or to -1 to leave its own";
    }
    if (!written) return written;
  }
  const auto option = read<std::int16_t>(object::kQuickStopOption, deadline);
  if (!option && !is_absent(option.error())) return pass(option);
  stays_in_quick_stop_ = option && *option >= 5;
  return {};
}

Result<void> Drive::set_up_heartbeat(Steady::time_point deadline) {
  const NetworkSettings& network = network_->settings();
  if (network.heartbeat.count() == 0) return {};
  const auto period = static_cast<std::uint16_t>(network.heartbeat.count());
  auto written = write(object::kHeartbeatTime, period, deadline);
  if (!written && written.error().code != ErrorCode::lost) {
    written.error().hint = "set heartbeat_ms = 0 for a drive that sends no heartbeat";
  }
  if (!written) return written;
  return {};
}

// A drive that takes its controlword as a PDO by itself, or that can be told to.
Result<void> Drive::find_pdo(Steady::time_point deadline) {
  pdo_.reset();
  if (!settings_.stop_by_pdo) return {};
  const auto id = read<std::uint32_t>(object::kPdoId, deadline);
  if (!id) return id.error().code == ErrorCode::lost ? Result<void>(pass(id)) : Result<void>();
  const auto count = read<std::uint8_t>(object::kPdoMappedCount, deadline);
  if (!count && count.error().code == ErrorCode::lost) return pass(count);
  if (count && *count == 1 && (*id & kPdoOff) == 0) {
    const auto mapped = read<std::uint32_t>(object::kPdoMapped, deadline);
    if (!mapped && mapped.error().code == ErrorCode::lost) return pass(mapped);
    if (mapped && *mapped == kControlwordMapping) {
      pdo_ = *id & CAN_SFF_MASK;
      return {};
    }
  }
  const auto done = map_pdo(deadline);
  if (!done) return pass(done);
  if (*done) {
    pdo_ = kFirstPdo + static_cast<canid_t>(settings_.node);
  } else {
    log_(LogLevel::warning, where() +
                                ": the drive's first PDO cannot be made to carry the controlword alone; "
                                "a stop goes as an SDO");
  }
  return {};
}

// In the order that CiA 301 asks for. False where the drive refuses.
Result<bool> Drive::map_pdo(Steady::time_point deadline) {
  const std::uint32_t id = kFirstPdo + static_cast<std::uint32_t>(settings_.node);
  const auto steps = {
      std::function([&] { return write<std::uint32_t>(object::kPdoId, id | kPdoOff, deadline); }),
      std::function([&] { return write<std::uint8_t>(object::kPdoMappedCount, 0, deadline); }),
      std::function([&] { return write<std::uint32_t>(object::kPdoMapped, kControlwordMapping, deadline); }),
      std::function([&] { return write<std::uint8_t>(object::kPdoMappedCount, 1, deadline); }),
      std::function([&] { return write<std::uint8_t>(object::kPdoKind, kAtOnce, deadline); }),
      std::function([&] { return write<std::uint32_t>(object::kPdoId, id, deadline); }),
  };
  for (const auto& step : steps) {
    const Result<void> done = step();
    if (!done && done.error().code == ErrorCode::lost) return pass(done);
    if (!done) return false;
  }
  return true;
}

Result<bool> Drive::set_mode(std::int8_t mode, Steady::time_point deadline) {
  if (mode_ == mode) return true;
  if (auto written = write(object::kMode, mode, deadline); !written) return pass(written);
  const auto end = std::min(deadline, Steady::now() + kModeWithin);
  while (true) {
    const auto shown = read<std::int8_t>(object::kModeShown, deadline);
    if (!shown) return pass(shown);
    mode_ = *shown;
    if (mode_ == mode) return true;
    if (Steady::now() >= end) return false;
    (void)::poll(nullptr, 0, 1);
  }
}

Result<void> Drive::quick_stop(Steady::time_point deadline) {
  Result<void> as_pdo;
  if (pdo_) {
    can_frame frame{};
    frame.can_id = *pdo_;
    frame.can_dlc = 2;
    frame.data[0] = control::kQuickStop & 0xFFU;
    frame.data[1] = control::kQuickStop >> 8U;
    as_pdo = network_->send(frame, deadline);
  }
  const char bytes[] = {control::kQuickStop & 0xFF, control::kQuickStop >> 8};
  auto as_sdo = noting_loss(
      network_->download_at_once(settings_.node, object::kControlword, {bytes, sizeof bytes}, deadline));
  if (!as_sdo && !as_pdo) return as_pdo;
  return as_sdo;
}

}  // namespace rig::drivers::cia402
