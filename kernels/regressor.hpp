// The torque regressor: joint torques are linear in every link's mass m, first moment m c and inertia I at the link frame (Eq. 2.20).
//
// In the frame of link i, with ω, α its angular velocity and acceleration and a the acceleration of its origin less gravity, the link
// needs force f = m a + A m c, A = [α]× + [ω]×[ω]×, and moment I α + ω × I ω + m c × a. Joint j, whose unit rate moves that frame with
// velocity v and angular velocity u, feels v·f + u·moment: m gets v·a, m c gets Aᵀ v + a × u, and the six of I are products of u with
// α and those of ω, which are entries of A and their differences.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "tree_motion.hpp"

namespace flexcal {

constexpr int inertial_size = 10;  // m, m c_x, m c_y, m c_z, Ixx, Ixy, Ixz, Iyy, Iyz, Izz

// What the motion of a link makes of its inertials; x, y and z are the columns of A.
template <class S>
class LinkTorques {
  public:
    explicit LinkTorques(const Link<S>& link) : a(link.a), dw(link.dw) {
        const Vector<S>& w = link.w;
        const S xx = w.x * w.x, yy = w.y * w.y, zz = w.z * w.z;
        xy = w.x * w.y, xz = w.x * w.z, yz = w.y * w.z;
        x = {-(yy + zz), xy + dw.z, xz - dw.y};
        y = {xy - dw.z, -(xx + zz), yz + dw.x};
        z = {xz + dw.y, yz - dw.x, -(xx + yy)};
    }

    // Calls store(k, torque) with a function for each torque per unit parameter that a joint feels from the link.
    template <class Store>
    [[gnu::always_inline]] void felt(const Motion<S>& joint, Store store) const {  // called once a pair of joint and link
        const auto [v, u] = joint;
        store(0, [&] { return dot(v, a); });
        store(1, [&] { return dot(x, v) + (a.y * u.z - a.z * u.y); });
        store(2, [&] { return dot(y, v) + (a.z * u.x - a.x * u.z); });
        store(3, [&] { return dot(z, v) + (a.x * u.y - a.y * u.x); });
        store(4, [&] { return u.x * dw.x + (u.y * xz - u.z * xy); });
        store(5, [&] { return u.y * y.z - u.x * x.z + u.z * (x.x - y.y); });
        store(6, [&] { return u.x * x.y - u.z * z.y + u.y * (z.z - x.x); });
        store(7, [&] { return u.y * dw.y + (u.z * xy - u.x * yz); });
        store(8, [&] { return u.z * z.x - u.y * y.x + u.x * (y.y - z.z); });
        store(9, [&] { return u.z * dw.z + (u.x * yz - u.y * xz); });
    }

  private:
    Vector<S> a, dw, x, y, z;
    S xy, xz, yz;
};

// q, dq, ddq: (samples, n). places: (n, 10 n), for every entry of the regressor the row of out that takes it over the samples, or -1.
// out: (·, samples); entries that are zero by structure are not written. Rows are written in stretches: one sample after the other would
// go through as many pages of memory as there are rows.
inline void torque_regressor(const Tree& tree, const double* geometry, Vector3 gravity, const double* q, const double* dq, const double* ddq,
                             const std::int64_t* places, std::ptrdiff_t samples, double* out) {
    constexpr std::ptrdiff_t stretch = 128;
    const int n = tree.size();
    TreeMotion<Lanes> motion(tree, geometry, gravity);
    JointStates states(n);
    std::vector<std::int64_t> rows, own(inertial_size * n * n, -1);
    for (int i = 0; i < n; ++i)
        for (int j : motion.path(i))
            for (int at = inertial_size * (j * n + i); at < inertial_size * (j * n + i + 1); ++at)
                if (places[at] >= 0) {
                    own[at] = static_cast<std::int64_t>(rows.size());
                    rows.push_back(places[at]);
                }
    std::vector<double> written(rows.size() * stretch);
    for (std::ptrdiff_t start = 0; start < samples; start += stretch) {
        const std::ptrdiff_t count = std::min(stretch, samples - start);
        for (std::ptrdiff_t s = 0; s < count; s += lane_count) {
            states.read(q, dq, ddq, start + s, samples);
            for (int i = 0; i < n; ++i) {
                const LinkTorques<Lanes> link(motion.advance(i, states.q()[i], states.dq()[i], states.ddq()[i]));
                for (int j : motion.path(i)) {
                    const std::int64_t* row = &own[inertial_size * (j * n + i)];
                    double* first = written.data() + s;
                    link.felt(motion.reach(i, j), [row, first](int k, auto torque) {
                        if (row[k] < 0) return;
                        const Lanes value = torque();
                        std::memcpy(first + row[k] * stretch, &value, sizeof value);
                    });
                }
            }
        }
        for (std::size_t r = 0; r < rows.size(); ++r) std::copy_n(&written[r * stretch], count, out + rows[r] * samples + start);
    }
}

}  // namespace flexcal
