#include "drivers/gpiod_lines/socket_chip.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace rig::drivers::gpiod_lines {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

// Within rigd's deadline for a call, which asks for one answer after the other.
constexpr std::chrono::milliseconds kAnswer{500};
constexpr std::size_t kLongestAnswer = 4096;

template <typename Number>
bool take_number(std::string_view& text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

tl::unexpected<base::Error> garbled(std::string_view text) {
  constexpr std::size_t kShown = 40;
  return fail(ErrorCode::damaged,
              fmt::format("the chip of lines answers nonsense: '{}'", text.substr(0, kShown)));
}

const char* word(Bias bias) {
  switch (bias) {
    case Bias::none:
      return "none";
    case Bias::pull_up:
      return "pull-up";
    case Bias::pull_down:
      return "pull-down";
    case Bias::as_is:
      break;
  }
  return "as-is";
}

const char* word(Drive drive) {
  switch (drive) {
    case Drive::open_drain:
      return "open-drain";
    case Drive::open_source:
      return "open-source";
    case Drive::push_pull:
      break;
  }
  return "push-pull";
}

const char* word(Rest rest) {
  switch (rest) {
    case Rest::active:
      return "1";
    case Rest::keep:
      return "keep";
    case Rest::inactive:
      break;
  }
  return "0";
}

class SocketChip final : public LineChip {
 public:
  SocketChip(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}
  ~SocketChip() override { ::close(fd_); }
  SocketChip(const SocketChip&) = delete;
  SocketChip& operator=(const SocketChip&) = delete;

  [[nodiscard]] Result<void> request_all(const std::vector<LineRequest>& requests) {
    for (const LineRequest& request : requests) {
      auto offset = request.offset ? Result<unsigned int>(*request.offset) : find(request);
      if (!offset) return pass(offset);
      if (std::find(offsets_.begin(), offsets_.end(), *offset) != offsets_.end()) {
        return fail(ErrorCode::bad_input, "two names for one line", "line " + request.name);
      }
      offsets_.push_back(*offset);
      with_edges_.push_back(!request.output && request.edges);
    }
    for (const bool outputs : {true, false}) {
      for (std::size_t i = 0; i < requests.size(); ++i) {
        if (requests[i].output != outputs) continue;
        if (auto ok = take(requests[i], offsets_[i]); !ok) return pass(ok);
      }
    }
    return {};
  }

  [[nodiscard]] Result<bool> level(std::size_t line) override {
    return used(ask(fmt::format("get {}", offsets_.at(line))).and_then([](const std::string& text) {
      return read_level(text);
    }));
  }

  [[nodiscard]] Result<void> set(std::size_t line, bool active) override {
    return used(ask(fmt::format("set {} {}", offsets_.at(line), active ? 1 : 0)).map([](const auto&) {}));
  }

  [[nodiscard]] Result<std::vector<Edge>> edges(std::size_t line) override {
    if (!with_edges_.at(line)) return std::vector<Edge>();
    return used(ask(fmt::format("edges {}", offsets_[line])).and_then([](const std::string& text) {
      return read_edges(text);
    }));
  }

 private:
  [[nodiscard]] Result<unsigned int> find(const LineRequest& request) {
    const auto found = ask("find " + request.label);
    if (found) return read_offset(*found);
    if (found.error().code != ErrorCode::io) return pass(found);
    return fail(ErrorCode::not_found, fmt::format("the chip has no line with the name '{}'", request.label),
                "line " + request.name);
  }

  [[nodiscard]] Result<void> take(const LineRequest& request, unsigned int offset) {
    const char* active = request.active_low ? "low" : "high";
    auto taken = request.output ? ask(fmt::format("output {} {} {} {}", offset, active, word(request.drive),
                                                  word(request.at_start)))
                                : ask(fmt::format("input {} {} {} {}", offset, active, word(request.bias),
                                                  request.edges ? "both" : "none"));
    if (taken) return {};
    taken.error().where = "line " + request.name;
    return pass(taken);
  }

  // What an open chip cannot do is `lost`.
  template <typename T>
  [[nodiscard]] Result<T> used(Result<T> result) const {
    if (!result) {
      result.error().code = ErrorCode::lost;
      result.error().where = path_;
    }
    return result;
  }

  [[nodiscard]] Result<std::string> ask(const std::string& request) {
    const auto lost = [&](const std::string& why) {
      return fail(ErrorCode::lost, "the chip of lines is gone: " + why, path_);
    };
    std::array<char, kLongestAnswer> answer{};
    // An answer that nobody waits for belongs to no question that is to come.
    while (::recv(fd_, answer.data(), answer.size(), MSG_DONTWAIT) > 0) continue;
    if (::send(fd_, request.data(), request.size(), MSG_NOSIGNAL) < 0) return lost(std::strerror(errno));
    // Once one did not come this connection is given up; what it is still told has to go out, no more.
    if (silent_) return lost("it gave no answer before");
    pollfd wait{fd_, POLLIN, 0};
    if (::poll(&wait, 1, static_cast<int>(kAnswer.count())) <= 0) {
      silent_ = true;
      return lost("no answer");
    }
    const ssize_t n = ::recv(fd_, answer.data(), answer.size(), 0);
    if (n <= 0) return lost(n == 0 ? "it hung up" : std::strerror(errno));
    const auto said = read_answer({answer.data(), static_cast<std::size_t>(n)});
    if (!said) return pass(said);
    return std::string(*said);
  }

  const int fd_;
  const std::string path_;
  bool silent_ = false;
  std::vector<unsigned int> offsets_;
  std::vector<bool> with_edges_;
};

}  // namespace

