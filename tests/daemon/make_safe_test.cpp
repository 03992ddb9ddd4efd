// One part that hangs or fails keeps no other from its safe state, nor rigd-safe from its end.
#include "daemon/make_safe.h"

#include <future>
#include <gtest/gtest.h>

#include "tests/core/machine/rig_file.h"
#include "tests/core/temporary_folder.h"

namespace rig::daemon {
namespace {

using Tell = std::function<void(SafePart)>;

TEST(MakeSafe, WhatHangsIsToldAndTheRestIsDone) {
  // Left behind with its thread, as a hanging driver would be: never destroyed.
  static auto* const never = new std::promise<void>;
  static const auto* const hang = new std::shared_future<void>(never->get_future().share());
  const auto parts =
      work_within({{{"axis roll"}, [](const Tell&) { hang->wait(); }},
                   {{"axis tilt", "light"},
                    [](const Tell& tell) {
                      tell({"axis tilt", std::string("stands at 1 deg")});
                      tell({"light", base::fail(base::ErrorCode::device, "the shutter is still open")});
                    }}},
                  std::chrono::milliseconds(200));
  ASSERT_EQ(parts.size(), 3U);
  ASSERT_FALSE(parts[0].state.has_value());
  EXPECT_EQ(parts[0].state.error().code, base::ErrorCode::timeout);
  EXPECT_EQ(parts[1].state.value_or(""), "stands at 1 deg");
  EXPECT_FALSE(parts[2].state.has_value());
}

TEST(MakeSafe, AModuleThatCannotBeOpenedIsAnErrorOfEachOfItsParts) {
  const test::TemporaryFolder folder;
  auto rig = std::make_shared<machine::RigConfig>(machine::rig_with({}));
  rig->modules.at(0).file = (folder / "no_such_module.so").string();
  const auto parts =
      make_safe(rig, base::make_system_clock(), folder.path(), std::chrono::milliseconds(20000));
  ASSERT_EQ(parts.size(), machine::kAxisCount + 2) << "the axes, the light, and outputs that it may have";
  for (const SafePart& part : parts) {
    ASSERT_FALSE(part.state.has_value()) << part.name;
    EXPECT_NE(part.state.error().text().find("no_such_module"), std::string::npos)
        << part.state.error().text();
  }
}

}  // namespace
}  // namespace rig::daemon
