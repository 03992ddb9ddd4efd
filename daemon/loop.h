// The thin loop around step(): feeds it events, carries its actions out.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <memory>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "daemon/devices.h"
#include "daemon/event.h"
#include "daemon/frame_pool.h"
#include "daemon/metrics.h"
#include "daemon/state.h"
#include "daemon/step.h"
#include "daemon/storage.h"
#include "protocol/frame_door.h"
#include "protocol/server.h"

namespace rig::daemon {

class Loop {
 public:
  Loop(base::Clock& clock, Setup setup, State state, OpenDevices& devices, FramePool& pool);
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  /// From any thread.
  void post(What what);
  /// What earlier epochs told, in order: for clients that catch up across a restart. Before run().
  void remember(std::deque<protocol::Event> events) { recent_ = std::move(events); }
  /// All before run(); they must outlive it.
  void attach(Storage& storage, protocol::Server& server, protocol::FrameDoor& frames);

  /// Until EndRequested was handled.
  void run();

 private:
  void take(const Event& event);
  void carry_out(Action& action);
  enum class Turn { command, reading, stop };
  void to_axis(std::size_t axis, Turn turn, std::function<base::Result<void>(drivers::Axis&)> what);
  void trigger(const TriggerCamera& action);
  void pulse(std::uint64_t exposure);
  void read_lines(const LinesDevice& lines, base::Time asked);
  void fetch(const FetchFrame& action);
  void publish(const protocol::Event& event);
  void hand_to_local_clients(FrameSlot slot, const drivers::FrameInfo& info);
  void tell_service_manager();
  [[nodiscard]] protocol::Metrics metrics() const;
  void reply_with_metrics(const Asker& asker);
  void log_statistics();
  void catch_up(const SubscribeClient& action);
  [[nodiscard]] std::shared_ptr<const std::vector<PreviewPicture>> previews_of(
      std::span<const std::uint16_t> pixels) const;
  [[nodiscard]] protocol::Frame describe(const drivers::FrameInfo& info, double share,
                                         const Preview& preview) const;

  base::Clock& clock_;
  const Setup setup_;
  State state_;
  OpenDevices& devices_;
  FramePool& pool_;
  Storage* storage_ = nullptr;
  protocol::Server* server_ = nullptr;
  const std::unique_ptr<base::Clock> wall_ = base::make_system_clock();  // for leases
  protocol::FrameDoor* frames_ = nullptr;
  bool arm_first_ = false;  // of the camera's thread: it was busy when it was to get ready
  base::Mailbox<Event> mailbox_;
  std::deque<protocol::Event> recent_;  // for late joiners
  const std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  Counters counters_;
  protocol::Metrics last_statistics_;
  std::string status_told_;  // to the service manager
};

}  // namespace rig::daemon
