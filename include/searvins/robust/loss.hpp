// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Robust losses: how far a whitened residual is believed.
///
/// A loss is one function rho(z) of a whitened residual norm z >= 0 (dimensionless). The rest follows from it:
///
///     cost      rho(z), with quadratic branch z^2/2: rho(z) = z^2/2 + O(z^4) near 0, or exactly z^2/2 up to a threshold
///     weight    w(z) = rho'(z) / z = 2 d rho / d(z^2)        information is scaled by w, residual rows by sqrt(w)
///
/// so the gradient of sum rho is J' W r, and step control compares the very cost that the step reduces.
///
/// Every loss here has w(0) = 1 and w falling in z, that is, rho is concave as a function of s = z^2. A concave function lies below its
/// tangent, rho(s) <= rho(s0) + w(s0) (s - s0) / 2, with equality at s0. The right-hand side is the reweighted quadratic of IRLS
/// (iteratively reweighted least squares): a majoriser. Whatever step lowers it lowers the robust cost by at least as much.
///
///     loss            rho(z)                                    w(z)               as z -> infinity       default constant
///     Gaussian        z^2/2                                     1                  rho grows as z^2       -
///     Huber           z^2/2 up to k, then k z - k^2/2           min(1, k/z)        rho grows as z         k = 1.345  on z
///     Cauchy          c^2/2 ln(1 + z^2/c^2)                     1/(1 + z^2/c^2)    rho grows as ln z      c = 2.3849 on z
///     Dcs             z^2/2 up to z^2 = c, 3c/2 - 2c^2/(c+z^2)  (2c/(c+z^2))^2     rho -> 3c/2            c = 1.5    on z^2
///     GemanMcClure    z^2/2 * c^2/(c^2+z^2)                     (c^2/(c^2+z^2))^2  rho -> c^2/2           c = 3.7874 on z
///     Tukey           c^2/6 (1 - (1 - z^2/c^2)^3) up to c       (1 - z^2/c^2)^2    rho = c^2/6, w = 0     c = 4.6851 on z
///
/// The constants of Huber, Cauchy, Geman-McClure and Tukey keep 95 % of the efficiency of least squares under Gaussian noise
/// [Huber, Robust Statistics, 1981; Zhang, Image and Vision Computing 15, 1997]. That of DCS is the paper's and keeps 76 %
/// (c = 3.6 would keep 95 %): it acts from z = 1.22 on. Gaussian and Huber are convex. The others redescend (z w(z) falls again), so
/// their sum may have several minima and the point where iteration starts matters.
///
/// Arguments are finite and z^2 >= 0; a NaN gives NaN. Constants are > 0; they are public because the policy that owns a loss owns
/// its setting.
#pragma once

#include <cmath>
#include <concepts>

namespace searvins::robust {

/// A type with rho, its IRLS weight, and a name for tables and options. Both functions take z^2, because no caller has z without a
/// square root.
template <class L>
concept Loss = std::floating_point<typename L::Scalar> && requires(const L& loss, typename L::Scalar z2) {
  { loss.rho(z2) } -> std::same_as<typename L::Scalar>;
  { loss.weight(z2) } -> std::same_as<typename L::Scalar>;
  { L::name } -> std::convertible_to<const char*>;
};

/// No robustification: rho = z^2/2.
template <std::floating_point S>
struct Gaussian {
  using Scalar = S;
  static constexpr const char* name = "gaussian";

  [[nodiscard]] constexpr S rho(S z2) const { return z2 / 2; }
  [[nodiscard]] constexpr S weight(S /*z2*/) const { return 1; }
};

/// Quadratic, then linear [Huber 1964; the paper's loss of Doppler and stereo].
///
///     rho(z) = z^2/2            z <= k
///            = k z - k^2/2      beyond        so rho' = k there, and w = k/z
template <std::floating_point S>
struct Huber {
  using Scalar = S;
  static constexpr const char* name = "huber";
  S k{S(1.345)};  ///< threshold on z, > 0

