#include "drivers/aravis_camera/session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "drivers/aravis_camera/buffer_facts.h"
#include "drivers/aravis_camera/finder.h"

namespace rig::drivers::aravis {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::pass;
using base::Result;
using std::chrono::milliseconds;

namespace {

// Beyond exposure and readout: what a camera may take to notice that it is to stop.
constexpr milliseconds kAfterStop{150};
// For an exposure that another process began; beyond that a trigger says how long it goes on.
constexpr std::chrono::seconds kOpeningWaits{5};
// Between the end of one frame and readiness for the next trigger: a frame's readout at most.
constexpr milliseconds kReadyWithin{500};
// Aravis asks each second, and again for 5 s; a single answer takes up to 2.5 s not to come. What still says
// after this that it controls the camera has an answer, and nothing to tell.
constexpr std::chrono::seconds kHeartbeatEnds{10};
// How far the camera's own time of a frame may be before the trigger that began it, beside the error of its
// clock: what a camera stamps is not quite the beginning.
constexpr base::Duration kClockError = milliseconds(50);

// GigE Vision's register of who controls the camera: exclusively, or so that others may read.
constexpr guint64 kControlPrivilege = 0x0a00;
constexpr guint32 kControls = 0x3;

struct OnLost {
  std::shared_ptr<std::atomic<bool>> lost;
  std::function<void()> tell;
};

void control_lost(ArvDevice* /*device*/, gpointer data) {
  const auto* handler = static_cast<OnLost*>(data);
  *handler->lost = true;
  handler->tell();
}

void forget(gpointer data, GClosure* /*closure*/) {
  delete static_cast<OnLost*>(data);
}

base::Error named(const Settings& settings, base::Error error) {
  if (error.where.empty()) error.where = settings.called();
  return error;
}

template <typename T>
tl::unexpected<base::Error> pass_named(const Settings& settings, const Result<T>& failed) {
  return tl::unexpected<base::Error>(named(settings, failed.error()));
}

// Aravis' heartbeat holds the device while it tells that control is lost. If that were the last hold, its
// thread would wait for its own end, and GLib would end this process. It says that it has told.
void await_end_of_heartbeat(ArvDevice* device) {
  if (!ARV_IS_GV_DEVICE(device)) return;
  const auto until = std::chrono::steady_clock::now() + kHeartbeatEnds;
  while (arv_gv_device_is_controller(ARV_GV_DEVICE(device)) != FALSE &&
         std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(milliseconds(10));
  }
}

std::uint64_t distance(std::uint64_t last, std::uint64_t id) {
  if (follows(last, id) || id <= last) return 1;
  return id - last;
}

}  // namespace

Session::Session(const Settings& settings, base::Clock& clock, Log log, Owned<ArvCamera> camera,
                 Configured made)
    : settings_(settings),
      clock_(clock),
      log_(std::move(log)),
      camera_(std::move(camera)),
      made_(std::move(made)),
      camera_clock_(arv_camera_get_device(camera_.get()), clock),
      by_line_(!settings.trigger_line.empty()) {}

Result<std::unique_ptr<Session>> Session::open(const Settings& settings, base::Clock& clock, const Log& log,
                                               std::function<void()> on_lost) {
  auto camera = find_camera(settings);
  if (!camera) return pass(camera);
  auto made = configure(camera->get(), settings);
  if (!made) {
    if (made.error().code == ErrorCode::lost) await_end_of_heartbeat(arv_camera_get_device(camera->get()));
    return pass_named(settings, made);
  }
  std::unique_ptr<Session> session(new Session(settings, clock, log, std::move(*camera), std::move(*made)));
  ArvDevice* device = arv_camera_get_device(session->camera_.get());
  session->handler_ = g_signal_connect_data(device, "control-lost", G_CALLBACK(control_lost),
                                            new OnLost{session->lost_, std::move(on_lost)}, forget,
                                            static_cast<GConnectFlags>(0));
  if (session->made_.has_chunks)
    session->chunks_.reset(arv_camera_create_chunk_parser(session->camera_.get()));
  session->stream_.emplace(session->camera_.get(), settings, session->made_.payload_bytes);
  auto done = session->end_what_another_began();
  if (done) done = session->camera_clock_.latch();
  if (!done) {
    if (done.error().code == ErrorCode::lost) session->give_up();
    return pass_named(settings, done);
  }
  const int granted = session->stream_->socket_buffer_bytes();
  if (granted != 0 && granted < settings.socket_buffer_bytes) {
    log(LogLevel::warning,
        fmt::format("{}: the kernel gives its stream a socket buffer of {} KiB, asked for were {}; raise "
                    "net.core.rmem_max, or frames may be damaged",
                    settings.called(), granted / 1024, settings.socket_buffer_bytes / 1024));
  }
  return session;
}

Session::~Session() {
  ArvDevice* device = arv_camera_get_device(camera_.get());
  // Without a camera at the other end this would only be a time-out more.
  if (!is_lost()) arv_camera_stop_acquisition(camera_.get(), nullptr);
  tell_resent();
  stream_.reset();
  if (handler_ != 0) g_signal_handler_disconnect(device, handler_);
  if (is_lost()) await_end_of_heartbeat(device);
}

Result<void> Session::cut_short() {
  // A camera that is told to stop exposes to the end, and sends the frame to wherever frames then go; one
  // that had not begun yet may begin when it is started again.
  if (made_.can_abort) {
    auto done =
        attempt("to end its exposure", [&](GError** e) { arv_camera_abort_acquisition(camera_.get(), e); });
    if (!done) return done;
  }
  auto done = restart();
  const double rest_s = made_.capabilities.readout_s + (made_.can_abort ? 0 : exposure_s_);
  old_until_ = std::chrono::steady_clock::now() + kAfterStop +
               std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(rest_s));
  return done;
}

