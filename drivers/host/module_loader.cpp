#include "drivers/host/module_loader.h"

#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <exception>

namespace rig::drivers {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

Result<fs::path> find_module(const std::string& file, const std::vector<fs::path>& search) {
  if (file.find('/') != std::string::npos) return fs::path(file);
  const std::string name = fmt::format("librig_driver_{}.so", file);
  std::string looked;
  for (const fs::path& folder : search) {
    std::error_code unreadable_is_absent;
    if (fs::exists(folder / name, unreadable_is_absent)) return folder / name;
    looked += (looked.empty() ? "" : ", ") + folder.string();
  }
  return fail(ErrorCode::not_found, fmt::format("no driver module '{}' ({}) in {}", file, name, looked), {},
              "RIG_DRIVER_PATH names further folders");
}

// The entry; what it throws is an error that names the file.
Result<const ModuleEntry*> call_entry(EntryFunction function, const fs::path& path) {
  try {
    return function();
  } catch (const std::exception& error) {
    return fail(ErrorCode::bad_input, fmt::format("its entry failed: {}", error.what()), path.string());
  } catch (...) {
    return fail(ErrorCode::bad_input, "its entry failed with an unknown exception", path.string());
  }
}

}  // namespace

Result<const ModuleEntry*> load_module(const std::string& file, const std::vector<fs::path>& search) {
  const auto path = find_module(file, search);
  if (!path) return base::pass(path);
  // Never closed: devices, their code and their static data live as long as the program.
  void* library = ::dlopen(path->c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    return fail(ErrorCode::bad_input, fmt::format("cannot load: {}", ::dlerror()), path->string());
  }
  auto* entry_function = reinterpret_cast<EntryFunction>(::dlsym(library, kEntrySymbol));
  if (entry_function == nullptr) {
    return fail(ErrorCode::bad_input,
                fmt::format("is no driver module: it does not export '{}'", kEntrySymbol), path->string());
  }
  const auto called = call_entry(entry_function, *path);
  if (!called) return called;
  const ModuleEntry* entry = *called;
  if (entry == nullptr || entry->abi_tag == nullptr || std::strcmp(entry->abi_tag, kAbiTag) != 0) {
    return fail(ErrorCode::bad_input,
                fmt::format("was built for '{}', this program is '{}'",
                            entry != nullptr && entry->abi_tag != nullptr ? entry->abi_tag : "?", kAbiTag),
                path->string(), "build module and rigd together");
  }
  if (entry->name == nullptr || entry->check == nullptr || entry->open == nullptr) {
    return fail(ErrorCode::bad_input, "its entry is incomplete", path->string());
  }
  return entry;
}

std::vector<fs::path> module_search_path() {
  std::vector<fs::path> folders;
  if (const char* path = std::getenv("RIG_DRIVER_PATH")) {
    const std::string text(path);
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(':', begin), text.size());
      if (end > begin) folders.emplace_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path prefix = program.parent_path().parent_path();
    folders.push_back(prefix / "lib");
    folders.push_back(prefix / "lib" / "rigd");
  }
  return folders;
}

}  // namespace rig::drivers
