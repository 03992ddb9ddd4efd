// Says what the rig is doing, then prints every event until one job has ended. docs/protocol.md says how to
// compile it.
#include <cstdio>

#include "protocol/client.h"

using namespace rig;
using std::chrono::seconds;

namespace {

int report(const base::Error& error) {
  std::fprintf(stderr, "follow_rig: %s\n", error.text().c_str());
  return 1;
}

bool ended(const protocol::JobInfo& job) {
  return job.state() == protocol::COMPLETE || job.state() == protocol::ABORTED ||
         job.state() == protocol::JOB_FAILED;
}

}  // namespace

int main(int argc, char** argv) {
  auto client = protocol::Client::connect(argc > 1 ? argv[1] : protocol::default_endpoint());
  if (!client) return report(client.error());

  // An Error is a connection that failed; a refusal is an answer.
  protocol::Request request;
  request.mutable_get_status();
  auto reply = client->ask(request, seconds(5));
  if (!reply) return report(reply.error());
  if (reply->outcome() != protocol::DONE) {
    std::fprintf(stderr, "follow_rig: %s\n", reply->reason().c_str());
    return 1;
  }
  const std::uint64_t epoch = reply->status().epoch();
  const std::uint64_t last = reply->status().last_event();
  std::printf("%s: %s\n", reply->status().rig_name().c_str(),
              protocol::Mode_Name(reply->status().mode()).c_str());

  // What happened since that status comes with the answer, all that follows behind it: nothing is missed
  // between.
  request.mutable_subscribe()->set_epoch(epoch);
  request.mutable_subscribe()->set_after(last);
  reply = client->ask(request, seconds(5));
  if (!reply) return report(reply.error());
  for (const auto& event : reply->catch_up().missed()) std::printf("%s\n", event.ShortDebugString().c_str());

  while (true) {
    auto event = client->next_event(seconds(60));
    if (!event) return report(event.error());
    if (!*event) continue;  // nothing happened for a minute
    std::printf("%s\n", (*event)->ShortDebugString().c_str());
    if ((*event)->has_job_changed() && ended((*event)->job_changed().job())) return 0;
  }
}
