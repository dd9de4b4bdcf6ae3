// Several samples side by side in one SIMD value (GCC and Clang vector extensions).
#pragma once
#include <cmath>

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

}  // namespace flexcal
