// Covariance of the mean of measured frequency response matrices from the scatter of their realisations, line by line over a window of lines.
//
// Four stretches of lines go side by side. Along each the sum of v vᴴ over the window is brought forward by the line that enters and the one
// that leaves; then it is shrunk to its diagonal and carried back by right ⊗ left, block by block, both factors being lower triangles.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "complex_lanes.hpp"

namespace flexcal {

struct Scatter {
    std::ptrdiff_t lines;
    int outputs, members, inputs;  // m, R, n
    const double* white;           // (lines, m, R, n) complex: whitened realisations less their mean
    const double* right;           // (lines, n, n) complex, lower triangle
    const double* left;            // (lines, m, m) complex, lower triangle
    std::ptrdiff_t window;         // lines that share a covariance, 1 to lines
    double freedom;                // degrees of freedom of the window

    int size() const { return outputs * inputs; }
};

class ScatterCovariance {
  public:
    explicit ScatterCovariance(const Scatter& scatter)
        : of_(scatter),
          p_(scatter.size()),
          sum_(triangle(p_)),
          scatter_(scatter.members * p_),
          shrunk_(p_ * p_),
          carried_(p_ * p_),
          block_(scatter.outputs * scatter.outputs),
          right_(triangle(scatter.inputs)),
          left_(triangle(scatter.outputs)) {}

    // out: (lines, m n, m n) complex, of vec: element (i, j) of a matrix is j m + i
    void fill(double* out) {
        const std::ptrdiff_t stretch = (of_.lines + lane_count - 1) / lane_count;
        LaneNumbers line, begin;
        for (int lane = 0; lane < lane_count; ++lane) begin[lane] = first_of_window(std::min(lane * stretch, of_.lines - 1));
        for (std::ptrdiff_t k = 0; k < of_.window; ++k) add(shifted(begin, k), 1.0);
        for (std::ptrdiff_t step = 0; step < stretch; ++step) {
            LaneNumbers enters, leaves;
            for (int lane = 0; lane < lane_count; ++lane) {
                line[lane] = std::min(lane * stretch + step, of_.lines - 1);
                const bool moves = first_of_window(line[lane]) > begin[lane];
                leaves[lane] = moves ? begin[lane] : -1;
                enters[lane] = moves ? begin[lane] + of_.window : -1;
                begin[lane] += moves;
            }
            add(enters, 1.0);
            add(leaves, -1.0);
            shrink();
            gather_triangle(of_.right, of_.inputs, line, right_);
            gather_triangle(of_.left, of_.outputs, line, left_);
            from_left();
            from_right();
            for (int lane = 0; lane < lane_count && lane * stretch + step < of_.lines; ++lane) write(lane, out + 2 * p_ * p_ * line[lane]);
        }
    }

  private:
    static std::size_t triangle(int size) { return static_cast<std::size_t>(size) * (size + 1) / 2; }
    static std::size_t row(int i) { return triangle(i); }
    static LaneNumbers shifted(LaneNumbers a, std::ptrdiff_t by) {
        for (auto& line : a) line += by;
        return a;
    }

    // Near the ends the window keeps its size and leans inwards.
    std::ptrdiff_t first_of_window(std::ptrdiff_t line) const {
        return std::clamp<std::ptrdiff_t>(line - of_.window / 2, 0, of_.lines - of_.window);
    }

    // Adds `sign` Σ v vᴴ of the members' v of a line each, none for -1, to the sum, a lower triangle.
    void add(const LaneNumbers& line, double sign) {
        if (std::all_of(line.begin(), line.end(), [](std::ptrdiff_t l) { return l < 0; })) return;
        const int m = of_.outputs, members = of_.members, n = of_.inputs;
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < m; ++i)
                for (int r = 0; r < members; ++r)
                    scatter_[(j * m + i) * members + r] = gather(of_.white, m * members * n, line, (i * members + r) * n + j);
        for (int a = 0; a < p_; ++a)
            for (int b = 0; b <= a; ++b) {
                ComplexLanes total{};
                for (int r = 0; r < members; ++r) total.add_with_conjugate(scatter_[a * members + r], scatter_[b * members + r]);
                sum_[row(a) + b] += sign * total;
            }
    }

