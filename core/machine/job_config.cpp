#include "core/machine/job_config.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/config.h"
#include "core/base/units.h"
#include "core/machine/limits.h"

namespace rig::machine {

using base::ConfigTable;

namespace {

constexpr int kJobFormat = 1;
constexpr std::int64_t kAnyFormat = std::numeric_limits<std::int64_t>::max();
constexpr double kShortest_us = 0.01;
constexpr double kLongest_us = 1e10;
constexpr double kDarkest_deg = 90;
constexpr double kShortShare = 0.01;
constexpr std::int64_t kMostAdaptiveFrames = 16;

double seconds_from_us(double us) {
  return us * 1e-6;
}

// A list of exposures, longest first.
std::vector<double> read_bracket(const ConfigTable& table, std::string_view key) {
  std::vector<double> bracket;
  for (const double us : table.numbers(key, 0, {kShortest_us, kLongest_us})) {
    bracket.push_back(seconds_from_us(us));
  }
  if (table.has(key) && bracket.empty()) table.error(key, "names no exposure");
  if (!std::is_sorted(bracket.rbegin(), bracket.rend()))
    table.error(key, "must begin with the longest exposure");
  return bracket;
}

void read_prediction(const ConfigTable& table, ExposureConfig& exposure) {
  constexpr double kMostDeg = 180;
  exposure.lightest_s = read_bracket(table, "lightest_us");
  exposure.darkest_s = read_bracket(table, "darkest_us");
  exposure.lightest_rad = base::radians(table.number_or("lightest_deg", 0, {0, kMostDeg}));
  exposure.darkest_rad = base::radians(table.number_or("darkest_deg", kDarkest_deg, {0, kMostDeg}));
  if (!(exposure.lightest_rad < exposure.darkest_rad)) {
    table.error("darkest_deg", "must be greater than lightest_deg", "the highlight is at 0");
  }
  if (exposure.lightest_s.empty() || exposure.darkest_s.empty()) return;
  if (exposure.lightest_s.size() != exposure.darkest_s.size()) {
    table.error("darkest_us",
                fmt::format("has {} exposures, lightest_us has {}", exposure.darkest_s.size(),
                            exposure.lightest_s.size()),
                "one for each, so that every pose gets as many");
    return;
  }
  for (std::size_t i = 0; i < exposure.darkest_s.size(); ++i) {
    if (exposure.darkest_s[i] >= exposure.lightest_s[i]) continue;
    table.error("darkest_us", fmt::format("exposure {} is shorter than that of lightest_us", i + 1),
                "the darkest pose needs the longer exposures");
  }
}

void read_adaptation(const ConfigTable& table, ExposureConfig& exposure) {
  exposure.longest_s = seconds_from_us(table.number("longest_us", {kShortest_us, kLongest_us}));
  exposure.first_s = seconds_from_us(table.number("first_us", {kShortest_us, kLongest_us}));
  exposure.most_frames = static_cast<int>(table.integer("most_frames", 1, kMostAdaptiveFrames));
  exposure.snr = table.number("snr", {1, 1000});
  exposure.short_share = table.number_or("short_share", kShortShare, {0, 1});
  if (exposure.first_s > exposure.longest_s) table.error("first_us", "is longer than longest_us");
}

ExposureConfig read_exposure(const ConfigTable& table) {
  ExposureConfig exposure;
  const std::string strategy = table.choice("strategy", {"fixed", "halve", "predicted", "adaptive"});
  if (strategy == "halve") {
    exposure.strategy = ExposureStrategy::halve;
    exposure.longest_s = seconds_from_us(table.number("longest_us", {kShortest_us, kLongest_us}));
    exposure.most_frames = static_cast<int>(table.integer("most_frames", 1, 32));
    exposure.saturated_share = table.number_or("saturated_share", 0, {0, 1});
  } else if (strategy == "predicted") {
    exposure.strategy = ExposureStrategy::predicted;
    read_prediction(table, exposure);
  } else if (strategy == "adaptive") {
    exposure.strategy = ExposureStrategy::adaptive;
    read_adaptation(table, exposure);
  } else {
    exposure.exposures_s = read_bracket(table, "exposures_us");
  }
  return exposure;
}

base::Result<JobConfig> read_job(const ConfigTable& root) {
  if (const auto format = root.integer("format", 1, kAnyFormat); format > kJobFormat) {
    return base::fail(base::ErrorCode::newer,
                      fmt::format("format {} is newer than this program reads ({})", format, kJobFormat),
                      root.where("format"), "use a newer rigd");
  }
  JobConfig job;
  job.name = root.text("name");
  job.sample = root.text("sample");
  job.operator_name = root.text_or("operator", "");
  job.needs_sample_change = root.boolean_or("needs_sample_change", false);
  if (root.has("sample_fiducials")) {
    for (const double id : root.numbers("sample_fiducials", 0, {0, 1e6})) {
      if (id != std::floor(id)) root.error("sample_fiducials", "must be whole numbers: ids of tags");
      job.sample_fiducials.push_back(static_cast<int>(id));
    }
  }
  job.exposure = read_exposure(root.table("exposure"));
  if (const auto retry = root.table_if("retry")) {
    job.retry.attempts = static_cast<int>(retry->integer_or("attempts", job.retry.attempts, 1, 100));
    job.retry.delay_s = retry->number_or("delay_s", job.retry.delay_s, {0, 3600});
  }
  const ConfigTable poses = root.table("poses");
  for (const auto& row : poses.rows("angles_deg", kAxisCount)) {
    JointAngles angles{};
    std::transform(row.begin(), row.end(), angles.begin(), base::radians);
    job.poses.push_back(angles);
  }
  if (job.poses.empty()) poses.error("angles_deg", "has no pose");
  if (auto done = root.finish(); !done) return base::pass(done);
  return job;
}

// A TOML basic string.
std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

// A TOML float with every digit that matters.
std::string number(double value) {
  std::string out = fmt::format("{}", value);
  if (out.find_first_of(".en") == std::string::npos) out += ".0";
  return out;
}

// A value in the unit of the file that `inside` turns into the wanted one. Converting there and back may end
// one rounding step off; then the neighbour with the fewest digits is the one that was meant.
std::string number_at_edge(double wanted, double guess, double (*inside)(double)) {
  std::string best = inside(guess) == wanted ? number(guess) : "";
  double candidate = guess;
  constexpr int kNeighbours = 3;
  for (int i = 0; i < kNeighbours; ++i) candidate = std::nextafter(candidate, -INFINITY);
  for (int i = -kNeighbours; i <= kNeighbours; ++i, candidate = std::nextafter(candidate, INFINITY)) {
    if (inside(candidate) != wanted) continue;
    const std::string text = number(candidate);
    if (best.empty() || text.size() < best.size()) best = text;
  }
  return best.empty() ? number(guess) : best;
}

std::string number_us(double seconds) {
  return number_at_edge(seconds, seconds * 1e6, &seconds_from_us);
}

std::string number_deg(double radians) {
  return number_at_edge(radians, base::degrees(radians), &base::radians);
}

std::string bracket_us(const std::vector<double>& bracket) {
  std::string list;
  for (const double s : bracket) list += (list.empty() ? "" : ", ") + number_us(s);
  return "[" + list + "]";
}

std::string format_exposure(const ExposureConfig& exposure) {
  switch (exposure.strategy) {
    case ExposureStrategy::fixed:
      break;
    case ExposureStrategy::halve:
      return fmt::format("strategy = \"halve\"\nlongest_us = {}\nmost_frames = {}\nsaturated_share = {}\n",
                         number_us(exposure.longest_s), exposure.most_frames,
                         number(exposure.saturated_share));
    case ExposureStrategy::predicted:
      return fmt::format(
          "strategy = \"predicted\"\nlightest_us = {}\ndarkest_us = {}\nlightest_deg = {}\ndarkest_deg = "
          "{}\n",
          bracket_us(exposure.lightest_s), bracket_us(exposure.darkest_s), number_deg(exposure.lightest_rad),
          number_deg(exposure.darkest_rad));
    case ExposureStrategy::adaptive:
      return fmt::format(
          "strategy = \"adaptive\"\nfirst_us = {}\nlongest_us = {}\nmost_frames = {}\nsnr = {}\nshort_share "
          "= {}\n",
          number_us(exposure.first_s), number_us(exposure.longest_s), exposure.most_frames,
          number(exposure.snr), number(exposure.short_share));
  }
  return fmt::format("strategy = \"fixed\"\nexposures_us = {}\n", bracket_us(exposure.exposures_s));
}

}  // namespace

base::Result<JobConfig> parse_job_config(std::string_view text, const std::string& name) {
  auto root = ConfigTable::parse(text, name);
  if (!root) return base::pass(root);
  return read_job(*root);
}

base::Result<JobConfig> load_job_config(const std::string& path) {
  auto root = ConfigTable::parse_file(path);
  if (!root) return base::pass(root);
  return read_job(*root);
}

std::string format_job_config(const JobConfig& job, std::string_view comment) {
  std::string out;
  for (std::size_t begin = 0; begin < comment.size();) {
    const std::size_t end = std::min(comment.find('\n', begin), comment.size());
    out += fmt::format("# {}\n", comment.substr(begin, end - begin));
    begin = end + 1;
  }
  out +=
      fmt::format("format = {}\nname = {}\nsample = {}\n", kJobFormat, quoted(job.name), quoted(job.sample));
  if (!job.operator_name.empty()) out += fmt::format("operator = {}\n", quoted(job.operator_name));
  if (!job.sample_fiducials.empty())
    out += fmt::format("sample_fiducials = [{}]\n", fmt::join(job.sample_fiducials, ", "));
  if (job.needs_sample_change) out += "needs_sample_change = true\n";
  out += "\n[exposure]\n";
  out += format_exposure(job.exposure);
  out +=
      fmt::format("\n[retry]\nattempts = {}\ndelay_s = {}\n", job.retry.attempts, number(job.retry.delay_s));
  out += "\n[poses]\n# roll, tilt, pan, arm\nangles_deg = [\n";
  for (const JointAngles& pose : job.poses) {
    out += fmt::format("  [{}, {}, {}, {}],\n", number_deg(pose[0]), number_deg(pose[1]), number_deg(pose[2]),
                       number_deg(pose[3]));
  }
  return out + "]\n";
}

base::Result<void> check_job(const RigConfig& rig, const JobConfig& job) {
  std::vector<std::string> errors;
  const auto check_exposure = [&](double seconds) {
    if (seconds >= rig.camera.min_exposure_s && seconds <= rig.camera.max_exposure_s) return;
    errors.push_back(fmt::format("exposure of {:.3f} us: the camera takes {:.3f} to {:.3f} us", seconds * 1e6,
                                 rig.camera.min_exposure_s * 1e6, rig.camera.max_exposure_s * 1e6));
  };
  for (const auto* bracket : {&job.exposure.exposures_s, &job.exposure.lightest_s, &job.exposure.darkest_s}) {
    for (const double s : *bracket) check_exposure(s);
  }
  if (job.exposure.strategy == ExposureStrategy::adaptive) {
    check_exposure(job.exposure.first_s);
    check_exposure(job.exposure.longest_s);
  }
  if (job.exposure.strategy == ExposureStrategy::halve) {
    check_exposure(job.exposure.longest_s);
    check_exposure(job.exposure.longest_s / static_cast<double>(1U << (job.exposure.most_frames - 1)));
  }
  if (!job.sample_fiducials.empty() && !rig.unattended.reference) {
    errors.emplace_back("sample_fiducials: rig.toml has no [reference], whose pose they are looked for in");
  }
  if (rig.unattended.reference) {
    check_exposure(rig.unattended.reference->exposure_s);
    check_exposure(rig.unattended.reference->dark_exposure_s);
    if (rig.unattended.reference->flat) check_exposure(rig.unattended.reference->flat->exposure_s);
  }
  // The way to a pose begins at the last one that the rig can take.
  const JointAngles* before = nullptr;
  for (std::size_t i = 0; i < job.poses.size(); ++i) {
    const JointAngles& pose = job.poses[i];
    if (auto ok = before != nullptr ? check_move(rig, *before, pose) : check_standing(rig, pose); !ok) {
      errors.push_back(fmt::format("pose {}: {}", i, ok.error().what));
    } else {
      before = &pose;
    }
  }
  if (errors.empty()) return {};
  constexpr std::size_t kMostShown = 20;
  const std::size_t left = errors.size() > kMostShown ? errors.size() - kMostShown : 0;
  if (left > 0) errors.resize(kMostShown);
  return base::fail(base::ErrorCode::bad_input,
                    fmt::format("the rig cannot do this job:\n  {}{}", fmt::join(errors, "\n  "),
                                left > 0 ? fmt::format("\n  and {} more", left) : ""));
}

}  // namespace rig::machine
