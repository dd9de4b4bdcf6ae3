// Python's view of the runtime: what C++ programs take from it, for batches.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "arrays.hpp"
#include "bindings.hpp"
#include "flexcal/runtime.hpp"

namespace nb = nanobind;
using namespace flexcal;
using runtime::Pose;
using runtime::Solver;
using runtime::Status;

namespace {

struct Robot {
    std::shared_ptr<const runtime::Model> model;
};

Robot read_robot(const std::string& text) {
    std::string error;
    auto model = runtime::read_model(text, error);
    if (!model) throw nb::value_error(error.c_str());
    return {std::move(model)};
}

// What a batch of calls writes beside its own result: the status of each, and the joint that it is about.
struct Outcome {
    Buffer status, joint;

    explicit Outcome(std::size_t samples) : status({samples}), joint({samples}) {}
    void note(std::size_t s, Status result, int about) {
        status.data[s] = static_cast<double>(static_cast<int>(result));
        joint.data[s] = about;
    }
};

Status with_payload(Solver& solver, double mass) { return std::isnan(mass) ? Status::ok : solver.set_payload(mass); }

void copy(const Pose& pose, std::size_t s, Buffer& position, Buffer& rotation) {
    std::copy(pose.position, pose.position + 3, position.data.get() + 3 * s);
    std::copy(pose.rotation, pose.rotation + 9, rotation.data.get() + 9 * s);
}

nb::tuple forward(const Robot& robot, nb::handle q_, int point, nb::handle payload_, nb::handle flank_) {
    const std::size_t n = robot.model->joints.size();
    const auto q = reals(q_, {any, n}, "q");
    const std::size_t samples = q.shape(0);
    const auto payload = reals(payload_, {samples}, "payload");
    const auto flank = reals(flank_, {any, n}, "flank");
    if (flank.shape(0) != 0 && flank.shape(0) != samples) throw nb::value_error("flank must have a row for each of q, or none");
    Buffer position({samples, 3}), rotation({samples, 3, 3}), status({samples});
    {
        nb::gil_scoped_release release;
        Solver solver(*robot.model);
        for (std::size_t s = 0; s < samples; ++s) {
            Pose pose{};
            Status result = with_payload(solver, payload.data()[s]);
            if (result == Status::ok) result = solver.forward(q.data() + n * s, point, pose, flank.shape(0) ? flank.data() + n * s : nullptr);
            if (result != Status::ok) for (double& value : pose.position) value = std::numeric_limits<double>::quiet_NaN();
            copy(pose, s, position, rotation);
            status.data[s] = static_cast<double>(static_cast<int>(result));
        }
    }
    return nb::make_tuple(position.release(), rotation.release(), status.release());
}

nb::tuple nominal(const Robot& robot, nb::handle q_, int point) {
    const std::size_t n = robot.model->joints.size();
    const auto q = reals(q_, {any, n}, "q");
    const std::size_t samples = q.shape(0);
    Buffer position({samples, 3}), rotation({samples, 3, 3});
    Solver solver(*robot.model);
    for (std::size_t s = 0; s < samples; ++s) {
        Pose pose{};
        const Status result = solver.nominal(q.data() + n * s, point, pose);
        if (result != Status::ok) throw nb::value_error(runtime::describe(result));
        copy(pose, s, position, rotation);
    }
    return nb::make_tuple(position.release(), rotation.release());
}

Result beyond(const Robot& robot, nb::handle q_, int point) {
    const std::size_t n = robot.model->joints.size();
    const auto q = reals(q_, {any, n}, "q");
    Buffer outside({q.shape(0)});
    for (std::size_t s = 0; s < q.shape(0); ++s) outside.data[s] = robot.model->beyond(q.data() + n * s, point);
    return outside.release();
}

// Commands (samples, n), NaN where there is none, with `call` for each.
template <class Call>
nb::tuple commands(const Robot& robot, std::size_t samples, const Contiguous<const double, 1>& payload, Call call) {
    const std::size_t n = robot.model->joints.size();
    Buffer command({samples, n});
    Outcome outcome(samples);
    {
        nb::gil_scoped_release release;
        Solver solver(*robot.model);
        std::fill_n(command.data.get(), samples * n, std::numeric_limits<double>::quiet_NaN());
        for (std::size_t s = 0; s < samples; ++s) {
            Status result = with_payload(solver, payload.data()[s]);
            if (result == Status::ok) result = call(solver, s, command.data.get() + n * s);
            outcome.note(s, result, solver.joint());
        }
    }
    return nb::make_tuple(command.release(), outcome.status.release(), outcome.joint.release());
}

nb::tuple compensate(const Robot& robot, nb::handle q_, int point, nb::handle payload_) {
    const std::size_t n = robot.model->joints.size();
    const auto q = reals(q_, {any, n}, "q");
    const auto payload = reals(payload_, {q.shape(0)}, "payload");
    return commands(robot, q.shape(0), payload,
                    [&](Solver& solver, std::size_t s, double* command) { return solver.compensate(q.data() + n * s, point, command); });
}

nb::tuple inverse(const Robot& robot, nb::handle position_, nb::handle rotation_, nb::handle near_, int point, nb::handle payload_) {
    const std::size_t n = robot.model->joints.size();
    const auto near = reals(near_, {any, n}, "near");
    const std::size_t samples = near.shape(0);
    const auto position = reals(position_, {samples, 3}, "position");
    const auto rotation = reals(rotation_, {samples, 3, 3}, "rotation");
    const auto payload = reals(payload_, {samples}, "payload");
    return commands(robot, samples, payload, [&](Solver& solver, std::size_t s, double* command) {
        Pose pose{};
        std::copy_n(position.data() + 3 * s, 3, pose.position);
        std::copy_n(rotation.data() + 9 * s, 9, pose.rotation);
        return solver.inverse(pose, near.data() + n * s, point, command);
    });
}

nb::tuple torque(const Robot& robot, nb::handle q_, nb::handle dq_, nb::handle ddq_, nb::handle payload_, bool elastic) {
    const std::size_t n = robot.model->joints.size();
    const auto q = reals(q_, {any, n}, "q");
    const std::size_t samples = q.shape(0);
    const auto dq = reals(dq_, {samples, n}, "dq"), ddq = reals(ddq_, {samples, n}, "ddq");
    const auto payload = reals(payload_, {samples}, "payload");
    return commands(robot, samples, payload, [&](Solver& solver, std::size_t s, double* result) {
        return solver.torque(q.data() + n * s, dq.data() + n * s, ddq.data() + n * s, result, elastic);
    });
}

}  // namespace

