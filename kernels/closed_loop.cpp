#include "closed_loop.hpp"

#include <algorithm>
#include <cmath>

#include "arrays.hpp"
#include "bindings.hpp"

namespace nb = nanobind;

namespace flexcal {

constexpr double runaway = 1e3;  // rad/s or m/s: no robot moves like this

double Spring::force(double twist, double rate) {
    double torque = 0.0;
    if (half_gap == 0.0 || std::abs(twist) > half_gap) {  // in the gap nothing touches
        const double stretch = twist - std::copysign(half_gap, twist);
        torque -= stiffness * stretch * (1.0 + cubic * stretch * stretch) + damping * rate;
    }
    if (hysteresis != 0.0) {  // Dahl: d slip / d twist = (1 - slip sign(d twist)) / width
        const double moved = (twist - last) / hysteresis_width;
        slip = std::clamp(slip + moved - slip * std::abs(moved), -1.0, 1.0);
        last = twist;
        torque -= hysteresis * slip;
    }
    return torque;
}

double Friction::torque(double rate) const {
    double level = coulomb;
    if (stribeck != 0.0) level += stribeck * std::exp(-(rate / stribeck_velocity) * (rate / stribeck_velocity));
    return viscous * rate + (level != 0.0 ? level * std::tanh(rate / coulomb_velocity) : 0.0);
}

std::size_t closed_loop(const SteppedPlant& plant, std::vector<Spring>& springs,
                        const std::vector<Friction>& frictions, const std::vector<std::size_t>& motors,
                        const std::vector<std::ptrdiff_t>& twists, std::vector<MotorController>& controllers,
                        const Sampling& sampling, std::size_t substeps, const LoopSignals& signals) {
    const std::size_t dofs = plant.dofs;
    const std::size_t count = motors.size();
    const double step = sampling.tick / static_cast<double>(substeps);
    std::vector<double> before(plant.velocity, plant.velocity + dofs), earlier(before), rate(dofs);
    std::vector<double> torque(count), held(count);
    for (std::size_t i = 0; i < dofs; ++i) springs[i].last = plant.position[i];

    for (std::size_t k = 0; k < signals.ticks; ++k) {
        const std::size_t row = k * count;
        for (std::size_t m = 0; m < count; ++m) {
            MotorController& controller = controllers[m];
            const double position = plant.position[motors[m]];
            controller.read(sampling, position, plant.velocity[motors[m]], k == 0);
            torque[m] = controller.torque(signals.feed_forward[row + m], signals.reference[row + m],
                                          signals.reference_rate[row + m]);
            signals.position[row + m] = controller.seen;
            signals.torque[row + m] = torque[m];
            if (signals.arm) {
                signals.arm[row + m] = position + (twists[m] >= 0 ? plant.position[twists[m]] : 0.0);
            }
        }
        if (k == 0) held = torque;
        for (std::size_t s = 0; s < substeps; ++s) {
            // MuJoCo's Euler step is a kick and a drift, M (q+ - 2 q + q-)/h² = force, and its velocity lies half a
            // step back. What belongs on the right is the force averaged over (-h, h) with triangular weights: the held
            // torque's at its jump is the mean of both sides, a spring's is that at q + h² q''/12 (Numerov) with q''
            // extrapolated, a damper's the mean of the velocities before and after, that too extrapolated (Adams).
            for (std::size_t i = 0; i < dofs; ++i) {
                const double velocity = plant.velocity[i];
                if (!(std::abs(velocity) < runaway)) return k;
                rate[i] = (23.0 * velocity - 16.0 * before[i] + 5.0 * earlier[i]) / 12.0;
                const double bend = step / 12.0 * (2.0 * velocity - 3.0 * before[i] + earlier[i]);
                plant.force[i] = springs[i].force(plant.position[i] + bend, rate[i]);
                earlier[i] = before[i];
                before[i] = velocity;
            }
            for (std::size_t m = 0; m < count; ++m) {
                const double drive = s == 0 ? 0.5 * (held[m] + torque[m]) : torque[m];
                plant.force[motors[m]] += drive - frictions[m].torque(rate[motors[m]]);
            }
            plant.step(plant.model, plant.data);
        }
        held = torque;
    }
    return signals.ticks;
}

namespace {

std::size_t closed_loop_binding(std::uintptr_t step, std::uintptr_t model, std::uintptr_t data, State position,
                                State velocity, State force, Table springs, Table frictions, Indices motors,
                                Indices twists, Vector proportional, Vector derivative, double tick,
                                std::size_t substeps, double encoder_resolution, double rate_filter,
                                Table feed_forward, Table reference, Table reference_rate, Log position_log,
                                Log torque_log, Log arm_log) {
    const std::size_t dofs = position.shape(0), count = motors.shape(0), ticks = feed_forward.shape(0);
    if (velocity.shape(0) != dofs || force.shape(0) != dofs)
        throw std::invalid_argument("every coordinate of the plant must be a hinge or a slide");
    if (twists.shape(0) != count || proportional.shape(0) != count || derivative.shape(0) != count)
        throw std::invalid_argument("one twist, one kp and one kd are needed per motor");
    if (substeps == 0 || !(tick > 0.0)) throw std::invalid_argument("tick and substeps must be positive");
    require_shape(springs, dofs, 6, "springs");
    require_shape(frictions, count, 5, "frictions");
    for (const Table* table : {&feed_forward, &reference, &reference_rate})
        require_shape(*table, ticks, count, "a signal");
    for (const Log* log : {&position_log, &torque_log, &arm_log}) require_shape(*log, ticks, count, "a log");

    std::vector<Spring> spring(dofs);
    for (std::size_t i = 0; i < dofs; ++i)
        spring[i] = {springs(i, 0), springs(i, 1), springs(i, 2), springs(i, 3), springs(i, 4), springs(i, 5)};
    std::vector<Friction> friction(count);
    std::vector<std::size_t> motor(count);
    std::vector<std::ptrdiff_t> twist(count);
    std::vector<MotorController> controllers(count);
    for (std::size_t m = 0; m < count; ++m) {
        friction[m] = {frictions(m, 0), frictions(m, 1), frictions(m, 2), frictions(m, 3), frictions(m, 4)};
        if (motors(m) < 0 || motors(m) >= static_cast<std::int64_t>(dofs) ||
            twists(m) >= static_cast<std::int64_t>(dofs))
            throw std::invalid_argument("a motor or twist lies outside the plant's coordinates");
        motor[m] = static_cast<std::size_t>(motors(m));
        twist[m] = static_cast<std::ptrdiff_t>(twists(m));
        controllers[m] = {proportional(m), derivative(m)};
    }
    const SteppedPlant plant =
        SteppedPlant::at(step, model, data, position.data(), velocity.data(), force.data(), dofs);
    const Sampling sampling{tick, encoder_resolution, rate_filter};
    const LoopSignals signals{ticks,
                              feed_forward.data(),
                              reference.data(),
                              reference_rate.data(),
                              position_log.data(),
                              torque_log.data(),
                              arm_log.data()};
    nb::gil_scoped_release release;
    return closed_loop(plant, spring, friction, motor, twist, controllers, sampling, substeps, signals);
}

}  // namespace
}  // namespace flexcal

