// Python's view of the kinematic tree: batches of poses in, arrays out.
#include <nanobind/nanobind.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "equilibrium.hpp"
#include "kinematics.hpp"
#include "regressor_adjoint.hpp"

namespace nb = nanobind;
using namespace flexcal;

namespace {

Tree make_tree(const std::vector<int>& parents, const std::vector<bool>& prismatic, nb::handle placements_, nb::handle translations_,
               nb::handle normals_, nb::handle bearings_, bool tilts_first) {
    const std::size_t n = parents.size();
    if (prismatic.size() != n) throw nb::value_error("prismatic must have one value per joint");
    const auto placements = reals(placements_, {n, 3, 3}, "placements");
    const auto translations = reals(translations_, {n, 3}, "translations");
    const auto normals = reals(normals_, {n, 2, 3}, "normals");
    const auto bearings = reals(bearings_, {n, 3, 3}, "bearings");
    Tree tree;
    tree.tilts_first = tilts_first;
    for (std::size_t i = 0; i < n; ++i) {
        if (parents[i] < -1 || parents[i] >= static_cast<int>(i)) throw nb::value_error("a parent must be -1 or come before its child");
        tree.joints.push_back({parents[i], prismatic[i], rotation(placements.data() + 9 * i), vector3(translations.data() + 3 * i),
                               vector3(normals.data() + 6 * i), vector3(normals.data() + 6 * i + 3), rotation(bearings.data() + 9 * i)});
    }
    return tree;
}

nb::tuple point(const Tree& tree, int joint, nb::handle placement_, nb::handle translation_, nb::handle target_, nb::handle geometry_,
                nb::handle tool_, nb::handle q_, nb::handle deflection_, bool jacobians, bool parameters) {
    const std::size_t n = tree.size();
    if (joint < 0 || joint >= static_cast<int>(n)) throw nb::value_error("the point's joint is out of range");
    const auto placement = reals(placement_, {3, 3}, "placement");
    const auto translation = reals(translation_, {3}, "translation");
    const auto target = reals(target_, {3}, "target");
    const auto geometry = reals(geometry_, {n, 6}, "geometry");
    const auto tool = reals(tool_, {6}, "tool");
    const auto q = reals(q_, {any, n}, "q");
    const std::size_t samples = q.shape(0);
    const auto deflection = reals(deflection_, {samples, n, 3}, "deflection");
    Buffer position({samples, 3}), orientation({samples, 3, 3});
    const bool geometric = jacobians && parameters;
    Buffer by_geometry({geometric ? samples : 0, 6, 6 * (n + 1)}), by_motion({jacobians ? samples : 0, 6, 3 * n});
    const Target hung{joint, rotation(placement.data()), vector3(translation.data()), vector3(target.data())};
    {
        nb::gil_scoped_release release;
        point_kinematics(tree, hung, geometry.data(), tool.data(), q.data(), deflection.data(), static_cast<std::ptrdiff_t>(samples),
                         {position.data.get(), orientation.data.get(), geometric ? by_geometry.data.get() : nullptr,
                          jacobians ? by_motion.data.get() : nullptr});
    }
    return nb::make_tuple(position.release(), orientation.release(), by_geometry.release(), by_motion.release());
}

// What the arm carries and the axes that it loads.
struct Loaded {
    Contiguous<const double, 2> geometry, first_moment, q;
    Contiguous<const double, 1> mass, payload, payload_point, gravity;
    std::vector<ElasticAxis> axes;
    std::size_t samples;
    Masses masses;

