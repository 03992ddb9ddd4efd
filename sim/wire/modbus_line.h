// Modbus slaves on one line: RTU at a pseudo-terminal, or TCP on loopback; and the faults of such a line.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "sim/wire/modbus_frame.h"

namespace rig::sim::wire {

/// Serves the slaves from a thread of its own. Any thread may call the rest.
class ModbusLine {
 public:
  /// How answers are spoilt on their way.
  enum class Spoil {
    missing,
    garbage,
    late,
    duplicate,
    two_of_three,  ///< only each third comes
  };

  /// The slaves live longer than the line.
  using Slaves = std::map<int, ModbusRegisters*>;

  ModbusLine(const ModbusLine&) = delete;
  ModbusLine& operator=(const ModbusLine&) = delete;
  virtual ~ModbusLine() = default;

  /// The next so many answers; 0 ends it.
  void spoil(Spoil how, int answers);
  /// Late answers come so long after the request; nothing is answered meanwhile.
  void set_lateness(std::chrono::milliseconds by);
  /// The second of two answers comes so long after the first.
  void set_repeat_after(std::chrono::milliseconds by);
  /// The next so many requests are answered with this exception and not carried out.
  void refuse(ModbusException code, int requests);
  /// A slave that is off: no answer, nothing carried out.
  void set_off(int slave, bool off);

  /// The plug is pulled, or the network is down, until restore().
  virtual void cut() = 0;
  virtual void restore() = 0;

  /// Requests to a slave of the line with a good checksum.
  [[nodiscard]] int requests() const { return requests_; }
  /// Frames that no slave could read: bad checksum, no silence before them.
  [[nodiscard]] int unreadable() const { return unreadable_; }

 protected:
  explicit ModbusLine(Slaves slaves) : slaves_(std::move(slaves)) {}

  struct Delivery {
    std::string pdu;
    std::chrono::milliseconds after{0};
    bool garbled = false;
    std::optional<std::chrono::milliseconds> again_after = std::nullopt;
  };
  /// What goes back to a request, if anything.
  [[nodiscard]] std::optional<Delivery> deliver(int slave, std::string_view pdu);
  [[nodiscard]] ModbusRegisters* slave(int number);
  void count_unreadable() { ++unreadable_; }

 private:
  const Slaves slaves_;
  std::mutex mutex_;
  Spoil how_ = Spoil::missing;
  int spoilt_ = 0;
  std::chrono::milliseconds lateness_{300}, repeat_after_{0};
  ModbusException refusal_ = ModbusException::busy;
  int refused_ = 0;
  std::map<int, bool> off_;
  std::atomic<int> requests_ = 0, unreadable_ = 0;
};

/// RTU. `silence`: what the drives need between an answer and the next request; a request that comes sooner
/// is not understood.
[[nodiscard]] std::unique_ptr<ModbusLine> make_rtu_line(const std::filesystem::path& link,
                                                        std::chrono::microseconds silence,
                                                        ModbusLine::Slaves slaves);

/// TCP on 127.0.0.1, one client at a time, the newest.
class ModbusTcpLine : public ModbusLine {
 public:
  [[nodiscard]] virtual int port() const = 0;

 protected:
  using ModbusLine::ModbusLine;
};
[[nodiscard]] std::unique_ptr<ModbusTcpLine> make_tcp_line(ModbusLine::Slaves slaves);

}  // namespace rig::sim::wire
