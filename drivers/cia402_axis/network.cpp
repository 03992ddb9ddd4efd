#include "drivers/cia402_axis/network.h"

#include "drivers/cia402_axis/can_errors.h"

namespace rig::drivers::cia402 {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// Every node has these two (CiA 301): one of them is another object than that of any question.
constexpr Object kDeviceType{0x1000, 0}, kErrorRegister{0x1001, 0};

constexpr Steady::time_point kDoNotWait{};

constexpr const char* kTooSlow = "the call's time is over; raise call_ms if the drive is this slow";
constexpr const char* kTooSilent = "is the drive powered, and its node number and the bit rate right?";

std::vector<canid_t> answers_of(const std::vector<int>& nodes) {
  std::vector<canid_t> ids;
  for (const int node : nodes) {
    // Emergency, SDO answer, heartbeat.
    for (const canid_t id : {0x080U, 0x580U, 0x700U}) ids.push_back(id + static_cast<canid_t>(node));
  }
  return ids;
}

}  // namespace

Network::Network(NetworkSettings settings, const std::vector<int>& nodes, base::Clock& clock, Log log)
    : settings_(std::move(settings)),
      heard_(answers_of(nodes)),
      log_(std::move(log)),
      bus_(
          [this] {
            is_bus_off_ = false;
            return CanBus::open(settings_.interface, heard_);
          },
          clock) {
  for (const int node : nodes) nodes_.emplace(node, node);
}

std::string Network::where(int node) const {
  return fmt::format("{}, node {}", settings_.interface, node);
}

void Network::take(const can_frame& frame) {
  if ((frame.can_id & CAN_ERR_FLAG) == 0) {
    is_bus_off_ = false;  // what is off the bus hears nothing
    for (auto& [id, node] : nodes_) node.monitor.hear(frame, Steady::now());
    return;
  }
  const BusNews news = read_error_frame(frame);
  switch (news.event) {
    case BusEvent::nothing:
      return;
    case BusEvent::bus_off:
      if (!is_bus_off_) ++times_bus_off_;
      is_bus_off_ = true;
      break;
    case BusEvent::restarted:
      is_bus_off_ = false;
      break;
    case BusEvent::warning:
      break;
  }
  // A bus in trouble says the same thing a thousand times.
  if (news.text == last_warning_) return;
  last_warning_ = news.text;
  log_(base::LogLevel::warning, fmt::format("{}: {}", settings_.interface, news.text));
}

Result<void> Network::take_all(CanBus& bus) {
  while (true) {
    const auto frame = bus.read(kDoNotWait);
    if (!frame) return pass(frame);
    if (!*frame) return {};
    take(**frame);
  }
}

Result<void> Network::on_the_bus() const {
  if (!is_bus_off_) return {};
  return fail(
      ErrorCode::lost, "the controller is bus-off: too many errors", settings_.interface,
      "look at cable, terminators and bit rate; 'ip link set DEVICE type can restart-ms 100', done once "
      "by the administrator, lets it come back by itself");
}

Result<void> Network::alive(int node) {
  if (!node_at(node).monitor.is_overdue(Steady::now())) return {};
  return fail(ErrorCode::lost,
              fmt::format("no heartbeat for more than {} ms", settings_.heartbeat_timeout.count()),
              where(node), "is the drive powered, and its cable in place?");
}

Result<void> Network::listen() {
  if (auto taken = bus_.use([&](CanBus& bus) { return take_all(bus); }); !taken) return taken;
  return on_the_bus();
}

Result<void> Network::send(const can_frame& frame, Steady::time_point deadline) {
  auto sent = bus_.use([&](CanBus& bus) { return bus.write(frame, deadline); });
  if (!sent && sent.error().code == ErrorCode::timeout) sent.error().code = ErrorCode::lost;
  return sent;
}

Result<void> Network::command(NmtCommand command, int node, Steady::time_point deadline) {
  can_frame frame{};
  frame.can_dlc = 2;
  frame.data[0] = static_cast<std::uint8_t>(command);
  frame.data[1] = static_cast<std::uint8_t>(node);
  auto sent = send(frame, deadline);
  if (sent && command == NmtCommand::start) monitor(node).started();
  return sent;
}

Result<std::string> Network::upload(int node, Object object, Steady::time_point deadline) {
  return transfer(node, SdoTransfer::upload(node, object), object, deadline);
}

