// Prints the table that the conformance tests have filled: conformance_table FOLDER...
#include <cstdio>

#include "drivers/conformance/suite.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: conformance_table FOLDER...\n");
    return 2;
  }
  const auto table = rig::drivers::conformance::table_of({argv + 1, argv + argc});
  if (!table) {
    std::fprintf(stderr, "%s\n", table.error().text().c_str());
    return 1;
  }
  std::fputs(table->c_str(), stdout);
  return 0;
}
