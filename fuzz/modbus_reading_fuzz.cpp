// Whatever words a Modbus drive answers with: they become a state, and a motion that was commanded ends once
// nothing changes any more.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "drivers/modbus_axis/motion_watch.h"

namespace {

using namespace rig::drivers::modbus;

// Every type, order, table and form of flag.
constexpr const char* kDrive = R"(
format = 1
name = "a drive"
[line]
baud = 9600
parity = "none"
word_order = "low_first"
[option.mask]
default = 4
[option.gear]
default = 3
low = 1
[register.status]
address = 1
[register.outputs]
address = 2
type = "u32"
order = "high_first"
[register.inputs]
address = 9
type = "i16"
[register.position]
address = 20
type = "i32"
scale = 0.25
times = "gear"
[register.heat]
address = 4
table = "input"
type = "i16"
scale = 0.1
[register.alarm]
address = 30
type = "u32"
[state]
position = "position"
temperature_c = "heat"
alarm = "alarm"
fault = "not status & 1"
enabled = "outputs & 0xF0 == 0x50"
homed = "status & 0x40"
moving = "outputs != 7"
complete = "status & 0x10"
low_limit = "inputs & {mask}"
high_limit = "inputs == -1"
[alarm]
3 = "hot"
[value.place]
of = "position"
[sequence]
move = ["1 = {place}"]
stop = ["2 = 1"]
)";

// The next word of the input; 0 after its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::uint16_t word() { return static_cast<std::uint16_t>(byte() << 8 | byte()); }
  [[nodiscard]] bool over() const { return at_ >= size_; }

 private:
  unsigned byte() { return at_ < size_ ? data_[at_++] : 0U; }
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Profile profile = [] {
    auto read = parse_profile(kDrive, "a drive");
    if (!read) std::abort();
    return *read;
  }();
  Input input(data, size);
  const OptionValues options{input.word(), input.word() % 65535 + 1};
  const ReadPlan plan = plan_reads(profile, options);
  MotionWatch watch({100, 500, 50, 2});
  rig::base::Time now{};
  Reading last;
  const auto look = [&](bool same) {
    now += std::chrono::milliseconds(10);
    if (!same) {
      std::vector<std::vector<std::uint16_t>> words;
      for (const Block& block : plan.blocks) {
        words.emplace_back();
        for (int i = 0; i < block.count; ++i) words.back().push_back(input.word());
      }
      last = decode_reading(profile, options, plan, words);
      if (!std::isfinite(last.position_counts)) std::abort();
    }
    return watch.moving(now, last);
  };
  while (!input.over()) {
    const std::uint16_t command = input.word();
    if (command % 7 == 0) watch.move(now, last, command);
    if (command % 7 == 1) watch.home(now, last);
    if (command % 7 == 2) watch.stop(now);
    if (command % 7 == 3) watch.forget();
    (void)look(false);
  }
  // From here on the drive says the same for ever: a motion that it does not say goes on is over within
  // what the times allow.
  bool moving = true;
  for (int i = 0; i < 80 && moving; ++i) moving = look(true);
  if (moving && !*last.moving) std::abort();
  (void)alarm_text(profile, input.word());
  return 0;
}
