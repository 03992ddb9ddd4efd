// Modules are found in order, and what is none, or not one for this program, is an error that says why.
#include "drivers/host/module_loader.h"

#include <cstdlib>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "tests/core/temporary_folder.h"

namespace rig::drivers {
namespace {

namespace fs = std::filesystem;
using base::ErrorCode;
using testing::ElementsAre;
using testing::HasSubstr;

const fs::path kModules = fs::path(RIG_BINARY_DIR) / "tests" / "modules";

std::string module_path(const std::string& name) {
  return (kModules / ("librig_driver_" + name + ".so")).string();
}

base::Error error_of(const std::string& file, const std::vector<fs::path>& search = {}) {
  const auto entry = load_module(file, search);
  EXPECT_FALSE(entry.has_value()) << file;
  return entry ? base::Error{} : entry.error();
}

// Sets $RIG_DRIVER_PATH, or unsets it, as long as it lives.
class DriverPath {
 public:
  explicit DriverPath(const char* value) {
    if (const char* before = std::getenv("RIG_DRIVER_PATH")) before_ = before;
    set(value);
  }
  DriverPath(const DriverPath&) = delete;
  DriverPath& operator=(const DriverPath&) = delete;
  ~DriverPath() { set(before_ ? before_->c_str() : nullptr); }

