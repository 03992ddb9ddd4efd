// How long a lamp has burnt, kept in a file between runs, and for how long it burns now.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/base/result.h"

namespace rig::drivers {

/// Told at every look whether the lamp is lit. The hours are an upper bound: between two looks that found it
/// lit it has burnt, and one that finds it out counts the time since the look before. They are on the disk
/// once a minute while it burns, whenever it is lit or goes out, and at the end.
class LampRecord {
 public:
  using Log = void (*)(base::LogLevel, std::string_view);

  /// A file that is not there is a new lamp, with 0 hours. One that contradicts itself is `damaged`: going on
  /// from 0 would lie about the lamp's life.
  [[nodiscard]] static base::Result<LampRecord> open(std::filesystem::path file, base::Clock& clock, Log log);
  LampRecord(LampRecord&&) noexcept;
  LampRecord(const LampRecord&) = delete;
  LampRecord& operator=(const LampRecord&) = delete;
  LampRecord& operator=(LampRecord&&) = delete;
  ~LampRecord();

  /// A look. One that finds the lamp lit after a break (a restart, forget()) counts the break as burnt, up to
  /// 12 hours; one that finds it out does not. A disk that refuses the record is logged, once until it works
  /// again: a lamp must be switched off with a full disk too.
  void note(bool lit);
  /// The lamp was out of sight: it may have gone out meanwhile, so that it is cold until shown otherwise.
  void forget();

  [[nodiscard]] double hours() const;
  /// 0 while it is out. Starts again after forget() and after a restart.
  [[nodiscard]] double lit_for_s() const;

 private:
  struct Kept {
    double hours = 0;
    std::optional<base::Time> lit_at;  ///< the last look, if it found the lamp lit
  };
  LampRecord(std::filesystem::path file, base::Clock& clock, Log log, Kept kept);
  [[nodiscard]] static base::Result<Kept> read(const std::filesystem::path& file);
  void write();

  std::filesystem::path file_;
  base::Clock* clock_;
  Log log_;
  Kept kept_;
  bool broken_off_ = true;  // kept_ is from before a break
  std::optional<base::Time> lit_since_;
  base::Time written_at_{};
  bool unwritten_ = false;
  bool refused_ = false;
};

}  // namespace rig::drivers
