// The torque regressor: joint torques are linear in every link's mass m, first moment m c and inertia I at the link frame (Eq. 2.20).
//
// In the frame of link i, with ω, α its angular velocity and acceleration and a the acceleration of its origin less gravity, the link
// needs force f = m a + A m c, A = [α]× + [ω]×[ω]×, and moment I α + ω × I ω + m c × a. Joint j, whose unit rate moves that frame with
// velocity v and angular velocity u, feels v·f + u·moment: m gets v·a, m c gets Aᵀ v + a × u, and I gets u·I α + (u × ω)·I ω.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "lanes.hpp"
#include "tree.hpp"

namespace flexcal {

constexpr int inertial_size = 10;  // m, m c_x, m c_y, m c_z, Ixx, Ixy, Ixz, Iyy, Iyz, Izz

// What torques per unit parameter a joint feels from a link.
template <class S>
inline std::array<S, inertial_size> inertial_torques(const Vector<S>& v, const Vector<S>& u, const Vector<S>& w, const Vector<S>& dw,
                                                     const Vector<S>& a) {
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

// The regressor of a tree, S samples at a time; S needs + - * with itself, cosine, sine and broadcast.
template <class S>
class Regressor {
  public:
    Regressor(const Tree& tree, const double* geometry, Vector3 gravity) : tree_(tree), up_(lift(-1.0 * gravity)) {
        const std::vector<Prepared> prepared = tree.prepare(geometry);
        for (int i = 0; i < tree.size(); ++i) {
            const Prepared& p = prepared[i];
            fixed_.push_back({lift(p.translation), lift(p.aligned), lift(p.bearing_inverse), lift(tree.joints[i].bearing.z), p.offset});
            paths_.push_back(tree.path(i));
        }
        links_.resize(tree.size());
        motions_.resize(static_cast<std::size_t>(tree.size()) * tree.size());
    }

    // q, dq, ddq: one S a joint. store(joint, column, torque) is called for every entry that is not zero by structure.
    template <class Store>
    void evaluate(const S* q, const S* dq, const S* ddq, Store&& store) {
        const int n = tree_.size();
        const Vector<S> still{S{}, S{}, S{}};
        for (int i = 0; i < n; ++i) {
            const Fixed& f = fixed_[i];
            const int parent = tree_.joints[i].parent;
            const bool slides = tree_.joints[i].prismatic;
            const S motion = q[i] + f.offset;
            RotationOf<S> r = f.aligned;
            Vector<S> arm = f.translation;
            if (slides)
                arm = arm + motion * f.aligned.z;
            else
                turn_z(r, cosine(motion), sine(motion));
            const RotationOf<S> back = transpose(r * f.bearing_inverse);
            Link& link = links_[i];
            link = {still, still, up_};
            if (parent >= 0) link = links_[parent];
            link.a = back * (link.a + cross(link.dw, arm) + cross(link.w, cross(link.w, arm)));
            link.w = back * link.w;
            link.dw = back * link.dw;
            const Vector<S> rate = dq[i] * f.axis, push = ddq[i] * f.axis, swept = cross(link.w, rate);
            if (slides) {
                link.a = link.a + push + swept + swept;
            } else {
                link.w = link.w + rate;
                link.dw = link.dw + push + swept;
            }
            for (int j : paths_[i]) {
                Motion& m = motions_[i * n + j];
                if (j == i) {
                    m = slides ? Motion{f.axis, still} : Motion{still, f.axis};
                } else {
                    const Motion& before = motions_[parent * n + j];
                    m = {back * (before.v + cross(before.u, arm)), back * before.u};
                }
                const std::array<S, inertial_size> torques = inertial_torques(m.v, m.u, link.w, link.dw, link.a);
                for (int k = 0; k < inertial_size; ++k) store(j, inertial_size * i + k, torques[k]);
            }
        }
    }

  private:
    struct Fixed {
        Vector<S> translation;
        RotationOf<S> aligned, bearing_inverse;
        Vector<S> axis;
        double offset;
    };
    struct Link {
        Vector<S> w, dw, a;
    };
    struct Motion {
        Vector<S> v, u;
    };

    static Vector<S> lift(Vector3 a) { return {broadcast<S>(a.x), broadcast<S>(a.y), broadcast<S>(a.z)}; }
    static RotationOf<S> lift(const Rotation& r) { return {lift(r.x), lift(r.y), lift(r.z)}; }

    const Tree& tree_;
    Vector<S> up_;
    std::vector<Fixed> fixed_;
    std::vector<std::vector<int>> paths_;
    std::vector<Link> links_;
    std::vector<Motion> motions_;
};

// q, dq, ddq: (samples, n). places: (n, 10 n), for every entry of the regressor the row of out that takes it over the samples, or -1.
// out: (·, samples); entries that are zero by structure are not written.
inline void torque_regressor(const Tree& tree, const double* geometry, Vector3 gravity, const double* q, const double* dq, const double* ddq,
                             const std::int64_t* places, std::ptrdiff_t samples, double* out) {
    const int n = tree.size();
    Regressor<Lanes> regressor(tree, geometry, gravity);
    std::vector<Lanes> states(3 * static_cast<std::size_t>(n));
    const double* sources[3] = {q, dq, ddq};
    for (std::ptrdiff_t s = 0; s < samples; s += lane_count) {
        const int present = static_cast<int>(samples - s < lane_count ? samples - s : lane_count);
        for (int part = 0; part < 3; ++part)
            for (int i = 0; i < n; ++i)
                for (int lane = 0; lane < present; ++lane) states[part * n + i][lane] = sources[part][(s + lane) * n + i];
        regressor.evaluate(states.data(), states.data() + n, states.data() + 2 * n, [&](int joint, int column, const Lanes& torque) {
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
