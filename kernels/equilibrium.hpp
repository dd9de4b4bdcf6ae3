// Where the elastic arm comes to rest under gravity with its motors held: Newton on Eq. (11) for each pose.
#pragma once
#include <algorithm>
#include <stdexcept>

#include "flexcal/cholesky.hpp"
#include "flexcal/gravity_load.hpp"

namespace flexcal {

struct EquilibriumOutput {
    double* deflection;  // (samples, n, 3): tilt_x, tilt_y, twist
    double* compliance;  // (samples, d, d) or null: inverse of springs + gravity stiffness
    double* regressor;   // (samples, d, 4 n) or null: ∂(∂V/∂q) by mass and first moment of each link
    double* coupling;    // (samples, d, 6 n) or null: ∂(∂V/∂q) by geometry
};

// axes: elastic axes from base to tool, within a joint too, as the tree has them. stiffness: one per axis.
// deflection of joints without springs is left at what it is (zero). Returns the largest last step, in rad.
inline double static_equilibrium(const Tree& tree, const std::vector<ElasticAxis>& axes, const double* stiffness, const double* geometry,
                                 const Masses& masses, Vector3 gravity, const double* q, std::ptrdiff_t samples,
                                 const EquilibriumOutput& out) {
    const int n = tree.size(), d = static_cast<int>(axes.size());
    if (d == 0) return 0;
    constexpr int most_iterations = 30;
    constexpr double tolerance = 1e-13;
    GravityLoad load(tree, axes, geometry, masses, gravity);
    std::vector<double> hessian(d * d), step(d), unit(d);

    double worst = 0;
    for (std::ptrdiff_t s = 0; s < samples; ++s) {
        double* deflection = out.deflection + 3 * n * s;
        double largest = 0;
        for (int iteration = 0; iteration <= most_iterations; ++iteration) {
            load.move(q + s * n, deflection, masses.payload[s]);
            for (int j = 0; j < d; ++j) {
                step[j] = load.load(j) - stiffness[j] * deflection[3 * axes[j].joint + axes[j].component];
                for (int k = 0; k <= j; ++k) hessian[j * d + k] = load.stiffness(k, j);
                hessian[j * d + j] += stiffness[j];
            }
            if (!cholesky(hessian, d)) throw std::domain_error("the springs cannot carry the arm: the equilibrium is not stable");
            if (iteration > 0 && largest < tolerance) break;
            cholesky_solve(hessian, d, step.data());
            largest = 0;
            for (int k = 0; k < d; ++k) {
                deflection[3 * axes[k].joint + axes[k].component] += step[k];
                largest = std::max(largest, std::abs(step[k]));
            }
            if (largest < tolerance && !out.compliance) break;  // derivatives need everything once more where the arm rests
        }
        worst = std::max(worst, largest);
        if (out.compliance) {
            for (int k = 0; k < d; ++k) {
                std::fill(unit.begin(), unit.end(), 0.0);
                unit[k] = 1;
                cholesky_solve(hessian, d, unit.data());
                std::copy(unit.begin(), unit.end(), out.compliance + (s * d + k) * d);
            }
        }
        for (int k = 0; k < d; ++k) {
            if (out.regressor) load.regressor(k, out.regressor + (s * d + k) * 4 * n);
            if (out.coupling) load.coupling(k, out.coupling + (s * d + k) * geometry_size * n);
        }
    }
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
