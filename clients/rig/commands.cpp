#include "clients/rig/commands.h"

#include <cstdio>
#include <filesystem>
#include <memory>

#include "clients/rig/ask.h"
#include "clients/rig/format.h"
#include "clients/rig/frame_image.h"
#include "core/base/files.h"
#include "core/base/progress.h"
#include "core/machine/job_config.h"
#include "core/scan/verify.h"
#include "protocol/report_text.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;
using protocol::Reply;
using protocol::Request;

namespace {

Result<void> only_done(const Result<Reply>& reply) {
  if (!reply) return pass(reply);
  return {};
}

}  // namespace

Result<void> status(const Connection& to) {
  Request request;
  request.mutable_get_status();
  const auto reply = ask(to, request, to.wait_s);
  if (reply) std::printf("%s", describe_status(reply->status()).c_str());
  return only_done(reply);
}

Result<void> home(const Connection& to, const std::vector<std::string>& axes) {
  Request request;
  request.mutable_home();
  for (const std::string& axis : axes) request.mutable_home()->add_axes(axis);
  return only_done(ask(to, request, kLongestMotion_s));
}

Result<void> move(const Connection& to, const std::map<std::string, double>& angles_deg) {
  Request request;
  request.mutable_move();
  for (const auto& [axis, angle] : angles_deg) {
    auto& named = *request.mutable_move()->add_axes();
    named.set_axis(axis);
    named.set_angle_deg(angle);
  }
  return only_done(ask(to, request, kLongestMotion_s));
}

Result<void> jog(const Connection& to, const std::string& axis, double by_deg) {
  Request request;
  request.mutable_jog()->set_axis(axis);
  request.mutable_jog()->set_by_deg(by_deg);
  return only_done(ask(to, request, kLongestMotion_s));
}

Result<void> stop(const Connection& to, const std::string& reason) {
  Request request;
  request.mutable_stop()->set_reason(reason);
  return only_done(ask(to, request, to.wait_s));
}

Result<void> clear(const Connection& to) {
  Request request;
  request.mutable_clear_stop();
  return only_done(ask(to, request, to.wait_s));
}

Result<void> light(const Connection& to, const LightChange& change) {
  Request request;
  auto& set = *request.mutable_set_light();
  if (change.on) set.set_on(*change.on);
  if (change.shutter_open) set.set_shutter_open(*change.shutter_open);
  if (change.level) set.set_level(*change.level);
  return only_done(ask(to, request, to.wait_s));
}

Result<void> snap(const Connection& to, double exposure_us, const std::string& out) {
  const auto content = content_for(out);
  if (!content) return pass(content);
  Request request;
  request.mutable_snap()->set_exposure_us(exposure_us);
  request.mutable_snap()->set_full(*content == FrameContent::raw);
  const auto reply = ask(to, request, exposure_us * 1e-6 + 30);
  if (!reply) return pass(reply);
  const auto& frame = reply->frame();
  std::printf("exposure %.0f us, %.3f %% of the sample saturated\n", frame.exposure_us(),
              100 * frame.saturated_share());
  return write_frame(frame, *content, out);
}

Result<void> job_submit(const Connection& to, const std::string& job_file, const std::string& scan) {
  auto text = base::read_file(job_file);
  if (!text) return pass(text);
  // Mistakes in the file are told before anything is sent.
  if (auto job = machine::parse_job_config(*text, job_file); !job) return pass(job);
  Request request;
  auto& submit = *request.mutable_submit_job();
  submit.set_job_toml(*text);
  submit.set_job_name(job_file);
  submit.set_scan_folder(std::filesystem::absolute(scan).lexically_normal().string());
  const auto reply = ask(to, request, std::max(to.wait_s, 30.0));
  if (reply) std::printf("%s\n", describe_job(reply->job()).c_str());
  return only_done(reply);
}

