// Rows brought into a triangle by Householder reflections: R of the QR of a tall matrix that comes in parts.
//
// A reflection H = 1 - scale w wᵀ brings a column below the triangle into one of its rows: w is head in this row and v, the column, below.
// Four columns are reflected one after the other, and the four reflections then applied to all columns behind them together, two at a
// time, as in the WY form (Bischof & Van Loan 1987): each value is read once for four reflections. As their heads stand in different rows
// of the triangle, products of two w are those of their v.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <vector>

#include "lanes.hpp"

namespace flexcal {

constexpr double negligible = 1e-280;  // a column below the triangle whose square is smaller counts as zero: it would underflow

// Up to so many rows are reflected together: 40 columns of them fit a processor's second cache.
constexpr std::ptrdiff_t lanes_together = 64, rows_together = lanes_together * lane_count;

// Reflections of `count` columns v; along[i][j] is the product of v_i and v_j, j < i.
template <int count>
struct Reflections {
    double head[count], scale[count], along[count][count];
};

// Products of `left` columns v with `right` columns b, of m lanes each.
template <int left, int right>
inline void products(const Lanes* v, const Lanes* b, std::ptrdiff_t m, double (&found)[left][right]) {
    Lanes total[left][right] = {};
    for (std::ptrdiff_t s = 0; s < m; ++s)
        for (int j = 0; j < right; ++j)
            for (int i = 0; i < left; ++i) total[i][j] += v[i * lanes_together + s] * b[j * lanes_together + s];
    for (int i = 0; i < left; ++i)
        for (int j = 0; j < right; ++j) found[i][j] = sum(total[i][j]);
}

// Reflects column c and those of its panel behind it, then the columns that follow.
template <int count, int c = 0>
inline void factor(Lanes* v, double* r, std::ptrdiff_t width, std::ptrdiff_t m, Reflections<count>& panel) {
    double* row = r + c * width;
    double factors[count] = {};
    panel.head[c] = panel.scale[c] = 0;
    const double* along = panel.along[c];
    if (along[c] >= negligible) {
        const double size = std::sqrt(row[c] * row[c] + along[c]), corner = row[c] > 0 ? -size : size, head = row[c] - corner;
        panel.head[c] = head;
        panel.scale[c] = -1 / (corner * head);
        row[c] = corner;
        for (int j = c + 1; j < count; ++j) {
            factors[j] = panel.scale[c] * (along[j] + head * row[j]);
            row[j] -= factors[j] * head;
        }
    }
    if constexpr (c + 1 < count) {
        Lanes total[count] = {};
        for (std::ptrdiff_t s = 0; s < m; ++s) {
            Lanes x[count];
            for (int j = 0; j < count; ++j) x[j] = v[j * lanes_together + s];
            for (int j = c + 1; j < count; ++j) v[j * lanes_together + s] = x[j] -= factors[j] * x[c];
            for (int j = 0; j < count; ++j) total[j] += x[c + 1] * x[j];
        }
        for (int j = 0; j < count; ++j) panel.along[c + 1][j] = sum(total[j]);
        factor<count, c + 1>(v, r, width, m, panel);
    }
}

// Applies reflections to two columns b and what stands above them in the triangle.
template <int count>
inline void reflect(const Reflections<count>& panel, const Lanes* v, double* r, std::ptrdiff_t width, Lanes* b, std::ptrdiff_t m) {
    double factors[count][2];
    products(v, b, m, factors);
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < 2; ++j) {
            double along = factors[i][j] + panel.head[i] * r[i * width + j];
            for (int k = 0; k < i; ++k) along -= panel.along[i][k] * factors[k][j];
            factors[i][j] = panel.scale[i] * along;
            r[i * width + j] -= factors[i][j] * panel.head[i];
        }
    for (std::ptrdiff_t s = 0; s < m; ++s)
        for (int j = 0; j < 2; ++j) {
            Lanes x = b[j * lanes_together + s];
            for (int i = 0; i < count; ++i) x -= factors[i][j] * v[i * lanes_together + s];
            b[j * lanes_together + s] = x;
        }
}

// Rows of several columns, `width` of them with one of zeros where their number is odd, brought into a triangle (width, width) by rows.
class TriangleUpdate {
  public:
    explicit TriangleUpdate(std::ptrdiff_t columns)
        : columns_(columns), width_(columns + columns % 2), triangle_(width_ * width_), rows_(width_ * lanes_together) {}

    // triangle: (k, k) by rows, upper.
    void load(const double* triangle) {
        for (std::ptrdiff_t c = 0; c < columns_; ++c) std::copy_n(triangle + c * columns_, columns_, &triangle_[c * width_]);
    }
    void store(double* triangle) const {
        for (std::ptrdiff_t c = 0; c < columns_; ++c) std::copy_n(&triangle_[c * width_], columns_, triangle + c * columns_);
    }

    // rows: (k, ·), every column's values together and columns `stride` apart; count of them, up to rows_together.
    void add(const double* rows, std::ptrdiff_t stride, std::ptrdiff_t count) {
        const std::ptrdiff_t m = (count + lane_count - 1) / lane_count;
        for (std::ptrdiff_t c = 0; c < columns_; ++c) {
            double* column = reinterpret_cast<double*>(&rows_[c * lanes_together]);
            std::copy_n(rows + c * stride, count, column);
            std::fill(column + count, column + m * lane_count, 0.0);
        }
        std::ptrdiff_t c = 0;
        for (; c + 4 <= width_; c += 4) step<4>(c, m);
        if (c < width_) step<2>(c, m);
    }

  private:
    template <int count>
    void step(std::ptrdiff_t c, std::ptrdiff_t m) {
        Lanes* v = &rows_[c * lanes_together];
        double* r = &triangle_[c * width_];
        double along[1][count];
        products(v, v, m, along);
        Reflections<count> panel;
        std::copy_n(along[0], count, panel.along[0]);
        factor(v, r + c, width_, m, panel);
        for (std::ptrdiff_t j = c + count; j < width_; j += 2) reflect(panel, v, r + j, width_, &rows_[j * lanes_together], m);
    }

    std::ptrdiff_t columns_, width_;
    std::vector<double> triangle_;
    std::vector<Lanes> rows_;
};

// triangle: (k, k) by rows, upper. rows: (k, m), every column's m values together and columns `stride` apart.
inline void update(double* triangle, const double* rows, std::ptrdiff_t k, std::ptrdiff_t m, std::ptrdiff_t stride) {
    TriangleUpdate whole(k);
    whole.load(triangle);
    for (std::ptrdiff_t start = 0; start < m; start += rows_together) whole.add(rows + start, stride, std::min(rows_together, m - start));
    whole.store(triangle);
}

}  // namespace flexcal
