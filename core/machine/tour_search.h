// Makes a tour shorter, step by step.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/base/random.h"
#include "core/machine/travel_times.h"

namespace rig::machine {

/// A local search over open tours whose first station stays and whose last is free. Times may differ between
/// the two directions of a way. Two changes are tried around each station, towards those near it: a stretch
/// is taken in the other direction (2-opt), or is put elsewhere in either direction (Or 1976; 3-opt without
/// reversal where it is long). Where none helps any more, two neighbouring stretches are exchanged at random
/// and the search goes on from there; what did not get shorter is taken back (iterated local search,
/// Lourenço, Martin and Stützle 2003). Every change keeps to moves that are allowed.
class TourSearch {
 public:
  /// `tour` begins with station 0 and takes allowed moves only; `times` must outlive this.
  TourSearch(TravelTimes& times, std::vector<Station> tour);

  /// Until no change helps.
  void descend();
  /// `count` random exchanges; `on_progress` is called with how many are done, now and then. What comes out
  /// depends on the tour and the count alone.
  void shake(std::size_t count, const std::function<void(std::size_t)>& on_progress);

  /// The tour as it is now, from station 0.
  [[nodiscard]] std::vector<Station> tour() const { return {stations_.begin(), stations_.end() - 1}; }

 private:
  struct Stretch {
    std::size_t first, last;  // places
  };

  [[nodiscard]] double seconds(Station from, Station to) const {
    return to == end_ ? 0 : static_cast<double>(times_.seconds(from, to));
  }
  [[nodiscard]] double step_s(std::size_t from_place, std::size_t to_place) const {
    return seconds(stations_[from_place], stations_[to_place]);
  }
  [[nodiscard]] bool allowed(std::size_t from_place, std::size_t to_place) {
    return stations_[to_place] == end_ || times_.allowed(stations_[from_place], stations_[to_place]);
  }
  [[nodiscard]] std::size_t last_place() const { return stations_.size() - 2; }
  [[nodiscard]] double inside_s(Stretch s, bool backwards) const;
  [[nodiscard]] bool allowed_backwards(Stretch s);

  bool improve_around(Station station);
  bool try_turning(Stretch s);
  bool try_moving(std::size_t place, Station near);
  bool try_putting(Stretch s, std::size_t after, bool backwards);

  void turn(Stretch s);
  void exchange(Stretch first, Stretch second);
  void look_again_at(std::size_t place);
  void settle_down();

  TravelTimes& times_;
  const Station end_;  // stands behind the last station; the way to it takes no time
  std::vector<Station> stations_;
  std::vector<std::size_t> place_of_;
  std::vector<std::vector<Station>> near_;
  std::vector<Station> to_look_at_;  // a stack
  std::vector<bool> waiting_;
  std::vector<Stretch> turned_;  // since the last exchange, to take back
  double change_s_ = 0;          // since then
};

}  // namespace rig::machine
