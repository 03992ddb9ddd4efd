#include "sim/wire/modbus_line.h"

#include <array>
#include <cerrno>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "sim/wire/promptness.h"
#include "sim/wire/pty.h"

namespace rig::sim::wire {

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

void ModbusLine::spoil(Spoil how, int answers) {
  const std::lock_guard lock(mutex_);
  how_ = how;
  spoilt_ = answers;
}

void ModbusLine::set_lateness(milliseconds by) {
  const std::lock_guard lock(mutex_);
  lateness_ = by;
}

void ModbusLine::set_repeat_after(milliseconds by) {
  const std::lock_guard lock(mutex_);
  repeat_after_ = by;
}

void ModbusLine::refuse(ModbusException code, int requests) {
  const std::lock_guard lock(mutex_);
  refusal_ = code;
  refused_ = requests;
}

void ModbusLine::set_off(int slave, bool off) {
  const std::lock_guard lock(mutex_);
  off_[slave] = off;
}

ModbusRegisters* ModbusLine::slave(int number) {
  const auto found = slaves_.find(number);
  if (found == slaves_.end()) return nullptr;
  const std::lock_guard lock(mutex_);
  const auto off = off_.find(number);
  return off != off_.end() && off->second ? nullptr : found->second;
}

std::optional<ModbusLine::Delivery> ModbusLine::deliver(int number, std::string_view pdu) {
  ModbusRegisters* registers = slave(number);
  if (registers == nullptr || pdu.empty()) return std::nullopt;
  ++requests_;
  std::unique_lock lock(mutex_);
  if (refused_ > 0) {
    --refused_;
    return Delivery{modbus_exception(pdu[0], refusal_)};
  }
  lock.unlock();
  Delivery delivery{modbus_answer(*registers, pdu)};
  lock.lock();
  if (spoilt_ <= 0) return delivery;
  --spoilt_;
  switch (how_) {
    case Spoil::missing:
      return std::nullopt;
    case Spoil::garbage:
      delivery.garbled = true;
      break;
    case Spoil::late:
      delivery.after = lateness_;
      break;
    case Spoil::duplicate:
      delivery.again_after = repeat_after_;
      break;
    case Spoil::two_of_three:
      if (spoilt_ % 3 != 0) return std::nullopt;
      break;
  }
  return delivery;
}

namespace {

class RtuLine final : public ModbusLine {
 public:
  RtuLine(const std::filesystem::path& link, std::chrono::microseconds silence, Slaves slaves)
      : ModbusLine(std::move(slaves)), silence_(silence), pty_(link), thread_([this] { serve(); }) {}
  ~RtuLine() override {
    ends_ = true;
    thread_.join();
  }

  void cut() override { pty_.cut(); }
  void restore() override { pty_.restore(); }

 private:
  void serve() {
    answer_promptly();
    while (!ends_) {
      if (listen(milliseconds(5))) {
        // A whole frame is taken at once, without waiting out the silence that ends it.
        while (take_frame()) {
        }
      } else if (!come_.empty()) {
        drop_unreadable();
      }
    }
  }

  /// Takes in what comes within the time; false: nothing.
  bool listen(milliseconds within) {
    const std::string bytes = pty_.read(within);
    if (bytes.empty()) return false;
    if (come_.empty()) begun_ = Steady::now();
    come_ += bytes;
    return true;
  }

  void drop_unreadable() {
    count_unreadable();
    const std::string frame = std::exchange(come_, {});
    if (frame.size() < 4 || modbus_crc_fits(frame)) return;
    ModbusRegisters* registers = slave(static_cast<unsigned char>(frame[0]));
    if (registers == nullptr || !registers->tells_bad_checksum()) return;
    send(frame[0], {modbus_exception(frame[1], ModbusException::bad_checksum)});
  }

  bool take_frame() {
    if (come_.size() < 4) return false;
    const auto length = modbus_request_length(std::string_view(come_).substr(1));
    // Functions that are not known end with the silence.
    const std::size_t size = length ? *length + 3 : come_.size();
    if (come_.size() < size || !modbus_crc_fits(std::string_view(come_).substr(0, size))) return false;
    const std::string frame = come_.substr(0, size);
    come_.erase(0, size);
    const auto begun = std::exchange(begun_, Steady::now());
    if (begun > answered_ && begun - answered_ < silence_) {
      count_unreadable();
      return true;
    }
    const auto delivery =
        deliver(static_cast<unsigned char>(frame[0]), std::string_view(frame).substr(1, size - 3));
    if (delivery) send(frame[0], *delivery);
    return true;
  }

  void send(char slave, const Delivery& delivery) {
    std::string frame = with_modbus_crc(slave + delivery.pdu);
    if (delivery.garbled) frame.back() = static_cast<char>(frame.back() ^ 0x5A);
    pause(delivery.after);
    // Taken before the bytes go: who reads them at once must not seem early.
    answered_ = Steady::now();
    pty_.write(frame);
    if (!delivery.again_after) return;
    pause(*delivery.again_after);
    answered_ = Steady::now();
    pty_.write(frame);
  }

