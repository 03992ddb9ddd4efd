#include "tests/soak/night.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <google/protobuf/util/json_util.h>
#include <thread>

#include "core/base/files.h"
#include "core/base/random.h"
#include "core/base/units.h"
#include "core/machine/job_config.h"
#include "core/machine/limits.h"
#include "core/scan/journal.h"
#include "core/scan/scan_directory.h"
#include "core/scan/verify.h"
#include "tests/soak/rig_process.h"
#include "tests/soak/tiny_rig.h"

namespace rig::soak {

namespace fs = std::filesystem;
using base::Result;
using std::chrono::milliseconds;

namespace {

// In every rig of the soak: it changes the pixels, but as a function of the angles.
constexpr const char* kDrift = "[[module.settings.faults.fault]]\nkind = \"light-drift\"\nshare = 0.03\n\n";
// Painted patches are noise about a mean, the same noise where the rig stands the same: wider bands than for
// a real lamp, which an excursion leaves all the same.
constexpr const char* kVisits =
    "\n[reference]\npose_deg = [0.0, 10.0, 0.0, 75.0]\nexposure_ms = 30.0\ndark_exposure_ms = 30.0\n"
    "every_poses = 7\nband = 0.15\nevenness = 0.9\ndark_dn = 100.0\nattempts = 20\nagain_min = 1.0\n";
constexpr std::chrono::seconds kSilence{90};  // nothing at all is told for so long: something hangs

struct RandomFault {
  const char* keys;
  double chance;  // the most that is drawn
};

// Frames stay as they are: each ends in a stop, in a suspension or in a pose that is taken again.
constexpr std::array<RandomFault, 15> kKeepPixels{{{"kind = \"stall\"\nshare = 0.3", 0.02},
                                                   {"kind = \"backlash\"\nby_deg = 2", 1},
                                                   {"kind = \"limit-switch\"\nside = \"low\"", 0.002},
                                                   {"kind = \"limit-switch\"\nside = \"high\"", 0.002},
                                                   {"kind = \"emergency-stop\"\nby_s = 0.05", 0.01},
                                                   {"kind = \"slow\"\nby_s = 0.2", 0.02},
                                                   {"kind = \"slow\"\nby_s = 40", 0.001},
                                                   {"kind = \"garbage\"", 0.001},
                                                   {"kind = \"lost\"", 0.001},
                                                   {"kind = \"unplugged\"", 0.001},
                                                   {"kind = \"disk-full\"\nby_s = 1\nfrom_s = 100", 0.003},
                                                   {"kind = \"dropped-frame\"", 0.03},
                                                   {"kind = \"corrupt-frame\"", 0.03},
                                                   {"kind = \"clock-step\"\nby_s = 3600", 0.005},
                                                   {"kind = \"clock-step\"\nby_s = -900", 0.005}}};
// Of each reading, half a second apart: a lamp that warms up for 900 s must get warm now and then.
constexpr RandomFault kLampOut{"kind = \"light-fails\"", 0.001};
// In each of the nights whose frames may change: some fall upon a visit, which gives poses back, also upon
// the first ones, with which all others are compared.
constexpr const char* kExcursions =
    "[[module.settings.faults.fault]]\nkind = \"light-excursion\"\nshare = -0.2\nchance = 0.2\n\n";
constexpr std::array<RandomFault, 2> kChangePixels{
    {{"kind = \"lost-steps\"\nby_deg = 0.3", 0.02},
     {"kind = \"limit-switch\"\ndevice = \"arm\"\nside = \"high\"", 0.1}}};

std::string random_faults(base::Random& random, std::uint64_t seed, bool changes_pixels) {
  std::string text = fmt::format("seed = {}\n\n{}", seed, kDrift);
  const auto maybe = [&](const RandomFault& fault) {
    const double chance = random.uniform(0, fault.chance);
    if (random.below(2) == 0) return;
    text += fmt::format("[[module.settings.faults.fault]]\n{}\nchance = {:.6f}\n\n", fault.keys, chance);
  };
  for (const RandomFault& fault : kKeepPixels) maybe(fault);
  maybe(kLampOut);
  if (changes_pixels) {
    text += kExcursions;
    for (const RandomFault& fault : kChangePixels) maybe(fault);
  }
  return text;
}

// A reason without its figures, so that equal ones can be counted.
std::string kind_of(const std::string& reason) {
  std::string out;
  for (const char c : reason) {
    const bool figure = (c >= '0' && c <= '9') || c == '.' || c == '-';
    if (!figure) out += c;
    if (figure && (out.empty() || out.back() != '#')) out += '#';
  }
  return out;
}

// How this round of rigd is to end.
struct Ending {
  std::string die_at;
  int at_event = 0;  // 0: none
  std::optional<milliseconds> after;
};

Ending random_ending(base::Random& random) {
  constexpr std::array<const char*, 8> kInstants{"before-write",  "after-write",   "before-flush",
                                                 "after-flush",   "before-rename", "after-rename",
                                                 "before-commit", "after-commit"};
  Ending ending;
  switch (random.below(5)) {
    case 0:
      ending.die_at = fmt::format("any:{}", 1 + random.below(100));
      break;
    case 1:
    case 2:
      ending.die_at = fmt::format("{}:{}", kInstants.at(random.below(kInstants.size())), 1 + random.below(9));
      break;
    case 3:
      ending.at_event = static_cast<int>(1 + random.below(30));
      break;
    default:
      ending.after = milliseconds(random.below(400));
      break;
  }
  return ending;
}

// One night's rig: it is started and ended until the job has ended.
class Keeper {
 public:
  Keeper(const NightOptions& options, NightReport& report)
      : options_(options), report_(report), random_(base::derive_key(options.seed, 1)) {}

