#include "clients/report/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "appearance/texel.h"
#include "clients/report/figures.h"
#include "core/base/files.h"
#include "core/base/interrupt.h"
#include "core/base/progress.h"
#include "core/base/units.h"

namespace rig::report {

using base::ErrorCode;
using base::pass;
using base::Result;

namespace {

constexpr double kBrightPercentile = 0.98;
constexpr double kDifferenceGain = 4;

constexpr const char* kStyle = R"css(
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:1180px;padding:0 1rem;color:#1c2430;background:#fafaf8}
h1{font-size:1.7rem;margin-bottom:0}h2{margin-top:2.4rem;border-bottom:1px solid #ccc;padding-bottom:.2rem}
.grid{display:grid;grid-template-columns:repeat(auto-fill,minmax(250px,1fr));gap:1rem}
figure{margin:0}figure img{width:100%;image-rendering:auto;border:1px solid #bbb;background:#000}
figcaption{font-size:.85rem;color:#444}.wide{grid-template-columns:repeat(auto-fill,minmax(340px,1fr))}
table{border-collapse:collapse;margin:.6rem 0}td,th{padding:.25rem .8rem;border-bottom:1px solid #ddd;text-align:right}
td:first-child,th:first-child{text-align:left}.ok{color:#186a3b}.missed{color:#a93226}
)css";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

Result<std::string> figure(const Picture& picture, double exposure, const std::string& caption) {
  auto url = data_url(picture, exposure);
  if (!url) return pass(url);
  return fmt::format("<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>\n",
                     escaped(caption), *url);
}

Picture channels_as_picture(const maps::ParameterMap& map, const std::string& stem) {
  Picture picture{map.columns, map.rows, {}};
  const std::array<const maps::Channel*, 3> rgb{map.find(stem + ".R"), map.find(stem + ".G"),
                                                map.find(stem + ".B")};
  for (std::size_t i = 0; i < map.channels.front().values.size(); ++i) {
    for (const maps::Channel* channel : rgb)
      picture.rgb.push_back(channel != nullptr ? channel->values[i] : 0.0F);
  }
  return picture;
}

double exposure_for(const Picture& picture) {
  const double bright = percentile(picture.rgb, kBrightPercentile);
  return bright > 0 ? 0.9 / bright : 1;
}

Picture absolute_difference(const Picture& a, const Picture& b) {
  Picture out = a;
  for (std::size_t i = 0; i < out.rgb.size(); ++i) out.rgb[i] = std::abs(a.rgb[i] - b.rgb[i]);
  return out;
}

// Every parameter of a map as a picture.
Result<std::string> parameter_pictures(const maps::ParameterMap& map) {
  std::string html = "<div class=\"grid\">\n";
  const auto add = [&html](Result<std::string> made) -> Result<void> {
    if (!made) return pass(made);
    html += *made;
    return {};
  };
  for (const std::string stem : {"rho_d", "lobe1.rho_s"}) {
    const Picture picture = channels_as_picture(map, stem);
    const double exposure = exposure_for(picture);
    if (auto ok =
            add(figure(picture, exposure, fmt::format("{}, sr^-1; white is {:.3g}", stem, 1 / exposure)));
        !ok)
      return pass(ok);
  }
  for (const maps::Channel& channel : map.channels) {
    if (channel.name.find("rho_") != std::string::npos) continue;
    const double low = percentile(channel.values, 0.02);
    const double high = percentile(channel.values, 0.98);
    const Picture picture = colour_scale(channel.values, map.columns, map.rows, low, high);
    if (auto ok = add(
            figure(picture, 1, fmt::format("{}: {:.3g} (dark) to {:.3g} (bright)", channel.name, low, high)));
        !ok) {
      return pass(ok);
    }
  }
  return html + "</div>\n";
}

// Measured values and the model of one texel over the angle between half vector and normal.
Result<std::string> texel_plot(const maps::ObservationReader& observation, const maps::ParameterMap& map,
                               int t, int s, const std::string& label) {
  auto block = observation.read(t, 1, s, 1);
  if (!block) return pass(block);
  const maps::ObservationHeader& header = observation.header();
  const auto samples =
      appearance::samples_of(header, *block, 0, 0, std::vector<bool>(header.poses.size(), true));
  const auto model = model_at(map, static_cast<std::size_t>(t) * static_cast<std::size_t>(header.columns) +
                                       static_cast<std::size_t>(s));
  double top = 1e-6;
  for (const auto& sample : samples)
    top = std::max({top, sample.value[1], appearance::evaluate(model, sample.incident, sample.exitant, 1)});
  // Polar: the exitant direction's angle from the normal in its own plane, towards the light's side to the
  // right.
  std::string svg =
      "<svg viewBox=\"-110 -110 220 125\" width=\"340\"><line x1=\"-105\" x2=\"105\" y1=\"0\" y2=\"0\" "
      "stroke=\"#888\"/>"
      "<line x1=\"0\" x2=\"0\" y1=\"0\" y2=\"-105\" stroke=\"#ccc\"/>";
  const auto dot_at = [&](const appearance::Sample& sample, double value, const char* style) {
    const double theta = std::atan2(std::hypot(sample.exitant.x, sample.exitant.y), sample.exitant.z);
    const double side =
        sample.exitant.x * sample.incident.x + sample.exitant.y * sample.incident.y >= 0 ? 1 : -1;
    const double r = 100 * std::sqrt(std::max(0.0, value) / top);
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" {}/>", side * r * std::sin(theta),
                       -r * std::cos(theta), style);
  };
  for (const auto& sample : samples) {
    dot_at(sample, appearance::evaluate(model, sample.incident, sample.exitant, 1),
           "r=\"3\" fill=\"none\" stroke=\"#c0392b\"");
    dot_at(sample, sample.value[1], "r=\"1.6\" fill=\"#1f618d\"");
  }
  return fmt::format(
      "<figure>{}</svg><figcaption>{}: measured (dots) and model (rings), green channel; full radius is "
      "{:.3g} sr^-1, radius grows with the root</figcaption></figure>\n",
      svg, escaped(label), top);
}

// A handful of texels, one a region where regions are known, else spread over the sample.
Result<std::string> plots(const maps::ObservationReader& observation, const maps::ParameterMap& map,
                          const maps::ParameterMap* regions) {
  std::string html = "<div class=\"grid wide\">\n";
  const int columns = map.columns;
  const int rows = map.rows;
  for (const auto& [u, v] : {std::pair(0.09, 0.66), std::pair(0.38, 0.66), std::pair(0.53, 0.66),
                             std::pair(0.25, 0.25), std::pair(0.75, 0.25), std::pair(0.5, 0.02)}) {
    const int s = std::min(columns - 1, static_cast<int>(u * columns));
    const int t = std::min(rows - 1, static_cast<int>(v * rows));
    std::string label = fmt::format("texel {}, {}", s, t);
    if (const maps::Channel* region = regions != nullptr ? regions->find("region") : nullptr;
        region != nullptr) {
      const auto index =
          std::lround(region->values[static_cast<std::size_t>(t) * static_cast<std::size_t>(columns) +
                                     static_cast<std::size_t>(s)]);
      const auto name = regions->attributes.find("region." + std::to_string(index));
      if (name != regions->attributes.end()) label += ", " + name->second;
    }
    auto plot = texel_plot(observation, map, t, s, label);
    if (!plot) return plot;
    html += *plot;
  }
  return html + "</div>\n";
}

// The poses held out of a map that this observation map has.
std::vector<int> held_out_of(const maps::ParameterMap& map, std::size_t count) {
  std::vector<int> poses = held_out_poses(map);
  poses.erase(std::remove_if(poses.begin(), poses.end(),
                             [count](int p) { return static_cast<std::size_t>(p) >= count; }),
              poses.end());
  return poses;
}

// Refuses to write over what the report is made from.
Result<void> check(const Options& options) {
  if (options.maps.empty()) return base::fail(ErrorCode::bad_input, "a report needs a parameter map");
  std::vector<std::filesystem::path> sources = options.maps;
  sources.push_back(options.observation);
  if (!options.truth.empty()) sources.push_back(options.truth);
  for (const auto& source : sources) {
    std::error_code absent;
    if (std::filesystem::equivalent(options.out, source, absent)) {
      return base::fail(ErrorCode::refused, "is what the report is made from", options.out.string(),
                        "name another file to write to");
    }
  }
  return {};
}

}  // namespace

Result<std::vector<Figure>> write_report(const Options& options) {
  if (auto ok = check(options); !ok) return pass(ok);
  auto observation = maps::ObservationReader::open(options.observation);
  if (!observation) return pass(observation);
  const maps::ObservationHeader& header = observation->header();
  std::vector<maps::ParameterMap> maps;
  for (const auto& path : options.maps) {
    auto map = maps::read_parameter_map(path);
    if (!map) return pass(map);
    if (map->columns != header.columns || map->rows != header.rows || map->find("rho_d.R") == nullptr) {
      return base::fail(ErrorCode::bad_input, "was not fitted to this observation map", path.string());
    }
    maps.push_back(std::move(*map));
  }
  std::optional<maps::ParameterMap> regions;
  std::vector<Figure> figures;
  std::string truth_html;
  if (!options.truth.empty()) {
    auto truth = compare_with_truth(*observation, options.truth);
    if (!truth) return pass(truth);
    figures.push_back({"registration_rms_mm", truth->registration_rms_mm, 0.05});
    figures.push_back({"reflectance_median_relative_error", truth->reflectance_error, 0.02});
    std::filesystem::path path = options.truth;
    auto read = maps::read_parameter_map(path.replace_extension("regions.exr"));
    if (!read) return pass(read);
    if (read->columns != header.columns || read->rows != header.rows) {
      return base::fail(ErrorCode::bad_input, "is not of this observation map", path.string(),
                        "make it with rig virtual-truth --like");
    }
    regions = std::move(*read);
    truth_html = fmt::format(
        "<p>{} poses of at most 60 degrees entered the registration's figure, {} values the "
        "reflectance's.</p>",
        truth->registered_poses, truth->values);
  }
  const maps::ParameterMap* known = regions ? &*regions : nullptr;

  std::string views_html;
  std::string table = "<table><tr><th>view (light, camera)</th>";
  for (const auto& map : maps) {
    table += fmt::format("<th>{0} mean</th><th>deviation</th><th>mean |difference|</th>{1}",
                         escaped(map.model), known != nullptr ? "<th>rough regions</th>" : "");
  }
  table += "</tr>\n";
  std::vector<double> rough(maps.size(), 0.0);
  const std::vector<int> held_out = held_out_of(maps.front(), header.poses.size());
  std::vector<int> poses = held_out;
  if (poses.empty()) {
    poses.resize(header.poses.size());
    std::iota(poses.begin(), poses.end(), 0);
  }
  base::Progress progress("report", poses.size(), "views");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (base::interrupted()) return base::interrupted_error("no report was written");
    auto view = make_view(*observation, poses[i], maps, known);
    if (!view) return pass(view);
    const std::string name =
        fmt::format("pose {} ({:.0f}, {:.0f} deg)", header.poses[static_cast<std::size_t>(poses[i])].row,
                    view->incident_deg, view->exitant_deg);
    table += "<tr><td>" + name + "</td>";
    for (std::size_t m = 0; m < maps.size(); ++m) {
      const ViewError& e = view->errors[m];
      table +=
          fmt::format("<td>{:+.5f}</td><td>{:.5f}</td><td>{:.5f}</td>", e.mean, e.deviation, e.mean_absolute);
      if (known != nullptr) {
        table += fmt::format("<td>{:.5f}</td>", view->rough_error[m]);
        rough[m] += view->rough_error[m] / static_cast<double>(poses.size());
      }
    }
    table += "</tr>\n";
    progress.add();
    if (i >= static_cast<std::size_t>(options.views)) continue;
    const double exposure = exposure_for(view->photograph);
    views_html += "<h3>" + name + "</h3><div class=\"grid wide\">\n";
    std::vector<std::pair<Picture, std::string>> shown{{view->photograph, "photograph"}};
    for (std::size_t m = 0; m < maps.size(); ++m) {
      shown.emplace_back(view->renderings[m], "rendering, " + maps[m].model);
      Picture difference = absolute_difference(view->renderings[m], view->photograph);
      for (float& v : difference.rgb) v *= static_cast<float>(kDifferenceGain);
      shown.emplace_back(std::move(difference), fmt::format("difference, {}, {:.0f} times amplified",
                                                            maps[m].model, kDifferenceGain));
    }
    for (const auto& [picture, caption] : shown) {
      auto html = figure(picture, exposure, caption);
      if (!html) return pass(html);
      views_html += *html;
    }
    views_html += "</div>\n";
  }
  table += "</table>\n";
  if (known != nullptr && maps.size() > 1 && rough[0] > 0) {
    figures.push_back({"rough_regions_improvement_over_" + maps[1].model, rough[1] / rough[0], 1.5, true});
  }
  std::string html = fmt::format(
      "<!doctype html><html lang=\"en\"><meta "
      "charset=\"utf-8\"><title>{0}</title><style>{1}</style>\n<h1>{0}</h1>\n",
      escaped(header.name), kStyle);
  html += fmt::format(
      "<p>{} x {} texels over {:.1f} x {:.1f} mm, {} poses, {} of them held out of the fit. Values are "
      "{}.</p>\n",
      header.columns, header.rows, 1e3 * header.width_m, 1e3 * header.height_m, header.poses.size(),
      held_out.size(), header.absolute ? "BRDF in sr^-1" : "relative BRDF");
  if (!figures.empty()) {
    html +=
        "<h2>Against the truth of the virtual "
        "rig</h2><table><tr><th>figure</th><th>value</th><th>limit</th></tr>\n";
    for (const Figure& f : figures) {
      html += fmt::format("<tr><td>{}</td><td class=\"{}\">{:.4f}</td><td>{} {}</td></tr>\n", escaped(f.name),
                          f.met() ? "ok" : "missed", f.value, f.at_least ? "at least" : "at most", f.limit);
    }
    html += "</table>" + truth_html;
  }
  html += "<h2>Parameters</h2>\n";
  auto parameters = parameter_pictures(maps.front());
  if (!parameters) return pass(parameters);
  html += *parameters + "<h2>Views</h2><p>Luminance of f cos(theta_i), rendering minus photograph.</p>\n" +
          table + views_html;
  auto texels = plots(*observation, maps.front(), known);
  if (!texels) return pass(texels);
  html += "<h2>Texels</h2>\n" + *texels + "<h2>Provenance</h2><table>\n";
  for (const auto& [key, value] : header.provenance)
    html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escaped(key), escaped(value));
  html += "</table></html>\n";
  if (auto ok = base::write_file_durably(options.out, html); !ok) return pass(ok);
  return figures;
}

}  // namespace rig::report
