#include "daemon/reference_looks.h"

#include "core/machine/limits.h"

namespace rig::daemon {

std::vector<Look> reference_looks(const Setup& setup) {
  const auto& reference = setup.rig.unattended.reference;
  if (!reference) return {};
  std::vector<Look> looks;
  // A lamp without a shutter would have to be put out, and lit again while it is hot.
  if (setup.light.has_shutter)
    looks.push_back({"dark", reference->pose_rad, reference->dark_exposure_s, false});
  looks.push_back({"patches", reference->pose_rad, reference->exposure_s, true});
  if (reference->flat)
    looks.push_back({"flat", reference->flat->pose_rad, reference->flat->exposure_s, true});
  return looks;
}

Look identity_look(const Setup& setup) {
  const machine::ReferenceConfig& reference = *setup.rig.unattended.reference;
  return {"identity", reference.pose_rad, reference.exposure_s, true};
}

std::string why_unreachable(const Setup& setup, JointAngles from, const std::vector<Look>& looks,
                            const JointAngles* next) {
  for (const Look& look : looks) {
    if (auto ok = machine::check_move(setup.rig, from, look.pose_rad); !ok) return ok.error().text();
    from = look.pose_rad;
  }
  if (next == nullptr) return {};
  const auto on = machine::check_move(setup.rig, from, *next);
  return on ? std::string() : on.error().text();
}

}  // namespace rig::daemon
