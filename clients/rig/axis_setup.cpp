#include "clients/rig/axis_setup.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <vector>

#include "clients/rig/axis_drive.h"
#include "clients/rig/axis_file.h"
#include "clients/rig/dialogue.h"
#include "clients/rig/format.h"
#include "clients/rig/text_difference.h"
#include "core/base/files.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

// Limits are written to a hundredth of a degree, on the safe side of where the axis stood.
constexpr double kLimitGrain_deg = 0.01;
constexpr double kSameLimit_deg = 1e-6;

// What a person sees of a movement in the positive sense (docs/rig-toml.md, Frames).
const std::map<std::string, std::string>& positive_sense() {
  static const std::map<std::string, std::string> kSense{
      {"roll", "the sample turns counter-clockwise, as the camera sees it"},
      {"tilt", "the sample's upper edge comes towards the camera"},
      {"pan", "the sample's face turns to the right, as the camera sees it"},
      {"arm", "the light moves to the right, as the camera sees it"}};
  return kSense;
}

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// "= -85.5" without what stands before the number.
std::string_view without_sign(std::string_view answer) {
  answer.remove_prefix(std::min(answer.find_first_not_of("= "), answer.size()));
  return answer;
}

class AxisSetup {
 public:
  AxisSetup(const Connection& to, const AxisSetupOptions& options, std::string text, AxisFile file)
      : options_(options),
        text_(std::move(text)),
        file_(std::move(file)),
        dialogue_(options.answers),
        drive_(to, file_.axis, file_.tolerance_deg, dialogue_) {}

  Result<void> run() {
    if (auto ok = begin(); !ok) return ok;
    if (ends_here_) return finish();
    for (const auto step :
         {&AxisSetup::direction, &AxisSetup::scale, &AxisSetup::limits, &AxisSetup::homing}) {
      if (auto ok = (this->*step)(); !ok) return ok;
      if (ends_here_) break;
    }
    return finish();
  }

 private:
  Result<void> begin() {
    const auto axis = drive_.look();
    if (!axis) return pass(axis);
    if (drive_.rig_name() != file_.rig || std::abs(axis->min_deg() - file_.min_deg) > kSameLimit_deg ||
        std::abs(axis->max_deg() - file_.max_deg) > kSameLimit_deg) {
      return fail(ErrorCode::bad_input, "rigd runs with another rig.toml, or another version of it",
                  options_.config, "name its file with --config, or start it anew");
    }
    dialogue_.say(fmt::format("Axis {} of '{}': device '{}' of module '{}'", file_.axis, file_.rig,
                              file_.device, file_.module));
    dialogue_.say(fmt::format("  limits     {:g} to {:g} deg", file_.min_deg, file_.max_deg));
    dialogue_.say(fmt::format("  home       {:g} deg", file_.home_deg));
    dialogue_.say("  direction  " + (file_.reversed ? fmt::format("reversed = {}", *file_.reversed)
                                                    : std::string("not set in rig.toml")));
    dialogue_.say("  scale      " + (file_.counts_per_deg
                                         ? fmt::format("counts_per_deg = {:g}", *file_.counts_per_deg)
                                         : std::string("not set in rig.toml")));
    for (std::size_t end = 0; end < machine::kEnds; ++end) {
      if (const auto& line = file_.limit_lines.at(end)) {
        dialogue_.say(fmt::format("  {:9}  limit line '{}', device '{}' of module '{}'",
                                  machine::kEndNames.at(end), line->line, line->device.device,
                                  line->device.module));
      }
    }
    dialogue_.say(fmt::format("  stands at  {:.3f} deg, {}{}", axis->position_deg(),
                              axis->homed() ? "homed" : "not homed", describe_trouble(*axis)));
    // It is replaced, not written into.
    const auto folder = std::filesystem::absolute(options_.config).parent_path();
    if (::access(folder.c_str(), W_OK) != 0)
      dialogue_.say(
          fmt::format("  You may not change {}: what is found can only be shown.", options_.config));
    dialogue_.say(
        "\nIt moves after a yes, never otherwise. Keep the emergency stop at hand; Ctrl-C stops a movement,\n"
        "and leaves rig.toml as it is. An empty answer is the one in capitals.");
    if (!axis->homed()) {
      if (auto ok = direction_before_homing(); !ok || ends_here_) return ok;
    }
    return home_what_needs_it();
  }

