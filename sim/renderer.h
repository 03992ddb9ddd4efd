// What the camera sees before its electronics: the rate of photoelectrons in every pixel.
#pragma once

#include <memory>
#include <vector>

#include "sim/world.h"

namespace rig::sim {

class Renderer {
 public:
  explicit Renderer(const World& world);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Photoelectrons per second in each pixel of the RGGB mosaic, row by row, with the axes truly at `angles`
  /// and the light at its full level. Each of a pixel's samples has its own place in the pixel and its own
  /// point of the light's aperture; only the mosaic's colour is computed.
  [[nodiscard]] std::vector<float> render(const Angles& angles) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rig::sim