  void pause(milliseconds length) {
    const auto until = Steady::now() + length;
    while (!ends_ && Steady::now() < until) (void)listen(milliseconds(1));
  }

  const std::chrono::microseconds silence_;
  Pty pty_;
  std::string come_;
  Steady::time_point begun_{}, answered_{};
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

class TcpLine final : public ModbusTcpLine {
 public:
  explicit TcpLine(Slaves slaves) : ModbusTcpLine(std::move(slaves)) {
    start();
    thread_ = std::thread([this] { serve(); });
  }
  ~TcpLine() override {
    ends_ = true;
    thread_.join();
    close_all();
  }

  [[nodiscard]] int port() const override { return port_; }

  void cut() override {
    const std::lock_guard lock(mutex_);
    close_all();
  }
  void restore() override {
    const std::lock_guard lock(mutex_);
    if (listener_ < 0) start();
  }

 private:
  static constexpr std::size_t kHeader = 7;  // transaction, protocol, length, slave

  void start() {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    // The port stays taken for a moment where the other thread still waits on the listener that was closed.
    int bound = -1;
    for (int i = 0; bound != 0 && i < 100; ++i) {
      bound = ::bind(listener_, reinterpret_cast<sockaddr*>(&address), size);
      if (bound != 0) std::this_thread::sleep_for(milliseconds(5));
    }
    if (bound != 0 || ::listen(listener_, 4) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::system_error(errno, std::generic_category(), "the Modbus server's port");
    }
    port_ = ntohs(address.sin_port);
  }

  void close_client() {
    if (client_ >= 0) ::close(client_);
    client_ = -1;
    come_.clear();
  }

  void close_all() {
    close_client();
    if (listener_ >= 0) ::close(listener_);
    listener_ = -1;
  }

  void serve() {
    answer_promptly();
    while (!ends_) {
      if (!listen(milliseconds(2))) continue;
      while (take_frame()) {
      }
    }
  }

  bool listen(milliseconds within) {
    std::array<pollfd, 2> wait{};
    {
      const std::lock_guard lock(mutex_);
      wait = {pollfd{listener_, POLLIN, 0}, pollfd{client_, POLLIN, 0}};
    }
    if (::poll(wait.data(), wait.size(), static_cast<int>(within.count())) <= 0) return false;
    const std::lock_guard lock(mutex_);
    if (wait[0].revents != 0 && listener_ >= 0) {
      const int fresh = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fresh >= 0) {
        const int on = 1;
        ::setsockopt(fresh, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
        close_client();
        client_ = fresh;
      }
    }
    if (client_ < 0) return false;
    std::array<char, 1024> buffer{};
    const ssize_t n = ::recv(client_, buffer.data(), buffer.size(), 0);
    if (n > 0) come_.append(buffer.data(), static_cast<std::size_t>(n));
    if (n == 0) close_client();
    return n > 0;
  }

  bool take_frame() {
    std::string frame;
    {
      const std::lock_guard lock(mutex_);
      if (come_.size() < kHeader) return false;
      const std::size_t length = kHeader - 1 + static_cast<unsigned char>(come_[5]);
      if (come_[2] != 0 || come_[3] != 0 || come_[4] != 0 || length <= kHeader) {
        // No Modbus: such a server hangs up.
        count_unreadable();
        close_client();
        return false;
      }
      if (come_.size() < length) return false;
      frame = come_.substr(0, length);
      come_.erase(0, length);
    }
    const auto delivery =
        deliver(static_cast<unsigned char>(frame[6]), std::string_view(frame).substr(kHeader));
    if (!delivery) return true;
    std::string answer = frame.substr(0, 5);
    answer += static_cast<char>(delivery->pdu.size() + 1);
    answer += frame[6] + delivery->pdu;
    if (delivery->garbled) answer[1] = static_cast<char>(answer[1] ^ 0x5A);
    pause(delivery->after);
    send(answer);
    if (delivery->again_after) {
      pause(*delivery->again_after);
      send(answer);
    }
    return true;
  }

  void send(const std::string& bytes) {
    const std::lock_guard lock(mutex_);
    if (client_ >= 0) (void)::send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

  void pause(milliseconds length) {
    const auto until = Steady::now() + length;
    while (!ends_ && Steady::now() < until) std::this_thread::sleep_for(milliseconds(1));
  }

  std::mutex mutex_;
  int listener_ = -1, client_ = -1;
  std::atomic<int> port_ = 0;
  std::string come_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<ModbusLine> make_rtu_line(const std::filesystem::path& link,
                                          std::chrono::microseconds silence, ModbusLine::Slaves slaves) {
  return std::make_unique<RtuLine>(link, silence, std::move(slaves));
}

std::unique_ptr<ModbusTcpLine> make_tcp_line(ModbusLine::Slaves slaves) {
  return std::make_unique<TcpLine>(std::move(slaves));
}

}  // namespace rig::sim::wire
