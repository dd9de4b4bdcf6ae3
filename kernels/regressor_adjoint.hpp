// The adjoint of the torque regressor W: from weights ∂f/∂W the derivatives of a scalar f by q, q̇ and q̈, in one sweep from the tips.
//
// The ten weights of joint j and link i stand where m, m c and I do; call them m, c and J. What f gets from them then is what the joint
// would feel if the link had these inertials (regressor.hpp): φ = v·f + u·μ, f = m a + α × c + ω × (ω × c), μ = J α + ω × J ω + c × a.
// With a bar for derivatives,
//   v̄ = f, ū = μ, ā = m v + u × c, ᾱ = J u + c × v, ω̄ = (ω × c) × v + c × (v × ω) + J (u × ω) + J ω × u.
// Those of a link are sums over the joints on its path and, as v̄ and ū, include what the links beyond have handed down.
//
// Back through joint i with axis z, first of its own motion: q̇ z in ω and q̈ z + ω × q̇ z in α (of a slide: q̈ z + 2 ω × q̇ z in a) give
// the derivatives by q̇ and q̈, and more ω̄. What then is left of ω, α and a, and v, u of the joints before i, has come from the parent:
// an angle turns it all by -z as the link sees it, q̄ = z·Σ x̄ × x, and a slide moves the arm r by z, q̄ = z·r̄. Last, the parent gets
// the bars turned into its own frame: a force g = ā at the end of the arm adds r × g to ᾱ and its share of ω × (ω × r) to ω̄, and a
// force v̄ adds r × v̄ to ū.
#pragma once
#include <algorithm>

#include "regressor.hpp"

namespace flexcal {

// The weights of what a joint feels from a link, read as the inertial parameters of that link.
template <class S>
struct Weights {
    S m;
    Vector<S> c;
    S xx, xy, xz, yy, yz, zz;

    Vector<S> inertia(const Vector<S>& a) const {
        return {xx * a.x + xy * a.y + xz * a.z, xy * a.x + yy * a.y + yz * a.z, xz * a.x + yz * a.y + zz * a.z};
    }
};

// v·(ω × (ω × c)) by ω.
template <class S>
inline Vector<S> swing_adjoint(const Vector<S>& v, const Vector<S>& w, const Vector<S>& c) {
    return cross(cross(w, c), v) + cross(c, cross(v, w));
}

// Adds what one joint feels from one link to the derivatives by both their motions.
template <class S>
inline void add_adjoint(const Weights<S>& y, const Motion<S>& joint, const Link<S>& link, Motion<S>& joint_bar, Link<S>& link_bar) {
    const auto& [v, u] = joint;
    const auto& [w, dw, a] = link;
    const Vector<S> spin = y.inertia(w);
    joint_bar.v = joint_bar.v + y.m * a + cross(dw, y.c) + cross(w, cross(w, y.c));
    joint_bar.u = joint_bar.u + y.inertia(dw) + cross(w, spin) + cross(y.c, a);
    link_bar.a = link_bar.a + y.m * v + cross(u, y.c);
    link_bar.dw = link_bar.dw + y.inertia(u) + cross(y.c, v);
    link_bar.w = link_bar.w + swing_adjoint(v, w, y.c) + y.inertia(cross(u, w)) + cross(spin, u);
}

// S samples at a time.
template <class S>
class RegressorAdjoint {
  public:
    explicit RegressorAdjoint(TreeMotion<S>& tree)
        : tree_(tree), links_(tree.size()), motions_(static_cast<std::size_t>(tree.size()) * tree.size()) {}

    // q, dq, ddq: one S a joint, as the derivatives by them. weight(joint, column) is asked for every entry that is not zero by structure.
    template <class Weight>
    void evaluate(const S* q, const S* dq, const S* ddq, Weight&& weight, S* q_bar, S* dq_bar, S* ddq_bar) {
        const Vector<S> still = TreeMotion<S>::still();
        std::fill(links_.begin(), links_.end(), Link<S>{still, still, still});
        std::fill(motions_.begin(), motions_.end(), Motion<S>{still, still});
        for (int i = 0; i < tree_.size(); ++i) {
            tree_.advance(i, q[i], dq[i], ddq[i]);
            for (int j : tree_.path(i)) tree_.reach(i, j);
        }
        for (int i = tree_.size() - 1; i >= 0; --i) {
            for (int j : tree_.path(i)) {
                const auto y = [&](int k) { return weight(j, inertial_size * i + k); };
                add_adjoint<S>({y(0), {y(1), y(2), y(3)}, y(4), y(5), y(6), y(7), y(8), y(9)}, tree_.motion(i, j), tree_.link(i),
                               bar(i, j), links_[i]);
            }
            retreat(i, dq[i], q_bar[i], dq_bar[i], ddq_bar[i]);
        }
    }