  // One that turns the wrong way would look for its home at the wrong end.
  Result<void> direction_before_homing() {
    dialogue_.say(fmt::format(
        "\nDirection, before it is homed. Positive means: {}.\n"
        "  It goes at its reduced speed (jog_velocity_deg_s). rigd does not know where it stands and "
        "keeps no limits\n  and no keep-out zones: look that nothing is in its way.",
        positive_sense().at(file_.axis)));
    const auto yes = dialogue_.agrees(
        fmt::format("  Move it by {:g} deg? (no: the direction is looked at once it is homed)",
                    options_.jog_deg),
        true);
    if (!yes) return pass(yes);
    if (!*yes) return {};
    bool there = false;
    return show_direction([this, there]() mutable -> Result<bool> {
      if (there) {
        auto back = drive_.jog(-options_.jog_deg);
        if (!back || !*back) return back;
      }
      auto moved = drive_.jog(options_.jog_deg);
      there = there || (moved && *moved);
      return moved;
    });
  }

  Result<void> home_what_needs_it() {
    const auto axes = drive_.not_homed();
    if (axes.empty()) return {};
    const auto yes = dialogue_.agrees(fmt::format("\nrigd moves an axis only when all are homed; not yet: "
                                                  "{}. Home all now, in the order of rig.toml?",
                                                  fmt::join(axes, ", ")),
                                      true);
    if (!yes) return pass(yes);
    if (!*yes)
      return fail(ErrorCode::refused, "an axis cannot be set up before the rig is homed", {}, "rig home");
    return drive_.home_all();
  }

  Result<void> direction() {
    if (direction_seen_) return {};
    const auto start = drive_.position();
    if (!start) return pass(start);
    const double from = *start + options_.jog_deg <= file_.max_deg ? *start : *start - options_.jog_deg;
    dialogue_.say(fmt::format("\nDirection. Positive means: {}.", positive_sense().at(file_.axis)));
    if (file_.approach_deg > 0) {
      dialogue_.say(fmt::format("  (On the way down it passes its target by {:g} deg and comes from below.)",
                                file_.approach_deg));
    }
    const auto yes = dialogue_.agrees(
        fmt::format("  Move from {:.3f} to {:.3f} deg?", from, from + options_.jog_deg), true);
    if (!yes) return pass(yes);
    if (!*yes) return {};
    return show_direction([this, from] { return jog_from(from); });
  }

  // `show` moves; false where rigd refused that.
  template <typename Show>
  Result<void> show_direction(Show show) {
    Result<bool> moved = show();
    while (moved && *moved) {
      const auto answer = dialogue_.ask("  Was that the positive sense? [y/n/again/skip]");
      if (!answer) return pass(answer);
      direction_seen_ = *answer == "y";
      if (*answer == "y" || *answer == "skip") return {};
      if (*answer == "n") return turn_direction();
      // Only where it is asked for: a slip of the hand moves nothing.
      if (*answer == "again") moved = show();
    }
    if (!moved) return pass(moved);
    return {};
  }

  // False where rigd refused it.
  Result<bool> jog_from(double angle_deg) {
    for (const double angle : {angle_deg, angle_deg + options_.jog_deg}) {
      const auto now = drive_.go_to(angle);
      if (!now) return pass(now);
      if (!*now) return false;
    }
    return true;
  }

  Result<void> turn_direction() {
    if (file_.reversed) {
      changes_.reversed = !*file_.reversed;
    } else {
      by_hand_.push_back(fmt::format(
          "Turn the direction of {} round where its module, its drive or its wiring sets it: module '{}' has "
          "no key `reversed` in [module.settings.axis.{}].",
          file_.axis, file_.module, file_.device));
    }
    if (file_.limit_lines[machine::kLow] || file_.limit_lines[machine::kHigh]) {
      by_hand_.push_back(fmt::format(
          "The limit lines of {0} change places with the direction: exchange [lines.limit.{0}.low] and "
          "[lines.limit.{0}.high] before the axis moves again.",
          file_.axis));
    }
    return rest_later("The ends and home change places with the direction");
  }

