#include "drivers/v4l2_camera/session.h"

#include <algorithm>
#include <utility>

#include "drivers/v4l2_camera/device_error.h"
#include "drivers/v4l2_camera/measure.h"

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::pass;
using base::Result;
using Steady = std::chrono::steady_clock;

namespace {

// rigd waits 10 s for a frame beyond its exposure: all frames until a setting shows must have come by then.
constexpr double kLongestWait_s = 8;
// Between the phase in which the trigger finds the camera and the transfer of the frame.
constexpr int kOwnFrames = 2;
constexpr int kSpareBuffers = 3;
constexpr int kMostBuffers = 32;
// What exposes or is read out when a camera is opened was set by somebody else, and may have begun any time
// ago.
constexpr int kFramesOfOthers = 2;
// A stream that says nothing for so long, and some frames more, has broken down.
constexpr std::chrono::seconds kSilence{3};
constexpr int kSilentFrames = 5;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Steady::now().time_since_epoch()).count();
}

template <typename T>
tl::unexpected<base::Error> pass_named(const Settings& settings, const Result<T>& failed) {
  base::Error error = failed.error();
  if (error.where.empty()) error.where = settings.called();
  return tl::unexpected<base::Error>(std::move(error));
}

int buffers_for(const Settings& settings) {
  if (settings.buffers != 0) return settings.buffers;
  return std::min(kMostBuffers, settings.settle_frames + settings.settle_margin + kSpareBuffers);
}

}  // namespace

Session::Session(const Settings& settings, base::Clock& clock, const Log& log,
                 std::unique_ptr<VideoNode> node, Configured made)
    : settings_(settings),
      clock_(clock),
      node_(std::move(node)),
      made_(std::move(made)),
      sieve_(made_.image_bytes, made_.interval_s),
      losses_(log, settings.called()) {}

Result<std::unique_ptr<Session>> Session::open(const Settings& settings, base::Clock& clock, const Log& log,
                                               const std::optional<Settling>& known) {
  auto node = open_node(settings.device);
  if (!node) return pass_named(settings, node);
  auto made = configure(**node, settings, log);
  if (!made) return pass_named(settings, made);
  std::unique_ptr<Session> session(new Session(settings, clock, log, std::move(*node), std::move(*made)));
  auto stream = Stream::start(*session->node_, settings, session->made_.image_bytes, buffers_for(settings));
  if (!stream) return pass_named(settings, stream);
  session->stream_ = std::move(*stream);
  if (auto done = session->settle_or_state(log, known); !done) return pass_named(settings, done);
  return session;
}

Result<void> Session::settle_or_state(const Log& log, const std::optional<Settling>& known) {
  settling_ = {made_.card, settings_.settle_frames};
  if (known && known->card == made_.card) {
    settling_ = *known;
    return {};
  }
  if (!settings_.measure_settling) return {};
  const auto measured = measure_settling(*node_, *stream_, settings_, made_);
  if (!measured) return pass(measured);
  if (measured->frames) {
    settling_.frames = *measured->frames;
    log(LogLevel::info,
        fmt::format("{}: {} shows a setting after {} frames, measured; {} more are dropped",
                    settings_.called(), made_.card, settling_.frames, settings_.settle_margin));
    return {};
  }
  log(LogLevel::warning,
      fmt::format(
          "{}: after how many frames a setting shows could not be measured: {}; settle_frames says {}",
          settings_.called(), measured->why, settling_.frames));
  return {};
}

double Session::most_exposure_s() const {
  if (!made_.exposure) return made_.max_exposure_s;
  const int frames = settling_.frames + settings_.settle_margin + kOwnFrames;
  return std::max(made_.min_exposure_s, std::min(made_.max_exposure_s, kLongestWait_s / frames));
}

CameraCapabilities Session::capabilities() const {
  CameraCapabilities can;
  can.width = static_cast<int>(made_.layout.width);
  can.height = static_cast<int>(made_.layout.height);
  can.bits = settings_.bits();
  can.bayer = settings_.format.bayer;
  can.min_exposure_s = made_.min_exposure_s;
  can.max_exposure_s = most_exposure_s();
  can.readout_s = (settling_.frames + settings_.settle_margin + kOwnFrames) * made_.interval_s;
  return can;
}

Result<void> Session::check(double exposure_s, double gain) const {
  constexpr double kRounding = 1e-9;
  const double least = made_.min_exposure_s, most = most_exposure_s();
  if (!(exposure_s >= least * (1 - kRounding) && exposure_s <= most * (1 + kRounding))) {
    return fail(ErrorCode::bad_input, made_.exposure
                                          ? fmt::format("it cannot expose for {} us, only for {} to {} us",
                                                        exposure_s * 1e6, least * 1e6, most * 1e6)
                                          : fmt::format("its exposure is fixed: {} us, asked for were {} us",
                                                        least * 1e6, exposure_s * 1e6));
  }
  if (!made_.gain) {
    if (gain == 1) return {};
    return fail(ErrorCode::bad_input, fmt::format("it has no gain but 1, asked for was {}", gain));
  }
  const double value = gain_value(settings_.gain, gain);
  if (value >= made_.gain->min && value <= made_.gain->max) return {};
  return fail(ErrorCode::bad_input, fmt::format("it has no gain {}: its {} takes {} to {}", gain,
                                                made_.gain->name, made_.gain->min, made_.gain->max));
}

