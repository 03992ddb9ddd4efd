#include "drivers/conformance/suite.h"

#include <exception>
#include <iterator>

#include "drivers/conformance/check_lists.h"
#include "drivers/conformance/ending.h"

namespace rig::drivers::conformance {

const char* name_of(base::ErrorCode code) {
  switch (code) {
    case base::ErrorCode::bad_input:
      return "bad_input";
    case base::ErrorCode::not_found:
      return "not_found";
    case base::ErrorCode::io:
      return "io";
    case base::ErrorCode::damaged:
      return "damaged";
    case base::ErrorCode::newer:
      return "newer";
    case base::ErrorCode::device:
      return "device";
    case base::ErrorCode::timeout:
      return "timeout";
    case base::ErrorCode::busy:
      return "busy";
    case base::ErrorCode::refused:
      return "refused";
    case base::ErrorCode::interrupted:
      return "interrupted";
    case base::ErrorCode::lost:
      return "lost";
  }
  return "an unknown code";
}

std::string told(const base::Error& error) {
  return fmt::format("{}: {}", name_of(error.code), error.text());
}

const std::vector<Check>& checks() {
  static const std::vector<Check> all = [] {
    std::vector<Check> list;
    for (auto part : {&module_checks, &axis_move_checks, &axis_stop_checks, &axis_reference_checks,
                      &axis_jog_checks, &axis_limit_checks, &axis_wire_checks, &axis_lost_checks,
                      &camera_frame_checks, &camera_fault_checks, &light_checks, &lines_checks}) {
      std::vector<Check> more = part();
      std::move(more.begin(), more.end(), std::back_inserter(list));
    }
    return list;
  }();
  return all;
}

Outcome run_check(Bench& bench, const Check& check) {
  try {
    bench.reset();
    // A simulated clock goes on only while every member waits in it: this thread's waiting is the bench's
    // time.
    const base::ClockMember member(bench.clock());
    return check.run(bench);
  } catch (const CheckEnded& ended) {
    return ended.outcome;
  } catch (const std::exception& error) {
    return {Verdict::failed, fmt::format("an exception came out: {}", error.what())};
  } catch (...) {
    return {Verdict::failed, "an exception came out that is no std::exception"};
  }
}

}  // namespace rig::drivers::conformance
