// One SDO transfer of the client's side (CiA 301): expedited and segmented upload, expedited download.
#pragma once

#include <cstdint>
#include <linux/can.h>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace rig::drivers::cia402 {

/// An entry of a node's object dictionary.
struct Object {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  bool operator==(const Object&) const = default;
};

/// "6099:1"
[[nodiscard]] std::string text_of(Object object);

/// What an abort code says; with its number where it is none of CiA 301's.
[[nodiscard]] std::string text_of_abort(std::uint32_t code);

/// The codes that this side sends, and those that it tells apart.
namespace abort_code {
inline constexpr std::uint32_t kToggle = 0x05030000;
inline constexpr std::uint32_t kTimedOut = 0x05040000;
inline constexpr std::uint32_t kUnknownCommand = 0x05040001;
inline constexpr std::uint32_t kOutOfMemory = 0x05040005;
inline constexpr std::uint32_t kNoObject = 0x06020000;
inline constexpr std::uint32_t kNoSub = 0x06090011;
inline constexpr std::uint32_t kGeneral = 0x08000000;
}  // namespace abort_code

/// Pure: it is told every frame that arrives and says what to send. A frame that is no answer to what was
/// asked last is passed over: an answer to an earlier question has another object or another command. That a
/// late answer to the very same question is not taken is the business of who asks again (Network::fence).
class SdoTransfer {
 public:
  [[nodiscard]] static SdoTransfer upload(int node, Object object);
  /// At most 4 bytes, in the order of the wire.
  [[nodiscard]] static SdoTransfer download(int node, Object object, std::string_view bytes);

  /// The frame that begins it.
  [[nodiscard]] const can_frame& request() const { return request_; }

  enum class State { waiting, done, failed };

  /// The frame to send next, if any. Once it is done or has failed nothing more is taken.
  [[nodiscard]] std::optional<can_frame> hear(const can_frame& frame);

  [[nodiscard]] State state() const { return state_; }
  /// Of an upload that is done, in the order of the wire.
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  /// Why it failed: `not_found` where the node has no such object, `device` where it aborted for another
  /// reason, `damaged` where it did not understand the question or its answer contradicts the protocol.
  [[nodiscard]] const base::Error& error() const { return error_; }
  /// The node's own code, where it aborted.
  [[nodiscard]] std::optional<std::uint32_t> aborted_with() const { return aborted_with_; }
  /// Whether something came from the node's server that no server sends in answer to anything.
  [[nodiscard]] bool saw_garbage() const { return saw_garbage_; }

  /// Ends the transfer at the node too; it answers nothing to it.
  [[nodiscard]] can_frame abort(std::uint32_t code) const;

 private:
  SdoTransfer(int node, Object object, bool is_upload);
  [[nodiscard]] can_frame fresh() const;
  [[nodiscard]] bool names_object(const can_frame& frame) const;
  [[nodiscard]] std::optional<can_frame> begin_upload(const can_frame& frame);
  [[nodiscard]] std::optional<can_frame> take_segment(const can_frame& frame);
  [[nodiscard]] can_frame ask_segment() const;
  [[nodiscard]] std::optional<can_frame> fail(std::uint32_t code, std::string what);

  int node_;
  Object object_;
  bool is_upload_;
  can_frame request_{};
  State state_ = State::waiting;
  std::string bytes_;
  base::Error error_;
  std::optional<std::uint32_t> aborted_with_;
  bool saw_garbage_ = false;
  bool in_segments_ = false;
  bool toggle_ = false;
  std::optional<std::size_t> announced_;  // how long a segmented upload is to be
};

}  // namespace rig::drivers::cia402
