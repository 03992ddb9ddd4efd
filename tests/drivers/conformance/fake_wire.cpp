#include "tests/drivers/conformance/fake_wire.h"

#include <algorithm>

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;

bool FakeWire::cut() {
  cut_ = true;
  on_its_way_.clear();
  return true;
}

bool FakeWire::restore() {
  cut_ = false;
  return true;
}

bool FakeWire::spoil(Spoil how, int answers) {
  how_ = how;
  spoilt_ = answers;
  return true;
}

bool FakeWire::thin_out(int answers) {
  thinned_ = answers;
  return true;
}

void FakeWire::send(const Words& request) {
  if (cut_ || !device_) return;
  // Longer than the driver waits for one answer, and shorter than for two.
  constexpr auto kLate = std::chrono::milliseconds(150);
  const base::Time now = clock_.now();
  OnItsWay answer{now, device_(request)};
  if (thinned_ > 0 && --thinned_ % 3 != 0) return;
  if (spoilt_ > 0) {
    --spoilt_;
    if (how_ == Spoil::missing) return;
    if (how_ == Spoil::garbage) answer.words = Words(8, spoilt_ % 2 == 0 ? 1.0 : 0.0);
    if (how_ == Spoil::late) answer.arrives = now + kLate;
    if (how_ == Spoil::duplicate) on_its_way_.push_back(answer);
  }
  on_its_way_.push_back(std::move(answer));
  std::stable_sort(on_its_way_.begin(), on_its_way_.end(),
                   [](const OnItsWay& a, const OnItsWay& b) { return a.arrives < b.arrives; });
}

void FakeWire::discard() {
  while (!on_its_way_.empty() && on_its_way_.front().arrives <= clock_.now()) on_its_way_.pop_front();
}

Result<Words> FakeWire::receive(std::chrono::milliseconds within) {
  const base::Time deadline = clock_.now() + within;
  const bool comes = !on_its_way_.empty() && on_its_way_.front().arrives <= deadline;
  const base::Time until = comes ? on_its_way_.front().arrives : deadline;
  if (until > clock_.now()) {
    base::WaitSlot nobody_calls;
    (void)clock_.wait(nobody_calls, until, base::WaitFor::rig);
  }
  if (!comes) return fail(ErrorCode::timeout, fmt::format("no answer within {} ms", within.count()), "fake");
  Words answer = std::move(on_its_way_.front().words);
  on_its_way_.pop_front();
  return answer;
}

Result<Words> FakeLine::ask(const Words& request, std::size_t values) {
  if (flaw_ == Flaw::never_back && lost_) return fail(ErrorCode::lost, "it was lost", "fake");
  if (wire_.is_cut()) {
    lost_ = true;
    if (flaw_ == Flaw::hangs_when_lost) {
      base::WaitSlot nobody_calls;
      (void)clock_.wait(nobody_calls, clock_.now() + std::chrono::seconds(30), base::WaitFor::rig);
    }
    return fail(flaw_ == Flaw::lost_is_device ? ErrorCode::device : ErrorCode::lost, "it is not there",
                "fake");
  }
  if (lost_) ++times_back_;
  lost_ = false;
  auto answer = with_retries(policy_, [&]() -> Result<Words> {
    if (flaw_ != Flaw::reads_old_answers) wire_.discard();
    wire_.send(request);
    auto come = wire_.receive(policy_.answer);
    if (!come) return come;
    const bool whole = come->size() == values + 1 && come->front() == request.front();
    if (!whole && flaw_ != Flaw::believes_garbage) {
      return fail(ErrorCode::damaged, "an answer that is none to this question", "fake");
    }
    come->erase(come->begin());
    come->resize(values);
    return come;
  });
  last_was_bad_ = !answer;
  return answer;
}

}  // namespace rig::drivers::conformance
