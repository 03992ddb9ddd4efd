// toml++ as this project uses it: without exceptions, and without its assertions. Text that is no TOML trips one
// of them ("[;x]") where the code behind it would report the mistake; a file from outside must never end a
// program. Private to core/base.
#pragma once

#ifdef NDEBUG
#error "With NDEBUG toml++ takes its assertions for granted instead of checking what they say."
#endif
#define TOML_EXCEPTIONS 0
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>
