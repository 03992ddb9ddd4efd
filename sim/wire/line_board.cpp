#include "sim/wire/line_board.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <fmt/format.h>
#include <functional>
#include <mutex>
#include <poll.h>
#include <sstream>
#include <sys/socket.h>
#include <sys/un.h>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>

#include "sim/wire/promptness.h"

namespace rig::sim::wire {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kQueue = 16;
constexpr int kTurn_ms = 5;

struct Pin {
  std::string name;
  std::optional<bool> driven;  // from outside
  bool bias_high = false;
  bool output = false;
  bool out_high = false;
  std::string drive = "push-pull";
  // Of the request that is in force:
  int owner = -1;  // the connection
  bool active_low = false;
  bool edges = false;
  std::vector<std::string> queue;  // "1@NS"
  std::vector<LineBoard::Change> changes;
  int looks = 0;

  [[nodiscard]] bool drives() const {
    return output && !(drive == "open-drain" && out_high) && !(drive == "open-source" && !out_high);
  }
  [[nodiscard]] bool high() const {
    if (driven) return *driven;
    if (drives()) return out_high;
    // An open-drain line is pulled up by what it is wired to, an open-source line down.
    return output ? drive == "open-drain" : bias_high;
  }
  [[nodiscard]] bool active() const { return high() != active_low; }
};

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

}  // namespace

struct LineBoard::State {
  fs::path socket;
  std::mutex mutex;
  std::condition_variable looked;
  std::vector<Pin> pins;
  int listener = -1;
  std::vector<int> users;
  int failing = 0, fail_with = 0, garbled = 0;
  std::string garbage;
  Spoil spoilt_how = Spoil::missing;
  int spoilt = 0;
  std::chrono::milliseconds lateness{};
  struct Late {
    int user;
    Time due;
    std::string said;
  };
  std::vector<Late> late;
  std::atomic<bool> ended{false};
  std::thread thread;

  void listen();
  void close_all();
  void serve();
  void leave(int user);
  void say(int user, const std::string& said);
  void say_what_is_late();
  void change(unsigned int line, const std::function<void(Pin&)>& how,
              Time at = std::chrono::steady_clock::now());
  void drive(unsigned int line, std::optional<bool> high, Time at);
  std::string answer(int user, const std::string& request);
  std::string take(int user, Pin& pin, const std::vector<std::string>& words);
  static std::string error(int number) { return fmt::format("error {}", number); }
};

void LineBoard::State::listen() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.native().size() >= sizeof(address.sun_path)) {
    throw std::system_error(ENAMETOOLONG, std::generic_category(), socket.string());
  }
  socket.native().copy(address.sun_path, socket.native().size());
  listener = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  std::error_code not_there;
  fs::remove(socket, not_there);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(listener, 4) != 0) {
    throw std::system_error(errno, std::generic_category(), socket.string());
  }
}

void LineBoard::State::close_all() {
  for (const int user : std::vector<int>(users)) leave(user);
  if (listener >= 0) ::close(listener);
  listener = -1;
  std::error_code already_gone;
  fs::remove(socket, already_gone);
}

void LineBoard::State::leave(int user) {
  for (Pin& pin : pins) {
    if (pin.owner == user) pin.owner = -1;
  }
  std::erase(users, user);
  std::erase_if(late, [&](const Late& one) { return one.user == user; });
  ::close(user);
}

void LineBoard::State::drive(unsigned int line, std::optional<bool> high, Time at) {
  change(
      line, [&](Pin& pin) { pin.driven = high; }, at);
}

// Whatever changes the level of a pin goes through here, so that its changes are noted.
void LineBoard::State::change(unsigned int line, const std::function<void(Pin&)>& how, Time at) {
  Pin& pin = pins.at(line);
  const bool before = pin.high();
  how(pin);
  const bool after = pin.high();
  if (before == after) return;
  if (pin.output) pin.changes.push_back({at, after});
  if (pin.owner < 0 || !pin.edges || pin.queue.size() >= kQueue) return;
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(at.time_since_epoch()).count();
  pin.queue.push_back(fmt::format("{}@{}", pin.active() ? 1 : 0, ns));
}

