// How different two pairs of light and view direction are to an isotropic, reciprocal material.
#pragma once

#include "core/machine/kinematics.h"

namespace rig::plan {

/// A pair of directions up to rotation about the normal and mirror image.
class IsotropicPair {
 public:
  /// Polar angles of incident and exitant direction and the azimuth between them, 0 .. pi.
  IsotropicPair(double incident_rad, double exitant_rad, double azimuth_rad);
  explicit IsotropicPair(const machine::DirectionPair& pair);

  [[nodiscard]] double incident_rad() const { return incident_rad_; }
  [[nodiscard]] double exitant_rad() const { return exitant_rad_; }
  [[nodiscard]] double azimuth_rad() const { return azimuth_rad_; }
  /// Angle between the two directions; like the polar angles it needs no azimuth, so that it has no pole.
  [[nodiscard]] double between_rad() const;

 private:
  friend double pair_distance(const IsotropicPair& a, const IsotropicPair& b);
  friend bool nearer_than(const IsotropicPair& a, const IsotropicPair& b, double limit_rad);
  double incident_rad_, exitant_rad_, azimuth_rad_;
  double cos_i_, sin_i_, cos_r_, sin_r_;
};

/// The least d with d^2 = angle(wi, wi')^2 + angle(wr, wr')^2 over every rotation about the normal, mirror
/// image and exchange of the two directions of one pair; radians, to about 1e-9.
[[nodiscard]] double pair_distance(const IsotropicPair& a, const IsotropicPair& b);

/// Whether pair_distance(a, b) <= limit_rad; much faster, because bounds mostly decide.
[[nodiscard]] bool nearer_than(const IsotropicPair& a, const IsotropicPair& b, double limit_rad);

}  // namespace rig::plan