// A process that died, or we ourselves before the wire was cut, may have left it exposing.
Result<void> Session::end_what_another_began() {
  const auto set_us = ask_number("to tell its exposure",
                                 [&](GError** e) { return arv_camera_get_exposure_time(camera_.get(), e); });
  if (!set_us) return pass(set_us);
  exposure_s_ = *set_us * 1e-6;
  auto done = cut_short();
  // What a trigger would not wait for.
  const auto now = std::chrono::steady_clock::now();
  if (done) std::this_thread::sleep_until(std::min(*old_until_ - settings_.answer / 2, now + kOpeningWaits));
  return done;
}

Result<void> Session::outlast_old_exposure() {
  if (!old_until_) return {};
  const auto left = *old_until_ - std::chrono::steady_clock::now();
  if (left > settings_.answer / 2) {
    return fail(ErrorCode::busy, fmt::format("the exposure that was ended goes on in it for {} ms",
                                             std::chrono::duration_cast<milliseconds>(left).count()));
  }
  std::this_thread::sleep_until(*old_until_);
  while (ArvBuffer* buffer = stream_->pop()) stream_->give_back(buffer);
  last_id_.reset();
  old_until_.reset();
  return {};
}

Result<void> Session::restart() {
  exposing_ = false;
  suspect_ = true;
  last_id_.reset();
  auto done =
      attempt("to stop taking frames", [&](GError** e) { arv_camera_stop_acquisition(camera_.get(), e); });
  if (!done) return done;
  stream_->close();
  if (done = stream_->open(); !done) return done;
  done =
      attempt("to start taking frames", [&](GError** e) { arv_camera_start_acquisition(camera_.get(), e); });
  if (done) suspect_ = false;
  return done;
}

Result<void> Session::listen_to(bool line) {
  if (line == by_line_) return {};
  const char* source = line ? settings_.trigger_line.c_str() : "Software";
  // Many cameras lock the source while they take frames.
  auto done = attempt(fmt::format("to set its trigger to {}", source), [&](GError** e) {
    arv_camera_stop_acquisition(camera_.get(), e);
    if (*e == nullptr) arv_camera_set_trigger_source(camera_.get(), source, e);
  });
  if (!done) return done;
  by_line_ = line;
  return restart();
}

Result<void> Session::set_exposure(double exposure_s) {
  if (asked_s_ == exposure_s) return {};
  asked_s_.reset();
  const auto did = ask_number("to set its exposure", [&](GError** e) {
    arv_camera_set_exposure_time(camera_.get(), exposure_s * 1e6, e);
    return *e == nullptr ? arv_camera_get_exposure_time(camera_.get(), e) : 0;
  });
  if (!did) return pass(did);
  exposure_s_ = *did * 1e-6;
  asked_s_ = exposure_s;
  return {};
}

double Session::feature_for(double gain) const {
  const double value = gain_value(settings_.gain, gain);
  return made_.whole_gains ? std::round(value) : value;
}

Result<void> Session::set_gain(double gain) {
  if (asked_gain_ == gain || !made_.has_gain) return {};
  asked_gain_.reset();
  const auto did = ask_number("to set its gain", [&](GError** e) {
    arv_camera_set_gain(camera_.get(), feature_for(gain), e);
    return *e == nullptr ? arv_camera_get_gain(camera_.get(), e) : 0;
  });
  if (!did) return pass(did);
  gain_ = gain_factor(settings_.gain, *did);
  asked_gain_ = gain;
  return {};
}

