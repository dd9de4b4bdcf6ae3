// How the links of a tree move, and how the unit rate of each joint moves the links beyond it.
//
// Everything about link i stands in its own frame, which its joint puts at `arm` in the parent's frame and turns by `turn` towards it:
// x_parent = turn · x. ω, α are its angular velocity and acceleration, a is the acceleration of its origin less gravity.
#pragma once
#include <vector>

#include "lanes.hpp"
#include "flexcal/tree.hpp"

namespace flexcal {

template <class S>
struct Link {
    Vector<S> w, dw, a;
};

// The velocity of a frame's origin and its angular velocity.
template <class S>
struct Motion {
    Vector<S> v, u;
};

// From the parent's frame to the link's.
template <class S>
struct Step {
    Vector<S> arm;
    RotationOf<S> turn;
};

// S samples at a time; S needs + - * with itself, cosine_and_sine and broadcast.
template <class S>
class TreeMotion {
  public:
    TreeMotion(const Tree& tree, const double* geometry, Vector3 gravity) : tree_(tree), n_(tree.size()), up_(lift<S>(-1.0 * gravity)) {
        const std::vector<Prepared> prepared = tree.prepare(geometry);
        for (int i = 0; i < n_; ++i) {
            const Prepared& p = prepared[i];
            fixed_.push_back({lift<S>(p.translation), lift<S>(p.aligned), lift<S>(p.bearing_inverse), lift<S>(tree.joints[i].bearing.z), p.offset});
            paths_.push_back(tree.path(i));
        }
        steps_.resize(n_);
        links_.resize(n_);
        motions_.resize(static_cast<std::size_t>(n_) * n_);
    }

    int size() const { return n_; }
    int parent(int i) const { return tree_.joints[i].parent; }
    bool slides(int i) const { return tree_.joints[i].prismatic; }
    const std::vector<int>& path(int i) const { return paths_[i]; }
    const Vector<S>& axis(int i) const { return fixed_[i].axis; }
    const Step<S>& step(int i) const { return steps_[i]; }
    const Link<S>& link(int i) const { return links_[i]; }
    // Of link i by the unit rate of joint j, which is on its path.
    const Motion<S>& motion(int i, int j) const { return motions_[i * size() + j]; }

    static Vector<S> still() { return {S{}, S{}, S{}}; }

    // Moves link i, parents first.
    const Link<S>& advance(int i, S q, S dq, S ddq) {
        const Fixed& f = fixed_[i];
        Step<S>& step = steps_[i];
        const S moved = q + f.offset;
        RotationOf<S> r = f.aligned;
        step.arm = f.translation;
        if (slides(i)) {
            step.arm = step.arm + moved * f.aligned.z;
        } else {
            S c, s;
            cosine_and_sine(moved, c, s);
            turn_z(r, c, s);
        }
        step.turn = r * f.bearing_inverse;
        const RotationOf<S> back = transpose(step.turn);
        Link<S>& link = links_[i];
        link = {still(), still(), up_};
        if (parent(i) >= 0) link = links_[parent(i)];
        link.a = back * (link.a + cross(link.dw, step.arm) + cross(link.w, cross(link.w, step.arm)));
        link.w = back * link.w;
        link.dw = back * link.dw;
        const Vector<S> rate = dq * f.axis, push = ddq * f.axis, swept = cross(link.w, rate);
        if (slides(i)) {
            link.a = link.a + push + swept + swept;
        } else {
            link.w = link.w + rate;
            link.dw = link.dw + push + swept;
        }
        return link;
    }

    // Moves link i by the unit rate of joint j, parents first.
    const Motion<S>& reach(int i, int j) {
        Motion<S>& m = motions_[i * size() + j];
        const Step<S>& step = steps_[i];
        if (j == i) {
            m = slides(i) ? Motion<S>{axis(i), still()} : Motion<S>{still(), axis(i)};
        } else {
            const Motion<S>& before = motion(parent(i), j);
            const RotationOf<S> back = transpose(step.turn);
            m = {back * (before.v + cross(before.u, step.arm)), back * before.u};
        }
        return m;
    }

  private:
    struct Fixed {
        Vector<S> translation;
        RotationOf<S> aligned, bearing_inverse;
        Vector<S> axis;
        double offset;
    };

    const Tree& tree_;
    int n_;
    Vector<S> up_;
    std::vector<Fixed> fixed_;
    std::vector<Step<S>> steps_;
    std::vector<std::vector<int>> paths_;
    std::vector<Link<S>> links_;
    std::vector<Motion<S>> motions_;
};

// What the joints do at some samples, side by side.
class JointStates {
  public:
    explicit JointStates(int n) : n_(n), values_(3 * static_cast<std::size_t>(n)) {}

    const Lanes* q() const { return values_.data(); }
    const Lanes* dq() const { return q() + n_; }
    const Lanes* ddq() const { return dq() + n_; }

    // Samples from the first on, of sources (samples, n); returns how many there are.
    int read(const double* q, const double* dq, const double* ddq, std::ptrdiff_t first, std::ptrdiff_t samples) {
        const int present = static_cast<int>(samples - first < lane_count ? samples - first : lane_count);
        const double* sources[3] = {q, dq, ddq};
        for (int part = 0; part < 3; ++part)
            for (int i = 0; i < n_; ++i)
                for (int lane = 0; lane < present; ++lane) values_[part * n_ + i][lane] = sources[part][(first + lane) * n_ + i];
        return present;
    }

  private:
    int n_;
    std::vector<Lanes> values_;
};

}  // namespace flexcal
