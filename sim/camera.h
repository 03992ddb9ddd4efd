// The virtual camera: what stands before it at the trigger becomes a frame.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/api/device.h"
#include "sim/machine.h"
#include "sim/renderer.h"

namespace rig::sim {

/// A frame's pixels are a function of the world, the counts of the axes and the light at the trigger,
/// exposure, gain, and how often this exposure and gain were triggered since arm(): never of time or of what
/// was before, but for the faults that the settings ask for.
class VirtualCamera final : public drivers::Camera {
 public:
  explicit VirtualCamera(std::shared_ptr<Machine> machine);
  ~VirtualCamera() override;
  VirtualCamera(const VirtualCamera&) = delete;
  VirtualCamera& operator=(const VirtualCamera&) = delete;

  [[nodiscard]] drivers::CameraCapabilities capabilities() const override;
  [[nodiscard]] base::Result<void> arm() override;
  /// The light and the axes are taken as they are now, for the whole exposure.
  [[nodiscard]] base::Result<void> trigger(double exposure_s, double gain) override;
  /// The machine's trigger line begins it.
  [[nodiscard]] base::Result<void> await_trigger(double exposure_s, double gain) override;
  [[nodiscard]] base::Result<std::optional<drivers::FrameInfo>> fetch(
      std::span<std::uint16_t> pixels) override;
  [[nodiscard]] base::Result<void> abort() override;

 private:
  struct Exposure {
    base::Time started;
    double exposure_s, gain;
    std::uint64_t nth;  ///< how often this setting was taken since the bracket was armed
    bool dropped;       ///< its frame never comes
    Scene scene;
  };

  [[nodiscard]] base::Result<void> check(double exposure_s, double gain) const;
  void expose_now(double exposure_s, double gain);
  void paint(const Exposure& exposure, std::span<std::uint16_t> pixels);
  [[nodiscard]] std::uint64_t noise_key(const Exposure& exposure) const;

  std::shared_ptr<Machine> machine_;
  std::unique_ptr<Renderer> renderer_;                 // none where frames are painted from a hash
  std::mutex mutex_;                                   // the trigger line is on another bus
  std::optional<std::pair<double, double>> awaiting_;  // exposure and gain that the next pulse begins
  std::optional<Exposure> exposure_;
  base::Time busy_until_{};                                   // with one that was aborted
  std::map<std::pair<double, double>, std::uint64_t> taken_;  // by exposure and gain, since armed
  std::uint64_t counter_ = 0;
  std::optional<Scene> rendered_scene_;
  std::vector<float> rendered_;
};

}  // namespace rig::sim
