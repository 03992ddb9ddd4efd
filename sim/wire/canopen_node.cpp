#include "sim/wire/canopen_node.h"

#include <algorithm>

namespace rig::sim::wire {

namespace {

constexpr std::uint8_t kStopped = 0x04, kOperational = 0x05, kPreOperational = 0x7F;
constexpr std::uint32_t kOff = 1U << 31U;
constexpr std::uint32_t kControlword16 = 0x60400010, kMode8 = 0x60600008, kTarget32 = 0x607A0020;
constexpr std::size_t kHistory = 4;
constexpr std::uint16_t kPdoTooShort = 0x8210;

}  // namespace

CanopenNode::CanopenNode(const Settings& settings)
    : settings_(settings), drive_(settings.drive, objects_), server_(settings.id, objects_) {
  drive_.on_emergency = [this](std::uint16_t code, std::uint8_t error_register) {
    emergency(code, error_register);
  };
}

void CanopenNode::add_objects() {
  using Access = CanopenDictionary::Access;
  const auto id = static_cast<std::uint32_t>(settings_.id);
  const auto constant = [&](std::uint16_t index, std::uint8_t sub, std::size_t bytes, std::uint32_t value) {
    objects_.add(index, sub, {.bytes = bytes, .access = Access::constant, .value = value});
  };
  constant(0x1000, 0, 4, 0x00020192);  // a servo drive of profile 402
  objects_.add(0x1001, 0, {.bytes = 1, .access = Access::ro, .get = [this] { return error_register_; }});
  objects_.add(0x1003, 0,
               {.bytes = 1,
                .access = Access::rw,
                .get = [this] { return static_cast<std::uint32_t>(history_.size()); },
                .set =
                    [this](std::uint32_t value) {
                      if (value != 0) return abort_code::kOutOfRange;
                      history_.clear();
                      return 0U;
                    }});
  for (std::uint8_t sub = 1; sub <= kHistory; ++sub) {
    objects_.add(0x1003, sub, {.access = Access::ro, .get = [this, sub] {
                                 return sub <= history_.size() ? history_[sub - 1U] : 0U;
                               }});
  }
  objects_.add(0x1008, 0, {.access = Access::constant, .text = settings_.name});
  constant(0x1014, 0, 4, 0x80 + id);
  if (settings_.has_heartbeat) {
    objects_.add(0x1017, 0, {.bytes = 2, .value = 0, .set = [this](std::uint32_t) {
                               next_heartbeat_ = now_;
                               return 0U;
                             }});
  }
  constant(0x1018, 0, 1, 4);
  for (std::uint8_t sub = 1; sub <= 4; ++sub) constant(0x1018, sub, 4, sub == 4 ? id : 0);
  constant(0x1400, 0, 1, 2);
  objects_.add(0x1400, 1, {.value = 0x200 + id, .set = [this, id](std::uint32_t value) {
                             if (!settings_.maps_freely) return abort_code::kDeviceState;
                             return (value & ~kOff) == 0x200 + id ? 0U : abort_code::kOutOfRange;
                           }});
  objects_.add(0x1400, 2, {.bytes = 1, .value = 255, .set = [this](std::uint32_t value) {
                             if (!settings_.maps_freely) return abort_code::kDeviceState;
                             return value == 254 || value == 255 ? 0U : abort_code::kOutOfRange;
                           }});
  for (std::uint8_t sub = 0; sub <= 2; ++sub) {
    objects_.add(0x1600, sub,
                 {.bytes = sub == 0 ? std::size_t{1} : std::size_t{4},
                  .set = [this, sub](std::uint32_t value) { return map_pdo(sub, value); }});
  }
  objects_.put(0x1600, 0, settings_.maps_controlword ? 1 : 2);
  objects_.put(0x1600, 1, kControlword16);
  objects_.put(0x1600, 2, settings_.maps_controlword ? 0 : kMode8);
}

// CiA 301: the PDO off, then the count 0, then the objects, then their count.
std::uint32_t CanopenNode::map_pdo(std::uint8_t sub, std::uint32_t value) {
  if (!settings_.maps_freely || (objects_.value(0x1400, 1) & kOff) == 0) return abort_code::kDeviceState;
  if (sub == 0) return value <= 2 ? 0U : abort_code::kOutOfRange;
  if (objects_.value(0x1600, 0) != 0) return abort_code::kDeviceState;
  const bool known = value == kControlword16 || value == kMode8 || value == kTarget32 || value == 0;
  return known ? 0U : abort_code::kNotMappable;
}

void CanopenNode::power_on(Time now) {
  if (phase_ != Phase::off) return;
  phase_ = Phase::booting;
  up_at_ = now + settings_.boot;
}

void CanopenNode::power_off(Time now) {
  now_ = now;
  drive_.power_down(now);
  phase_ = Phase::off;
  nmt_ = 0;
  due_.clear();
}

void CanopenNode::boot(Time now) {
  phase_ = Phase::up;
  add_objects();
  drive_.power_up(now);
  server_.reset();
  history_.clear();
  error_register_ = 0;
  next_heartbeat_.reset();
  send(0x700 + static_cast<canid_t>(settings_.id), {0x00}, now);
  enter(kPreOperational);
}

void CanopenNode::enter(std::uint8_t state) {
  nmt_ = state;
  drive_.set_operational(state == kOperational);
}

void CanopenNode::nmt(Time now, std::uint8_t command) {
  now_ = now;
  if (phase_ != Phase::up) return;
  switch (command) {
    case 0x01:
      enter(kOperational);
      return;
    case 0x02:
      enter(kStopped);
      return;
    case 0x80:
      enter(kPreOperational);
      return;
    case 0x81:
      power_off(now);
      power_on(now);
      return;
    case 0x82:  // communication alone: the drive keeps what it knows
      server_.reset();
      add_objects();
      next_heartbeat_.reset();
      send(0x700 + static_cast<canid_t>(settings_.id), {0x00}, now);
      enter(kPreOperational);
      return;
    default:
      return;
  }
}

void CanopenNode::send(canid_t id, std::vector<std::uint8_t> bytes, Time at) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data);
  due_.push_back({frame, at});
}

