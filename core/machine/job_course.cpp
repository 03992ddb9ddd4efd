#include "core/machine/job_course.h"

#include <algorithm>

#include "core/machine/exposure_bounds.h"
#include "core/machine/motion.h"
#include "core/machine/reference_looks.h"

namespace rig::machine {

namespace {

class Walk {
 public:
  Walk(const RigConfig& rig, const CourseDevices& devices, const JobConfig& job, const JointAngles& start)
      : rig_(rig),
        devices_(devices),
        job_(job),
        looks_(reference_looks(rig, devices.has_shutter)),
        at_(start) {}

  JobCourse go() {
    if (!looks_.empty()) begin();
    for (std::size_t i = 0; i < job_.poses.size(); ++i) {
      take(job_.poses[i]);
      const bool last = i + 1 == job_.poses.size();
      if (!looks_.empty() && (last || visit_is_due())) visit(last ? nullptr : &job_.poses[i + 1]);
    }
    wait_for_readout();
    return course_;
  }

 private:
  void begin() {
    const JointAngles* first = job_.poses.empty() ? nullptr : &job_.poses.front();
    if (!job_.sample_fiducials.empty()) {
      const Look identity = identity_look(rig_);
      course_.unidentified = why_unreachable(rig_, at_, {identity}, first);
      if (course_.unidentified.empty()) look_at(identity);
    }
    visit(first);
  }

  void take(const JointAngles& pose) {
    move_to(pose);
    spend_exposing(bracket_s(rig_, devices_.readout_s, job_.exposure, pose));
    reading_out_ = true;
    ++poses_since_;
  }

  [[nodiscard]] bool visit_is_due() const {
    const ReferenceConfig& reference = *rig_.unattended.reference;
    // The clock asks for a visit where a pose is committed; the one just exposed is not yet.
    const bool by_clock =
        reference.every_s > 0 && poses_since_ > 1 && course_.duration_s - visited_s_ >= reference.every_s;
    return put_off_ || by_clock || (reference.every_poses > 0 && poses_since_ >= reference.every_poses);
  }

  void visit(const JointAngles* next) {
    const std::string why = why_unreachable(rig_, at_, looks_, next);
    put_off_ = !why.empty();
    if (put_off_) {
      if (next == nullptr) course_.unproven = why;
      return;
    }
    wait_for_readout();
    const int times = course_.visits == 0 ? 2 : 1;  // the first is repeated
    for (int i = 0; i < times; ++i) {
      for (const Look& look : looks_) look_at(look);
    }
    course_.visits += times;
    poses_since_ = 0;
    visited_s_ = course_.duration_s;
  }

  // Each look is judged before what comes next.
  void look_at(const Look& look) {
    move_to(look.pose_rad);
    spend_exposing(look.exposure_s);
    reading_out_ = true;
    wait_for_readout();
  }

  void move_to(const JointAngles& pose) {
    const double change = pose_change_time_s(rig_, at_, pose);
    course_.travel_s += change;
    if (reading_out_ && devices_.overlaps_motion) {
      course_.exposing_s += devices_.readout_s;
      course_.duration_s += std::max(change, devices_.readout_s);
      reading_out_ = false;
    } else {
      wait_for_readout();
      course_.duration_s += change;
    }
    at_ = pose;
  }

  void wait_for_readout() {
    if (reading_out_) spend_exposing(devices_.readout_s);
    reading_out_ = false;
  }

  void spend_exposing(double duration_s) {
    course_.exposing_s += duration_s;
    course_.duration_s += duration_s;
  }

  const RigConfig& rig_;
  const CourseDevices& devices_;
  const JobConfig& job_;
  const std::vector<Look> looks_;
  JointAngles at_;
  bool reading_out_ = false;  // the last frame of a pose
  bool put_off_ = false;      // a visit, until the next pose is taken
  int poses_since_ = 0;       // the last visit
  double visited_s_ = 0;      // when it ended
  JobCourse course_;
};

}  // namespace

JobCourse foresee(const RigConfig& rig, const CourseDevices& devices, const JobConfig& job,
                  const JointAngles& start) {
  return Walk(rig, devices, job, start).go();
}

double bracket_s(const RigConfig& rig, double readout_s, const ExposureConfig& exposure,
                 const JointAngles& pose) {
  return longest_bracket_s(rig, exposure, pose) + (most_frames(exposure) - 1) * readout_s;
}

}  // namespace rig::machine
