#include "geared_loop.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "stepped_plant.hpp"

namespace nb = nanobind;

namespace flexcal {

constexpr double too_fast = 500.0;  // rad/s

double ElasticHinge::torque(double twist, double rate) {
    slip = std::clamp(slip + twist - last_twist, -slip_limit, slip_limit);
    last_twist = twist;
    double total = -slipping_stiffness * slip;
    const double wound = std::abs(twist) - lost_motion;
    if (wound > 0.0 || lost_motion == 0.0) {
        const double stretch = std::copysign(wound, twist);
        total -= stiffness * (stretch + hardening * stretch * stretch * stretch) + damping * rate;
    }
    return total;
}

double BristleFriction::torque(double rate, double load, double step) {
    const double speed = std::abs(rate), slowness = rate / stribeck_velocity;
    const double level = coulomb + per_load * std::abs(load) + stribeck * std::exp(-slowness * slowness);
    if (!(bristle_stiffness > 0.0) || !(level > 0.0)) return viscous * rate;
    const double sliding = std::copysign(level / bristle_stiffness, rate);
    const double before = deflection;
    deflection = sliding + (before - sliding) * std::exp(-bristle_stiffness * speed * step / level);
    return viscous * rate + bristle_stiffness * deflection + bristle_damping * (deflection - before) / step;
}

double TransmissionError::angle(double motor) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < 4; ++k)
        sum += amplitude[k] * std::sin((k < 2 ? 1.0 : ratio) * (k % 2 ? 2.0 : 1.0) * motor + phase[k]);
    return sum;
}

double TransmissionError::slope(double motor) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        const double order = (k < 2 ? 1.0 : ratio) * (k % 2 ? 2.0 : 1.0);
        sum += amplitude[k] * order * std::cos(order * motor + phase[k]);
    }
    return sum;
}

