#include "sim/faults.h"

#include <algorithm>
#include <sys/stat.h>

#include "core/base/random.h"

namespace rig::sim {

namespace {

// Tells versions of a file apart; empty where there is none.
std::string version_of(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return {};
  return fmt::format("{} {} {} {}", info.st_ino, info.st_size, info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
}

base::Result<FaultPlan> read_file(const std::filesystem::path& path) {
  const auto table = base::ConfigTable::parse_file(path.string());
  if (!table) return base::pass(table);
  FaultPlan plan = read_fault_plan(*table);
  if (auto fine = table->finish(); !fine) return base::pass(fine);
  return plan;
}

}  // namespace

std::vector<Faults::Watched> Faults::watch(const FaultPlan& plan, std::uint64_t stream) {
  std::vector<Watched> watched;
  for (const Fault& fault : plan.faults) {
    watched.push_back({fault, base::derive_key(base::derive_key(plan.seed, stream), watched.size()), 0, 0});
  }
  return watched;
}

Faults::Faults(FaultPlan settings, std::filesystem::path file, Complain complain)
    : file_(std::move(file)), complain_(std::move(complain)), settings_(watch(settings, 1)) {}

void Faults::look_at_file() {
  const std::string version = version_of(file_);
  if (version == seen_) return;
  seen_ = version;
  if (version.empty()) {
    from_file_.clear();
    return;
  }
  if (auto plan = read_file(file_)) {
    from_file_ = watch(*plan, 2);
  } else {
    complain_(plan.error().text());
  }
}

std::optional<double> Faults::strike_first(const Matches& matches, double world_s) {
  const std::lock_guard lock(mutex_);
  look_at_file();
  std::optional<double> amount;
  for (auto* faults : {&settings_, &from_file_}) {
    for (Watched& w : *faults) {
      const Fault& f = w.fault;
      if (!matches(f) || world_s < f.from_s || world_s >= f.until_s) continue;
      const std::uint64_t occasion = w.occasions++;
      if (amount || occasion < f.after || w.struck >= f.times) continue;
      if (base::unit_from_bits(base::derive_key(w.key, occasion)) >= f.chance) continue;
      ++w.struck;
      amount = f.amount;
    }
  }
  return amount;
}

std::optional<double> Faults::strike(FaultKind kind, std::string_view device, double world_s) {
  return strike_first(
      [&](const Fault& f) { return f.kind == kind && (f.device.empty() || f.device == device); }, world_s);
}

bool Faults::strike_switch(FaultKind kind, std::string_view axis, bool high_side, double world_s) {
  return strike_first(
             [&](const Fault& f) {
               return f.kind == kind && f.high_side == high_side && (f.device.empty() || f.device == axis);
             },
             world_s)
      .has_value();
}

bool Faults::has_any(FaultKind kind) {
  const std::lock_guard lock(mutex_);
  look_at_file();
  const auto of_kind = [kind](const Watched& w) { return w.fault.kind == kind; };
  return std::any_of(settings_.begin(), settings_.end(), of_kind) ||
         std::any_of(from_file_.begin(), from_file_.end(), of_kind);
}

}  // namespace rig::sim
