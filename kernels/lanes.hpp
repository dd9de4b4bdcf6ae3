// Several samples side by side in one SIMD value (GCC and Clang vector extensions).
#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>

#include "flexcal/spatial.hpp"

namespace flexcal {

constexpr int lane_count = 4;
typedef double Lanes __attribute__((vector_size(lane_count * sizeof(double))));

template <>
inline Lanes cosine(Lanes a) { return Lanes{std::cos(a[0]), std::cos(a[1]), std::cos(a[2]), std::cos(a[3])}; }
template <>
inline Lanes sine(Lanes a) { return Lanes{std::sin(a[0]), std::sin(a[1]), std::sin(a[2]), std::sin(a[3])}; }
template <>
inline Lanes square_root(Lanes a) { return Lanes{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])}; }
template <>
inline bool any_nonzero(Lanes a) { return a[0] != 0 || a[1] != 0 || a[2] != 0 || a[3] != 0; }
template <>
inline bool all_positive(Lanes a) { return a[0] > 0 && a[1] > 0 && a[2] > 0 && a[3] > 0; }

inline double sum(const Lanes& a) { return (a[0] + a[1]) + (a[2] + a[3]); }

// Cosine and sine of each lane, to 1.2e-16. An angle up to 1e5 is reduced by π/2 in three parts, of which the number of quarter turns times
// the first two is exact (Cody & Waite 1980), and has the polynomials of fdlibm on [-π/4, π/4]; larger ones are left to the library.
inline void cosine_and_sine(const Lanes& angle, Lanes& c, Lanes& s) {
    typedef std::int64_t Whole __attribute__((vector_size(sizeof(Lanes))));
    constexpr double rounding = 0x1.8p52;  // a sum with it has no fraction, and its last bits are those of the rounded number
    const Whole small = (angle < 1e5) & (angle > -1e5);
    if (!(small[0] & small[1] & small[2] & small[3])) {
        c = cosine<Lanes>(angle), s = sine<Lanes>(angle);
        return;
    }
    const Lanes shifted = angle * 6.36619772367581382433e-01 + rounding, quarters = shifted - rounding;
    const Lanes r = ((angle - quarters * 1.57079632673412561417e+00) - quarters * 6.07710050630396597660e-11) - quarters * 2.02226624879595063154e-21;
    const Lanes z = r * r, half = 0.5 * z, rest = 1.0 - half;
    const Lanes odd = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 +
                      z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    const Lanes even = rest + (((1.0 - rest) - half) + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 +
                       z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))))));
    Whole count;
    std::memcpy(&count, &shifted, sizeof count);
    const Whole swapped = (count & 1) != 0;
    c = swapped ? odd : even;
    s = swapped ? even : odd;
    c = ((count + 1) & 2) != 0 ? -c : c;
    s = (count & 2) != 0 ? -s : s;
}

}  // namespace flexcal