  Result<void> keep(bool disturbed) {
    constexpr int kMostRounds = 2000;
    for (int round = 0; round < kMostRounds; ++round) {
      const bool kill = disturbed && report_.kills + report_.deaths < options_.kills;
      auto over = keep_once(kill ? random_ending(random_) : Ending{});
      if (!over) return base::pass(over);
      if (*over) return {};
    }
    return base::fail(base::ErrorCode::timeout, "the job does not come to its end");
  }

 private:
  [[nodiscard]] fs::path scan() const { return options_.folder / "scan"; }
  void problem(const std::string& text) { report_.problems.push_back(text); }

  // Whether the job has ended.
  Result<bool> keep_once(const Ending& ending) {
    auto rig = RigProcess::start(options_.rigd, options_.folder, ending.die_at);
    if (!rig) return base::pass(rig);
    if (ending.after)
      std::this_thread::sleep_for(*ending.after);  // the instant itself is what is random here
    auto ended = ending.after ? Result<bool>(false) : watch(*rig, ending);
    if (!ended) return ended;
    const bool by_itself = rig->ended();
    const int status = rig->end(*ended ? SIGTERM : SIGKILL);
    if (status == -SIGKILL) {
      ++(by_itself || *ended ? report_.deaths : report_.kills);
      if (*ended) return false;  // it died while it was ending: whether the job is over is asked again
    } else if (!*ended || status != 0) {
      problem(fmt::format("rigd ended by itself with status {}; see {}", status,
                          (options_.folder / "rigd.log").string()));
      return base::fail(base::ErrorCode::device, "rigd ended by itself", options_.folder.string());
    }
    return ended;
  }

  // Until the job has ended (true), or rigd is to be killed or has died (false).
  Result<bool> watch(RigProcess& rig, const Ending& ending) {
    protocol::Request subscribe;
    subscribe.mutable_subscribe()->set_epoch(1);
    auto joined = rig.ask(subscribe);
    if (!joined) return base::pass(joined);
    if (!*joined) return false;
    auto there = have_job(rig);
    if (!there || !*there) return there;
    int events = 0;
    auto heard = std::chrono::steady_clock::now();
    while (true) {
      auto state = look(rig);
      if (!state) return base::pass(state);
      if (!*state) return false;
      if (**state == protocol::COMPLETE) return true;
      if (**state == protocol::HELD) {
        protocol::Request release;
        release.mutable_release_job()->set_job(1);
        if (auto released = rig.ask(release); !released) return base::pass(released);
      } else if (**state != protocol::ACTIVE && **state != protocol::QUEUED &&
                 **state != protocol::SUSPENDED) {
        problem(fmt::format("the job ended otherwise than complete: {}", protocol::JobState_Name(**state)));
        return true;
      }
      // A batch of events, then a look whether it is over.
      bool quiet = false;
      while (!quiet) {
        auto event = rig.next_event(milliseconds(50));
        if (!event) return base::pass(event);
        quiet = !*event;
        if (quiet) break;
        heard = std::chrono::steady_clock::now();
        if (ending.at_event > 0 && ++events >= ending.at_event) return false;
        if ((*event)->has_reference_visited())
          report_.given_back += static_cast<int>((*event)->reference_visited().poses_again());
        if ((*event)->has_job_suspended() && (*event)->job_suspended().condition() != "stopped") {
          ++report_.suspensions;
          ++report_.reasons[kind_of((*event)->job_suspended().reason())];
        }
        if ((*event)->has_stop_latched()) {
          ++report_.stops;
          ++report_.reasons[kind_of((*event)->stop_latched().reason())];
          break;
        }
        if ((*event)->has_job_changed()) break;
      }
      if (rig.ended()) return false;
      if (std::chrono::steady_clock::now() - heard > kSilence) {
        problem("nothing happened for a long time while the job was not over");
        return base::fail(base::ErrorCode::timeout, "rigd hangs", options_.folder.string());
      }
    }
  }

