// The hard cell's inner loop: a sampled controller, gears with transmission error, bristle friction, MuJoCo's step.
//
// It shares no law of the arm with closed_loop.hpp, so that what both cells teach about the identification is taught twice.
#pragma once

#include <array>

namespace flexcal {

// An elastic hinge: hardening spring with lost motion, a damper, and a Jenkins element (a spring that slips at a twist).
struct ElasticHinge {
    double stiffness, damping, lost_motion, hardening, slipping_stiffness, slip_limit;
    double slip = 0.0, last_twist = 0.0;

    double torque(double twist, double rate);
};

// LuGre friction whose level grows with the load on the gear (Canudas de Wit et al. 1995).
struct BristleFriction {
    double viscous, coulomb, stribeck, stribeck_velocity, per_load, bristle_stiffness, bristle_damping;
    double deflection = 0.0;

    double torque(double rate, double load, double step);
};

// Output angle of a gear beyond the motor angle: harmonics 1 and 2 of the joint and of the motor.
struct TransmissionError {
    double ratio;
    std::array<double, 4> amplitude, phase;

    double angle(double motor) const;
    double slope(double motor) const;
};

}  // namespace flexcal
