#include "clients/rig/fetch_frame.h"

#include <filesystem>
#include <fstream>
#include <memory>

#include "core/base/files.h"
#include "core/base/hash.h"
#include "core/base/interrupt.h"
#include "core/base/progress.h"
#include "protocol/client.h"

namespace rig::client {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

constexpr const char* kGoOn = "the same command goes on where it broke off";

Result<protocol::FramePiece> piece_at(protocol::Client& client, const Connection& to,
                                      const WantedFrame& wanted, std::uint64_t offset) {
  protocol::Request request;
  auto& get = *request.mutable_get_frame();
  get.set_job(wanted.job);
  get.set_row(wanted.row);
  get.set_index(wanted.index);
  get.set_offset(offset);
  const auto reply = client.ask(request, std::chrono::milliseconds(static_cast<long>(to.wait_s * 1e3)));
  if (!reply) return pass(reply);
  if (reply->outcome() != protocol::DONE) return fail(ErrorCode::refused, reply->reason());
  return reply->frame_piece();
}

Result<void> append(const fs::path& part, const std::string& content) {
  std::ofstream file(part, std::ios::binary | std::ios::app);
  if (!file.write(content.data(), static_cast<std::streamsize>(content.size())) || !file.flush())
    return fail(ErrorCode::io, "cannot be written", part.string());
  return {};
}

}  // namespace

Result<void> fetch_frame(const Connection& to, const WantedFrame& wanted) {
  auto client = protocol::Client::connect(to.endpoint);
  if (!client) return pass(client);
  const fs::path out = wanted.out;
  fs::path part = out;
  part += ".part";
  std::error_code not_there;
  const auto begun = fs::file_size(part, not_there);
  std::uint64_t offset = not_there ? 0 : begun;
  std::unique_ptr<base::Progress> progress;
  while (true) {
    if (base::interrupted()) return base::interrupted_error(kGoOn);
    const auto piece = piece_at(*client, to, wanted, offset);
    if (!piece) return pass(piece);
    if (!progress) {
      constexpr std::uint64_t kUnit = 1 << 20;
      progress = std::make_unique<base::Progress>(
          "frame", static_cast<std::size_t>((piece->file_bytes() - offset + kUnit - 1) / kUnit), "MiB");
    }
    if (auto ok = append(part, piece->content()); !ok) return ok;
    offset += piece->content().size();
    progress->add((piece->content().size() + (1 << 20) - 1) >> 20);
    if (offset < piece->file_bytes()) continue;
    const auto hash = base::sha256_of_file(part);
    if (!hash) return pass(hash);
    if (*hash == piece->sha256()) return base::rename_durably(part, out);
    std::error_code told_already;
    fs::remove(part, told_already);
    return fail(ErrorCode::damaged, "what came has another hash than the journal has; it was removed",
                out.string(), "fetch it again");
  }
}

void offer_frame(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen) {
  auto* fetch = command(app, "frame", "fetch a frame of a job from rigd, checked by its hash");
  const auto wanted = std::make_shared<WantedFrame>();
  fetch->add_option("job", wanted->job, "the job's number")->required();
  fetch->add_option("row", wanted->row, "of the plan")->required();
  fetch->add_option("index", wanted->index, "within the bracket, from 0")->required();
  fetch->add_option("--out", wanted->out, "the file; until it is complete it is FILE.part")->required();
  fetch->callback([&to, &chosen, wanted] { chosen = [&to, wanted] { return fetch_frame(to, *wanted); }; });
}

}  // namespace rig::client
