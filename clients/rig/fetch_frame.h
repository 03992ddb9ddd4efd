// `rig frame`: a stored frame from a rigd elsewhere, gone on with where it broke off, proven by its hash.
#pragma once

#include <cstdint>
#include <string>

#include "clients/rig/access_options.h"

namespace rig::client {

struct WantedFrame {
  std::uint64_t job = 0;
  std::int64_t row = 0;
  unsigned index = 0;
  std::string out;  ///< until it is complete and its hash is right it is <out>.part
};
[[nodiscard]] Result<void> fetch_frame(const Connection& to, const WantedFrame& wanted);

/// All that is handed in must live until `chosen` has been called.
void offer_frame(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen);

}  // namespace rig::client
