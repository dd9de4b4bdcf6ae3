// Where the elastic arm comes to rest under gravity with its motors held: Newton on Eq. (11) for each pose.
//
// The potential is V = -g·Σ m c. With the rotation axes a_k ordered from base to tool and S_k the first moment of everything beyond
// axis k about its origin, ∂V/∂q_k = -g·(a_k × S_k) and, for k before j, ∂²V/∂q_k∂q_j = -g·(a_k × (a_j × S_j)).
#pragma once
#include <algorithm>
#include <stdexcept>

#include "tree.hpp"

namespace flexcal {

struct Masses {
    const double* mass;          // (n,)
    const double* first_moment;  // (n, 3), mass times centre of mass, in the link
    const double* payload;       // (samples,) kg, at payload_point of payload_joint's link
    int payload_joint;
    Vector3 payload_point;
};

struct EquilibriumOutput {
    double* deflection;  // (samples, n, 3): tilt_x, tilt_y, twist
    double* compliance;  // (samples, d, d) or null: inverse of springs + gravity stiffness
    double* regressor;   // (samples, d, 4 n) or null: ∂(∂V/∂q) by mass and first moment of each link
    double* coupling;    // (samples, d, 6 n) or null: ∂(∂V/∂q) by geometry
};

struct ElasticAxis {
    int joint;
    int component;  // 0 tilt_x, 1 tilt_y, 2 twist
};

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

// axes: elastic axes from base to tool, within a joint too, as the tree has them. stiffness: one per axis.
// deflection of joints without springs is left at what it is (zero). Returns the largest last step, in rad.
inline double static_equilibrium(const Tree& tree, const std::vector<ElasticAxis>& axes, const double* stiffness, const double* geometry,
                                 const Masses& masses, Vector3 gravity, const double* q, std::ptrdiff_t samples,
                                 const EquilibriumOutput& out) {
    const int n = tree.size(), d = static_cast<int>(axes.size());
    if (d == 0) return 0;
    constexpr int most_iterations = 30;
    constexpr double tolerance = 1e-13;
    const std::vector<Prepared> prepared = tree.prepare(geometry);
    std::vector<Frames> frames(n);
    std::vector<double> mass(n), hessian(d * d), step(d), unit(d);
    std::vector<Vector3> moment(n), axis(d), arm(d);
    std::vector<char> beyond(static_cast<std::size_t>(n) * n, 0);  // beyond[j * n + i]: link i is carried by joint j
    for (int i = 0; i < n; ++i)
        for (int j = i; j >= 0; j = tree.joints[j].parent) beyond[j * n + i] = 1;

    double worst = 0;
    for (std::ptrdiff_t s = 0; s < samples; ++s) {
        double* deflection = out.deflection + 3 * n * s;
        double largest = 0;
        for (int iteration = 0; iteration <= most_iterations; ++iteration) {
            for (int i = 0; i < n; ++i) {
                const int parent = tree.joints[i].parent;
                frames[i] = tree.advance(i, prepared[i], parent < 0 ? nullptr : &frames[parent], q[s * n + i], deflection + 3 * i);
                mass[i] = masses.mass[i];
                Vector3 own = vector3(masses.first_moment + 3 * i);
                if (i == masses.payload_joint) {
                    mass[i] += masses.payload[s];
                    own = own + masses.payload[s] * masses.payload_point;
                }
                moment[i] = mass[i] * frames[i].origin + frames[i].link * own;
            }
            for (int i = n - 1; i >= 0; --i) {
                const int parent = tree.joints[i].parent;
                if (parent >= 0) {
                    mass[parent] += mass[i];
                    moment[parent] = moment[parent] + moment[i];
                }
            }
            for (int k = 0; k < d; ++k) {
                const Frames& f = frames[axes[k].joint];
                axis[k] = axes[k].component == 0 ? f.tilt_x : axes[k].component == 1 ? f.tilt_y : f.axis;
                arm[k] = moment[axes[k].joint] - mass[axes[k].joint] * f.origin;
            }
            for (int j = 0; j < d; ++j) {
                const Vector3 turned = cross(axis[j], arm[j]);
                step[j] = dot(gravity, turned) - stiffness[j] * deflection[3 * axes[j].joint + axes[j].component];
                for (int k = 0; k <= j; ++k) {
                    const bool carried = beyond[axes[k].joint * n + axes[j].joint];
                    hessian[j * d + k] = carried ? -dot(gravity, cross(axis[k], turned)) : 0.0;
                }
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
        if (out.regressor) {
            for (int k = 0; k < d; ++k) {
                double* row = out.regressor + (s * d + k) * 4 * n;
                const Vector3 lever = cross(gravity, axis[k]);  // g·(a × r) = (g × a)·r
                for (int i = 0; i < n; ++i) {
                    if (!beyond[axes[k].joint * n + i]) continue;
                    const Rotation& r = frames[i].link;
                    row[4 * i] = -dot(lever, frames[i].origin - frames[axes[k].joint].origin);
                    row[4 * i + 1] = -dot(lever, r.x);
                    row[4 * i + 2] = -dot(lever, r.y);
                    row[4 * i + 3] = -dot(lever, r.z);
                }
            }
        }
        if (out.coupling) {
            for (int k = 0; k < d; ++k) {
                double* row = out.coupling + (s * d + k) * geometry_size * n;
                const int joint = axes[k].joint;
                const Vector3 own = cross(axis[k], arm[k]);
                for (int i = 0; i < n; ++i) {
                    const bool outside = beyond[joint * n + i] && i != joint;
                    const bool inside = beyond[i * n + joint];
                    if (!outside && !inside) continue;
                    const Frames& f = frames[i];
                    const Vector3 turns[3] = {f.axis, f.misalignment_1, f.misalignment_2};
                    const bool slides = tree.joints[i].prismatic;
                    // a misalignment turns about the joint's place before the prismatic motion
                    const double slid = slides ? q[s * n + i] + prepared[i].offset + deflection[3 * i + 2] : 0.0;
                    const Vector3 moved = moment[i] - mass[i] * (f.origin - slid * f.axis);
                    // fixed to the parent, the bearing tilts the offset with everything beyond
                    const bool tilted = i == joint && tree.tilts_first && axes[k].component != 2;
                    for (int g = 0; g < 3; ++g) {
                        const bool before = inside && !(g == 0 && tilted);
                        row[geometry_size * i + g] = before ? -dot(gravity, cross(turns[g], own))
                                                            : -dot(gravity, cross(axis[k], cross(turns[g], moved)));
                    }
                    if (slides) row[geometry_size * i] = inside ? 0.0 : -mass[i] * dot(gravity, cross(axis[k], f.axis));
                    if (!beyond[joint * n + i]) continue;
                    const double carried = mass[i] - masses.mass[i] - (i == masses.payload_joint ? masses.payload[s] : 0.0);
                    const Vector3 lengths[3] = {f.link.x, f.link.y, f.link.z};
                    for (int g = 0; g < 3; ++g)
                        row[geometry_size * i + 3 + g] = -carried * dot(gravity, cross(axis[k], lengths[g]));
                }
            }
        }
    }
    return worst;
}

}  // namespace flexcal
