#include "drivers/tic_axis/session.h"

#include <algorithm>

#include "drivers/tic_axis/products.h"
#include "drivers/tic_axis/setup_check.h"

namespace rig::drivers::tic {

using base::LogLevel;
using base::pass;
using base::Result;

namespace {

constexpr int kFeedsPerTimeout = 4;
constexpr std::chrono::milliseconds kUsualTimeout{1000};

std::string title(const TicSettings& tic, const Identity& identity) {
  return fmt::format("axis {}, {}", tic.axis.name, identity.where);
}

FeederTimes times_of(const Settings& settings, const ModuleSettings& module) {
  const std::chrono::milliseconds timeout(settings.command_timeout_ms);
  const auto fed_within = timeout.count() == 0 ? kUsualTimeout : std::min(timeout, kUsualTimeout);
  return {fed_within / kFeedsPerTimeout, module.silence};
}

struct Met {
  Settings settings;
  std::vector<Mismatch> mismatches;
};

Result<Met> meet(Link& link, const TicSettings& tic, Variables& now) {
  // Firmware before 1.06 may know shorter blocks; of such a Tic only that matters.
  if (link.identity().firmware < kLeastFirmware || !product_of(link.identity().product)) {
    return Met{{}, compare_setup(tic, link.identity(), {}, {})};
  }
  const auto settings = link.settings();
  if (!settings) return pass(settings);
  const auto variables = link.variables();
  if (!variables) return pass(variables);
  now = *variables;
  return Met{*settings, compare_setup(tic, link.identity(), *settings, now)};
}

}  // namespace

Result<std::unique_ptr<Session>> Session::open(const TicSettings& tic, const ModuleSettings& module,
                                               const Heartbeat& heart, const Log& log, Deadline call_ends) {
  auto transport = open_transport(tic.place, module.retry, call_ends);
  if (!transport) return pass(transport);
  std::unique_ptr<Session> session(new Session);
  session->link_ = std::make_unique<Link>(std::move(*transport), module.retry);
  Link& link = *session->link_;
  link.begin_call(call_ends);
  const std::string who = title(tic, link.identity());
  Variables now;
  auto met = meet(link, tic, now);
  if (!met) return pass(met);
  if (module.write_settings && !met->mismatches.empty()) {
    const auto written = write_mismatches(link, met->mismatches, now);
    if (!written) return pass(written);
    if (*written) {
      log(LogLevel::warning, fmt::format("{}: written to it, because {}", who,
                                         mismatch_text(met->mismatches, link.identity().serial)));
      met = meet(link, tic, now);
      if (!met) return pass(met);
    }
  }
  session->settings_ = met->settings;
  session->mismatch_ = mismatch_text(met->mismatches, link.identity().serial);
  // A Tic that nobody spoke to has run into its command timeout; that is over now.
  if (auto fed = link.feed(); !fed) return pass(fed);
  const auto before = link.take_errors_occurred();
  if (!before) return pass(before);
  if ((*before & error::faults) != 0) {
    log(LogLevel::info, fmt::format("{}: before now: {}", who, error_text(*before & error::faults)));
  }
  if (!session->mismatch_.empty()) log(LogLevel::error, fmt::format("{}: {}", who, session->mismatch_));
  session->feeder_ = std::make_unique<Feeder>(
      link, heart, times_of(met->settings, module),
      [log, who](const std::string& what) { log(LogLevel::warning, fmt::format("{}: {}", who, what)); });
  return session;
}

bool Session::is_mended(const TicSettings& tic) {
  Variables now;
  const auto met = meet(*link_, tic, now);
  return met && met->mismatches.empty();
}

}  // namespace rig::drivers::tic
