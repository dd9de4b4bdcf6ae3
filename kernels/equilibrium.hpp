// Where the elastic arm comes to rest under gravity with its motors held: Newton on Eq. (11), four poses at a time.
#pragma once
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "flexcal/cholesky.hpp"
#include "flexcal/gravity_load.hpp"
#include "lanes.hpp"

namespace flexcal {

struct EquilibriumOutput {
    double* deflection;  // (samples, n, 3): tilt_x, tilt_y, twist
    double* compliance;  // (samples, d, d) or null: inverse of springs + gravity stiffness
    double* by_offset;   // (samples, d, n) or null: ∂(∂V/∂q) by the offset of each joint
    double* regressor;   // (samples, d, 4 n) or null: ∂(∂V/∂q) by mass and first moment of each link
    double* coupling;    // (samples, d, 6 n) or null: ∂(∂V/∂q) by geometry
};

// Poses side by side, those beyond the last being copies of it.
class PosesAtRest {
  public:
    // axes: elastic axes from base to tool, within a joint too, as the tree has them. stiffness: one per axis.
    PosesAtRest(const Tree& tree, const std::vector<ElasticAxis>& axes, const double* stiffness, const double* geometry, const Masses& masses,
                Vector3 gravity)
        : n_(tree.size()), d_(static_cast<int>(axes.size())), axes_(axes), stiffness_(stiffness), payload_(masses.payload),
          load_(tree, axes, geometry, masses, gravity), q_(n_), deflection_(3 * n_), hessian_(d_ * d_), step_(d_), row_(geometry_size * n_) {}

    // Poses from `first` on, `present` of them. Returns the largest last step, in rad.
    double settle(const double* q, std::ptrdiff_t first, int present, const EquilibriumOutput& out) {
        present_ = present;
        Lanes payload;
        for (int lane = 0; lane < lane_count; ++lane) {
            const std::ptrdiff_t sample = first + std::min(lane, present - 1);
            payload[lane] = payload_[sample];
            for (int i = 0; i < n_; ++i) q_[i][lane] = q[sample * n_ + i];
        }
        std::fill(deflection_.begin(), deflection_.end(), Lanes{});
        const double worst = newton(payload, out.compliance);
        write(deflection_.data(), 3 * n_, out.deflection + first * 3 * n_, 3 * n_);
        for (int k = 0; k < d_; ++k) {
            if (out.compliance) {
                std::fill(step_.begin(), step_.end(), Lanes{});
                step_[k] = broadcast<Lanes>(1);
                cholesky_solve(hessian_, d_, step_.data());
                write(step_.data(), d_, out.compliance + (first * d_ + k) * d_, d_ * d_);
            }
            if (out.by_offset) {
                for (int i = 0; i < n_; ++i) row_[i] = load_.by_offset(k, i);
                write(row_.data(), n_, out.by_offset + (first * d_ + k) * n_, d_ * n_);
            }
            if (out.regressor) {
                std::fill(row_.begin(), row_.end(), Lanes{});
                load_.regressor(k, row_.data());
                write(row_.data(), 4 * n_, out.regressor + (first * d_ + k) * 4 * n_, d_ * 4 * n_);
            }
            if (out.coupling) {
                std::fill(row_.begin(), row_.end(), Lanes{});
                load_.coupling(k, row_.data());
                write(row_.data(), geometry_size * n_, out.coupling + (first * d_ + k) * geometry_size * n_, d_ * geometry_size * n_);
            }
        }
        return worst;
    }

  private:
    static constexpr int most_iterations = 30;
    static constexpr double tolerance = 1e-13;

