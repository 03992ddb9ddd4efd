// The seed of a randomised test: printed, so that a failure can be had again, and taken from the environment
// variable RIG_TEST_SEED if that is set.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace rig::test {

inline std::uint64_t seed(std::uint64_t usual) {
  const char* wanted = std::getenv("RIG_TEST_SEED");
  const std::uint64_t seed = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : usual;
  std::printf("seed %llu (RIG_TEST_SEED)\n", static_cast<unsigned long long>(seed));
  return seed;
}

}  // namespace rig::test
