#include "drivers/modbus_axis/profile.h"

#include <algorithm>
#include <array>

#include "core/base/config.h"

namespace rig::drivers::modbus {

namespace fs = std::filesystem;
using base::ConfigTable;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

template <typename T>
struct Word {
  const char* name;
  T is;
};

constexpr std::array kTypes{Word<WordType>{"u16", WordType::u16}, Word<WordType>{"i16", WordType::i16},
                            Word<WordType>{"u32", WordType::u32}, Word<WordType>{"i32", WordType::i32}};
constexpr std::array kOrders{Word<WordOrder>{"high_first", WordOrder::high_first},
                             Word<WordOrder>{"low_first", WordOrder::low_first}};
constexpr std::array kTables{Word<Table>{"holding", Table::holding}, Word<Table>{"input", Table::input}};
constexpr std::array kQuantities{Word<Quantity>{"position", Quantity::position},
                                 Word<Quantity>{"velocity", Quantity::velocity},
                                 Word<Quantity>{"acceleration", Quantity::acceleration},
                                 Word<Quantity>{"max_velocity", Quantity::max_velocity},
                                 Word<Quantity>{"max_acceleration", Quantity::max_acceleration},
                                 Word<Quantity>{"soft_low", Quantity::soft_low},
                                 Word<Quantity>{"soft_high", Quantity::soft_high}};
constexpr std::array kRoundings{Word<Rounding>{"nearest", Rounding::nearest},
                                Word<Rounding>{"down", Rounding::down}, Word<Rounding>{"up", Rounding::up}};

/// The meaning of a word that stands at `key`; `usual` where the key is absent. Without `usual` it must be
/// there.
template <typename Words, typename T>
T read_word(const ConfigTable& table, const char* key, const Words& words, std::optional<T> usual) {
  if (usual && !table.has(key)) return *usual;
  std::vector<std::string> names;
  for (const auto& word : words) names.emplace_back(word.name);
  const std::string read = table.choice(key, names);
  for (const auto& word : words) {
    if (read == word.name) return word.is;
  }
  return words[0].is;
}

/// Reads one profile, section by section, and notes every mistake in its table.
class Reader {
 public:
  explicit Reader(const ConfigTable& root) : root_(root) {}

  Profile read() {
    (void)root_.integer("format", 1, 1);
    profile_.name = root_.text("name");
    read_line(root_.table("line"));
    read_options();
    read_registers();
    read_values();
    read_state(root_.table("state"));
    if (const auto alarms = root_.table_if("alarm")) read_alarms(*alarms);
    if (const auto motion = root_.table_if("motion")) read_motion(*motion);
    read_sequences(root_.table("sequence"));
    return std::move(profile_);
  }

 private:
  void read_line(const ConfigTable& table) {
    profile_.line.baud = static_cast<int>(table.integer("baud", 1200, 921600));
    const std::string parity = table.choice("parity", {"none", "even", "odd"});
    profile_.line.parity = parity == "even" ? 'E' : parity == "odd" ? 'O' : 'N';
    profile_.line.stop_bits = static_cast<int>(table.integer_or("stop_bits", 1, 1, 2));
    profile_.line.gap_ms = static_cast<int>(table.integer_or("gap_ms", 0, 0, 100));
    profile_.line.one_word_single =
        table.choice_or("one_word", "multiple", {"single", "multiple"}) == "single";
    order_ = read_word(table, "word_order", kOrders, std::optional<WordOrder>());
  }

