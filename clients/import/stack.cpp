#include "clients/import/stack.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "clients/import/text_rows.h"

namespace rig::import {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

Result<std::vector<std::array<double, 3>>> read_points(const fs::path& file, double unit_m) {
  const auto rows = read_text_rows(file);
  if (!rows) return pass(rows);
  std::vector<std::array<double, 3>> points;
  for (const TextRow& row : *rows) {
    const auto n = numbers_of(row, 0, 3, file);
    if (!n) return pass(n);
    if ((*n)[2] <= 0) {
      return fail(ErrorCode::bad_input, fmt::format("z = {} is not above the sample", (*n)[2]),
                  fmt::format("{}:{}", file.string(), row.line));
    }
    points.push_back({(*n)[0] * unit_m, (*n)[1] * unit_m, (*n)[2] * unit_m});
  }
  return points;
}

// The one line of a file.
Result<std::vector<double>> read_line(const fs::path& file, std::size_t count) {
  const auto rows = read_text_rows(file);
  if (!rows) return pass(rows);
  if (rows->size() != 1) {
    return fail(ErrorCode::bad_input, fmt::format("has {} lines, one belongs there", rows->size()),
                file.string());
  }
  auto numbers = numbers_of(rows->front(), 0, count, file);
  if (!numbers) return numbers;
  for (const double n : *numbers) {
    if (n <= 0) return fail(ErrorCode::bad_input, fmt::format("{} is not positive", n), file.string() + ":1");
  }
  return numbers;
}

bool is_image(const fs::path& file) {
  static const std::set<std::string> kEndings{".png",  ".jpg", ".jpeg", ".tif",
                                              ".tiff", ".exr", ".hdr",  ".pfm"};
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return kEndings.count(ending) > 0;
}

std::vector<fs::path> files_of(const fs::path& folder, bool (*wanted)(const fs::path&)) {
  std::vector<fs::path> files;
  std::error_code unreadable_is_empty;
  for (const auto& entry : fs::directory_iterator(folder, unreadable_is_empty)) {
    if (wanted(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

Result<Stack> read_positions_layout(const fs::path& folder, double unit_m) {
  Stack stack;
  stack.layout = "camera_pos.txt, light_pos.txt";
  const auto cameras = read_points(folder / "camera_pos.txt", unit_m);
  if (!cameras) return pass(cameras);
  const auto lights = read_points(folder / "light_pos.txt", unit_m);
  if (!lights) return pass(lights);
  const auto size = read_line(folder / "image_size.txt", 1);
  if (!size) return pass(size);
  const auto power = read_line(folder / "light_power.txt", 3);
  if (!power) return pass(power);
  const auto images = files_of(folder, is_image);
  if (cameras->empty() || cameras->size() != lights->size() || cameras->size() != images.size()) {
    return fail(ErrorCode::bad_input,
                fmt::format("there are {} camera positions, {} light positions and {} images",
                            cameras->size(), lights->size(), images.size()),
                folder.string(), "each image needs a line in both files, in the order of the names");
  }
  stack.width_m = size->front() * unit_m;
  for (std::size_t c = 0; c < 3; ++c) stack.light_power[c] = (*power)[c] * unit_m * unit_m;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto& light = (*lights)[i];
    stack.photographs.push_back({images[i], (*cameras)[i], {light[0], light[1], light[2], 1}});
  }
  return stack;
}

Result<Stack> read_lp_layout(const fs::path& file, double camera_distance_m) {
  const auto rows = read_text_rows(file);
  if (!rows) return pass(rows);
  if (rows->empty()) return fail(ErrorCode::bad_input, "is empty", file.string());
  const auto count = numbers_of(rows->front(), 0, 1, file);
  if (!count) return pass(count);
  if (count->front() != static_cast<double>(rows->size() - 1)) {
    return fail(
        ErrorCode::bad_input,
        fmt::format("the first line promises {} images, {} lines follow", count->front(), rows->size() - 1),
        file.string() + ":1");
  }
  Stack stack;
  stack.layout = "RTI, " + file.filename().string();
  for (std::size_t i = 1; i < rows->size(); ++i) {
    const TextRow& row = (*rows)[i];
    const std::string where = fmt::format("{}:{}", file.string(), row.line);
    if (row.words.size() < 4) {
      return fail(ErrorCode::bad_input,
                  fmt::format("has {} values, a file name and three numbers belong there", row.words.size()),
                  where);
    }
    // A file name may hold blanks: the numbers are the last three words.
    TextRow joined{row.line, {row.words.front()}};
    for (std::size_t k = 1; k + 3 < row.words.size(); ++k) joined.words.front() += " " + row.words[k];
    joined.words.insert(joined.words.end(), row.words.end() - 3, row.words.end());
    const auto d = numbers_of(joined, 1, 3, file);
    if (!d) return pass(d);
    const double length = std::hypot((*d)[0], (*d)[1], (*d)[2]);
    if (!(length > 1e-9)) return fail(ErrorCode::bad_input, "the light has no direction", where);
    std::string name = joined.words.front();
    std::replace(name.begin(), name.end(), '\\', '/');
    fs::path image = file.parent_path() / name;
    if (!fs::exists(image)) image = file.parent_path() / fs::path(name).filename();
    if (!fs::exists(image))
      return fail(ErrorCode::not_found, fmt::format("there is no image '{}'", name), where);
    stack.photographs.push_back(
        {image, {0, 0, camera_distance_m}, {(*d)[0] / length, (*d)[1] / length, (*d)[2] / length, 0}});
  }
  if (stack.photographs.empty()) return fail(ErrorCode::bad_input, "names no image", file.string());
  return stack;
}

Result<FoundLayout> find_layout(const fs::path& path) {
  if (!fs::exists(path)) return fail(ErrorCode::not_found, "does not exist", path.string());
  const auto is_lp = [](const fs::path& p) { return p.extension() == ".lp"; };
  if (!fs::is_directory(path)) {
    if (is_lp(path)) return FoundLayout{Layout::lp, path};
    return fail(ErrorCode::bad_input, "is neither a folder nor an .lp file", path.string());
  }
  if (fs::exists(path / "camera_pos.txt")) return FoundLayout{Layout::positions, path};
  const auto found = files_of(path, is_lp);
  if (found.size() == 1) return FoundLayout{Layout::lp, found.front()};
  if (found.size() > 1) {
    return fail(ErrorCode::bad_input, fmt::format("holds {} .lp files", found.size()), path.string(),
                "name one of them");
  }
  return fail(ErrorCode::bad_input, "is no stack that can be imported", path.string(),
              "it needs camera_pos.txt and light_pos.txt, or an .lp file");
}

}  // namespace rig::import
