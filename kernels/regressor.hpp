// The torque regressor: joint torques are linear in every link's mass m, first moment m c and inertia I at the link frame (Eq. 2.20).
//
// In the frame of link i, with ω, α its angular velocity and acceleration and a the acceleration of its origin less gravity, the link
// needs force f = m a + A m c, A = [α]× + [ω]×[ω]×, and moment I α + ω × I ω + m c × a. Joint j, whose unit rate moves that frame with
// velocity v and angular velocity u, feels v·f + u·moment: m gets v·a, m c gets Aᵀ v + a × u, and I gets u·I α + (u × ω)·I ω.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>

#include "tree_motion.hpp"

namespace flexcal {

constexpr int inertial_size = 10;  // m, m c_x, m c_y, m c_z, Ixx, Ixy, Ixz, Iyy, Iyz, Izz

// What torques per unit parameter a joint feels from a link.
template <class S>
inline std::array<S, inertial_size> inertial_torques(const Motion<S>& joint, const Link<S>& link) {
    const auto& [v, u] = joint;
    const auto& [w, dw, a] = link;
    const Vector<S> moment = cross(v, dw) + cross(w, cross(w, v)) + cross(a, u), t = cross(u, w);
    return {dot(v, a),
            moment.x,
            moment.y,
            moment.z,
            u.x * dw.x + t.x * w.x,
            u.x * dw.y + u.y * dw.x + t.x * w.y + t.y * w.x,
            u.x * dw.z + u.z * dw.x + t.x * w.z + t.z * w.x,
            u.y * dw.y + t.y * w.y,
            u.y * dw.z + u.z * dw.y + t.y * w.z + t.z * w.y,
            u.z * dw.z + t.z * w.z};
}

// Calls store(joint, column, torque) for every entry of the regressor that is not zero by structure. q, dq, ddq: one S a joint.
template <class S, class Store>
void regressor(TreeMotion<S>& tree, const S* q, const S* dq, const S* ddq, Store&& store) {
    for (int i = 0; i < tree.size(); ++i) {
        const Link<S>& link = tree.advance(i, q[i], dq[i], ddq[i]);
        for (int j : tree.path(i)) {
            const std::array<S, inertial_size> torques = inertial_torques(tree.reach(i, j), link);
            for (int k = 0; k < inertial_size; ++k) store(j, inertial_size * i + k, torques[k]);
        }
    }
}

// q, dq, ddq: (samples, n). places: (n, 10 n), for every entry of the regressor the row of out that takes it over the samples, or -1.
// out: (·, samples); entries that are zero by structure are not written.
inline void torque_regressor(const Tree& tree, const double* geometry, Vector3 gravity, const double* q, const double* dq, const double* ddq,
                             const std::int64_t* places, std::ptrdiff_t samples, double* out) {
    const int n = tree.size();
    TreeMotion<Lanes> motion(tree, geometry, gravity);
    JointStates states(n);
    for (std::ptrdiff_t s = 0; s < samples; s += lane_count) {
        const int present = states.read(q, dq, ddq, s, samples);
        regressor(motion, states.q(), states.dq(), states.ddq(), [&](int joint, int column, const Lanes& torque) {
            const std::ptrdiff_t place = places[joint * inertial_size * n + column];
            if (place < 0) return;
            double* p = out + place * samples + s;
            if (present == lane_count)
                std::memcpy(p, &torque, sizeof torque);
            else
                for (int lane = 0; lane < present; ++lane) p[lane] = torque[lane];
        });
    }
}

}  // namespace flexcal
