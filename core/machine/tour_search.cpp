#include "core/machine/tour_search.h"

#include <algorithm>

namespace rig::machine {

namespace {

constexpr std::size_t kNeighbours = 8;
constexpr std::size_t kLongestTurned = 500;    // places; longer ones seldom help and take long
constexpr std::size_t kLongestTurnedRun = 3;   // put elsewhere backwards
constexpr std::size_t kLongestRun = 30;        // put elsewhere in its own direction
constexpr std::size_t kLongestExchanged = 10;  // at random
constexpr double kWorthwhile_s = 1e-5;         // well above the rounding of single precision
constexpr std::uint64_t kSeed = 1;
constexpr std::size_t kTellEvery = 1000;

}  // namespace

TourSearch::TourSearch(TravelTimes& times, std::vector<Station> tour)
    : times_(times),
      end_(static_cast<Station>(times.size())),
      stations_(std::move(tour)),
      place_of_(times.size() + 1, 0),
      near_(times.nearest(kNeighbours)),
      waiting_(times.size() + 1, false) {
  stations_.push_back(end_);
  for (std::size_t i = 0; i < stations_.size(); ++i) place_of_[stations_[i]] = i;
  // Poses that no move leads to are nobody's neighbours.
  for (auto& list : near_) {
    std::erase_if(list, [this](Station s) { return place_of_[s] == 0; });
  }
}

double TourSearch::inside_s(Stretch s, bool backwards) const {
  double sum = 0;
  for (std::size_t i = s.first; i < s.last; ++i) sum += backwards ? step_s(i + 1, i) : step_s(i, i + 1);
  return sum;
}

bool TourSearch::allowed_backwards(Stretch s) {
  for (std::size_t i = s.first; i < s.last; ++i) {
    if (!allowed(i + 1, i)) return false;
  }
  return true;
}

void TourSearch::look_again_at(std::size_t place) {
  const Station station = stations_[place];
  if (station == end_ || waiting_[station]) return;
  waiting_[station] = true;
  to_look_at_.push_back(station);
}

void TourSearch::turn(Stretch s) {
  turned_.push_back(s);
  std::reverse(stations_.begin() + static_cast<std::ptrdiff_t>(s.first),
               stations_.begin() + static_cast<std::ptrdiff_t>(s.last) + 1);
  for (std::size_t i = s.first; i <= s.last; ++i) place_of_[stations_[i]] = i;
}

// Neighbouring stretches change places, each keeping its direction.
void TourSearch::exchange(Stretch first, Stretch second) {
  const std::size_t length = second.last - second.first + 1;
  turn({first.first, second.last});
  turn({first.first, first.first + length - 1});
  turn({first.first + length, second.last});
}

bool TourSearch::try_turning(Stretch s) {
  if (s.first < 1 || s.last > last_place() || s.first >= s.last || s.last - s.first >= kLongestTurned) {
    return false;
  }
  double change = step_s(s.first - 1, s.last) + step_s(s.first, s.last + 1) - step_s(s.first - 1, s.first) -
                  step_s(s.last, s.last + 1);
  if (change > -kWorthwhile_s) return false;
  change += inside_s(s, true) - inside_s(s, false);
  if (change > -kWorthwhile_s) return false;
  if (!allowed(s.first - 1, s.last) || !allowed(s.first, s.last + 1) || !allowed_backwards(s)) return false;
  turn(s);
  change_s_ += change;
  for (const std::size_t i : {s.first - 1, s.first, s.last, s.last + 1}) look_again_at(i);
  return true;
}

// Puts a stretch between the places `after` and `after + 1`, which are outside of it.
bool TourSearch::try_putting(Stretch s, std::size_t after, bool backwards) {
  const std::size_t head = backwards ? s.last : s.first;
  const std::size_t tail = backwards ? s.first : s.last;
  double change = step_s(s.first - 1, s.last + 1) - step_s(s.first - 1, s.first) -
                  step_s(s.last, s.last + 1) + step_s(after, head) + step_s(tail, after + 1) -
                  step_s(after, after + 1);
  if (backwards && change < 1) change += inside_s(s, true) - inside_s(s, false);
  if (change > -kWorthwhile_s) return false;
  if (!allowed(s.first - 1, s.last + 1) || !allowed(after, head) || !allowed(tail, after + 1)) return false;
  if (backwards && !allowed_backwards(s)) return false;
  change_s_ += change;
  for (const std::size_t i : {s.first - 1, s.first, s.last, s.last + 1, after, after + 1}) look_again_at(i);
  if (backwards) turn(s);
  if (after > s.last) {
    exchange(s, {s.last + 1, after});
  } else {
    exchange({after + 1, s.first - 1}, s);
  }
  return true;
}

// Stretches that begin or end at `place`, put beside a station near to it.
bool TourSearch::try_moving(std::size_t place, Station near) {
  const std::size_t there = place_of_[near];
  const Station here = stations_[place];
  const double to_s = seconds(here, near);
  const double from_s = seconds(near, here);
  // Begins here: behind `near`, or turned before it.
  const double before_s = step_s(place - 1, place);
  const bool kept = from_s < before_s;
  const bool turned = to_s < before_s;
  for (std::size_t last = place; (kept || turned) && last < place + kLongestRun && last <= last_place();
       ++last) {
    if (there >= place && there <= last) break;
    const Stretch s{place, last};
    if (kept && there + 1 != place && try_putting(s, there, false)) return true;
    if (turned && there != last + 1 && there > 0 && last < place + kLongestTurnedRun &&
        try_putting(s, there - 1, true)) {
      return true;
    }
  }
  // Ends here: before `near`, or turned behind it.
  const double after_s = step_s(place, place + 1);
  const bool kept_before = to_s < after_s && there > 0;
  const bool turned_behind = from_s < after_s;
  for (std::size_t length = 0; (kept_before || turned_behind) && length < kLongestRun && length < place;
       ++length) {
    const Stretch s{place - length, place};
    if (there >= s.first && there <= place) break;
    if (kept_before && there != place + 1 && try_putting(s, there - 1, false)) return true;
    if (turned_behind && there + 1 != s.first && length < kLongestTurnedRun && try_putting(s, there, true)) {
      return true;
    }
  }
  return false;
}

bool TourSearch::improve_around(Station station) {
  for (const Station near : near_[station]) {
    const std::size_t here = place_of_[station];
    // A new way to or from here must be quicker than one that it replaces, and the neighbours only get
    // slower.
    const double quicker_s = std::min(seconds(station, near), seconds(near, station));
    if (quicker_s >= step_s(here, here + 1) && (here == 0 || quicker_s >= step_s(here - 1, here))) break;
    const std::size_t there = place_of_[near];
    const auto [low, high] = std::minmax(here, there);
    if (try_turning({low + 1, high})) return true;
    if (high > 0 && try_turning({low, high - 1})) return true;
    if (here > 0 && try_moving(here, near)) return true;
  }
  return false;
}

void TourSearch::settle_down() {
  while (!to_look_at_.empty()) {
    const Station station = to_look_at_.back();
    to_look_at_.pop_back();
    waiting_[station] = false;
    while (improve_around(station)) {
    }
  }
}

void TourSearch::descend() {
  for (std::size_t i = stations_.size(); i > 0; --i) look_again_at(i - 1);
  settle_down();
  turned_.clear();
}

void TourSearch::shake(std::size_t count, const std::function<void(std::size_t)>& on_progress) {
  constexpr std::size_t kFewest = 3;  // poses: below there is nothing to exchange
  if (last_place() < kFewest) return;
  base::Random random(kSeed);
  for (std::size_t n = 0; n < count; ++n) {
    if (on_progress && n % kTellEvery == 0) on_progress(n);
    const std::size_t longest = std::min(kLongestExchanged, last_place() / 2);
    const std::size_t length_a = 1 + random.below(longest);
    const std::size_t length_b = 1 + random.below(longest);
    const std::size_t first = 1 + random.below(last_place() - length_a - length_b + 1);
    const Stretch a{first, first + length_a - 1};
    const Stretch b{a.last + 1, a.last + length_b};
    if (!allowed(a.first - 1, b.first) || !allowed(b.last, a.first) || !allowed(a.last, b.last + 1)) continue;
    turned_.clear();
    change_s_ = step_s(a.first - 1, b.first) + step_s(b.last, a.first) + step_s(a.last, b.last + 1) -
                step_s(a.first - 1, a.first) - step_s(a.last, b.first) - step_s(b.last, b.last + 1);
    for (const std::size_t i : {a.first - 1, a.first, a.last, b.first, b.last, b.last + 1}) look_again_at(i);
    exchange(a, b);
    settle_down();
    if (change_s_ <= 0) continue;
    while (!turned_.empty()) {
      const Stretch s = turned_.back();
      turn(s);
      turned_.pop_back();
      turned_.pop_back();
    }
  }
}

}  // namespace rig::machine
