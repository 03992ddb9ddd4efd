#include "drivers/dmx_light/dmx_light.h"

#include "drivers/common/connection.h"
#include "drivers/common/lamp_record.h"
#include "drivers/dmx_light/packet.h"
#include "drivers/dmx_light/widget.h"

namespace rig::drivers::dmx_light {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

constexpr base::Duration kPutOutEvery = base::seconds(1);
constexpr const char* kHoursFile = "light.hours";
constexpr int kSniffer = 3;  // firmware that only listens

// The widget while it is open, and what it puts out.
class Output {
 public:
  Output(const DmxSettings& settings, base::Clock& clock, std::unique_ptr<Widget> widget)
      : settings_(settings), clock_(clock), widget_(std::move(widget)), level_(settings.at_start_level) {}
  // Also tried where the widget seems to be lost: it may only have been slow.
  ~Output() { (void)widget_->put_out_once(make_packet(settings_, settings_.at_exit_level, false)); }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// All that follows belongs to a call that has to be over by then.
  void begin_call(Deadline ends) { widget_->begin_call(ends); }

  [[nodiscard]] double level() const { return nearest_level(settings_, level_); }
  [[nodiscard]] bool shutter_open() const { return shutter_open_; }

  [[nodiscard]] Result<void> put_out(double level, bool shutter_open) {
    level_ = level;
    shutter_open_ = shutter_open;
    taken_ = false;
    if (auto ok = widget_->put_out(make_packet(settings_, level, shutter_open)); !ok) return ok;
    taken_ = true;
    put_out_at_ = clock_.now();
    return {};
  }

  /// That the widget is there and has what it is to put out; it is given it again once a second.
  [[nodiscard]] Result<void> look() {
    if (!taken_ || clock_.now() - put_out_at_ >= kPutOutEvery) return put_out(level_, shutter_open_);
    return widget_->parameters().map([](const Parameters&) {});
  }

 private:
  const DmxSettings& settings_;
  base::Clock& clock_;
  const std::unique_ptr<Widget> widget_;
  double level_;
  bool shutter_open_ = false;
  bool taken_ = false;
  base::Time put_out_at_{};
};

class DmxLight final : public Light {
 public:
  DmxLight(const DmxSettings& settings, const OpenContext& context, LampRecord lamp)
      : settings_(settings),
        serial_(settings.serial),
        clock_(context.clock),
        log_(context.log),
        lamp_(std::move(lamp)),
        output_([this] { return open(); }, context.clock) {}

  [[nodiscard]] Result<void> open_first() {
    // No call of rigd's: nobody waits so long as to give up.
    call_ends_ = Deadline::max();
    return output_.use([](Output&) { return Result<void>(); });
  }

  [[nodiscard]] LightCapabilities capabilities() const override {
    return {settings_.shutter.has_value(), true, settings_.warm_up_s};
  }

  [[nodiscard]] Result<void> set_level(double level) override {
    if (!(level >= 0 && level <= 1)) {
      return fail(ErrorCode::bad_input, fmt::format("{} is no level", level), settings_.line.path, "0 to 1");
    }
    return use([&](Output& output) { return output.put_out(level, output.shutter_open()); });
  }

  [[nodiscard]] Result<void> set_shutter(bool open) override {
    if (!settings_.shutter) {
      return fail(ErrorCode::refused, "this light has no shutter", settings_.line.path);
    }
    return use([&](Output& output) { return output.put_out(output.level(), open); });
  }

  [[nodiscard]] Result<LightState> state() override {
    return use([&](Output& output) -> Result<LightState> {
      if (auto ok = output.look(); !ok) return pass(ok);
      LightState state;
      state.level = output.level();
      state.on = state.level > 0;
      state.shutter_open = !settings_.shutter || output.shutter_open();
      lamp_.note(state.on);
      state.warm = state.on && lamp_.lit_for_s() >= settings_.warm_up_s;
      state.hours = lamp_.hours();
      return state;
    });
  }

 private:
  /// `what` with the open widget, as a call of rigd's.
  template <typename What>
  [[nodiscard]] auto use(What&& what) -> decltype(what(std::declval<Output&>())) {
    call_ends_ = settings_.retry.call_ends();
    auto result = output_.use([&](Output& output) {
      output.begin_call(call_ends_);
      return what(output);
    });
    if (!result && result.error().code == ErrorCode::lost) lamp_.forget();
    return result;
  }

  [[nodiscard]] Result<void> check_identity(Widget& widget) {
    const auto serial = widget.serial();
    if (!serial) return pass(serial);
    if (!serial_.empty() && *serial != serial_) {
      return fail(ErrorCode::bad_input, fmt::format("this is widget {}, not {}", *serial, serial_),
                  settings_.line.path, "plug in the right one, or change `serial`");
    }
    const auto parameters = widget.parameters();
    if (!parameters) return pass(parameters);
    if (parameters->firmware_major == kSniffer) {
      return fail(ErrorCode::bad_input, fmt::format("widget {} has the firmware that only listens", *serial),
                  settings_.line.path, "give it that for DMX or RDM");
    }
    std::string called = *serial;
    if (settings_.ask_names && output_.times_opened() == 0) {
      for (const Label which : {Label::manufacturer, Label::device}) {
        if (const auto name = widget.name(which)) called += fmt::format(", '{}'", *name);
      }
    }
    log_(base::LogLevel::info,
         fmt::format("{}: DMX widget {}, firmware {}.{}, {} packets/s", settings_.line.path, called,
                     parameters->firmware_major, parameters->firmware_minor, parameters->packets_per_s));
    serial_ = *serial;
    return {};
  }

  [[nodiscard]] Result<std::unique_ptr<Output>> open() {
    auto widget = Widget::open(settings_.line, settings_.retry);
    if (!widget) return pass(widget);
    (*widget)->begin_call(call_ends_);
    if (auto ok = check_identity(**widget); !ok) return pass(ok);
    auto output = std::make_unique<Output>(settings_, clock_, std::move(*widget));
    if (auto ok = output->put_out(settings_.at_start_level, false); !ok) return pass(ok);
    return output;
  }

  const DmxSettings settings_;
  std::string serial_;  // once known, the only one that is taken for this light
  base::Clock& clock_;
  void (*const log_)(base::LogLevel, std::string_view);
  LampRecord lamp_;
  Deadline call_ends_ = Deadline::max();
  Connection<Output> output_;
};

}  // namespace

Result<std::unique_ptr<Light>> make_dmx_light(const DmxSettings& settings, const OpenContext& context) {
  auto lamp = LampRecord::open(context.state_folder / kHoursFile, context.clock, context.log);
  if (!lamp) return pass(lamp);
  auto light = std::make_unique<DmxLight>(settings, context, std::move(*lamp));
  if (auto ok = light->open_first(); !ok) return pass(ok);
  return light;
}

}  // namespace rig::drivers::dmx_light
