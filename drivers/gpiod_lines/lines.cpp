#include "drivers/gpiod_lines/lines.h"

#include <algorithm>
#include <string_view>

#include "drivers/common/connection.h"
#include "drivers/gpiod_lines/input_filter.h"
#include "drivers/gpiod_lines/now.h"
#include "drivers/gpiod_lines/polling_chip.h"

namespace rig::drivers::gpiod_lines {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

// The chip while it is open, with what was seen of its inputs since then.
class OpenLines {
 public:
  OpenLines(const LinesSettings& settings, std::unique_ptr<LineChip> chip)
      : settings_(settings), chip_(std::move(chip)) {
    for (const LineSettings& line : settings_.lines) filters_.emplace_back(line.debounce_ns);
  }
  // Also tried where the chip seems to be lost: it may only have failed once.
  ~OpenLines() {
    for (std::size_t i = 0; i < settings_.lines.size(); ++i) {
      const LineSettings& line = settings_.lines[i];
      if (line.request.output && line.at_exit != Rest::keep) {
        (void)chip_->set(i, line.at_exit == Rest::active);
      }
    }
  }
  OpenLines(const OpenLines&) = delete;
  OpenLines& operator=(const OpenLines&) = delete;

  [[nodiscard]] LineChip& chip() { return *chip_; }

  /// Of an input: whether it was active since the last look.
  [[nodiscard]] Result<bool> look(std::size_t line) {
    auto edges = chip_->edges(line);
    if (!edges) return pass(edges);
    // A level is of use only if no change came between it and the changes.
    constexpr int kTries = 3;
    for (int i = 1;; ++i) {
      const auto level = chip_->level(line);
      if (!level) return pass(level);
      const std::int64_t at_ns = now_ns();
      const auto later = chip_->edges(line);
      if (!later) return pass(later);
      edges->insert(edges->end(), later->begin(), later->end());
      if (later->empty() || i == kTries) return filters_[line].look(*edges, *level, at_ns);
    }
  }

 private:
  const LinesSettings& settings_;
  const std::unique_ptr<LineChip> chip_;
  std::vector<InputFilter> filters_;
};

}  // namespace

class Lines {
 public:
  Lines(const LinesSettings& settings, base::Clock& clock, void (*log)(base::LogLevel, std::string_view))
      : settings_(settings), clock_(clock), log_(log), connection_([this] { return open(); }, clock) {
    for (const LineSettings& line : settings_.lines) requests_.push_back(line.request);
  }

  [[nodiscard]] Result<void> open_first() {
    return connection_.use([](OpenLines&) { return Result<void>(); });
  }

  [[nodiscard]] const LinesSettings& settings() const { return settings_; }
  /// Grows whenever the chip was opened again.
  [[nodiscard]] int generation() const { return connection_.times_opened(); }

  /// Looks at every line: the inputs that were active are added to `latched` of every reader, and `levels`
  /// gets the outputs'.
  [[nodiscard]] Result<std::vector<bool>> look() {
    return connection_.use([&](OpenLines& open) -> Result<std::vector<bool>> {
      std::vector<bool> levels(settings_.lines.size());
      for (std::size_t i = 0; i < settings_.lines.size(); ++i) {
        const bool output = settings_.lines[i].request.output;
        const auto level = output ? open.chip().level(i) : open.look(i);
        if (!level) return pass(level);
        levels[i] = *level;
        if (output || !*level) continue;
        for (std::vector<bool>* latched : latches_) (*latched)[i] = true;
      }
      return levels;
    });
  }