// A triggered camera takes as many frames as it is triggered, and each was taken off the stream.
Result<void> Session::drop_what_came() {
  bool unasked = false;
  while (ArvBuffer* buffer = stream_->pop()) {
    unasked = unasked || arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    stream_->give_back(buffer);
  }
  // Before the first frame since it began anew there is none that it could have been mistaken for.
  if (!unasked || made_.runs_free || !settings_.count_frames || !last_id_) return {};
  suspect_ = true;
  return fail(ErrorCode::device,
              "it took a frame that nobody asked for: the one before may be another exposure's", {},
              by_line_ ? "does its trigger line bounce?" : "");
}

void Session::tell_resent() {
  const std::uint64_t resent = stream_->resent_packets();
  if (resent == told_resent_) return;
  log_(LogLevel::info,
       fmt::format("{}: {} packets were lost on their way, and came when they were asked for again",
                   settings_.called(), resent - told_resent_));
  told_resent_ = resent;
}

Result<void> Session::wait_until_ready() {
  if (!made_.tells_readiness) return {};
  const auto until = std::chrono::steady_clock::now() + kReadyWithin;
  while (true) {
    const auto ready = ask_number("to ask whether it is ready", [&](GError** e) {
      return arv_camera_get_boolean(camera_.get(), "AcquisitionStatus", e) != FALSE ? 1 : 0;
    });
    if (!ready) return pass(ready);
    if (*ready != 0) return {};
    if (std::chrono::steady_clock::now() >= until) {
      return fail(ErrorCode::busy, "it does not get ready for a trigger");
    }
    std::this_thread::sleep_for(milliseconds(1));
  }
}

Result<void> Session::expose(double exposure_s, double gain, bool by_line) {
  const CameraCapabilities& can = made_.capabilities;
  constexpr double kRounding = 1e-9;
  if (!(exposure_s >= can.min_exposure_s * (1 - kRounding) &&
        exposure_s <= can.max_exposure_s * (1 + kRounding))) {
    return fail(ErrorCode::bad_input,
                fmt::format("it cannot expose for {} us, only for {} to {} us", exposure_s * 1e6,
                            can.min_exposure_s * 1e6, can.max_exposure_s * 1e6),
                settings_.called());
  }
  const double value = feature_for(gain);
  if (made_.has_gain ? !(value >= made_.min_gain && value <= made_.max_gain) : gain != 1) {
    return fail(ErrorCode::bad_input,
                made_.has_gain ? fmt::format("it has no gain {}: its feature takes {} to {}", gain,
                                             made_.min_gain, made_.max_gain)
                               : fmt::format("it has no gain but 1, asked for was {}", gain),
                settings_.called());
  }
  if (by_line && settings_.trigger_line.empty()) {
    return fail(ErrorCode::refused, "its trigger input is not set up", settings_.called(),
                "trigger_line names it");
  }
  if (auto done = listen_to(by_line); !done) return pass_named(settings_, done);
  if (exposing_) {
    if (auto done = cut_short(); !done) return pass_named(settings_, done);
  }
  if (suspect_) {
    if (auto done = restart(); !done) return pass_named(settings_, done);
  }
  if (auto done = outlast_old_exposure(); !done) return pass_named(settings_, done);
  if (auto done = set_exposure(exposure_s); !done) return pass_named(settings_, done);
  if (auto done = set_gain(gain); !done) return pass_named(settings_, done);
  if (auto done = wait_until_ready(); !done) return pass_named(settings_, done);
  if (auto done = drop_what_came(); !done) return pass_named(settings_, done);
  triggered_ = clock_.now();
  triggered_ns_ = g_get_real_time() * 1000;
  if (!by_line) {
    auto done = attempt("to trigger it", [&](GError** e) { arv_camera_software_trigger(camera_.get(), e); });
    if (!done) return pass_named(settings_, done);
  }
  exposing_ = true;
  return {};
}

Expected Session::expected() const {
  const CameraCapabilities& can = made_.capabilities;
  Expected wanted;
  wanted.format = settings_.format.code;
  wanted.offset_x = made_.offset_x;
  wanted.offset_y = made_.offset_y;
  wanted.width = can.width;
  wanted.height = can.height;
  wanted.image_bytes = bytes_of(settings_.format.packing,
                                static_cast<std::size_t>(can.width) * static_cast<std::size_t>(can.height));
  wanted.payload_bytes = made_.payload_bytes;
  wanted.exposure_s = exposure_s_;
  if (settings_.count_frames && !made_.runs_free) wanted.last_id = last_id_;
  if (made_.runs_free) wanted.not_before_ns = triggered_ns_;
  wanted.clock_error_s = base::to_seconds(kClockError + camera_clock_.error());
  return wanted;
}

