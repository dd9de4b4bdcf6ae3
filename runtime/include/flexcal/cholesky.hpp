// Cholesky factors of small symmetric matrices, in place.
#pragma once
#include <vector>

#include "spatial.hpp"

namespace flexcal {

// a: (d, d), of which the lower triangle is read and becomes the factor. False where it is not positive definite.
template <class S>
inline bool cholesky(std::vector<S>& a, int d) {
    for (int j = 0; j < d; ++j) {
        S s = a[j * d + j];
        for (int k = 0; k < j; ++k) s -= a[j * d + k] * a[j * d + k];
        if (!all_positive<S>(s)) return false;
        const S root = square_root<S>(s);
        a[j * d + j] = root;
        for (int i = j + 1; i < d; ++i) {
            S t = a[i * d + j];
            for (int k = 0; k < j; ++k) t -= a[i * d + k] * a[j * d + k];
            a[i * d + j] = t / root;
        }
    }
    return true;
}

template <class S>
inline void cholesky_solve(const std::vector<S>& l, int d, S* x) {
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
