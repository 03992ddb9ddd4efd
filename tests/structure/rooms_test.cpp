// The table of rooms holds in this tree, and the check finds every way to break it in made-up trees.
#include <cstdlib>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/structure/include_table.h"

namespace rig::structure {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsSupersetOf;

TEST(Rooms, ThisTreeKeepsToItsTable) {
  std::vector<std::string> faults;
  const RoomTable rooms = read_rooms(RIG_SOURCE_DIR "/rooms.txt", faults);
  EXPECT_THAT(faults, IsEmpty());
  EXPECT_THAT(cycles(rooms), IsEmpty());
  for (const auto& [room, uses] : rooms) {
    EXPECT_TRUE(fs::is_directory(fs::path(RIG_SOURCE_DIR) / room)) << room;
  }
  for (const std::string& fault : include_faults(RIG_SOURCE_DIR, rooms)) ADD_FAILURE() << fault;
}

// What must stay true however the table grows: the virtual rig cannot use what inverts its pictures, the
// programs do not reach into rigd, and the foundation uses nothing.
TEST(Rooms, TheTableKeepsItsPromises) {
  std::vector<std::string> faults;
  const RoomTable rooms = read_rooms(RIG_SOURCE_DIR "/rooms.txt", faults);
  EXPECT_THAT(rooms.at("core/base"), IsEmpty());
  for (const char* inverse : {"calibration", "calibration/fiducials", "appearance", "core/geometry"}) {
    EXPECT_EQ(rooms.at("sim").count(inverse), 0U) << inverse;
  }
  for (const auto& [room, uses] : rooms) {
    EXPECT_EQ(uses.count("daemon"), 0U) << room;
    // The fuzzers read what any room reads.
    EXPECT_EQ(uses.count("sim"), room == "fuzz" ? 1U : 0U) << room;
  }
}

class MadeUpTree : public testing::Test {
 protected:
  MadeUpTree() {
    std::string pattern = (fs::temp_directory_path() / "rooms-XXXXXX").string();
    root_ = ::mkdtemp(pattern.data());
    write("rooms.txt", "# a comment\nbase:\nupper: base\nupper/inner: base\nlone: # nothing\n");
  }
  ~MadeUpTree() override { fs::remove_all(root_); }
  MadeUpTree(const MadeUpTree&) = delete;
  MadeUpTree& operator=(const MadeUpTree&) = delete;

  void write(const std::string& path, const std::string& text) const {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text;
  }
  [[nodiscard]] std::vector<std::string> faults() const {
    std::vector<std::string> found;
    const RoomTable rooms = read_rooms(root_ / "rooms.txt", found);
    EXPECT_THAT(found, IsEmpty());
    return include_faults(root_, rooms);
  }

  fs::path root_;
};

TEST_F(MadeUpTree, WhatTheTableAllowsPasses) {
  write("base/a.h", "#include <vector>\n#include \"base/b.h\"\n");
  write("upper/a.cpp", "#include \"upper/a.h\"\n#include \"base/a.h\"\n");
  write("upper/inner/a.cpp", "#include \"base/a.h\"\n#include \"upper/inner/b.h\"\n");
  write("tests/upper/a_test.cpp", "#include \"upper/a.h\"\n#include \"lone/a.h\"\n#include \"anything.h\"\n");
  write("build/generated/x.cpp", "#include \"nowhere.h\"\n");
  write(".hidden/x.cpp", "#include \"nowhere.h\"\n");
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(MadeUpTree, AForbiddenIncludeIsNamedWithFileAndLine) {
  write("base/a.h", "// text\n#pragma once\n\n#include \"upper/a.h\"\n");
  EXPECT_THAT(faults(), ElementsAre("base/a.h:4: base may not include upper (\"upper/a.h\")"));
}

TEST_F(MadeUpTree, EveryWayToWriteItIsSeen) {
  write("lone/a.cpp",
        "#include \"base/a.h\"\n  #  include   \"base/b.h\"  // why\n#include\"base/c.h\"\n"
        "#include \"lone/../base/d.h\"\n");
  EXPECT_EQ(faults().size(), 4U);
}

TEST_F(MadeUpTree, AnInnerRoomIsARoomOfItsOwn) {
  write("upper/a.cpp", "#include \"upper/inner/b.h\"\n");
  write("upper/inner/a.cpp", "#include \"upper/b.h\"\n");
  EXPECT_THAT(faults(),
              ElementsAre("upper/a.cpp:1: upper may not include upper/inner (\"upper/inner/b.h\")",
                          "upper/inner/a.cpp:1: upper/inner may not include upper (\"upper/b.h\")"));
}

TEST_F(MadeUpTree, PathsThatDoNotBeginAtTheRootAndFoldersWithoutARoom) {
  write("base/a.cpp", "#include \"b.h\"\n#include \"../upper/a.h\"\n");
  write("cellar/a.cpp", "int x;\n");
  EXPECT_THAT(faults(), ElementsAre("base/a.cpp:1: \"b.h\" is no path from the root into a room",
                                    "base/a.cpp:2: \"../upper/a.h\" is no path from the root into a room",
                                    "cellar/a.cpp:1: lies in no room of rooms.txt"));
}

TEST_F(MadeUpTree, TestsAreNoRoomThatOthersMayInclude) {
  write("base/a.cpp", "#include \"tests/base/helper.h\"\n");
  EXPECT_EQ(faults().size(), 1U);
}

TEST_F(MadeUpTree, FaultsOfTheTableItself) {
  write("rooms.txt", "base:\nupper: base cellar\nbase: upper\nnonsense\n");
  std::vector<std::string> found;
  const RoomTable rooms = read_rooms(root_ / "rooms.txt", found);
  EXPECT_THAT(found, IsSupersetOf({"rooms.txt:2: cellar is no room", "rooms.txt:3: base stands twice",
                                   "rooms.txt:4: has no colon"}));
  EXPECT_THAT(cycles(rooms), ElementsAre("base > upper > base"));
  found.clear();
  EXPECT_THAT(read_rooms(root_ / "missing.txt", found), IsEmpty());
  EXPECT_EQ(found.size(), 1U);
}

}  // namespace
}  // namespace rig::structure
