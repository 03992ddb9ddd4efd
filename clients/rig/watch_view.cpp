#include "clients/rig/watch_view.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "clients/rig/format.h"
#include "core/base/progress.h"

namespace rig::client {

namespace {

constexpr std::size_t kTextWidth = 62;
constexpr std::size_t kNarrowestPicture = 24;
constexpr std::size_t kWidestPicture = 80;
constexpr std::size_t kHistogramBins = 40;

// Where an axis stands between its limits, and where it is going. A limit switch that is active is a !.
std::string travel(const protocol::AxisStatus& axis, std::size_t width) {
  std::string line(width, '-');
  const double span = axis.max_deg() - axis.min_deg();
  const auto mark = [&](double angle_deg, char letter) {
    if (!(span > 0) || !std::isfinite(angle_deg)) return;
    const double share = std::clamp((angle_deg - axis.min_deg()) / span, 0.0, 1.0);
    line[static_cast<std::size_t>(std::lround(share * static_cast<double>(width - 1)))] = letter;
  };
  if (axis.moving()) mark(axis.target_deg(), '>');
  mark(axis.position_deg(), axis.moving() ? '*' : '|');
  return (axis.at_low_limit() ? "!" : "[") + line + (axis.at_high_limit() ? "!" : "]");
}

std::vector<std::string> axis_lines(const protocol::Status& status) {
  std::vector<std::string> lines;
  for (const auto& axis : status.axes()) {
    lines.push_back(fmt::format(
        "{:5} {:10.3f} deg {} {}{}", axis.name(), axis.position_deg(), travel(axis, 24),
        axis.homed() ? (axis.moving() ? "moving" : "at rest") : "not homed", describe_trouble(axis)));
  }
  return lines;
}

std::vector<std::string> job_lines(const WatchView& view, bool utf8) {
  const auto& job = view.job;
  if (job.job() == 0) return {"no job"};
  const double share =
      job.poses() > 0 ? static_cast<double>(job.done() + job.abandoned()) / static_cast<double>(job.poses())
                      : 0;
  std::vector<std::string> lines{describe_job_shortly(job)};
  std::string left;
  if (view.seconds_left >= 0) {
    left = base::format_duration(view.seconds_left) + " left";
  } else if (job.state() == protocol::ACTIVE) {
    left = "time left not known yet";
  }
  lines.push_back(fmt::format("{} {:3.0f} %  {}", bar(share, 32, utf8), 100 * share, left));
  if (!job.reason().empty()) lines.push_back(job.reason());
  return lines;
}

// What keeps the job from going on: the condition, its age and its limit, then the reason.
std::vector<std::string> suspension_lines(const protocol::JobInfo& job, std::size_t width) {
  std::vector<std::string> lines;
  for (const auto& suspension : job.suspensions()) {
    for (auto& line :
         wrapped("suspended by " + describe_suspension(suspension) + ": " + suspension.reason(), width, "  "))
      lines.push_back(std::move(line));
  }
  return lines;
}

std::string rough_duration(double seconds) {
  constexpr double kDay_s = 86400;
  return seconds < 2 * kDay_s ? base::format_duration(seconds) : fmt::format("{:.0f} days", seconds / kDay_s);
}

// The room that the running job has, and when the disk is full at the pace seen here.
std::vector<std::string> disk_lines(const WatchView& view) {
  const auto free = static_cast<double>(view.status.free_bytes());
  const auto left = static_cast<double>(view.status.bytes_left());
  if (free == 0) return {};
  std::string line = fmt::format("disk {} free", describe_bytes(free));
  if (left > 0) line += fmt::format(", the job needs {}", describe_bytes(left));
  if (left > 0 && view.seconds_left > 0)
    line += ", full in " + rough_duration(view.seconds_left * free / left);
  return {line};
}

// The pose under way, and the exposures of the newest bracket, which may still be that of the pose before.
std::vector<std::string> exposure_lines(const WatchView& view) {
  if (view.job.job() == 0) return {};
  std::string pose = fmt::format("row {}", view.pose.row());
  if (view.pose.attempt() > 1) pose += fmt::format(", attempt {}", view.pose.attempt());
  if (!view.pose.target_deg().empty()) {
    pose += fmt::format(" to {:.1f} deg",
                        fmt::join(view.pose.target_deg().begin(), view.pose.target_deg().end(), ", "));
  }
  if (view.bracket.empty()) return {pose, ""};
  std::string exposures = fmt::format("row {} exposed", view.bracket.front().row());
  for (const auto& frame : view.bracket) {
    exposures += fmt::format("  {:.3g} ms", frame.exposure_us() * 1e-3);
    if (frame.saturated_share() > 0)
      exposures += fmt::format(" ({:.2f} % sat.)", 100 * frame.saturated_share());
  }
  return {pose, exposures};
}

std::vector<std::string> histogram_lines(const protocol::Frame& preview, bool utf8) {
  if (preview.preview_rgb().empty()) return {};
  const auto shares = preview_histogram(preview, kHistogramBins);
  const double most = *std::max_element(shares.begin(), shares.end());
  std::vector<double> heights;
  // The root shows small shares too.
  heights.reserve(shares.size());
  for (const double share : shares) heights.push_back(std::sqrt(most > 0 ? share / most : 0));
  return {"dark " + column_chart(heights, utf8) + " bright"};
}

}  // namespace

std::vector<double> preview_histogram(const protocol::Frame& preview, std::size_t bins) {
  std::vector<double> shares(bins, 0.0);
  const std::string& rgb = preview.preview_rgb();
  const std::size_t pixels = rgb.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto value = [&](std::size_t c) {
      return static_cast<double>(static_cast<unsigned char>(rgb[3 * i + c]));
    };
    const double luminance = 0.2126 * value(0) + 0.7152 * value(1) + 0.0722 * value(2);
    // Whole steps, as the picture has them: a sum of roundings must not fall into the bin below.
    const auto bin = static_cast<std::size_t>(std::round(luminance) / 256 * static_cast<double>(bins));
    shares[std::min(bin, bins - 1)] += 1 / static_cast<double>(pixels);
  }
  return shares;
}