  [[nodiscard]] Result<void> set(std::size_t line, bool active) {
    const LineSettings& set = settings_.lines[line];
    return connection_.use([&](OpenLines& open) -> Result<void> {
      if (auto ok = open.chip().set(line, active); !ok) return ok;
      bool wanted = active;
      if (active && set.pulse_ns > 0) {
        base::WaitSlot slot;
        clock_.wait(slot, clock_.now() + base::Duration(set.pulse_ns), base::WaitFor::rig);
        wanted = false;
        if (auto ok = open.chip().set(line, false); !ok) return ok;
      }
      if (!set.verify) return {};
      const auto is = open.chip().level(line);
      if (!is) return pass(is);
      if (*is == wanted) return {};
      return fail(ErrorCode::device,
                  fmt::format("the line was set {} and reads {}", wanted ? "active" : "inactive",
                              *is ? "active" : "inactive"),
                  "line " + set.request.name, "is its pin held by something else, or overloaded?");
    });
  }

  void add(std::vector<bool>* latched) { latches_.push_back(latched); }
  void remove(std::vector<bool>* latched) { std::erase(latches_, latched); }

 private:
  [[nodiscard]] Result<std::unique_ptr<OpenLines>> open() {
    auto chip = open_chip(settings_.chip, requests_);
    if (!chip) return pass(chip);
    if (generation() > 0) {
      log_(base::LogLevel::warning,
           fmt::format("{}: the chip of lines is back; its outputs are at their levels of start",
                       settings_.chip));
    }
    return std::make_unique<OpenLines>(settings_, poll_inputs(std::move(*chip), requests_, settings_.poll));
  }

  const LinesSettings settings_;
  base::Clock& clock_;
  void (*const log_)(base::LogLevel, std::string_view);
  std::vector<LineRequest> requests_;
  std::vector<std::vector<bool>*> latches_;
  Connection<OpenLines> connection_;
};

namespace {

class Reader final : public DigitalIo {
 public:
  explicit Reader(std::shared_ptr<Lines> lines)
      : lines_(std::move(lines)),
        latched_(lines_->settings().lines.size()),
        generation_(lines_->generation()) {
    lines_->add(&latched_);
  }
  ~Reader() override { lines_->remove(&latched_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  [[nodiscard]] std::vector<Line> lines() const override { return lines_of(lines_->settings()); }

  [[nodiscard]] Result<std::vector<bool>> read() override {
    auto levels = lines_->look();
    const bool away = lines_->generation() != generation_;
    if (!levels) {
      told_ = levels.error().code == ErrorCode::lost;
      return levels;
    }
    generation_ = lines_->generation();
    if (away && !std::exchange(told_, false)) {
      return fail(ErrorCode::lost, "the chip of lines was away and is back", lines_->settings().chip);
    }
    told_ = false;
    for (std::size_t i = 0; i < latched_.size(); ++i) {
      if (!lines_->settings().lines[i].request.output) (*levels)[i] = latched_[i];
    }
    latched_.assign(latched_.size(), false);
    return levels;
  }

  [[nodiscard]] Result<void> set(const std::string& line, bool active) override {
    const auto& all = lines_->settings().lines;
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const LineSettings& l) { return l.request.name == line; });
    if (found == all.end() || !found->request.output) {
      return fail(ErrorCode::bad_input, fmt::format("there is no output line '{}'", line),
                  lines_->settings().chip);
    }
    return lines_->set(static_cast<std::size_t>(found - all.begin()), active);
  }

 private:
  const std::shared_ptr<Lines> lines_;
  std::vector<bool> latched_;  // of inputs: active since the last read()
  int generation_;
  bool told_ = false;  // the last read() was lost
};

}  // namespace

Result<std::shared_ptr<Lines>> open_lines(const LinesSettings& settings, base::Clock& clock,
                                          void (*log)(base::LogLevel, std::string_view)) {
  auto lines = std::make_shared<Lines>(settings, clock, log);
  if (auto ok = lines->open_first(); !ok) return pass(ok);
  return lines;
}

std::unique_ptr<DigitalIo> make_reader(std::shared_ptr<Lines> lines) {
  return std::make_unique<Reader>(std::move(lines));
}

}  // namespace rig::drivers::gpiod_lines
