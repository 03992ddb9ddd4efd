// Lists of things that have a `name`, as settings choose among them.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace rig::drivers {

template <typename T>
[[nodiscard]] std::vector<std::string> names_of(const std::vector<T>& all) {
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const T& each : all) names.push_back(each.name);
  return names;
}

/// nullptr: none of them has that name.
template <typename T>
[[nodiscard]] const T* find_by_name(const std::vector<T>& all, const std::string& name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const T& each) { return each.name == name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace rig::drivers
