// How the fake module is wrong: what the suite has to find.
#pragma once

namespace rig::drivers::conformance {

enum class Flaw {
  none,
  // The module.
  twin_names,
  leaks_descriptor,
  leaks_thread,
  leaks_memory,
  throws_at_opening,
  // The axis.
  finer_than_true,       // says a tenth of its resolution
  too_fast,              // moves with twice the velocity
  arrived_too_early,     // says that it stands a little before it does
  arrives_elsewhere,     // two steps beside its target, and says that it is there
  swallows_new_target,   // accepts a target while moving and forgets it
  move_lost_in_homing,   // accepts a target while homing and forgets it
  silent_without_power,  // accepts a move without power
  takes_nonsense,        // a target that is no number is zero
  moves_at_opening,      // goes home by itself
  homed_by_its_file,     // believes what it wrote down before it was closed
  loses_stop,            // answers and sends nothing
  stops_late,            // waits for the line to be quiet first
  stop_forgets_home,
  no_stop_after_bad_answer,
  homed_too_early,  // says homed as soon as homing has begun
  moves_unhomed,
  believes_homed,  // once homed, for ever
  homed_after_abort,
  jogs_fast,         // twice as fast as asked
  jogs_to_an_angle,  // takes the distance for an angle
  homed_by_a_jog,
  jogs_nonsense,  // a distance that is no number is a little one
  swapped_limits,
  goes_into_limit,  // neither it nor the device looks at the switch
  hides_fault,
  fault_acknowledged_away,  // enable(true) hides a fault whose cause lasts
  makes_up_state,           // answers the last state where none comes
  no_calls_deadline,        // gives each of a call's many questions its whole time
  believes_garbage,
  reads_old_answers,  // takes whatever comes first
  never_back,         // what was lost once stays lost
  resends_target,     // ends the move that it believes in once the device is back
  homed_on_return,    // believes that homing ended while the device was gone
  keeps_the_line,     // an opening that failed keeps the line
  hangs_when_lost,
  lost_is_device,  // says "device" of a device that is gone
  // The camera.
  leaves_last_line,
  exposes_twice_as_long,
  reports_wrong_exposure,
  frame_of_before,  // delivers the frame of the exposure before
  counter_stands,
  takes_second_trigger,
  abort_does_nothing,
  overruns_buffer,
  takes_small_buffer,
  delivers_corrupt,
  corrupt_is_device,   // says "device" of a frame that is damaged
  fills_in_missing,    // delivers the last frame where one was lost
  delivers_unplugged,  // delivers a frame from before it was unplugged
  frame_over_death,    // delivers a frame that was exposed before the module was opened
  ends_only_in_order,  // ends an exposure when it is closed, and relies on that when it is opened
  // The light.
  level_off,       // a tenth too much
  level_believed,  // reads back what it was told, not what is so
  no_shutter,
  off_by_belief,  // believes after opening that it is off
  // The lines.
  slow_input,
  misses_press,
  output_read_believed,
  leaves_output,        // does nothing on exit
  rests_only_in_order,  // puts outputs to rest when it is closed, and relies on that when it is opened
  sets_anything,
  invents_levels,  // inactive, where none can be read
  input_by_edges,  // knows an input only once it has changed
};

}  // namespace rig::drivers::conformance
