#include "clients/rig/terminal_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

namespace rig::client {

namespace {

bool begins_code_point(char c) {
  return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
}

}  // namespace

std::size_t display_width(const std::string& line) {
  std::size_t width = 0;
  bool in_sequence = false;
  for (const char c : line) {
    if (c == '\033') in_sequence = true;
    if (!in_sequence && begins_code_point(c)) ++width;
    if (in_sequence && c == 'm') in_sequence = false;
  }
  return width;
}

std::string cut(const std::string& line, std::size_t width) {
  std::size_t letters = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (begins_code_point(line[i]) && ++letters > width) return line.substr(0, i);
  }
  return line;
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width, const std::string& indent) {
  std::vector<std::string> lines;
  std::string left = text;
  while (display_width(left) > width) {
    std::string line = cut(left, width);
    const bool between_words = left[line.size()] == ' ';
    const std::size_t space = line.rfind(' ');
    // An indent alone is no line.
    if (!between_words && space != std::string::npos && line.find_first_not_of(' ') < space)
      line.resize(space);
    if (line.size() <= (lines.empty() ? 0 : indent.size())) break;  // too narrow to break
    std::string rest = left.substr(line.size());
    rest.erase(0, rest.find_first_not_of(' '));
    lines.push_back(std::move(line));
    left = indent + rest;
  }
  lines.push_back(std::move(left));
  return lines;
}

std::string padded(const std::string& line, std::size_t width) {
  const std::size_t has = display_width(line);
  return has < width ? line + std::string(width - has, ' ') : line;
}

std::string bar(double share, std::size_t width, bool utf8) {
  const double clamped = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0;
  const auto full = static_cast<std::size_t>(clamped * static_cast<double>(width));
  std::string out;
  for (std::size_t i = 0; i < width; ++i) {
    if (utf8) {
      out += i < full ? "\u2588" : "\u2591";
    } else {
      out += i < full ? '#' : '.';
    }
  }
  return out;
}

std::string column_chart(const std::vector<double>& heights, bool utf8) {
  static const std::array<const char*, 9> kBlocks{" ",      "\u2581", "\u2582", "\u2583", "\u2584",
                                                  "\u2585", "\u2586", "\u2587", "\u2588"};
  constexpr const char* kAscii = " .:-=+*#@";
  std::string line;
  for (const double height : heights) {
    const double clamped = std::isfinite(height) ? std::clamp(height, 0.0, 1.0) : 0;
    const auto level = static_cast<std::size_t>(std::ceil(8 * clamped));
    if (utf8) {
      line += kBlocks.at(level);
    } else {
      line += kAscii[level];
    }
  }
  return line;
}

std::vector<std::string> picture_lines(const protocol::Frame& preview, std::size_t width,
                                       std::size_t most_rows) {
  const auto w = static_cast<std::size_t>(preview.preview_width());
  const auto h = static_cast<std::size_t>(preview.preview_height());
  if (w == 0 || h == 0 || preview.preview_rgb().size() != 3 * w * h) return {};
  std::size_t rows = width * h / w / 2;
  if (rows > most_rows) {
    rows = most_rows;
    width = rows * 2 * w / h;
  }
  if (rows == 0 || width == 0) return {};
  const auto pixel = [&](std::size_t x, std::size_t y) {
    const std::size_t at = 3 * ((y * h / (2 * rows)) * w + x * w / width);
    const auto value = [&](std::size_t c) {
      return static_cast<unsigned char>(preview.preview_rgb()[at + c]);
    };
    return fmt::format("{};{};{}", value(0), value(1), value(2));
  };
  std::vector<std::string> lines;
  for (std::size_t y = 0; y < rows; ++y) {
    std::string line;
    for (std::size_t x = 0; x < width; ++x) {
      line += fmt::format("\033[38;2;{}m\033[48;2;{}m\u2580", pixel(x, 2 * y), pixel(x, 2 * y + 1));
    }
    lines.push_back(line + "\033[0m");
  }
  return lines;
}

}  // namespace rig::client
