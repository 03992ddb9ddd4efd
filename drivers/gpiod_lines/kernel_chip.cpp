#include "drivers/gpiod_lines/kernel_chip.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <gpiod.h>
#include <poll.h>

namespace rig::drivers::gpiod_lines {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using ChipHandle = std::unique_ptr<gpiod_chip, CloseChip>;

Result<ChipHandle> open_path(const fs::path& path) {
  // libgpiod compares the name with what sysfs lists: a link would not be found there.
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  ChipHandle chip(error ? nullptr : gpiod_chip_open(real.c_str()));
  if (chip) return chip;
  const int why = error ? error.value() : errno;
  return fail(ErrorCode::lost, fmt::format("cannot open the chip of lines: {}", std::strerror(why)),
              path.string(),
              why == EACCES ? "is rigd in the group that owns it (gpio)?" : "is it plugged in?");
}

// Chips that cannot be opened are passed over: they may belong to others.
Result<ChipHandle> open_called(const std::string& name) {
  std::vector<ChipHandle> found;
  std::vector<std::string> names;
  std::string others;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error)) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    ChipHandle chip(gpiod_chip_open(entry.path().c_str()));
    if (!chip) continue;
    const std::string label = gpiod_chip_label(chip.get());
    if (name == gpiod_chip_name(chip.get())) return chip;
    others += fmt::format("{}{} '{}'", others.empty() ? "" : ", ", gpiod_chip_name(chip.get()), label);
    if (name != label) continue;
    names.push_back(entry.path().string());
    found.push_back(std::move(chip));
  }
  if (found.size() == 1) return std::move(found.front());
  if (found.empty()) {
    return fail(ErrorCode::lost, fmt::format("there is no chip of lines with the name or label '{}'", name),
                "chip", others.empty() ? "is it plugged in?" : "there are " + others);
  }
  return fail(ErrorCode::bad_input,
              fmt::format("{} chips have the label '{}': {}", names.size(), name, fmt::join(names, ", ")),
              "chip", "name one by its path; a udev rule can give it one that stays");
}

int flags_of(const LineRequest& request) {
  int flags = request.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (request.output) {
    if (request.drive == Drive::open_drain) flags |= GPIOD_LINE_REQUEST_FLAG_OPEN_DRAIN;
    if (request.drive == Drive::open_source) flags |= GPIOD_LINE_REQUEST_FLAG_OPEN_SOURCE;
    return flags;
  }
  if (request.bias == Bias::none) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE;
  if (request.bias == Bias::pull_up) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  if (request.bias == Bias::pull_down) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  return flags;
}

tl::unexpected<base::Error> not_given(const LineRequest& request, gpiod_line* line) {
  const int why = errno;
  const char* other = why == EBUSY ? gpiod_line_consumer(line) : nullptr;
  const bool no_edges = request.edges && !request.output && (why == EINVAL || why == ENXIO || why == ENOTSUP);
  return fail(why == EBUSY ? ErrorCode::busy : ErrorCode::io,
              other == nullptr ? fmt::format("the line is not to be had: {}", std::strerror(why))
                               : fmt::format("'{}' has the line", other),
              "line " + request.name,
              no_edges ? "a chip that does not tell of changes needs edges = \"polled\"" : "");
}

class KernelChip final : public LineChip {
 public:
  KernelChip(ChipHandle chip, std::string name) : chip_(std::move(chip)), name_(std::move(name)) {}

  [[nodiscard]] Result<void> request_all(const std::vector<LineRequest>& requests) {
    lines_.resize(requests.size());
    for (std::size_t i = 0; i < requests.size(); ++i) {
      auto line = find(requests[i]);
      if (!line) return pass(line);
      if (std::find(lines_.begin(), lines_.end(), *line) != lines_.end()) {
        return fail(ErrorCode::bad_input, "two names for one line", "line " + requests[i].name);
      }
      lines_[i] = *line;
    }
    // Outputs first: they are not to stand open longer than they must.
    for (const bool outputs : {true, false}) {
      for (std::size_t i = 0; i < requests.size(); ++i) {
        if (requests[i].output != outputs) continue;
        const bool ok = outputs ? take_output(requests[i], lines_[i]) : take_input(requests[i], lines_[i]);
        if (!ok) return not_given(requests[i], lines_[i]);
      }
    }
    with_edges_.clear();
    for (const LineRequest& request : requests) with_edges_.push_back(!request.output && request.edges);
    return {};
  }