  Result<void> scale() {
    const auto start = drive_.position();
    if (!start) return pass(start);
    const double from = std::min(*start, file_.max_deg - options_.scale_deg);
    dialogue_.say(
        "\nScale. Measure by how much the axis really turns: a protractor, a digital level, marks.");
    if (from < file_.min_deg) {
      dialogue_.say(fmt::format("  Its limits leave no room for {:g} deg; --scale-deg takes less.",
                                options_.scale_deg));
      return {};
    }
    if (from < *start) {
      const auto yes = dialogue_.agrees(fmt::format("  Go to {:.3f} deg, to turn from there?", from), true);
      if (!yes) return pass(yes);
      if (!*yes) return {};
    }
    const auto before = drive_.go_to(from);
    if (!before) return pass(before);
    if (!*before) return {};
    const double to = from + options_.scale_deg;
    const auto yes = dialogue_.agrees(
        fmt::format("  Mark where it stands. Turn from {:.3f} to {:.3f} deg?", **before, to), true);
    if (!yes) return pass(yes);
    if (!*yes) return {};
    const auto after = drive_.go_to(to);
    if (!after) return pass(after);
    if (!*after) return {};
    const double told_deg = **after - **before;
    while (true) {
      const auto answer = dialogue_.ask("  By how many degrees did it turn? [a number; Enter: not measured]");
      if (!answer) return pass(answer);
      if (answer->empty()) return {};
      const auto measured_deg = number_in(*answer);
      if (measured_deg && *measured_deg > 0) return judge_scale(told_deg, *measured_deg);
      dialogue_.say("  a positive number, please");
    }
  }

  Result<void> judge_scale(double told_deg, double measured_deg) {
    const double ratio = told_deg / measured_deg;
    if (std::abs(told_deg - measured_deg) <= file_.tolerance_deg) {
      dialogue_.say("  As rig.toml has it, within tolerance_deg.");
      return {};
    }
    const auto yes = dialogue_.agrees(
        fmt::format(
            "  It reports {:.3f} deg and turned {:.3f}: off by {:.2f} %. Is that more than the measurement's "
            "own error?",
            told_deg, measured_deg, 100 * std::abs(ratio - 1)),
        false);
    if (!yes) return pass(yes);
    if (!*yes) return {};
    if (file_.counts_per_deg) {
      changes_.counts_per_deg = *file_.counts_per_deg * ratio;
    } else {
      by_hand_.push_back(
          fmt::format("Multiply the counts per degree of {} by {:.6g} where its module or drive sets them: "
                      "module '{}' has no key "
                      "`counts_per_deg` in [module.settings.axis.{}].",
                      file_.axis, ratio, file_.module, file_.device));
    }
    return rest_later("The ends and home are told in degrees of the new scale");
  }

  Result<void> rest_later(const std::string& why) {
    dialogue_.say(fmt::format("  {}: start rigd anew with that, home, and run this again.", why));
    ends_here_ = true;
    return {};
  }

  Result<void> limits() {
    dialogue_.say(
        fmt::format("\nLimits. At each end, answer\n"
                    "  Enter     a step of {:g} deg towards it\n"
                    "  NUMBER    a step of so many degrees; negative: back\n"
                    "  here      the limit is where the axis stands\n"
                    "  = ANGLE   the limit is there, also beyond the present one\n"
                    "  keep      the limit stays as it is",
                    options_.step_deg));
    if (auto ok = find_limit("lower", -1, file_.min_deg, changes_.min_deg); !ok) return ok;
    return find_limit("upper", 1, file_.max_deg, changes_.max_deg);
  }

