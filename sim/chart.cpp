#include "sim/chart.h"

#include <algorithm>
#include <cmath>

#include "sim/font.h"
#include "sim/sgd.h"

namespace rig::sim {

namespace {

constexpr int kPaper = 0;  // delrin
constexpr int kInk = 1;    // black soft plastic
constexpr int kFirstPatch = 2;
constexpr int kPatchColumns = 6;
constexpr int kWeave = 14;
constexpr int kSatin = 15;
constexpr int kWedge = 16;

struct Line {
  const char* text;
  double height_mm, x_mm, y_mm;
};
constexpr std::array<Line, 3> kLines{{{"RIGD 8 MM SEES LIGHT", 8, -69, 64},
                                      {"THE QUICK BROWN FOX JUMPS 5 MM 123", 5, -72, 54},
                                      {"PACK MY BOX WITH FIVE DOZEN LIQUOR JUGS 3 MM 0123456", 3, -67, 47}}};

const std::array<Thread, 3> kThreads{{
    {{0.05, 0.10, 0.36}, 0.06, 0.18, 0.45, 0.35, 0.35},  // warp: indigo
    {{0.80, 0.74, 0.62}, 0.06, 0.18, 0.45, 0.35, 0.35},  // weft: raw cotton
    {{0.55, 0.16, 0.14}, 0.14, 0.14, 0.30, 0.20, 0.12},  // satin: red, shiny, nearly straight
}};

double sawtooth(double x) {
  return x - std::floor(x);
}

// Plain weave: warp along y and weft along x take turns on top, 1 mm wide.
Spot weave(double x_mm, double y_mm) {
  const auto column = static_cast<long>(std::floor(x_mm));
  const auto row = static_cast<long>(std::floor(y_mm));
  Spot spot{kWeave, -1, 0, {0, 1, 0}, 1};
  const bool warp = ((column + row) & 1) == 0;
  if (!warp) {
    spot.thread = 1;
    spot.tangent = {1, 0, 0};
  }
  // A thread is darker where it dives below its neighbour.
  const double along = warp ? sawtooth(y_mm) : sawtooth(x_mm);
  spot.shade = 0.75 + 0.25 * std::sin(kPi * along);
  return spot;
}

// Parallel threads at 30 degrees whose colour deepens from left to right.
Spot satin(double x_mm) {
  constexpr double kTurn = kPi / 6;
  return {kSatin,
          -1,
          2,
          {std::cos(kTurn), std::sin(kTurn), 0},
          1.15 - 0.5 * std::clamp((x_mm - 5) / 70, 0.0, 1.0)};
}

}  // namespace

const std::vector<std::string>& region_names() {
  static const auto names = [] {
    std::vector<std::string> made;
    for (const SgdMaterial& m : sgd_materials()) made.push_back(m.name);
    made[kPaper] = "paper (delrin)";
    made[kInk] = "ink (black-soft-plastic)";
    made.emplace_back("plain weave");
    made.emplace_back("satin threads");
    made.emplace_back("grey wedge (delrin, shaded)");
    return made;
  }();
  return names;
}

const std::array<Thread, 3>& threads() {
  return kThreads;
}

Spot spot_at(double x_mm, double y_mm) {
  for (const Line& line : kLines) {
    if (inked(line.text, line.height_mm, x_mm - line.x_mm, y_mm - line.y_mm)) return {kInk, kInk, -1, {}, 1};
  }
  // Two rows of six patches of 22 mm, 2 mm apart.
  constexpr double kPitch = 24;
  constexpr double kEdge = 22;
  const double u = x_mm + 71;
  const double v = 42 - y_mm;
  if (u >= 0 && v >= 0 && u < kPatchColumns * kPitch && v < 2 * kPitch && std::fmod(u, kPitch) < kEdge &&
      std::fmod(v, kPitch) < kEdge) {
    const int index =
        kFirstPatch + static_cast<int>(v / kPitch) * kPatchColumns + static_cast<int>(u / kPitch);
    return {index, index, -1, {}, 1};
  }
  if (y_mm > 74 && y_mm < 78 && std::abs(x_mm) < 72) {
    return {kWedge, kPaper, -1, {}, 1 - 0.9 * (x_mm + 72) / 144};
  }
  if (y_mm > -76 && y_mm < -12) {
    if (x_mm > -76 && x_mm < -4) return weave(x_mm, y_mm);
    if (x_mm > 4 && x_mm < 76) return satin(x_mm);
  }
  return {kPaper, kPaper, -1, {}, 1};
}

double spot_brdf(const Spot& spot, V3 wi, V3 wr, int channel) {
  if (spot.thread >= 0) {
    return spot.shade *
           thread_brdf(kThreads[static_cast<std::size_t>(spot.thread)], spot.tangent, wi, wr, channel);
  }
  const SgdChannel& material =
      sgd_materials()[static_cast<std::size_t>(spot.material)].rgb[static_cast<std::size_t>(channel)];
  return sgd_brdf(material, wi, wr, spot.shade);
}

double spot_alpha(const Spot& spot) {
  if (spot.material < 0) return 1;
  const auto& rgb = sgd_materials()[static_cast<std::size_t>(spot.material)].rgb;
  return (rgb[0].alpha + rgb[1].alpha + rgb[2].alpha) / 3;
}

std::array<double, 3> spot_albedo(const Spot& spot) {
  std::array<double, 3> albedo{};
  for (std::size_t c = 0; c < 3; ++c) {
    albedo[c] = spot.shade * (spot.thread >= 0
                                  ? kThreads[static_cast<std::size_t>(spot.thread)].colour[c]
                                  : sgd_materials()[static_cast<std::size_t>(spot.material)].rgb[c].rho_d);
  }
  return albedo;
}

}  // namespace rig::sim
