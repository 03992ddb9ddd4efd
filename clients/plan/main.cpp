// rig-plan: chooses the poses of a scan and writes them as a job.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <iostream>

#include "clients/plan/plan.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "core/base/units.h"

namespace {

using rig::base::radians;

struct Arguments {
  std::string rig = "rig.toml";
  std::string out = "job.toml";
  bool force = false;
  double angle_deg = 0;
  double sharpness = 0;
  double threshold = 0.3;
  double per_highlight = 4;
  double step_deg = 1;
  double max_incident_deg = 75;
  double max_exitant_deg = 65;
  std::uint64_t seed = 1;
  std::string name = "scan";
  std::string sample = "sample";
  std::string operator_name;
  std::vector<double> exposures_us;
  double longest_us = 0;
  int most_frames = 8;
  double saturated_share = 0;
  std::vector<double> lightest_us;
  std::vector<double> darkest_us;
  double lightest_deg = 0;
  double darkest_deg = 90;
  double snr = 0;
  double first_us = 0;
  double longest_adaptive_us = 0;
  double short_share = 0.01;
};

void declare(CLI::App& app, Arguments& a) {
  app.add_option("--rig", a.rig, "Description of the rig")->capture_default_str();
  app.add_option("--out", a.out, "Job to write")->capture_default_str();
  app.add_flag("--force", a.force, "Replace the job if it exists");
  auto* angle = app.add_option("--angle-deg", a.angle_deg, "Angle between poses");
  auto* sharpness = app.add_option("--sharpness", a.sharpness,
                                   "Instead of an angle: exponent n of the sharpest highlight, cos^n")
                        ->excludes(angle);
  app.add_option("--threshold", a.threshold,
                 "With --sharpness: share of its peak down to which a highlight counts")
      ->capture_default_str()
      ->needs(sharpness);
  app.add_option("--per-highlight", a.per_highlight, "With --sharpness: poses wanted within a highlight")
      ->capture_default_str()
      ->needs(sharpness);
  app.add_option("--step-deg", a.step_deg, "Step of the walk through the angles of the axes")
      ->capture_default_str();
  app.add_option("--max-incident-deg", a.max_incident_deg, "Steepest light")->capture_default_str();
  app.add_option("--max-exitant-deg", a.max_exitant_deg, "Steepest view")->capture_default_str();
  app.add_option("--seed", a.seed, "Of the rolls")->capture_default_str();
  app.add_option("--name", a.name, "Name of the job")->capture_default_str();
  app.add_option("--sample", a.sample, "Name of the sample")->capture_default_str();
  app.add_option("--operator", a.operator_name, "Who scans");
  auto* fixed =
      app.add_option("--exposures-us", a.exposures_us, "Bracket: every exposure, as 160000,20000,2500")
          ->delimiter(',');
  auto* halve = app.add_option("--halve-from-us", a.longest_us,
                               "Instead of a bracket: longest exposure, halved until nothing saturates")
                    ->excludes(fixed);
  app.add_option("--most-frames", a.most_frames,
                 "With --halve-from-us or --adaptive: most exposures of a pose")
      ->check(CLI::Range(1, 32))
      ->capture_default_str();
  app.add_option("--saturated-share", a.saturated_share,
                 "With --halve-from-us: share of the sample's pixels that may saturate")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->needs(halve);
  auto* predicted =
      app.add_option(
             "--predicted", a.lightest_us,
             "Instead of a bracket: that of the lightest pose, from which and --darkest-us each pose's "
             "own is predicted")
          ->delimiter(',')
          ->excludes(fixed)
          ->excludes(halve);
  predicted->needs(app.add_option("--darkest-us", a.darkest_us,
                                  "With --predicted: the bracket of the darkest pose, as many")
                       ->delimiter(',')
                       ->needs(predicted));
  app.add_option("--lightest-deg", a.lightest_deg,
                 "With --predicted: angle of the lightest pose to the mirror direction")
      ->capture_default_str()
      ->needs(predicted);
  app.add_option("--darkest-deg", a.darkest_deg,
                 "With --predicted: angle of the darkest pose to the mirror direction")
      ->capture_default_str()
      ->needs(predicted);
  auto* adaptive = app.add_option("--adaptive", a.snr,
                                  "Instead of a bracket: signal-to-noise ratio that the pixels are to reach")
                       ->check(CLI::Range(1.0, 1000.0))
                       ->excludes(fixed)
                       ->excludes(halve)
                       ->excludes(predicted);
  auto* longest = app.add_option("--longest-us", a.longest_adaptive_us, "With --adaptive: longest exposure")
                      ->needs(adaptive);
  auto* first = app.add_option("--first-us", a.first_us, "With --adaptive: first exposure of every pose")
                    ->needs(adaptive);
  adaptive->needs(longest)->needs(first);
  app.add_option("--short-share", a.short_share,
                 "With --adaptive: share of the sample's pixels that may miss the ratio")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->needs(adaptive);
}

std::vector<double> bracket_of(const std::vector<double>& exposures_us) {
  std::vector<double> bracket;
  for (const double us : exposures_us) bracket.push_back(us * 1e-6);
  std::sort(bracket.rbegin(), bracket.rend());
  return bracket;
}

rig::machine::ExposureConfig exposure_of(const Arguments& a) {
  rig::machine::ExposureConfig exposure;
  if (a.longest_us > 0) {
    exposure.strategy = rig::machine::ExposureStrategy::halve;
    exposure.longest_s = a.longest_us * 1e-6;
    exposure.most_frames = a.most_frames;
    exposure.saturated_share = a.saturated_share;
    return exposure;
  }
  if (!a.lightest_us.empty()) {
    exposure.strategy = rig::machine::ExposureStrategy::predicted;
    exposure.lightest_s = bracket_of(a.lightest_us);
    exposure.darkest_s = bracket_of(a.darkest_us);
    exposure.lightest_rad = radians(a.lightest_deg);
    exposure.darkest_rad = radians(a.darkest_deg);
    return exposure;
  }
  if (a.snr > 0) {
    exposure.strategy = rig::machine::ExposureStrategy::adaptive;
    exposure.snr = a.snr;
    exposure.first_s = a.first_us * 1e-6;
    exposure.longest_s = a.longest_adaptive_us * 1e-6;
    exposure.most_frames = a.most_frames;
    exposure.short_share = a.short_share;
    return exposure;
  }
  exposure.exposures_s = bracket_of(a.exposures_us);
  return exposure;
}

int report(const rig::base::Error& error) {
  std::fprintf(stderr, "rig-plan: %s\n", error.text().c_str());
  constexpr int kInterrupted = 130;
  return error.code == rig::base::ErrorCode::interrupted ? kInterrupted : 1;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): what is thrown here is a bug and shall end the program as one.
int main(int argc, char** argv) {
  CLI::App app{"Chooses poses so that no two look alike to an isotropic material, and writes them as a job"};
  app.name("rig-plan");
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return fmt::format("rig-plan: {}\n--help lists the options\n", error.what());
  });
  Arguments arguments;
  declare(app, arguments);
  try {
    app.parse(argc, argv);
    if (app.count("--angle-deg") + app.count("--sharpness") == 0) {
      throw CLI::ValidationError("--angle-deg or --sharpness", "one of them is required");
    }
    if (app.count("--exposures-us") + app.count("--halve-from-us") + app.count("--predicted") +
            app.count("--adaptive") ==
        0) {
      throw CLI::ValidationError("--exposures-us, --halve-from-us, --predicted or --adaptive",
                                 "one of them is required");
    }
    if (app.count("--most-frames") > 0 && app.count("--halve-from-us") + app.count("--adaptive") == 0) {
      throw CLI::RequiresError("--most-frames", "--halve-from-us or --adaptive");
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error, std::cout, std::cerr) == 0 ? 0 : 2;
  }
  rig::base::catch_interrupts();

  // Refused before the work, and again when it is written.
  std::error_code ignored;
  if (!arguments.force && std::filesystem::exists(arguments.out, ignored)) {
    return report({rig::base::ErrorCode::refused, "exists already", arguments.out, "--force replaces it"});
  }
  const auto rig = rig::machine::load_rig_config(arguments.rig);
  if (!rig) return report(rig.error());
  rig::plan::PlanRequest request;
  request.choice = {radians(arguments.angle_deg), radians(arguments.step_deg),
                    radians(arguments.max_incident_deg), radians(arguments.max_exitant_deg)};
  if (app.count("--sharpness") > 0) {
    const auto density =
        rig::plan::density_for(arguments.sharpness, arguments.threshold, arguments.per_highlight);
    if (!density) return report(density.error());
    std::printf("a highlight of cos^%g falls to %g at %.3f deg: poses %.3f deg apart\n", arguments.sharpness,
                arguments.threshold, rig::base::degrees(density->highlight_rad),
                rig::base::degrees(density->apart_3d_rad));
    request.choice.apart_rad = density->apart_3d_rad;
  }
  request.seed = arguments.seed;
  request.name = arguments.name;
  request.sample = arguments.sample;
  request.operator_name = arguments.operator_name;
  request.exposure = exposure_of(arguments);
  const auto plan = rig::plan::make_plan(*rig, request);
  if (!plan) return report(plan.error());
  if (auto written = rig::plan::write_plan(arguments.out, arguments.force, request, *plan); !written) {
    return report(written.error());
  }
  std::printf("%swritten to %s\n", rig::plan::summary(request, *plan).c_str(), arguments.out.c_str());
  return 0;
}
