// A chip of lines behind a socket, for tests and for rigs without lines: whoever listens plays the kernel. It
// is an AF_UNIX socket of type SOCK_SEQPACKET; each request is one packet of text and is answered by one.
//
//   find NAME                                  ok OFFSET
//   input OFFSET LEVEL BIAS EDGES              ok
//   output OFFSET LEVEL DRIVE START            ok
//   get OFFSET                                 ok 0|1
//   set OFFSET 0|1                             ok
//   edges OFFSET                               ok [0|1@NS ...]
//
// LEVEL is the active one, high or low; BIAS is as-is, none, pull-up or pull-down; EDGES is both or none;
// DRIVE is push-pull, open-drain or open-source; START is 0, 1 or keep. 1 is active. NS is CLOCK_MONOTONIC.
// What fails is answered `error ERRNO` with the number that the kernel would set. The lines are given back,
// at their levels, when the connection ends.
#pragma once

#include <string_view>

#include "drivers/gpiod_lines/line_chip.h"

namespace rig::drivers::gpiod_lines {

[[nodiscard]] Result<std::unique_ptr<LineChip>> open_socket_chip(const std::string& path,
                                                                 const std::vector<LineRequest>& requests);

/// What an answer says behind its "ok". `error ERRNO` is an io error with that text; anything else is
/// damaged.
[[nodiscard]] Result<std::string_view> read_answer(std::string_view answer);
/// "0" or "1".
[[nodiscard]] Result<bool> read_level(std::string_view text);
[[nodiscard]] Result<unsigned int> read_offset(std::string_view text);
/// "1@12 0@15" and so on; at most 4 * kEdgeQueue of them.
[[nodiscard]] Result<std::vector<Edge>> read_edges(std::string_view text);

}  // namespace rig::drivers::gpiod_lines
