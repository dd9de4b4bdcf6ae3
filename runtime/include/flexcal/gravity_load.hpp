// Gravity's load on the axes of an arm, and how it changes as they turn.
//
// The potential is V = -g·Σ m c. With the rotation axes a_k ordered from base to tool and S_k the first moment of everything beyond
// axis k about its origin, ∂V/∂q_k = -g·(a_k × S_k) and, for k before j, ∂²V/∂q_k∂q_j = -g·(a_k × (a_j × S_j)).
#pragma once
#include <vector>

#include "tree.hpp"

namespace flexcal {

struct Masses {
    const double* mass;          // (n,)
    const double* first_moment;  // (n, 3), mass times centre of mass, in the link
    const double* payload;       // (samples,) kg, at payload_point of payload_joint's link
    int payload_joint;
    Vector3 payload_point;
};

struct ElasticAxis {
    int joint;
    int component;  // 0 tilt_x, 1 tilt_y, 2 twist
};

// The gravity load of one pose on some axes, base to tool, within a joint too, as the tree has them. About a revolute joint's axes the load
// is a moment, along a prismatic joint's it is a force: ∂V/∂q_k = -g·(m a_k), and no later axis changes its direction.
template <class S>
class GravityLoadOf {
  public:
    GravityLoadOf(const Tree& tree, const std::vector<ElasticAxis>& axes, const double* geometry, const Masses& masses, Vector3 gravity)
        : tree_(tree), axes_(axes), masses_(masses), gravity_(lift<S>(gravity)), frames_(tree.size()),
          mass_(tree.size()), moment_(tree.size()), axis_(axes.size()), turned_(axes.size()),
          beyond_(static_cast<std::size_t>(tree.size()) * tree.size(), 0) {
        for (const Prepared& joint : tree.prepare(geometry)) prepared_.push_back(lift<S>(joint));
        for (int i = 0; i < tree.size(); ++i)
            for (int j = i; j >= 0; j = tree.joints[j].parent) beyond_[j * tree.size() + i] = 1;
    }

    // q: (n,); deflection: (n, 3)
    void move(const S* q, const S* deflection, S payload) {
        const int n = tree_.size();
        q_ = q, deflection_ = deflection, payload_ = payload;
        for (int i = 0; i < n; ++i) {
            const int parent = tree_.joints[i].parent;
            frames_[i] = tree_.advance(i, prepared_[i], parent < 0 ? nullptr : &frames_[parent], q[i], deflection + 3 * i);
            mass_[i] = broadcast<S>(masses_.mass[i]);
            Vector<S> own = lift<S>(vector3(masses_.first_moment + 3 * i));
            if (i == masses_.payload_joint) {
                mass_[i] += payload;
                own = own + payload * lift<S>(masses_.payload_point);
            }
            moment_[i] = mass_[i] * frames_[i].origin + frames_[i].link * own;
        }
        for (int i = n - 1; i >= 0; --i) {
            const int parent = tree_.joints[i].parent;
            if (parent >= 0) {
                mass_[parent] += mass_[i];
                moment_[parent] = moment_[parent] + moment_[i];
            }
        }
        for (std::size_t k = 0; k < axes_.size(); ++k) {
            const int joint = axes_[k].joint;
            const FramesOf<S>& f = frames_[joint];
            axis_[k] = axes_[k].component == 0 ? f.tilt_x : axes_[k].component == 1 ? f.tilt_y : f.axis;
            turned_[k] = slides(static_cast<int>(k)) ? mass_[joint] * axis_[k] : cross(axis_[k], moment_[joint] - mass_[joint] * f.origin);
        }
    }

    // -∂V/∂q_k
    S load(int k) const { return dot(gravity_, turned_[k]); }

    // ∂²V/∂q_k∂q_j for k before j, or j itself
    S stiffness(int k, int j) const {
        const bool carried = beyond_[axes_[k].joint * tree_.size() + axes_[j].joint];
        return carried && !slides(k) ? -dot(gravity_, cross(axis_[k], turned_[j])) : S{};
    }

