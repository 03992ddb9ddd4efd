#include "calibration/registration_file.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/config.h"
#include "core/base/files.h"
#include "core/base/hash.h"

namespace rig::calibration {

namespace {

constexpr base::Range kAnyNumber{-1e30, 1e30};

std::string toml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      out += c;
    }
  }
  return out + '"';
}

// Shortest text that reads back to the same value, and a TOML float.
std::string toml_number(double value) {
  std::string out = fmt::format("{}", value);
  if (out.find_first_of(".en") == std::string::npos) out += ".0";
  return out;
}

template <typename Numbers>
std::string toml_numbers(const Numbers& values) {
  std::string out = "[";
  for (const double value : values) out += (out.size() > 1 ? ", " : "") + toml_number(value);
  return out + "]";
}

std::vector<int> ids(const base::ConfigTable& table, std::string_view key) {
  std::vector<int> out;
  for (const double value : table.numbers(key, 0, {0, 1e6})) {
    if (value != std::floor(value)) table.error(key, "holds a tag id that is no whole number");
    out.push_back(static_cast<int>(value));
  }
  return out;
}

PoseRegistration parse_pose(const base::ConfigTable& table) {
  PoseRegistration pose;
  pose.row = table.integer("row", 0, 1'000'000'000);
  pose.registered = table.choice("status", {"registered", "rejected"}) == "registered";
  pose.frame = static_cast<int>(table.integer_or("frame", -1, -1, 1'000'000));
  pose.tags = ids(table, "tags");
  pose.left_out = ids(table, "left_out");
  if (!pose.registered) {
    pose.reason = table.text("reason");
    return pose;
  }
  const auto matrix = table.numbers("camera_from_sample", 12, kAnyNumber);
  const auto covariance = table.numbers("covariance", 36, kAnyNumber);
  pose.rms_px = table.number("rms_px", {0, 1e6});
  pose.expected_error_m = table.number("expected_error_mm", {0, 1e6}) * 1e-3;
  pose.turn_rad = table.number("turn_from_nominal_rad", {0, 4});
  pose.shift_m = table.number("shift_from_nominal_mm", {0, 1e6}) * 1e-3;
  if (matrix.size() != 12 || covariance.size() != 36) return pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      pose.camera_from_sample.rotation(r, c) = matrix[static_cast<std::size_t>(4 * r + c)];
    }
  }
  pose.camera_from_sample.translation = {matrix[3], matrix[7], matrix[11]};
  const geometry::Mat3 square =
      pose.camera_from_sample.rotation * geometry::transposed(pose.camera_from_sample.rotation);
  const geometry::Mat3 identity;
  double worst = std::abs(geometry::determinant(pose.camera_from_sample.rotation) - 1);
  for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::abs(square.m[i] - identity.m[i]));
  if (worst > 1e-6) table.error("camera_from_sample", "its first three columns are no rotation");
  std::copy(covariance.begin(), covariance.end(), pose.covariance.begin());
  return pose;
}

}  // namespace

std::filesystem::path registration_path(const std::filesystem::path& scan) {
  return scan / "registration.toml";
}

std::string format_registration(const RegistrationFile& file) {
  std::string out =
      "# Where the carrier stood before the camera in every pose. Written by rig-calibrate;\n"
      "# camera_from_sample is 3 x 4, row-major, metres; covariance is 6 x 6 of a rotation vector (radians, "
      "camera\n"
      "# frame, about the sample's centre) and a shift (metres).\n";
  out += fmt::format("format = {}\nrig_sha256 = {}\n", kRegistrationFormat, toml_text(file.rig_sha256));
  for (const PoseRegistration& pose : file.poses) {
    out += fmt::format("\n[[pose]]\nrow = {}\nstatus = \"{}\"\n", pose.row,
                       pose.registered ? "registered" : "rejected");
    if (pose.frame >= 0) out += fmt::format("frame = {}\n", pose.frame);
    out += fmt::format("tags = [{}]\nleft_out = [{}]\n", fmt::join(pose.tags, ", "),
                       fmt::join(pose.left_out, ", "));
    if (!pose.registered) {
      out += fmt::format("reason = {}\n", toml_text(pose.reason));
      continue;
    }
    const auto& r = pose.camera_from_sample.rotation.m;
    const auto& t = pose.camera_from_sample.translation;
    const std::array<double, 12> matrix{r[0], r[1], r[2], t.x, r[3], r[4], r[5], t.y, r[6], r[7], r[8], t.z};
    out += fmt::format("camera_from_sample = {}\ncovariance = {}\n", toml_numbers(matrix),
                       toml_numbers(pose.covariance));
    out += fmt::format("rms_px = {}\nexpected_error_mm = {}\n", toml_number(pose.rms_px),
                       toml_number(pose.expected_error_m * 1e3));
    out += fmt::format("turn_from_nominal_rad = {}\nshift_from_nominal_mm = {}\n", toml_number(pose.turn_rad),
                       toml_number(pose.shift_m * 1e3));
  }
  return out;
}

base::Result<RegistrationFile> parse_registration(std::string_view text, const std::string& name) {
  auto root = base::ConfigTable::parse(text, name);
  if (!root) return base::pass(root);
  const auto format = root->integer("format", 1, 1'000'000);
  if (format > kRegistrationFormat) {
    return base::fail(
        base::ErrorCode::newer,
        fmt::format("format {} is newer than {}, the newest this program reads", format, kRegistrationFormat),
        root->where("format"), "update rigd, or run 'rig calibrate' again with this version");
  }
  RegistrationFile file;
  file.rig_sha256 = root->text("rig_sha256");
  std::set<std::int64_t> rows;
  for (const base::ConfigTable& table : root->tables("pose")) {
    file.poses.push_back(parse_pose(table));
    if (!rows.insert(file.poses.back().row).second) table.error("row", "stands there twice");
  }
  if (auto finished = root->finish(); !finished) return base::pass(finished);
  std::sort(file.poses.begin(), file.poses.end(),
            [](const PoseRegistration& a, const PoseRegistration& b) { return a.row < b.row; });
  return file;
}

base::Result<void> write_registration(const std::filesystem::path& scan, const RegistrationFile& file) {
  return base::write_file_durably(registration_path(scan), format_registration(file));
}

base::Result<RegistrationFile> read_registration(const std::filesystem::path& scan) {
  const std::filesystem::path path = registration_path(scan);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    return base::fail(base::ErrorCode::not_found, "the scan is not registered", path.string(),
                      fmt::format("run 'rig calibrate {}' first", scan.string()));
  }
  const auto text = base::read_file(path);
  if (!text) return base::pass(text);
  auto file = parse_registration(*text, path.string());
  if (!file) return file;
  const auto rig = base::sha256_of_file(scan / "rig.toml");
  if (!rig) return base::pass(rig);
  if (*rig != file->rig_sha256) {
    return base::fail(base::ErrorCode::bad_input, "was made with another rig.toml than the scan holds now",
                      path.string(), fmt::format("run 'rig calibrate {}' again", scan.string()));
  }
  return file;
}

}  // namespace rig::calibration