  // The job is submitted where rigd does not know it.
  Result<bool> have_job(RigProcess& rig) {
    protocol::Request list;
    list.mutable_list_jobs();
    auto jobs = rig.ask(list);
    if (!jobs) return base::pass(jobs);
    if (!*jobs) return false;
    if ((*jobs)->jobs().jobs_size() > 0) return true;
    // A scan whose rigd died before it had noted the job: an operator removes the folder and submits again.
    std::error_code error;
    fs::remove_all(scan(), error);
    protocol::Request submit;
    submit.mutable_submit_job()->set_job_toml(options_.job_toml);
    submit.mutable_submit_job()->set_job_name("job.toml");
    submit.mutable_submit_job()->set_scan_folder(scan().string());
    auto done = rig.ask(submit);
    if (!done) return base::pass(done);
    if (!*done) return false;
    if ((*done)->outcome() == protocol::DONE) return true;
    if ((*done)->reason().find("exists") != std::string::npos) return true;  // an earlier try came through
    return base::fail(base::ErrorCode::refused, "the job is refused: " + (*done)->reason());
  }

  // The job's state after clearing a stop that is latched; nothing where rigd died.
  Result<std::optional<protocol::JobState>> look(RigProcess& rig) {
    protocol::Request status;
    status.mutable_get_status();
    auto now = rig.ask(status);
    if (!now) return base::pass(now);
    if (!*now) return std::optional<protocol::JobState>();
    if ((*now)->status().mode() == protocol::STOPPED) {
      protocol::Request clear;
      clear.mutable_clear_stop();
      auto cleared = rig.ask(clear);  // refused while its cause is there: the next look tries again
      if (!cleared) return base::pass(cleared);
    }
    protocol::Request show;
    show.mutable_show_job()->set_job(1);
    auto job = rig.ask(show);
    if (!job) return base::pass(job);
    if (!*job) return std::optional<protocol::JobState>();
    return std::optional<protocol::JobState>((*job)->job().state());
  }

