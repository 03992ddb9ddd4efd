// Where a test makes the process die: just before and just after each step that makes something durable.
#pragma once

namespace rig::base {

enum class DurableStep { write, flush, rename, commit };

/// Kills the process (SIGKILL) at the instant that the environment variable RIG_DIE_AT names:
/// "before-rename:3" is the third time that a rename is about to be made, "after-commit:1" the first commit
/// that has been made, "any:17" the seventeenth such instant of any kind. Does nothing where the variable is
/// not set. For tests: docs/operations.md, section Soak.
void die_before(DurableStep step);
void die_after(DurableStep step);

/// Whether `text` is a value of RIG_DIE_AT that names an instant.
[[nodiscard]] bool names_an_instant(const char* text);

}  // namespace rig::base
