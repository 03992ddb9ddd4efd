#include "sim/wire/answers.h"

namespace rig::sim::wire {

void Answers::spoil(Spoil how, int answers) {
  how_ = how;
  to_spoil_ = answers;
}

void Answers::forget() {
  to_spoil_ = 0;
  late_.clear();
}

void Answers::send(Time now, std::string_view answer) {
  if (to_spoil_ == 0) {
    line_.write(answer);
    return;
  }
  --to_spoil_;
  switch (how_) {
    case Spoil::missing:
      return;
    case Spoil::garbage: {
      std::string noise;
      for (std::size_t i = 0; i < answer.size(); ++i) {
        noise_ = noise_ * 1664525U + 1013904223U;
        noise.push_back(static_cast<char>(noise_ >> 24U));
      }
      line_.write(noise);
      return;
    }
    case Spoil::late:
      late_.push_back({now + lateness_, std::string(answer)});
      return;
    case Spoil::duplicate:
      line_.write(std::string(answer) + std::string(answer));
      return;
    case Spoil::two_of_three:
      if (to_spoil_ % 3 == 0) line_.write(answer);
      return;
  }
}

void Answers::tick(Time now) {
  while (!late_.empty() && late_.front().due <= now) {
    line_.write(late_.front().bytes);
    late_.pop_front();
  }
}

}  // namespace rig::sim::wire
