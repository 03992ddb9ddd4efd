// OpenEXR on memory, so that files are written by the one durable writer and read whole. Private to
// core/maps.
#pragma once

#include <OpenEXR/ImfIO.h>
#include <string>

namespace rig::maps {

class MemoryOut : public Imf::OStream {
 public:
  MemoryOut() : Imf::OStream("memory") {}
  void write(const char bytes[], int n) override;
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = position; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  uint64_t position_ = 0;
};

class MemoryIn : public Imf::IStream {
 public:
  /// Borrows `bytes`.
  explicit MemoryIn(const std::string& bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  /// Throws, as OpenEXR asks of it, where the file ends before `n` bytes.
  bool read(char bytes[], int n) override;
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = position; }

 private:
  const std::string& bytes_;
  uint64_t position_ = 0;
};

}  // namespace rig::maps