  private:
    Motion<S>& bar(int i, int j) { return motions_[i * tree_.size() + j]; }

    // Back through joint i: its derivatives, and the parent's share.
    void retreat(int i, S dq, S& q_bar, S& dq_bar, S& ddq_bar) {
        const auto& [w, dw, a] = tree_.link(i);
        const Vector<S>& z = tree_.axis(i);
        const Vector<S> rate = dq * z;
        Link<S>& link = links_[i];
        Vector<S> by_motion;  // per unit of q, along z
        if (tree_.slides(i)) {
            ddq_bar = dot(link.a, z);
            dq_bar = 2.0 * dot(link.a, cross(w, z));
            link.w = link.w + cross(rate, link.a) + cross(rate, link.a);
            by_motion = cross(link.a, dw) + cross(cross(link.a, w), w);
        } else {
            ddq_bar = dot(link.dw, z);
            dq_bar = dot(link.w, z) + dot(link.dw, cross(w, z));
            link.w = link.w + cross(rate, link.dw);
            by_motion = cross(link.w, w) + cross(link.dw, dw - cross(w, rate)) + cross(link.a, a);
        }
        const int parent = tree_.parent(i);
        const auto& [arm, turn] = tree_.step(i);
        for (int j : tree_.path(i)) {
            if (j == i) continue;
            const auto& [v, u] = tree_.motion(i, j);
            const Motion<S>& m = bar(i, j);
            by_motion = by_motion + (tree_.slides(i) ? cross(m.v, u) : cross(m.v, v) + cross(m.u, u));
            const Vector<S> force = turn * m.v;
            Motion<S>& before = bar(parent, j);
            before.v = before.v + force;
            before.u = before.u + turn * m.u + cross(arm, force);
        }
        q_bar = dot(by_motion, z);
        if (parent < 0) return;
        const Vector<S> force = turn * link.a;
        Link<S>& before = links_[parent];
        before.a = before.a + force;
        before.dw = before.dw + turn * link.dw + cross(arm, force);
        before.w = before.w + turn * link.w + swing_adjoint(force, tree_.link(parent).w, arm);
    }

    TreeMotion<S>& tree_;
    std::vector<Link<S>> links_;
    std::vector<Motion<S>> motions_;  // of link i by joint j, as tree_.motion(i, j)
};

// q, dq, ddq, places: as torque_regressor has them. weights: (·, samples), row places[joint, column] for that entry; -1 has none.
// out: (3, samples, n), by q, dq and ddq.
inline void torque_regressor_adjoint(const Tree& tree, const double* geometry, Vector3 gravity, const double* q, const double* dq,
                                     const double* ddq, const std::int64_t* places, const double* weights, std::ptrdiff_t samples,
                                     double* out) {
    const int n = tree.size();
    TreeMotion<Lanes> motion(tree, geometry, gravity);
    RegressorAdjoint<Lanes> adjoint(motion);
    JointStates states(n);
    std::vector<Lanes> bars(3 * static_cast<std::size_t>(n));
    for (std::ptrdiff_t s = 0; s < samples; s += lane_count) {
        const int present = states.read(q, dq, ddq, s, samples);
        const auto weight = [&](int joint, int column) {
            Lanes result{};
            const std::ptrdiff_t place = places[joint * inertial_size * n + column];
            if (place < 0) return result;
            const double* p = weights + place * samples + s;
            if (present == lane_count)
                std::memcpy(&result, p, sizeof result);
            else
                for (int lane = 0; lane < present; ++lane) result[lane] = p[lane];
            return result;
        };
        adjoint.evaluate(states.q(), states.dq(), states.ddq(), weight, bars.data(), bars.data() + n, bars.data() + 2 * n);
        for (int part = 0; part < 3; ++part)
            for (int i = 0; i < n; ++i)
                for (int lane = 0; lane < present; ++lane) out[(part * samples + s + lane) * n + i] = bars[part * n + i][lane];
    }
}

}  // namespace flexcal
