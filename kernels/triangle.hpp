// Rows brought into a triangle by Householder reflections: R of the QR of a tall matrix that comes in parts.
#pragma once
#include <cmath>
#include <cstddef>
#include <cstring>

#include "lanes.hpp"

namespace flexcal {

constexpr std::ptrdiff_t rows_together = 128;  // of 40 columns they fit a processor's first cache
constexpr double negligible = 1e-280;           // a column below the triangle whose square is smaller counts as zero: it would underflow

inline Lanes load(const double* p) {
    Lanes a;
    std::memcpy(&a, p, sizeof a);
    return a;
}
inline void store(double* p, const Lanes& a) { std::memcpy(p, &a, sizeof a); }
inline double sum(const Lanes& a) { return (a[0] + a[1]) + (a[2] + a[3]); }

// Products of v (m) with `count` columns b, `stride` apart; what a reflection takes from them: b_j -= v factor_j.
template <int count>
inline void products(const double* v, const double* b, std::ptrdiff_t stride, std::ptrdiff_t m, double* found) {
    Lanes total[count] = {};
    std::ptrdiff_t s = 0;
    for (; s + lane_count <= m; s += lane_count) {
        const Lanes a = load(v + s);
        for (int j = 0; j < count; ++j) total[j] += a * load(b + j * stride + s);
    }
    for (int j = 0; j < count; ++j) found[j] = sum(total[j]);
    for (; s < m; ++s)
        for (int j = 0; j < count; ++j) found[j] += v[s] * b[j * stride + s];
}
template <int count>
inline void take(const double* v, double* b, std::ptrdiff_t stride, std::ptrdiff_t m, const double* factor) {
    std::ptrdiff_t s = 0;
    for (; s + lane_count <= m; s += lane_count) {
        const Lanes a = load(v + s);
        for (int j = 0; j < count; ++j) store(b + j * stride + s, load(b + j * stride + s) - factor[j] * a);
    }
    for (; s < m; ++s)
        for (int j = 0; j < count; ++j) b[j * stride + s] -= factor[j] * v[s];
}

// One reflection of the row r of the triangle and m rows of b, with w = (head, v) and H = 1 - scale w wᵀ, for `count` columns.
template <int count>
inline void reflect(const double* v, double head, double scale, double* r, double* b, std::ptrdiff_t stride, std::ptrdiff_t m) {
    double along[count];
    products<count>(v, b, stride, m, along);
    for (int j = 0; j < count; ++j) {
        along[j] = scale * (along[j] + head * r[j]);
        r[j] -= along[j] * head;
    }
    take<count>(v, b, stride, m, along);
}

// triangle: (k, k) by rows, upper. rows: (k, m), every column's m values together; spent.
inline void update(double* triangle, double* rows, std::ptrdiff_t k, std::ptrdiff_t m) {
    for (std::ptrdiff_t start = 0; start < m; start += rows_together) {
        const std::ptrdiff_t count = m - start < rows_together ? m - start : rows_together;
        for (std::ptrdiff_t c = 0; c < k; ++c) {
            const double* v = rows + c * m + start;
            double* r = triangle + c * k;
            double square;
            products<1>(v, v, m, count, &square);
            if (square < negligible) continue;
            const double size = std::sqrt(r[c] * r[c] + square), corner = r[c] > 0 ? -size : size, head = r[c] - corner;
            const double scale = -1 / (corner * head);
            r[c] = corner;
            std::ptrdiff_t j = c + 1;
            for (; j + 4 <= k; j += 4) reflect<4>(v, head, scale, r + j, rows + j * m + start, m, count);
            for (; j < k; ++j) reflect<1>(v, head, scale, r + j, rows + j * m + start, m, count);
        }
    }
}

}  // namespace flexcal