void CanopenNode::emergency(std::uint16_t code, std::uint8_t error_register) {
  error_register_ = error_register;
  if (code != 0) {
    history_.push_front(code);
    if (history_.size() > kHistory) history_.pop_back();
  }
  if (phase_ != Phase::up || nmt_ == kStopped) return;
  send(0x80 + static_cast<canid_t>(settings_.id),
       {static_cast<std::uint8_t>(code & 0xFFU), static_cast<std::uint8_t>(code >> 8U), error_register, 0, 0,
        0, 0, 0},
       now_);
}

void CanopenNode::receive(Time now, const can_frame& frame) {
  now_ = now;
  if (phase_ != Phase::up) return;
  const auto id = static_cast<canid_t>(settings_.id);
  if (frame.can_id == 0x000) {
    if (frame.can_dlc == 2 && (frame.data[1] == 0 || frame.data[1] == id)) nmt(now, frame.data[0]);
    return;
  }
  drive_.tick(now);
  if (nmt_ == kOperational && frame.can_id == objects_.value(0x1400, 1)) take_pdo(frame);
  if (frame.can_id == 0x600 + id && nmt_ != kStopped) {
    const auto answer = server_.answer(frame);
    if (answer && !is_silent_) due_.push_back({*answer, now + settings_.answer_after});
  }
}

void CanopenNode::take_pdo(const can_frame& frame) {
  const std::uint32_t count = objects_.value(0x1600, 0);
  std::size_t at = 0;
  std::vector<std::pair<std::uint32_t, std::string>> writes;
  for (std::uint8_t sub = 1; sub <= count; ++sub) {
    const std::uint32_t mapped = objects_.value(0x1600, sub);
    const std::size_t bytes = (mapped & 0xFFU) / 8;
    if (at + bytes > frame.can_dlc) {
      emergency(kPdoTooShort, 0x11);
      return;
    }
    writes.emplace_back(mapped, std::string(reinterpret_cast<const char*>(frame.data) + at, bytes));
    at += bytes;
  }
  for (const auto& [mapped, bytes] : writes) {
    (void)objects_.write(static_cast<std::uint16_t>(mapped >> 16U),
                         static_cast<std::uint8_t>(mapped >> 8U & 0xFFU), bytes);
  }
}

std::vector<can_frame> CanopenNode::tick(Time now) {
  now_ = now;
  std::vector<can_frame> frames;
  if (phase_ == Phase::off) return frames;
  if (phase_ == Phase::booting) {
    if (now < up_at_) return frames;
    boot(now);
  }
  drive_.tick(now);
  const auto period = milliseconds(settings_.has_heartbeat ? objects_.value(0x1017) : 0);
  if (next_heartbeat_ && period.count() != 0 && now >= *next_heartbeat_) {
    next_heartbeat_ = now + period;
    if (!is_muted_) send(0x700 + static_cast<canid_t>(settings_.id), {nmt_}, now);
  }
  while (!due_.empty() && due_.front().at <= now) {
    frames.push_back(due_.front().frame);
    due_.pop_front();
  }
  return frames;
}

}  // namespace rig::sim::wire
