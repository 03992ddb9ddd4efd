#include "core/machine/reference_looks.h"

#include "core/machine/limits.h"

namespace rig::machine {

std::vector<Look> reference_looks(const RigConfig& rig, bool has_shutter) {
  const auto& reference = rig.unattended.reference;
  if (!reference) return {};
  std::vector<Look> looks;
  // A lamp without a shutter would have to be put out, and lit again while it is hot.
  if (has_shutter) looks.push_back({"dark", reference->pose_rad, reference->dark_exposure_s, false});
  looks.push_back({"patches", reference->pose_rad, reference->exposure_s, true});
  if (reference->flat)
    looks.push_back({"flat", reference->flat->pose_rad, reference->flat->exposure_s, true});
  return looks;
}

Look identity_look(const RigConfig& rig) {
  const ReferenceConfig& reference = *rig.unattended.reference;
  return {"identity", reference.pose_rad, reference.exposure_s, true};
}

std::string why_unreachable(const RigConfig& rig, JointAngles from, const std::vector<Look>& looks,
                            const JointAngles* next) {
  for (const Look& look : looks) {
    if (auto ok = check_move(rig, from, look.pose_rad); !ok) return ok.error().text();
    from = look.pose_rad;
  }
  if (next == nullptr) return {};
  const auto on = check_move(rig, from, *next);
  return on ? std::string() : on.error().text();
}

}  // namespace rig::machine