  /// The tables below [section.*], whose names stand in braces or in flags elsewhere.
  std::vector<std::pair<std::string, ConfigTable>> named_tables(const char* section) {
    std::vector<std::pair<std::string, ConfigTable>> tables;
    const auto all = root_.table_if(section);
    if (!all) return tables;
    for (const std::string& name : all->keys()) {
      const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
      });
      if (!plain || name.empty() || name == "not") {
        all->error(name, fmt::format("'{}' cannot be a name", name), "small letters, digits and _");
      }
      tables.emplace_back(name, all->table(name));
    }
    return tables;
  }

  Format read_format(const ConfigTable& table, WordType usual) {
    return {read_word(table, "type", kTypes, std::optional(usual)),
            read_word(table, "order", kOrders, std::optional(order_))};
  }

  std::optional<std::size_t> option_at(const ConfigTable& table, const char* key) {
    if (!table.has(key)) return std::nullopt;
    const std::string name = table.text(key);
    for (std::size_t i = 0; i < profile_.options.size(); ++i) {
      if (profile_.options[i].name != name) continue;
      if (profile_.options[i].low < 1) {
        table.error(key, fmt::format("option '{}' may be less than 1, and cannot be a factor", name));
      }
      return i;
    }
    table.error(key, fmt::format("there is no option '{}'", name));
    return std::nullopt;
  }

  Factor read_factor(const ConfigTable& table) {
    Factor factor;
    factor.scale = table.number_or("scale", 1, {1e-9, 1e9});
    factor.times = option_at(table, "times");
    factor.per = option_at(table, "per");
    return factor;
  }

  void read_options() {
    for (const auto& [name, table] : named_tables("option")) {
      Option option;
      option.name = name;
      option.format = read_format(table, WordType::u16);
      const std::int64_t low = least(option.format.type), high = most(option.format.type);
      option.low = table.integer_or("low", low, low, high);
      option.high = table.integer_or("high", high, option.low, high);
      option.fallback = table.integer("default", option.low, option.high);
      (void)table.text_or("about", "");
      profile_.options.push_back(option);
    }
  }

  /// `address`, or `address_option` where drives of one kind differ in it.
  Number read_address(const ConfigTable& table, std::int64_t last) {
    if (!table.has("address_option")) return {table.integer("address", 0, last)};
    if (table.has("address")) table.error("address", "stands beside 'address_option'");
    const std::string name = table.text("address_option");
    for (std::size_t i = 0; i < profile_.options.size(); ++i) {
      const Option& option = profile_.options[i];
      if (option.name != name) continue;
      if (option.low < 0 || option.high > last) {
        table.error("address_option", fmt::format("option '{}' may be no address", name),
                    fmt::format("its low must be at least 0, its high at most {}", last));
      }
      return {0, i};
    }
    table.error("address_option", fmt::format("there is no option '{}'", name));
    return {};
  }

  void read_registers() {
    for (const auto& [name, table] : named_tables("register")) {
      Register reg;
      reg.name = name;
      reg.table = read_word(table, "table", kTables, std::optional(Table::holding));
      reg.format = read_format(table, WordType::u16);
      reg.factor = read_factor(table);
      reg.address = read_address(table, most(WordType::u16) + 1 - static_cast<std::int64_t>(reg.words()));
      profile_.registers.push_back(reg);
      register_names_.push_back(name);
    }
  }

  void read_values() {
    for (const auto& [name, table] : named_tables("value")) {
      Value value;
      value.name = name;
      value.of = read_word(table, "of", kQuantities, std::optional<Quantity>());
      const bool place = is_place(value.of);
      value.format = read_format(table, place ? WordType::i32 : WordType::u16);
      value.factor = read_factor(table);
      value.inverse = table.boolean_or("inverse", false);
      if (place && value.inverse) table.error("inverse", "a place has no inverse");
      // Of speeds the drive gets no more than was allowed; a time per speed is rounded up for the same end.
      const Rounding usual = place ? Rounding::nearest : value.inverse ? Rounding::up : Rounding::down;
      value.round = read_word(table, "round", kRoundings, std::optional(usual));
      const std::int64_t low = least(value.format.type), high = most(value.format.type);
      value.low = table.integer_or("low", place ? low : 1, low, high);
      value.high = table.integer_or("high", high, value.low, high);
      for (const Option& option : profile_.options) {
        if (option.name == name) table.error("", fmt::format("'{}' is an option, too", name));
      }
      profile_.values.push_back(value);
    }
  }

  std::size_t register_at(const ConfigTable& table, const char* key) {
    const std::size_t before = root_.errors();
    const std::string name = table.text(key);
    const auto found = std::find(register_names_.begin(), register_names_.end(), name);
    if (found != register_names_.end()) return static_cast<std::size_t>(found - register_names_.begin());
    if (root_.errors() == before) table.error(key, fmt::format("there is no register '{}'", name));
    return 0;
  }

  Flag flag_at(const ConfigTable& table, const char* key, bool may_be_remembered = false) {
    const std::size_t before = root_.errors();
    const std::string text = table.text(key);
    if (root_.errors() != before) return {};
    const auto flag = parse_flag(text, register_names_, profile_.options);
    if (!flag) {
      table.error(key, flag.error().what, flag.error().hint);
      return {};
    }
    if (flag->kind == Flag::Kind::remembered && !may_be_remembered) {
      table.error(key, "only 'homed' can be remembered");
    }
    return *flag;
  }

  void read_state(const ConfigTable& table) {
    profile_.position = register_at(table, "position");
    if (table.has("temperature_c")) profile_.temperature = register_at(table, "temperature_c");
    if (table.has("alarm")) profile_.alarm = register_at(table, "alarm");
    profile_.fault = flag_at(table, "fault");
    profile_.enabled = flag_at(table, "enabled");
    profile_.homed = flag_at(table, "homed", true);
    if (table.has("moving")) profile_.moving = flag_at(table, "moving");
    if (table.has("complete")) profile_.complete = flag_at(table, "complete");
    if (!profile_.moving && !profile_.complete) {
      table.error("", "neither 'moving' nor 'complete' says whether the motor moves", "give one of them");
    }
    if (table.has("low_limit")) profile_.low_limit = flag_at(table, "low_limit");
    if (table.has("high_limit")) profile_.high_limit = flag_at(table, "high_limit");
    profile_.keeps_position_unpowered = table.boolean_or("keeps_position_unpowered", false);
  }

  void read_alarms(const ConfigTable& table) {
    for (const std::string& key : table.keys()) {
      const std::string text = table.text(key);
      const auto code = parse_whole(key);
      if (!code) {
        table.error(key, "is no alarm's number", "as 17 or 0x11");
      } else if (!profile_.alarms.emplace(*code, text).second) {
        table.error(key, "stands twice, in two ways of writing");
      }
    }
    if (!profile_.alarm) table.error("", "[state] names no register 'alarm'");
  }

  void read_motion(const ConfigTable& table) {
    MotionTimes& motion = profile_.motion;
    motion.take_ms = static_cast<int>(table.integer_or("take_ms", motion.take_ms, 1, 5000));
    motion.finish_ms = static_cast<int>(table.integer_or("finish_ms", motion.finish_ms, 0, 60000));
    motion.still_ms = static_cast<int>(table.integer_or("still_ms", motion.still_ms, 0, 5000));
    motion.enable_ms = static_cast<int>(table.integer_or("enable_ms", motion.enable_ms, 0, 500));
    motion.tolerance_counts = table.number_or("tolerance_counts", motion.tolerance_counts, {0, 1e6});
    profile_.replaces_moves = table.choice_or("while_moving", "replace", {"replace", "refuse"}) == "replace";
  }

  std::vector<Step> steps_at(const ConfigTable& table, const char* key, bool must,
                             std::vector<Quantity> known) {
    std::vector<Step> steps;
    if (!must && !table.has(key)) return steps;
    const std::vector<std::string> texts = table.texts(key);
    for (std::size_t i = 0; i < texts.size(); ++i) {
      auto step = parse_step(texts[i], profile_.options, profile_.values, known);
      if (step) {
        steps.push_back(*step);
      } else {
        table.error(key, fmt::format("item {}: {}", i + 1, step.error().what), step.error().hint);
      }
    }
    if (must && texts.empty() && table.has(key)) table.error(key, "is empty: the drive would do nothing");
    return steps;
  }

  void read_sequences(const ConfigTable& table) {
    const std::vector<Quantity> always{Quantity::max_velocity, Quantity::max_acceleration};
    const auto with = [&always](std::vector<Quantity> more) {
      more.insert(more.end(), always.begin(), always.end());
      return more;
    };
    profile_.expect = steps_at(table, "expect", false, {});
    profile_.setup = steps_at(table, "setup", false, always);
    profile_.enable = steps_at(table, "enable", false, always);
    profile_.disable = steps_at(table, "disable", false, always);
    profile_.clear_alarm = steps_at(table, "clear_alarm", false, always);
    profile_.home = steps_at(table, "home", false, always);
    profile_.stop = steps_at(table, "stop", true, always);
    profile_.soft_limits =
        steps_at(table, "soft_limits", false, with({Quantity::soft_low, Quantity::soft_high}));
    profile_.move =
        steps_at(table, "move", true, with({Quantity::position, Quantity::velocity, Quantity::acceleration}));
    profile_.jog =
        steps_at(table, "jog", false, with({Quantity::position, Quantity::velocity, Quantity::acceleration}));
    const bool places = std::any_of(profile_.move.begin(), profile_.move.end(), [this](const Step& step) {
      return std::any_of(step.items.begin(), step.items.end(), [this](const Step::Item& item) {
        const auto* value = std::get_if<Step::ValueOf>(&item);
        return value != nullptr && profile_.values[value->value].of == Quantity::position;
      });
    });
    if (!profile_.move.empty() && !places) table.error("move", "no step writes a position");
  }

  const ConfigTable& root_;
  Profile profile_;
  WordOrder order_ = WordOrder::high_first;
  std::vector<std::string> register_names_;
};

}  // namespace

Result<Profile> parse_profile(std::string_view text, const std::string& name) {
  const auto root = ConfigTable::parse(text, name);
  if (!root) return pass(root);
  Profile profile = Reader(*root).read();
  if (auto fine = root->finish(); !fine) return pass(fine);
  return profile;
}

Result<fs::path> find_profile(const std::string& profile) {
  std::error_code error;
  if (profile.find('/') != std::string::npos) {
    if (fs::is_regular_file(profile, error)) return fs::path(profile);
    return fail(ErrorCode::not_found, fmt::format("there is no file {}", profile));
  }
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const std::array folders{
      program.parent_path().parent_path() / "share" / "rigd" / "drives",
      program.parent_path().parent_path().parent_path().parent_path() / "share" / "drives"};
  for (const fs::path& folder : folders) {
    const fs::path path = folder / (profile + ".toml");
    if (fs::is_regular_file(path, error)) return path;
  }
  return fail(ErrorCode::not_found, fmt::format("there is no drive '{}'", profile), {},
              fmt::format("looked for {}.toml in {} and {}; or write a path with a slash", profile,
                          folders[0].string(), folders[1].string()));
}

}  // namespace rig::drivers::modbus