    Loaded(const Tree& tree, const std::vector<std::pair<int, int>>& axes_, nb::handle geometry_, nb::handle mass_, nb::handle first_moment_,
           nb::handle payload_, int payload_joint, nb::handle payload_point_, nb::handle gravity_, nb::handle q_) {
        const std::size_t n = tree.size();
        geometry = reals(geometry_, {n, 6}, "geometry");
        mass = reals(mass_, {n}, "mass");
        first_moment = reals(first_moment_, {n, 3}, "first_moment");
        payload_point = reals(payload_point_, {3}, "payload_point");
        gravity = reals(gravity_, {3}, "gravity");
        q = reals(q_, {any, n}, "q");
        samples = q.shape(0);
        payload = reals(payload_, {samples}, "payload");
        if (payload_joint < -1 || payload_joint >= static_cast<int>(n)) throw nb::value_error("the payload's joint is out of range");
        for (auto [joint, component] : axes_) {
            if (joint < 0 || joint >= static_cast<int>(n) || component < 0 || component > 2) throw nb::value_error("no such elastic axis");
            axes.push_back({joint, component});
        }
        masses = {mass.data(), first_moment.data(), payload.data(), payload_joint, vector3(payload_point.data())};
    }
};

nb::tuple equilibrium(const Tree& tree, const std::vector<std::pair<int, int>>& axes, nb::handle stiffness_, nb::handle geometry, nb::handle mass,
                      nb::handle first_moment, nb::handle payload, int payload_joint, nb::handle payload_point, nb::handle gravity, nb::handle q,
                      bool sensitivities, bool parameters) {
    const std::size_t n = tree.size(), d = axes.size();
    const Loaded arm(tree, axes, geometry, mass, first_moment, payload, payload_joint, payload_point, gravity, q);
    const auto stiffness = reals(stiffness_, {d}, "stiffness");
    const std::size_t samples = arm.samples;
    const std::size_t derived = sensitivities ? samples : 0, parametric = sensitivities && parameters ? samples : 0;
    Buffer deflection({samples, n, 3}), compliance({derived, d, d}), by_offset({derived, d, n}), regressor({parametric, d, 4 * n}),
        coupling({parametric, d, 6 * n});
    double residual = 0;
    {
        nb::gil_scoped_release release;
        const auto wanted = [](const Buffer& buffer) { return buffer.shape[0] ? buffer.data.get() : nullptr; };
        residual = static_equilibrium(tree, arm.axes, stiffness.data(), arm.geometry.data(), arm.masses, vector3(arm.gravity.data()),
                                      arm.q.data(), static_cast<std::ptrdiff_t>(samples),
                                      {deflection.data.get(), wanted(compliance), wanted(by_offset), wanted(regressor), wanted(coupling)});
    }
    return nb::make_tuple(deflection.release(), compliance.release(), by_offset.release(), regressor.release(), coupling.release(), residual);
}

nb::tuple loads(const Tree& tree, const std::vector<std::pair<int, int>>& axes, nb::handle geometry, nb::handle mass, nb::handle first_moment,
                nb::handle payload, int payload_joint, nb::handle payload_point, nb::handle gravity, nb::handle q, nb::handle deflection_) {
    const std::size_t n = tree.size(), d = axes.size();
    const Loaded arm(tree, axes, geometry, mass, first_moment, payload, payload_joint, payload_point, gravity, q);
    const std::size_t samples = arm.samples;
    const auto deflection = reals(deflection_, {samples, n, 3}, "deflection");
    Buffer load({samples, d}), stiffness({samples, d, d}), regressor({samples, d, 4 * n}), coupling({samples, d, 6 * n});
    {
        nb::gil_scoped_release release;
        gravity_loads(tree, arm.axes, arm.geometry.data(), arm.masses, vector3(arm.gravity.data()), arm.q.data(), deflection.data(),
                      static_cast<std::ptrdiff_t>(samples), {load.data.get(), stiffness.data.get(), regressor.data.get(), coupling.data.get()});
    }
    return nb::make_tuple(load.release(), stiffness.release(), regressor.release(), coupling.release());
}

// What both directions of the torque regressor take.
struct States {
    Contiguous<const double, 1> gravity;
    Contiguous<const double, 2> geometry, q, dq, ddq;
    Contiguous<const std::int64_t, 2> places;
    std::size_t samples;

