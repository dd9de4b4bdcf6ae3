// Python's view of triangles' inverses and sums of rows.
#include "linear_algebra.hpp"

#include <nanobind/nanobind.h>

#include <algorithm>

#include "arrays.hpp"
#include "bindings.hpp"

namespace nb = nanobind;
using namespace flexcal;

namespace {

void triangular_inverse(nb::handle lower_, nb::handle inverse_) {
    const std::size_t n = reals(lower_, {any, any}, "lower").shape(0);
    const auto lower = reals(lower_, {n, n}, "lower");
    const auto inverse = written_reals(inverse_, {n, n}, "inverse");
    nb::gil_scoped_release release;
    invert_triangle(lower.data(), inverse.data(), static_cast<std::ptrdiff_t>(n));
}

void add_selected(nb::handle to_, nb::handle source_, nb::handle values_, nb::handle sums_) {
    const auto to = indices(to_, {any}, "to");
    const auto source = indices(source_, {to.shape(0)}, "source");
    const auto values = reals(values_, {any, any}, "values");
    const auto sums = written_reals(sums_, {any, values.shape(1)}, "sums");
    const auto outside = [](const auto& numbers, std::size_t rows) {
        return std::any_of(numbers.data(), numbers.data() + numbers.shape(0),
                           [rows](std::int64_t number) { return number < 0 || static_cast<std::size_t>(number) >= rows; });
    };
    if (outside(to, sums.shape(0)) || outside(source, values.shape(0))) throw nb::value_error("a number of a row is outside its array");
    nb::gil_scoped_release release;
    add_rows(to.data(), source.data(), static_cast<std::ptrdiff_t>(to.shape(0)), values.data(), static_cast<std::ptrdiff_t>(values.shape(1)), sums.data());
}

}  // namespace

void bind_linear_algebra(nb::module_& m) {
    m.def("triangular_inverse", &triangular_inverse, nb::arg("lower"), nb::arg("inverse"), "Into inverse (n, n) that of the lower triangle of a matrix (n, n).");
    m.def("add_selected", &add_selected, nb::arg("to"), nb::arg("source"), nb::arg("values"), nb::arg("sums"),
          "Add to rows `to` (E,) of sums (R, k) the rows `source` (E,) of values (C, k), one after the other.");
}
