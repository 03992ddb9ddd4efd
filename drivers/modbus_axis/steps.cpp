#include "drivers/modbus_axis/steps.h"

#include <algorithm>
#include <limits>
#include <sstream>

namespace rig::drivers::modbus {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// What one request of the protocol may write.
constexpr std::size_t kMostWords = 123;

Result<Step::Item> parse_item(const std::string& text, const std::vector<Option>& options,
                              const std::vector<Value>& values, const std::vector<Quantity>& known) {
  if (const auto name = placeholder(text)) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i].name != *name) continue;
      if (std::find(known.begin(), known.end(), values[i].of) == known.end()) {
        return fail(ErrorCode::bad_input, fmt::format("'{}' is not known in this sequence", *name));
      }
      return Step::ValueOf{i};
    }
    for (std::size_t i = 0; i < options.size(); ++i) {
      if (options[i].name == *name) return Step::OptionOf{i};
    }
    return fail(ErrorCode::bad_input, fmt::format("there is no value and no option '{}'", *name));
  }
  const auto word = parse_whole(text);
  if (!word || *word < least(WordType::i16) || *word > most(WordType::u16)) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' is no word of 16 bits and no {{NAME}}", text));
  }
  return static_cast<std::uint16_t>(static_cast<std::uint64_t>(*word));
}

std::size_t words_in(const Step::Item& item, const std::vector<Option>& options,
                     const std::vector<Value>& values) {
  if (const auto* option = std::get_if<Step::OptionOf>(&item)) {
    return words_of(options[option->option].format.type);
  }
  if (const auto* value = std::get_if<Step::ValueOf>(&item)) {
    return words_of(values[value->value].format.type);
  }
  return 1;
}

}  // namespace

Quantities::Quantities() {
  of.fill(std::numeric_limits<double>::quiet_NaN());
}

Result<Step> parse_step(const std::string& text, const std::vector<Option>& options,
                        const std::vector<Value>& values, const std::vector<Quantity>& known) {
  std::istringstream in(text);
  std::string address, equals;
  in >> address >> equals;
  const auto number = parse_whole(address);
  if (!number || *number < 0 || *number > most(WordType::u16) || equals != "=") {
    return fail(ErrorCode::bad_input, fmt::format("'{}' is not understood", text), {},
                "it reads 'ADDRESS = WORD ...', as '0x6002 = 0x0010'");
  }
  Step step;
  step.address = static_cast<std::uint16_t>(*number);
  std::size_t words = 0;
  for (std::string word; in >> word;) {
    auto item = parse_item(word, options, values, known);
    if (!item) return pass(item);
    words += words_in(*item, options, values);
    step.items.push_back(*item);
  }
  if (words == 0) return fail(ErrorCode::bad_input, fmt::format("'{}' writes nothing", text));
  if (words > kMostWords) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' writes {} words at once, the protocol {} at most",
                                                  text, words, kMostWords));
  }
  if (step.address + words - 1 > std::numeric_limits<std::uint16_t>::max()) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' writes beyond the last register", text));
  }
  return step;
}

Result<Write> fill_in(const Step& step, const std::vector<Option>& options, const OptionValues& option_values,
                      const std::vector<Value>& values, const Quantities& quantities) {
  Write write{step.address, {}};
  for (const Step::Item& item : step.items) {
    if (const auto* word = std::get_if<std::uint16_t>(&item)) {
      write.words.push_back(*word);
    } else if (const auto* option = std::get_if<Step::OptionOf>(&item)) {
      encode(option_values[option->option], options[option->option].format, write.words);
    } else {
      const Value& value = values[std::get<Step::ValueOf>(item).value];
      auto number = to_drive(value, quantities[value.of], option_values);
      if (!number) return pass(number);
      encode(*number, value.format, write.words);
    }
  }
  return write;
}

}  // namespace rig::drivers::modbus