  [[nodiscard]] Result<bool> level(std::size_t line) override {
    const int value = gpiod_line_get_value(lines_.at(line));
    if (value < 0) return lost("reading a line");
    return value != 0;
  }

  [[nodiscard]] Result<void> set(std::size_t line, bool active) override {
    if (gpiod_line_set_value(lines_.at(line), active ? 1 : 0) != 0) return lost("setting a line");
    return {};
  }

  [[nodiscard]] Result<std::vector<Edge>> edges(std::size_t line) override {
    std::vector<Edge> edges;
    if (!with_edges_.at(line)) return edges;
    const int fd = gpiod_line_event_get_fd(lines_[line]);
    while (true) {
      pollfd wait{fd, POLLIN, 0};
      const int ready = ::poll(&wait, 1, 0);
      if (ready < 0 && errno == EINTR) continue;
      if (ready < 0) return lost("asking for changes");
      if (ready == 0) return edges;
      if ((wait.revents & POLLIN) == 0) {
        errno = ENODEV;
        return lost("asking for changes");
      }
      std::array<gpiod_line_event, kEdgeQueue> events{};
      const int count = gpiod_line_event_read_fd_multiple(fd, events.data(), events.size());
      if (count < 0) return lost("asking for changes");
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        edges.push_back({events[i].event_type == GPIOD_LINE_EVENT_RISING_EDGE,
                         events[i].ts.tv_sec * kNsPerSecond + events[i].ts.tv_nsec});
      }
      // A line that changes faster than it is read must not keep the worker here.
      if (edges.size() >= 4 * kEdgeQueue) return edges;
    }
  }

 private:
  [[nodiscard]] Result<gpiod_line*> find(const LineRequest& request) {
    gpiod_line* line = request.offset ? gpiod_chip_get_line(chip_.get(), *request.offset)
                                      : gpiod_chip_find_line(chip_.get(), request.label.c_str());
    if (line != nullptr) return line;
    return fail(ErrorCode::not_found,
                request.offset ? fmt::format("there is no line {}: the chip has {}", *request.offset,
                                             gpiod_chip_num_lines(chip_.get()))
                               : fmt::format("the chip has no line with the name '{}'", request.label),
                "line " + request.name, "gpioinfo lists them");
  }

  [[nodiscard]] static bool take_output(const LineRequest& request, gpiod_line* line) {
    const int flags = flags_of(request);
    if (request.at_start == Rest::keep && gpiod_line_direction(line) == GPIOD_LINE_DIRECTION_OUTPUT) {
      const gpiod_line_request_config as_is{kConsumer, GPIOD_LINE_REQUEST_DIRECTION_AS_IS,
                                            flags & GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW};
      if (gpiod_line_request(line, &as_is, 0) != 0) return false;
      const int value = gpiod_line_get_value(line);
      return value >= 0 &&
             gpiod_line_set_config(line, GPIOD_LINE_REQUEST_DIRECTION_OUTPUT, flags, value) == 0;
    }
    return gpiod_line_request_output_flags(line, kConsumer, flags,
                                           request.at_start == Rest::active ? 1 : 0) == 0;
  }

  [[nodiscard]] static bool take_input(const LineRequest& request, gpiod_line* line) {
    const int flags = flags_of(request);
    return (request.edges ? gpiod_line_request_both_edges_events_flags(line, kConsumer, flags)
                          : gpiod_line_request_input_flags(line, kConsumer, flags)) == 0;
  }

  [[nodiscard]] tl::unexpected<base::Error> lost(const char* doing) const {
    return fail(ErrorCode::lost,
                fmt::format("the chip of lines is gone: {}: {}", doing, std::strerror(errno)), name_);
  }

  const ChipHandle chip_;
  const std::string name_;
  std::vector<gpiod_line*> lines_;  // the chip's, which releases them
  std::vector<bool> with_edges_;
};

}  // namespace

Result<std::unique_ptr<LineChip>> open_kernel_chip(const std::string& chip,
                                                   const std::vector<LineRequest>& requests) {
  auto handle = chip.starts_with('/') ? open_path(chip) : open_called(chip);
  if (!handle) return pass(handle);
  auto opened = std::make_unique<KernelChip>(std::move(*handle), chip);
  if (auto ok = opened->request_all(requests); !ok) return pass(ok);
  return opened;
}

}  // namespace rig::drivers::gpiod_lines
