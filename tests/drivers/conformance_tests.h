// A module's bench as tests: one for each check of the conformance suite.
//
//   #include "tests/drivers/conformance_tests.h"
//   #include "tests/drivers/ptu/bench.h"
//   RIG_CONFORMANCE_TESTS(PtuAxis, rig::drivers::ptu::make_bench)
//
// A failed check fails its test. One that the bench cannot show, or that does not concern it, is printed.
// Each test writes its own line of the module's column, so that the table is whole in whatever order and in
// however many processes they run.
#pragma once

#include <cstdlib>
#include <gtest/gtest.h>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "drivers/conformance/suite.h"

namespace rig::drivers::conformance {

/// RIG_BINARY_DIR/conformance.
inline std::filesystem::path column_folder() {
  return std::filesystem::path(RIG_BINARY_DIR) / "conformance";
}

class ConformanceTest : public ::testing::TestWithParam<std::size_t> {
 protected:
  static void run(const std::unique_ptr<Bench>& bench, const Check& check) {
    ASSERT_NE(bench, nullptr);
    // A further try within one run of ./dev conformance does not make undone what must never be.
    const bool in_a_run = std::getenv("RIG_CONFORMANCE_RUN") != nullptr;
    const auto written = write_column(column_folder(), bench->name(), {{check, run_check(*bench, check)}},
                                      in_a_run ? Earlier::counts : Earlier::forgotten);
    ASSERT_TRUE(written.has_value()) << written.error().text();
    const Outcome& outcome = written->front();
    switch (outcome.verdict) {
      case Verdict::passed:
        break;
      case Verdict::failed:
        ADD_FAILURE() << check.name << ": " << outcome.text
                      << (outcome.for_good ? " (no further try takes that back)" : "");
        break;
      case Verdict::not_proven:
        std::cout << "not proven: " << outcome.text << "\n";
        break;
      case Verdict::none:
        std::cout << "does not concern it: " << outcome.text << "\n";
        break;
    }
  }
};

inline std::vector<std::size_t> numbers_of_checks() {
  std::vector<std::size_t> numbers(checks().size());
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  return numbers;
}

/// "axis_abort_during_a_move".
inline std::string test_name_of(const ::testing::TestParamInfo<std::size_t>& info) {
  std::string name;
  for (const char c : checks()[info.param].name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      name += c;
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  return name;
}

}  // namespace rig::drivers::conformance

/// `make` makes a fresh bench: std::unique_ptr<Bench>().
// NOLINTBEGIN(bugprone-macro-parentheses): a class's name stands in none.
#define RIG_CONFORMANCE_TESTS(Module, make)                                                       \
  class Module : public ::rig::drivers::conformance::ConformanceTest {};                          \
  TEST_P(Module, Passes) {                                                                        \
    run(make(), ::rig::drivers::conformance::checks()[GetParam()]);                               \
  }                                                                                               \
  INSTANTIATE_TEST_SUITE_P(conformance, Module,                                                   \
                           ::testing::ValuesIn(::rig::drivers::conformance::numbers_of_checks()), \
                           ::rig::drivers::conformance::test_name_of);
// NOLINTEND(bugprone-macro-parentheses)
