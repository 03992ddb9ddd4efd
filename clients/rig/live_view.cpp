#include "clients/rig/live_view.h"

#include <algorithm>
#include <iterator>

namespace rig::client {

namespace {

constexpr std::size_t kTextWidth = 56;
constexpr std::size_t kBarWidth = 34;
constexpr std::size_t kNarrowestPicture = 24;
constexpr std::size_t kWidestPicture = 120;
constexpr std::size_t kFewestPictureRows = 6;

double share_of_best(double focus, double best) {
  return best > 0 ? focus / best : 0;
}

const char* measured_on(const LiveFrame& frame) {
  return frame.content == FrameContent::raw ? "raw" : "preview";
}

std::vector<int> missing(const LiveView& view) {
  std::vector<int> out;
  std::set_difference(view.expected.begin(), view.expected.end(), view.frame.fiducials.begin(),
                      view.frame.fiducials.end(), std::back_inserter(out));
  return out;
}

std::vector<std::string> focus_lines(const LiveView& view, bool utf8) {
  const double share = share_of_best(view.frame.focus, view.best_focus);
  std::vector<double> heights;
  heights.reserve(view.focus_history.size());
  for (const double focus : view.focus_history) heights.push_back(share_of_best(focus, view.best_focus));
  return {fmt::format("focus      {:.4g}, best so far {:.4g}", view.frame.focus, view.best_focus),
          fmt::format("{} {:3.0f} % of best", bar(share, kBarWidth, utf8), 100 * share),
          column_chart(heights, utf8)};
}

std::string warning_for(const Exposed& exposed) {
  if (exposed.saturated_share > 0.001) return "  too bright";
  return exposed.level < 0.05 ? "  too dark" : "";
}

std::vector<std::string> exposure_lines(const LiveView& view, bool utf8) {
  const Exposed& exposed = view.frame.exposed;
  return {fmt::format("exposure   {:.6g} ms{}{}", view.frame.exposure_us * 1e-3,
                      view.automatic ? ", automatic" : "", warning_for(exposed)),
          fmt::format("{} {:3.0f} % of full scale", bar(exposed.level, kBarWidth, utf8), 100 * exposed.level),
          fmt::format("saturated  {:.3f} %   at black {:.3f} %", 100 * exposed.saturated_share,
                      100 * exposed.black_share)};
}

std::vector<std::string> fiducial_lines(const LiveView& view) {
  const auto& found = view.frame.fiducials;
  const std::string of = view.expected.empty() ? "" : fmt::format(" of {}", view.expected.size());
  const auto absent = missing(view);
  return {fmt::format("fiducials  {}{}{}", found.size(), of, found.empty() ? "" : ": " + id_ranges(found)),
          absent.empty() ? "" : "missing    " + id_ranges(absent)};
}

}  // namespace

std::string id_ranges(const std::vector<int>& ids) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < ids.size();) {
    std::size_t last = i;
    while (last + 1 < ids.size() && ids[last + 1] == ids[last] + 1) ++last;
    // Two in a row are no range yet.
    if (last < i + 2) last = i;
    parts.push_back(last == i ? fmt::format("{}", ids[i]) : fmt::format("{}-{}", ids[i], ids[last]));
    i = last + 1;
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::vector<std::string> draw_live(const LiveView& view, const TerminalStyle& style) {
  const auto width = static_cast<std::size_t>(std::max(style.columns, 1));
  const auto rows = static_cast<std::size_t>(std::max(style.rows, 1));
  std::vector<std::string> lines;
  const auto add = [&lines](std::vector<std::string> more) {
    lines.insert(lines.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  add(focus_lines(view, style.utf8));
  add({""});
  add(exposure_lines(view, style.utf8));
  add({""});
  add(fiducial_lines(view));
  const Region& region = view.frame.region;
  add({"",
       fmt::format("measured on {} x {} pixels at {}, {} ({})", region.width(), region.height(), region.x0,
                   region.y0, measured_on(view.frame)),
       view.rig, view.light, view.note});
  if (lines.size() > rows) lines.resize(rows);

  const bool pictures = style.colour && style.utf8;
  const bool wide = width >= kTextWidth + 2 + kNarrowestPicture;
  std::vector<std::string> beside;
  if (pictures && wide)
    beside = picture_lines(view.picture, std::min(width - kTextWidth - 2, kWidestPicture), rows);
  lines.resize(std::max(lines.size(), beside.size()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines[i] = cut(lines[i], i < beside.size() ? kTextWidth : width);
    if (i < beside.size()) lines[i] = padded(lines[i], kTextWidth + 2) + beside[i];
  }
  if (pictures && !wide && rows >= lines.size() + kFewestPictureRows)
    add(picture_lines(view.picture, width, rows - lines.size()));
  return lines;
}

std::string live_line(const LiveView& view) {
  const LiveFrame& frame = view.frame;
  return fmt::format(
      "exposure {:.6g} ms, focus {:.4g} ({:.0f} % of best), level {:.0f} %, saturated {:.3f} %, at black "
      "{:.3f} "
      "%, {} fiducials{}",
      frame.exposure_us * 1e-3, frame.focus, 100 * share_of_best(frame.focus, view.best_focus),
      100 * frame.exposed.level, 100 * frame.exposed.saturated_share, 100 * frame.exposed.black_share,
      frame.fiducials.size(), frame.fiducials.empty() ? "" : ": " + id_ranges(frame.fiducials));
}

std::string live_figures(const LiveFrame& frame) {
  const Region& region = frame.region;
  return fmt::format(
      "exposure_ms {:.6g}\nfocus {:.6g}\nlevel_percent {:.4g}\nsaturated_percent {:.6g}\nblack_percent "
      "{:.6g}\nfiducials {}\nfiducial_ids {}\nregion_px {} {} {} {}\nmeasured_on {}\n"
      "frame_from {}\n",
      frame.exposure_us * 1e-3, frame.focus, 100 * frame.exposed.level, 100 * frame.exposed.saturated_share,
      100 * frame.exposed.black_share, frame.fiducials.size(), fmt::join(frame.fiducials, " "), region.x0,
      region.y0, region.width(), region.height(), measured_on(frame),
      frame.from_memory ? "memory" : "socket");
}

}  // namespace rig::client