void bind_closed_loop(nb::module_& m) {
    m.def("closed_loop", &flexcal::closed_loop_binding, nb::arg("step"), nb::arg("model"), nb::arg("data"),
          nb::arg("position").noconvert(), nb::arg("velocity").noconvert(), nb::arg("force").noconvert(),
          nb::arg("springs"), nb::arg("frictions"), nb::arg("motors"), nb::arg("twists"),
          nb::arg("proportional"), nb::arg("derivative"), nb::arg("tick"), nb::arg("substeps"),
          nb::arg("encoder_resolution"), nb::arg("rate_filter"), nb::arg("feed_forward"), nb::arg("reference"),
          nb::arg("reference_rate"), nb::arg("position_log").noconvert(), nb::arg("torque_log").noconvert(),
          nb::arg("arm_log").noconvert(),
          "Run the virtual cell's closed loop on a MuJoCo plant; returns the ticks done.\n\n"
          "step, model, data: addresses of mj_step, of an mjModel and an mjData; position, velocity, force: views of\n"
          "its qpos, qvel and qfrc_applied. springs (dofs, 6): stiffness, damping, half gap, cubic, hysteresis torque\n"
          "and width; frictions (motors, 5): viscous, coulomb, its velocity, stribeck, its velocity. Signals and logs\n"
          "are (ticks, motors). The interpreter lock is released.");
}