  [[nodiscard]] S rho(S z2) const { return z2 <= k * k ? z2 / 2 : k * (std::sqrt(z2) - k / 2); }
  [[nodiscard]] S weight(S z2) const { return z2 <= k * k ? S(1) : k / std::sqrt(z2); }
};

/// Dynamic covariance scaling [Agarwal et al., ICRA 2013; paper eq. (dcs-weight)].
///
///     s(z) = min(1, 2c / (c + z^2)),   w = s^2   (an information weight, hence the square)
///
/// Integrating z w(z) from 0 gives the loss that has this weight; it meets z^2/2 smoothly at z^2 = c and saturates at 3c/2:
///
///     rho(z) = z^2/2                        z^2 <= c
///            = 3c/2 - 2 c^2 / (c + z^2)     beyond
template <std::floating_point S>
struct Dcs {
  using Scalar = S;
  static constexpr const char* name = "dcs";
  S c{S(1.5)};  ///< threshold on z^2, > 0; the paper uses 1.5

  [[nodiscard]] constexpr S rho(S z2) const { return z2 <= c ? z2 / 2 : 3 * c / 2 - 2 * c * c / (c + z2); }
  [[nodiscard]] constexpr S weight(S z2) const {
    if (z2 <= c) return 1;
    const S s = 2 * c / (c + z2);
    return s * s;
  }
};

/// Negative logarithm of a Cauchy density, up to a constant: rho = c^2/2 ln(1 + z^2/c^2), hence w = 1/(1 + z^2/c^2).
template <std::floating_point S>
struct Cauchy {
  using Scalar = S;
  static constexpr const char* name = "cauchy";
  S c{S(2.3849)};  ///< scale on z, > 0: the weight is one half at z = c

  [[nodiscard]] S rho(S z2) const { return c * c / 2 * std::log1p(z2 / (c * c)); }
  [[nodiscard]] constexpr S weight(S z2) const { return 1 / (1 + z2 / (c * c)); }
};

/// Saturating without a seam: rho = z^2/2 * c^2/(c^2 + z^2), hence w = (c^2/(c^2 + z^2))^2; rho tends to c^2/2
/// [Geman and McClure 1987].
template <std::floating_point S>
struct GemanMcClure {
  using Scalar = S;
  static constexpr const char* name = "geman-mcclure";
  S c{S(3.7874)};  ///< scale on z, > 0: the weight is one quarter at z = c

  [[nodiscard]] constexpr S rho(S z2) const { return z2 / 2 * shrink(z2); }
  [[nodiscard]] constexpr S weight(S z2) const { return shrink(z2) * shrink(z2); }

 private:
  [[nodiscard]] constexpr S shrink(S z2) const { return c * c / (c * c + z2); }
};

/// Hard rejection beyond c [Beaton and Tukey 1974]: with g = 1 - z^2/c^2,
///
///     rho(z) = c^2/6 (1 - g^3),  w = g^2      z <= c
///            = c^2/6,            w = 0        beyond
///
/// A weight of exactly zero removes the row: a variable that only rejected rows inform becomes under-determined. For small z the
/// cost is evaluated as z^2/6 (1 + g + g^2), the same polynomial without the difference of near-equal numbers.
template <std::floating_point S>
struct Tukey {
  using Scalar = S;
  static constexpr const char* name = "tukey";
  S c{S(4.6851)};  ///< rejection threshold on z, > 0

  [[nodiscard]] constexpr S rho(S z2) const {
    if (z2 > c * c) return c * c / 6;
    const S g = 1 - z2 / (c * c);
    return z2 / 6 * (1 + g + g * g);
  }
  [[nodiscard]] constexpr S weight(S z2) const {
    if (z2 > c * c) return 0;
    const S g = 1 - z2 / (c * c);
    return g * g;
  }
};

static_assert(Loss<Gaussian<float>> && Loss<Huber<float>> && Loss<Dcs<double>> && Loss<Cauchy<double>> && Loss<GemanMcClure<float>> &&
              Loss<Tukey<double>>);

}  // namespace searvins::robust
