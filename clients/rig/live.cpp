#include "clients/rig/live.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>
#include <unistd.h>

#include "clients/rig/ask.h"
#include "clients/rig/format.h"
#include "clients/rig/live_view.h"
#include "clients/rig/local_frames.h"
#include "clients/rig/terminal.h"
#include "core/base/interrupt.h"

namespace rig::client {

using base::ErrorCode;
using base::pass;

namespace {

constexpr std::uint32_t kRemoteWidth = 1200;
constexpr double kAnswer_s = 30;  // beyond the exposure
constexpr std::size_t kHistory = 40;
// Nobody turns a ring and waits longer than this for what it does.
constexpr double kLongestAutomatic_us = 5e6;
// What keeps a frame from being taken, like a move from elsewhere, is over soon.
constexpr std::chrono::milliseconds kTryAgain{500};
constexpr std::chrono::milliseconds kLookForInterrupt{50};
// An exposure that is no better after so many frames is not going to be.
constexpr int kMostAdjustments = 12;
// Cameras round to lines of their own.
constexpr double kSameExposure = 1e-3;
// Larger images are searched for tags coarser: a preview is to be quick.
constexpr int kFullSearchWidth = 2000;

Result<std::optional<machine::RigConfig>> machine_at(const std::string& config) {
  // That rigd runs on another machine, or as somebody else, is no mistake; that a file was named which is
  // missing is one.
  if (config == kInstalledRigToml && ::access(config.c_str(), R_OK) != 0) return std::nullopt;
  auto rig = machine::load_rig_config(config);
  if (!rig) return pass(rig);
  return std::move(*rig);
}

std::vector<int> fiducials_of(const machine::RigConfig& rig) {
  std::vector<int> ids;
  ids.reserve(rig.carrier.fiducials.size());
  for (const auto& fiducial : rig.carrier.fiducials) ids.push_back(fiducial.id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

class Live {
 public:
  Live(const Connection& to, const LiveOptions& options, std::optional<machine::RigConfig> rig,
       calibration::TagFinder finder, std::uint32_t preview_width)
      : to_(to),
        options_(options),
        rig_(std::move(rig)),
        finder_(std::move(finder)),
        preview_width_(preview_width),
        exposure_us_(options.exposure_ms * 1e3) {
    view_.automatic = options.automatic;
    if (rig_) view_.expected = fiducials_of(*rig_);
  }

  Result<void> run() {
    if (!options_.once && is_terminal()) screen_ = std::make_unique<WholeTerminal>();
    auto ended = show_frames();
    screen_.reset();
    if (!ended && ended.error().code != ErrorCode::interrupted) return ended;
    if (!options_.save.empty() && last_) {
      if (auto saved = save(); !saved) return saved;
    }
    return ended;
  }

 private:
  [[nodiscard]] FrameContent content() const {
    return preview_width_ == 0 ? FrameContent::raw : FrameContent::preview;
  }

  Result<void> show_frames() {
    for (int adjusted = 0; !base::interrupted();) {
      auto taken = take();
      if (!taken && taken.error().code == ErrorCode::interrupted) break;
      if (!taken) {
        if (!passes_by(taken.error().code)) return taken;
        show_note(taken.error().text());
        continue;
      }
      const bool is_good = adjust();
      if (options_.once && (is_good || ++adjusted > kMostAdjustments)) {
        std::printf("%s", live_figures(view_.frame).c_str());
        return {};
      }
      if (!options_.once) show();
    }
    return base::interrupted_error(last_ ? fmt::format("best focus {:.4g}, last {:.4g} at {:.6g} ms",
                                                       view_.best_focus, view_.frame.focus,
                                                       view_.frame.exposure_us * 1e-3)
                                         : "no frame was taken");
  }

  Result<void> take() {
    protocol::Request look;
    look.mutable_get_status();
    const auto status = ask(to_, look, to_.wait_s);
    if (!status) return pass(status);
    bool from_memory = false;
    auto snapped = snap(from_memory);
    if (!snapped) return pass(snapped);
    auto frame = measure_frame(*snapped, content(), rig_, status->status(), finder_);
    if (!frame) return pass(frame);
    frame->from_memory = from_memory;
    last_ = std::move(*snapped);
    view_.frame = std::move(*frame);
    view_.picture = *last_;
    view_.picture.clear_raw();
    view_.best_focus = std::max(view_.best_focus, view_.frame.focus);
    view_.focus_history.push_back(view_.frame.focus);
    if (view_.focus_history.size() > kHistory) view_.focus_history.pop_front();
    view_.rig = status->status().rig_name();
    view_.light = describe_light(status->status().light());
    view_.note.clear();
    return {};
  }

  Result<protocol::Frame> snap(bool& from_memory) {
    const bool needs_raw = content() == FrameContent::raw || content_to_save() == FrameContent::raw;
    if (needs_raw && local_) {
      auto frame = ask_snap(false);
      if (!frame) return frame;
      from_memory = local_->add_raw(*frame);
      if (from_memory) return frame;
      // Overtaken by other frames; or rigd was started again.
      if (local_->ended()) {
        auto again = LocalFrames::beside(to_.endpoint);
        local_.reset();
        if (again) local_.emplace(std::move(*again));
      }
    }
    return ask_snap(needs_raw);
  }

  Result<protocol::Frame> ask_snap(bool full) {
    protocol::Request request;
    auto& wanted = *request.mutable_snap();
    wanted.set_exposure_us(exposure_us_);
    wanted.set_full(full);
    wanted.set_preview_width(preview_width_);
    auto reply = ask(to_, request, exposure_us_ * 1e-6 + kAnswer_s);
    if (!reply) return pass(reply);
    return std::move(*reply->mutable_frame());
  }

  [[nodiscard]] FrameContent content_to_save() const {
    if (options_.save.empty()) return FrameContent::preview;
    return content_for(options_.save).value_or(FrameContent::preview);
  }

  // The exposure of the next frame; whether this one was exposed as well as it can be.
  bool adjust() {
    if (!options_.automatic) return true;
    double better = better_exposure(view_.frame.exposure_us, view_.frame.exposed.level);
    if (rig_)
      better = std::clamp(better, rig_->camera.min_exposure_s * 1e6, rig_->camera.max_exposure_s * 1e6);
    better = std::min(better, kLongestAutomatic_us);
    const bool is_good = std::abs(better / view_.frame.exposure_us - 1) < kSameExposure;
    exposure_us_ = better;
    return is_good;
  }

  // Only what may be over soon, and only once it has worked: a mistake is told at once.
  [[nodiscard]] bool passes_by(ErrorCode code) const {
    return last_ && !options_.once && (code == ErrorCode::refused || code == ErrorCode::timeout);
  }

  void show() {
    if (screen_) {
      screen_->draw(draw_live(view_, terminal_style()));
    } else {
      std::printf("%s\n", live_line(view_).c_str());
      std::fflush(stdout);
    }
  }

  void show_note(const std::string& note) {
    const std::string before = std::exchange(view_.note, note + "; trying again");
    // An adjusted exposure may be what was refused; the last one was not.
    exposure_us_ = view_.frame.exposure_us;
    if (screen_) {
      show();
    } else if (view_.note != before) {
      std::printf("%s\n", view_.note.c_str());
      std::fflush(stdout);
    }
    const auto until = std::chrono::steady_clock::now() + kTryAgain;
    while (!base::interrupted() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(kLookForInterrupt);
  }

  Result<void> save() {
    if (auto written = write_frame(*last_, content_to_save(), options_.save); !written) return written;
    if (!options_.once) std::printf("%s\n", options_.save.c_str());
    return {};
  }

  const Connection to_;
  const LiveOptions options_;
  const std::optional<machine::RigConfig> rig_;
  calibration::TagFinder finder_;
  const std::uint32_t preview_width_;  // 0: raw
  std::optional<LocalFrames> local_ = LocalFrames::beside(to_.endpoint);
  double exposure_us_;
  std::optional<protocol::Frame> last_;
  LiveView view_;
  std::unique_ptr<WholeTerminal> screen_;
};

}  // namespace

Result<void> live(const Connection& to, const LiveOptions& options) {
  if (!options.save.empty()) {
    if (auto content = content_for(options.save); !content) return pass(content);
  }
  auto rig = machine_at(options.config);
  if (!rig) return pass(rig);
  calibration::TagFinderOptions search;
  // The ids are wanted, not the corners to a hundredth of a pixel.
  search.refine = false;
  if (*rig && (*rig)->camera.intrinsics.width > kFullSearchWidth) search.decimate = 4;
  auto finder = calibration::TagFinder::create(*rig ? (*rig)->carrier.tag_family : "tag36h11", search);
  if (!finder) return pass(finder);
  const std::uint32_t over_network = to.endpoint.starts_with("tcp://") ? kRemoteWidth : 0;
  return Live(to, options, std::move(*rig), std::move(*finder), options.preview_width.value_or(over_network))
      .run();
}

}  // namespace rig::client