Result<void> Network::download(int node, Object object, std::string_view bytes, Steady::time_point deadline) {
  const auto done = transfer(node, SdoTransfer::download(node, object, bytes), object, deadline);
  if (!done) return pass(done);
  return {};
}

Result<void> Network::download_at_once(int node, Object object, std::string_view bytes,
                                       Steady::time_point deadline) {
  Node& asked = node_at(node);
  if (asked.answer_outstanding) {
    const auto abort = SdoTransfer::upload(node, asked.outstanding).abort(abort_code::kTimedOut);
    if (auto sent = send(abort, deadline); !sent) return sent;
    // No fence: a stop does not wait for one. A late answer to an earlier order of the same object may be
    // taken for this one's; the order itself has gone out all the same.
    asked.answer_outstanding = false;
  }
  return download(node, object, bytes, deadline);
}

Result<std::string> Network::transfer(int node, SdoTransfer transfer, Object object,
                                      Steady::time_point deadline) {
  // What one node does not answer leaves the bus to the others: within use() that is `timeout`, and only what
  // happens to the bus itself closes it.
  const auto once = [&] {
    return bus_.use([&](CanBus& bus) { return attempt(bus, node, transfer, object, deadline); });
  };
  auto answer = with_retries(settings_.retry, once);
  if (answer || answer.error().code != ErrorCode::lost) return answer;
  if (auto on = on_the_bus(); !on) return pass(on);
  return answer;
}

// After a question that went unanswered, another one whose answer tells that no answer to the first can come
// any more: a server answers in the order in which it was asked.
Result<void> Network::fence(CanBus& bus, int node, Object object, Steady::time_point deadline) {
  Node& asked = node_at(node);
  const Object other =
      object == kDeviceType || asked.outstanding == kDeviceType ? kErrorRegister : kDeviceType;
  asked.answer_outstanding = false;
  const auto answer = attempt(bus, node, SdoTransfer::upload(node, other), other, deadline);
  // That it refuses is an answer too.
  if (answer || answer.error().code == ErrorCode::device || answer.error().code == ErrorCode::not_found)
    return {};
  return pass(answer);
}

Result<std::string> Network::attempt(CanBus& bus, int node, SdoTransfer transfer, Object object,
                                     Steady::time_point deadline) {
  if (Steady::now() >= deadline) {
    return fail(ErrorCode::timeout, fmt::format("{}: no time was left to ask for it", text_of(object)),
                where(node), kTooSlow);
  }
  // What has come before the question cannot be its answer.
  if (auto taken = take_all(bus); !taken) return pass(taken);
  if (is_bus_off_) return fail(ErrorCode::timeout, "the controller is bus-off", settings_.interface);
  Node& asked = node_at(node);
  if (asked.answer_outstanding) {
    if (auto fenced = fence(bus, node, object, deadline); !fenced) return pass(fenced);
  }
  auto begun = Steady::now();
  auto end = std::min(deadline, begun + settings_.retry.answer);
  if (auto sent = bus.write(transfer.request(), end); !sent) return pass(sent);
  while (true) {
    const auto frame = bus.read(end);
    if (!frame) return pass(frame);
    if (!*frame) break;
    take(**frame);
    const auto next = transfer.hear(**frame);
    if (next) {
      // Each segment has its own time.
      begun = asked.last_answer = Steady::now();
      end = std::min(deadline, begun + settings_.retry.answer);
      if (auto sent = bus.write(*next, end); !sent) return pass(sent);
    }
    if (transfer.state() != SdoTransfer::State::waiting) asked.last_answer = Steady::now();
    switch (transfer.state()) {
      case SdoTransfer::State::waiting:
        continue;
      case SdoTransfer::State::done:
        return transfer.bytes();
      case SdoTransfer::State::failed: {
        base::Error error = transfer.error();
        error.where = where(node);
        return tl::unexpected<base::Error>(std::move(error));
      }
    }
  }
  asked.answer_outstanding = true;
  asked.outstanding = object;
  if (transfer.saw_garbage()) {
    return fail(ErrorCode::damaged, fmt::format("{}: the answer is none of CANopen's", text_of(object)),
                where(node));
  }
  const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(Steady::now() - begun);
  return fail(ErrorCode::timeout, fmt::format("{}: no answer within {} ms", text_of(object), waited.count()),
              where(node), end < begun + settings_.retry.answer ? kTooSlow : kTooSilent);
}

}  // namespace rig::drivers::cia402
