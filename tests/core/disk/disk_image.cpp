#include "tests/core/disk/disk_image.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "tests/core/temporary_folder.h"

namespace rig::test {

namespace fs = std::filesystem;
using Kind = Operation::Kind;

namespace {

constexpr std::size_t kSector = 512;

}  // namespace

DiskImage::DiskImage(const fs::path& root) {
  load(root);
}

int DiskImage::load(const fs::path& path) {
  const int number = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  if (!fs::is_directory(path)) {
    nodes_.back().flushed = bytes_in(path);
    return number;
  }
  std::map<std::string, int> entries;
  nodes_.back().folder = true;
  for (const auto& entry : fs::directory_iterator(path)) {
    // SQLite's index of a log lives in memory that programs share; no disk promises anything about it.
    if (entry.path().string().ends_with("-shm")) continue;
    entries[entry.path().filename().string()] = load(entry.path());
  }
  Node& node = nodes_[static_cast<std::size_t>(number)];
  node.entries = entries;
  node.flushed_entries = entries;
  return number;
}

int DiskImage::find(const fs::path& path) const {
  int node = 0;
  for (const fs::path& part : path) {
    const auto& entries = nodes_.at(static_cast<std::size_t>(node)).entries;
    const auto found = entries.find(part.string());
    if (found == entries.end()) return -1;
    node = found->second;
  }
  return node;
}

void DiskImage::change(std::map<std::string, int>& entries, const Change& change) {
  for (const auto& [name, node] : change) {
    if (node < 0) {
      entries.erase(name);
    } else {
      entries[name] = node;
    }
  }
}

void DiskImage::change(const std::vector<std::pair<fs::path, int>>& entries) {
  std::map<int, Change> by_folder;
  for (const auto& [path, node] : entries) {
    by_folder[find(path.parent_path())][path.filename().string()] = node;
  }
  for (const auto& [number, each] : by_folder) {
    Node& folder = nodes_.at(static_cast<std::size_t>(number));
    change(folder.entries, each);
    folder.changes.push_back(each);
  }
}

void DiskImage::apply(const Operation& operation) {
  last_written_ = -1;
  const auto open_node = [&]() -> Node& {
    return nodes_.at(static_cast<std::size_t>(open_.at(operation.file)));
  };
  switch (operation.kind) {
    case Kind::open: {
      int node = find(operation.path);
      if (node < 0) {
        node = static_cast<int>(nodes_.size());
        nodes_.emplace_back();
        change({{operation.path, node}});
      }
      open_[operation.file] = node;
      return;
    }
    case Kind::write:
      open_node().writes.push_back({operation.offset, operation.bytes, false});
      last_written_ = open_.at(operation.file);
      return;
    case Kind::truncate:
      open_node().writes.push_back({operation.offset, {}, true});
      return;
    case Kind::flush: {
      Node& node = open_node();
      for (const Write& each : node.writes) write(node.flushed, each, each.bytes.size());
      node.writes.clear();
      return;
    }
    case Kind::make_folder: {
      const int node = static_cast<int>(nodes_.size());
      nodes_.emplace_back();
      nodes_.back().folder = true;
      change({{operation.path, node}});
      return;
    }
    case Kind::flush_folder: {
      Node& folder = nodes_.at(static_cast<std::size_t>(find(operation.path)));
      folder.flushed_entries = folder.entries;
      folder.changes.clear();
      return;
    }
    case Kind::rename:
      change({{operation.path, -1}, {operation.to, find(operation.path)}});
      return;
    case Kind::exchange:
      change({{operation.path, find(operation.to)}, {operation.to, find(operation.path)}});
      return;
    case Kind::remove:
      change({{operation.path, -1}});
      return;
    case Kind::note:
      return;
  }
}

void DiskImage::write(std::string& content, const Write& write, std::size_t most) {
  if (write.truncates) {
    content.resize(write.offset);
    return;
  }
  const std::size_t n = std::min(most, write.bytes.size());
  if (content.size() < write.offset + n) content.resize(write.offset + n);
  content.replace(write.offset, n, write.bytes, 0, n);
}

void DiskImage::restore(const fs::path& folder, Unflushed unflushed, base::Random& random) const {
  restore_node(0, folder, unflushed, random);
}

void DiskImage::restore_node(int number, const fs::path& path, Unflushed unflushed,
                             base::Random& random) const {
  const Node& node = nodes_.at(static_cast<std::size_t>(number));
  const auto chance = [&random](std::size_t most) {
    return std::min(most, static_cast<std::size_t>(random.uniform() * static_cast<double>(most + 1)));
  };
  if (!node.folder) {
    std::string content = node.flushed;
    for (std::size_t i = 0; i < node.writes.size(); ++i) {
      const Write& each = node.writes[i];
      const bool last = number == last_written_ && i + 1 == node.writes.size();
      std::size_t most = each.bytes.size();
      switch (unflushed) {
        case Unflushed::dropped:
        case Unflushed::only_entries:
          continue;
        case Unflushed::torn:
          if (last) most /= 2;
          break;
        case Unflushed::some:
          if (chance(2) == 0) continue;
          if (chance(2) == 0) most = kSector * chance(most / kSector);
          break;
        case Unflushed::kept:
        case Unflushed::only_contents:
          break;
      }
      write(content, each, most);
    }
    put_bytes(path, content);
    return;
  }
  const bool names_kept =
      unflushed == Unflushed::kept || unflushed == Unflushed::torn || unflushed == Unflushed::only_entries;
  std::map<std::string, int> entries = names_kept ? node.entries : node.flushed_entries;
  if (unflushed == Unflushed::some) {
    // A file system keeps the order of the changes to a folder.
    const std::size_t kept = chance(node.changes.size());
    for (std::size_t i = 0; i < kept; ++i) change(entries, node.changes[i]);
  }
  fs::create_directory(path);
  for (const auto& [name, child] : entries) restore_node(child, path / name, unflushed, random);
}

}  // namespace rig::test
