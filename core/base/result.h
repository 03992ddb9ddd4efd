// Errors that a caller can expect (device answers, files, configuration) are values; exceptions are for bugs
// and for what nobody can act on.
#pragma once

#include <fmt/format.h>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace rig::base {

enum class ErrorCode {
  bad_input,    ///< a file, a key or an argument is wrong: the user can mend it
  not_found,    ///< something that was named does not exist
  io,           ///< the operating system refused or failed
  damaged,      ///< data exist and contradict themselves or their hash
  newer,        ///< written by a newer version than this one reads
  device,       ///< a device reported a fault
  timeout,      ///< a deadline passed
  busy,         ///< correct, but not now
  refused,      ///< a rule forbids it
  interrupted,  ///< a person or the system asked to end
  lost,         ///< a device is gone for now and may come back by itself
};

/// What went wrong, where, and what to do about it, each in words for a person.
struct Error {
  ErrorCode code = ErrorCode::io;
  std::string what;   ///< "unknown key 'speeed_deg_s'"
  std::string where;  ///< "rig.toml:12:3 axis.pan" or a path; may be empty
  std::string hint;   ///< "did you mean 'speed_deg_s'?"; may be empty

  /// "where: what (hint)" with the parts that exist.
  [[nodiscard]] std::string text() const {
    std::string out = where.empty() ? what : where + ": " + what;
    return hint.empty() ? out : out + " (" + hint + ")";
  }
};

template <typename T>
using Result = tl::expected<T, Error>;

/// An Error as the failing return value of a function that returns a Result.
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string what, std::string where = {},
                                                std::string hint = {}) {
  return tl::unexpected<Error>(Error{code, std::move(what), std::move(where), std::move(hint)});
}

/// Hands an error on unchanged: `if (!r) return pass(r);`
template <typename T>
[[nodiscard]] tl::unexpected<Error> pass(const Result<T>& failed) {
  return tl::unexpected<Error>(failed.error());
}

}  // namespace rig::base
