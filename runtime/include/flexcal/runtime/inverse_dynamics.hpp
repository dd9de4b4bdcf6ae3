// Torques of the motors for a motion of the rigid robot: Newton and Euler's equations link by link, and friction.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "flexcal/runtime/arm_at_rest.hpp"
#include "flexcal/runtime/model.hpp"

namespace flexcal::runtime {

class InverseDynamics {
  public:
    explicit InverseDynamics(const Model& model)
        : model_(model), n_(model.size()), frames_(n_), links_(n_), force_(n_), moment_(n_),
          speed_(n_), load_(n_), moved_(n_) {}

    // q, dq, ddq, result: (n,); payload: true kg; elastic: whether the drives' springs give way to what the motion asks of them.
    void torque(const double* q, const double* dq, const double* ddq, double payload, bool elastic, double* result) {
        links(q, dq, ddq, payload, result);
        for (int pass = 0; elastic && pass < passes; ++pass) {
            for (int i = 0; i < n_; ++i) {
                const JointData& joint = model_.joints[i];
                const double twist = joint.drive_stiffness > 0 ? hardened_twist(result[i] / joint.drive_stiffness, joint.hardening) : 0.0;
                moved_[i] = q[i] - twist - sign(result[i]) * joint.backlash;
            }
            links(moved_.data(), dq, ddq, payload, result);
        }
        drives(q, dq, ddq, result);
    }

  private:
    static constexpr int passes = 6;

    struct Link {
        Vector3 w, dw, a;  // angular velocity and acceleration, acceleration of the origin less gravity, in the base
    };

    // Torques that move links and payload.
    void links(const double* q, const double* dq, const double* ddq, double payload, double* result) {
        for (int i = 0; i < n_; ++i) move(i, q[i], dq[i], ddq[i], payload);
        for (int i = n_ - 1; i >= 0; --i) {
            const bool slides = model_.tree.joints[i].prismatic;
            result[i] = dot(frames_[i].axis, slides ? force_[i] : moment_[i]);
            const int parent = model_.tree.joints[i].parent;
            if (parent < 0) continue;
            force_[parent] = force_[parent] + force_[i];
            moment_[parent] = moment_[parent] + moment_[i] + cross(frames_[i].origin - frames_[parent].origin, force_[i]);
        }
    }

    // Adds what rotors, friction, couplings, springs and cables take to the links' torques.
    void drives(const double* q, const double* dq, const double* ddq, double* result) {
        for (int i = 0; i < n_; ++i) load_[i] = std::abs(result[i]), speed_[i] = dq[i];
        for (const CouplingData& c : model_.couplings) speed_[c.motor] += c.ratio * dq[c.joint];
        for (int i = 0; i < n_; ++i) {
            const DriveData& d = model_.drives[i];
            result[i] += d.rotor_inertia * ddq[i] + d.viscous * dq[i] + d.coulomb * sign(dq[i]) + d.torque_offset + d.spring_stiffness * q[i] +
                         d.spring_torque + on_axis(i);
        }
        for (const CouplingData& c : model_.couplings) {
            const double side = sign(dq[c.motor] + c.ratio * dq[c.joint]);
            result[c.motor] += c.ratio * (c.rotor_inertia * ddq[c.joint] + c.viscous * dq[c.joint]) + c.coulomb * side;
            result[c.joint] += c.ratio * (c.rotor_inertia * ddq[c.motor] + c.viscous * dq[c.motor] + c.coulomb * side + on_axis(c.motor));
        }
    }

    // Friction of a motor's own axis, which a joint coupled to it feels too.
    double on_axis(int i) const {
        const DriveData& d = model_.drives[i];
        const double speed = speed_[i], slow = speed / d.stribeck_velocity, slow_loaded = speed / d.load_stribeck_velocity;
        return d.coulomb_asymmetry * std::abs(sign(speed)) +
               sign(speed) * (d.sublinear_viscous * std::sqrt(std::abs(speed)) + d.presliding + d.stribeck * std::exp(-slow * slow) +
                              load_[i] * (d.load_coulomb + d.load_stribeck * std::exp(-slow_loaded * slow_loaded)));
    }

    void move(int i, double q, double dq, double ddq, double payload) {
        constexpr double still[3] = {0, 0, 0};
        const int parent = model_.tree.joints[i].parent;
        frames_[i] = model_.tree.advance(i, model_.prepared[i], parent < 0 ? nullptr : &frames_[parent], q, still);
        const Frames& f = frames_[i];
        Link link{{0, 0, 0}, {0, 0, 0}, -1.0 * model_.gravity};
        if (parent >= 0) {
            link = links_[parent];
            const Vector3 d = f.origin - frames_[parent].origin;
            link.a = link.a + cross(link.dw, d) + cross(link.w, cross(link.w, d));
        }
        const Vector3 rate = dq * f.axis;
        if (model_.tree.joints[i].prismatic) {
            link.a = link.a + 2.0 * cross(link.w, rate) + ddq * f.axis;
        } else {
            link.dw = link.dw + ddq * f.axis + cross(link.w, rate);
            link.w = link.w + rate;
        }
        links_[i] = link;
        double mass = model_.mass[i], inertia[6];
        Vector3 moment = vector3(&model_.first_moment[3 * i]);
        std::copy_n(model_.drives[i].inertia, 6, inertia);
        if (i == model_.payload.joint) {
            mass += payload;
            moment = moment + payload * model_.payload.com;
            for (int k = 0; k < 6; ++k) inertia[k] += payload * model_.payload.inertia[k];
        }
        const Vector3 mc = f.link * moment;
        const auto turned = [&](Vector3 v) {
            const Vector3 u = transpose(f.link) * v;
            return f.link * Vector3{inertia[0] * u.x + inertia[1] * u.y + inertia[2] * u.z, inertia[1] * u.x + inertia[3] * u.y + inertia[4] * u.z,
                                    inertia[2] * u.x + inertia[4] * u.y + inertia[5] * u.z};
        };
        force_[i] = mass * link.a + cross(link.dw, mc) + cross(link.w, cross(link.w, mc));
        moment_[i] = turned(link.dw) + cross(link.w, turned(link.w)) + cross(mc, link.a);
    }

    const Model& model_;
    const int n_;
    std::vector<Frames> frames_;
    std::vector<Link> links_;
    std::vector<Vector3> force_, moment_;
    std::vector<double> speed_, load_, moved_;
};

}  // namespace flexcal::runtime