    // Each pose stops by itself: its numbers do not depend on those beside it. Returns the largest last step.
    double newton(Lanes payload, bool derivatives) {
        double largest[lane_count] = {};
        bool resting[lane_count] = {};
        const auto all_rest = [&] { return std::all_of(resting, resting + lane_count, [](bool r) { return r; }); };
        for (int iteration = 0; iteration <= most_iterations; ++iteration) {
            load_.move(q_.data(), deflection_.data(), payload);
            for (int j = 0; j < d_; ++j) {
                step_[j] = load_.load(j) - stiffness_[j] * deflection_[at(j)];
                for (int k = 0; k <= j; ++k) hessian_[j * d_ + k] = load_.stiffness(k, j);
                hessian_[j * d_ + j] += stiffness_[j];
            }
            if (!cholesky(hessian_, d_)) throw std::domain_error("the springs cannot carry the arm: the equilibrium is not stable");
            if (all_rest()) break;
            cholesky_solve(hessian_, d_, step_.data());
            for (int lane = 0; lane < lane_count; ++lane) {
                if (resting[lane]) continue;
                largest[lane] = 0;
                for (int k = 0; k < d_; ++k) {
                    deflection_[at(k)][lane] += step_[k][lane];
                    largest[lane] = std::max(largest[lane], std::abs(step_[k][lane]));
                }
                resting[lane] = largest[lane] < tolerance;
            }
            if (all_rest() && !derivatives) break;  // derivatives need everything once more where the arm rests
        }
        return *std::max_element(largest, largest + lane_count);
    }

    int at(int k) const { return 3 * axes_[k].joint + axes_[k].component; }

    // values: (size,), to every pose's place, `stride` apart.
    void write(const Lanes* values, int size, double* out, std::ptrdiff_t stride) const {
        for (int lane = 0; lane < present_; ++lane)
            for (int k = 0; k < size; ++k) out[lane * stride + k] = values[k][lane];
    }

    const int n_, d_;
    const std::vector<ElasticAxis>& axes_;
    const double* stiffness_;
    const double* payload_;
    GravityLoadOf<Lanes> load_;
    std::vector<Lanes> q_, deflection_, hessian_, step_, row_;
    int present_ = 0;
};

// stiffness: one per axis. Joints without springs do not deflect. Returns the largest last step, in rad.
inline double static_equilibrium(const Tree& tree, const std::vector<ElasticAxis>& axes, const double* stiffness, const double* geometry,
                                 const Masses& masses, Vector3 gravity, const double* q, std::ptrdiff_t samples,
                                 const EquilibriumOutput& out) {
    if (axes.empty()) return 0;
    PosesAtRest poses(tree, axes, stiffness, geometry, masses, gravity);
    double worst = 0;
    for (std::ptrdiff_t first = 0; first < samples; first += lane_count)
        worst = std::max(worst, poses.settle(q, first, static_cast<int>(std::min<std::ptrdiff_t>(lane_count, samples - first)), out));
    return worst;
}

struct GravityOutput {
    double* load;       // (samples, d): -∂V/∂q
    double* stiffness;  // (samples, d, d): ∂²V/∂q∂q
    double* regressor;  // (samples, d, 4 n)
    double* coupling;   // (samples, d, 6 n)
};

// Gravity loads of poses that are not at rest, for arms whose joints do not move independently. deflection: (samples, n, 3)
inline void gravity_loads(const Tree& tree, const std::vector<ElasticAxis>& axes, const double* geometry, const Masses& masses, Vector3 gravity,
                          const double* q, const double* deflection, std::ptrdiff_t samples, const GravityOutput& out) {
    const int n = tree.size(), d = static_cast<int>(axes.size());
    GravityLoad load(tree, axes, geometry, masses, gravity);
    for (std::ptrdiff_t s = 0; s < samples; ++s) {
        load.move(q + s * n, deflection + 3 * n * s, masses.payload[s]);
        for (int j = 0; j < d; ++j) {
            const std::ptrdiff_t at = s * d + j;
            out.load[at] = load.load(j);
            for (int k = 0; k <= j; ++k) out.stiffness[at * d + k] = out.stiffness[(s * d + k) * d + j] = load.stiffness(k, j);
            load.regressor(j, out.regressor + at * 4 * n);
            load.coupling(j, out.coupling + at * geometry_size * n);
        }
    }
}

}  // namespace flexcal
