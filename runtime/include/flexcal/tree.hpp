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
struct Frames {
    Vector3 origin;
    Vector3 misalignment_1, misalignment_2, axis, tilt_y, tilt_x;
    Rotation link;
};

// Everything about a joint that is the same at all poses.
struct Prepared {
    Vector3 translation;        // with the length error of the parent joint
    Rotation aligned;           // placement · misalignments · bearing frame
    Vector3 normal_1, normal_2; // misalignment axes, in the parent link
    Rotation bearing_inverse;
    double offset;
};

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
    Frames advance(int i, const Prepared& joint, const Frames* parent, double q, const double* deflection) const {
        const Rotation base = parent ? parent->link : identity();
        Frames f;
        f.origin = base * joint.translation;
        if (parent) f.origin = f.origin + parent->origin;
        f.misalignment_2 = base * joint.normal_2;
        f.misalignment_1 = base * joint.normal_1;
        Rotation r = base * joint.aligned;
        if (tilts_first) tilt(f, r, deflection);
        f.axis = r.z;
        const double motion = q + joint.offset + deflection[2];
        if (joints[i].prismatic) {
            f.origin = f.origin + motion * f.axis;
        } else {
            turn_z(r, motion);
        }
        if (!tilts_first) tilt(f, r, deflection);
        f.link = r * joint.bearing_inverse;
        return f;
    }

    static void tilt(Frames& f, Rotation& r, const double* deflection) {
        f.tilt_y = r.y;
        if (deflection[1] != 0) turn_y(r, deflection[1]);
        f.tilt_x = r.x;
        if (deflection[0] != 0) turn_x(r, deflection[0]);
    }

    std::vector<int> path(int joint) const {
        std::vector<int> result;
        for (int i = joint; i >= 0; i = joints[i].parent) result.insert(result.begin(), i);
        return result;
    }
};

}  // namespace flexcal
