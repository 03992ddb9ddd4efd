#include "drivers/v4l2_camera/camera.h"

#include <chrono>
#include <thread>
#include <utility>

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::pass;
using base::Result;
using Steady = std::chrono::steady_clock;

namespace {

constexpr std::chrono::milliseconds kTryEvery{500};
constexpr std::chrono::milliseconds kLookEvery{50};

bool is_same_picture(const CameraCapabilities& a, const CameraCapabilities& b) {
  return a.width == b.width && a.height == b.height && a.bits == b.bits && a.bayer == b.bayer;
}

}  // namespace

V4l2Camera::V4l2Camera(Settings settings, base::Clock& clock, const Log& log)
    : settings_(std::move(settings)),
      clock_(clock),
      log_(log),
      connection_([this] { return open_session(); }, clock, kTryEvery) {}

Result<std::unique_ptr<Session>> V4l2Camera::open_session() {
  auto session = Session::open(settings_, clock_, log_, settling_);
  failed_with_.reset();
  if (!session) failed_with_ = session.error().code;
  if (session && settling_ && !is_same_picture((*session)->capabilities(), capabilities_)) {
    return fail(ErrorCode::lost, "another camera is in its place: its frames are not as they were",
                settings_.called());
  }
  return session;
}

// What is not there may come; anything else has to be mended.
Result<void> V4l2Camera::open_within() {
  const auto until = Steady::now() + settings_.open_within;
  while (true) {
    auto session = connection_.get();
    if (session) {
      settling_ = (*session)->settling();
      capabilities_ = (*session)->capabilities();
      return {};
    }
    const bool is_away = failed_with_ == ErrorCode::lost;
    if (!is_away || Steady::now() >= until) {
      base::Error error = session.error();
      error.code = failed_with_.value_or(ErrorCode::lost);
      return tl::unexpected<base::Error>(std::move(error));
    }
    std::this_thread::sleep_for(kLookEvery);
  }
}

Result<std::unique_ptr<V4l2Camera>> V4l2Camera::open(Settings settings, base::Clock& clock, const Log& log) {
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(std::move(settings), clock, log));
  if (auto opened = camera->open_within(); !opened) return pass(opened);
  return camera;
}

template <typename Use>
auto V4l2Camera::use(Use&& use) -> decltype(use(std::declval<Session&>())) {
  const int opened = connection_.times_opened();
  auto answer = connection_.use(std::forward<Use>(use));
  const bool is_lost = !answer && answer.error().code == ErrorCode::lost;
  if (is_lost && !std::exchange(said_lost_, true)) log_(LogLevel::warning, answer.error().text());
  if (connection_.times_opened() != opened && !is_lost) {
    said_lost_ = false;
    log_(LogLevel::info, settings_.called() + ": it is back");
  }
  return answer;
}

Result<void> V4l2Camera::arm() {
  exposing_.reset();
  return use([](Session& session) { return session.rest(); });
}

Result<void> V4l2Camera::trigger(double exposure_s, double gain) {
  if (exposing_) {
    return fail(ErrorCode::busy, "the camera is exposing, or its frame was not fetched", settings_.called());
  }
  auto done = use([=](Session& session) { return session.expose(exposure_s, gain); });
  if (done) exposing_ = connection_.times_opened();
  return done;
}

Result<std::optional<FrameInfo>> V4l2Camera::fetch(std::span<std::uint16_t> pixels) {
  if (!exposing_) return fail(ErrorCode::device, "no exposure was triggered", settings_.called());
  if (!connection_.is_open() || *exposing_ != connection_.times_opened()) {
    exposing_.reset();
    return fail(ErrorCode::lost, "the camera was away during the exposure", settings_.called());
  }
  auto taken = use([&](Session& session) { return session.take(pixels); });
  if (!taken) {
    if (taken.error().code != ErrorCode::bad_input) exposing_.reset();
    return pass(taken);
  }
  if (!*taken) return std::optional<FrameInfo>();
  exposing_.reset();
  counter_ += (*taken)->advance;
  FrameInfo info = (*taken)->info;
  info.counter = counter_;
  return std::optional<FrameInfo>(info);
}

Result<void> V4l2Camera::abort() {
  exposing_.reset();
  return use([](Session& session) { return session.rest(); });
}

}  // namespace rig::drivers::v4l2
