// Cholesky factors of small symmetric matrices, in place.
#pragma once
#include <cmath>
#include <vector>

namespace flexcal {

// a: (d, d), of which the lower triangle is read and becomes the factor. False where it is not positive definite.
inline bool cholesky(std::vector<double>& a, int d) {
    for (int j = 0; j < d; ++j) {
        double s = a[j * d + j];
        for (int k = 0; k < j; ++k) s -= a[j * d + k] * a[j * d + k];
        if (!(s > 0)) return false;
        const double root = std::sqrt(s);
        a[j * d + j] = root;
        for (int i = j + 1; i < d; ++i) {
            double t = a[i * d + j];
            for (int k = 0; k < j; ++k) t -= a[i * d + k] * a[j * d + k];
            a[i * d + j] = t / root;
        }
    }
    return true;
}

inline void cholesky_solve(const std::vector<double>& l, int d, double* x) {
    for (int i = 0; i < d; ++i) {
        for (int k = 0; k < i; ++k) x[i] -= l[i * d + k] * x[k];
        x[i] /= l[i * d + i];
    }
    for (int i = d - 1; i >= 0; --i) {
        for (int k = i + 1; k < d; ++k) x[i] -= l[k * d + i] * x[k];
        x[i] /= l[i * d + i];
    }
}

}  // namespace flexcal
