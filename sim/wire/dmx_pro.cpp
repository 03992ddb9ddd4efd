#include "sim/wire/dmx_pro.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "sim/wire/promptness.h"
#include "sim/wire/pty.h"

namespace rig::sim::wire {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kStart = 0x7E;
constexpr std::uint8_t kEnd = 0xE7;
constexpr std::size_t kMostData = 600;
constexpr std::uint8_t kNonsense = 0xFF;

// Labels of the specification; 77 and 78 of the extension.
constexpr std::uint8_t kGetParameters = 3, kSetParameters = 4, kReceivedDmx = 5, kSendDmx = 6,
                       kGetSerial = 10, kManufacturer = 77, kDevice = 78;

// Data of a packet: the start code and 24 to 512 channels.
constexpr std::size_t kFewest = 25, kMost = 513;

constexpr std::chrono::milliseconds kTurn{20};

Bytes bcd_of(const std::string& digits) {
  if (digits.size() != 8) throw std::invalid_argument("a serial number has eight digits");
  Bytes bytes;
  for (std::size_t i = 6;; i -= 2) {  // the lowest two digits first
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
    if (i == 0) return bytes;
  }
}

std::string message_of(std::uint8_t label, const Bytes& data) {
  std::string message;
  for (const std::size_t byte :
       {std::size_t{kStart}, std::size_t{label}, data.size() & 0xFFU, data.size() >> 8U}) {
    message.push_back(static_cast<char>(byte));
  }
  for (const std::uint8_t byte : data) message.push_back(static_cast<char>(byte));
  message.push_back(static_cast<char>(kEnd));
  return message;
}

Bytes with_id(std::uint16_t id, const std::string& name) {
  Bytes data{static_cast<std::uint8_t>(id & 0xFFU), static_cast<std::uint8_t>(id >> 8U)};
  for (const char c : name) data.push_back(static_cast<std::uint8_t>(c));
  return data;
}

}  // namespace

struct DmxPro::State {
  Pty line;
  std::mutex mutex;
  Bytes serial;
  std::uint8_t firmware = 1;
  std::uint8_t break_time = 9, mark_time = 1, rate = 40;
  Bytes user_data;
  std::string manufacturer, device;
  Bytes output, fixtures;
  std::map<std::uint8_t, int> requests;

  // Reading of a message, byte by byte, as a small processor does it.
  enum class Reading { start, label, low, high, data, end } reading = Reading::start;
  std::uint8_t label = 0;
  std::size_t length = 0;
  Bytes data;

  Spoil how = Spoil::missing;
  int spoilt = 0;
  std::string kept_back;

  std::atomic<bool> ended{false};
  std::thread thread;

  explicit State(const std::filesystem::path& path) : line(path) {}

  void power_on();
  void take(std::uint8_t byte);
  void carry_out();
  void answer(std::uint8_t with, const Bytes& bytes);
  void serve();
};

void DmxPro::State::power_on() {
  output.clear();
  reading = Reading::start;
  spoilt = 0;
  kept_back.clear();
}

void DmxPro::State::take(std::uint8_t byte) {
  switch (reading) {
    case Reading::start:
      if (byte == kStart) reading = Reading::label;
      return;
    case Reading::label:
      label = byte;
      reading = Reading::low;
      return;
    case Reading::low:
      length = byte;
      reading = Reading::high;
      return;
    case Reading::high:
      length += static_cast<std::size_t>(byte) << 8U;
      data.clear();
      reading = length > kMostData ? Reading::start : length == 0 ? Reading::end : Reading::data;
      if (length > kMostData) ++requests[kNonsense];
      return;
    case Reading::data:
      data.push_back(byte);
      if (data.size() == length) reading = Reading::end;
      return;
    case Reading::end:
      reading = Reading::start;
      if (byte == kEnd) {
        carry_out();
      } else {
        ++requests[kNonsense];
      }
      return;
  }
}

