// Where a target point of the tool is, and how that depends on every geometric error and deflection.
#pragma once
#include "flexcal/tree.hpp"

namespace flexcal {

struct Target {
    int joint;              // the point hangs on this joint's link
    Rotation placement;     // of the point's frame in that link
    Vector3 translation;
    Vector3 point;          // in the point's frame
};

struct PointOutput {
    double* position;           // (samples, 3)
    double* orientation;        // (samples, 3, 3) or null
    double* geometry_jacobian;  // (samples, 6, 6 n + 6) or null: linear rows, then angular rows
    double* motion_jacobian;    // (samples, 6, 3 n) or null: tilt_x, tilt_y, twist of every joint
};

inline void column(double* jacobian, int columns, int index, Vector3 linear, Vector3 angular) {
    double* p = jacobian + index;
    p[0] = linear.x, p[columns] = linear.y, p[2 * columns] = linear.z;
    p[3 * columns] = angular.x, p[4 * columns] = angular.y, p[5 * columns] = angular.z;
}

// q: (samples, n); deflection: (samples, n, 3); geometry: (n, 6); tool: (6,)
inline void point_kinematics(const Tree& tree, const Target& target, const double* geometry, const double* tool, const double* q,
                             const double* deflection, std::ptrdiff_t samples, const PointOutput& out) {
    const int n = tree.size();
    const int geometry_columns = geometry_size * (n + 1), motion_columns = 3 * n;
    const std::vector<Prepared> prepared = tree.prepare(geometry);
    const std::vector<int> path = tree.path(target.joint);
    const Vector3 arm = target.translation + vector3(geometry + geometry_size * target.joint + 3);
    const Vector3 tip = target.point + vector3(tool + 3);
    std::vector<Frames> frames(n);

    for (std::ptrdiff_t s = 0; s < samples; ++s) {
        const Frames* last = nullptr;
        for (int i : path) {
            frames[i] = tree.advance(i, prepared[i], last, q[s * n + i], deflection + 3 * (s * n + i));
            last = &frames[i];
        }
        const Vector3 foot = last->origin + last->link * arm;
        Rotation r = last->link * target.placement;
        const Vector3 tool_y = r.y;
        turn_y(r, tool[2]);
        const Vector3 tool_x = r.x;
        turn_x(r, tool[1]);
        const Vector3 tool_z = r.z;
        turn_z(r, tool[0]);
        const Vector3 p = foot + r * tip;
        double* position = out.position + 3 * s;
        position[0] = p.x, position[1] = p.y, position[2] = p.z;
        if (out.orientation) write_rows(r, out.orientation + 9 * s);
        constexpr Vector3 zero{0, 0, 0};
        if (out.geometry_jacobian) {
            double* j = out.geometry_jacobian + 6 * geometry_columns * s;
            for (int i : path) {
                const Frames& f = frames[i];
                const Vector3 d = p - f.origin;
                const int at = geometry_size * i;
                if (tree.joints[i].prismatic)
                    column(j, geometry_columns, at, f.axis, zero);
                else
                    column(j, geometry_columns, at, cross(f.axis, d), f.axis);
                // a misalignment turns about the joint's place before the prismatic motion
                const Vector3 e = tree.joints[i].prismatic ? d + (q[s * n + i] + prepared[i].offset + deflection[3 * (s * n + i) + 2]) * f.axis : d;
                column(j, geometry_columns, at + 1, cross(f.misalignment_1, e), f.misalignment_1);
                column(j, geometry_columns, at + 2, cross(f.misalignment_2, e), f.misalignment_2);
                column(j, geometry_columns, at + 3, f.link.x, zero);
                column(j, geometry_columns, at + 4, f.link.y, zero);
                column(j, geometry_columns, at + 5, f.link.z, zero);
            }
            const Vector3 d = p - foot;
            const int at = geometry_size * n;
            column(j, geometry_columns, at, cross(tool_z, d), tool_z);
            column(j, geometry_columns, at + 1, cross(tool_x, d), tool_x);
            column(j, geometry_columns, at + 2, cross(tool_y, d), tool_y);
            column(j, geometry_columns, at + 3, r.x, zero);
            column(j, geometry_columns, at + 4, r.y, zero);
            column(j, geometry_columns, at + 5, r.z, zero);
        }
        if (out.motion_jacobian) {
            double* j = out.motion_jacobian + 6 * motion_columns * s;
            for (int i : path) {
                const Frames& f = frames[i];
                const Vector3 d = p - f.origin;
                column(j, motion_columns, 3 * i, cross(f.tilt_x, d), f.tilt_x);
                column(j, motion_columns, 3 * i + 1, cross(f.tilt_y, d), f.tilt_y);
                if (tree.joints[i].prismatic)
                    column(j, motion_columns, 3 * i + 2, f.axis, zero);
                else
                    column(j, motion_columns, 3 * i + 2, cross(f.axis, d), f.axis);
            }
        }
    }
}

}  // namespace flexcal
