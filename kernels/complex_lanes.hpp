// Complex numbers of several samples side by side.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "lanes.hpp"

namespace flexcal {

struct ComplexLanes {
    Lanes re, im;

    ComplexLanes& operator+=(const ComplexLanes& a) {
        re += a.re, im += a.im;
        return *this;
    }
    void add(const ComplexLanes& a, const ComplexLanes& b) {
        re += a.re * b.re - a.im * b.im;
        im += a.re * b.im + a.im * b.re;
    }
    // a · conj(b)
    void add_with_conjugate(const ComplexLanes& a, const ComplexLanes& b) {
        re += a.re * b.re + a.im * b.im;
        im += a.im * b.re - a.re * b.im;
    }
};
inline ComplexLanes operator*(double factor, const ComplexLanes& a) { return {factor * a.re, factor * a.im}; }
inline ComplexLanes conjugate(const ComplexLanes& a) { return {a.re, -a.im}; }

using LaneNumbers = std::array<std::ptrdiff_t, lane_count>;

// Element `at` of one of the parts of `from`, `size` complex numbers each, in every lane; zero where its number is negative.
inline ComplexLanes gather(const double* from, std::ptrdiff_t size, const LaneNumbers& part, std::ptrdiff_t at) {
    ComplexLanes a{};
    for (int lane = 0; lane < lane_count; ++lane)
        if (part[lane] >= 0) {
            const double* p = from + 2 * (part[lane] * size + at);
            a.re[lane] = p[0], a.im[lane] = p[1];
        }
    return a;
}

// Lower triangles, row by row, of matrices (size, size).
inline void gather_triangle(const double* from, int size, const LaneNumbers& part, std::vector<ComplexLanes>& out) {
    auto next = out.begin();
    for (int i = 0; i < size; ++i)
        for (int j = 0; j <= i; ++j) *next++ = gather(from, size * size, part, i * size + j);
}

}  // namespace flexcal
