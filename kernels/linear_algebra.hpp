// What the likelihood of variance components needs of linear algebra, and NumPy lacks.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace flexcal {

// inverse: that of a lower triangle, (n, n) both; row i is (e_i - Σ_{k<i} l_ik · row k) / l_ii.
inline void invert_triangle(const double* lower, double* inverse, std::ptrdiff_t n) {
    std::fill_n(inverse, n * n, 0.0);
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        double* row = inverse + i * n;
        for (std::ptrdiff_t k = 0; k < i; ++k) {
            const double factor = lower[i * n + k];
            const double* above = inverse + k * n;
            for (std::ptrdiff_t j = 0; j <= k; ++j) row[j] -= factor * above[j];
        }
        const double scale = 1.0 / lower[i * n + i];
        for (std::ptrdiff_t j = 0; j < i; ++j) row[j] *= scale;
        row[i] = scale;
    }
}

// Adds to row `to[e]` of sums (·, width) the row `from[e]` of values (·, width), for every e of `count`.
inline void add_rows(const std::int64_t* to, const std::int64_t* from, std::ptrdiff_t count, const double* values, std::ptrdiff_t width, double* sums) {
    for (std::ptrdiff_t e = 0; e < count; ++e) {
        double* sum = sums + to[e] * width;
        const double* value = values + from[e] * width;
        for (std::ptrdiff_t j = 0; j < width; ++j) sum[j] += value[j];
    }
}

}  // namespace flexcal