void DmxPro::State::carry_out() {
  ++requests[label];
  // Any request but these two turns the socket to input.
  if (label != kSendDmx && label != kGetParameters) output.clear();
  if (label == kSendDmx) {
    if (data.size() < kFewest || data.size() > kMost || firmware == 3) return;
    if (data[0] != 0) {  // not for dimmers
      output.clear();
      return;
    }
    output.assign(data.begin() + 1, data.end());
    fixtures.resize(std::max(fixtures.size(), output.size()));
    std::copy(output.begin(), output.end(), fixtures.begin());
  } else if (label == kGetParameters) {
    if (data.size() != 2) return;
    const std::size_t wanted = data[0] + (static_cast<std::size_t>(data[1]) << 8U);
    Bytes parameters{44, firmware, break_time, mark_time, rate};
    for (std::size_t i = 0; i < wanted; ++i) parameters.push_back(i < user_data.size() ? user_data[i] : 0);
    answer(kGetParameters, parameters);
  } else if (label == kSetParameters) {
    if (data.size() < 5) return;
    break_time = data[2];
    mark_time = data[3];
    rate = data[4];
    user_data.assign(data.begin() + 5, data.end());
  } else if (label == kGetSerial) {
    answer(kGetSerial, serial);
  } else if (label == kManufacturer && !manufacturer.empty()) {
    answer(kManufacturer, with_id(0x6A6B, manufacturer));
  } else if (label == kDevice && !device.empty()) {
    answer(kDevice, with_id(1, device));
  }
}

void DmxPro::State::answer(std::uint8_t with, const Bytes& bytes) {
  std::string message = message_of(with, bytes);
  const bool spoil_it = spoilt > 0;
  if (spoil_it) --spoilt;
  if (spoil_it && (how == Spoil::missing || (how == Spoil::two_of_three && spoilt % 3 != 0))) return;
  if (spoil_it && how == Spoil::late) {
    line.write(std::exchange(kept_back, std::move(message)));
    return;
  }
  if (spoil_it && how == Spoil::duplicate) message += message;
  if (spoil_it && how == Spoil::garbage) {
    for (char& c : message) c = static_cast<char>(c ^ 0x55);
  }
  line.write(std::exchange(kept_back, {}) + message);
}

void DmxPro::State::serve() {
  answer_promptly();
  while (!ended) {
    const std::string come = line.read(kTurn);
    const std::lock_guard lock(mutex);
    for (const char c : come) take(static_cast<std::uint8_t>(c));
  }
}

DmxPro::DmxPro(const std::filesystem::path& line, const std::string& serial)
    : state_(std::make_unique<State>(line)) {
  state_->serial = bcd_of(serial);
  state_->thread = std::thread([state = state_.get()] { state->serve(); });
}

DmxPro::~DmxPro() {
  state_->ended = true;
  state_->thread.join();
}

std::vector<std::uint8_t> DmxPro::output() {
  const std::lock_guard lock(state_->mutex);
  return state_->output;
}

std::vector<std::uint8_t> DmxPro::fixtures() {
  const std::lock_guard lock(state_->mutex);
  return state_->fixtures;
}

int DmxPro::requests(std::uint8_t label) {
  const std::lock_guard lock(state_->mutex);
  return state_->requests[label];
}

void DmxPro::set_serial(const std::string& serial) {
  const std::lock_guard lock(state_->mutex);
  state_->serial = bcd_of(serial);
}

void DmxPro::set_firmware(std::uint8_t major) {
  const std::lock_guard lock(state_->mutex);
  state_->firmware = major;
}

void DmxPro::set_names(const std::string& manufacturer, const std::string& device) {
  const std::lock_guard lock(state_->mutex);
  state_->manufacturer = manufacturer;
  state_->device = device;
}

void DmxPro::send_received_dmx() {
  const std::lock_guard lock(state_->mutex);
  // A status of 0, the start code and channels that hold a beginning and an end of a message.
  state_->line.write(message_of(kReceivedDmx, {0, 0, kStart, kGetParameters, 5, 0, 1, 2, 3, 4, 5, kEnd}));
}

void DmxPro::spoil(Spoil how, int answers) {
  const std::lock_guard lock(state_->mutex);
  state_->how = how;
  state_->spoilt = answers;
}

void DmxPro::cut() {
  state_->line.cut();
  const std::lock_guard lock(state_->mutex);
  state_->power_on();
}

void DmxPro::restore() {
  state_->line.restore();
}

void DmxPro::power_cycle() {
  const std::lock_guard lock(state_->mutex);
  state_->power_on();
}

void DmxPro::feed(std::string_view bytes) {
  const std::lock_guard lock(state_->mutex);
  for (const char c : bytes) state_->take(static_cast<std::uint8_t>(c));
}

}  // namespace rig::sim::wire
