#include "tests/drivers/conformance/fake_camera.h"

#include <algorithm>
#include <cmath>

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;

std::optional<double> FakeSensor::exposure_in(std::span<const std::uint16_t> pixels) {
  const bool even =
      std::all_of(pixels.begin(), pixels.end(), [&](std::uint16_t p) { return p == pixels.front(); });
  return even ? pixels.front() * kUnit_s : 0;
}

void FakeSensor::begin(double exposure_s) {
  Frame frame;
  frame.exposure_s = exposure_s;
  frame.started = clock_.now();
  frame.ready = frame.started + base::seconds(exposure_s + 0.01);
  frame.number = ++numbers_;
  frame.corrupt = std::exchange(corrupt_next_, false);
  frame.lost = std::exchange(drop_next_, false);
  frame_ = frame;
}

void FakeSensor::paint(const Frame& frame, std::span<std::uint16_t> pixels) {
  std::fill(pixels.begin(), pixels.end(),
            static_cast<std::uint16_t>(std::lround(frame.exposure_s / kUnit_s)));
  if (!frame.corrupt) return;
  const auto line = pixels.subspan(kWidth, kWidth);
  std::fill(line.begin(), line.end(), std::uint16_t{0});
}

namespace {

constexpr std::size_t kPixels = std::size_t{FakeSensor::kWidth} * FakeSensor::kHeight;

class FakeCamera final : public Camera {
 public:
  FakeCamera(FakeSensor& sensor, FakeWire& wire, base::Clock& clock, Flaw flaw)
      : sensor_(sensor), wire_(wire), clock_(clock), flaw_(flaw) {
    if (flaw_ != Flaw::frame_over_death && flaw_ != Flaw::ends_only_in_order) sensor_.frame().reset();
  }
  ~FakeCamera() override {
    if (flaw_ == Flaw::ends_only_in_order) sensor_.frame().reset();
  }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  [[nodiscard]] CameraCapabilities capabilities() const override {
    return {FakeSensor::kWidth, FakeSensor::kHeight, 16, "none", 1e-4, 0.5, 0.01, true};
  }

  [[nodiscard]] Result<void> arm() override {
    if (auto ok = reach(); !ok) return ok;
    if (flaw_ != Flaw::delivers_unplugged) sensor_.frame().reset();
    return {};
  }

  [[nodiscard]] Result<void> trigger(double exposure_s, double /*gain*/) override {
    if (auto ok = reach(); !ok) return ok;
    auto& frame = sensor_.frame();
    if (frame && flaw_ != Flaw::takes_second_trigger) return fail(ErrorCode::busy, "it exposes", "fake");
    asked_s_ = exposure_s;
    sensor_.begin(flaw_ == Flaw::exposes_twice_as_long ? 2 * exposure_s : exposure_s);
    return {};
  }

  [[nodiscard]] Result<std::optional<FrameInfo>> fetch(std::span<std::uint16_t> pixels) override {
    auto& frame = sensor_.frame();
    const bool there = frame && clock_.now() >= frame->ready;
    if (flaw_ != Flaw::delivers_unplugged || !there) {
      if (auto ok = reach(); !ok) return base::pass(ok);
    }
    if (pixels.size() != kPixels && flaw_ != Flaw::takes_small_buffer) {
      return fail(ErrorCode::bad_input, "the buffer has not the size of a frame", "fake");
    }
    if (!there) return std::optional<FrameInfo>();
    FakeSensor::Frame taken = *frame;
    if (taken.lost) {
      if (flaw_ != Flaw::fills_in_missing || !last_) return std::optional<FrameInfo>();
      taken = *last_;
    }
    frame.reset();
    if (taken.corrupt && flaw_ != Flaw::delivers_corrupt) {
      const bool wrong = flaw_ == Flaw::corrupt_is_device;
      return fail(wrong ? ErrorCode::device : ErrorCode::damaged, "damaged frame", "fake");
    }
    if (flaw_ == Flaw::frame_of_before && last_)
      std::swap(*last_, taken);
    else
      last_ = taken;
    return deliver(taken, pixels);
  }

  [[nodiscard]] Result<void> abort() override {
    if (auto ok = reach(); !ok) return ok;
    if (flaw_ != Flaw::abort_does_nothing) sensor_.frame().reset();
    return {};
  }

 private:
  Result<void> reach() {
    if (wire_.is_cut() || (lost_ && flaw_ == Flaw::never_back)) {
      lost_ = true;
      if (flaw_ != Flaw::delivers_unplugged) sensor_.frame().reset();
      return fail(ErrorCode::lost, "it is not there", "fake");
    }
    return {};
  }

  std::optional<FrameInfo> deliver(const FakeSensor::Frame& taken, std::span<std::uint16_t> pixels) {
    std::vector<std::uint16_t> whole(kPixels);
    FakeSensor::paint(taken, whole);
    std::size_t count = std::min(pixels.size(), kPixels);
    if (flaw_ == Flaw::leaves_last_line) count -= FakeSensor::kWidth;
    std::copy_n(whole.begin(), count, pixels.begin());
    if (flaw_ == Flaw::overruns_buffer) pixels.data()[pixels.size()] = 0;
    FrameInfo info;
    info.exposure_s = flaw_ == Flaw::exposes_twice_as_long ? asked_s_ : taken.exposure_s;
    if (flaw_ == Flaw::reports_wrong_exposure) info.exposure_s *= 1.1;
    info.started = taken.started;
    info.counter = flaw_ == Flaw::counter_stands ? 1 : taken.number;
    return info;
  }

  FakeSensor& sensor_;
  FakeWire& wire_;
  base::Clock& clock_;
  const Flaw flaw_;
  double asked_s_ = 0;
  std::optional<FakeSensor::Frame> last_;
  bool lost_ = false;
};

}  // namespace

std::unique_ptr<Camera> make_fake_camera(FakeSensor& sensor, FakeWire& wire, base::Clock& clock, Flaw flaw) {
  return std::make_unique<FakeCamera>(sensor, wire, clock, flaw);
}

}  // namespace rig::drivers::conformance
