// Several samples side by side in one SIMD value (GCC and Clang vector extensions), and what they share with double.
#pragma once
#include <cmath>

namespace flexcal {

constexpr int lane_count = 4;
typedef double Lanes __attribute__((vector_size(lane_count * sizeof(double))));

inline Lanes cosine(Lanes a) { return Lanes{std::cos(a[0]), std::cos(a[1]), std::cos(a[2]), std::cos(a[3])}; }
inline Lanes sine(Lanes a) { return Lanes{std::sin(a[0]), std::sin(a[1]), std::sin(a[2]), std::sin(a[3])}; }
inline double cosine(double a) { return std::cos(a); }
inline double sine(double a) { return std::sin(a); }

template <class S>
inline S broadcast(double a) { return S{} + a; }

}  // namespace flexcal
