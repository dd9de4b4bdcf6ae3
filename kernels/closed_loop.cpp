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
        if (signals.state) std::copy(plant.position, plant.position + dofs, signals.state + k * dofs);
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

std::size_t closed_loop_binding(std::uintptr_t step, std::uintptr_t model, std::uintptr_t data, nb::handle position_,
                                nb::handle velocity_, nb::handle force_, nb::handle springs_, nb::handle frictions_,
                                nb::handle motors_, nb::handle twists_, nb::handle proportional_,
                                nb::handle derivative_, double tick, std::size_t substeps, double encoder_resolution,
                                double rate_filter, nb::handle feed_forward_, nb::handle reference_,
                                nb::handle reference_rate_, nb::handle position_log_, nb::handle torque_log_,
                                nb::handle arm_log_, nb::handle state_log_) {
    if (!step || !model || !data) throw nb::value_error("step, model and data must be addresses");
    if (substeps == 0 || !(tick > 0.0)) throw nb::value_error("tick and substeps must be positive");
    const auto position = written_reals(position_, {any}, "position");  // of hinges and slides: as many as velocities
    const std::size_t dofs = position.shape(0);
    const auto velocity = written_reals(velocity_, {dofs}, "velocity");
    const auto force = written_reals(force_, {dofs}, "force");
    const auto springs = reals(springs_, {dofs, 6}, "springs");
    const auto motors = indices(motors_, {any}, "motors");
    const std::size_t count = motors.shape(0);
    const auto twists = indices(twists_, {count}, "twists");
    const auto frictions = reals(frictions_, {count, 5}, "frictions");
    const auto proportional = reals(proportional_, {count}, "proportional");
    const auto derivative = reals(derivative_, {count}, "derivative");
    const auto feed_forward = reals(feed_forward_, {any, count}, "feed_forward");
    const std::size_t ticks = feed_forward.shape(0);
    const auto reference = reals(reference_, {ticks, count}, "reference");
    const auto reference_rate = reals(reference_rate_, {ticks, count}, "reference_rate");
    const auto position_log = written_reals(position_log_, {ticks, count}, "position_log");
    const auto torque_log = written_reals(torque_log_, {ticks, count}, "torque_log");
    const auto arm_log = written_reals(arm_log_, {ticks, count}, "arm_log");
    double* state = nullptr;
    if (!state_log_.is_none()) state = written_reals(state_log_, {ticks, dofs}, "state_log").data();

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
            throw nb::value_error("a motor or twist lies outside the plant's coordinates");
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
                              arm_log.data(),
                              state};
    nb::gil_scoped_release release;
    return closed_loop(plant, spring, friction, motor, twist, controllers, sampling, substeps, signals);
}

}  // namespace
}  // namespace flexcal

void bind_closed_loop(nb::module_& m) {
    m.def("closed_loop", &flexcal::closed_loop_binding, nb::arg("step"), nb::arg("model"), nb::arg("data"),
          nb::arg("position"), nb::arg("velocity"), nb::arg("force"),
          nb::arg("springs"), nb::arg("frictions"), nb::arg("motors"), nb::arg("twists"),
          nb::arg("proportional"), nb::arg("derivative"), nb::arg("tick"), nb::arg("substeps"),
          nb::arg("encoder_resolution"), nb::arg("rate_filter"), nb::arg("feed_forward"), nb::arg("reference"),
          nb::arg("reference_rate"), nb::arg("position_log"), nb::arg("torque_log"),
          nb::arg("arm_log"), nb::arg("state_log") = nb::none(),
          "Run the virtual cell's closed loop on a MuJoCo plant; returns the ticks done.\n\n"
          "step, model, data: addresses of mj_step, of an mjModel and an mjData; position, velocity, force: views of\n"
          "its qpos, qvel and qfrc_applied. springs (dofs, 6): stiffness, damping, half gap, cubic, hysteresis torque\n"
          "and width; frictions (motors, 5): viscous, coulomb, its velocity, stribeck, its velocity. Signals and logs\n"
          "are (ticks, motors); state_log (ticks, dofs), where it is given, gets all positions at the ticks. The\n"
          "interpreter lock is released.");
}