 private:
  static void set(const char* value) {
    if (value != nullptr)
      ::setenv("RIG_DRIVER_PATH", value, 1);
    else
      ::unsetenv("RIG_DRIVER_PATH");
  }
  std::optional<std::string> before_;
};

TEST(ModuleLoader, LoadsAGoodModuleByItsPath) {
  const auto entry = load_module(module_path("good"), {});
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  EXPECT_STREQ((*entry)->name, "good");
  EXPECT_STREQ((*entry)->abi_tag, kAbiTag);
}

TEST(ModuleLoader, OpensWhatItLoaded) {
  const auto entry = load_module(module_path("good"), {});
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  const auto settings = base::ConfigTable::parse("", "rig.toml");
  ASSERT_TRUE(settings.has_value());
  (*entry)->check(*settings);
  EXPECT_TRUE(settings->finish().has_value());
  const auto clock = base::make_system_clock();
  const auto devices = (*entry)->open({"instance", *settings, ".", *clock, nullptr});
  ASSERT_TRUE(devices.has_value()) << devices.error().text();
  EXPECT_TRUE(devices->empty());
}

TEST(ModuleLoader, LoadsTheSameModuleTwice) {
  const auto first = load_module(module_path("good"), {});
  const auto second = load_module(module_path("good"), {});
  ASSERT_TRUE(first.has_value() && second.has_value());
  EXPECT_EQ(*first, *second);
}

TEST(ModuleLoader, FindsTheVirtualRigBesideTheProgram) {
  const DriverPath none(nullptr);
  const auto entry = load_module("virtual", module_search_path());
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  EXPECT_STREQ((*entry)->name, "virtual");
}

TEST(ModuleLoader, HandsTheVirtualRigsErrorsOut) {
  const auto entry = load_module("virtual", {fs::path(RIG_BINARY_DIR) / "lib"});
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  const auto settings = base::ConfigTable::parse("seed = -1\n", "rig.toml");
  ASSERT_TRUE(settings.has_value());
  (*entry)->check(*settings);
  const auto finished = settings->finish();
  ASSERT_FALSE(finished.has_value());
  EXPECT_THAT(finished.error().text(), HasSubstr("rig.toml:1"));
  EXPECT_THAT(finished.error().text(), HasSubstr("seed"));
}

TEST(ModuleLoader, TakesTheFirstOfSeveral) {
  const test::TemporaryFolder folder;
  const fs::path empty = folder / "empty", with_good = folder / "good", with_bad = folder / "bad";
  for (const fs::path& path : {empty, with_good, with_bad}) fs::create_directory(path);
  fs::copy_file(module_path("good"), with_good / "librig_driver_x.so");
  fs::copy_file(module_path("foreign_tag"), with_bad / "librig_driver_x.so");

  const auto entry = load_module("x", {folder / "absent", empty, with_good, with_bad});
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  EXPECT_STREQ((*entry)->name, "good");
  // The first found counts, also where it is wrong: what stands behind it was not meant.
  EXPECT_EQ(error_of("x", {with_bad, with_good}).where, (with_bad / "librig_driver_x.so").string());
}

TEST(ModuleLoader, SaysWhereItLookedInVain) {
  const base::Error error = error_of("no_such_device", {"/one/folder", "/another"});
  EXPECT_EQ(error.code, ErrorCode::not_found);
  EXPECT_THAT(error.text(), HasSubstr("no_such_device"));
  EXPECT_THAT(error.text(), HasSubstr("/one/folder, /another"));
  EXPECT_THAT(error.hint, HasSubstr("RIG_DRIVER_PATH"));
}

TEST(ModuleLoader, APathIsNotLookedFor) {
  const test::TemporaryFolder folder;
  fs::copy_file(module_path("good"), folder / "librig_driver_x.so");
  EXPECT_EQ(error_of("./librig_driver_x.so", {folder.path()}).where, "./librig_driver_x.so");
}

TEST(ModuleLoader, RefusesAFileThatIsNotThere) {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "absent.so").string();
  const base::Error error = error_of(path);
  EXPECT_EQ(error.where, path);
  EXPECT_THAT(error.what, HasSubstr("cannot load"));
}

TEST(ModuleLoader, RefusesAFileThatIsNoLibrary) {
  const test::TemporaryFolder folder;
  const fs::path text = folder / "text.so";
  test::put_bytes(text, "not ELF at all\n");
  const std::string good = test::bytes_in(module_path("good"));
  const fs::path cut = folder / "cut.so";
  test::put_bytes(cut, good.substr(0, 100));
  for (const fs::path& path : {text, cut, folder.path()}) {
    const base::Error error = error_of(path.string());
    EXPECT_EQ(error.code, ErrorCode::bad_input);
    EXPECT_EQ(error.where, path.string());
    EXPECT_THAT(error.what, HasSubstr("cannot load"));
  }
}

struct Fault {
  const char* module;
  const char* said;
};

class BrokenModule : public testing::TestWithParam<Fault> {};

TEST_P(BrokenModule, IsRefusedByNameAndReason) {
  const std::string path = module_path(GetParam().module);
  ASSERT_TRUE(fs::exists(path));
  const base::Error error = error_of(path);
  EXPECT_EQ(error.code, ErrorCode::bad_input);
  EXPECT_EQ(error.where, path);
  EXPECT_THAT(error.what, HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(
    ModuleLoader, BrokenModule,
    testing::Values(Fault{"no_door", "does not export 'rig_driver_module'"},
                    Fault{"unresolved", "rig_driver_test_defined_nowhere"},
                    Fault{"foreign_tag", "was built for 'rig-driver-0 gcc-2 none'"},
                    Fault{"longer_tag", " and more'"}, Fault{"null_tag", "was built for '?'"},
                    Fault{"null_entry", "was built for '?'"}, Fault{"null_open", "incomplete"},
                    Fault{"null_name", "incomplete"}, Fault{"throws", "the hardware is not in the mood"},
                    Fault{"throws_a_number", "exception"}),
    [](const testing::TestParamInfo<Fault>& fault) { return std::string(fault.param.module); });

TEST(ModuleSearchPath, ReadsTheEnvironmentBeforeTheFoldersBesideTheProgram) {
  const fs::path prefix = fs::path(RIG_BINARY_DIR);
  {
    const DriverPath none(nullptr);
    EXPECT_THAT(module_search_path(), ElementsAre(prefix / "lib", prefix / "lib" / "rigd"));
  }
  {
    // Empty parts name no folder: not the present one by accident.
    const DriverPath some(":/first::/second/deep:");
    EXPECT_THAT(module_search_path(), ElementsAre(fs::path("/first"), fs::path("/second/deep"),
                                                  prefix / "lib", prefix / "lib" / "rigd"));
  }
  const DriverPath empty("");
  EXPECT_THAT(module_search_path(), ElementsAre(prefix / "lib", prefix / "lib" / "rigd"));
}

}  // namespace
}  // namespace rig::drivers