  Result<void> find_limit(const char* name, int sign, double old_deg, std::optional<double>& found_deg) {
    dialogue_.say(fmt::format("  {} end, {:g} deg in rig.toml", name, old_deg));
    while (true) {
      const auto now = drive_.position();
      if (!now) return pass(now);
      const auto answer = dialogue_.ask(fmt::format("  at {:.3f} deg, {}>", *now, name));
      if (!answer) return pass(answer);
      if (*answer == "keep") return {};
      if (*answer == "here") {
        found_deg = inside(*now, sign);
        if (std::abs(*now - old_deg) <= file_.tolerance_deg) found_deg.reset();
        return {};
      }
      if (answer->starts_with('=')) {
        found_deg = number_in(without_sign(*answer));
        if (found_deg) return {};
      }
      const auto step = answer->empty() ? std::optional(options_.step_deg) : number_in(*answer);
      if (!step) {
        dialogue_.say("  Enter, a number, here, = ANGLE or keep, please");
        continue;
      }
      const double to = std::clamp(*now + sign * *step, file_.min_deg, file_.max_deg);
      if (std::abs(to - *now) <= file_.tolerance_deg) {
        dialogue_.say(fmt::format("  rigd goes no further than {:g} deg; `= ANGLE` sets a limit beyond", to));
        continue;
      }
      if (auto moved = drive_.go_to(to); !moved) return pass(moved);
    }
  }

  // On the near side of where it stood, as a number that a person would write.
  static double inside(double at_deg, int sign) {
    const double grains = at_deg / kLimitGrain_deg;
    return (sign > 0 ? std::floor(grains) : std::ceil(grains)) / std::round(1 / kLimitGrain_deg);
  }

  Result<void> homing() {
    dialogue_.say(fmt::format("\nHoming. It should end at home_deg = {:g}.", file_.home_deg));
    const auto yes = dialogue_.agrees(fmt::format("  Home {} and compare?", file_.axis), true);
    if (!yes) return pass(yes);
    if (!*yes) return {};
    dialogue_.say("  homes ...");
    if (auto ok = drive_.home(); !ok) return ok;
    const auto now = drive_.position();
    if (!now) return pass(now);
    const double off = *now - file_.home_deg;
    if (std::abs(off) <= file_.tolerance_deg) {
      dialogue_.say(fmt::format("  stands at {:.3f} deg: as rig.toml has it", *now));
      return {};
    }
    const double rounded = std::round(*now / kLimitGrain_deg) / std::round(1 / kLimitGrain_deg);
    const auto change = dialogue_.agrees(
        fmt::format("  stands at {:.3f} deg, {:.3f} off. Set home_deg = {:g}?", *now, off, rounded), false);
    if (!change) return pass(change);
    if (*change) changes_.home_deg = rounded;
    return {};
  }

  Result<void> finish() {
    dialogue_.say("");
    for (const std::string& text : by_hand_) dialogue_.say("By hand: " + text);
    const auto changed = with_changes(text_, file_, changes_);
    if (!changed) return pass(changed);
    if (*changed == text_) {
      dialogue_.say(fmt::format("{} stays as it is.", options_.config));
      return {};
    }
    dialogue_.say(unified_difference(text_, *changed, options_.config, options_.config + " (new)"));
    if (const auto correct = read_axis_file(*changed, options_.config, file_.axis); !correct) {
      auto error = correct.error();
      error.hint = "so changed the file would be wrong; it stays as it is";
      return tl::unexpected(error);
    }
    const auto yes = dialogue_.agrees(fmt::format("Write that to {}?", options_.config), false);
    if (!yes) return pass(yes);
    if (!*yes) {
      dialogue_.say("Nothing was changed.");
      return {};
    }
    const auto old = replace_keeping_old(options_.config, text_, *changed);
    if (!old) return pass(old);
    dialogue_.say(fmt::format("Written; the old file is {}.\nIt takes effect at the next start of rigd.",
                              old->string()));
    return {};
  }

  const AxisSetupOptions options_;
  const std::string text_;  // of rig.toml
  const AxisFile file_;
  Dialogue dialogue_;
  AxisDrive drive_;
  AxisChanges changes_;
  std::vector<std::string> by_hand_;
  bool ends_here_ = false;
  bool direction_seen_ = false;  // to be right
};

}  // namespace

Result<void> axis_setup(const Connection& to, const AxisSetupOptions& options) {
  for (const double angle : {options.jog_deg, options.scale_deg, options.step_deg}) {
    // Written so that NaN is refused too.
    if (!(angle > 0)) return fail(ErrorCode::bad_input, fmt::format("{} deg is no step", angle));
  }
  auto text = base::read_file(options.config);
  if (!text) return pass(text);
  auto file = read_axis_file(*text, options.config, options.axis);
  if (!file) return pass(file);
  return AxisSetup(to, options, std::move(*text), std::move(*file)).run();
}

}  // namespace rig::client
