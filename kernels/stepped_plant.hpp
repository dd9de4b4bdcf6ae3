// A MuJoCo plant that is stepped from outside, and the sampled controller of one of its motors.
//
// The plant is MuJoCo's; a loop only fills qfrc_applied and calls the step it was handed, so that no MuJoCo header and no library to link
// is needed: the address of mj_step and those of model and data come from Python.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace flexcal {

// A MuJoCo plant whose coordinates are all hinges or slides (positions and velocities number `dofs`).
struct SteppedPlant {
    void (*step)(const void* model, void* data);
    const void* model;
    void* data;
    const double* position;  // qpos
    const double* velocity;  // qvel, half a step behind
    double* force;           // qfrc_applied
    std::size_t dofs;

    static SteppedPlant at(std::uintptr_t step, std::uintptr_t model, std::uintptr_t data, const double* position,
                           const double* velocity, double* force, std::size_t dofs) {
        return {reinterpret_cast<void (*)(const void*, void*)>(step),
                reinterpret_cast<const void*>(model),
                reinterpret_cast<void*>(data),
                position,
                velocity,
                force,
                dofs};
    }
};

// When the controllers run, and what they see.
struct Sampling {
    double tick;                // s
    double encoder_resolution;  // rad per count, 0 = ideal
    double rate_filter;         // pole of the rate estimate's filter: weight of the newest difference, 1 = none
};

// Proportional-derivative controller of one motor.
struct MotorController {
    double proportional, derivative;
    double seen = 0.0, rate = 0.0;  // encoder reading and filtered rate of the latest tick

    // Read the encoder; the first reading takes the true rate.
    void read(const Sampling& sampling, double position, double velocity, bool first) {
        const double resolution = sampling.encoder_resolution;
        const double encoder = resolution > 0.0 ? resolution * std::nearbyint(position / resolution) : position;
        rate = first ? velocity : rate + sampling.rate_filter * ((encoder - seen) / sampling.tick - rate);
        seen = encoder;
    }

    double torque(double feed_forward, double reference, double reference_rate) const {
        return feed_forward + proportional * (reference - seen) + derivative * (reference_rate - rate);
    }
};

}  // namespace flexcal
