// The virtual cell's inner loop: sampled controller, hold, drive and friction forces, MuJoCo's step.
//
// The plant is MuJoCo's; this file only fills qfrc_applied and calls the step it was handed, so that no
// MuJoCo header and no library to link is needed: the address of mj_step and those of model and data come from Python.
#pragma once

#include <cstddef>
#include <vector>

namespace flexcal {

// A MuJoCo plant whose coordinates are all hinges or slides (positions and velocities number `dofs`).
struct SteppedPlant {
    void (*step)(const void* model, void* data);
    const void* model;
    void* data;
    const double* position;  // qpos
    const double* velocity;  // qvel
    double* force;           // qfrc_applied
    std::size_t dofs;
};

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

struct Controller {
    double tick;                // s
    std::size_t substeps;       // plant steps per tick
    double encoder_resolution;  // rad per count, 0 = ideal
    double rate_filter;         // pole of the rate estimate's filter: weight of the newest difference, 1 = none
    std::vector<double> proportional, derivative;  // per motor
};

// What the loop reads and writes, all (ticks, motors), row-major; `arm` may be null.
struct LoopSignals {
    std::size_t ticks;
    const double* feed_forward;
    const double* reference;
    const double* reference_rate;
    double* position;
    double* torque;
    double* arm;
};

// Runs the closed loop; returns the number of ticks done (fewer than asked when the plant diverges).
std::size_t closed_loop(const SteppedPlant& plant, std::vector<Spring>& springs,
                        const std::vector<Friction>& frictions, const std::vector<std::size_t>& motors,
                        const std::vector<std::ptrdiff_t>& twists, const Controller& controller,
                        const LoopSignals& signals);

}  // namespace flexcal
