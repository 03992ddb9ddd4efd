#include "clients/rig/dialogue.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <poll.h>
#include <unistd.h>

#include "core/base/interrupt.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr int kLookForInterrupt_ms = 100;

std::string trimmed(const std::string& line) {
  constexpr const char* kSpace = " \t\r\n";
  const auto first = line.find_first_not_of(kSpace);
  if (first == std::string::npos) return {};
  return line.substr(first, line.find_last_not_of(kSpace) - first + 1);
}

}  // namespace

Dialogue::Dialogue(int answers) : answers_(answers), echo_(::isatty(answers) != 1) {}

void Dialogue::say(const std::string& text) const {
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

Result<std::string> Dialogue::ask(const std::string& question) {
  std::printf("%s ", question.c_str());
  std::fflush(stdout);
  while (buffer_.find('\n') == std::string::npos) {
    if (base::interrupted()) {
      std::printf("\n");
      return base::interrupted_error("nothing was changed");
    }
    pollfd waiting{answers_, POLLIN, 0};
    if (::poll(&waiting, 1, kLookForInterrupt_ms) <= 0) continue;
    std::array<char, 512> part{};
    const ssize_t n = ::read(answers_, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      std::printf("\n");
      return fail(ErrorCode::bad_input, "the answers ended before the questions", {}, "nothing was changed");
    }
    buffer_.append(part.data(), static_cast<std::size_t>(n));
  }
  const std::size_t end = buffer_.find('\n');
  const std::string answer = trimmed(buffer_.substr(0, end));
  buffer_.erase(0, end + 1);
  if (echo_) say(answer);
  return answer;
}

Result<bool> Dialogue::agrees(const std::string& question, bool fallback) {
  while (true) {
    auto answer = ask(question + (fallback ? " [Y/n]" : " [y/N]"));
    if (!answer) return pass(answer);
    std::transform(answer->begin(), answer->end(), answer->begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (answer->empty()) return fallback;
    if (*answer == "y" || *answer == "yes") return true;
    if (*answer == "n" || *answer == "no") return false;
    say("  y or n, please");
  }
}

}  // namespace rig::client