namespace {

struct Axis {
    std::size_t motor;
    std::ptrdiff_t twist;  // -1: a rigid gear
    double torque_gain;
    MotorController controller;
    BristleFriction friction;
    TransmissionError error;
    double held = 0.0, asked = 0.0;
};

std::size_t geared_loop(std::uintptr_t step, std::uintptr_t model, std::uintptr_t data, nb::handle angle_,
                        nb::handle velocity_, nb::handle applied_, nb::handle hinges_, nb::handle motors_,
                        nb::handle twists_, nb::handle frictions_, nb::handle errors_, nb::handle gains_, double tick,
                        std::size_t substeps, double count, double filter, nb::handle torque_, nb::handle reference_,
                        nb::handle reference_rate_, nb::handle angle_log_, nb::handle torque_log_) {
    if (!step || !model || !data) throw nb::value_error("step, model and data must be addresses");
    if (substeps == 0 || !(tick > 0.0)) throw nb::value_error("tick and substeps must be positive");
    const auto angle = written_reals(angle_, {any}, "angle");  // of hinges: as many as velocities
    const std::size_t size = angle.shape(0);
    const auto velocity = written_reals(velocity_, {size}, "velocity");
    const auto applied = written_reals(applied_, {size}, "applied");
    const auto hinges = reals(hinges_, {size, 6}, "hinges");
    const auto motors = indices(motors_, {any}, "motors");
    const std::size_t axes = motors.shape(0);
    const auto twists = indices(twists_, {axes}, "twists");
    const auto frictions = reals(frictions_, {axes, 7}, "frictions");
    const auto errors = reals(errors_, {axes, 9}, "errors");
    const auto gains = reals(gains_, {axes, 3}, "gains");
    const auto torque = reals(torque_, {any, axes}, "torque");
    const std::size_t ticks = torque.shape(0);
    const auto reference = reals(reference_, {ticks, axes}, "reference");
    const auto reference_rate = reals(reference_rate_, {ticks, axes}, "reference_rate");
    const auto angle_log = written_reals(angle_log_, {ticks, axes}, "angle_log");
    const auto torque_log = written_reals(torque_log_, {ticks, axes}, "torque_log");

    std::vector<ElasticHinge> springs(size);
    for (std::size_t i = 0; i < size; ++i)
        springs[i] = {hinges(i, 0), hinges(i, 1), hinges(i, 2), hinges(i, 3), hinges(i, 4), hinges(i, 5)};
    std::vector<Axis> axis(axes);
    for (std::size_t m = 0; m < axes; ++m) {
        if (motors(m) < 0 || motors(m) >= static_cast<std::int64_t>(size) ||
            twists(m) >= static_cast<std::int64_t>(size))
            throw nb::value_error("a motor or twist lies outside the arm's hinges");
        axis[m].motor = static_cast<std::size_t>(motors(m));
        axis[m].twist = static_cast<std::ptrdiff_t>(twists(m));
        axis[m].torque_gain = gains(m, 0);
        axis[m].controller = {gains(m, 1), gains(m, 2)};
        axis[m].friction = {frictions(m, 0), frictions(m, 1), frictions(m, 2), frictions(m, 3),
                            frictions(m, 4), frictions(m, 5), frictions(m, 6)};
        axis[m].error.ratio = errors(m, 0);
        for (std::size_t k = 0; k < 4; ++k) {
            axis[m].error.amplitude[k] = errors(m, 1 + k);
            axis[m].error.phase[k] = errors(m, 5 + k);
        }
    }
    const SteppedPlant arm =
        SteppedPlant::at(step, model, data, angle.data(), velocity.data(), applied.data(), size);
    const Sampling sampling{tick, count, filter};

    nb::gil_scoped_release release;
    const double h = tick / static_cast<double>(substeps);
    std::vector<double> free_twist(size, 0.0), rate(size), last(arm.velocity, arm.velocity + size);
    for (const Axis& a : axis)
        if (a.twist >= 0) free_twist[a.twist] = a.error.angle(arm.position[a.motor]);
    for (std::size_t i = 0; i < size; ++i) springs[i].last_twist = arm.position[i] - free_twist[i];

    for (std::size_t k = 0; k < ticks; ++k) {
        for (std::size_t m = 0; m < axes; ++m) {
            Axis& a = axis[m];
            a.controller.read(sampling, arm.position[a.motor], arm.velocity[a.motor], k == 0);
            a.asked = a.controller.torque(torque(k, m), reference(k, m), reference_rate(k, m));
            angle_log(k, m) = a.controller.seen;
            torque_log(k, m) = a.asked;
            if (k == 0) a.held = a.asked;
        }
        for (std::size_t s = 0; s < substeps; ++s) {
            // MuJoCo's Euler step is Störmer's, q+ - 2 q + q- = h² a, with velocities half a step behind: what depends on them is
            // extrapolated by a line, and a torque that jumps now counts as the mean of both sides.
            for (std::size_t i = 0; i < size; ++i) {
                const double newest = arm.velocity[i];
                if (!(std::abs(newest) < too_fast)) return k;
                rate[i] = 1.5 * newest - 0.5 * last[i];
                last[i] = newest;
            }
            for (const Axis& a : axis)
                if (a.twist >= 0) free_twist[a.twist] = a.error.angle(arm.position[a.motor]);
            for (std::size_t i = 0; i < size; ++i)
                arm.force[i] = springs[i].torque(arm.position[i] - free_twist[i], rate[i]);
            for (Axis& a : axis) {
                const double load = a.twist >= 0 ? arm.force[a.twist] : 0.0;
                const double drive = a.torque_gain * (s == 0 ? 0.5 * (a.held + a.asked) : a.asked);
                arm.force[a.motor] += drive - a.friction.torque(rate[a.motor], load, h) -
                                        a.error.slope(arm.position[a.motor]) * load;
            }
            arm.step(arm.model, arm.data);
        }
        for (Axis& a : axis) a.held = a.asked;
    }
    return ticks;
}

}  // namespace
}  // namespace flexcal

void bind_geared_loop(nb::module_& m) {
    m.def("geared_loop", &flexcal::geared_loop, nb::arg("step"), nb::arg("model"), nb::arg("data"),
          nb::arg("angle"), nb::arg("velocity"), nb::arg("applied"),
          nb::arg("hinges"), nb::arg("motors"), nb::arg("twists"), nb::arg("frictions"), nb::arg("errors"),
          nb::arg("gains"), nb::arg("tick"), nb::arg("substeps"), nb::arg("count"), nb::arg("filter"),
          nb::arg("torque"), nb::arg("reference"), nb::arg("reference_rate"), nb::arg("angle_log"),
          nb::arg("torque_log"),
          "Run the hard cell's closed loop on a MuJoCo arm of hinges; returns the ticks done.\n\n"
          "step, model, data: addresses of mj_step, of an mjModel and an mjData; angle, velocity, applied: views of its\n"
          "qpos, qvel and qfrc_applied. hinges (d, 6): stiffness, damping, lost motion, hardening (1/rad²), stiffness and\n"
          "twist limit of the slipping element. Per axis: motors, twists (-1: rigid gear); frictions (m, 7): viscous,\n"
          "Coulomb, Stribeck, its velocity, share of the load, bristle stiffness and damping; errors (m, 9): ratio,\n"
          "amplitudes and phases of harmonics 1, 2 of the joint and of the motor; gains (m, 3): true over believed torque,\n"
          "kp, kd. Signals and logs are (ticks, m). The interpreter lock is released.");
}