    // The mean of the window less what chance alone gives beside the diagonal (intensity of Schäfer and Strimmer 2005), as a whole matrix.
    void shrink() {
        const double mean = 1.0 / (static_cast<double>(of_.window) * of_.members);
        Lanes trace{}, squares{}, power{};
        for (int a = 0; a < p_; ++a) {
            const Lanes variance = mean * sum_[row(a) + a].re;
            trace += variance;
            squares += variance * variance;
            for (int b = 0; b < a; ++b) {
                const ComplexLanes entry = mean * sum_[row(a) + b];
                power += entry.re * entry.re + entry.im * entry.im;
            }
        }
        const Lanes chance = (trace * trace - squares) / of_.freedom;
        power += power;
        Lanes kept{};
        for (int lane = 0; lane < lane_count; ++lane)
            if (power[lane] > chance[lane]) kept[lane] = mean * (1.0 - chance[lane] / power[lane]);
        for (int a = 0; a < p_; ++a) {
            shrunk_[a * p_ + a] = {mean * sum_[row(a) + a].re + smallest_variance, Lanes{}};
            for (int b = 0; b < a; ++b) {
                const ComplexLanes entry = sum_[row(a) + b];
                shrunk_[a * p_ + b] = {kept * entry.re, kept * entry.im};
                shrunk_[b * p_ + a] = conjugate(shrunk_[a * p_ + b]);
            }
        }
    }

    // Every block (m, m) on and below the diagonal to left · block · leftᴴ, and those above to the conjugate transposes.
    void from_left() {
        const int m = of_.outputs, n = of_.inputs;
        for (int c = 0; c < n; ++c)
            for (int d = 0; d <= c; ++d) {
                const ComplexLanes* from = &shrunk_[c * m * p_ + d * m];
                for (int i = 0; i < m; ++i)
                    for (int j = 0; j < m; ++j) {
                        ComplexLanes total{};
                        for (int k = 0; k <= i; ++k) total.add(left_[row(i) + k], from[k * p_ + j]);
                        block_[i * m + j] = total;
                    }
                for (int i = 0; i < m; ++i)
                    for (int j = 0; j < m; ++j) {
                        ComplexLanes total{};
                        for (int k = 0; k <= j; ++k) total.add_with_conjugate(block_[i * m + k], left_[row(j) + k]);
                        carried_[(c * m + i) * p_ + d * m + j] = total;
                        if (d < c) carried_[(d * m + j) * p_ + c * m + i] = conjugate(total);
                    }
            }
    }

    // (right ⊗ 1) · carried · (right ⊗ 1)ᴴ, on and below the diagonal.
    void from_right() {
        const int m = of_.outputs, n = of_.inputs;
        for (int a = 0; a < n; ++a)
            for (int d = 0; d <= a; ++d)
                for (int e = 0; e < m * m; ++e) {
                    const int at = e / m * p_ + d * m + e % m;
                    ComplexLanes total{};
                    for (int c = 0; c <= a; ++c) total.add(right_[row(a) + c], carried_[c * m * p_ + at]);
                    shrunk_[a * m * p_ + at] = total;
                }
        for (int a = 0; a < n; ++a)
            for (int b = 0; b <= a; ++b)
                for (int e = 0; e < m * m; ++e) {
                    const int at = (a * m + e / m) * p_ + e % m;
                    ComplexLanes total{};
                    for (int d = 0; d <= b; ++d) total.add_with_conjugate(shrunk_[at + d * m], right_[row(b) + d]);
                    carried_[at + b * m] = total;
                }
    }

    void write(int lane, double* out) const {
        for (int a = 0; a < p_; ++a) {
            for (int b = 0; b < a; ++b) {
                const ComplexLanes& entry = carried_[a * p_ + b];
                out[2 * (a * p_ + b)] = out[2 * (b * p_ + a)] = entry.re[lane];
                out[2 * (a * p_ + b) + 1] = entry.im[lane];
                out[2 * (b * p_ + a) + 1] = -entry.im[lane];
            }
            out[2 * (a * p_ + a)] = carried_[a * p_ + a].re[lane];
            out[2 * (a * p_ + a) + 1] = 0.0;
        }
    }

    static constexpr double smallest_variance = 1e-12;  // keeps the covariance definite where a scatter is exactly nil

    const Scatter& of_;
    int p_;
    std::vector<ComplexLanes> sum_, scatter_, shrunk_, carried_, block_, right_, left_;
};

}  // namespace flexcal
