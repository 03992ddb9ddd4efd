#include "drivers/modbus_axis/flags.h"

#include <algorithm>
#include <sstream>

namespace rig::drivers::modbus {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr const char* kForm = "'REGISTER & MASK', 'REGISTER == NUMBER', 'never' or 'always'";

std::uint32_t bits(std::int64_t number) {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(number));
}

}  // namespace

Result<Flag> parse_flag(const std::string& text, const std::vector<std::string>& registers,
                        const std::vector<Option>& options) {
  Flag flag;
  if (text == "never") return flag;
  if (text == "always" || text == "remembered") {
    flag.kind = text == "always" ? Flag::Kind::always : Flag::Kind::remembered;
    return flag;
  }
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  std::size_t at = 0;
  const auto next = [&] { return at < words.size() ? words[at++] : std::string(); };
  flag.kind = Flag::Kind::test;
  std::string word = next();
  if (word == "not") {
    flag.opposite = true;
    word = next();
  }
  const auto named = std::find(registers.begin(), registers.end(), word);
  if (named == registers.end()) {
    return fail(ErrorCode::bad_input, fmt::format("there is no register '{}' in '{}'", word, text), {},
                std::string("it reads ") + kForm);
  }
  flag.of_register = static_cast<std::size_t>(named - registers.begin());
  word = next();
  if (word == "&") {
    auto mask = parse_number(next(), options);
    if (!mask) return pass(mask);
    flag.masked = true;
    flag.mask = *mask;
    word = next();
  }
  bool understood = flag.masked;
  if (word == "==" || word == "!=") {
    auto number = parse_number(next(), options);
    if (!number) return pass(number);
    flag.number = *number;
    flag.compare = word == "==" ? Flag::Compare::equal : Flag::Compare::unequal;
    understood = true;
    word = next();
  }
  if (!understood || !word.empty()) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' is not understood", text), {},
                std::string("it reads ") + kForm);
  }
  return flag;
}

bool is_told(const Flag& flag, const OptionValues& options) {
  if (flag.kind != Flag::Kind::test) return flag.kind == Flag::Kind::always;
  return !flag.masked || flag.mask.value(options) != 0;
}

bool holds(const Flag& flag, std::int64_t raw, const OptionValues& options) {
  if (flag.kind != Flag::Kind::test) return flag.kind == Flag::Kind::always;
  if (!is_told(flag, options)) return false;
  const std::uint32_t masked = flag.masked ? bits(raw) & bits(flag.mask.value(options)) : bits(raw);
  bool held = masked != 0;
  if (flag.compare != Flag::Compare::any) {
    held = (masked == bits(flag.number.value(options))) == (flag.compare == Flag::Compare::equal);
  }
  return held != flag.opposite;
}

}  // namespace rig::drivers::modbus
