#include "clients/rig/ask.h"

#include "protocol/client.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;
using protocol::Reply;
using protocol::Request;

namespace {

constexpr double kLongestWait_s = 86400;

}  // namespace

Result<Reply> ask(const Connection& to, const Request& request, double timeout_s) {
  // Written so that NaN is refused too.
  if (!(timeout_s >= 0 && timeout_s <= kLongestWait_s))
    return fail(ErrorCode::bad_input, fmt::format("{} s is no time to wait for an answer", timeout_s));
  auto client = protocol::Client::connect(to.endpoint);
  if (!client) return pass(client);
  auto reply = client->ask(request, std::chrono::milliseconds(static_cast<long>(timeout_s * 1e3)));
  if (!reply) return reply;
  if (reply->outcome() == protocol::DONE) return reply;
  const bool refused = reply->outcome() == protocol::REFUSED;
  return fail(refused ? ErrorCode::refused : ErrorCode::device,
              fmt::format("{}: {}", refused ? "refused" : "failed", reply->reason()));
}

}  // namespace rig::client
