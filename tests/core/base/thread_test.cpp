#include "core/base/thread.h"

#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>

namespace rig::base {
namespace {

int niceness() {
  return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
}

TEST(Thread, BearsItsNameForTheKernel) {
  std::string seen;
  std::thread([&seen] {
    name_thread("a-rather-long-name");
    std::ifstream("/proc/self/task/" + std::to_string(::gettid()) + "/comm") >> seen;
  }).join();
  EXPECT_EQ(seen, "a-rather-long-n");
}

TEST(Thread, ThatGivesWayDoesSoAloneAndWithThoseItStarts) {
  const int before = niceness();
  if (before > 10) GTEST_SKIP() << "this process gives way to everybody already";
  int aside = 0;
  int started = 0;
  std::thread([&] {
    give_way_to_others();
    aside = niceness();
    std::thread([&] { started = niceness(); }).join();
  }).join();
  EXPECT_GT(aside, before);
  EXPECT_EQ(started, aside);
  EXPECT_EQ(niceness(), before);
}

}  // namespace
}  // namespace rig::base