// Whether the camera has got another value than before.
Result<bool> Session::write(const Control& control, double value, std::optional<Value>& is) {
  const std::int32_t wanted = control.nearest(value);
  if (is && is->asked == wanted) return false;
  is.reset();
  const auto reads = set_control(*node_, control, wanted);
  if (!reads) return pass(reads);
  is = Value{wanted, *reads};
  return true;
}

Result<void> Session::set(double exposure_s, double gain) {
  bool changed = false;
  exposure_s_ = made_.exposure ? exposure_s_ : exposure_s;
  // Together they are a setting: what is written in part is written anew.
  const auto failed = [&](const Result<bool>& done) {
    exposure_is_.reset();
    gain_is_.reset();
    return pass(done);
  };
  if (made_.exposure) {
    const auto done = write(made_.exposure->control, exposure_s / made_.exposure->unit_s, exposure_is_);
    if (!done) return failed(done);
    changed = *done;
    exposure_s_ = exposure_is_->reads * made_.exposure->unit_s;
  }
  if (made_.gain) {
    const auto done = write(*made_.gain, gain_value(settings_.gain, gain), gain_is_);
    if (!done) return failed(done);
    changed = changed || *done;
    gain_ = gain_factor(settings_.gain, gain_is_->reads);
  }
  if (!changed) return {};
  const int others = std::exchange(was_set_, true) ? 0 : kFramesOfOthers;
  sieve_.set(now_ns(), exposure_s_, settling_.frames + settings_.settle_margin + others);
  return {};
}

// So that the camera has room for frames again, and none of them is looked at later.
Result<void> Session::drop_what_came() {
  for (std::size_t i = 0; i < 2 * stream_->buffers(); ++i) {
    auto filled = stream_->take();
    if (!filled) return pass(filled);
    if (!*filled) return {};
    (void)sieve_.look((*filled)->facts);
    was_full_ = was_full_ || i + 1 >= stream_->buffers();
    if (auto done = stream_->give_back((*filled)->index); !done) return done;
  }
  return {};
}

Result<void> Session::expose(double exposure_s, double gain) {
  if (auto fine = check(exposure_s, gain); !fine) return pass_named(settings_, fine);
  if (auto done = drop_what_came(); !done) return pass_named(settings_, done);
  if (auto done = set(exposure_s, gain); !done) return pass_named(settings_, done);
  sieve_.trigger(now_ns());
  heard_at_ = Steady::now();
  exposing_ = true;
  return {};
}

// What its stamp says, by our clock.
base::Time Session::started(const FrameFacts& facts) const {
  const auto exposure_ns = static_cast<std::int64_t>(exposure_s_ * 1e9);
  const std::int64_t began_ns = facts.stamp_ns - (facts.stamp_is_start ? 0 : exposure_ns);
  return clock_.now() - std::chrono::nanoseconds(std::max<std::int64_t>(0, now_ns() - began_ns));
}

Result<Taken> Session::unpack_frame(const Filled& filled, std::span<std::uint16_t> pixels) {
  auto done = unpack(settings_.format.packing, settings_.shift_right, made_.layout, filled.bytes, pixels);
  if (!done) return fail(ErrorCode::damaged, "the frame is damaged: " + done.error().what);
  Taken taken;
  taken.info.exposure_s = exposure_s_;
  taken.info.gain = gain_;
  taken.info.started = started(filled.facts);
  if (last_sequence_) taken.advance = std::max(1U, filled.facts.sequence - *last_sequence_);
  last_sequence_ = filled.facts.sequence;
  return taken;
}

Result<std::optional<Taken>> Session::nothing_yet() {
  const auto frames = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(kSilentFrames * (exposure_s_ + made_.interval_s)));
  if (Steady::now() < heard_at_ + kSilence + frames) return std::optional<Taken>();
  exposing_ = false;
  return fail(ErrorCode::lost, "it sends no frames", settings_.called());
}

Result<std::optional<Taken>> Session::take(std::span<std::uint16_t> pixels) {
  if (!exposing_) return fail(ErrorCode::device, "no exposure was triggered", settings_.called());
  if (pixels.size() != made_.layout.width * made_.layout.height) {
    return fail(ErrorCode::bad_input, "the buffer has not the size of a frame", settings_.called());
  }
  // All that waits, and no more: a camera may be quicker than this loop.
  for (std::size_t i = 0; i < stream_->buffers(); ++i) {
    auto filled = stream_->take();
    if (!filled) return pass_named(settings_, filled);
    if (!*filled) return nothing_yet();
    heard_at_ = Steady::now();
    const Judgement judgement = sieve_.look((*filled)->facts);
    losses_.note(judgement, std::exchange(was_full_, i + 1 == stream_->buffers()));
    Result<std::optional<Taken>> answer;
    if (judgement.verdict == Verdict::good) {
      const auto taken = unpack_frame(**filled, pixels);
      if (taken) answer = *taken;
      if (!taken) answer = pass_named(settings_, taken);
      exposing_ = false;
    } else if (judgement.verdict == Verdict::bad) {
      answer = fail(ErrorCode::device, judgement.why, settings_.called());
      exposing_ = false;
    }
    if (auto done = stream_->give_back((*filled)->index); !done) return pass_named(settings_, done);
    if (!exposing_) return answer;
  }
  return std::optional<Taken>();
}

Result<void> Session::rest() {
  exposing_ = false;
  v4l2_capability said{};
  if (const int error = node_->request(VIDIOC_QUERYCAP, &said); error != 0) {
    return pass_named(settings_, Result<void>(failed_to("to answer", error)));
  }
  if (auto done = drop_what_came(); !done) return pass_named(settings_, done);
  return {};
}

}  // namespace rig::drivers::v4l2
