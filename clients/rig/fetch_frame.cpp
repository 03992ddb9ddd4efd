#include "clients/rig/fetch_frame.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

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
                                      const WantedFrame& wanted, std::uint64_t offset,
                                      std::uint32_t length = 0) {
  protocol::Request request;
  auto& get = *request.mutable_get_frame();
  get.set_job(wanted.job);
  get.set_row(wanted.row);
  get.set_index(wanted.index);
  get.set_offset(offset);
  get.set_length(length);
  const auto reply = client.ask(request, std::chrono::milliseconds(static_cast<long>(to.wait_s * 1e3)));
  if (!reply) return pass(reply);
  if (reply->outcome() != protocol::DONE) return fail(ErrorCode::refused, reply->reason());
  const auto& piece = reply->frame_piece();
  if (piece.offset() != offset || (piece.content().empty() && offset < piece.file_bytes()))
    return fail(ErrorCode::damaged, "rigd's answer is not the piece that was asked for");
  return piece;
}

Result<void> append(const fs::path& part, const std::string& content) {
  std::ofstream file(part, std::ios::binary | std::ios::app);
  if (!file.write(content.data(), static_cast<std::streamsize>(content.size())) || !file.flush())
    return fail(ErrorCode::io, "cannot be written", part.string());
  return {};
}

// How much of the frame lies there from before. More than the frame has is none of it.
Result<std::uint64_t> begun_bytes(protocol::Client& client, const Connection& to, const WantedFrame& wanted,
                                  const fs::path& part) {
  std::error_code error;
  const std::uint64_t begun = fs::file_size(part, error);
  if (error || begun == 0) return 0;
  const auto beginning = piece_at(client, to, wanted, 0, 1);
  if (!beginning) return pass(beginning);
  if (begun <= beginning->file_bytes()) return begun;
  fs::remove(part, error);
  return 0;
}

// Whether the whole frame has the journal's hash.
Result<bool> fetch_from(protocol::Client& client, const Connection& to, const WantedFrame& wanted,
                        const fs::path& part, std::uint64_t offset) {
  const auto whole_units = [begun = offset](std::uint64_t until) {
    constexpr std::uint64_t kUnit = 1 << 20;
    return static_cast<std::size_t>((until - begun + kUnit - 1) / kUnit);
  };
  std::unique_ptr<base::Progress> progress;
  while (true) {
    if (base::interrupted()) return base::interrupted_error(kGoOn);
    const auto piece = piece_at(client, to, wanted, offset);
    if (!piece) return pass(piece);
    if (!progress)
      progress = std::make_unique<base::Progress>("frame", whole_units(piece->file_bytes()), "MiB");
    if (auto ok = append(part, piece->content()); !ok) return pass(ok);
    const std::uint64_t before = std::exchange(offset, offset + piece->content().size());
    progress->add(whole_units(offset) - whole_units(before));
    if (offset < piece->file_bytes()) continue;
    const auto hash = base::sha256_of_file(part);
    if (!hash) return pass(hash);
    return *hash == piece->sha256();
  }
}

}  // namespace

Result<void> fetch_frame(const Connection& to, const WantedFrame& wanted) {
  auto client = protocol::Client::connect(to.endpoint);
  if (!client) return pass(client);
  const fs::path out = wanted.out;
  fs::path part = out;
  part += ".part";
  const auto begun = begun_bytes(*client, to, wanted, part);
  if (!begun) return pass(begun);
  auto whole = fetch_from(*client, to, wanted, part, *begun);
  if (!whole) return pass(whole);
  std::error_code told_already;
  if (!*whole) fs::remove(part, told_already);
  if (!*whole && *begun > 0) {
    // What lay there was of another frame, or damaged: the whole of it, once.
    whole = fetch_from(*client, to, wanted, part, 0);
    if (!whole) return pass(whole);
    if (!*whole) fs::remove(part, told_already);
  }
  if (*whole) return base::rename_durably(part, out);
  return fail(ErrorCode::damaged, "what came has another hash than the journal has; it was removed",
              out.string(), "fetch it again");
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
