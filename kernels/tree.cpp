// Python's view of the kinematic tree: batches of poses in, arrays out.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "bindings.hpp"
#include "equilibrium.hpp"
#include "kinematics.hpp"
#include "regressor_adjoint.hpp"

namespace nb = nanobind;
using namespace flexcal;

namespace {

using Array = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Places = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using ReadRows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Result = nb::ndarray<nb::numpy, double>;

void expect(const Array& array, std::initializer_list<std::size_t> shape, const char* name) {
    bool same = array.ndim() == shape.size();
    std::size_t k = 0;
    for (std::size_t extent : shape) same = same && array.shape(k++) == extent;
    if (!same) throw nb::value_error(name);
}

struct Buffer {
    std::unique_ptr<double[]> data;
    std::vector<std::size_t> shape;

    explicit Buffer(std::vector<std::size_t> extents) : shape(std::move(extents)) {
        std::size_t size = 1;
        for (std::size_t e : shape) size *= e;
        data = std::make_unique<double[]>(size);
    }
    Result release() {
        double* p = data.release();
        nb::capsule owner(p, [](void* q) noexcept { delete[] static_cast<double*>(q); });
        return Result(p, shape.size(), shape.data(), owner);
    }
};

Tree make_tree(const std::vector<int>& parents, const std::vector<bool>& prismatic, Array placements, Array translations, Array normals,
               Array bearings, bool tilts_first) {
    const std::size_t n = parents.size();
    expect(placements, {n, 3, 3}, "placements must be (n, 3, 3)");
    expect(translations, {n, 3}, "translations must be (n, 3)");
    expect(normals, {n, 2, 3}, "normals must be (n, 2, 3)");
    expect(bearings, {n, 3, 3}, "bearings must be (n, 3, 3)");
    Tree tree;
    tree.tilts_first = tilts_first;
    for (std::size_t i = 0; i < n; ++i) {
        if (parents[i] >= static_cast<int>(i)) throw nb::value_error("a parent must come before its child");
        tree.joints.push_back({parents[i], prismatic[i], rotation(placements.data() + 9 * i), vector3(translations.data() + 3 * i),
                               vector3(normals.data() + 6 * i), vector3(normals.data() + 6 * i + 3), rotation(bearings.data() + 9 * i)});
    }
    return tree;
}

nb::tuple point(const Tree& tree, int joint, Array placement, Array translation, Array target, Array geometry, Array tool, Array q,
                Array deflection, bool jacobians) {
    const std::size_t n = tree.size(), samples = q.shape(0);
    if (joint < 0 || joint >= static_cast<int>(n)) throw nb::value_error("the point's joint is out of range");
    expect(placement, {3, 3}, "placement must be (3, 3)");
    expect(translation, {3}, "translation must be (3,)");
    expect(target, {3}, "target must be (3,)");
    expect(geometry, {n, 6}, "geometry must be (n, 6)");
    expect(tool, {6}, "tool must be (6,)");
    expect(q, {samples, n}, "q must be (samples, n)");
    expect(deflection, {samples, n, 3}, "deflection must be (samples, n, 3)");
    Buffer position({samples, 3}), orientation({samples, 3, 3});
    Buffer by_geometry({jacobians ? samples : 0, 6, 6 * (n + 1)}), by_motion({jacobians ? samples : 0, 6, 3 * n});
    const Target hung{joint, rotation(placement.data()), vector3(translation.data()), vector3(target.data())};
    {
        nb::gil_scoped_release release;
        point_kinematics(tree, hung, geometry.data(), tool.data(), q.data(), deflection.data(), static_cast<std::ptrdiff_t>(samples),
                         {position.data.get(), orientation.data.get(), jacobians ? by_geometry.data.get() : nullptr,
                          jacobians ? by_motion.data.get() : nullptr});
    }
    return nb::make_tuple(position.release(), orientation.release(), by_geometry.release(), by_motion.release());
}

nb::tuple equilibrium(const Tree& tree, const std::vector<std::pair<int, int>>& axes, Array stiffness, Array geometry, Array mass,
                      Array first_moment, Array payload, int payload_joint, Array payload_point, Array gravity, Array q, bool sensitivities) {
    const std::size_t n = tree.size(), samples = q.shape(0), d = axes.size();
    expect(stiffness, {d}, "stiffness must have one value per elastic axis");
    expect(geometry, {n, 6}, "geometry must be (n, 6)");
    expect(mass, {n}, "mass must be (n,)");
    expect(first_moment, {n, 3}, "first_moment must be (n, 3)");
    expect(payload, {samples}, "payload must be (samples,)");
    expect(payload_point, {3}, "payload_point must be (3,)");
    expect(gravity, {3}, "gravity must be (3,)");
    expect(q, {samples, n}, "q must be (samples, n)");
    std::vector<ElasticAxis> elastic;
    for (auto [joint, component] : axes) {
        if (joint < 0 || joint >= static_cast<int>(n) || component < 0 || component > 2) throw nb::value_error("no such elastic axis");
        elastic.push_back({joint, component});
    }
    Buffer deflection({samples, n, 3}), compliance({sensitivities ? samples : 0, d, d}), regressor({sensitivities ? samples : 0, d, 4 * n}),
        coupling({sensitivities ? samples : 0, d, 6 * n});
    const Masses masses{mass.data(), first_moment.data(), payload.data(), payload_joint, vector3(payload_point.data())};
    double residual = 0;
    {
        nb::gil_scoped_release release;
        residual = static_equilibrium(tree, elastic, stiffness.data(), geometry.data(), masses, vector3(gravity.data()), q.data(),
                                      static_cast<std::ptrdiff_t>(samples),
                                      {deflection.data.get(), sensitivities ? compliance.data.get() : nullptr,
                                       sensitivities ? regressor.data.get() : nullptr, sensitivities ? coupling.data.get() : nullptr});
    }
    return nb::make_tuple(deflection.release(), compliance.release(), regressor.release(), coupling.release(), residual);
}

// rows: of the array that places point into, (rows, samples).
void expect_motion(const Tree& tree, const Array& geometry, const Array& gravity, const Array& q, const Array& dq, const Array& ddq,
                   const Places& places, std::size_t rows) {
    const std::size_t n = tree.size(), samples = q.shape(0);
    expect(geometry, {n, 6}, "geometry must be (n, 6)");
    expect(gravity, {3}, "gravity must be (3,)");
    expect(q, {samples, n}, "q must be (samples, n)");
    expect(dq, {samples, n}, "dq must be (samples, n)");
    expect(ddq, {samples, n}, "ddq must be (samples, n)");
    if (places.shape(0) != n || places.shape(1) != inertial_size * n) throw nb::value_error("places must be (n, 10 n)");
    for (std::size_t i = 0; i < places.size(); ++i)
        if (places.data()[i] >= static_cast<std::int64_t>(rows)) throw nb::value_error("a place is beyond the rows");
}

void torques(const Tree& tree, Array geometry, Array gravity, Array q, Array dq, Array ddq, Places places, Rows out) {
    const std::size_t samples = q.shape(0);
    expect_motion(tree, geometry, gravity, q, dq, ddq, places, out.shape(0));
    if (out.shape(1) != samples) throw nb::value_error("out must be (rows, samples)");
    nb::gil_scoped_release release;
    torque_regressor(tree, geometry.data(), vector3(gravity.data()), q.data(), dq.data(), ddq.data(), places.data(),
                     static_cast<std::ptrdiff_t>(samples), out.data());
}

Result torques_adjoint(const Tree& tree, Array geometry, Array gravity, Array q, Array dq, Array ddq, Places places, ReadRows weights) {
    const std::size_t n = tree.size(), samples = q.shape(0);
    expect_motion(tree, geometry, gravity, q, dq, ddq, places, weights.shape(0));
    if (weights.shape(1) != samples) throw nb::value_error("weights must be (rows, samples)");
    Buffer out({3, samples, n});
    {
        nb::gil_scoped_release release;
        torque_regressor_adjoint(tree, geometry.data(), vector3(gravity.data()), q.data(), dq.data(), ddq.data(), places.data(),
                                 weights.data(), static_cast<std::ptrdiff_t>(samples), out.data.get());
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
             "Position (samples, 3), orientation (samples, 3, 3), Jacobians by geometry (samples, 6, 6 n + 6) and motion (samples, 6, 3 n).")
        .def("equilibrium", &equilibrium, nb::arg("axes"), nb::arg("stiffness"), nb::arg("geometry"), nb::arg("mass"), nb::arg("first_moment"),
             nb::arg("payload"), nb::arg("payload_joint"), nb::arg("payload_point"), nb::arg("gravity"), nb::arg("q"), nb::arg("sensitivities"),
             "Deflection (samples, n, 3), compliance (samples, d, d), gravity regressor (samples, d, 4 n), its coupling with geometry "
             "(samples, d, 6 n), largest last Newton step (rad).")
        .def("torque_regressor", &torques, nb::arg("geometry"), nb::arg("gravity"), nb::arg("q"), nb::arg("dq"), nb::arg("ddq"),
             nb::arg("places"), nb::arg("out").noconvert(),
             "Joint torques by mass, first moment and inertia of every link, into the rows of out (·, samples) that places (n, 10 n) names; "
             "-1 leaves an entry out, and those that are zero by structure are not written.")
        .def("torque_regressor_adjoint", &torques_adjoint, nb::arg("geometry"), nb::arg("gravity"), nb::arg("q"), nb::arg("dq"), nb::arg("ddq"),
             nb::arg("places"), nb::arg("weights"),
             "Derivatives (3, samples, n) by q, dq and ddq of a scalar whose derivatives by the entries of the torque regressor are the rows "
             "of weights (·, samples) that places (n, 10 n) names; -1 stands for zeros, and entries that are zero by structure are not read.");
}
