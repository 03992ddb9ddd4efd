// The noise model of a linear image sensor (EMVA 1288), and the colour filter before it.
#pragma once

#include <string>

#include "core/base/result.h"

namespace rig::geometry {

struct SensorModel {
  int bits = 12;
  double black_dn = 0;       ///< mean value without light, digital numbers
  double saturation_dn = 0;  ///< from this value on a sample says only "at least this much"
  double electrons_per_dn = 1;
  double read_noise_e = 0;  ///< standard deviation, electrons

  /// Variance, in squared digital numbers, of a sample whose value above black is `signal_dn`: photon noise,
  /// read noise and quantisation.
  [[nodiscard]] double variance_dn2(double signal_dn) const {
    const double photon_dn2 = (signal_dn > 0 ? signal_dn : 0) / electrons_per_dn;
    const double read_dn = read_noise_e / electrons_per_dn;
    return photon_dn2 + read_dn * read_dn + 1.0 / 12.0;
  }
};

/// What stands at (0,0) (1,0) / (0,1) (1,1) of the sensor, in reading order.
enum class BayerPattern { none, rggb, bggr, grbg, gbrg };

enum class Colour { red = 0, green = 1, blue = 2 };

/// The filter over pixel (x, y). A sensor without a pattern answers green everywhere.
[[nodiscard]] Colour colour_at(BayerPattern pattern, int x, int y);

[[nodiscard]] base::Result<BayerPattern> bayer_from_text(const std::string& text);
[[nodiscard]] std::string text_from_bayer(BayerPattern pattern);

}  // namespace rig::geometry