    States(const Tree& tree, nb::handle geometry_, nb::handle gravity_, nb::handle q_, nb::handle dq_, nb::handle ddq_, nb::handle places_) {
        const std::size_t n = tree.size();
        geometry = reals(geometry_, {n, 6}, "geometry");
        gravity = reals(gravity_, {3}, "gravity");
        q = reals(q_, {any, n}, "q");
        samples = q.shape(0);
        dq = reals(dq_, {samples, n}, "dq");
        ddq = reals(ddq_, {samples, n}, "ddq");
        places = indices(places_, {n, inertial_size * n}, "places");
    }
    // rows: of the array that places point into, (rows, samples)
    void expect_places_below(std::size_t rows) const {
        for (std::size_t i = 0; i < places.size(); ++i)
            if (places.data()[i] >= static_cast<std::int64_t>(rows)) throw nb::value_error("a place is beyond the rows");
    }
};

void torques(const Tree& tree, nb::handle geometry, nb::handle gravity, nb::handle q, nb::handle dq, nb::handle ddq, nb::handle places,
             nb::handle out_) {
    const States at(tree, geometry, gravity, q, dq, ddq, places);
    const auto out = written_reals(out_, {any, at.samples}, "out");
    at.expect_places_below(out.shape(0));
    nb::gil_scoped_release release;
    torque_regressor(tree, at.geometry.data(), vector3(at.gravity.data()), at.q.data(), at.dq.data(), at.ddq.data(), at.places.data(),
                     static_cast<std::ptrdiff_t>(at.samples), out.data());
}

Result torques_adjoint(const Tree& tree, nb::handle geometry, nb::handle gravity, nb::handle q, nb::handle dq, nb::handle ddq,
                       nb::handle places, nb::handle weights_) {
    const States at(tree, geometry, gravity, q, dq, ddq, places);
    const auto weights = reals(weights_, {any, at.samples}, "weights");
    at.expect_places_below(weights.shape(0));
    Buffer out({3, at.samples, static_cast<std::size_t>(tree.size())});
    {
        nb::gil_scoped_release release;
        torque_regressor_adjoint(tree, at.geometry.data(), vector3(at.gravity.data()), at.q.data(), at.dq.data(), at.ddq.data(),
                                 at.places.data(), weights.data(), static_cast<std::ptrdiff_t>(at.samples), out.data.get());
    }
    return out.release();
}

}  // namespace

void bind_tree(nb::module_& m) {
    nb::class_<Tree>(m, "Tree", "A kinematic tree with geometric errors, twists and bearing tilts; arrays are C-contiguous float64.")
        .def_static("build", &make_tree, nb::arg("parents"), nb::arg("prismatic"), nb::arg("placements"), nb::arg("translations"),
                    nb::arg("normals"), nb::arg("bearings"), nb::arg("tilts_first") = false)
        .def("point", &point, nb::arg("joint"), nb::arg("placement"), nb::arg("translation"), nb::arg("target"), nb::arg("geometry"),
             nb::arg("tool"), nb::arg("q"), nb::arg("deflection"), nb::arg("jacobians"),
             nb::arg("parameters") = true,
             "Position (samples, 3), orientation (samples, 3, 3), Jacobians by geometry (samples, 6, 6 n + 6), of `parameters` only, and motion "
             "(samples, 6, 3 n).")
        .def("equilibrium", &equilibrium, nb::arg("axes"), nb::arg("stiffness"), nb::arg("geometry"), nb::arg("mass"), nb::arg("first_moment"),
             nb::arg("payload"), nb::arg("payload_joint"), nb::arg("payload_point"), nb::arg("gravity"), nb::arg("q"), nb::arg("sensitivities"),
             nb::arg("parameters") = true,
             "Deflection (samples, n, 3), compliance (samples, d, d), coupling of gravity's load with joint offsets (samples, d, n) and, of "
             "`parameters` only, its regressor (samples, d, 4 n) and coupling with all geometry (samples, d, 6 n); largest last Newton step (rad).")
        .def("gravity_loads", &loads, nb::arg("axes"), nb::arg("geometry"), nb::arg("mass"), nb::arg("first_moment"), nb::arg("payload"),
             nb::arg("payload_joint"), nb::arg("payload_point"), nb::arg("gravity"), nb::arg("q"), nb::arg("deflection"),
             "Gravity's load on the axes (samples, d), the stiffness by which it changes (samples, d, d), and the regressor and coupling of "
             "equilibrium, where the arm stands.")
        .def("torque_regressor", &torques, nb::arg("geometry"), nb::arg("gravity"), nb::arg("q"), nb::arg("dq"), nb::arg("ddq"),
             nb::arg("places"), nb::arg("out"),
             "Joint torques by mass, first moment and inertia of every link, into the rows of out (·, samples) that places (n, 10 n) names; "
             "-1 leaves an entry out, and those that are zero by structure are not written.")
        .def("torque_regressor_adjoint", &torques_adjoint, nb::arg("geometry"), nb::arg("gravity"), nb::arg("q"), nb::arg("dq"), nb::arg("ddq"),
             nb::arg("places"), nb::arg("weights"),
             "Derivatives (3, samples, n) by q, dq and ddq of a scalar whose derivatives by the entries of the torque regressor are the rows "
             "of weights (·, samples) that places (n, 10 n) names; -1 stands for zeros, and entries that are zero by structure are not read.");
}
