// A camera on its bench, as the checks use it.
#pragma once

#include <span>
#include <vector>

#include "drivers/conformance/opened.h"

namespace rig::drivers::conformance {

/// Room for one frame between words that nobody may touch.
class GuardedFrame {
 public:
  explicit GuardedFrame(std::size_t size) : words_(size + 2 * kGuard, kCanary) {}
  [[nodiscard]] std::span<std::uint16_t> pixels() {
    return {words_.data() + kGuard, words_.size() - 2 * kGuard};
  }
  [[nodiscard]] std::span<const std::uint16_t> pixels() const {
    return {words_.data() + kGuard, words_.size() - 2 * kGuard};
  }
  /// How many words outside the frame were written to.
  [[nodiscard]] std::size_t touched() const;

 private:
  static constexpr std::size_t kGuard = 4096;
  static constexpr std::uint16_t kCanary = 0xC3A5;
  std::vector<std::uint16_t> words_;
};

/// Every function fails the check where what it promises does not come true.
class CameraSession {
 public:
  /// The check does not concern a bench without a camera. Opens the module.
  explicit CameraSession(Bench& bench);

  [[nodiscard]] CameraPeer& peer() { return *test_.peer; }
  [[nodiscard]] Wire& wire() { return bench_.wire(); }
  [[nodiscard]] Camera& camera() { return opened_.device(); }
  [[nodiscard]] Waiting& waiting() { return waiting_; }
  [[nodiscard]] base::Clock& clock() { return bench_.clock(); }
  [[nodiscard]] const CameraUnderTest& test() const { return test_; }
  [[nodiscard]] const CameraCapabilities& capabilities() const { return capabilities_; }
  [[nodiscard]] double longest_s() const;
  [[nodiscard]] double shortest_s() const;
  [[nodiscard]] std::size_t size() const;

  void close() { opened_.close(); }
  void open() { opened_.open(); }
  void open_after(End end) { end == End::closed ? opened_.open() : opened_.open_after_kill(waiting_); }
  /// The module ends right after it triggered this.
  void end_while_exposing(End end, double exposure_s);

  /// The calls, each within its bound; the answer is the caller's to judge.
  [[nodiscard]] Result<void> try_arm();
  [[nodiscard]] Result<void> try_trigger(double exposure_s);
  [[nodiscard]] Result<std::optional<FrameInfo>> try_fetch(std::span<std::uint16_t> pixels);
  [[nodiscard]] Result<void> try_abort();

  void arm() { must(try_arm(), "arm"); }
  void trigger(double exposure_s) {
    must(try_trigger(exposure_s), fmt::format("trigger of {} s", exposure_s));
  }
  /// The frame of an exposure that was triggered, in frame(); a fault of the device is answered, no frame in
  /// time is a failure of the check.
  [[nodiscard]] FrameInfo wait_for_frame(double exposure_s);
  /// A whole exposure whose frame proves itself as far as it can.
  FrameInfo take(double exposure_s);
  /// What the last frame says of itself: exposure and gain as asked, a time that can be. Its pixels too,
  /// where they tell.
  void require_own(const FrameInfo& info, double exposure_s, base::Time triggered);
  /// No frame comes for so long as one of this exposure could; errors may.
  std::optional<base::Error> require_none(double exposure_s, std::string_view when);

  [[nodiscard]] GuardedFrame& frame() { return frame_; }
  /// Whether a frame's pixels have told its exposure so far.
  [[nodiscard]] bool pixels_told() const { return pixels_told_; }
  /// The end of a check that needs the pixels' word.
  [[nodiscard]] Outcome proven_by_pixels() const;

 private:
  Bench& bench_;
  const CameraUnderTest test_;
  Waiting waiting_;
  Opened<Camera> opened_;
  CameraCapabilities capabilities_;
  GuardedFrame frame_;
  bool pixels_told_ = false;
};

}  // namespace rig::drivers::conformance