std::string LineBoard::State::take(int user, Pin& pin, const std::vector<std::string>& words) {
  if (words.size() != 5) return error(EINVAL);
  if (pin.owner >= 0) return error(EBUSY);
  const std::string& level = words[2];
  if (level != "high" && level != "low") return error(EINVAL);
  const auto line = static_cast<unsigned int>(&pin - pins.data());
  const bool active_low = level == "low";
  if (words[0] == "input") {
    const std::string& bias = words[3];
    if (bias != "as-is" && bias != "none" && bias != "pull-up" && bias != "pull-down") return error(EINVAL);
    if (words[4] != "both" && words[4] != "none") return error(EINVAL);
    pin.active_low = active_low;
    change(line, [&](Pin& p) {
      p.output = false;
      if (bias != "as-is") p.bias_high = bias == "pull-up";
    });
    pin.edges = words[4] == "both";
  } else {
    const std::string& drive = words[3];
    const std::string& start = words[4];
    if (drive != "push-pull" && drive != "open-drain" && drive != "open-source") return error(EINVAL);
    if (start != "0" && start != "1" && start != "keep") return error(EINVAL);
    pin.edges = false;
    pin.active_low = active_low;
    change(line, [&](Pin& p) {
      const bool was = p.output && p.out_high != active_low;
      const bool active = start == "keep" ? was : start == "1";
      p.output = true;
      p.drive = drive;
      p.out_high = active != active_low;
    });
  }
  pin.owner = user;
  pin.queue.clear();
  return "ok";
}

std::string LineBoard::State::answer(int user, const std::string& request) {
  if (failing > 0) {
    --failing;
    return error(fail_with);
  }
  if (garbled > 0) {
    --garbled;
    return garbage;
  }
  const auto words = words_of(request);
  if (words.size() < 2) return error(EINVAL);
  if (words[0] == "find") {
    for (std::size_t i = 0; i < pins.size(); ++i) {
      if (pins[i].name == words[1]) return fmt::format("ok {}", i);
    }
    return error(ENOENT);
  }
  const auto line = static_cast<std::size_t>(std::atoi(words[1].c_str()));
  if (line >= pins.size()) return error(EINVAL);
  Pin& pin = pins[line];
  if (words[0] == "input" || words[0] == "output") return take(user, pin, words);
  if (pin.owner != user) return error(EPERM);
  if (words[0] == "get" && words.size() == 2) {
    ++pin.looks;
    looked.notify_all();
    return pin.active() ? "ok 1" : "ok 0";
  }
  if (words[0] == "set" && words.size() == 3 && (words[2] == "0" || words[2] == "1")) {
    if (!pin.output) return error(EPERM);
    change(static_cast<unsigned int>(line), [&](Pin& p) { p.out_high = (words[2] == "1") != p.active_low; });
    return "ok";
  }
  if (words[0] == "edges" && words.size() == 2) {
    if (!pin.edges) return error(EPERM);
    std::string said = "ok";
    for (const std::string& edge : pin.queue) said += " " + edge;
    pin.queue.clear();
    return said;
  }
  return error(EINVAL);
}

void LineBoard::State::say(int user, const std::string& said) {
  const auto send = [&](const std::string& text) {
    (void)::send(user, text.data(), text.size(), MSG_NOSIGNAL);
  };
  if (spoilt == 0) return send(said);
  --spoilt;
  switch (spoilt_how) {
    case Spoil::missing:
      return;
    case Spoil::two_of_three:
      return spoilt % 3 == 0 ? send(said) : void();
    case Spoil::garbage:
      return send("\x11?ok 1 0");
    case Spoil::late:
      late.push_back({user, std::chrono::steady_clock::now() + lateness, said});
      return;
    case Spoil::duplicate:
      send(said);
      return send(said);
  }
}

void LineBoard::State::say_what_is_late() {
  const Time now = std::chrono::steady_clock::now();
  std::erase_if(late, [&](const Late& one) {
    if (one.due > now) return false;
    (void)::send(one.user, one.said.data(), one.said.size(), MSG_NOSIGNAL);
    return true;
  });
}