std::vector<std::string> draw_watch(const WatchView& view, const TerminalStyle& style) {
  const auto columns = static_cast<std::size_t>(std::max(style.columns, 1));
  const auto rows = static_cast<std::size_t>(std::max(style.rows, 1));
  const bool wide = columns >= kTextWidth + 2 + kNarrowestPicture;
  const std::size_t text_width = wide ? kTextWidth : columns;
  std::vector<std::string> lines;
  const auto add = [&lines](std::vector<std::string> more) {
    lines.insert(lines.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  const auto& status = view.status;
  add({fmt::format("{}: {}", status.rig_name(), describe_mode(status)), ""});
  add(job_lines(view, style.utf8));
  add(suspension_lines(view.job, text_width));
  add(exposure_lines(view));
  add({""});
  add(axis_lines(status));
  add({describe_light(status.light())});
  add(disk_lines(view));
  const std::size_t needed = lines.size();
  if (needed + 2 <= rows) add(histogram_lines(view.preview, style.utf8));

  std::vector<std::string> beside;
  if (wide && style.colour && style.utf8) {
    beside = picture_lines(view.preview, std::min(columns - kTextWidth - 2, kWidestPicture), rows);
  }
  if (lines.size() + 2 < rows && !view.messages.empty()) {
    add({""});
    const std::size_t room = rows - lines.size();
    const std::size_t count = std::min(room, view.messages.size());
    for (std::size_t i = view.messages.size() - count; i < view.messages.size(); ++i)
      lines.push_back(view.messages[i]);
  }
  if (lines.size() > rows) lines.resize(rows);
  lines.resize(std::max(lines.size(), std::min(beside.size(), rows)));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines[i] = cut(lines[i], i < beside.size() ? text_width : columns);
    if (i < beside.size()) lines[i] = padded(lines[i], text_width + 2) + beside[i];
  }
  return lines;
}

}  // namespace rig::client