  const NightOptions& options_;
  NightReport& report_;
  base::Random random_;
};

// What whoever comes in the morning reads: every pose, as the journal has it.
Result<void> judge_report(const fs::path& scan, const std::vector<scan::PlanRow>& plan, NightReport& report) {
  const auto text = base::read_file(scan / "report.json");
  if (!text) return base::pass(text);
  protocol::Report told;
  if (const auto parsed = google::protobuf::util::JsonStringToMessage(*text, &told); !parsed.ok())
    return base::fail(base::ErrorCode::damaged, parsed.ToString(), (scan / "report.json").string());
  const auto expect = [&](bool holds, const std::string& what) {
    if (!holds) report.problems.push_back("report.json: " + what);
  };
  expect(told.job().state() == protocol::COMPLETE, "the job is not complete");
  expect(told.poses_size() == static_cast<int>(plan.size()),
         fmt::format("has {} of {} poses", told.poses_size(), plan.size()));
  if (told.poses_size() != static_cast<int>(plan.size())) return {};
  for (int i = 0; i < told.poses_size(); ++i) {
    const protocol::PoseReport& pose = told.poses(i);
    const scan::PlanRow& row = plan[static_cast<std::size_t>(i)];
    const bool done = row.state == scan::RowState::done;
    expect(pose.row() == row.row, fmt::format("row {} is not in its place", row.row));
    expect(pose.state() == (done ? "done" : "abandoned"),
           fmt::format("row {} is '{}' there", row.row, pose.state()));
    expect(static_cast<int>(pose.failures()) == row.attempts,
           fmt::format("row {} has {} failures there, and {} in the journal", row.row, pose.failures(),
                       row.attempts));
    expect(done || pose.reasons_size() > 0, fmt::format("row {} was abandoned without a reason", row.row));
    expect(!done || pose.frames() > 0, fmt::format("row {} has no frames", row.row));
  }
  const int visits = report.good_visits + report.bad_visits + report.unproven_visits;
  expect(told.visits_size() == visits, "not every visit is in it");
  expect(told.restarts_us_size() <= report.kills + report.deaths, "more restarts than there were");
  report.restarts = told.restarts_us_size();
  return {};
}

Result<void> judge(const NightOptions& options, NightReport& report) {
  const fs::path scan = options.folder / "scan";
  const auto verified = scan::verify_scan(scan, [](std::size_t) {});
  if (!verified) return base::pass(verified);
  report.problems.insert(report.problems.end(), verified->problems.begin(), verified->problems.end());
  const auto view = scan::open_scan(scan);
  if (!view) return base::pass(view);
  const auto journal = scan::Journal::open_read_only(scan::journal_path(scan));
  if (!journal) return base::pass(journal);
  const auto visits = journal->visits();
  if (!visits) return base::pass(visits);
  for (const scan::VisitRecord& visit : *visits)
    ++(visit.unproven() ? report.unproven_visits : visit.good ? report.good_visits : report.bad_visits);
  if (report.good_visits == 0) report.problems.emplace_back("the light was never proven");
  report.poses = verified->progress.total;
  report.done = verified->progress.done;
  report.abandoned = verified->progress.abandoned;
  for (const scan::PlanRow& row : view->plan) {
    report.failed_attempts += row.attempts;
    if (row.state == scan::RowState::pending)
      report.problems.push_back(fmt::format("row {} is neither done nor abandoned", row.row));
    if (row.state == scan::RowState::abandoned && row.reason.empty())
      report.problems.push_back(fmt::format("row {} was abandoned without a reason", row.row));
  }
  for (const scan::PoseRecord& pose : view->poses) {
    for (const scan::FrameRecord& frame : pose.frames) report.frame_hashes[frame.file] = frame.sha256;
  }
  return judge_report(scan, view->plan, report);
}

Result<NightReport> night(const NightOptions& options, const std::string& faults, bool disturbed) {
  std::error_code error;
  fs::create_directories(options.folder, error);
  auto rig_toml = tiny_rig(options.shipped, faults);
  if (!rig_toml) return base::pass(rig_toml);
  if (auto ok = base::write_file_durably(options.folder / "rig.toml", *rig_toml + kVisits); !ok)
    return base::pass(ok);
  NightReport report;
  if (auto ok = Keeper(options, report).keep(disturbed); !ok) return base::pass(ok);
  if (auto ok = judge(options, report); !ok) return base::pass(ok);
  return report;
}

}  // namespace

Result<NightReport> undisturbed_night(const NightOptions& options) {
  return night(options, kDrift, false);
}

Result<NightReport> disturbed_night(const NightOptions& options) {
  base::Random random(base::derive_key(options.seed, 2));
  return night(options, random_faults(random, options.seed, options.changes_pixels), true);
}

Result<std::string> random_job(const fs::path& shipped, std::size_t poses, std::uint64_t seed,
                               const std::vector<double>& exposures_s) {
  auto rig = machine::load_rig_config(shipped.string());
  if (!rig) return base::pass(rig);
  base::Random random(base::derive_key(seed, 3));
  machine::JobConfig job;
  job.name = "soak";
  job.sample = "chart";
  job.exposure.exposures_s = exposures_s;
  job.retry = {20, 0.1};
  machine::JointAngles from{};
  for (std::size_t i = 0; i < machine::kAxisCount; ++i) from[i] = rig->axes[i].home_rad;
  while (job.poses.size() < poses) {
    const machine::JointAngles to{
        base::radians(random.uniform(-60, 60)), base::radians(random.uniform(-25, 25)),
        base::radians(random.uniform(-50, 50)), base::radians(random.uniform(50, 130))};
    if (!machine::check_move(*rig, from, to)) continue;
    job.poses.push_back(to);
    from = to;
  }
  return machine::format_job_config(job, "a job of the soak run");
}

}  // namespace rig::soak