void LineBoard::State::serve() {
  answer_promptly();
  while (!ended) {
    std::vector<pollfd> waits;
    {
      const std::lock_guard lock(mutex);
      if (listener >= 0) waits.push_back({listener, POLLIN, 0});
      for (const int user : users) waits.push_back({user, POLLIN, 0});
    }
    (void)::poll(waits.data(), waits.size(), kTurn_ms);
    const std::lock_guard lock(mutex);
    if (listener >= 0) {
      const int user = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (user >= 0) users.push_back(user);
    }
    for (const int user : std::vector<int>(users)) {
      std::array<char, 512> request{};
      const ssize_t n = ::recv(user, request.data(), request.size(), 0);
      if (n < 0 && errno == EAGAIN) continue;
      if (n <= 0) {
        leave(user);
        continue;
      }
      say(user, answer(user, {request.data(), static_cast<std::size_t>(n)}));
    }
    say_what_is_late();
  }
}

LineBoard::LineBoard(fs::path socket, std::vector<std::string> names) : state_(std::make_unique<State>()) {
  state_->socket = std::move(socket);
  state_->pins.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) state_->pins[i].name = std::move(names[i]);
  state_->listen();
  state_->thread = std::thread([state = state_.get()] { state->serve(); });
}

LineBoard::~LineBoard() {
  state_->ended = true;
  state_->thread.join();
  state_->close_all();
}

const fs::path& LineBoard::path() const {
  return state_->socket;
}

void LineBoard::drive(unsigned int line, std::optional<bool> high) {
  const std::lock_guard lock(state_->mutex);
  state_->drive(line, high, std::chrono::steady_clock::now());
}

void LineBoard::drive_burst(unsigned int line, const std::vector<bool>& highs) {
  const std::lock_guard lock(state_->mutex);
  const Time at = std::chrono::steady_clock::now();
  for (const bool high : highs) state_->drive(line, high, at);
}

void LineBoard::drive_for(unsigned int line, bool high, std::chrono::nanoseconds held) {
  const std::lock_guard lock(state_->mutex);
  const Time at = std::chrono::steady_clock::now();
  state_->drive(line, high, at - held);
  state_->drive(line, !high, at);
}

bool LineBoard::high(unsigned int line) {
  const std::lock_guard lock(state_->mutex);
  return state_->pins.at(line).high();
}

bool LineBoard::is_output(unsigned int line) {
  const std::lock_guard lock(state_->mutex);
  return state_->pins.at(line).output;
}

bool LineBoard::is_taken(unsigned int line) {
  const std::lock_guard lock(state_->mutex);
  return state_->pins.at(line).owner >= 0;
}

void LineBoard::await_looks(unsigned int line, int looks) {
  std::unique_lock lock(state_->mutex);
  const Pin& pin = state_->pins.at(line);
  const int until = pin.looks + looks;
  state_->looked.wait(lock, [&] { return pin.looks >= until; });
}

std::vector<LineBoard::Change> LineBoard::changes(unsigned int line) {
  const std::lock_guard lock(state_->mutex);
  return std::exchange(state_->pins.at(line).changes, {});
}

void LineBoard::fail_next(int requests, int error) {
  const std::lock_guard lock(state_->mutex);
  state_->failing = requests;
  state_->fail_with = error;
}

void LineBoard::garble_next(int requests, const std::string& answer) {
  const std::lock_guard lock(state_->mutex);
  state_->garbled = requests;
  state_->garbage = answer;
}

void LineBoard::spoil(Spoil how, int answers, std::chrono::milliseconds lateness) {
  const std::lock_guard lock(state_->mutex);
  state_->spoilt_how = how;
  state_->spoilt = answers;
  state_->lateness = lateness;
}

void LineBoard::cut() {
  const std::lock_guard lock(state_->mutex);
  state_->close_all();
}

void LineBoard::restore() {
  const std::lock_guard lock(state_->mutex);
  for (Pin& pin : state_->pins) {
    Pin fresh;
    fresh.name = pin.name;
    fresh.driven = pin.driven;
    pin = std::move(fresh);
  }
  if (state_->listener < 0) state_->listen();
}

}  // namespace rig::sim::wire
