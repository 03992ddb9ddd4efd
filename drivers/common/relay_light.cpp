#include "drivers/common/relay_light.h"

#include <algorithm>
#include <optional>

namespace rig::drivers {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

std::optional<std::size_t> output_named(const std::vector<Line>& lines, const std::string& name) {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [&](const Line& l) { return l.output && l.name == name; });
  if (found == lines.end()) return std::nullopt;
  return static_cast<std::size_t>(found - lines.begin());
}

class RelayLight final : public Light {
 public:
  RelayLight(RelayLightSettings settings, std::unique_ptr<DigitalIo> lines, std::size_t relay,
             std::optional<std::size_t> shutter, LampRecord lamp)
      : settings_(std::move(settings)),
        lines_(std::move(lines)),
        relay_(relay),
        shutter_(shutter),
        lamp_(std::move(lamp)) {}

  [[nodiscard]] LightCapabilities capabilities() const override {
    return {shutter_.has_value(), false, settings_.warm_up_s};
  }

  [[nodiscard]] Result<void> set_level(double level) override {
    if (level != 0 && level != 1) {
      return fail(ErrorCode::bad_input, fmt::format("a relay cannot set level {}", level), settings_.relay,
                  "0 or 1");
    }
    return lines_->set(settings_.relay, level == 1);
  }

  [[nodiscard]] Result<void> set_shutter(bool open) override {
    if (!shutter_) return fail(ErrorCode::refused, "this light has no shutter", settings_.relay);
    return lines_->set(settings_.shutter, open);
  }

  [[nodiscard]] Result<LightState> state() override {
    const auto levels = lines_->read();
    if (!levels) {
      lamp_.forget();
      return pass(levels);
    }
    if (levels->size() <= std::max(relay_, shutter_.value_or(0))) {
      return fail(ErrorCode::device, fmt::format("a reading of {} lines; more were offered", levels->size()),
                  settings_.relay);
    }
    LightState state;
    state.on = (*levels)[relay_];
    state.shutter_open = !shutter_ || (*levels)[*shutter_];
    state.level = state.on ? 1 : 0;
    lamp_.note(state.on);
    state.warm = state.on && lamp_.lit_for_s() >= settings_.warm_up_s;
    state.hours = lamp_.hours();
    return state;
  }

 private:
  const RelayLightSettings settings_;
  const std::unique_ptr<DigitalIo> lines_;
  const std::size_t relay_;
  const std::optional<std::size_t> shutter_;
  LampRecord lamp_;
};

}  // namespace

RelayLightSettings read_relay_light_settings(const base::ConfigTable& table, const std::vector<Line>& lines) {
  RelayLightSettings light;
  light.relay = table.text("relay");
  light.shutter = table.text_or("shutter", "");
  light.warm_up_s = table.number_or("warm_up_s", 0, {0, 86400});
  const auto check = [&](const char* key, const std::string& name) {
    if (!name.empty() && !output_named(lines, name)) {
      table.error(key, fmt::format("there is no output '{}'", name), "name one of the module's outputs");
    }
  };
  check("relay", light.relay);
  check("shutter", light.shutter);
  if (!light.relay.empty() && light.relay == light.shutter) {
    table.error("shutter", "relay and shutter are the same line");
  }
  return light;
}

Result<std::unique_ptr<Light>> make_relay_light(const RelayLightSettings& settings,
                                                std::unique_ptr<DigitalIo> lines,
                                                const std::filesystem::path& hours_file, base::Clock& clock,
                                                LampRecord::Log log) {
  const auto all = lines->lines();
  const auto relay = output_named(all, settings.relay);
  const auto shutter = output_named(all, settings.shutter);
  if (!relay || (!shutter && !settings.shutter.empty())) {
    return fail(ErrorCode::not_found,
                fmt::format("there is no output '{}'", relay ? settings.shutter : settings.relay), "light");
  }
  auto lamp = LampRecord::open(hours_file, clock, log);
  if (!lamp) return pass(lamp);
  return std::make_unique<RelayLight>(settings, std::move(lines), *relay, shutter, std::move(*lamp));
}

}  // namespace rig::drivers
