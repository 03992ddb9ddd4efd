// Reproducible random numbers on every platform: counter based, so that a value depends on what it is for and
// not on how many were drawn before it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace rig::base {

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection of 64 bits with good avalanche.
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// A new key from a key and a number, to walk down a tree of streams.
[[nodiscard]] constexpr std::uint64_t derive_key(std::uint64_t key, std::uint64_t index) {
  return mix64(key ^ mix64(index));
}

/// Uniform in [0, 1) from 64 random bits.
[[nodiscard]] constexpr double unit_from_bits(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1.0p-53;
}

/// A sequence of random numbers that its key determines.
class Random {
 public:
  explicit Random(std::uint64_t key) : key_(key) {}

  std::uint64_t bits() { return derive_key(key_, count_++); }
  /// Uniform in [0, 1).
  double uniform() { return unit_from_bits(bits()); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0 .. n-1.
  std::uint64_t below(std::uint64_t n) {
    return static_cast<std::uint64_t>(uniform() * static_cast<double>(n));
  }
  /// Standard normal (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log1p(-uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t key_;
  std::uint64_t count_ = 0;
};

}  // namespace rig::base