std::optional<base::Time> Session::told_start(ArvBuffer* buffer) const {
  std::uint64_t stamp_ns = arv_buffer_get_timestamp(buffer);
  if (chunks_) {
    Failed failed;
    const gint64 counts =
        arv_chunk_parser_get_integer_value(chunks_.get(), buffer, "ChunkTimestamp", failed.slot());
    if (!failed) stamp_ns = camera_clock_.nanoseconds(static_cast<std::uint64_t>(counts));
  }
  return camera_clock_.time_of(stamp_ns);
}

// The camera's own time, where that can be; else as near as this side can tell.
base::Time Session::started(ArvBuffer* buffer) const {
  const base::Time now = clock_.now();
  const auto told = told_start(buffer);
  if (told && *told >= triggered_ - kClockError && *told <= now) return *told;
  if (!by_line_) return triggered_;
  const auto age = std::chrono::nanoseconds(g_get_real_time() * 1000 -
                                            static_cast<gint64>(arv_buffer_get_system_timestamp(buffer)));
  return std::max(triggered_, now - age - base::seconds(exposure_s_));
}

Result<std::optional<Taken>> Session::refuse(ErrorCode code, const std::string& why) {
  exposing_ = false;
  suspect_ = true;
  last_id_.reset();
  return fail(code, why, settings_.called());
}

Result<std::optional<Taken>> Session::take(std::span<std::uint16_t> pixels) {
  const CameraCapabilities& can = made_.capabilities;
  if (!exposing_) return fail(ErrorCode::device, "no exposure was triggered", settings_.called());
  if (pixels.size() != static_cast<std::size_t>(can.width) * static_cast<std::size_t>(can.height)) {
    return fail(ErrorCode::bad_input, "the buffer has not the size of a frame", settings_.called());
  }
  while (ArvBuffer* buffer = stream_->pop()) {
    BufferFacts facts = facts_of(buffer, chunks_.get());
    if (const auto told = facts.is_image && facts.damage.empty() ? told_start(buffer) : std::nullopt)
      facts.before_trigger_s = base::to_seconds(triggered_ - *told);
    const Judgement judgement = judge(expected(), facts);
    if (judgement.verdict == Verdict::old) {
      stream_->give_back(buffer);
      continue;
    }
    if (judgement.verdict != Verdict::good) {
      stream_->give_back(buffer);
      return refuse(judgement.verdict == Verdict::spoilt ? ErrorCode::damaged : ErrorCode::device,
                    judgement.why);
    }
    std::size_t bytes = 0;
    const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &bytes));
    const auto unpacked = unpack(settings_.format.packing, settings_.shift_right, {data, bytes}, pixels);
    Taken taken;
    taken.info = {facts.exposure_s.value_or(exposure_s_), gain_, started(buffer), facts.frame_id};
    stream_->give_back(buffer);
    if (!unpacked) return refuse(ErrorCode::damaged, unpacked.error().what);
    if (last_id_) taken.advance = distance(*last_id_, facts.frame_id);
    last_id_ = facts.frame_id;
    exposing_ = false;
    return std::optional<Taken>(taken);
  }
  return std::optional<Taken>();
}

Result<void> Session::arm() {
  tell_resent();
  if (auto there = answer(); !there) return there;
  if (exposing_) {
    if (auto done = cut_short(); !done) return pass_named(settings_, done);
  }
  if (auto done = drop_what_came(); !done) return pass_named(settings_, done);
  if (auto done = camera_clock_.latch(); !done) return pass_named(settings_, done);
  return {};
}

Result<void> Session::abort() {
  if (auto there = answer(); !there || !exposing_) return there;
  if (auto done = cut_short(); !done) return pass_named(settings_, done);
  return {};
}

// One that was without power between two heartbeats answers, and knows nothing of us.
Result<void> Session::answer() {
  ArvDevice* device = arv_camera_get_device(camera_.get());
  if (ARV_IS_GV_DEVICE(device)) {
    guint32 privilege = 0;
    auto asked = attempt(
        "to answer", [&](GError** e) { arv_device_read_register(device, kControlPrivilege, &privilege, e); });
    if (!asked) return pass_named(settings_, asked);
    if ((privilege & kControls) != 0) return {};
    return fail(ErrorCode::lost, "it was without power, or gave its control away", settings_.called());
  }
  const auto asked = ask_number("to answer", [&](GError** e) {
    return static_cast<double>(arv_camera_get_integer(camera_.get(), "Width", e));
  });
  if (!asked) return pass_named(settings_, asked);
  return {};
}

Result<std::optional<double>> Session::temperature_c() {
  if (made_.temperature.empty()) return std::optional<double>();
  const auto read = ask_number("to tell its temperature", [&](GError** e) {
    return arv_camera_get_float(camera_.get(), made_.temperature.c_str(), e);
  });
  if (!read) return pass_named(settings_, read);
  return std::optional<double>(*read);
}

}  // namespace rig::drivers::aravis