Result<std::string_view> read_answer(std::string_view answer) {
  constexpr std::string_view kOk = "ok";
  constexpr std::string_view kError = "error ";
  if (answer == kOk) return std::string_view();
  if (answer.starts_with(kOk) && answer[kOk.size()] == ' ') return answer.substr(kOk.size() + 1);
  if (answer.starts_with(kError)) {
    std::string_view rest = answer.substr(kError.size());
    int number = 0;
    if (take_number(rest, number) && rest.empty() && number > 0) {
      return fail(number == EBUSY ? ErrorCode::busy : ErrorCode::io,
                  fmt::format("the line is not to be had: {}", std::strerror(number)));
    }
  }
  return garbled(answer);
}

Result<bool> read_level(std::string_view text) {
  if (text != "0" && text != "1") return garbled(text);
  return text == "1";
}

Result<unsigned int> read_offset(std::string_view text) {
  std::string_view rest = text;
  unsigned int offset = 0;
  if (!take_number(rest, offset) || !rest.empty()) return garbled(text);
  return offset;
}

Result<std::vector<Edge>> read_edges(std::string_view text) {
  std::vector<Edge> edges;
  std::string_view rest = text;
  while (!rest.empty()) {
    Edge edge;
    const auto at = rest.find('@');
    if (at == std::string_view::npos || edges.size() == 4 * kEdgeQueue) return garbled(text);
    const auto active = read_level(rest.substr(0, at));
    if (!active) return garbled(text);
    edge.active = *active;
    rest.remove_prefix(at + 1);
    if (!take_number(rest, edge.at_ns) || edge.at_ns < 0) return garbled(text);
    if (!rest.empty() && (rest.front() != ' ' || rest.size() == 1)) return garbled(text);
    if (!rest.empty()) rest.remove_prefix(1);
    edges.push_back(edge);
  }
  return edges;
}

Result<std::unique_ptr<LineChip>> open_socket_chip(const std::string& path,
                                                   const std::vector<LineRequest>& requests) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return fail(ErrorCode::bad_input, "the path of the socket is empty or too long", path);
  }
  path.copy(address.sun_path, path.size());
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (fd < 0) return fail(ErrorCode::io, std::strerror(errno), path);
  auto chip = std::make_unique<SocketChip>(fd, path);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return fail(ErrorCode::lost, fmt::format("nobody plays a chip of lines there: {}", std::strerror(errno)),
                path);
  }
  if (auto ok = chip->request_all(requests); !ok) return pass(ok);
  return chip;
}

}  // namespace rig::drivers::gpiod_lines