Result<void> job_list(const Connection& to) {
  Request request;
  request.mutable_list_jobs();
  const auto reply = ask(to, request, to.wait_s);
  if (!reply) return pass(reply);
  for (const auto& job : reply->jobs().jobs()) std::printf("%s\n", describe_job(job).c_str());
  if (reply->jobs().jobs().empty()) std::printf("no jobs\n");
  return {};
}

Result<void> job_show(const Connection& to, std::uint64_t job) {
  Request request;
  request.mutable_show_job()->set_job(job);
  const auto reply = ask(to, request, to.wait_s);
  if (reply) std::printf("%s\n", describe_job(reply->job()).c_str());
  return only_done(reply);
}

Result<void> job_abort(const Connection& to, std::uint64_t job) {
  Request request;
  request.mutable_abort_job()->set_job(job);
  return only_done(ask(to, request, to.wait_s));
}

Result<void> job_check(const Connection& to, const std::string& job_file, const std::string& scan) {
  auto text = base::read_file(job_file);
  if (!text) return pass(text);
  if (auto job = machine::parse_job_config(*text, job_file); !job) return pass(job);
  Request request;
  auto& check = *request.mutable_check_job();
  check.set_job_toml(*text);
  check.set_job_name(job_file);
  if (!scan.empty()) check.set_scan_folder(std::filesystem::absolute(scan).lexically_normal().string());
  const auto reply = ask(to, request, std::max(to.wait_s, 30.0));
  if (!reply) return pass(reply);
  std::printf("%s", describe_preflight(reply->preflight()).c_str());
  if (reply->preflight().ok()) return {};
  return fail(ErrorCode::refused, "the rig cannot do this job", job_file, "see the problems above");
}

Result<void> job_report(const Connection& to, std::uint64_t job) {
  Request request;
  request.mutable_get_report()->set_job(job);
  const auto reply = ask(to, request, std::max(to.wait_s, 30.0));
  if (!reply) return pass(reply);
  std::printf("%s", protocol::report_text(reply->report()).c_str());
  return {};
}

Result<void> job_hold(const Connection& to, std::uint64_t job, const std::string& reason) {
  Request request;
  request.mutable_hold_job()->set_job(job);
  request.mutable_hold_job()->set_reason(reason);
  return only_done(ask(to, request, to.wait_s));
}

Result<void> job_release(const Connection& to, std::uint64_t job) {
  Request request;
  request.mutable_release_job()->set_job(job);
  return only_done(ask(to, request, to.wait_s));
}

Result<void> job_reorder(const Connection& to, std::uint64_t job, std::uint64_t before) {
  Request request;
  request.mutable_reorder_job()->set_job(job);
  request.mutable_reorder_job()->set_before(before);
  return only_done(ask(to, request, to.wait_s));
}

Result<void> scan_verify(const std::string& scan) {
  std::unique_ptr<base::Progress> progress;
  const auto report = scan::verify_scan(scan, [&progress](std::size_t left) {
    if (!progress) progress = std::make_unique<base::Progress>("verify", left + 1, "frames");
    progress->add();
  });
  progress.reset();
  if (!report) return pass(report);
  for (const std::string& problem : report->problems) std::printf("problem: %s\n", problem.c_str());
  std::printf("%lld of %lld poses done, %lld abandoned; %zu frames, %.1f MB: %s\n",
              static_cast<long long>(report->progress.done), static_cast<long long>(report->progress.total),
              static_cast<long long>(report->progress.abandoned), report->frames_checked,
              static_cast<double>(report->bytes_checked) * 1e-6,
              report->complete()    ? "complete"
              : report->undamaged() ? "undamaged, not complete"
                                    : "damaged");
  if (report->complete()) return {};
  return fail(ErrorCode::damaged, report->undamaged() ? "the scan is not complete" : "the scan is damaged",
              scan, report->undamaged() ? "let rigd finish its job" : "see the problems above");
}

}  // namespace rig::client