    // ∂(∂V/∂q_k) by mass and first moment of each link, (4 n,), written where not zero
    void regressor(int k, S* row) const {
        const int joint = axes_[k].joint;
        const Vector<S> lever = cross(gravity_, axis_[k]);  // g·(a × r) = (g × a)·r
        for (int i = 0; i < tree_.size(); ++i) {
            if (!beyond_[joint * tree_.size() + i]) continue;
            if (slides(k)) {
                row[4 * i] = -dot(gravity_, axis_[k]);
                continue;
            }
            const RotationOf<S>& r = frames_[i].link;
            row[4 * i] = -dot(lever, frames_[i].origin - frames_[joint].origin);
            row[4 * i + 1] = -dot(lever, r.x);
            row[4 * i + 2] = -dot(lever, r.y);
            row[4 * i + 3] = -dot(lever, r.z);
        }
    }

    // ∂(∂V/∂q_k) by the offset of joint i
    S by_offset(int k, int i) const {
        const int n = tree_.size(), joint = axes_[k].joint;
        const bool inside = beyond_[i * n + joint];
        if (!inside && !beyond_[joint * n + i]) return S{};
        if (tree_.joints[i].prismatic) return inside || slides(k) ? S{} : -mass_[i] * dot(gravity_, cross(axis_[k], frames_[i].axis));
        // fixed to the parent, the bearing tilts the offset with everything beyond
        const bool tilted = i == joint && tree_.tilts_first && axes_[k].component != 2;
        return by_turn(k, i, frames_[i].axis, inside && !tilted);
    }

    // ∂(∂V/∂q_k) by geometry, (6 n,), written where not zero
    void coupling(int k, S* row) const {
        const int n = tree_.size(), joint = axes_[k].joint;
        for (int i = 0; i < n; ++i) {
            const bool inside = beyond_[i * n + joint];
            if (!inside && !beyond_[joint * n + i]) continue;
            const FramesOf<S>& f = frames_[i];
            row[geometry_size * i] = by_offset(k, i);
            row[geometry_size * i + 1] = by_turn(k, i, f.misalignment_1, inside);
            row[geometry_size * i + 2] = by_turn(k, i, f.misalignment_2, inside);
            if (!beyond_[joint * n + i] || slides(k)) continue;
            const S carried = mass_[i] - masses_.mass[i] - (i == masses_.payload_joint ? payload_ : S{});
            const Vector<S> lengths[3] = {f.link.x, f.link.y, f.link.z};
            for (int g = 0; g < 3; ++g) row[geometry_size * i + 3 + g] = -carried * dot(gravity_, cross(axis_[k], lengths[g]));
        }
    }

  private:
    // ∂(∂V/∂q_k) by a turn within joint i: of axis k with everything beyond it, or of what axis k carries.
    S by_turn(int k, int i, const Vector<S>& turn, bool of_axis) const {
        if (of_axis) return -dot(gravity_, cross(turn, turned_[k]));
        if (slides(k)) return S{};
        const FramesOf<S>& f = frames_[i];
        // a misalignment turns about the joint's place before the prismatic motion
        const S slid = tree_.joints[i].prismatic ? q_[i] + prepared_[i].offset + deflection_[3 * i + 2] : S{};
        const Vector<S> moved = moment_[i] - mass_[i] * (f.origin - slid * f.axis);
        return -dot(gravity_, cross(axis_[k], cross(turn, moved)));
    }

    bool slides(int k) const { return axes_[k].component == 2 && tree_.joints[axes_[k].joint].prismatic; }

    const Tree& tree_;
    const std::vector<ElasticAxis>& axes_;
    const Masses& masses_;
    const Vector<S> gravity_;
    std::vector<PreparedOf<S>> prepared_;
    std::vector<FramesOf<S>> frames_;
    std::vector<S> mass_;
    std::vector<Vector<S>> moment_, axis_, turned_;
    std::vector<char> beyond_;  // beyond[j * n + i]: link i is carried by joint j
    const S* q_ = nullptr;
    const S* deflection_ = nullptr;
    S payload_{};
};
using GravityLoad = GravityLoadOf<double>;

}  // namespace flexcal
