// The virtual cell's inner loop: sampled controller, hold, drive and friction forces, MuJoCo's step.
#pragma once

#include <cstddef>
#include <vector>

#include "stepped_plant.hpp"

namespace flexcal {

// Force of one elastic coordinate: spring with dead band [-half_gap, half_gap], cubic term, hysteresis, damper.
struct Spring {
    double stiffness, damping, half_gap, cubic, hysteresis, hysteresis_width;
    double slip = 0.0, last = 0.0;  // state of the hysteresis in [-1, 1], last twist

    // Force on the coordinate at this twist (from its free position) and rate.
    double force(double twist, double rate);
};

// Friction of one motor: viscous, Coulomb smoothed by tanh, Stribeck.
struct Friction {
    double viscous, coulomb, coulomb_velocity, stribeck, stribeck_velocity;

    double torque(double rate) const;
};

// What the loop reads and writes, all (ticks, motors), row-major, but `state`, (ticks, dofs); `arm` and `state` may be null.
struct LoopSignals {
    std::size_t ticks;
    const double* feed_forward;
    const double* reference;
    const double* reference_rate;
    double* position;
    double* torque;
    double* arm;
    double* state;
};

// Runs the closed loop with `substeps` of the plant a tick; returns the number of ticks done (fewer than asked when the plant diverges).
std::size_t closed_loop(const SteppedPlant& plant, std::vector<Spring>& springs,
                        const std::vector<Friction>& frictions, const std::vector<std::size_t>& motors,
                        const std::vector<std::ptrdiff_t>& twists, std::vector<MotorController>& controllers,
                        const Sampling& sampling, std::size_t substeps, const LoopSignals& signals);

}  // namespace flexcal