void bind_runtime(nb::module_& m) {
    nb::class_<Robot>(m, "RuntimeRobot", "A robot of `flexcal export runtime`, as C++ programs have it; arrays are C-contiguous float64.")
        .def_static("read", &read_robot, nb::arg("text"))
        .def_static("describe", [](int status) { return std::string(runtime::describe(static_cast<Status>(status))); }, nb::arg("status"))
        .def_prop_ro("joint_names",
                     [](const Robot& robot) {
                         std::vector<std::string> names;
                         for (const auto& joint : robot.model->joints) names.push_back(joint.name);
                         return names;
                     })
        .def_prop_ro("point_names",
                     [](const Robot& robot) {
                         std::vector<std::string> names;
                         for (const auto& point : robot.model->points) names.push_back(point.name);
                         return names;
                     })
        .def("forward", &forward, nb::arg("q"), nb::arg("point"), nb::arg("payload"), nb::arg("flank"),
             "Position (samples, 3), rotation (samples, 3, 3) and status (samples,) of a point at q (samples, n), carrying payload (samples,) kg, "
             "NaN being the declared one, on the flanks (samples, n), or those of gravity for (0, n).")
        .def("nominal", &nominal, nb::arg("q"), nb::arg("point"), "Position (samples, 3) and rotation (samples, 3, 3) of the nominal robot.")
        .def("beyond", &beyond, nb::arg("q"), nb::arg("point"),
             "1 where q (samples, n) lies outside the joint ranges within which the calibration holds at the point, else 0 (samples,).")
        .def("compensate", &compensate, nb::arg("q"), nb::arg("point"), nb::arg("payload"),
             "Commands (samples, n) with which the tool stands where the nominal one would at q (samples, n), status (samples,) and the joint that "
             "it is about (samples,), -1 for none.")
        .def("inverse", &inverse, nb::arg("position"), nb::arg("rotation"), nb::arg("near"), nb::arg("point"), nb::arg("payload"),
             "The same for poses, from motor positions near (samples, n).")
        .def("torque", &torque, nb::arg("q"), nb::arg("dq"), nb::arg("ddq"), nb::arg("payload"), nb::arg("elastic") = false,
             "Torques (samples, n) of the motors for a motion, status and joint as of compensate.");
}
