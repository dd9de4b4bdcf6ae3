// The kinematic tree with everything that can be wrong with a joint: misalignment, offset, length errors, twist and bearing tilts.
//
// One joint, parent to child (Eqs. 1 and 15-18 of the two-stage paper, read as parent-to-child transforms):
//   Trans(t + length of the parent joint) · R · R_n2(misalignment_2) · R_n1(misalignment_1)
//   · F R_z(q + offset + twist) R_y(tilt_y) R_x(tilt_x) Fᵀ
// or, where the bearings are fixed to the parent link, F R_y(tilt_y) R_x(tilt_x) R_z(q + offset + twist) Fᵀ.
#pragma once
#include <vector>

#include "spatial.hpp"

namespace flexcal {

constexpr int geometry_size = 6;  // offset, misalignment_1, misalignment_2, length_x, length_y, length_z

struct Joint {
    int parent;
    bool prismatic;
    Rotation placement;
    Vector3 translation;
    Vector3 normal_1, normal_2;
    Rotation bearing;
};

// The frames that one joint passes through at one pose; each rotation axis is what a Jacobian column needs.
template <class S>
struct FramesOf {
    Vector<S> origin;
    Vector<S> misalignment_1, misalignment_2, axis, tilt_y, tilt_x;
    RotationOf<S> link;
};
using Frames = FramesOf<double>;

// Everything about a joint that is the same at all poses.
template <class S>
struct PreparedOf {
    Vector<S> translation;        // with the length error of the parent joint
    RotationOf<S> aligned;        // placement · misalignments · bearing frame
    Vector<S> normal_1, normal_2; // misalignment axes, in the parent link
    RotationOf<S> bearing_inverse;
    S offset;
};
using Prepared = PreparedOf<double>;
template <class S>
inline PreparedOf<S> lift(const Prepared& p) {
    return {lift<S>(p.translation), lift<S>(p.aligned), lift<S>(p.normal_1), lift<S>(p.normal_2), lift<S>(p.bearing_inverse), broadcast<S>(p.offset)};
}

struct Tree {
    std::vector<Joint> joints;
    bool tilts_first = false;  // the tilts come before the joint's rotation

    int size() const { return static_cast<int>(joints.size()); }

    std::vector<Prepared> prepare(const double* geometry) const {
        std::vector<Prepared> prepared;
        prepared.reserve(joints.size());
        for (int i = 0; i < size(); ++i) {
            const Joint& joint = joints[i];
            const double* g = geometry + geometry_size * i;
            const Vector3 length = joint.parent < 0 ? Vector3{0, 0, 0} : vector3(geometry + geometry_size * joint.parent + 3);
            const Rotation second = joint.placement * about(joint.normal_2, g[2]);
            prepared.push_back({joint.translation + length, second * about(joint.normal_1, g[1]) * joint.bearing,
                                second * joint.normal_1, joint.placement * joint.normal_2, transpose(joint.bearing), g[0]});
        }
        return prepared;
    }

    // deflection: tilt_x, tilt_y, twist of this joint
    template <class S>
    FramesOf<S> advance(int i, const PreparedOf<S>& joint, const FramesOf<S>* parent, typename Plain<S>::type q, const S* deflection) const {
        const RotationOf<S> base = parent ? parent->link : lift<S>(identity());
        FramesOf<S> f;
        f.origin = base * joint.translation;
        if (parent) f.origin = f.origin + parent->origin;
        f.misalignment_2 = base * joint.normal_2;
        f.misalignment_1 = base * joint.normal_1;
        RotationOf<S> r = base * joint.aligned;
        if (tilts_first) tilt(f, r, deflection);
        f.axis = r.z;
        const S motion = q + joint.offset + deflection[2];
        if (joints[i].prismatic) {
            f.origin = f.origin + motion * f.axis;
        } else {
            turn_z(r, motion);
        }
        if (!tilts_first) tilt(f, r, deflection);
        f.link = r * joint.bearing_inverse;
        return f;
    }

    template <class S>
    static void tilt(FramesOf<S>& f, RotationOf<S>& r, const S* deflection) {
        f.tilt_y = r.y;
        if (any_nonzero<S>(deflection[1])) turn_y(r, deflection[1]);
        f.tilt_x = r.x;
        if (any_nonzero<S>(deflection[0])) turn_x(r, deflection[0]);
    }

    std::vector<int> path(int joint) const {
        std::vector<int> result;
        for (int i = joint; i >= 0; i = joints[i].parent) result.insert(result.begin(), i);
        return result;
    }
};

}  // namespace flexcal
