// libpng leaves a damaged file by longjmp, over a string of OpenImageIO's that is then never freed. Nothing
// of ours can free it; every other leak counts.
extern "C" {

// The suppression below names a library that only a whole call stack shows.
const char* __asan_default_options() {
  return "fast_unwind_on_malloc=0";
}  // NOLINT: the sanitizer's names
const char* __lsan_default_suppressions() {
  return "leak:libOpenImageIO";
}  // NOLINT
}
